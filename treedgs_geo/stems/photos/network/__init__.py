"""The segmentation network: what it sees in a photo, in pieces of photos, and as silhouettes."""
