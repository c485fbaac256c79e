"""Rotations of photos that share no match with the adjusted ones: matches among themselves, the terrain, and the gimbal.

With positions known from PPK each photo has three unknowns. A match of two such photos says one thing about them (their rays must
meet); that it lies on the ground, which the other flight mapped, says another; the gimbal says the rest to half a degree. Least squares over
all photos, robust, because a third of the matches is wrong and some lie in the crowns.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from .tracks import Block

#: Standard deviation of a gimbal angle, radians.
GIMBAL_SD = np.radians(0.5)


def ground_surface(points: np.ndarray, neighbours: int = 25) -> Callable[[np.ndarray], np.ndarray]:
    """Height of the ground at (K, 2) places from (P, 3) sparse points: the lower quartile of the nearest ``neighbours``."""
    tree = cKDTree(points[:, :2])

    def height(xy: np.ndarray) -> np.ndarray:
        _, near = tree.query(xy, k=min(neighbours, len(points)))
        return np.percentile(points[near, 2], 25, axis=1)

    return height


def settle_rotations(block: Block, matches: dict[tuple[int, int], np.ndarray], centres: np.ndarray, guess: np.ndarray,
                     ground: Callable[[np.ndarray], np.ndarray], scale_px: float, scale_m: float) -> np.ndarray:
    """(N, 3, 3) rotations of the photos that ``matches`` join, NaN elsewhere.

    Args:
        centres: (N, 3) known positions. guess: (N, 3, 3) gimbal rotations. scale_px, scale_m: residuals beyond these count as wrong
            matches (Cauchy), in the image and above or below ``ground``.
    """
    photos = np.unique([p for pair, found in matches.items() if len(found) for p in pair]).astype(int)
    place = {int(photo): k for k, photo in enumerate(photos)}
    first, second, rays_a, rays_b = [], [], [], []
    for (i, j), found in matches.items():
        first.append(np.full(len(found), place[i]))
        second.append(np.full(len(found), place[j]))
        rays_a.append(_rays(block, i, found[:, 0]))
        rays_b.append(_rays(block, j, found[:, 1]))
    a, b = np.concatenate(first), np.concatenate(second)
    own_a, own_b = np.concatenate(rays_a), np.concatenate(rays_b)
    position = centres[photos]
    baseline = position[b] - position[a]
    length = np.linalg.norm(baseline, axis=1)
    focal = block.camera.fx
    start = guess[photos]

    def turned(angles: np.ndarray) -> np.ndarray:
        return _small_rotations(angles.reshape(-1, 3)) @ start

    def residuals(angles: np.ndarray) -> np.ndarray:
        rotations = turned(angles)
        world_a = np.einsum("mji,mj->mi", rotations[a], own_a)
        world_b = np.einsum("mji,mj->mi", rotations[b], own_b)
        normal = np.cross(world_a, world_b)
        size = np.linalg.norm(normal, axis=1)
        # Distance between the two rays over the range: the error in the image.
        gap = np.sum(baseline * normal, axis=1) / np.maximum(size, 1e-9)
        reach = np.sum(np.cross(baseline, world_b) * normal, axis=1) / np.maximum(size, 1e-9) ** 2
        reach = np.clip(reach, 5.0, 500.0)
        point = position[a] + reach[:, None] * world_a
        height = point[:, 2] - ground(point[:, :2])
        # A flat intersection knows its height badly: its scale grows with range over baseline.
        flat = scale_m * np.maximum(1.0, 0.2 * reach / np.maximum(length, 1.0))
        return np.concatenate([gap / reach * focal / scale_px, height / flat, angles / GIMBAL_SD])

    solved = least_squares(residuals, np.zeros(3 * len(photos)), loss="cauchy", x_scale=GIMBAL_SD, max_nfev=25, jac_sparsity=_sparsity(a, b, len(photos)))
    rotations = np.full_like(guess, np.nan)
    rotations[photos] = turned(solved.x)
    return rotations


def _rays(block: Block, photo: int, keys: np.ndarray) -> np.ndarray:
    pixels = block.keypoints[photo][keys]
    x, y = block.camera.undistort(pixels[:, 0], pixels[:, 1])
    rays = np.column_stack([x, y, np.ones_like(x)])
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def _small_rotations(angles: np.ndarray) -> np.ndarray:
    """(K, 3) rotation vectors -> (K, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(angles).as_matrix()


def _sparsity(a: np.ndarray, b: np.ndarray, count: int):  # noqa: ANN202 - scipy sparse
    from scipy.sparse import identity, lil_matrix, vstack

    pattern = lil_matrix((len(a), 3 * count), dtype=np.int8)
    rows = np.arange(len(a))
    for k in range(3):
        pattern[rows, 3 * a + k] = 1
        pattern[rows, 3 * b + k] = 1
    return vstack([pattern, pattern, identity(3 * count, dtype=np.int8)])
