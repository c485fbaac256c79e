"""Small patches that close the surface of a scanned cloud without making it thicker."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from scipy.spatial import cKDTree

#: Neighbours that say how a surface lies about a point, and the one whose distance says how dense the points are.
NEIGHBOURS, DENSITY_OF = 32, 8
#: Half side of a patch in distances of that neighbour: of points strewn on a plane 3 % is left open, and what is
#: behind it is bark too.
REACH = 0.55
#: Most cells along a patch's side.
MAX_CELLS = 5
#: How often points are first moved onto the surface that their neighbours imply, and over what reach they count, m.
SMOOTHED, REACH_M = 2, 0.02
#: Half sides of patches, least and most of surfaces and most of twigs and needles, m; points are of a surface only
#: where the neighbour is this near, m.
MIN_M, MAX_M, TWIG_M, SURFACE_M = 0.006, 0.045, 0.012, 0.12
#: Surfaces: the second spread about a point is this many times the third; of points that are not smoothed first, which
#: are mostly crowns, more, and their patches are smaller, m.
FLAT, ROUGH_FLAT, ROUGH_MAX_M = 2.5, 6.0, 0.03


class Surfels(NamedTuple):
    """corners: (F, 3, 3) float32, m. point: (F,) point of each triangle. flat: (N,) bool, points of surfaces (bark,
    boards), not of twigs and needles. normal: (N, 3) unit, of either sign."""

    corners: np.ndarray
    point: np.ndarray
    flat: np.ndarray
    normal: np.ndarray


def surfels(points: np.ndarray, rng: np.random.Generator, cell_m: float) -> Surfels:
    """One square patch a point (N, 3), turned at random in the surface, its corners moved onto the surface.

    cell_m: patches of surfaces are bent in cells of this size; infinite: not bent, and the points stay where they are.
    """
    if len(points) <= NEIGHBOURS:
        none = np.zeros((0, 3, 3), np.float32), np.zeros(0, int)
        return Surfels(*none, np.zeros(len(points), bool), np.zeros(points.shape))
    smooth = bool(np.isfinite(cell_m))
    distance, near = cKDTree(points).query(points, NEIGHBOURS, workers=2)
    half = np.clip(REACH * distance[:, DENSITY_OF], MIN_M, MAX_M if smooth else ROUGH_MAX_M)
    spread, axes = _spread(points, near, half)
    for _ in range(SMOOTHED if smooth else 0):
        moved = points[:, None].copy()
        _settle(moved, np.arange(len(points)), points, axes[:, :, 0], near, half)
        points = moved[:, 0]
        spread, axes = _spread(points, near, half)
    normal = axes[:, :, 0]
    flat = (spread[:, 1] > (FLAT if smooth else ROUGH_FLAT) * spread[:, 0]) & (distance[:, DENSITY_OF] < SURFACE_M)
    # Single points of a surface that seem not to be of one are; and the other way round.
    flat = flat[near[:, :DENSITY_OF]].mean(axis=1) > 0.5
    half = np.where(flat, half, np.minimum(half, TWIG_M))
    turn = rng.uniform(0, 2 * np.pi, len(points))[:, None]
    first = np.cos(turn) * axes[:, :, 1] + np.sin(turn) * axes[:, :, 2]
    second = np.cross(normal, first)
    cells = np.where(flat, np.clip(np.ceil(2 * half / cell_m), 1, MAX_CELLS), 1).astype(int)
    corners, owner = [], []
    for count in np.unique(cells):
        own = np.flatnonzero(cells == count)
        step = np.linspace(-1, 1, count + 1)
        a, b = (part.ravel() for part in np.meshgrid(step, step))
        grid = points[own, None] + half[own, None, None] * (
            a[:, None] * first[own, None] + b[:, None] * second[own, None]
        )
        _settle(grid, own, points, normal, near, half)
        node = np.arange((count + 1) ** 2).reshape(count + 1, count + 1)
        p, q, r, s = (part.ravel() for part in (node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]))
        faces = np.concatenate([np.column_stack([p, q, r]), np.column_stack([p, r, s])])
        corners.append(grid[:, faces].reshape(-1, 3, 3).astype(np.float32))
        owner.append(np.repeat(own, len(faces)))
    return Surfels(np.concatenate(corners), np.concatenate(owner), flat, normal)


def _spread(points: np.ndarray, near: np.ndarray, half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(N, 3) variances of each point's neighbours, smallest first, and (N, 3, 3) their axes, in columns; the nearer
    ones count for more, so that those of a thin scan do not reach round the stem."""
    spread, axes = np.empty((len(points), 3)), np.empty((len(points), 3, 3))
    for start in range(0, len(points), 100_000):
        own = slice(start, start + 100_000)
        about = points[near[own]]
        square = ((about - points[own, None]) ** 2).sum(axis=2)
        weight = np.exp(-square / (2 * np.maximum(half[own, None], REACH_M) ** 2))
        weight /= weight.sum(axis=1, keepdims=True)
        about = about - np.einsum("nk,nki->ni", weight, about)[:, None]
        spread[own], axes[own] = np.linalg.eigh(np.einsum("nk,nki,nkj->nij", weight, about, about, optimize=True))
    return spread, axes


@numba.njit(parallel=True, cache=True)
def _settle(grid, own, points, normal, near, half):
    """Move the corners ``grid`` (n, c, 3) of patches ``own`` (n,) onto the surface that their points' neighbours imply,
    in place: on a circle the chord between two points is at right angles to the mean of their normals. So curved
    surfaces keep their width, and the neighbours' noise is averaged."""
    for k in numba.prange(len(own)):
        i = own[k]
        scale = 1.0 / (2.0 * max(half[i], REACH_M) ** 2)
        for c in range(grid.shape[1]):
            weights = np.empty(near.shape[1])
            towards = np.zeros(3)
            for m in range(near.shape[1]):
                j = near[i, m]
                cosine, square = 0.0, 0.0
                for a in range(3):
                    cosine += normal[i, a] * normal[j, a]
                    square += (grid[k, c, a] - points[j, a]) ** 2
                # Signed, so that normals of either sign count alike; surfaces across it hardly.
                weights[m] = (np.exp(-square * scale) + 1e-9) * cosine * abs(cosine)
                for a in range(3):
                    towards[a] += weights[m] * normal[j, a]
            length = np.sqrt((towards**2).sum())
            if length < 1e-12:
                continue
            towards /= length
            total, moved = 0.0, 0.0
            for m in range(near.shape[1]):
                j = near[i, m]
                sign = 1.0 if weights[m] >= 0 else -1.0
                mean = towards + sign * normal[j]
                mean /= max(np.sqrt((mean**2).sum()), 1e-9)
                total += abs(weights[m])
                moved += abs(weights[m]) * (mean * (grid[k, c] - points[j])).sum()
            moved = min(max(moved / total, -half[i]), half[i])
            grid[k, c] -= moved * towards
