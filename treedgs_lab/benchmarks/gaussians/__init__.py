"""Gaussians: stem primitives, free Gaussians, whole scenes."""
