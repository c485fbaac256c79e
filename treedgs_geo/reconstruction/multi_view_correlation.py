"""Do photos show the same thing at a place in space? Normalised cross-correlation between photos that lie side by side.

Where something stands at a point, neighbouring photos show it alike there; where the point is in the air, each shows
what lies behind it, and the pieces differ. Zero-mean normalised cross-correlation: Lewis 1995, "Fast normalized
cross-correlation"; its mean over pairs of photos as evidence of a surface: Goesele, Curless and Seitz 2006,
"Multi-view stereo revisited".
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit, prange

from ..core.machine import FAST, in_threads
from .cameras import View
from .images import load_image

#: Half the width of the piece that is compared, pixels.
HALF_PX = 3
#: So many pairs of photos that show a point are looked at.
MAX_PAIRS = 48
#: Points that are looked at together.
_CHUNK = 128
#: Fractions of a pixel are counted in 2 to the power of so many bits.
_SHIFT = 14
#: Grey values squared that are added to a piece's variance: flat pieces are alike by chance.
_MIN_VARIANCE = 4.0
#: Two photos are compared when they look at the place from so many degrees apart; so many would be best.
_APART_DEG, _BEST_DEG = (6.0, 30.0), 10.0


@dataclass(frozen=True)
class Pictures:
    """V photos as pinhole pictures of one pixel size, grey. images: (V, H, W) uint8. matrix: (V, 3, 4) float32, local
    metres -> pixels. axes: (V, 2, 3) float32, right and down of each photo. focal: (V,) float32, pixels. pairs: (P, 2)
    int32, photos that are compared."""

    images: np.ndarray
    matrix: np.ndarray
    axes: np.ndarray
    focal: np.ndarray
    pairs: np.ndarray

    def alike(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N, 3) local points -> (N,) float32: mean correlation of the pieces round them, -1 to 1, over the pairs that
        show them, 0 where none does. (N,) uint8: so many pairs, up to ``MAX_PAIRS``."""
        points = np.ascontiguousarray(points, np.float32)
        found, count = np.zeros(len(points), np.float32), np.zeros(len(points), np.uint8)
        if len(points) and len(self.pairs):
            _alike(self.images, self.matrix, self.axes, self.focal, self.pairs, points, found, count)
        return found, count


def pictures_of(views: list[View], about: np.ndarray, pixel_m: float, neighbours: int = 1) -> Pictures:
    """The photos as :class:`Pictures` whose pixel is ``pixel_m`` at ``about``, (3,) local metres; no picture is finer
    than its photo.

    Lens and rolling shutter are those at the distance of ``about``. neighbours: photos that each is compared with.
    """
    about = np.asarray(about, float)

    def picture(view: View) -> tuple[np.ndarray, np.ndarray, float]:
        grey = cv2.cvtColor(load_image(view), cv2.COLOR_RGB2GRAY)
        away = float(np.linalg.norm(view.centre - about))
        return _pinhole(view, grey, min(away / view.camera.fx / pixel_m, 1.0), away)

    rows = list(in_threads(picture, views))
    height, width = np.max([image.shape for image, *_ in rows], axis=0)
    images = np.zeros((len(rows), height, width), np.uint8)
    for target, (image, *_) in zip(images, rows, strict=True):
        target[: image.shape[0], : image.shape[1]] = image
    axes = np.array([view.rotation[:2] for view in views], np.float32).reshape(-1, 2, 3)
    matrix = np.array([m for _, m, _ in rows], np.float32)
    focal = np.array([f for *_, f in rows], np.float32)
    return Pictures(images, matrix, axes, focal, _pairs(views, about, neighbours))


def _pinhole(view: View, grey: np.ndarray, scale: float, depth_m: float) -> tuple[np.ndarray, np.ndarray, float]:
    """(H, W) picture without lens and rolling shutter, its (3, 4) matrix and focal length; black where nothing is."""
    width, height = max(int(view.camera.width * scale), 8), max(int(view.camera.height * scale), 8)
    focal = view.camera.fx * scale
    # The lens is smooth: every eighth pixel is projected, those between are interpolated (to 0.01 pixel).
    columns, rows = (np.linspace(0.5, size - 0.5, size // 8 + 2) for size in (width, height))
    u, v = np.meshgrid(columns - width / 2, rows - height / 2)
    rays = np.stack([u / focal, v / focal, np.ones_like(u)], axis=-1).reshape(-1, 3) @ view.rotation
    pixels, ahead = view.project(view.centre + depth_m * rays)
    pixels = np.where((ahead > 0.1)[:, None], pixels, -1e4).reshape(*u.shape, 2) - 0.5
    map_x, map_y = (between(pixels[..., k], width, height) for k in range(2))
    if scale < 1:
        grey = cv2.GaussianBlur(grey, (0, 0), 0.5 / scale)
    image = cv2.remap(grey, map_x, map_y, cv2.INTER_LINEAR, borderValue=0)
    inner = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
    return image, inner @ np.column_stack([view.rotation, view.translation]), focal


def between(grid: np.ndarray, width: int, height: int) -> np.ndarray:
    """(height, width) float32: a grid whose corners are those of the picture's first and last pixel centre."""
    column, row = np.linspace(0, grid.shape[1] - 1, width), np.linspace(0, grid.shape[0] - 1, height)
    at_x, at_y = np.meshgrid(column.astype(np.float32), row.astype(np.float32))
    return cv2.remap(grid.astype(np.float32), at_x, at_y, cv2.INTER_LINEAR)


def _pairs(views: list[View], about: np.ndarray, neighbours: int) -> np.ndarray:
    """(P, 2) int32: each photo with those of its flight that look at ``about`` from a little way apart."""
    rays = np.array([(about - view.centre) / np.linalg.norm(about - view.centre) for view in views]).reshape(-1, 3)
    pairs = set()
    for i, view in enumerate(views):
        apart = np.degrees(np.arccos(np.clip(rays @ rays[i], -1, 1)))
        near = [
            j
            for j, other in enumerate(views)
            if j != i and other.flight == view.flight and _APART_DEG[0] <= apart[j] <= _APART_DEG[1]
        ]
        near.sort(key=lambda j: abs(apart[j] - _BEST_DEG))
        pairs |= {(i, j) for j in near[:neighbours]}
    # In any order: the first pairs that show a point are from all sides.
    return np.random.default_rng(0).permutation(np.array(sorted(pairs), np.int32).reshape(-1, 2))


@njit(inline="always", **FAST)
def _window_of(places, matrix, axes, focal, size, i, j, k, window):  # pragma: no cover - compiled
    """Whether photos i and j both show the piece round point k; window: its place and steps in photo j, filled.

    Where the window lies in photo j follows, to first order, from the plane through the point that faces photo i.
    """
    u, v, w = places[i, k, 0], places[i, k, 1], places[i, k, 2]
    u2, v2, w2 = places[j, k, 0], places[j, k, 1], places[j, k, 2]
    height, width, half = np.float32(size[0]), np.float32(size[1]), np.float32(HALF_PX)
    one, n = np.float32(1), matrix[j]
    if w <= one or w2 <= one or u < half or v < half or u >= width - half or v >= height - half:
        return False
    step = w / (focal[i] * w2)  # a pixel of photo i at the point, metres, over the depth in photo j
    # Derivatives of the place in photo j along the right (0) and down (1) of photo i.
    for axis in range(2):
        a, b, c = axes[i, axis, 0], axes[i, axis, 1], axes[i, axis, 2]
        deep = n[2, 0] * a + n[2, 1] * b + n[2, 2] * c
        window[2 * axis + 2] = step * (n[0, 0] * a + n[0, 1] * b + n[0, 2] * c - u2 * deep)
        window[2 * axis + 3] = step * (n[1, 0] * a + n[1, 1] * b + n[1, 2] * c - v2 * deep)
    window[0], window[1] = u2, v2
    # A little more than the window: its steps are rounded to fractions of a pixel, and places are not tested again.
    more = np.float32(0.001)
    reach_u = half * (abs(window[2]) + abs(window[4])) + more
    reach_v = half * (abs(window[3]) + abs(window[5])) + more
    return u2 >= reach_u and v2 >= reach_v and u2 < width - reach_u and v2 < height - reach_v


@njit(inline="always", **FAST)
def _correlation(first, second, u, v, window, pieces):  # pragma: no cover - compiled
    """Correlation of the window of photo ``first`` round pixel u, v with its piece of photo ``second``; -2 where one is
    black throughout. pieces: (2, N) uint8, filled.

    Places in the second photo are counted in fractions of 2^14: whole numbers are fast.
    """
    scale = np.float32(1 << _SHIFT)
    right_u, right_v = np.int64(window[2] * scale), np.int64(window[3] * scale)
    down_u, down_v = np.int64(window[4] * scale), np.int64(window[5] * scale)
    start_u, start_v = np.int64(window[0] * scale), np.int64(window[1] * scale)
    n = 0
    for b in range(-HALF_PX, HALF_PX + 1):
        at_u, at_v = start_u + b * down_u - HALF_PX * right_u, start_v + b * down_v - HALF_PX * right_v
        for a in range(-HALF_PX, HALF_PX + 1):
            # Unsigned: no test for places before the beginning.
            pieces[0, n] = first[np.uint64(v + b), np.uint64(u + a)]
            pieces[1, n] = second[np.uint64(at_v >> _SHIFT), np.uint64(at_u >> _SHIFT)]
            at_u += right_u
            at_v += right_v
            n += 1
    sum_p = sum_q = sum_pp = sum_qq = sum_pq = np.float32(0)
    for k in range((2 * HALF_PX + 1) ** 2):
        p, q = np.float32(pieces[0, k]), np.float32(pieces[1, k])
        sum_p += p
        sum_q += q
        sum_pp += p * p
        sum_qq += q * q
        sum_pq += p * q
    if sum_p == 0 or sum_q == 0:  # outside of a photo
        return np.float32(-2)
    one = np.float32(1) / np.float32((2 * HALF_PX + 1) ** 2)
    mean_p, mean_q = sum_p * one, sum_q * one
    var_p = sum_pp * one - mean_p * mean_p + np.float32(_MIN_VARIANCE)
    var_q = sum_qq * one - mean_q * mean_q + np.float32(_MIN_VARIANCE)
    return (sum_pq * one - mean_p * mean_q) / np.sqrt(var_p * var_q)


@njit(parallel=True, **FAST)
def _alike(images, matrix, axes, focal, pairs, points, found, counts):  # pragma: no cover - compiled
    """Pair after pair over a few points at a time: their pieces of two photos lie side by side in memory."""
    for chunk in prange(-(-len(points) // _CHUNK)):
        first, last = chunk * _CHUNK, min((chunk + 1) * _CHUNK, len(points))
        places = np.empty((len(matrix), last - first, 3), np.float32)
        for i in range(len(matrix)):
            m = matrix[i]
            for k in range(last - first):
                x, y, z = points[first + k, 0], points[first + k, 1], points[first + k, 2]
                w = m[2, 0] * x + m[2, 1] * y + m[2, 2] * z + m[2, 3]
                places[i, k, 0] = (m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3]) / w
                places[i, k, 1] = (m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3]) / w
                places[i, k, 2] = w
        window, pieces = np.empty(6, np.float32), np.empty((2, (2 * HALF_PX + 1) ** 2), np.uint8)
        for pair in range(len(pairs)):
            i, j = pairs[pair, 0], pairs[pair, 1]
            for k in range(last - first):
                if counts[first + k] < MAX_PAIRS and _window_of(
                    places, matrix, axes, focal, images.shape[1:], i, j, k, window
                ):
                    u, v = np.int64(places[i, k, 0]), np.int64(places[i, k, 1])
                    value = _correlation(images[i], images[j], u, v, window, pieces)
                    if value > np.float32(-1.5):
                        found[first + k] += value
                        counts[first + k] += 1
        for k in range(first, last):
            found[k] /= np.float32(max(counts[k], 1))
