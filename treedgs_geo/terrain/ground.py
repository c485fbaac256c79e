"""Which points are ground: cloth simulation over the lowest points, then a robust surface for the whole cloud."""

from __future__ import annotations

import math

import numpy as np
import pyproj

from ..core.errors import InputError
from ..core.machine import require_memory
from ..pointcloud.cloud import extent, slices
from .cloth import PARTICLE_BYTES, near_cloth, particles_over
from .dtm import Dtm, grid_over
from .options import ClothSimulation
from .surface import cell_quantile, grid_ground, local_ground

#: Slope (rise over run) of a whole cloud or tile from which it is taken off before the cloth is draped.
STEEP = 0.5


def classify_ground(xyz: np.ndarray, method: ClothSimulation | None = None) -> np.ndarray:
    """(N,) bool: the ground points of (N, 3) ``xyz``.

    Raises:
        InputError: no ground was found.
    """
    method = method or ClothSimulation()
    origin = xyz.min(axis=0)
    xyz = xyz - origin
    seeds = recentred(xyz, cloth_ground(lowest(xyz, method), method))
    surface = _surface(seeds, extent(xyz[:, :2]))
    return np.abs(xyz[:, 2] - surface.height(xyz[:, 0], xyz[:, 1])) <= method.ground_m


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
    if ground is not None and ground.sum() >= 10:
        seeds = cell_quantile(xyz[ground] - origin, 0.25, 0.3)
    else:
        # Part by part: a large cloud is not copied as a whole.
        method = method or ClothSimulation()
        corner = low[:2] - origin[:2]
        parts = [lowest(xyz[part] - origin, method, corner) for part in slices(len(xyz))]
        lows = cloth_ground(lowest(np.concatenate(parts), method, corner), method)
        surface = _surface(lows, (corner, high[:2] - origin[:2]))
        is_near = np.concatenate([_is_near(xyz[part] - origin, surface) for part in slices(len(xyz))])
        near = xyz[is_near]
        near -= origin
        seeds = _middle(near, lows)
    bounds = low[:2] - origin[:2], high[:2] - origin[:2]
    dtm = grid_ground(seeds, resolution_m, neighbours=24, bandwidth_m=0.5, reach_m=reach_m, bounds=bounds, crs=crs)
    return dtm.moved(origin)


def flat_ground(xyz: np.ndarray, crs: pyproj.CRS | None = None) -> Dtm:
    """A level ground at the cloud's lowest points: the last resort for a cut-out tree without its surroundings."""
    low, high = xyz[:, :2].min(axis=0) - 1.0, xyz[:, :2].max(axis=0) + 1.0
    transform, rows, cols = grid_over(low, high, 1.0)
    base = float(np.partition(xyz[:, 2], min(10, len(xyz) - 1))[min(10, len(xyz) - 1)])
    return Dtm(np.full((rows, cols), base), transform, crs)


def height_above_ground(xyz: np.ndarray, dtm: Dtm, method: str = "bilinear") -> np.ndarray:
    """(N,) metres above the terrain model; NaN where the ground is unknown."""
    height = np.empty(len(xyz))
    for part in slices(len(xyz)):
        height[part] = xyz[part, 2] - dtm.height(xyz[part, 0], xyz[part, 1], method)
    return height


def recentred(
    xyz: np.ndarray, lows: np.ndarray, reach_m: float = 0.10, cell_m: float = 0.25, corner: np.ndarray | None = None
) -> np.ndarray:
    """Ground points free of the bias of lowest points, which lie a noise's width under the ground.

    xyz: (N, 3) all points, lows: (M, 3) ground among the lowest points, both near zero. corner: of the cells' lattice.
    """
    return _middle(xyz[_is_near(xyz, _surface(lows, extent(xyz[:, :2])), reach_m)], lows, cell_m, corner)


def _is_near(xyz: np.ndarray, surface: Dtm, reach_m: float = 0.10) -> np.ndarray:
    return np.abs(xyz[:, 2] - surface.height(xyz[:, 0], xyz[:, 1])) < reach_m


def _middle(near: np.ndarray, lows: np.ndarray, cell_m: float = 0.25, corner: np.ndarray | None = None) -> np.ndarray:
    return cell_quantile(near, cell_m, 0.4, corner) if len(near) >= 10 else lows


def _surface(seeds: np.ndarray, bounds: tuple[np.ndarray, np.ndarray]) -> Dtm:
    """Ground under every point, through a fine grid (a plane per point would be N times too much work)."""
    return grid_ground(seeds, 0.25, neighbours=24, bandwidth_m=0.5, bounds=bounds)


def lowest(xyz: np.ndarray, method: ClothSimulation, corner: np.ndarray | None = None) -> np.ndarray:
    """(M, 3) the lowest point of each cell of ``method.thin_m``."""
    return cell_quantile(xyz, method.thin_m, 0.0, corner)


def cloth_ground(lows: np.ndarray, method: ClothSimulation) -> np.ndarray:
    """(K, 3) the ground among (M, 3) lowest points, coordinates near zero.

    Raises:
        InputError: no ground was found.
    """
    tilt = _tilt(lows)
    lows = _without_pits(lows - _tilt_at(tilt, lows))
    if len(lows) < 10:
        raise InputError(
            f"Terrain: found {len(lows)} cells with points, expected at least 10; give a larger cloud "
            "or a DTM with --dtm."
        )
    span = lows[:, :2].max(axis=0) - lows[:, :2].min(axis=0)
    require_memory(
        float(PARTICLE_BYTES * math.prod(particles_over(lows, method))),
        f"Terrain: a cloth over {span[0]:,.0f} x {span[1]:,.0f} m",
        "cut the cloud to the plot, remove points far off, or give a DTM with --dtm",
    )
    found = lows[near_cloth(lows, method)]
    if len(found) < 10:
        raise InputError("Terrain: no ground was found in the cloud; give a DTM with --dtm.")
    # The cloth lets low plants within its threshold pass: keep what a low, robust surface agrees with.
    for tolerance, width in ((0.3, 1.5), (0.15, 1.0)):
        surface, _ = local_ground(found[:, :2], found, neighbours=40, bandwidth_m=width, noise_m=0.03)
        kept = np.abs(found[:, 2] - surface) < tolerance
        if kept.sum() < 10:
            break
        found = found[kept]
    return found + _tilt_at(tilt, found)


def _tilt(lows: np.ndarray) -> np.ndarray:
    """(2,) slope in x and y of the plane under (M, 3) lowest points where it is steep, else none: a cloth does not lie
    on a steep slope, but on what is left of it."""
    cells = cell_quantile(lows, 2.0, 0.0) if len(lows) else lows
    plane = np.zeros(3)
    flat = np.column_stack([cells[:, :2], np.ones(len(cells))])
    kept = np.ones(len(cells), bool)
    for _ in range(10):
        if kept.sum() < 10:
            return np.zeros(2)
        plane = np.linalg.lstsq(flat[kept], cells[kept, 2], rcond=None)[0]
        off = cells[:, 2] - flat @ plane
        # Crowns and stems stand above the ground, nothing below.
        kept = off < np.median(off) + 2 * np.median(np.abs(off - np.median(off))) + 0.1
    return plane[:2] if np.hypot(*plane[:2]) > STEEP else np.zeros(2)


def _tilt_at(tilt: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N, 3) what a (2,) tilt adds to the heights of (N, 3) points."""
    return np.outer(points[:, :2] @ tilt, (0.0, 0.0, 1.0))


def _without_pits(lows: np.ndarray, depth_m: float = 1.0) -> np.ndarray:
    """Drop single points far below all their neighbours: multipath, which would pull the cloth down."""
    from scipy.spatial import cKDTree

    if len(lows) < 20:
        return lows
    _, near = cKDTree(lows[:, :2]).query(lows[:, :2], k=9)
    floor = np.partition(lows[near[:, 1:], 2], 1, axis=1)[:, 1]
    return lows[lows[:, 2] > floor - depth_m]
