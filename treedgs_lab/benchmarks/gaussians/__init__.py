"""Gaussians: stem primitives and the published method."""
