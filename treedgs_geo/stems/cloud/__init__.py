"""Trees from point clouds: stems segmented, then measured."""
