"""Points near a place on the ground: a grid over their xy, built in two passes and asked without a tree."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..pointcloud.cloud import extent

_CELL_M = 0.5
#: Grids of more cells than this (and than four a point) open their cells.
_MOST_CELLS = 4_000_000


class Nearby:
    """(N, 3) points by cells of ``cell_m`` or more; see :meth:`within`."""

    def __init__(self, points: np.ndarray, cell_m: float = _CELL_M) -> None:
        self.points = np.ascontiguousarray(points, dtype=float)
        low, high = extent(self.points[:, :2]) if len(points) else (np.zeros(2), np.zeros(2))
        self.low: np.ndarray = low
        self.cell_m = cell_m
        while np.prod(np.floor((high - self.low) / self.cell_m) + 1) > max(_MOST_CELLS, 4 * len(points)):
            self.cell_m *= 2
        self.span = np.floor((high - self.low) / self.cell_m).astype(np.int64) + 1
        self.starts, self.order = _sorted_by_cell(self.points, self.low, self.cell_m, self.span)

    def within(self, xy: np.ndarray, reach_m: float, low_m: float = -np.inf, high_m: float = np.inf) -> np.ndarray:
        """Indices, ascending, of the (N, 3) points at most ``reach_m`` from (2,) ``xy``, low_m < height < high_m."""
        return _within(self.points, self.starts, self.order, self.low, self.cell_m, self.span, float(xy[0]),
                       float(xy[1]), float(reach_m), float(low_m), float(high_m))


@njit(cache=True)
def _sorted_by_cell(points, low, cell_m, span):  # pragma: no cover - compiled
    n = points.shape[0]
    key = np.empty(n, np.int64)
    starts = np.zeros(span[0] * span[1] + 1, np.int64)
    for m in range(n):
        key[m] = int((points[m, 0] - low[0]) / cell_m) * span[1] + int((points[m, 1] - low[1]) / cell_m)
        starts[key[m] + 1] += 1
    for c in range(1, starts.shape[0]):
        starts[c] += starts[c - 1]
    place, order = starts.copy(), np.empty(n, np.int64)
    for m in range(n):
        order[place[key[m]]] = m
        place[key[m]] += 1
    return starts, order


@njit(cache=True)
def _within(points, starts, order, low, cell_m, span, x, y, reach, bottom, top):  # pragma: no cover - compiled
    found = np.empty(16, np.int64)
    count = 0
    i0, i1 = max(int(np.floor((x - reach - low[0]) / cell_m)), 0), int(np.floor((x + reach - low[0]) / cell_m))
    j0, j1 = max(int(np.floor((y - reach - low[1]) / cell_m)), 0), int(np.floor((y + reach - low[1]) / cell_m))
    for i in range(i0, min(i1, span[0] - 1) + 1):
        for j in range(j0, min(j1, span[1] - 1) + 1):
            for k in range(starts[i * span[1] + j], starts[i * span[1] + j + 1]):
                m = order[k]
                dx, dy = points[m, 0] - x, points[m, 1] - y
                if dx * dx + dy * dy <= reach * reach and bottom < points[m, 2] < top:
                    if count == found.shape[0]:
                        more = np.empty(2 * count, np.int64)
                        more[:count] = found
                        found = more
                    found[count] = m
                    count += 1
    found = found[:count]
    found.sort()
    return found
