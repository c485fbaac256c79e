"""Stems found and measured by three routes (photos, clouds, splats), and what they share."""
