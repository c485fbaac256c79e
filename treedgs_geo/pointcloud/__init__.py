"""LAS/LAZ clouds in and out, with their CRS and extra dimensions."""
