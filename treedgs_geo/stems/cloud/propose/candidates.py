"""Where stems may stand: rings (or discs) of points that repeat over the layers of the stem band.

A Hough vote on a grid: per height layer and radius, the voxels on the ring count for, those inside (bark is opaque; not
for splats, which fill the stem) and just outside count against. Layers are summed with room for lean.
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from numba import njit
from scipy import fft

from ....pointcloud.cloud import extent

_CELL_M = 0.05
_LAYER_M = 0.5
_STEP_M = 0.1
#: A voxel counts wholly from this share of the points of the fullest within so many cells.
_FULL, _BESIDE = 0.15, 4
RADII_M = (0.04, 0.06, 0.09, 0.12, 0.16, 0.20, 0.25, 0.31, 0.38, 0.46, 0.60, 0.80, 1.05, 1.40, 1.85)

#: Layers and votes that a candidate needs, and that one near a place where a stem is known to stand needs.
LEAST, LEAST_NEAR = (4, 4.0), (2, 2.0)
#: Distance from such a place, m, and slope of the axis that layers may be displaced by.
NEAR_M, LEAN = 1.0, 0.2


def find_candidates(
    points: np.ndarray,
    weights: np.ndarray | None,
    low_m: float,
    high_m: float,
    solid: bool,
    max_radius_m: float,
    near: np.ndarray | None = None,
) -> np.ndarray:
    """(K, 4) places x and y, height and rough radius of possible stems in one tile of (N, 3) points (x, y, height above
    ground), best first.

    weights: (N,) reliabilities or ``None``. solid: points fill the stem (splats). near: (K, 2) places where stems are
    known to stand: within ``NEAR_M`` of them weaker candidates count too. Memory is that of a few grids of 5 cm cells
    over the tile.
    """
    low, high = extent(points[:, :2])
    origin = low - 0.7
    rows, cols = np.ceil((high + 0.7 - origin) / _CELL_M).astype(int) + 1
    heights = np.arange(low_m, high_m - _LAYER_M / 2, _LAYER_M)
    radii = [r for r in RADII_M if r <= max_radius_m] or [RADII_M[0]]
    shape = fft.next_fast_len(int(rows), real=True), fft.next_fast_len(int(cols), real=True)
    kernels = [_kernel(r, shape, solid) for r in radii]
    # Thin stems get a ranking of their own: a wide ring through the twigs around them scores more.
    classes = [[i for i, r in enumerate(radii) if r <= 0.07], [i for i, r in enumerate(radii) if r > 0.07]]
    best: list[list[np.ndarray]] = [[], []]
    which: list[list[np.ndarray]] = [[], []]
    points = np.ascontiguousarray(points, dtype=float)
    for bottom in heights:
        if weights is None:
            occupied = _occupied(points, float(bottom), origin, shape)
        else:
            inside = (points[:, 2] >= bottom) & (points[:, 2] < bottom + _LAYER_M)
            occupied = _occupancy(points[inside], weights[inside], origin, shape)
        image = fft.rfft2(occupied, workers=1)
        for kind, members in enumerate(classes):
            top, chosen = np.zeros((rows, cols), np.float32), np.zeros((rows, cols), np.int8)
            for index in members:
                score = fft.irfft2(image * kernels[index], s=shape, workers=1)
                _keep_better(score, np.float32(np.sqrt(radii[index] + 0.1)), index, top, chosen)
            best[kind].append(top)
            which[kind].append(chosen)

    def peaks(least: tuple[int, float]) -> list[tuple[float, float, float, float, float]]:
        return [row for kind in (0, 1) for row in _peaks(best[kind], which[kind], heights, origin, radii, least)]

    found = peaks(LEAST)
    if near is not None and len(near):
        weaker = [row for row in peaks(LEAST_NEAR) if row not in found]
        found += [row for row in weaker if np.hypot(*(near - row[1:3]).T).min() < NEAR_M]
    return np.array(sorted(found, reverse=True)).reshape(-1, 5)[:, 1:]


@njit(cache=True, nogil=True)
def _occupied(points, bottom, origin, shape):  # pragma: no cover - compiled
    """The voxels of the layer above ``bottom`` that hold points, counted a column: image of ``shape``. A voxel that
    holds far less than the fullest beside it (stray points of a dense scan) counts for less."""
    levels = int(round(_LAYER_M / _STEP_M)) + 1
    count = np.zeros((shape[0], shape[1], levels), np.uint32)
    first = int(np.floor(bottom / _STEP_M))
    for m in range(points.shape[0]):
        z = points[m, 2]
        if bottom <= z < bottom + _LAYER_M:
            i, j = int((points[m, 0] - origin[0]) / _CELL_M), int((points[m, 1] - origin[1]) / _CELL_M)
            count[i, j, min(max(int(np.floor(z / _STEP_M)) - first, 0), levels - 1)] += np.uint32(1)
    fullest = np.zeros(shape, np.float32)
    for i in range(shape[0]):
        for j in range(shape[1]):
            for k in range(levels):
                fullest[i, j] = max(fullest[i, j], np.float32(count[i, j, k]))
    image = np.zeros(shape, np.float32)
    along = np.zeros(shape, np.float32)
    for i in range(shape[0]):
        for j in range(shape[1]):
            for n in range(max(j - _BESIDE, 0), min(j + _BESIDE + 1, shape[1])):
                along[i, j] = max(along[i, j], fullest[i, n])
    for i in range(shape[0]):
        for j in range(shape[1]):
            if fullest[i, j] == 0:
                continue
            most = np.float32(0)
            for n in range(max(i - _BESIDE, 0), min(i + _BESIDE + 1, shape[0])):
                most = max(most, along[n, j])
            full = max(np.float32(_FULL) * most, np.float32(1))
            for k in range(levels):
                image[i, j] += min(np.float32(count[i, j, k]) / full, np.float32(1))
    return image


def _occupancy(points: np.ndarray, weights: np.ndarray, origin: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """:func:`_occupied` of weighted points, all of one layer: a voxel counts with the largest of its weights."""
    image = np.zeros(shape, np.float32)
    if len(points) == 0:
        return image
    i, j = ((points[:, :2] - origin) / _CELL_M).astype(np.int64).T
    k = np.floor(points[:, 2] / _STEP_M).astype(np.int64)
    key = (i * shape[1] + j) * 4096 + (k - k.min())
    voxel, place = np.unique(key, return_inverse=True)
    strength = np.zeros(len(voxel))
    np.maximum.at(strength, place, weights)
    np.add.at(image.ravel(), voxel // 4096, strength.astype(np.float32))
    return image


@njit(cache=True, nogil=True, error_model="numpy")
def _keep_better(score, divisor, index, top, chosen):  # pragma: no cover - compiled
    """What is more than ``top`` becomes it, and ``chosen`` says whose it is."""
    for i in range(top.shape[0]):
        for j in range(top.shape[1]):
            value = score[i, j] / divisor
            better = value > top[i, j]
            top[i, j] = value if better else top[i, j]
            chosen[i, j] = index if better else chosen[i, j]


@lru_cache(maxsize=4 * len(RADII_M))
def _kernel(radius: float, shape: tuple[int, int], solid: bool) -> np.ndarray:
    """The transform of the ring (or disc) about the corner of an image of ``shape`` that wraps around."""
    band = 0.045
    reach = int((radius + band + 0.10) / _CELL_M) + 1
    i, j = (np.arange(-min(reach, size // 2), min(reach, size // 2) + 1) for size in shape)
    distance = np.hypot(np.abs(i)[:, None] * _CELL_M, np.abs(j)[None, :] * _CELL_M)
    part = np.zeros(distance.shape, np.float32)
    part[distance <= radius + band] = 0.5 if solid else -1.0
    part[np.abs(distance - radius) <= band] = 1.0
    part[(distance > radius + band) & (distance <= radius + band + 0.10)] = -0.5
    kernel = np.zeros(shape, np.float32)
    kernel[np.ix_(i % shape[0], j % shape[1])] = part
    return fft.rfft2(kernel, workers=1)


def _largest_near(image: np.ndarray, reach: int) -> np.ndarray:
    """The largest value within ``reach`` cells along both axes of an image without negative values."""
    return cv2.dilate(image, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))


def _peaks(
    best: list[np.ndarray],
    which: list[np.ndarray],
    heights: np.ndarray,
    origin: np.ndarray,
    radii: list[float],
    least: tuple[int, float],
) -> list[tuple[float, float, float, float, float]]:
    """(score, x, y, height, radius) of the local maxima."""
    found: list[tuple[float, float, float, float, float]] = []
    middle = heights + _LAYER_M / 2
    for level in (1.5, 2.75):
        reference = int(np.argmin(np.abs(middle - level)))
        total = np.zeros_like(best[0])
        votes = np.zeros(best[0].shape, np.int8)
        for index, layer in enumerate(best):
            reach = 0.05 + LEAN * abs(middle[index] - middle[reference])
            spread = _largest_near(layer, int(round(reach / _CELL_M))) if index != reference else layer
            total += np.sqrt(spread)
            votes += spread > 5.0
        # The reference layer places the peak; the others only say whether something stands there.
        total += 2 * np.sqrt(best[reference])
        peak = (total == _largest_near(total, 3)) & (votes >= least[0]) & (best[reference] > least[1])
        for i, j in np.argwhere(peak):
            x, y = origin[0] + i * _CELL_M, origin[1] + j * _CELL_M
            found.append((float(total[i, j]), x, y, float(middle[reference]), radii[which[reference][i, j]]))
    return found
