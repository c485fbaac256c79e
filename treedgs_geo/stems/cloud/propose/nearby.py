"""Points near a place on the ground: a grid over their xy, built in two passes and asked without a tree."""

from __future__ import annotations

import numpy as np
from numba import njit

from ....pointcloud.cloud import by_key, extent

_CELL_M = 0.5
#: Grids of more cells than this (and than four a point) open their cells.
_MOST_CELLS = 4_000_000


class Nearby:
    """(N, 3) points by cells of 0.5 m or more; see :meth:`within`."""

    def __init__(self, points: np.ndarray) -> None:
        self.points = np.ascontiguousarray(points, dtype=float)
        low, high = extent(self.points[:, :2]) if len(points) else (np.zeros(2), np.zeros(2))
        self.low: np.ndarray = low
        self.cell_m = _CELL_M
        while np.prod(np.floor((high - self.low) / self.cell_m) + 1) > max(_MOST_CELLS, 4 * len(points)):
            self.cell_m *= 2
        self.span = np.floor((high - self.low) / self.cell_m).astype(np.int64) + 1
        self.order, self.starts = by_key(_cells(self.points, self.low, self.cell_m, self.span), np.prod(self.span))
        self.ordered = self.points[self.order]

    def within(self, xy: np.ndarray, reach_m: float, low_m: float = -np.inf, high_m: float = np.inf) -> np.ndarray:
        """Indices, ascending, of the (N, 3) points at most ``reach_m`` from (2,) ``xy``, low_m < height < high_m."""
        about = float(xy[0]), float(xy[1]), float(reach_m), float(low_m), float(high_m)
        found = _within(self.ordered, self.starts, self.order, self.low, self.cell_m, self.span, *about)
        found.sort()
        return found


@njit(cache=True, nogil=True)
def _cells(points, low, cell_m, span):  # pragma: no cover - compiled
    key = np.empty(points.shape[0], np.int32)
    for m in range(points.shape[0]):
        key[m] = int((points[m, 0] - low[0]) / cell_m) * span[1] + int((points[m, 1] - low[1]) / cell_m)
    return key


@njit(cache=True, nogil=True)
def _within(points, starts, order, low, cell_m, span, x, y, reach, bottom, top):  # pragma: no cover - compiled
    """:meth:`Nearby.within` by cell; points: in the order of the cells, as their neighbours lie in memory."""
    i0, i1 = max(int(np.floor((x - reach - low[0]) / cell_m)), 0), int(np.floor((x + reach - low[0]) / cell_m))
    j0, j1 = max(int(np.floor((y - reach - low[1]) / cell_m)), 0), int(np.floor((y + reach - low[1]) / cell_m))
    i1, j1 = min(i1, span[0] - 1), min(j1, span[1] - 1)
    most = 0
    for i in range(i0, i1 + 1):
        if j1 >= j0:
            most += starts[i * span[1] + j1 + 1] - starts[i * span[1] + j0]
    found = np.empty(most, np.int64)
    count = 0
    for i in range(i0, i1 + 1):
        if j1 < j0:
            break
        # The cells of a row follow one another.
        for k in range(starts[i * span[1] + j0], starts[i * span[1] + j1 + 1]):
            dx, dy = points[k, 0] - x, points[k, 1] - y
            if dx * dx + dy * dy <= reach * reach and bottom < points[k, 2] < top:
                found[count] = order[k]
                count += 1
    return found[:count].copy()
