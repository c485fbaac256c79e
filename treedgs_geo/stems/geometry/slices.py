"""Horizontal slices of a stem (eq:slicing), straight down or sheared along a leaning axis."""

from __future__ import annotations

import numpy as np

from .cone import Cone


def slice_heights(low_m: float, high_m: float, spacing_m: float) -> np.ndarray:
    """Slice centres: multiples of ``spacing_m`` from the ground, within [low, high]."""
    first = int(np.ceil(low_m / spacing_m - 1e-9))
    last = int(np.floor(high_m / spacing_m + 1e-9))
    return np.arange(first, last + 1) * spacing_m


def slice_index(heights: np.ndarray, centres: np.ndarray, thickness_m: float) -> list[np.ndarray]:
    """For each slice centre the indices of the points with ``abs(h - h_s) <= thickness / 2``."""
    order = np.argsort(heights, kind="stable")
    ordered = heights[order]
    low = np.searchsorted(ordered, centres - thickness_m / 2 - 1e-12, side="left")
    high = np.searchsorted(ordered, centres + thickness_m / 2 + 1e-12, side="right")
    return [np.sort(order[a:b]) for a, b in zip(low, high, strict=True)]


def across_axis(points: np.ndarray, cone: Cone) -> np.ndarray:
    """(N, 2) coordinates in the plane across the cone's axis, taper taken out to the axis foot: (N, 3) -> (N, 2).

    Points are sheared along the axis to one plane and the lean's stretch is undone, so that a leaning round stem shows
    as a circle about the origin.
    """
    offset = points[:, :2] - cone.centre(points[:, 2])
    slope = np.hypot(cone.dx, cone.dy)
    if slope < 1e-9:
        return offset
    direction = np.array([cone.dx, cone.dy]) / slope
    along = offset @ direction
    return offset + np.outer(along * (np.cos(np.arctan(slope)) - 1.0), direction)
