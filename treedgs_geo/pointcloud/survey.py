"""Where a cloud's points lie, counted in coarse steps: its extent, single points far off, a sample."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from .cloud import extent, in_box, slices

#: Width of a step along an axis, metres.
STEP_M = 10.0
#: A group of points is far off when the empty space before it is wider than this along x or y, or along z, and than
#: :data:`GAP_SPANS` times the extent of the main group.
GAP_XY_M, GAP_Z_M, GAP_SPANS = 200.0, 100.0, 2.0
#: Points far off that are at most this share of all, or this many, are strays; more are a second group.
STRAY_SHARE, FEW_STRAYS = 0.01, 5
#: Steps from zero that are distinguished.
_FARTHEST = 1e15
#: Points that the sample holds at most, and half as many at least in a cloud of more.
SAMPLE_POINTS = 400_000


@dataclass(frozen=True)
class Extent:
    """Where points lie.

    low, high: (3,) the box of the points without the strays, project coordinates. n_points: all. n_strays: points
    far outside the box along one axis, to be left out (of the axis with most; n_strays_most: all axes' together).
    n_groups_off: points of other groups that are too many to be strays (their space is part of the box). reach_m: how
    far the farthest stray or group lies from the main group, metres.
    """

    low: np.ndarray
    high: np.ndarray
    n_points: int
    n_strays: int = 0
    n_strays_most: int = 0
    n_groups_off: int = 0
    reach_m: float = 0.0

    def holds(self, xyz: np.ndarray) -> np.ndarray:
        """(N,) bool: which of (N, 3) points lie in the box or near it, as points classified as noise may."""
        margin = np.array([GAP_XY_M, GAP_XY_M, GAP_Z_M]) / 2
        return np.asarray(in_box(xyz, self.low - margin, self.high + margin))


def survey(xyz: np.ndarray) -> Extent:
    """The box of the main group of (N, 3) finite points, and what lies far from it."""
    low, high = extent(xyz) if len(xyz) else (np.full(3, np.inf), np.full(3, -np.inf))
    if not len(xyz):
        return Extent(low, high, 0)
    whole, away_along, reach = (low.copy(), high.copy()), [], 0.0
    for axis in range(3):
        step, count = _steps(xyz[:, axis])
        first, last, away = _main_range(step, count, GAP_Z_M if axis == 2 else GAP_XY_M)
        away_along.append(int(count[(step < first) | (step > last)].sum()))
        reach = max(reach, away)
        low[axis], high[axis] = max(low[axis], first * STEP_M), min(high[axis], (last + 1) * STEP_M)
    outside, most = sum(away_along), max(away_along)
    if not outside:
        return Extent(low, high, len(xyz))
    if outside > max(STRAY_SHARE * len(xyz), FEW_STRAYS):
        return Extent(*whole, len(xyz), n_groups_off=most, reach_m=reach)
    return Extent(low, high, len(xyz), most, outside, reach_m=reach)


def sample(xyz: np.ndarray, within: Extent) -> np.ndarray:
    """(M, 3) every so-many-th of (N, 3) points, those in the box."""
    stride = 1
    while len(xyz) > SAMPLE_POINTS * stride:
        stride *= 2
    points = np.ascontiguousarray(xyz[::stride])
    return points[within.holds(points)]


def _steps(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The steps in which (N,) coordinates along an axis lie, sorted, and how many in each."""
    found: Counter[int] = Counter()
    for part in slices(len(values)):
        step = np.floor(np.clip(values[part] / STEP_M, -_FARTHEST, _FARTHEST)).astype(np.int64)
        first = int(step.min())
        if int(step.max()) - first > 10 * len(step) + 1000:
            there, count = np.unique(step, return_counts=True)
        else:
            count = np.bincount(step - first)
            there = np.flatnonzero(count)
            count, there = count[there], there + first
        found.update(dict(zip(there.tolist(), count.tolist(), strict=True)))
    steps = np.array(sorted(found))
    return steps, np.array([found[step] for step in steps.tolist()])


def _main_range(step: np.ndarray, count: np.ndarray, gap_m: float) -> tuple[int, int, float]:
    """First and last step of the main group along an axis, and how far away the farthest other point lies, metres."""
    starts = np.flatnonzero(np.r_[True, np.diff(step) * STEP_M > gap_m])
    ends = np.r_[starts[1:], len(step)] - 1
    totals = np.add.reduceat(count, starts)
    left = right = int(np.argmax(totals))
    while True:
        first, last = int(step[starts[left]]), int(step[ends[right]])
        allowed = max(gap_m, GAP_SPANS * (last - first + 1) * STEP_M)
        if left > 0 and (first - step[ends[left - 1]]) * STEP_M <= allowed:
            left -= 1
        elif right < len(starts) - 1 and (step[starts[right + 1]] - last) * STEP_M <= allowed:
            right += 1
        else:
            return first, last, float(max(first - step[0], step[-1] - last)) * STEP_M
