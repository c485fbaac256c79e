"""A stem as a primitive: a leaning, bending, tapering cone with an analytic, anti-aliased silhouette and a texture.

What is seen at a pixel is the stem (coverage alpha, colour S) before the ground. Coverage is exact up to the photo's
blur: a ray touches a cone where its distance s from the axis equals the radius, so alpha = Phi((r - s) / blur). Splats
drawn with a blur of their own add it to the stem's width (about a pixel in all); this edge has no such bias. Stem and
ground are mixed in linear light, as a lens mixes them, and compared in image space.

Kernels work on one crop; float32 images, float64 geometry. The shape vector is x, y (axis at breast height), lx, ly
(slope, m/m), bx, by (bend, 1/m), r (radius at breast height), taper (m/m), all in the stem frame (metres).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit

#: Length of the shape vector.
N_SHAPE = 8
#: Exponent between photo values and linear light.
GAMMA = 2.2
#: Texture cells around the stem, and their height in metres.
N_ANGLES, CELL_M = 24, 0.25
#: ``edge`` of pixels too far from the seed to be looked at; other edges lie within +-400 (+ 1000).
_BEYOND = np.float32(-500.0)
_FAST: dict[str, Any] = {"nogil": True, "cache": True, "fastmath": True, "error_model": "numpy"}


class Lens(NamedTuple):
    """A crop's camera. rotation: (3, 3) float64; centre: (3,) float64, m; intrinsics: (4,) fx, fy, cx, cy, px."""

    rotation: np.ndarray
    centre: np.ndarray
    intrinsics: np.ndarray


class StemView(NamedTuple):
    """A stem as one crop shows it. shape: (8,). bh_m: breast height. shift_px: sideways pose error of the photo.
    blur_px: edge blur (sd)."""

    shape: np.ndarray
    bh_m: float
    shift_px: float
    blur_px: float


class Region(NamedTuple):
    """The compared pixels: up to ``window_m`` from the seed's vertical, ``low_m`` to ``high_m`` above the ground."""

    window_m: float
    low_m: float
    high_m: float


class Coverage(NamedTuple):
    """Coverage and texture cell of each pixel.

    alpha: (H, W) float32. edge: (H, W) float32, pixels from the nearer edge, positive inside; 1000 is added on the
    stem's far side (s < 0), so that the two edges can be distinguished. angle, level: (H, W) int16 texture cell of the
    visible surface. window: (H, W) bool, the pixel belongs to the compared region.
    """

    alpha: np.ndarray
    edge: np.ndarray
    angle: np.ndarray
    level: np.ndarray
    window: np.ndarray


class Surroundings(NamedTuple):
    """What a crop shows besides the stem.

    behind: (H, W, 3) linear, the ground. gain: (3,). image: (H, W, 3) the photo; mask: (H, W) its weights.
    """

    behind: np.ndarray
    gain: np.ndarray
    image: np.ndarray
    mask: np.ndarray


class Composite(NamedTuple):
    """What the model shows in a crop, and how well it fits.

    shown: (H, W, 3), gamma space. weight: (H, W), mask times the Geman-McClure weight. clear: (2, L) for each side and
    height, how well the pixels just inside AND just outside the edge are explained (0..1): an edge that leaves hide
    pulls the stem towards the leaves.
    """

    shown: np.ndarray
    weight: np.ndarray
    clear: np.ndarray


def axis_xy(shape: np.ndarray, bh_m: float, height_m: np.ndarray) -> np.ndarray:
    """(N, 2) axis at heights above the ground."""
    q = np.asarray(height_m, float) - bh_m
    return shape[:2] + np.outer(q, shape[2:4]) + np.outer(q * q, shape[4:6])


def radius_m(shape: np.ndarray, bh_m: float, height_m: np.ndarray) -> np.ndarray:
    """(N,) radius at heights above the ground."""
    return np.maximum(shape[6] + shape[7] * (np.asarray(height_m, float) - bh_m), 0.005)


@njit(inline="always", **_FAST)
def axis_passage(shape, bh, lens, x, y):
    """Where the ray through pixel (x, y) passes the axis.

    Returns signed distance s, height above breast height q, distance along the ray t, the horizontal part of the
    direction that s is measured in (nx, ny) and the ray's horizontal direction (ux, uy), and cos to the optical axis.
    """
    rot, centre, intr = lens.rotation, lens.centre, lens.intrinsics
    a = (x + 0.5 - intr[2]) / intr[0]
    b = (y + 0.5 - intr[3]) / intr[1]
    size = math.sqrt(a * a + b * b + 1.0)
    dx = (rot[0, 0] * a + rot[1, 0] * b + rot[2, 0]) / size
    dy = (rot[0, 1] * a + rot[1, 1] * b + rot[2, 1]) / size
    dz = (rot[0, 2] * a + rot[1, 2] * b + rot[2, 2]) / size
    wx, wy, wz = shape[0] - centre[0], shape[1] - centre[1], bh - centre[2]
    ax, ay = shape[2], shape[3]
    px, py, q = wx, wy, 0.0
    for _ in range(2):
        along = ax * dx + ay * dy + dz
        aa = ax * ax + ay * ay + 1.0
        # Closest points of the ray and the line (p, a); p is the axis point at the last q moved back to q = 0.
        pd, pa = px * dx + py * dy + wz * dz, px * ax + py * ay + wz
        q = (along * pd - pa) / max(aa - along * along, 1e-12)
        q = min(max(q, -3.0), 6.0)
        ax, ay = shape[2] + 2 * shape[4] * q, shape[3] + 2 * shape[5] * q
        px = wx + shape[2] * q + shape[4] * q * q - ax * q
        py = wy + shape[3] * q + shape[5] * q * q - ay * q
    cx, cy, cz = px + ax * q, py + ay * q, wz + q
    nx, ny, nz = dy - dz * ay, dz * ax - dx, dx * ay - dy * ax
    norm = math.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / norm, ny / norm, nz / norm
    s = cx * nx + cy * ny + cz * nz
    t = cx * dx + cy * dy + cz * dz
    return s, q, t, nx, ny, dx, dy, 1.0 / size


@njit(inline="always", **_FAST)
def _phi(x):
    """Normal distribution function."""
    return 0.5 * math.erfc(-x * 0.7071067811865476)


@njit(**_FAST)
def cover(stem, lens, region, out, known=False):
    """Fill ``out`` (a :class:`Coverage`) of one crop.

    The region is about the seed's own vertical, not the fitted axis, so that explanations are compared on the same
    pixels. known: the arrays come from an earlier call for this crop; the window, which no shape changes, is kept.
    """
    shape, bh, shift_px, blur_px = stem
    window_m, low_m, high_m = region
    intr = lens.intrinsics
    alpha, edge, angle, level, window = out
    upright = np.zeros(8)
    for y in range(alpha.shape[0]):
        for x in range(alpha.shape[1]):
            if known:
                if edge[y, x] == _BEYOND:
                    continue
            else:
                side, q0, t0, _, _, _, _, _ = axis_passage(upright, bh, lens, x, y)
                h0 = q0 + bh
                window[y, x] = abs(side) < window_m and h0 > low_m and h0 < high_m and t0 > 0
                if abs(side) > window_m + 0.6:
                    alpha[y, x] = 0.0
                    edge[y, x] = _BEYOND
                    continue
            s, q, t, nx, ny, ux, uy, slant = axis_passage(shape, bh, lens, x, y)
            foot = t * slant / intr[0]
            s += shift_px * foot
            r = max(shape[6] + shape[7] * q, 0.005)
            value = _phi((r - abs(s)) / (blur_px * foot)) if t > 0 else 0.0
            alpha[y, x] = value
            edge[y, x] = max(min((r - abs(s)) / foot, 400.0), -400.0) + (1000.0 if s < 0 else 0.0)
            level[y, x] = max(int((q + bh) / CELL_M), 0)
            if value > 0.01:
                k = min(max(s / r, -1.0), 1.0)
                front = math.sqrt(1.0 - k * k) / max(math.sqrt(ux * ux + uy * uy), 1e-9)
                theta = math.atan2(-k * ny - front * uy, -k * nx - front * ux)
                cell = int((theta / (2 * math.pi) + 1.0) * N_ANGLES) % N_ANGLES
                angle[y, x] = cell


@njit(**_FAST)
def gather(coverage, linear, weight, total, mass):
    """Sum the colours (linear light, (H, W, 3)) of clearly covered pixels into one photo's texture: total (A, L, 3),
    mass (A, L)."""
    alpha, angle, level, window = coverage.alpha, coverage.angle, coverage.level, coverage.window
    for y in range(alpha.shape[0]):
        for x in range(alpha.shape[1]):
            if not window[y, x] or alpha[y, x] < 0.75:
                continue
            # A rim pixel holds ground too; trusted, it would lighten the bark and widen the stem.
            w = weight[y, x] * ((alpha[y, x] - 0.75) * 4.0) ** 3
            a, k = angle[y, x], min(level[y, x], mass.shape[1] - 1)
            mass[a, k] += w
            for c in range(3):
                total[a, k, c] += w * linear[y, x, c]


@njit(inline="always", **_FAST)
def _clear_edges(sums, clear):
    """``clear`` of :class:`Composite` from (side, row, in or out, 3): explained weight, weight, pixels."""
    for side in range(2):
        for k in range(sums.shape[1]):
            value = 1.0
            for inside in range(2):
                if sums[side, k, inside, 1] < 2.0:
                    value = 0.0
                else:
                    value *= sums[side, k, inside, 0] / sums[side, k, inside, 2]
            clear[side, k] = value


@njit(**_FAST)
def compose(coverage, texture, scene, scale, out):
    """Fill ``out`` (a :class:`Composite`) of one crop; errors count by Geman and McClure's rho at ``scale``.

    texture: (A, L, 3) linear. Returns the sum of rho = e^2 / (e^2 + scale^2) over the window's weights, and that
    weight.
    """
    alpha, edge, angle, level, window = coverage
    behind, gain, image, mask = scene
    shown, weight, clear = out
    rows = texture.shape[1]
    sums = np.zeros((2, rows, 2, 3))
    total = 0.0
    area = 0.0
    back = np.float32(1.0 / GAMMA)
    for y in range(alpha.shape[0]):
        for x in range(alpha.shape[1]):
            a = alpha[y, x]
            square = np.float32(0.0)
            for c in range(3):
                light = behind[y, x, c]
                if a > 0.01:
                    k = min(level[y, x], texture.shape[1] - 1)
                    light = a * texture[angle[y, x], k, c] + (np.float32(1.0) - a) * light
                value = max(light, np.float32(0.0)) ** back * gain[c]
                shown[y, x, c] = value
                e = value - image[y, x, c]
                square += e * e
            size = scale * scale
            share = size / (size + square)
            weight[y, x] = mask[y, x] * share * share
            far = edge[y, x] > 500.0
            d = edge[y, x] - (np.float32(1000.0) if far else np.float32(0.0))
            if window[y, x] and abs(d) < 5.0 and abs(d) > 0.8:
                k = min(level[y, x], rows - 1)
                inside = 0 if d > 0 else 1
                side = 1 if far else 0
                sums[side, k, inside, 0] += mask[y, x] * share
                sums[side, k, inside, 1] += mask[y, x]
                sums[side, k, inside, 2] += 1.0
            if window[y, x]:
                total += mask[y, x] * (1.0 - share)
                area += mask[y, x]
    _clear_edges(sums, clear)
    return total, area


@njit(**_FAST)
def normal_equations(stem, lens, coverage, texture, scene, composite, sharpness, matrix, right):
    """Add one crop's Gauss-Newton terms. Unknowns: the shape (8) and this photo's shift (1).

    sharpness: exponent on how clear an edge is. matrix: (9, 9), right: (9,), accumulated (zero them for a new photo).
    """
    shape, bh, shift_px, blur_px = stem
    alpha, edge, angle, level, window = coverage
    behind, gain, image, _ = scene
    shown, weight, clear = composite
    intr = lens.intrinsics
    row = np.empty(9)
    for y in range(alpha.shape[0]):
        for x in range(alpha.shape[1]):
            a = alpha[y, x]
            if not window[y, x] or a < 0.002 or a > 0.998 or weight[y, x] < 1e-3:
                continue
            s, q, t, nx, ny, _, _, slant = axis_passage(shape, bh, lens, x, y)
            foot = t * slant / intr[0]
            s += shift_px * foot
            r = max(shape[6] + shape[7] * q, 0.005)
            blur = blur_px * foot
            z = (r - abs(s)) / blur
            slope = math.exp(-0.5 * z * z) * 0.3989422804014327 / blur
            sign = 1.0 if s > 0 else -1.0
            row[0] = -sign * nx
            row[1] = -sign * ny
            row[2] = row[0] * q
            row[3] = row[1] * q
            row[4] = row[2] * q
            row[5] = row[3] * q
            row[6] = 1.0
            row[7] = q
            row[8] = -sign * foot
            k = min(level[y, x], texture.shape[1] - 1)
            power = 0.0
            cross = 0.0
            for c in range(3):
                light = behind[y, x, c]
                step = texture[angle[y, x], k, c] - light
                mixed = max(light + a * step, 1e-4)
                g = gain[c] * step * mixed ** (1.0 / GAMMA - 1.0) / GAMMA * slope
                power += g * g
                cross += g * (image[y, x, c] - shown[y, x, c])
            trust = weight[y, x] * clear[1 if edge[y, x] > 500.0 else 0, k] ** sharpness
            power *= trust
            cross *= trust
            for i in range(9):
                right[i] += row[i] * cross
                for j in range(i + 1):
                    matrix[i, j] += row[i] * row[j] * power
