"""A large cloud read as measuring stems needs it: all points of the stem band, of dense ground and crowns a share.

All points are held as the file stores them (27 bytes with their times) until the lowest ones have told roughly where
the ground is; then the needed ones take their place. Shares are even over the pulses, whose returns stay together (they
tell where the scanner was), or without times over the file's order: each flight line and scan keeps its part.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numba import njit

from ..core.errors import InputError
from ..core.machine import in_threads
from ..pointcloud.cloud import PointCloud, evenly, slices, usable
from ..pointcloud.files import About, describe_cloud, iter_cloud, placed
from .dtm import Dtm
from .ground import MANY_POINTS, cloth_ground
from .options import ClothSimulation
from .surface import grid_ground

#: Clouds up to this size are read as a whole.
WHOLE_CLOUD_POINTS = MANY_POINTS
#: Side of the cells in which points are counted, m, and cells at most, which make them larger; that of the rough ground
#: is this many times as wide.
CELL_M, MAX_CELLS, ROUGH = 0.5, 16_000_000, 2
#: Points this near the rough ground may be ground or what it is told from; crowns begin at the second height (stems are
#: followed to 14.5 m), and so far below its cell's highest point a point tells the height of trees, m.
LAYER_M, CROWNS_M, TOP_M = 0.2, 14.8, 0.25
#: So many points a cell are enough of ground (of those less than :data:`LOW_M` above the lowest of the wide cell), of
#: the stem band and of crowns (of all points of the cell); never less than the share is kept.
ENOUGH, MIN_SHARE, LOW_M = (16, 20_000, 32), 0.2, 1.0
#: Points that are worked on at once.
PIECE_POINTS = 500_000
#: So many points of a piece tell whether pulses have times of their own: that share of different ones.
PULSES, SHARE_TIMED = 10_000, 0.3


def read_thinned(path: Path, crs: str | None, attributes: tuple[str, ...], need_crs: bool) -> PointCloud:
    """Like :func:`treedgs_geo.pointcloud.files.read_cloud`, of a file whose header gives its extent.

    Raises:
        InputError, CRSError: as there.
    """
    about = describe_cloud(path)
    cells, count = _Cells(about), 0
    stored = np.empty((about.n_points, 3), np.int32)
    held: dict[str, np.ndarray] = {}
    for piece in iter_cloud(path, None, crs, attributes, need_crs, PIECE_POINTS):
        cells.add(piece)
        rows = slice(count, count + len(piece))
        _store(piece.xyz, about.scale, about.offset, stored[rows])
        for name, values in piece.attributes.items():
            if name not in held:
                held[name] = np.empty(about.n_points, values.dtype)
            held[name][rows] = values
        count += len(piece)
    # What is zero throughout tells nothing.
    held = {name: values for name, values in held.items() if values.any()}
    ground = cells.rough_ground()

    def needed(rows: slice) -> np.ndarray:
        part = {name: values[rows] for name, values in held.items()}
        return cells.needed(placed(*stored[rows].T, about.scale, about.offset), part, ground, rows.start)

    kept = np.concatenate(list(in_threads(needed, list(slices(count, PIECE_POINTS)))))
    for name in held:
        held[name] = held[name][kept]
    stored = stored[kept]
    return PointCloud(placed(*stored.T, about.scale, about.offset), piece.crs, held, piece.layout)


class _Cells:
    """lowest: (rows, cols, 3) the lowest usable point of each wide cell from ``corner`` (3,), z inf where none is.
    high: (rows, cols) height of the highest, count, low: (rows, cols) points of each cell, and low ones."""

    def __init__(self, about: About) -> None:
        span = np.maximum(about.high - about.low, 1.0)[:2]
        self.corner = np.floor(np.asarray(about.low, float))
        self.cell_m = max(CELL_M, float(np.sqrt(np.prod(span) / MAX_CELLS)))
        wide = np.floor((span + 1.0) / (ROUGH * self.cell_m)).astype(int) + 1
        self.lowest = np.full((*wide, 3), np.inf)
        self.high = np.full(ROUGH * wide, -np.inf, np.float32)
        self.count, self.low = np.zeros((2, *(ROUGH * wide)), np.int32)

    def add(self, piece: PointCloud) -> None:
        """Count the usable points of a piece."""
        _count(piece.xyz, usable(piece), self.corner, self.cell_m, self.lowest, self.high, self.count, self.low)

    def rough_ground(self) -> Dtm | None:
        """The ground that the lowest points show, from the corner; ``None`` where they show none, or where points are
        too few to be thinned (so are those of a plot in millimetres)."""
        if self.count.sum() < ENOUGH[0] * np.count_nonzero(self.count):
            return None
        lows = self.lowest.reshape(-1, 3)
        step = ROUGH * self.cell_m
        try:
            lows = cloth_ground(lows[np.isfinite(lows[:, 2])], ClothSimulation(cloth_m=step, thin_m=step))
        except InputError:
            return None
        return grid_ground(lows, step, neighbours=12, bandwidth_m=step)

    def needed(self, xyz: np.ndarray, attributes: dict[str, np.ndarray], ground: Dtm | None, first: int) -> np.ndarray:
        """(N,) bool: those of (N, 3) points that are needed; all without a ground. first: their place in the file."""
        if ground is None:
            return np.ones(len(xyz), bool)
        x, y, z = (xyz - self.corner).T
        height, pulse = z - ground.height(x, y), _pulses(attributes, len(xyz), first)
        return _needed(xyz, height, pulse, self.corner, self.cell_m, self.high, self.count, self.low)


def _pulses(attributes: dict[str, np.ndarray], count: int, first: int) -> np.ndarray:
    """(N,) from 0 to 1, even over the pulses and one for each, which its time tells where most have one of their own;
    else, from ``first``, the count of first returns in the file, or of points."""
    time = np.asarray(attributes.get("gps_time", ()), float)
    if len(np.unique(time[:PULSES])) > SHARE_TIMED * PULSES:
        return evenly(time.view(np.uint64))
    begins = np.asarray(attributes.get("return_number", np.ones(count))) == 1
    return evenly(np.cumsum(begins).astype(np.uint64) + np.uint64(first))


@njit(cache=True, nogil=True)
def _store(xyz, scale, offset, stored):  # pragma: no cover - compiled
    """(N, 3) coordinates as the whole numbers of which LAS made them, into ``stored``."""
    for m in range(xyz.shape[0]):
        for axis in range(3):
            stored[m, axis] = np.int32(np.rint((xyz[m, axis] - offset[axis]) / scale[axis]))


@njit(cache=True)
def _cell(point, corner, cell_m, shape):  # pragma: no cover - compiled
    i, j = int(np.floor((point[0] - corner[0]) / cell_m)), int(np.floor((point[1] - corner[1]) / cell_m))
    return min(max(i, 0), shape[0] - 1), min(max(j, 0), shape[1] - 1)


@njit(cache=True, nogil=True)
def _count(xyz, good, corner, cell_m, lowest, high, count, low):  # pragma: no cover - compiled
    for m in range(xyz.shape[0]):
        if not good[m]:
            continue
        i, j = _cell(xyz[m], corner, cell_m, count.shape)
        z = xyz[m, 2] - corner[2]
        high[i, j] = max(high[i, j], np.float32(z))
        count[i, j] += 1
        i0, j0 = i // ROUGH, j // ROUGH
        if z < lowest[i0, j0, 2] - LOW_M:
            low[i0 * ROUGH : (i0 + 1) * ROUGH, j0 * ROUGH : (j0 + 1) * ROUGH] = 0
        low[i, j] += z < lowest[i0, j0, 2] + LOW_M
        if z < lowest[i0, j0, 2]:
            for axis in range(3):
                lowest[i0, j0, axis] = xyz[m, axis] - corner[axis]


@njit(cache=True, nogil=True)
def _needed(xyz, height, pulse, corner, cell_m, high, count, low):  # pragma: no cover - compiled
    """(N,) bool of (N, 3) points of (N,) :func:`_pulses` at (N,) heights above the rough ground."""
    kept = np.ones(xyz.shape[0], np.bool_)
    for m in range(xyz.shape[0]):
        i, j = _cell(xyz[m], corner, cell_m, count.shape)
        part = 1
        if height[m] > CROWNS_M:
            if high[i, j] - (xyz[m, 2] - corner[2]) < TOP_M:
                continue
            part = 2
        elif abs(height[m]) < LAYER_M:
            part = 0
        kept[m] = pulse[m] < max(ENOUGH[part] / max(count[i, j] if part else low[i, j], 1), MIN_SHARE)
    return kept
