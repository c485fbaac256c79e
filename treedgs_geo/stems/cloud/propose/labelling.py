"""``tree_id`` for points of a cloud of any size: through a grid of the stems, at the same cost for every point."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from ....core.machine import in_threads
from ....pointcloud.cloud import slices
from ...geometry.cone_kernels import distance
from .sensors import SENSORS, tolerance

if TYPE_CHECKING:
    from .segment import StemMap

_CELL_M = 0.5


class Labeller:
    """Stems of a :class:`StemMap` spread over a grid; points inside a stem's bark or within its noise
    outside are that stem's, the nearest bark wins."""

    def __init__(self, stems: StemMap) -> None:
        self.stems = stems
        rows: list[list[float]] = []
        cells: list[tuple[int, int, int]] = []
        sensor = SENSORS[stems.sensor]
        for number, stem in enumerate(stems.stems, start=1):
            pieces = (stem.cone, *stem.pieces)
            edges = [0.15] + [0.5 * (a.h_ref + b.h_ref) for a, b in zip(pieces[:-1], pieces[1:], strict=True)]
            edges.append(pieces[-1].h_ref + (2.2 if len(pieces) == 1 else 0.5))
            for piece, low, high in zip(pieces, edges[:-1], edges[1:], strict=True):
                middle = piece.centre(0.5 * (low + high))
                reach = float(piece.radius(low)) + 0.1 + 0.5 * (high - low) * np.hypot(piece.dx, piece.dy)
                if reach <= 0:
                    continue
                first, last = (np.floor((middle + side) / _CELL_M).astype(int) for side in (-reach, reach))
                cells += [(i, j, len(rows)) for i in range(first[0], last[0] + 1) for j in range(first[1], last[1] + 1)]
                rows.append([*piece.vector, piece.h_ref, low, high, *middle, reach, tolerance(piece, sensor), number])
        self.pieces = np.array(rows, float).reshape(-1, 16)
        table = np.array(cells, np.int64).reshape(-1, 3)
        self.low = table[:, :2].min(axis=0) if len(table) else np.zeros(2, np.int64)
        self.span = table[:, :2].max(axis=0) - self.low + 1 if len(table) else np.zeros(2, np.int64)
        key = (table[:, 0] - self.low[0]) * self.span[1] + table[:, 1] - self.low[1]
        self.piece = table[np.argsort(key, kind="stable"), 2]
        self.starts = np.searchsorted(np.sort(key), np.arange(self.span.prod() + 1))

    def __call__(self, xyz: np.ndarray, height: np.ndarray) -> np.ndarray:
        """(N,) int32 tree ids of (N, 3) project coordinates at (N,) heights above ground; 0 = no stem."""
        label = np.zeros(len(xyz), np.int32)
        if not len(self.piece):
            return label
        grid = self.stems.origin, self.low, self.span, self.starts, self.piece, self.pieces
        height = np.asarray(height, float)
        for _ in in_threads(lambda part: _label(label[part], xyz[part], height[part], *grid), list(slices(len(xyz)))):
            pass
        return label


@njit(cache=True, nogil=True)
def _label(label, xyz, height, origin, low, span, starts, piece, pieces):  # pragma: no cover - compiled
    for m in range(xyz.shape[0]):
        h = height[m]
        if not h >= 0.15:
            continue
        x, y = xyz[m, 0] - origin[0], xyz[m, 1] - origin[1]
        i, j = int(np.floor(x / _CELL_M)) - low[0], int(np.floor(y / _CELL_M)) - low[1]
        if i < 0 or j < 0 or i >= span[0] or j >= span[1]:
            continue
        nearest = np.inf
        for k in range(starts[i * span[1] + j], starts[i * span[1] + j + 1]):
            p = pieces[piece[k]]
            if h < p[9] or h >= p[10] or (x - p[11]) ** 2 + (y - p[12]) ** 2 > p[13] ** 2:
                continue
            e = distance(x, y, h, p, p[8])
            if e < p[14] + 0.01 and abs(e) < nearest:
                nearest = abs(e)
                label[m] = int(p[15])
