"""A ground surface from noisy points: local planes, robust, leaning low because what is not ground is above it."""

from __future__ import annotations

import numpy as np
import pyproj
from numba import njit
from scipy.spatial import cKDTree

from ..core.machine import in_threads, require_memory
from ..pointcloud.cloud import by_key, extent, slices
from .dtm import Dtm, grid_over

#: Positions that a thread answers at once.
_BATCH = 20_000
#: Memory of a cell while a grid is made: its place, height and support.
_CELL_BYTES = 80


def local_ground(
    query_xy: np.ndarray, points: np.ndarray, neighbours: int = 40, bandwidth_m: float = 1.0, noise_m: float = 0.02
) -> tuple[np.ndarray, np.ndarray]:
    """Ground height at (Q, 2) positions from (N, 3) ground candidates.

    Per query a plane through its nearest points, Gaussian weights of ``bandwidth_m`` (or of the distance to the
    neighbours where they are farther), re-weighted four times by an M-estimate that trusts low residuals longer than
    high ones: litter, grass and stem bases lie above the ground, almost nothing below. Returns ``(heights, support)``:
    (Q,) metres and (Q,) distance to the nearest point.
    """
    points = np.asarray(points, float)
    query_xy = np.ascontiguousarray(query_xy, float)
    tree = cKDTree(points[:, :2])
    k = min(neighbours, len(points))
    heights, support = np.empty(len(query_xy)), np.empty(len(query_xy))

    def answer(low: int) -> None:
        here = query_xy[low : low + _BATCH]
        distance, index = tree.query(here, k=k)
        distance, index = distance.reshape(len(here), k), index.reshape(len(here), k)
        support[low : low + _BATCH] = distance[:, 0]
        # Where points are sparse, the bandwidth opens to take in a third of the neighbours.
        width = np.maximum(bandwidth_m, distance[:, min(k - 1, max(k // 3, 3))])
        kernel = np.exp(-0.5 * (distance / width[:, None]) ** 2)
        heights[low : low + _BATCH] = _planes(here, points[index], kernel, width, noise_m)

    for _ in in_threads(answer, range(0, len(query_xy), _BATCH)):
        pass
    return heights, support


@njit(cache=True, nogil=True)
def _planes(xy, near, kernel, width, noise_m):  # pragma: no cover - compiled
    """(Q,) heights at (Q, 2) xy of planes through (Q, K, 3) points with (Q, K) weights; width: (Q,) metres."""
    queries, k = kernel.shape
    out = np.empty(queries)
    u, v, z, residual, weight = np.empty(k), np.empty(k), np.empty(k), np.empty(k), np.empty(k)
    spare = np.empty(k)
    for q in range(queries):
        for m in range(k):
            spare[m] = near[q, m, 2]
        base = np.median(spare)
        for m in range(k):
            u[m], v[m] = (near[q, m, 0] - xy[q, 0]) / width[q], (near[q, m, 1] - xy[q, 1]) / width[q]
            z[m], weight[m] = near[q, m, 2] - base, kernel[q, m]
        for step in range(5):
            n0, nu, nv, uu, uv, vv, r0, ru, rv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for m in range(k):
                wu, wv = weight[m] * u[m], weight[m] * v[m]
                n0, nu, nv = n0 + weight[m], nu + wu, nv + wv
                uu, uv, vv = uu + wu * u[m], uv + wu * v[m], vv + wv * v[m]
                r0, ru, rv = r0 + weight[m] * z[m], ru + wu * z[m], rv + wv * z[m]
            # A weak pull of the slope to level keeps one-sided neighbourhoods from swinging the plane.
            uu, vv = uu + 0.05 * n0, vv + 0.05 * n0
            n0 += 1e-12
            # The slopes about the weighted middle, two by two; then the height at the query.
            auu, auv, avv = uu - nu * nu / n0, uv - nu * nv / n0, vv - nv * nv / n0
            bu, bv = ru - nu * r0 / n0, rv - nv * r0 / n0
            det = auu * avv - auv * auv
            su, sv = (avv * bu - auv * bv) / det, (auu * bv - auv * bu) / det
            height = (r0 - nu * su - nv * sv) / n0
            if step == 4:
                break
            for m in range(k):
                residual[m] = z[m] - height - su * u[m] - sv * v[m]
                spare[m] = abs(residual[m])
            scale = min(max(1.4826 * np.median(spare), noise_m), 0.15)
            for m in range(k):
                share = residual[m] / ((2.0 if residual[m] > 0 else 4.0) * scale)
                weight[m] = kernel[q, m] * max(1.0 - share * share, 0.0) ** 2 + 1e-9
        out[q] = height + base
    return out


def cell_quantile(points: np.ndarray, cell_m: float, quantile: float, corner: np.ndarray | None = None) -> np.ndarray:
    """The point at a height quantile of each grid cell: (N, 3) -> (M, 3), one a cell.

    corner: (2,) a corner of the lattice at or below the points' minimum (default: that minimum).
    """
    points = np.asarray(points, float)
    if not len(points):
        return np.empty((0, 3))
    corner = extent(points[:, :2])[0] if corner is None else np.asarray(corner, float)
    parts = list(slices(len(points)))
    if quantile == 0.0 and len(parts) > 1:  # the lowest of the parts' lowest, in the memory of a part
        points = np.concatenate([cell_quantile(points[part], cell_m, 0.0, corner) for part in parts])
    key = _cell_keys(points, corner, float(cell_m))
    _, key = np.unique(key, return_inverse=True) if key.max() > 4 * len(key) + 1000 else (None, key)
    z = np.ascontiguousarray(points[:, 2])
    return points[_lowest(z, key) if quantile == 0.0 else _quantiles(z, key, quantile)]


@njit(cache=True)
def _cell_keys(points, corner, cell_m):  # pragma: no cover - compiled
    """(N,) numbers of the cells that (N, 3) points lie in, row by row of the lattice from ``corner``."""
    key = np.empty(len(points), np.int64)
    last = 0
    for m in range(len(points)):
        last = max(last, int(np.floor((points[m, 1] - corner[1]) / cell_m)))
    for m in range(len(points)):
        row = int(np.floor((points[m, 0] - corner[0]) / cell_m))
        key[m] = row * (last + 1) + int(np.floor((points[m, 1] - corner[1]) / cell_m))
    return key


@njit(cache=True)
def _lowest(z, key):  # pragma: no cover - compiled
    """:func:`_quantiles` for the lowest."""
    chosen = np.full(key.max() + 1, -1, np.int64)
    for m in range(len(key)):
        held = chosen[key[m]]
        if held < 0 or z[m] < z[held]:
            chosen[key[m]] = m
    return chosen[chosen >= 0]


@njit(cache=True)
def _quantiles(z, key, quantile):  # pragma: no cover - compiled
    """Index of the point at a quantile of ``z`` among those that share a key (small integers), by key."""
    order, starts = by_key(key, key.max() + 1)
    chosen = np.empty(len(starts) - 1, np.int64)
    count = 0
    for k in range(len(starts) - 1):
        here = order[starts[k] : starts[k + 1]]
        if len(here) == 0:
            continue
        rank = int(np.floor(quantile * (len(here) - 1) + 0.5))
        chosen[count] = here[np.argsort(z[here], kind="mergesort")[rank]]
        count += 1
    return chosen[:count].copy()


def grid_ground(
    points: np.ndarray,
    resolution_m: float,
    neighbours: int = 40,
    bandwidth_m: float = 1.0,
    noise_m: float = 0.02,
    reach_m: float = 10.0,
    bounds: tuple[np.ndarray, np.ndarray] | None = None,
    crs: pyproj.CRS | None = None,
) -> Dtm:
    """(N, 3) ground points -> a :class:`Dtm` over their extent (or ``bounds`` = xy minimum, xy maximum).

    Cells farther than ``reach_m`` from any ground point stay unknown. The distance to the nearest ground point is kept
    as ``support``. ``crs``: CRS of the points, if any.
    """
    low, high = bounds if bounds is not None else extent(points[:, :2])
    transform, rows, cols = grid_over(low, high, resolution_m)
    require_memory(
        _CELL_BYTES * rows * cols,
        f"Terrain: a grid of {cols:,} x {rows:,} cells of {resolution_m:g} m",
        "cut the cloud to the plot, or remove points far off",
    )
    empty = Dtm(np.full((rows, cols), np.nan), transform, crs)
    x, y = empty.centres()
    heights, support = local_ground(np.column_stack([x.ravel(), y.ravel()]), points, neighbours, bandwidth_m, noise_m)
    heights[support > reach_m] = np.nan
    return Dtm(heights.reshape(rows, cols), transform, crs, support.reshape(rows, cols))
