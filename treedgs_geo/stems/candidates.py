"""Where stems may stand: rings (or discs) of points that repeat over the layers of the stem band.

A Hough vote on a grid: per height layer and radius, the voxels on the ring count for, those inside (bark is opaque; not
for splats, which fill the stem) and just outside count against. Layers are summed with room for lean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft
from scipy.ndimage import maximum_filter

from ..pointcloud.cloud import extent

_CELL_M = 0.05
_LAYER_M = 0.5
_STEP_M = 0.1
RADII_M = (0.04, 0.06, 0.09, 0.12, 0.16, 0.20, 0.25, 0.31, 0.38, 0.46)


@dataclass(frozen=True)
class Candidates:
    """Possible stems: (K, 2) xy at (K,) heights, (K,) rough radii, (K,) scores, best first."""

    xy: np.ndarray
    height: np.ndarray
    radius: np.ndarray
    score: np.ndarray


#: Layers and votes that a candidate needs, and that one near a place where a stem is known to stand needs.
LEAST, LEAST_NEAR = (4, 4.0), (2, 2.0)


def find_candidates(points: np.ndarray, weights: np.ndarray | None, low_m: float, high_m: float, solid: bool,
                    max_radius_m: float, lean: float = 0.2, near: np.ndarray | None = None,
                    near_m: float = 1.0) -> Candidates:
    """Candidates in one tile of (N, 3) points (x, y, height above ground), best first.

    weights: (N,) reliabilities or ``None``. solid: points fill the stem (splats). lean: axis slope that layers may be
    displaced by. near: (K, 2) places where stems are known to stand: within ``near_m`` of them weaker candidates count
    too. Memory is that of a few grids of 5 cm cells over the tile.
    """
    low, high = extent(points[:, :2])
    origin = low - 0.7
    rows, cols = (np.ceil((high + 0.7 - origin) / _CELL_M).astype(int) + 1)
    heights = np.arange(low_m, high_m - _LAYER_M / 2, _LAYER_M)
    radii = [r for r in RADII_M if r <= max_radius_m] or [RADII_M[0]]
    shape = fft.next_fast_len(int(rows), real=True), fft.next_fast_len(int(cols), real=True)
    kernels = [fft.rfft2(_kernel(r, shape, solid), workers=1) for r in radii]
    # Thin stems get a ranking of their own: a wide ring through the twigs around them scores more.
    classes = [[i for i, r in enumerate(radii) if r <= 0.07], [i for i, r in enumerate(radii) if r > 0.07]]
    best: list[list[np.ndarray]] = [[], []]
    which: list[list[np.ndarray]] = [[], []]
    for bottom in heights:
        inside = (points[:, 2] >= bottom) & (points[:, 2] < bottom + _LAYER_M)
        strength = None if weights is None else weights[inside]
        image = fft.rfft2(_occupancy(points[inside], strength, origin, shape), workers=1)
        for kind, members in enumerate(classes):
            top = np.zeros(shape, np.float32)
            chosen = np.zeros(shape, np.int8)
            for index in members:
                score = fft.irfft2(image * kernels[index], s=shape, workers=1)
                score /= np.float32(np.sqrt(radii[index] + 0.1))
                better = score > top
                top[better] = score[better]
                chosen[better] = index
            best[kind].append(top[:rows, :cols])
            which[kind].append(chosen[:rows, :cols])
    found = [row for kind in (0, 1) for row in
             _peaks(best[kind], which[kind], heights, origin, np.asarray(radii), LEAST, lean)]
    if near is not None and len(near):
        more = [row for kind in (0, 1) for row in
                _peaks(best[kind], which[kind], heights, origin, np.asarray(radii), LEAST_NEAR, lean)]
        found += [row for row in more if row not in found and np.hypot(*(near - row[1:3]).T).min() < near_m]
    table = np.array(sorted(found, reverse=True)).reshape(-1, 5)
    return Candidates(table[:, 1:3], table[:, 3], table[:, 4], table[:, 0])


def _occupancy(points: np.ndarray, weights: np.ndarray | None, origin: np.ndarray,
               shape: tuple[int, int]) -> np.ndarray:
    """Grid of occupied 10 cm steps a cell: dense scans near the scanner weigh no more than sparse ones."""
    image = np.zeros(shape, np.float32)
    if len(points) == 0:
        return image
    i, j = ((points[:, :2] - origin) / _CELL_M).astype(np.int64).T
    k = np.floor(points[:, 2] / _STEP_M).astype(np.int64)
    key = (i * shape[1] + j) * 4096 + (k - k.min())
    if weights is None:
        cell, count = np.unique(np.unique(key) // 4096, return_counts=True)
        image.ravel()[cell] = count
    else:
        voxel, place = np.unique(key, return_inverse=True)
        strength = np.zeros(len(voxel))
        np.maximum.at(strength, place, weights)
        np.add.at(image.ravel(), voxel // 4096, strength.astype(np.float32))
    return image


def _kernel(radius: float, shape: tuple[int, int], solid: bool) -> np.ndarray:
    i = np.minimum(np.arange(shape[0]), shape[0] - np.arange(shape[0])) * _CELL_M
    j = np.minimum(np.arange(shape[1]), shape[1] - np.arange(shape[1])) * _CELL_M
    distance = np.hypot(i[:, None], j[None, :])
    band = 0.045
    kernel = np.zeros(shape, np.float32)
    kernel[distance <= radius + band] = 0.5 if solid else -1.0
    kernel[np.abs(distance - radius) <= band] = 1.0
    kernel[(distance > radius + band) & (distance <= radius + band + 0.10)] = -0.5
    return kernel


def _peaks(best: list[np.ndarray], which: list[np.ndarray], heights: np.ndarray, origin: np.ndarray, radii: np.ndarray,
           least: tuple[int, float], lean: float) -> list[tuple[float, float, float, float, float]]:
    """(score, x, y, height, radius) of the local maxima."""
    found: list[tuple[float, float, float, float, float]] = []
    middle = heights + _LAYER_M / 2
    for level in (1.5, 2.75):
        reference = int(np.argmin(np.abs(middle - level)))
        total = np.zeros_like(best[0])
        votes = np.zeros(best[0].shape, np.int8)
        for index, layer in enumerate(best):
            reach = 0.05 + lean * abs(middle[index] - middle[reference])
            size = 2 * int(round(reach / _CELL_M)) + 1
            spread = maximum_filter(layer, size=size) if index != reference else layer
            total += np.sqrt(spread)
            votes += spread > 5.0
        # The reference layer places the peak; the others only say whether something stands there.
        total += 2 * np.sqrt(best[reference])
        peak = (total == maximum_filter(total, size=7)) & (votes >= least[0]) & (best[reference] > least[1])
        for i, j in np.argwhere(peak):
            found.append((float(total[i, j]), origin[0] + i * _CELL_M, origin[1] + j * _CELL_M,
                          float(middle[reference]), float(radii[which[reference][i, j]])))
    return found
