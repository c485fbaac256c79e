"""Which points are ground: cloth simulation over the lowest points, then a robust surface for the whole cloud."""

from __future__ import annotations

import math

import numpy as np
import pyproj
from scipy.spatial import cKDTree

from ..core.errors import InputError
from ..core.machine import available_threads, in_threads, require_memory
from ..pointcloud.cloud import extent, slices
from .cloth import PARTICLE_BYTES, near_cloth, particles_over
from .credibility import carry_ground
from .dtm import Dtm, grid_over
from .options import ClothSimulation
from .surface import cell_quantile, grid_ground, local_ground

#: Ground is followed up slopes in steps of so many cells of the cloth, to points so near the plane led there, m.
GROW_STEP, GROW_M = 1.5, 0.15
#: Clouds of more points, of more lowest points, are large: surfaces through them are asked on coarser grids.
MANY_POINTS, MANY_LOWS = 4_000_000, 200_000
#: Points this near the surface through the lowest ones are ground, m.
NEAR_M = 0.10


def classify_ground(xyz: np.ndarray, method: ClothSimulation | None = None) -> np.ndarray:
    """(N,) bool: the ground points of (N, 3) ``xyz``.

    Raises:
        InputError: no ground was found.
    """
    method = method or ClothSimulation()
    return np.abs(height_above_ground(xyz, dtm_from_cloud(xyz, method=method))) <= method.ground_m


def dtm_from_cloud(
    xyz: np.ndarray,
    resolution_m: float = 0.25,
    method: ClothSimulation | None = None,
    crs: pyproj.CRS | None = None,
    reach_m: float = 10.0,
    ground: np.ndarray | None = None,
) -> Dtm:
    """Terrain model of (N, 3) ``xyz`` over its extent; support = distance to the nearest ground point.

    ground: (N,) bool of points known to be ground (a classified cloud); otherwise cloth simulation finds them.
    Cells farther than ``reach_m`` from ground stay unknown.

    Raises:
        InputError: no ground was found.
    """
    low, high = extent(xyz)
    origin = np.floor(low)
    bounds = low[:2] - origin[:2], high[:2] - origin[:2]
    if ground is not None and ground.sum() >= 10:
        seeds = cell_quantile(xyz[ground] - origin, 0.25, 0.3)
    else:
        # Part by part: a large cloud is not copied as a whole.
        method = method or ClothSimulation()
        parts = [cell_quantile(xyz[part] - origin, method.thin_m, 0.0, bounds[0]) for part in slices(len(xyz))]
        lows = cloth_ground(cell_quantile(np.concatenate(parts), method.thin_m, 0.0, bounds[0]), method)
        # The ground under every point through a fine grid: a plane per point would be N times too much work.
        fine_m = 0.25 if len(lows) <= MANY_LOWS else 0.5
        surface = grid_ground(lows, fine_m, neighbours=24, bandwidth_m=0.5, bounds=bounds)
        heights = (height_above_ground(xyz[part] - origin, surface) for part in slices(len(xyz)))
        near = xyz[np.concatenate([np.abs(height) < NEAR_M for height in heights])]
        near -= origin
        # The middle of the ground points: the lowest lie a noise's width under the ground.
        seeds = cell_quantile(near, 0.25, 0.4) if len(near) >= 10 else lows
    dtm = grid_ground(seeds, resolution_m, neighbours=24, bandwidth_m=0.5, reach_m=reach_m, bounds=bounds, crs=crs)
    return dtm.moved(origin)


def flat_ground(xyz: np.ndarray, crs: pyproj.CRS | None = None, z: float | None = None) -> Dtm:
    """A level ground under (N, 3) points at ``z``, or at the lowest of them: the last resort for a cut-out tree."""
    low, high = extent(xyz[:, :2])
    transform, rows, cols = grid_over(low - 1.0, high + 1.0, 1.0)
    return Dtm(np.full((rows, cols), lowest_z(xyz) if z is None else z), transform, crs)


def lowest_z(xyz: np.ndarray) -> float:
    """Height of the lowest of (N, 3) points but ten, which may be strays."""
    return float(np.partition(xyz[:, 2], min(10, len(xyz) - 1))[min(10, len(xyz) - 1)])


def height_above_ground(xyz: np.ndarray, dtm: Dtm) -> np.ndarray:
    """(N,) metres above the terrain model; NaN where the ground is unknown."""
    height = np.empty(len(xyz))

    def fill(part: slice) -> None:
        height[part] = xyz[part, 2] - dtm.height(xyz[part, 0], xyz[part, 1])

    for _ in in_threads(fill, list(slices(len(xyz)))):
        pass
    return height


def cloth_ground(lows: np.ndarray, method: ClothSimulation) -> np.ndarray:
    """(K, 3) the ground among (M, 3) lowest points, coordinates near zero.

    Raises:
        InputError: no ground was found.
    """
    lows = _without_pits(lows)
    if len(lows) < 10:
        raise InputError(
            f"Terrain: found {len(lows)} cells with points, expected at least 10; give a larger cloud "
            "or a DTM with --dtm."
        )
    span = np.ptp(lows[:, :2], axis=0)
    require_memory(
        float(PARTICLE_BYTES * math.prod(particles_over(lows, method))),
        f"Terrain: a cloth over {span[0]:,.0f} x {span[1]:,.0f} m",
        "cut the cloud to the plot, remove points far off, or give a DTM with --dtm",
    )
    found = np.flatnonzero(near_cloth(lows, method))
    if len(found) < 10:
        raise InputError("Terrain: no ground was found in the cloud; give a DTM with --dtm.")
    # The cloth lets low plants within its threshold pass: keep what a low, robust surface agrees with.
    for tolerance, width in ((0.3, 1.5), (0.15, 1.0)):
        if len(found) <= MANY_LOWS:
            surface, _ = local_ground(lows[found, :2], lows[found], neighbours=40, bandwidth_m=width, noise_m=0.03)
        else:
            grid = grid_ground(lows[found], width / 2, neighbours=40, bandwidth_m=width, noise_m=0.03)
            surface = grid.height(*lows[found, :2].T)
        kept = np.abs(lows[found, 2] - surface) < tolerance
        if kept.sum() < 10:
            break
        found = found[kept]
    return lows[_followed_up(lows, found, GROW_STEP * method.cloth_m)]


def _followed_up(lows: np.ndarray, found: np.ndarray, step_m: float) -> np.ndarray:
    """Indices of the ground among (M, 3) lowest points, with that on steep slopes, where the cloth does not lie: step
    by step from what was ``found`` (K,), lowest points in the plane of the ground beside them (Axelsson 2000)."""
    tree = cKDTree(lows[:, :2])
    hole = cKDTree(lows[found, :2]).query(lows[:, :2], workers=available_threads())[0] > step_m
    is_open, is_ground = np.zeros(len(lows), bool), np.zeros(len(lows), bool)
    is_open[_all_within(tree, lows[hole], 2 * step_m)] = is_ground[found] = True
    front = np.flatnonzero(is_open & is_ground)
    while len(front):
        around = _all_within(tree, lows[front], step_m)
        beside = around[is_open[around] & ~is_ground[around]]
        led_there, _ = carry_ground(lows[around[is_ground[around]]], lows[beside, :2])
        front = beside[np.abs(lows[beside, 2] - led_there) < GROW_M]
        is_ground[front] = True
    return np.flatnonzero(is_ground)


def _all_within(tree: cKDTree, points: np.ndarray, reach_m: float) -> np.ndarray:
    """Indices, ascending, of what in a tree over xy lies within reach of any of (N, 3) points."""
    found = np.zeros(tree.n, bool)
    for index in tree.query_ball_point(points[:, :2], reach_m):
        found[index] = True
    return np.flatnonzero(found)


def _without_pits(lows: np.ndarray) -> np.ndarray:
    """Drop single points a metre below all their neighbours: multipath, which would pull the cloth down."""
    if len(lows) < 20:
        return lows
    _, near = cKDTree(lows[:, :2]).query(lows[:, :2], k=9, workers=available_threads())
    floor = np.partition(lows[near[:, 1:], 2], 1, axis=1)[:, 1]
    return lows[lows[:, 2] > floor - 1.0]
