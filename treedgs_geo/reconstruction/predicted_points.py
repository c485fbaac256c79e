"""Matching guided by predicted geometry: known points are looked for where a photo's pose says they must be.

Among the few features there the descriptors have little to decide, so photos that plain SIFT matching loses (moved
shadows, wide angles)
still find the points, at a fraction of the cost. A point is described by the photo that saw it from the nearest
direction.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numba import njit

from ..core.machine import EXACT
from .cameras import View
from .poses import nearest_rotation
from .tracks import Block

#: Largest squared descriptor distance (SIFT bytes have norm 512): an angle of 0.7 rad.
MAX_SQUARED = int(2 * (1 - np.cos(0.7)) * 512**2)
CELL_PX = 16
#: A point is not looked for from further off the directions it was seen from.
MAX_ANGLE_DEG = 40.0


def find_points(
    block: Block,
    descriptors: list[np.ndarray],
    i: int,
    rotation: np.ndarray,
    translation: np.ndarray,
    radius_px: float,
    ratio: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Known points in photo i under a predicted pose, one to one: (K,) their numbers, (K,) keypoints of the photo.

    Args:
        rotation, translation: predicted world -> camera. radius_px: how far the prediction may be off. ratio: of
        descriptor distances, best to second best inside the radius.
    """
    camera = block.camera
    view = replace(block.view(i), rotation=rotation, translation=translation)
    near = _in_field(view, block.points, radius_px)
    pixels = np.full((len(near), 2), np.nan)
    pixels[near] = view.project(block.points[near])[0]
    inside = (pixels > -radius_px).all(axis=1) & (pixels < [camera.width + radius_px, camera.height + radius_px]).all(
        axis=1
    )
    # The observation from the nearest direction describes the point best.
    centre = -rotation.T @ translation
    source, closeness = _nearest_seen(block.points, inside, block.centres, block.image, block.point, i, centre)
    usable = np.flatnonzero(inside & (source >= 0))
    usable = usable[closeness[usable] > np.cos(np.radians(MAX_ANGLE_DEG))]
    keypoints = block.keypoints[i]
    if not len(usable) or not len(keypoints):
        return np.empty(0, np.int64), np.empty(0, np.int64)
    rows = source[usable]
    described = np.empty((len(usable), 128), np.uint8)
    order = np.argsort(block.image[rows], kind="stable")
    images, starts = np.unique(block.image[rows[order]], return_index=True)
    for image, own in zip(images, np.split(order, starts[1:]), strict=True):
        described[own] = descriptors[image][block.key[rows[own]]]
    features = Features(keypoints, descriptors[i], camera.width, camera.height)
    ends = np.hstack([pixels[usable], pixels[usable]])
    best, distance = search(ends, described, squares(described), features, radius_px, ratio)
    found = one_to_one(best, distance)
    return usable[found], features.order[best[found]]


#: Sectors of the circle by which features are sorted that have a direction, and so many on each side of the expected
#: one are looked in: up to 20 to 30 degrees. Of right matches on ``plot_a`` 98 % lie within 17.
SECTORS, BESIDE = 36, 2
#: Cells of features sorted by direction, pixels; at most so many columns.
WIDE_CELL_PX, MAX_COLUMNS = 32, 48


class Features:
    """The features of one photo in the order of cells. order (K,): their numbers as they were given. xy (K, 2) pixels,
    described (K, 128), square (K,): of the descriptors. starts: where each cell of each kind begins. grid: columns,
    rows, pixels of a cell, sectors. Where ``turned`` and ``bright`` (:class:`.sift.PhotoFeatures`) are given, features
    of other directions and of the other sign are of other kinds."""

    def __init__(
        self,
        keypoints: np.ndarray,
        descriptors: np.ndarray,
        width: int,
        height: int,
        turned: np.ndarray | None = None,
        bright: np.ndarray | None = None,
    ) -> None:
        if turned is not None and bright is not None:
            size, sectors, of_all = max(WIDE_CELL_PX, -(-width // MAX_COLUMNS)), SECTORS, 2 * SECTORS
            self.kind = kinds(turned, bright)
        else:
            size, sectors, of_all = CELL_PX, 1, 1
            self.kind = np.zeros(len(keypoints), np.int64)
        columns, rows = width // size + 1, height // size + 1
        self.grid = columns, rows, size, sectors
        row = np.clip(keypoints[:, 1] // size, 0, rows - 1)
        cell = (row * columns + np.clip(keypoints[:, 0] // size, 0, columns - 1)).astype(np.int64)
        cell += self.kind * (columns * rows)
        self.order = np.argsort(cell, kind="stable")
        self.kind = self.kind[self.order]
        self.starts = np.searchsorted(cell[self.order], np.arange(columns * rows * of_all + 1))
        self.xy = np.ascontiguousarray(keypoints[self.order])
        self.described = np.ascontiguousarray(descriptors[self.order])
        self.square = squares(self.described)


def kinds(turned: np.ndarray, bright: np.ndarray) -> np.ndarray:
    """(K,) sector of directions (K,), radians, and sign (K,) of features as one number."""
    sector = (np.nan_to_num(turned) * (SECTORS / (2 * np.pi))).astype(np.int64) % SECTORS
    return bright.astype(np.int64) * SECTORS + sector


def squares(described: np.ndarray) -> np.ndarray:
    """(K,) squared lengths of descriptors (K, 128)."""
    # Below 2 ** 24: exact in float32.
    values = described.astype(np.float32)
    return np.einsum("kd,kd->k", values, values).astype(np.int64)


def search(
    ends: np.ndarray,
    described: np.ndarray,
    square: np.ndarray,
    features: Features,
    reach_px: float,
    ratio: float,
    kind: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Best of a photo's features for each of K descriptors: its number in the order of cells or -1, and their squared
    distance.

    ends: (K, 4) pixels x, y, x, y: a line on which it lies, to within ``reach_px``; NaN: nowhere. described (K, 128),
    square (K,) as :func:`squares`. ratio: of descriptor distances, best to second best along the line. kind: (K,) of
    :func:`kinds`, as expected in that photo; ``None`` where its features are not sorted so.
    """
    if kind is None:
        kind = np.zeros(len(ends), np.int64)
    others = features.xy, features.described, features.square, features.starts
    return _search(ends, described, square, kind, others, features.grid, float(reach_px), ratio * ratio, MAX_SQUARED)


def turn_to_points(
    points: np.ndarray,
    rays: np.ndarray,
    centre: np.ndarray,
    tolerance: float,
    rng: np.random.Generator,
    near: np.ndarray,
    max_turn_deg: float,
    trials: int = 400,
) -> tuple[np.ndarray, np.ndarray] | None:
    """The rotation that most point-ray pairs agree with, the camera standing at ``centre`` (RANSAC over two pairs).

    With the position known from PPK only the rotation is sought, so that a tenth of right matches is enough.

    Args:
        points: (K, 3) world. rays: (K, 3) unit, camera frame. tolerance: of the angle, radians. near, max_turn_deg:
            only rotations within this angle of ``near``.

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


def _in_field(view: View, points: np.ndarray, reach_px: float) -> np.ndarray:
    """(P,) bool: points (P, 3) that may lie in a photo or within ``reach_px`` of it; somewhat more than do."""
    camera = view.camera
    u = np.linspace(-reach_px, camera.width + reach_px, 5)
    v = np.linspace(-reach_px, camera.height + reach_px, 5)
    x, y = camera.undistort(*(side.ravel() for side in np.meshgrid(u, v)))
    # A tenth more: the photo's borders between these places, and what it moved while it was read.
    across, down = 1.1 * np.abs(x).max(), 1.1 * np.abs(y).max()
    local = points @ view.rotation.T + view.translation
    depth = local[:, 2]
    if not np.isfinite([across, down]).all():
        return depth > 0
    return (depth > 0) & (np.abs(local[:, 0]) <= across * depth) & (np.abs(local[:, 1]) <= down * depth)


@njit(**EXACT)
def _nearest_seen(points, wanted, centres, image, point, photo, centre):
    """(P,) number of the observation by another photo that saw a point from the direction nearest to ``centre``, -1
    for none, and the cosine between the two directions; of the points ``wanted``, (P,) bool."""
    source, closeness = np.full(len(points), -1, np.int64), np.full(len(points), -1.0)
    for m in range(len(point)):
        if image[m] == photo or not wanted[point[m]]:
            continue
        p, i = point[m], image[m]
        along = seen = away = 0.0
        for d in range(3):
            one, other = points[p, d] - centres[i, d], points[p, d] - centre[d]
            along += one * other
            seen += one * one
            away += other * other
        cosine = along / np.sqrt(seen * away)
        if cosine >= closeness[p]:
            source[p], closeness[p] = m, cosine
    return source, closeness


@njit(**EXACT)
def _dot(a, k, b, q):
    total = np.int32(0)
    for d in range(128):
        # Kept to 32 bits: sixteen products at once.
        total = np.int32(total + np.int32(np.int32(a[k, d]) * np.int32(b[q, d])))
    return total


@njit(**EXACT)
def _search(ends, described, square, kind, features, grid, reach, ratio2, limit):
    """As :func:`search`, on plain arrays."""
    points, others, other_square, starts = features
    columns, rows, size, sectors = grid
    count, cells = len(ends), columns * rows
    beside = BESIDE if sectors > 1 else 0
    best = np.full(count, -1, np.int64)
    distance = np.full(count, limit, np.int64)
    for k in range(count):
        x0, y0, x1, y1 = ends[k, 0], ends[k, 1], ends[k, 2], ends[k, 3]
        if not (np.isfinite(x0) and np.isfinite(y0) and np.isfinite(x1) and np.isfinite(y1)):
            continue
        top, bottom = min(y0, y1) - reach, max(y0, y1) + reach
        if bottom < 0 or top >= rows * size:
            continue
        dx, dy = x1 - x0, y1 - y0
        per_length2 = 1 / max(dx * dx + dy * dy, 1e-9)
        first, second, who = limit, limit, -1
        sign, sector = kind[k] // sectors, kind[k] % sectors
        for r in range(max(int(top // size), 0), min(int(bottom // size), rows - 1) + 1):
            # The part of the line that is within reach of this row of cells.
            begin, end = 0.0, 1.0
            if abs(dy) > 1e-6:
                one, two = (r * size - reach - y0) / dy, ((r + 1) * size + reach - y0) / dy
                begin, end = max(min(one, two), 0.0), min(max(one, two), 1.0)
                if begin > end:
                    continue
            left, right = min(x0 + begin * dx, x0 + end * dx) - reach, max(x0 + begin * dx, x0 + end * dx) + reach
            if right < 0 or left >= columns * size:
                continue
            c0, c1 = max(int(left // size), 0), min(int(right // size), columns - 1)
            for turn in range(-beside, beside + 1):
                at = (sign * sectors + (sector + turn) % sectors) * cells + r * columns
                for q in range(starts[at + c0], starts[at + c1 + 1]):
                    u, v = points[q, 0] - x0, points[q, 1] - y0
                    along = min(max((u * dx + v * dy) * per_length2, 0.0), 1.0)
                    u -= along * dx
                    v -= along * dy
                    if u * u + v * v > reach * reach:
                        continue
                    away = square[k] + other_square[q] - 2 * np.int64(_dot(described, k, others, q))
                    if away < first:
                        first, second, who = away, first, q
                    elif away < second:
                        second = away
        if who >= 0 and first < ratio2 * second:
            best[k] = who
            distance[k] = first
    return best, distance
