"""Ground from the sparse points of structure from motion: most lie on the litter, the rest on stems and crowns."""

from __future__ import annotations

import numpy as np
import pyproj

from ..core.errors import InputError
from .dtm import Dtm
from .surface import cell_quantile, grid_ground, local_ground


def dtm_from_sparse(points: np.ndarray, resolution_m: float = 0.25, crs: pyproj.CRS | None = None,
                    cell_m: float = 1.0, tolerance_m: float = 0.5, reach_m: float = 6.0,
                    bounds: tuple[np.ndarray, np.ndarray] | None = None) -> Dtm:
    """Ground model from (N, 3) sparse points in local or project coordinates.

    Low 5 % per ``cell_m`` cell -> robust asymmetric plane -> a smooth low surface over the cells (so that hills are
    followed) -> the points within ``tolerance_m`` of it -> local robust planes on a grid. The recipe was tried on three
    rendered plots: bias under 2 cm, 1.5-2.3 cm RMS at the stems on bare litter; under real understory it reads high.

    Raises:
        InputError: fewer than 30 finite points, or they span less than two cells.
    """
    points = np.asarray(points, float).reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) < 30:
        raise InputError(
            f"Ground from photos: found {len(points)} 3-D points, expected at least 30; give a DTM with --dtm.")
    centre = np.median(points, axis=0)
    ground = sparse_ground_points(points - centre, cell_m, tolerance_m)
    if bounds is not None:
        bounds = (np.asarray(bounds[0], float)[:2] - centre[:2], np.asarray(bounds[1], float)[:2] - centre[:2])
    dtm = grid_ground(ground, resolution_m, neighbours=40, bandwidth_m=1.0, reach_m=reach_m, bounds=bounds, crs=crs)
    return dtm.moved(centre)


def sparse_ground_points(points: np.ndarray, cell_m: float = 1.0, tolerance_m: float = 0.5) -> np.ndarray:
    """The (M, 3) ground points among (N, 3) sparse points (coordinates near zero)."""
    lows = cell_quantile(points, cell_m, 0.05)
    plane = asymmetric_plane(lows)
    above = lows[:, 2] - _at(plane, lows)
    # Cells without a ground point hang metres above the plane; hills of a few metres must survive.
    lows = lows[np.abs(above) < max(3.0, 4 * _low_spread(above))]
    if len(lows) < 10:
        lows = cell_quantile(points, cell_m, 0.05)
    surface, _ = local_ground(points[:, :2], lows, neighbours=30, bandwidth_m=3 * cell_m, noise_m=0.10)
    near = np.abs(points[:, 2] - surface) < tolerance_m
    if near.sum() < 10:
        raise InputError("Ground from photos: no ground surface was found among the 3-D points; give a DTM with --dtm.")
    return points[near]


def asymmetric_plane(points: np.ndarray, rounds: int = 30) -> np.ndarray:
    """(3,) ``a, b, c`` of z = a + b x + c y that hugs the (N, 3) points from below, robustly."""
    basis = np.column_stack([np.ones(len(points)), points[:, :2]])
    weight = np.ones(len(points))
    plane = np.zeros(3)
    for _ in range(rounds):
        ridge = np.diag([1e-9, 1e-3, 1e-3]) * weight.sum()
        plane = np.linalg.solve((basis * weight[:, None]).T @ basis + ridge, (basis * weight[:, None]).T @ points[:, 2])
        residual = points[:, 2] - basis @ plane
        scale = max(_low_spread(residual), 0.1)
        # High residuals (no ground return in the cell) fade fast, deep outliers slowly but fully.
        weight = np.where(residual > 0, 0.15 / (1 + (residual / scale) ** 2), 1 / (1 + (residual / (4 * scale)) ** 4))
    return plane


def _at(plane: np.ndarray, points: np.ndarray) -> np.ndarray:
    return plane[0] + points[:, :2] @ plane[1:]


def _low_spread(residual: np.ndarray) -> float:
    below = -residual[residual < 0]
    return float(1.4826 * np.median(below)) if len(below) else 0.1
