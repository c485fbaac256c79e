"""Do the lowest points of the stems lie at their feet? Asked where a cloud has lost its ground.

Programs that filter the ground out leave the stems from a few decimetres up, with their butt swell: breast height is
then known to about half a metre. A clip higher up leaves tapering stems, which say nothing about where they began.
"""

from __future__ import annotations

import numpy as np

from ..stems.nearby import Nearby
from .circles import fit_circle

#: Rings at the lowest points and on the stem above them: lower edge of each, and their height, m.
_LOWEST_M, _ABOVE_M, _RING_M = 0.05, (1.0, 1.6), 0.15
#: A ring with so many points, over so much of the circumference, and with this share of the points on it, is one.
_LEAST_POINTS, _LEAST_ARC_DEG, _LEAST_SHARE = 60, 240.0, 0.5
#: The lowest ring of a swollen foot over what the stem above it would have there, and that of a stem which surely does
#: not begin there. Terrestrial clouds: 1.14 to 1.18 (medians of plots, whole or with the ground filtered out), 0.9 to
#: 1.05 (clipped 0.5 to 4 m above the ground).
SWOLLEN, STRAIGHT = 1.07, 1.055
#: So many stems of a plot have to show it.
LEAST_STEMS = 3


def foot_swell(xyz: np.ndarray, height: np.ndarray, xy: np.ndarray, radius_m: np.ndarray) -> tuple[float, int]:
    """``(swell, stems)``: how much wider stems are at their lowest points than the stem above would be there (median,
    NaN where none shows rings), and how many show it.

    xyz: (N, 3) points, height: (N,) metres above the surface through the stems' lowest points. xy, radius_m: (K, 2)
    places and (K,) radii of the stems at breast height above it, NaN where a stem has none.
    """
    with np.errstate(invalid="ignore"):
        low = np.flatnonzero((height > 0) & (height < _ABOVE_M[-1] + _RING_M))
    near = Nearby(xyz[low])
    ratios = []
    for place, radius in zip(xy[np.isfinite(radius_m)], radius_m[np.isfinite(radius_m)], strict=True):
        own = low[near.within(place, 2.0 * radius + 0.1)]
        offset = xyz[own, :2] - place
        radii = [
            _ring(offset[(height[own] > base) & (height[own] < base + _RING_M)], radius)
            for base in (_LOWEST_M, *_ABOVE_M)
        ]
        foot, lower, upper = radii
        expected = lower + (upper - lower) * (_LOWEST_M - _ABOVE_M[0]) / (_ABOVE_M[1] - _ABOVE_M[0])
        if np.isfinite(foot + expected):
            ratios.append(foot / expected)
    return (float(np.median(ratios)) if ratios else np.nan), len(ratios)


def _ring(points: np.ndarray, radius: float) -> float:
    """Radius of the ring that (N, 2) points form about the origin; NaN where they form none."""
    points = points[:: max(len(points) // 800, 1)]
    if len(points) < _LEAST_POINTS:
        return np.nan
    found = fit_circle(points, noise_m=0.01, start=np.array([0.0, 0.0, radius]))
    if found is None or found.arc_deg < _LEAST_ARC_DEG or found.points < _LEAST_SHARE * len(points):
        return np.nan
    return found.r
