"""Ground from the sparse points of structure from motion: most lie on the litter, the rest on stems and crowns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pyproj
from scipy.spatial import cKDTree

from ..core.errors import InputError
from .credibility import NEAR_M, NO_GROUND_M
from .dtm import Dtm
from .surface import cell_quantile, grid_ground, local_ground

#: Side of the wide cells, what is near the surface through their lowest points, and how far the ground is known beyond
#: its points, m.
_CELL_M, _NEAR_SURFACE_M, _REACH_M = 1.0, 0.5, 6.0


def dtm_from_sparse(
    points: np.ndarray, crs: pyproj.CRS | None = None, bounds: tuple[np.ndarray, np.ndarray] | None = None
) -> Dtm:
    """Ground model from (N, 3) sparse points in local or project coordinates, cells of 25 cm.

    Points in layers -> low 5 % of each wide cell -> robust asymmetric plane -> a smooth low surface over the cells (so
    that hills are followed) -> the points near it -> local robust planes on a grid. The recipe was tried on
    three rendered plots: bias under 2 cm, 1.5-2.3 cm RMS at the stems on bare litter; under real understory it reads
    high.

    Raises:
        InputError: fewer than 30 finite points, or no ground surface among them.
    """
    points = np.asarray(points, float).reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) < 30:
        raise InputError(
            f"Ground from photos: found {len(points)} 3-D points, expected at least 30; give a DTM with --dtm."
        )
    centre = np.median(points, axis=0)
    points = points - centre
    layers = in_layers(points)
    lows = cell_quantile(points[layers] if layers.sum() >= 10 else points, _CELL_M, 0.05)
    plane = asymmetric_plane(lows)
    above = lows[:, 2] - (plane[0] + lows[:, :2] @ plane[1:])
    # Cells without a ground point hang metres above the plane; hills of a few metres must survive.
    lows = lows[np.abs(above) < max(3.0, 4 * _low_spread(above))]
    if len(lows) < 10:
        lows = cell_quantile(points, _CELL_M, 0.05)
    surface, _ = local_ground(points[:, :2], lows, neighbours=30, bandwidth_m=3 * _CELL_M, noise_m=0.10)
    near = np.abs(points[:, 2] - surface) < _NEAR_SURFACE_M
    if near.sum() < 10:
        raise InputError("Ground from photos: no ground surface was found among the 3-D points; give a DTM with --dtm.")
    if bounds is not None:
        bounds = bounds[0][:2] - centre[:2], bounds[1][:2] - centre[:2]
    return grid_ground(points[near], 0.25, reach_m=_REACH_M, bounds=bounds, crs=crs).moved(centre)


#: What is beside a point: across and up, metres. So many points beside one are a layer, and so large a share of those
#: of the thickest layer within so many times as far.
_ACROSS_M, _UP_M, _LAYER_POINTS, _LAYER_SHARE, _FARTHER = 2.0, 0.25, 4, 0.15, 3


def in_layers(points: np.ndarray) -> np.ndarray:
    """(N,) bool: points with others beside them at their height. Wrong matches in moving crowns lie metres below the
    ground, but spread over all heights."""
    scaled = points / np.array([_ACROSS_M, _ACROSS_M, _UP_M])
    beside = cKDTree(scaled).query_ball_point(scaled, 1.0, return_length=True)
    cells, cell = np.unique(np.floor(scaled[:, :2]), axis=0, return_inverse=True)
    thickest = np.zeros(len(cells))
    np.maximum.at(thickest, cell.ravel(), beside)
    about = cKDTree(cells).query_ball_point(cells, _FARTHER)
    thickest = np.array([thickest[near].max() for near in about])
    return beside >= np.maximum(_LAYER_POINTS, _LAYER_SHARE * thickest[cell.ravel()])


#: Sparse points near a stem that show its ground: within :data:`.credibility.NEAR_M` of it or, less surely, within
#: this, this close to the ground model (m), so many of them, and no rougher than this (1 sd, m; shrubs and grass are).
#: Three rendered plots: 23 to 160 points, 0.01-0.09 m.
FAR_M, LAYER_M, MIN_POINTS, ROUGHEST_M = 5.0, 0.5, 6, 0.15
#: Standard error of the ground's height, m: shown round the stem; rough, or shown some metres off.
SHOWN_SE_M, UNKNOWN_SE_M = 0.05, 0.6


def sparse_ground_se(points: np.ndarray, dtm: Dtm, xy: np.ndarray, above_m: float | None = None) -> np.ndarray:
    """(K,) standard error of the ground's height at stems, metres; :data:`.credibility.NO_GROUND_M` where neither
    points nor model show any.

    points: (N, 3) sparse points, xy: (K, 2) stems, in the coordinates of ``dtm``. above_m: of a given model, how far
    it lies above the points' ground (median of the plot); it is then off by what it differs from the points near it,
    where they show bare ground, and by ``above_m`` elsewhere.
    """
    xy = np.asarray(xy, float).reshape(-1, 2)
    height = points[:, 2] - dtm.height(points[:, 0], points[:, 1]) + (above_m or 0.0)
    layer = np.abs(height) < LAYER_M
    found = np.full(len(xy), NO_GROUND_M)
    tree = cKDTree(points[layer, :2])
    for k, known in enumerate(np.isfinite(dtm.height(*xy.T))):
        if not known:
            continue
        near = height[layer][tree.query_ball_point(xy[k], NEAR_M)]
        middle = float(np.median(near)) if len(near) else 0.0
        shown = len(near) >= MIN_POINTS and 1.4826 * float(np.median(np.abs(near - middle))) < ROUGHEST_M
        if above_m is not None:
            found[k] = abs(middle - above_m) if shown else abs(above_m)
        elif shown:
            found[k] = SHOWN_SE_M
        elif len(tree.query_ball_point(xy[k], FAR_M)) >= MIN_POINTS:
            found[k] = UNKNOWN_SE_M
    return found


def with_gaps_filled(given: Dtm, found: Dtm, above_m: float) -> tuple[Dtm, float]:
    """``(model, m2)``: a given model, where it knows no height that of the photos brought to its level, and how much
    that is. On the grid of ``found`` where there is a gap, as it is where there is none."""
    x, y = found.centres()
    theirs = given.height(x, y)
    gaps = ~np.isfinite(theirs) & np.isfinite(found.heights)
    if not gaps.any():
        return given, 0.0
    filled = replace(found, heights=np.where(gaps, found.heights + above_m, theirs), support=None)
    return filled, found.resolution_m**2 * float(gaps.sum())


def asymmetric_plane(points: np.ndarray) -> np.ndarray:
    """(3,) ``a, b, c`` of z = a + b x + c y that hugs the (N, 3) points from below, robustly."""
    basis = np.column_stack([np.ones(len(points)), points[:, :2]])
    weight = np.ones(len(points))
    plane = np.zeros(3)
    for _ in range(30):
        ridge = np.diag([1e-9, 1e-3, 1e-3]) * weight.sum()
        plane = np.linalg.solve((basis * weight[:, None]).T @ basis + ridge, (basis * weight[:, None]).T @ points[:, 2])
        residual = points[:, 2] - basis @ plane
        scale = max(_low_spread(residual), 0.1)
        # High residuals (no ground return in the cell) fade fast, deep outliers slowly but fully.
        weight = np.where(residual > 0, 0.15 / (1 + (residual / scale) ** 2), 1 / (1 + (residual / (4 * scale)) ** 4))
    return plane


def _low_spread(residual: np.ndarray) -> float:
    below = -residual[residual < 0]
    return float(1.4826 * np.median(below)) if len(below) else 0.1
