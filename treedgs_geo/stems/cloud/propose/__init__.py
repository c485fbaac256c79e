"""Stems in point clouds: candidates, cones grown and judged, labels; field stems and external segmenters."""
