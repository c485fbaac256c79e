"""The terrain model of a cloud of any size, tile by tile: the same steps as for a whole cloud, with buffers.

Only reduced points cross the tiles' borders (the lowest of each cell, then the ground points), so the buffers cost
little. Memory is that of one tile and its neighbours' reduced points; the grid itself lies in a file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyproj

from ..core.errors import InputError
from ..core.files import reserve
from ..core.progress import Reporter
from ..pointcloud.cloud import horizontal
from ..pointcloud.tiles import TileStore
from .cloud_ground import CloudGround
from .credibility import GroundLayer
from .dtm import Dtm, grid_over, read_dtm, require_coverage, require_same_heights
from .ground import cloth_ground, flat_ground, lowest, recentred
from .normalised import NORMALISED_SE_M, lowest_height
from .options import ClothSimulation
from .surface import cell_quantile, local_ground

#: The cloth hangs over this much of the neighbouring tiles: more than the widest crown without ground under it.
_CLOTH_BUFFER_M = 10.0


def dtm_from_tiles(
    store: TileStore,
    folder: Path,
    resolution_m: float = 0.25,
    method: ClothSimulation | None = None,
    crs: pyproj.CRS | None = None,
    reach_m: float = 10.0,
    use_classes: bool = False,
    reporter: Reporter | None = None,
) -> Dtm:
    """Like :func:`.ground.dtm_from_cloud`; the grid is float32 on disk in ``folder`` and stays valid as long as it.

    use_classes: the tiles' ``classification`` 2 is the ground; otherwise cloth simulation finds it.

    Raises:
        InputError: no ground was found.
    """
    method, reporter = method or ClothSimulation(), reporter or Reporter()
    tiles = store.tiles
    origin = np.r_[store.origin, np.floor(store.low[2])]
    for number, tile in enumerate(tiles):
        xyz, extras = store.read(tile)
        corner = store.bounds(tile)[0] - origin[:2]
        if use_classes:
            ground = xyz[extras["classification"] == 2] - origin
            np.save(folder / f"seeds_{tile[0]}_{tile[1]}.npy", cell_quantile(ground, 0.25, 0.3, corner))
        else:
            np.save(folder / f"lows_{tile[0]}_{tile[1]}.npy", lowest(xyz - origin, method, corner))
        reporter.progress(0.3 * (number + 1) / len(tiles))
    found = 0
    for number, tile in enumerate(tiles):
        if use_classes:
            found += len(np.load(folder / f"seeds_{tile[0]}_{tile[1]}.npy"))
            continue
        seeds = _tile_seeds(store, folder, tile, origin, method)
        found += len(seeds)
        np.save(folder / f"seeds_{tile[0]}_{tile[1]}.npy", seeds)
        reporter.progress(0.3 + 0.4 * (number + 1) / len(tiles))
    if found < 10:
        raise InputError("Terrain: no ground was found in the cloud; give a DTM with --dtm.")
    return _grid(store, folder, origin, resolution_m, crs, reach_m, reporter)


def _tile_seeds(
    store: TileStore, folder: Path, tile: tuple[int, int], origin: np.ndarray, method: ClothSimulation
) -> np.ndarray:
    """Ground points of one tile, coordinates from ``origin``."""
    low, high = (corner - origin[:2] for corner in store.bounds(tile))
    lows = _gather(store, folder, "lows", tile, low - _CLOTH_BUFFER_M, high + _CLOTH_BUFFER_M)
    try:
        ground = cloth_ground(lows, method)
    except InputError:
        return np.empty((0, 3))  # a tile without ground (water, the rim of a scan) is filled from its neighbours
    xyz = store.read(tile)[0] - origin
    seeds = recentred(xyz, ground, corner=low)
    return seeds[((seeds[:, :2] >= low) & (seeds[:, :2] < high)).all(axis=1)]


def _gather(
    store: TileStore, folder: Path, kind: str, tile: tuple[int, int], low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Reduced points of a tile and its neighbours within a box."""
    parts = [
        np.load(folder / f"{kind}_{i}_{j}.npy")
        for i, j in store.neighbours(tile, float(max(np.max(high - low) - store.side_m, 0.0) / 2))
    ]
    points = np.concatenate(parts)
    return points[((points[:, :2] >= low) & (points[:, :2] < high)).all(axis=1)]


def _grid(
    store: TileStore,
    folder: Path,
    origin: np.ndarray,
    resolution_m: float,
    crs: pyproj.CRS | None,
    reach_m: float,
    reporter: Reporter,
) -> Dtm:
    transform, rows, cols = grid_over(store.low[:2] - origin[:2], store.high[:2] - origin[:2], resolution_m)
    for name in ("ground.f32", "support.f32"):
        reserve(folder / name, 4 * rows * cols)
    heights = np.memmap(folder / "ground.f32", np.float32, "r+", shape=(rows, cols))
    support = np.memmap(folder / "support.f32", np.float32, "r+", shape=(rows, cols))
    # Cells of tiles without points are asked too: a gap in the cloud narrower than the reach is bridged.
    first = np.floor((store.low[:2] - store.origin) / store.side_m).astype(int)
    last = np.floor((store.high[:2] - store.origin) / store.side_m).astype(int)
    wanted = [(i, j) for i in range(first[0], last[0] + 1) for j in range(first[1], last[1] + 1)]
    for number, tile in enumerate(wanted):
        low, high = (corner - origin[:2] for corner in store.bounds(tile))
        # Cells whose centre lies in the tile.
        left, right = (
            int(np.clip(np.ceil((x - transform.c) / resolution_m - 0.5), 0, cols)) for x in (low[0], high[0])
        )
        top, bottom = (
            int(np.clip(np.ceil((transform.f - y) / resolution_m - 0.5), 0, rows)) for y in (high[1], low[1])
        )
        if left == right or top == bottom:
            continue
        block_h = np.full((bottom - top, right - left), np.nan)
        block_s = np.full_like(block_h, np.nan)
        if any(True for _ in store.neighbours(tile, reach_m)):
            seeds = _gather(store, folder, "seeds", tile, low - reach_m - 1.0, high + reach_m + 1.0)
            if len(seeds):
                x, y = np.meshgrid(
                    transform.c + (np.arange(left, right) + 0.5) * resolution_m,
                    transform.f - (np.arange(top, bottom) + 0.5) * resolution_m,
                )
                z, away = local_ground(np.column_stack([x.ravel(), y.ravel()]), seeds, 24, 0.5)
                z[away > reach_m] = np.nan
                block_h, block_s = z.reshape(x.shape) + origin[2], away.reshape(x.shape)
        heights[top:bottom, left:right] = block_h
        support[top:bottom, left:right] = block_s
        reporter.progress(0.7 + 0.3 * (number + 1) / len(wanted))
    return Dtm(heights, transform, crs, support).moved_grid(origin)


def ground_of_tiles(store: TileStore, folder: Path, dtm: Path | None, z_is: str, reporter: Reporter) -> CloudGround:
    """The ground under a cloud in tiles, as :func:`.cloud_ground.found_ground` and :func:`check_dtm` see it.

    Raises:
        InputError, CRSError: as these.
    """
    if dtm is not None:
        return check_dtm(dtm, store, reporter)
    lows = np.concatenate([cell_quantile(store.read(tile)[0], 1.0, 0.0) for tile in store.tiles])
    zero = flat_ground(np.array([store.low, store.high]), horizontal(store.crs), 0.0)
    at_zero = CloudGround(zero, zero, least_m=NORMALISED_SE_M)
    if z_is == "height":
        return at_zero
    own = dtm_from_tiles(store, folder, crs=horizontal(store.crs), reporter=reporter)
    found = CloudGround(own, own=own, layer=layer_of_tiles(store, own))
    return at_zero if z_is == "auto" and lowest_height(lows) is not None and not found.shows_ground_at(lows) else found


def layer_of_tiles(store: TileStore, dtm: Dtm) -> GroundLayer:
    """How well the tiles show the ground that was found in them."""
    layer = GroundLayer.over(store.low, store.high)
    for tile in store.tiles:
        xyz = store.read(tile)[0]
        layer.add(xyz, xyz[:, 2] - dtm.height(xyz[:, 0], xyz[:, 1]))
    return layer


def check_dtm(path: Path, store: TileStore, reporter: Reporter | None = None) -> CloudGround:
    """The user's DTM for a cloud in tiles, refused where it does not lie under the cloud or has other heights; where it
    knows no height, that is said.

    Raises:
        InputError, CRSError: see :func:`.dtm.read_dtm`, :func:`.dtm.require_coverage`,
            :func:`.dtm.require_same_heights`.
    """
    reporter = reporter or Reporter()
    dtm = read_dtm(path, store.crs, reporter)
    lows = np.concatenate([cell_quantile(store.read(tile)[0], 1.0, 0.0) for tile in store.tiles])
    require_coverage(dtm, lows[:, :2], str(path))
    require_same_heights(dtm, lows, str(path))
    unknown = int((~dtm.covers(lows[:, :2])).sum())
    if unknown:
        reporter.warn(
            f"{path}: has no height in {unknown} m2 of the ground under the cloud; no stem is found there; "
            "give a DTM without gaps, or leave --dtm out."
        )
    return CloudGround(dtm, dtm)
