"""A ground surface from noisy points: local planes, robust, leaning low because what is not ground is above it."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from .dtm import Dtm, grid_over


def local_ground(query_xy: np.ndarray, points: np.ndarray, neighbours: int = 40, bandwidth_m: float = 1.0,
                 noise_m: float = 0.02, batch: int = 20_000) -> tuple[np.ndarray, np.ndarray]:
    """Ground height at (Q, 2) positions from (N, 3) ground candidates.

    Per query a plane through its nearest points, Gaussian weights of ``bandwidth_m`` (or of the distance to the
    neighbours where they are farther), re-weighted four times by an M-estimate that trusts low residuals longer than
    high ones: litter, grass and stem bases lie above the ground, almost nothing below. Returns ``(heights, support)``:
    (Q,) metres and (Q,) distance to the nearest point.
    """
    points = np.asarray(points, float)
    query_xy = np.asarray(query_xy, float)
    tree = cKDTree(points[:, :2])
    k = min(neighbours, len(points))
    heights, support = np.empty(len(query_xy)), np.empty(len(query_xy))
    for low in range(0, len(query_xy), batch):
        here = query_xy[low:low + batch]
        distance, index = tree.query(here, k=k)
        distance, index = distance.reshape(len(here), k), index.reshape(len(here), k)
        support[low:low + batch] = distance[:, 0]
        # Where points are sparse, the bandwidth opens to take in a third of the neighbours.
        width = np.maximum(bandwidth_m, distance[:, min(k - 1, max(k // 3, 3))])[:, None]
        heights[low:low + batch] = _planes(here, points[index], np.exp(-0.5 * (distance / width) ** 2), width, noise_m)
    return heights, support


def _planes(xy: np.ndarray, near: np.ndarray, kernel: np.ndarray, width: np.ndarray, noise_m: float) -> np.ndarray:
    u = (near[..., 0] - xy[:, :1]) / width
    v = (near[..., 1] - xy[:, 1:]) / width
    base = np.median(near[..., 2], axis=1, keepdims=True)
    z = near[..., 2] - base
    basis = np.stack([np.ones_like(u), u, v], axis=-1)
    weight = kernel.copy()
    # A weak pull of the slope to level keeps one-sided neighbourhoods from swinging the plane.
    ridge = np.diag([0.0, 0.05, 0.05])
    for step in range(5):
        weighted = basis * weight[..., None]
        normal = np.einsum("nki,nkj->nij", weighted, basis) + ridge * weight.sum(axis=1)[:, None, None]
        normal[:, 0, 0] += 1e-12
        right = np.einsum("nki,nk->ni", weighted, z)
        plane = np.linalg.solve(normal, right[..., None])[..., 0]
        if step == 4:
            break
        residual = z - np.einsum("nki,ni->nk", basis, plane)
        spread = 1.4826 * np.median(np.abs(residual), axis=1, keepdims=True)
        scale = np.clip(spread, noise_m, 0.15)
        cut = np.where(residual > 0, 2.0, 4.0) * scale
        weight = kernel * np.clip(1 - (residual / cut) ** 2, 0, None) ** 2 + 1e-9
    return plane[:, 0] + base[:, 0]


def cell_quantile(points: np.ndarray, cell_m: float, quantile: float, corner: np.ndarray | None = None) -> np.ndarray:
    """The point at a height quantile of each grid cell: (N, 3) -> (M, 3), one a cell.

    corner: (2,) a corner of the lattice at or below the points' minimum (default: that minimum).
    """
    points = np.asarray(points, float)
    if not len(points):
        return np.empty((0, 3))
    corner = points[:, :2].min(axis=0) if corner is None else np.asarray(corner, float)
    cell = np.floor((points[:, :2] - corner) / cell_m).astype(np.int64)
    key = cell[:, 0] * (cell[:, 1].max() + 1) + cell[:, 1]
    order = np.lexsort((points[:, 2], key))
    starts = np.flatnonzero(np.r_[True, np.diff(key[order]) != 0])
    counts = np.diff(np.r_[starts, len(order)])
    return points[order[starts + np.floor(quantile * (counts - 1) + 0.5).astype(int)]]


def grid_ground(points: np.ndarray, resolution_m: float, neighbours: int = 40, bandwidth_m: float = 1.0,
                noise_m: float = 0.02, reach_m: float = 10.0, bounds: tuple[np.ndarray, np.ndarray] | None = None,
                crs=None) -> Dtm:
    """(N, 3) ground points -> a :class:`Dtm` over their extent (or ``bounds`` = xy minimum, xy maximum).

    Cells farther than ``reach_m`` from any ground point stay unknown. The distance to the nearest ground point is kept
    as ``support``. ``crs``: CRS of the points, if any.
    """
    low, high = bounds if bounds is not None else (points[:, :2].min(axis=0), points[:, :2].max(axis=0))
    transform, rows, cols = grid_over(low, high, resolution_m)
    empty = Dtm(np.full((rows, cols), np.nan), transform, crs)
    x, y = empty.centres()
    heights, support = local_ground(np.column_stack([x.ravel(), y.ravel()]), points, neighbours, bandwidth_m, noise_m)
    heights[support > reach_m] = np.nan
    return Dtm(heights.reshape(rows, cols), transform, crs, support.reshape(rows, cols))
