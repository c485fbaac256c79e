"""``tree_id`` for points of a cloud of any size: through a grid of the stems, at the same cost for every point."""

from __future__ import annotations

import numpy as np

from .segment import SENSORS, StemMap, _tolerance

_CELL_M = 0.5


class Labeller:
    """Stems of a :class:`StemMap` spread over a grid; the same rule as :func:`.segment.label_points`."""

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
                first = np.floor((middle - reach) / _CELL_M).astype(int)
                last = np.floor((middle + reach) / _CELL_M).astype(int)
                cells += [(i, j, len(rows)) for i in range(first[0], last[0] + 1) for j in range(first[1], last[1] + 1)]
                rows.append([*piece.vector, piece.h_ref, low, high, *middle, reach, _tolerance(piece, sensor), number])
        self.pieces = np.array(rows, float).reshape(-1, 16)
        table = np.array(cells, np.int64).reshape(-1, 3)
        self.low = table[:, :2].min(axis=0) if len(table) else np.zeros(2, np.int64)
        self.span = table[:, :2].max(axis=0) - self.low + 1 if len(table) else np.zeros(2, np.int64)
        key = (table[:, 0] - self.low[0]) * self.span[1] + table[:, 1] - self.low[1]
        order = np.argsort(key, kind="stable")
        self.key, self.piece = key[order], table[order, 2]

    def __call__(self, xyz: np.ndarray, height: np.ndarray) -> np.ndarray:
        """(N,) int32 tree ids of (N, 3) project coordinates at (N,) heights above ground; 0 = no stem."""
        label = np.zeros(len(xyz), np.int32)
        if not len(self.key):
            return label
        xy = xyz[:, :2] - self.stems.origin
        cell = np.floor(xy / _CELL_M).astype(np.int64) - self.low
        with np.errstate(invalid="ignore"):
            inside = ((cell >= 0) & (cell < self.span)).all(axis=1) & (height >= 0.15)
        where = np.flatnonzero(inside)
        key = cell[where, 0] * self.span[1] + cell[where, 1]
        start, end = np.searchsorted(self.key, key, "left"), np.searchsorted(self.key, key, "right")
        count = end - start
        where, start, count = where[count > 0], start[count > 0], count[count > 0]
        point = np.repeat(where, count)
        piece = self.piece[np.repeat(start - np.r_[0, np.cumsum(count)[:-1]], count) + np.arange(count.sum())]
        h = height[point]
        p = self.pieces[piece]
        keep = (h >= p[:, 9]) & (h < p[:, 10])
        keep &= np.hypot(xy[point, 0] - p[:, 11], xy[point, 1] - p[:, 12]) <= p[:, 13]
        point, piece, p, h = point[keep], piece[keep], p[keep], h[keep]
        residual = _residuals(xy[point], h, p)
        keep = residual < p[:, 14] + 0.01
        point, piece, away = point[keep], piece[keep], np.abs(residual[keep])
        order = np.lexsort((piece, away, point))
        first = np.r_[True, np.diff(point[order]) != 0] if len(order) else np.zeros(0, bool)
        chosen = order[first]
        label[point[chosen]] = self.pieces[piece[chosen], 15]
        return label


def _residuals(xy: np.ndarray, h: np.ndarray, p: np.ndarray) -> np.ndarray:
    """(K,) distance of each point from its own piece's bark, positive outside (as :meth:`.cone.Cone.residuals`)."""
    t = h - p[:, 8]
    sx, sy = p[:, 2] + p[:, 6] * t, p[:, 3] + p[:, 7] * t
    length = np.sqrt(1.0 + sx * sx + sy * sy)
    ex = xy[:, 0] - p[:, 0] - (p[:, 2] + 0.5 * p[:, 6] * t) * t
    ey = xy[:, 1] - p[:, 1] - (p[:, 3] + 0.5 * p[:, 7] * t) * t
    along = (ex * sx + ey * sy) / length
    d = np.sqrt(np.maximum(ex * ex + ey * ey - along * along, 1e-12))
    return d - (p[:, 4] + p[:, 5] * (t + along / length))
