"""Shapes fitted to points: circle, ellipse, cylinder, cone, slices, taper, and their compiled kernels."""
