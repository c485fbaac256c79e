"""A large cloud read as measuring stems needs it: all points of the stem band, of dense ground and crowns a share.

The file is read twice: for the lowest and highest point of each cell, then for the points. Memory is that of the kept
points. Shares are even over the file's order, so that each flight line and scan keeps its part.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numba import njit

from .cloud import PointCloud, usable
from .files import About, describe_cloud, gathered, iter_cloud

#: Side of the cells, m, and cells at most, which make them larger.
CELL_M, MAX_CELLS = 0.5, 16_000_000
#: Up to here above the lowest point of its cell a point may be ground or what it is told from, beyond the second the
#: crowns begin, and so far below its cell's highest point a point tells the height of trees, m.
LAYER_M, CROWNS_M, TOP_M = 0.35, 15.5, 1.0
#: Of ground and crowns this many points a cell are enough, of the stem band this many; never less than the share.
PLENTY, PLENTY_OF_STEM, LEAST_SHARE = 64, 20_000, 0.2


def read_thinned(path: Path, crs: str | None, attributes: tuple[str, ...], need_crs: bool) -> PointCloud:
    """Like :func:`.files.read_cloud`, of a file whose header gives its extent.

    Raises:
        InputError, CRSError: as :func:`.files.read_cloud`.
    """
    cells = _Cells(describe_cloud(path))
    for piece in iter_cloud(path, None, crs, ("classification", "withheld"), need_crs):
        cells.add(piece)
    return gathered(path, cells.thinned(iter_cloud(path, None, crs, attributes, need_crs)))


class _Cells:
    """low, high: (rows, cols) height of the lowest and highest usable point; count: (rows, cols) points."""

    def __init__(self, about: About) -> None:
        span = np.maximum(about.high - about.low, 1.0)[:2]
        self.corner = np.asarray(about.low[:2], float)
        self.cell_m = max(CELL_M, float(np.sqrt(np.prod(span) / MAX_CELLS)))
        shape = tuple(int(n) for n in np.floor(span / self.cell_m) + 1)
        self.low, self.high = np.full(shape, np.inf, np.float32), np.full(shape, -np.inf, np.float32)
        self.count = np.zeros(shape, np.int32)

    def add(self, piece: PointCloud) -> None:
        _count(piece.xyz, usable(piece), self.corner, self.cell_m, self.low, self.high, self.count)

    def thinned(self, pieces):
        """The pieces of a cloud without the points that are not needed."""
        first = 0
        for piece in pieces:
            kept = _needed(piece.xyz, first, self.corner, self.cell_m, self.low, self.high, self.count)
            first += len(piece)
            yield piece.select(kept)


@njit(cache=True)
def _cell(point, corner, cell_m, shape):  # pragma: no cover - compiled
    i, j = int(np.floor((point[0] - corner[0]) / cell_m)), int(np.floor((point[1] - corner[1]) / cell_m))
    return min(max(i, 0), shape[0] - 1), min(max(j, 0), shape[1] - 1)


@njit(cache=True)
def _count(xyz, good, corner, cell_m, low, high, count):  # pragma: no cover - compiled
    for m in range(xyz.shape[0]):
        if good[m]:
            i, j = _cell(xyz[m], corner, cell_m, count.shape)
            z = np.float32(xyz[m, 2])
            low[i, j], high[i, j] = min(low[i, j], z), max(high[i, j], z)
            count[i, j] += 1


@njit(cache=True)
def _needed(xyz, first, corner, cell_m, low, high, count):  # pragma: no cover - compiled
    """(N,) bool of the points ``first``, ``first`` + 1, ... of a file."""
    kept = np.ones(xyz.shape[0], np.bool_)
    for m in range(xyz.shape[0]):
        i, j = _cell(xyz[m], corner, cell_m, count.shape)
        above, below_top = xyz[m, 2] - low[i, j], high[i, j] - xyz[m, 2]
        if above > CROWNS_M and below_top < TOP_M:
            continue
        plenty = PLENTY_OF_STEM if LAYER_M < above <= CROWNS_M else PLENTY
        share = max(plenty / max(count[i, j], 1), LEAST_SHARE)
        # Multiples of the golden ratio spread evenly over any stretch of the file.
        kept[m] = ((first + m) * 0.6180339887498949) % 1.0 < share
    return kept
