"""Tree heights from a cloud that reaches the crowns."""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.spatial import cKDTree

from ..segmentation.nearby import Nearby

#: Points above this are looked at, and a cloud whose tops are below that has no crowns, m.
_LOWEST_M, _LEAST_M = 3.0, 5.0


def tree_heights(
    xyz: np.ndarray, height: np.ndarray, feet: np.ndarray, slopes: np.ndarray, gap_m: float = 3.0
) -> np.ndarray:
    """(T,) metres above ground of each tree's top; NaN where the cloud stops below the crowns.

    height: (N,) above ground. feet: (T, 2) axis at the ground, slopes: (T, 2) axis slopes. A point above 3 m belongs to
    the tree whose axis, followed up with half its lean, is nearest and within reach: 1.2 m in a stand (a neighbour's
    crown hangs over a suppressed tree), up to 4 m where no neighbour is near. The top is the third highest point below
    the first vertical gap of ``gap_m``.
    """
    tops = np.full(len(feet), np.nan)
    if len(feet) == 0:
        return tops
    count, low, highest = _upper(height)
    if count < 50 or low > np.floor(0.99 * (count - 1)) and np.percentile(height[height > _LOWEST_M], 99) < _LEAST_M:
        return tops
    spacing = cKDTree(feet).query(feet, k=2)[0][:, 1] if len(feet) > 1 else np.array([np.inf])
    reach = np.clip(0.3 * spacing, 1.2, 4.0)
    # No axis strays farther from its foot than this, and no point is an axis's that is farther than its reach.
    drift = float(np.hypot(*slopes.T).max()) * (0.5 * (min(np.floor(highest), 100.0) - 3.0) + 3.0)
    near = Nearby(np.column_stack([feet, np.zeros(len(feet))]), cell_m=max(float(reach.max()) + drift, 1.0))
    heights, starts = _owned(
        xyz,
        np.ascontiguousarray(height, dtype=float),
        count,
        feet,
        slopes,
        reach,
        near.starts,
        near.order,
        near.low,
        near.cell_m,
        near.span,
    )
    for tree in range(len(feet)):
        own = heights[starts[tree] : starts[tree + 1]]
        if len(own) < 20:
            continue
        own.sort()
        gaps = np.flatnonzero(np.diff(own) > gap_m)
        own = own[: gaps[0] + 1] if len(gaps) else own
        if len(own) >= 20 and own[-1] > _LEAST_M:
            tops[tree] = own[-3]
    return tops


@njit(cache=True)
def _upper(height):  # pragma: no cover - compiled
    """How many heights are above :data:`_LOWEST_M`, how many of those below :data:`_LEAST_M`, and the highest."""
    count, low, highest = 0, 0, 0.0
    for h in height:
        if h > _LOWEST_M:
            count += 1
            low += h < _LEAST_M
            highest = max(highest, h)
    return count, low, highest


@njit(cache=True)
def _owned(xyz, height, count, feet, slopes, reach, starts, order, low, cell_m, span):  # pragma: no cover - compiled
    """The heights of the ``count`` points above :data:`_LOWEST_M` that are an axis's, tree by tree, and where those of
    each tree begin. A point is its nearest axis's at its layer, if within that one's reach; axes are compared layer by
    layer."""
    owner, own = np.empty(count, np.int32), np.empty(count)
    begin = np.zeros(feet.shape[0] + 1, np.int64)
    taken = 0
    for m in range(xyz.shape[0]):
        h = height[m]
        if not h > _LOWEST_M:
            continue
        x, y = xyz[m, 0], xyz[m, 1]
        up = 0.5 * (min(max(np.floor(h), 3.0), 100.0) - 3.0) + 3.0
        i, j = int(np.floor((x - low[0]) / cell_m)), int(np.floor((y - low[1]) / cell_m))
        best, nearest = np.inf, -1
        for a in range(max(i - 1, 0), min(i + 1, span[0] - 1) + 1):
            for b in range(max(j - 1, 0), min(j + 1, span[1] - 1) + 1):
                for k in range(starts[a * span[1] + b], starts[a * span[1] + b + 1]):
                    tree = order[k]
                    dx = x - feet[tree, 0] - slopes[tree, 0] * up
                    dy = y - feet[tree, 1] - slopes[tree, 1] * up
                    if dx * dx + dy * dy < best:
                        best, nearest = dx * dx + dy * dy, tree
        if nearest >= 0 and best <= reach[nearest] ** 2:
            owner[taken], own[taken] = nearest, h
            begin[nearest + 1] += 1
            taken += 1
    begin = np.cumsum(begin)
    place, heights = begin.copy(), np.empty(taken)
    for m in range(taken):
        heights[place[owner[m]]] = own[m]
        place[owner[m]] += 1
    return heights, begin
