"""Cameras and geotags."""
