"""Stems in a cloud of any size: the search of :mod:`.segment` fed tile by tile from disk, with its own buffers."""

from __future__ import annotations

import numpy as np

from ....core.progress import Reporter
from ....pointcloud.cloud import PointCloud
from ....pointcloud.tiles import TileStore
from ....terrain.dtm import Dtm
from .options import SegmentOptions
from .segment import SLAB_M, TILE_M, StemMap, guess_sensor, search_tiles

#: Tiles looked at, evenly spread, to see what made the cloud.
_GUESS_TILES = 16


def find_stems_tiled(
    store: TileStore,
    dtm: Dtm,
    options: SegmentOptions | None = None,
    reporter: Reporter | None = None,
    seeds_xy: np.ndarray | None = None,
) -> StemMap:
    """Like :func:`.segment.find_stems`, on the same lattice of tiles; memory is that of one tile with its buffer."""
    options, reporter = options or SegmentOptions(), reporter or Reporter()
    origin = np.floor(store.low[:2])
    source = options.source if options.source != "auto" else _guess(store, dtm, options)
    last = np.floor((store.high[:2] - origin) / TILE_M).astype(int)
    tiles = [np.array([i, j]) for i in range(last[0] + 1) for j in range(last[1] + 1)]

    def points_in(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        return _slab(store, dtm, origin, low, high, options)

    return search_tiles(points_in, tiles, origin, source, options, reporter, seeds_xy, 1)


def _slab(
    store: TileStore, dtm: Dtm, origin: np.ndarray, low: np.ndarray, high: np.ndarray, options: SegmentOptions
) -> tuple[np.ndarray, np.ndarray | None]:
    """(N, 3) x, y from ``origin`` and height above ground of one tile's points, and their opacities."""
    xyz, extras = store.read_box(low + origin, high + origin)
    height = xyz[:, 2] - dtm.height(xyz[:, 0], xyz[:, 1])
    with np.errstate(invalid="ignore"):
        slab = np.flatnonzero((height > SLAB_M) & (height < options.grow_m))
    points = np.column_stack([xyz[slab, :2] - origin, height[slab]])
    weights = extras.get("opacity")
    return points, None if weights is None else np.clip(np.asarray(weights, float)[slab], 0.02, 1.0)


def _guess(store: TileStore, dtm: Dtm, options: SegmentOptions) -> str:
    """What made the cloud, from some of its tiles."""
    if "opacity" in store.extras:
        return "splat"
    tiles = store.tiles
    some = [tiles[k] for k in np.unique(np.linspace(0, len(tiles) - 1, _GUESS_TILES).astype(int))]
    parts = []
    for tile in some:
        low, high = store.bounds(tile)
        points, _ = _slab(store, dtm, store.origin, low - store.origin, high - store.origin, options)
        band = points[(points[:, 2] > options.low_m) & (points[:, 2] < options.high_m)]
        # The density is what is asked for: whole square metres, enough of them.
        parts.append(band[(np.floor(band[:, :2]).sum(axis=1) % 5) == 0] if len(band) > 200_000 else band)
    empty = PointCloud(np.empty((0, 3)))
    return guess_sensor(empty, np.concatenate(parts), options)
