"""Do the lowest points of the stems lie at their feet? Asked where a cloud has lost its ground.

Programs that filter the ground out leave the stems from a few decimetres up, with their butt swell: breast height is
then known to about half a metre. A clip higher up leaves tapering stems, which say nothing about where they began.
"""

from __future__ import annotations

import numpy as np

from ....pointcloud.cloud import grouped
from ....terrain.cloud_ground import LOWEST_SE_M, CloudGround
from ...geometry.circles import fit_circle
from ...quality.ground import with_ground_error
from ...quality.tree import Tree
from ..propose.nearby import Nearby

#: Rings at the lowest points and on the stem above them: lower edge of each, and their height, m.
_LOWEST_M, _ABOVE_M, _RING_M = 0.05, (1.0, 1.6), 0.15
#: A ring with so many points, over so much of the circumference, and with this share of the points on it, is one.
_MIN_POINTS, _MIN_ARC_DEG, _MIN_SHARE = 60, 240.0, 0.5
#: The lowest ring of a swollen foot over what the stem above it would have there, and that of a stem which surely does
#: not begin there. Terrestrial clouds: 1.14 to 1.18 (medians of plots, whole or with the ground filtered out), 0.9 to
#: 1.05 (clipped 0.5 to 4 m above the ground).
SWOLLEN, STRAIGHT = 1.07, 1.055
#: So many stems of a plot have to show it.
LEAST_STEMS = 3
#: The ground lies so far below the lowest points of stems (1 sd), m: of those that show their feet there, and of those
#: that show that they do not begin there.
FEET_SE_M, CLIPPED_SE_M = 0.3, 2.0
#: A stem's foot takes up this much more than its radius at breast height (butt swell, lean), and so much in all where
#: the radius is not known, metres.
FOOT_M, USUAL_FOOT_M = 0.15, 0.30


def foot_swell(xyz: np.ndarray, height: np.ndarray, xy: np.ndarray, radius_m: np.ndarray) -> tuple[float, int]:
    """``(swell, stems)``: how much wider stems are at their lowest points than the stem above would be there (median,
    NaN where none shows rings), and how many show it.

    xyz: (N, 3) points, height: (N,) metres above the surface through the stems' lowest points. xy, radius_m: (K, 2)
    places and (K,) radii of the stems at breast height above it, NaN where a stem has none.
    """
    low = np.flatnonzero((height > 0) & (height < _ABOVE_M[-1] + _RING_M))
    near = Nearby(xyz[low])
    ratios = []
    for place, radius in zip(xy[np.isfinite(radius_m)], radius_m[np.isfinite(radius_m)], strict=True):
        own = low[near.within(place, 2.0 * radius + 0.1)]
        offset = xyz[own, :2] - place
        foot, lower, upper = (
            _ring(offset[(height[own] > base) & (height[own] < base + _RING_M)], radius)
            for base in (_LOWEST_M, *_ABOVE_M)
        )
        expected = lower + (upper - lower) * (_LOWEST_M - _ABOVE_M[0]) / (_ABOVE_M[1] - _ABOVE_M[0])
        if np.isfinite(foot + expected):
            ratios.append(foot / expected)
    return (float(np.median(ratios)) if ratios else np.nan), len(ratios)


def _ring(points: np.ndarray, radius: float) -> float:
    """Radius of the ring that (N, 2) points form about the origin; NaN where they form none."""
    points = points[:: max(len(points) // 800, 1)]
    if len(points) < _MIN_POINTS:
        return np.nan
    found = fit_circle(points, noise_m=0.01, start=np.array([0.0, 0.0, radius]))
    if found is None or found.arc_deg < _MIN_ARC_DEG or found.points < _MIN_SHARE * len(points):
        return np.nan
    return found.r


def with_ground(trees: list[Tree], ground: CloudGround, xyz: np.ndarray) -> list[Tree]:
    """Trees measured in (N, 3) points, whose intervals and flags allow for how well the ground under each is known."""
    xy = np.array([[tree.x, tree.y] for tree in trees]).reshape(-1, 2)
    radius_m = np.array([np.nan if tree.dbh_cm is None else tree.dbh_cm / 200 for tree in trees])
    return [
        with_ground_error(tree, float(se_m), "points")
        for tree, se_m in zip(trees, stem_ground_se(ground, xy, radius_m, xyz), strict=True)
    ]


def stem_ground_se(ground: CloudGround, xy: np.ndarray, radius_m: np.ndarray, xyz: np.ndarray) -> np.ndarray:
    """(K,) standard error of the ground's height, metres, at (K, 2) stems with (K,) radii (NaN: not known) in (N, 3)
    points."""
    se_m = ground.se_m(xy, np.where(np.isfinite(radius_m), radius_m + FOOT_M, USUAL_FOOT_M))
    unsure = se_m >= LOWEST_SE_M
    if ground.given is not None or not unsure.any():
        return se_m
    height = xyz[:, 2] - ground.dtm.height(xyz[:, 0], xyz[:, 1])
    swell, stems = foot_swell(xyz, height, xy, radius_m)
    if stems < (1 if ground.lowest else LEAST_STEMS):
        return se_m
    told = FEET_SE_M if swell >= SWOLLEN else CLIPPED_SE_M if swell < STRAIGHT else LOWEST_SE_M
    return np.where(unsure, told, se_m)


def stem_feet(xyz: np.ndarray, tree_id: np.ndarray, height: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``(ids, (K, 2) places, (K,) radii)`` of the trees in (N, 3) labelled points: the middle of each one's points
    from 1 to 2 m (of all, where it has none there), and their median distance from it. height: (N,) above the ground.
    """
    ids, groups = grouped(tree_id)
    places, radii = np.empty((len(ids), 2)), np.empty(len(ids))
    for k, group in enumerate(groups):
        low = group[(height[group] > 1.0) & (height[group] < 2.0)]
        xy = xyz[low if len(low) else group, :2]
        places[k] = 0.5 * (np.percentile(xy, 2, axis=0) + np.percentile(xy, 98, axis=0))
        radii[k] = np.median(np.hypot(*(xy - places[k]).T))
    return ids, places, radii
