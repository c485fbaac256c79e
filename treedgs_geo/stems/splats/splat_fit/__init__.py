"""Gaussians fitted freely to one band of photos: fit, optimiser, controllers."""
