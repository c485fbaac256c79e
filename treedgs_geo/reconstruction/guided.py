"""Matching guided by predicted geometry: known points are looked for where a photo's pose says they must be.

Among the few features there the descriptors have little to decide, so photos that plain SIFT matching loses (moved
shadows, wide angles)
still find the points, at a fraction of the cost. A point is described by the photo that saw it from the nearest
direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from .poses import nearest_rotation
from .tracks import Block

#: Largest squared descriptor distance (SIFT bytes have norm 512): an angle of 0.7 rad.
MAX_SQUARED = int(2 * (1 - np.cos(0.7)) * 512**2)
CELL_PX = 16


@dataclass(frozen=True)
class PointMatches:
    """point (K,), key (K,): known point and keypoint of the photo; distance (K,) squared descriptor distance."""

    point: np.ndarray
    key: np.ndarray
    distance: np.ndarray


def find_points(
    block: Block,
    descriptors: list[np.ndarray],
    i: int,
    rotation: np.ndarray,
    translation: np.ndarray,
    radius_px: float,
    ratio: float,
    max_angle_deg: float = 40.0,
) -> PointMatches:
    """Known points in photo i under a predicted pose, one to one.

    Args:
        rotation, translation: predicted world -> camera. radius_px: how far the prediction may be off. ratio: of
        descriptor distances, best to second best inside the radius. max_angle_deg: a point is not looked for from
        further off its seen directions.
    """
    camera = block.camera
    pixels = block.view(i, rotation, translation).project(block.points)[0]
    inside = (pixels > -radius_px).all(axis=1) & (pixels < [camera.width + radius_px, camera.height + radius_px]).all(
        axis=1
    )
    # The observation from the nearest direction describes the point best.
    centre = -rotation.T @ translation
    rays = block.points - centre
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    seen = block.points[block.point] - block.centres[block.image]
    seen /= np.linalg.norm(seen, axis=1, keepdims=True)
    closeness = np.sum(seen * rays[block.point], axis=1)
    closeness[block.image == i] = -1
    order = np.lexsort((closeness, block.point))
    last = np.flatnonzero(np.diff(block.point[order], append=-1))
    source = np.full(len(block.points), -1)
    source[block.point[order[last]]] = order[last]
    usable = np.flatnonzero(inside & (source >= 0))
    usable = usable[closeness[source[usable]] > np.cos(np.radians(max_angle_deg))]
    keypoints = block.keypoints[i]
    if not len(usable) or not len(keypoints):
        empty = np.empty(0, np.int64)
        return PointMatches(empty, empty.copy(), empty.copy())
    rows = source[usable]
    described = np.empty((len(usable), 128), np.uint8)
    for image in np.unique(block.image[rows]):
        own = block.image[rows] == image
        described[own] = descriptors[image][block.key[rows[own]]]
    best, distance = _search(
        pixels[usable],
        described,
        keypoints,
        descriptors[i],
        *grid_cells(keypoints, camera.width, camera.height),
        radius_px,
        ratio * ratio,
        MAX_SQUARED,
    )
    found = one_to_one(best, distance)
    return PointMatches(usable[found], best[found], distance[found])


def turn_to_points(
    points: np.ndarray,
    rays: np.ndarray,
    centre: np.ndarray,
    tolerance: float,
    rng: np.random.Generator,
    trials: int = 400,
    max_turn_deg: float | None = None,
    near: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray] | None:
    """The rotation that most point-ray pairs agree with, the camera standing at ``centre`` (RANSAC over two pairs).

    With the position known from PPK only the rotation is sought, so that a tenth of right matches is enough.

    Args:
        points: (K, 3) world. rays: (K, 3) unit, camera frame. tolerance: of the angle, radians. max_turn_deg, near:
        only rotations
            within this angle of ``near``.

    Returns:
        (3, 3) world -> camera and the (K,) inlier mask, None when fewer than 3 agree.
    """
    count = len(points)
    if count < 3:
        return None
    world = points - centre
    world /= np.linalg.norm(world, axis=1, keepdims=True)
    pick = rng.integers(0, count, (trials, 2))
    pick = pick[pick[:, 0] != pick[:, 1]]
    apart = np.linalg.norm(np.cross(world[pick[:, 0]], world[pick[:, 1]]), axis=1)
    pick = pick[apart > 5 * tolerance]
    if not len(pick):
        return None

    def triad(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        first = a
        third = np.cross(a, b)
        third /= np.linalg.norm(third, axis=1, keepdims=True)
        return np.stack([first, np.cross(third, first), third], axis=2)

    with np.errstate(invalid="ignore", divide="ignore"):
        rotations = triad(rays[pick[:, 0]], rays[pick[:, 1]]) @ triad(world[pick[:, 0]], world[pick[:, 1]]).transpose(
            0, 2, 1
        )
    rotations = rotations[np.isfinite(rotations).all(axis=(1, 2))]
    if near is not None and max_turn_deg is not None and len(rotations):
        trace = np.einsum("nij,ij->n", rotations, near)
        rotations = rotations[np.degrees(np.arccos(np.clip((trace - 1) / 2, -1, 1))) <= max_turn_deg]
    if not len(rotations):
        return None
    off = np.linalg.norm(np.einsum("nij,kj->nki", rotations, world) - rays, axis=2)
    best = rotations[(off < tolerance).sum(axis=1).argmax()]
    for _ in range(5):
        inliers = np.linalg.norm(world @ best.T - rays, axis=1) < tolerance
        if inliers.sum() < 3:
            return None
        best = nearest_rotation(rays[inliers].T @ world[inliers])
    return best, np.linalg.norm(world @ best.T - rays, axis=1) < tolerance


def one_to_one(best: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Ascending numbers of those that keep what they chose: of several with the same choice the closest.

    best: (K,) choice of each, -1 for none. distance: (K,) of the descriptors.
    """
    found = np.flatnonzero(best >= 0)
    found = found[np.argsort(distance[found], kind="stable")]
    _, first = np.unique(best[found], return_index=True)
    return np.sort(found[first])


def grid_cells(keypoints: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray, int, int]:
    """Keypoints sorted into cells: order, start of each cell, columns, rows."""
    columns, rows = width // CELL_PX + 1, height // CELL_PX + 1
    cell = (
        np.clip(keypoints[:, 1] // CELL_PX, 0, rows - 1) * columns + np.clip(keypoints[:, 0] // CELL_PX, 0, columns - 1)
    ).astype(np.int64)
    order = np.argsort(cell, kind="stable")
    starts = np.searchsorted(cell[order], np.arange(columns * rows + 1))
    return order, starts, columns, rows


@numba.njit(cache=True, parallel=True)
def _search(pixels, described, points, others, order, starts, columns, rows, radius, ratio2, limit):
    count = len(pixels)
    best = np.full(count, -1, np.int64)
    distance = np.full(count, 2_000_000_000, np.int64)
    for k in numba.prange(count):
        x, y = pixels[k, 0], pixels[k, 1]
        c0, c1 = max(int((x - radius) // CELL_PX), 0), min(int((x + radius) // CELL_PX), columns - 1)
        r0, r1 = max(int((y - radius) // CELL_PX), 0), min(int((y + radius) // CELL_PX), rows - 1)
        first, second, who = limit, limit, -1
        for r in range(r0, r1 + 1):
            for place in range(starts[r * columns + c0], starts[r * columns + c1 + 1] if c1 >= c0 else 0):
                q = order[place]
                if (points[q, 0] - x) ** 2 + (points[q, 1] - y) ** 2 > radius * radius:
                    continue
                total = np.int64(0)
                for b in range(128):
                    step = np.int32(described[k, b]) - np.int32(others[q, b])
                    total += step * step
                if total < first:
                    first, second, who = total, first, q
                elif total < second:
                    second = total
        if who >= 0 and first < ratio2 * second:
            best[k] = who
            distance[k] = first
    return best, distance
