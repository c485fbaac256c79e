"""Where a cloud's points lie, counted in coarse steps while it is read: its extent, single points far off, a sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .cloud import extent, in_box

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
    """What a :class:`Survey` found.

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


class Survey:
    """Fed with a cloud piece by piece; memory is that of the sample and of the occupied steps along each axis."""

    def __init__(self) -> None:
        self.n_points = 0
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)
        self._steps: list[tuple[np.ndarray, np.ndarray]] = [(np.empty(0, np.int64), np.empty(0, np.int64))] * 3
        self._stride, self._next = 1, 0
        self._parts: list[np.ndarray] = []
        self._sampled = 0

    def add(self, xyz: np.ndarray) -> None:
        """Count (N, 3) finite points."""
        if not len(xyz):
            return
        low, high = extent(np.asarray(xyz, float))
        self._low, self._high = np.minimum(self._low, low), np.maximum(self._high, high)
        for axis in range(3):
            step, count = _counted(np.floor(np.clip(xyz[:, axis] / STEP_M, -_FARTHEST, _FARTHEST)).astype(np.int64))
            known, before = self._steps[axis]
            both, place = np.unique(np.concatenate([known, step]), return_inverse=True)
            total = np.bincount(place, np.concatenate([before, count]), len(both)).astype(np.int64)
            self._steps[axis] = both, total
        part = xyz[self._next :: self._stride]
        self._next = (self._next - len(xyz)) % self._stride
        self._parts.append(part.copy())
        self._sampled += len(part)
        self.n_points += len(xyz)
        while self._sampled > SAMPLE_POINTS:
            self._parts = [np.concatenate(self._parts)[::2]]
            self._sampled = len(self._parts[0])
            self._stride *= 2

    def sample(self, extent: Extent | None = None) -> np.ndarray:
        """(M, 3) every so-many-th point, those in the box of ``extent``."""
        points = np.concatenate(self._parts) if self._parts else np.empty((0, 3))
        return points if extent is None else points[extent.holds(points)]

    def extent(self) -> Extent:
        """The box of the main group, and what lies far from it."""
        low, high = self._low.copy(), self._high.copy()
        if not self.n_points:
            return Extent(low, high, 0)
        away_along, reach = [], 0.0
        for axis in range(3):
            first, last, away = _main_range(*self._steps[axis], GAP_Z_M if axis == 2 else GAP_XY_M)
            step, count = self._steps[axis]
            away_along.append(int(count[(step < first) | (step > last)].sum()))
            reach = max(reach, away)
            low[axis], high[axis] = max(low[axis], first * STEP_M), min(high[axis], (last + 1) * STEP_M)
        outside = sum(away_along)
        if not outside:
            return Extent(low, high, self.n_points)
        if outside > max(STRAY_SHARE * self.n_points, FEW_STRAYS):
            return Extent(
                self._low.copy(), self._high.copy(), self.n_points, n_groups_off=max(away_along), reach_m=reach
            )
        return Extent(low, high, self.n_points, max(away_along), outside, reach_m=reach)


def _counted(steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The steps that occur, sorted, and how often each does."""
    first = int(steps.min())
    if int(steps.max()) - first > 10 * len(steps) + 1000:
        return np.unique(steps, return_counts=True)
    count = np.bincount(steps - first)
    there = np.flatnonzero(count)
    return there + first, count[there]


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
