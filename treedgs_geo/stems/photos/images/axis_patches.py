"""Strips along a stem's axis, cut from every photo, and how clearly each shows a straight edge.

The evidence is *coherence*: over the rows of a block, ``|mean gradient|^2 / (mean |gradient|^2 + tau^2)``. A straight
trunk edge gives 1; leaves, needles and litter, whose gradients point everywhere, give 0. Three colour channels: luma,
(R - G) / 2, (B - G) / 2. Own method; evidence: ``docs/evidence/photos.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit, prange

from ....core.machine import FAST
from ....reconstruction.images import FINEST_GSD_M, GAMMA
from .crops import CX, CY, FX, FY, K1, K2, K3, P1, P2, ROW_0, ROW_X, ROW_Y, ROW_Z, TX, TY, TZ, PhotoStack

#: A stem this near to a camera, or nearer, is not looked at in its photo, m.
NEAREST_M = 1.0


@njit(inline="always", **FAST)
def _lens(cam, a, b):
    """Normalised pinhole coordinates -> pixels."""
    r2 = a * a + b * b
    radial = 1.0 + r2 * (cam[K1] + r2 * (cam[K2] + r2 * cam[K3]))
    u = a * radial + 2 * cam[P1] * a * b + cam[P2] * (r2 + 2 * a * a)
    v = b * radial + cam[P1] * (r2 + 2 * b * b) + 2 * cam[P2] * a * b
    return cam[FX] * u + cam[CX], cam[FY] * v + cam[CY]


@njit(inline="always", **FAST)
def project(cam, x, y, z):
    """One world point -> u, v (pixels, first pixel centre at 0.5) and depth. cam: row of :func:`.crops.camera_row`."""
    a = cam[0] * x + cam[1] * y + cam[2] * z + cam[TX]
    b = cam[3] * x + cam[4] * y + cam[5] * z + cam[TY]
    c = cam[6] * x + cam[7] * y + cam[8] * z + cam[TZ]
    if c < 0.1:
        return -1e6, -1e6, c
    u, v = _lens(cam, a / c, b / c)
    if cam[ROW_X] != 0.0 or cam[ROW_Y] != 0.0 or cam[ROW_Z] != 0.0:
        # The row says where the camera stood, and that the row: see :meth:`.View.project`.
        x, y, z = a, b, c
        for _ in range(3):
            rows = v - cam[ROW_0]
            a, b, c = x - rows * cam[ROW_X], y - rows * cam[ROW_Y], z - rows * cam[ROW_Z]
            u, v = _lens(cam, a / c, b / c)
    return u, v, c


@njit(inline="always", **FAST)
def crop_place(photos, v, x, y, z):
    """Where photo ``v`` shows a point, u and v in pixels of its crop, and whether it does."""
    u, w, depth = project(photos.camera[v], x, y, z)
    u -= 0.5 + photos.corner[v, 1]
    w -= 0.5 + photos.corner[v, 0]
    return (
        u,
        w,
        depth >= NEAREST_M and u >= 1.0 and w >= 1.0 and u <= photos.shape[v, 1] - 2 and w <= photos.shape[v, 0] - 2,
    )


@njit(inline="always", **FAST)
def fetch(photos, view, u, v, lut, out):
    """Bilinear colour at coordinates of a photo's crop (pixel centres at integers) -> three channels; edges are
    clamped."""
    pixels, rows, columns = photos.pixels, photos.shape[view, 0], photos.shape[view, 1]
    u = min(max(u, 0.0), columns - 1.001)
    v = min(max(v, 0.0), rows - 1.001)
    i = int(v)
    j = int(u)
    a = np.float32(v - i)
    b = np.float32(u - j)
    k = photos.start[view] + (i * columns + j) * 3
    m = k + columns * 3
    one = np.float32(1.0)
    blue = (lut[pixels[k]] * (one - b) + lut[pixels[k + 3]] * b) * (one - a) + (
        lut[pixels[m]] * (one - b) + lut[pixels[m + 3]] * b
    ) * a
    green = (lut[pixels[k + 1]] * (one - b) + lut[pixels[k + 4]] * b) * (one - a) + (
        lut[pixels[m + 1]] * (one - b) + lut[pixels[m + 4]] * b
    ) * a
    red = (lut[pixels[k + 2]] * (one - b) + lut[pixels[k + 5]] * b) * (one - a) + (
        lut[pixels[m + 2]] * (one - b) + lut[pixels[m + 5]] * b
    ) * a
    out[0] = np.float32(0.299) * red + np.float32(0.587) * green + np.float32(0.114) * blue
    out[1] = np.float32(0.5) * (red - green)
    out[2] = np.float32(0.5) * (blue - green)


#: Tone: sRGB-like photo values 0..1 as they are (coarse), and linear light (fine; needed for unbiased edges).
LUT_GAMMA = (np.arange(256) / 255).astype(np.float32)
LUT_LINEAR = ((np.arange(256) / 255) ** GAMMA).astype(np.float32)


#: Columns of an axis row (:attr:`StemAxis.row`), and of the row of a known stem: radius at breast height and its slope.
P_X, P_Y, S_X, S_Y, C_X, C_Y, GROUND_Z, BH_M, RADIUS, SLOPE = range(10)


@dataclass(frozen=True)
class StemAxis:
    """A stem axis. At height q = h - breast height: xy = p + s q + c q^2, with h above ``ground_z`` (local metres).

    p, s, c: (2,) metres, metres per metre, metres per square metre.
    """

    p: np.ndarray
    s: np.ndarray
    c: np.ndarray
    ground_z: float
    bh_m: float

    def at(self, height_m: np.ndarray) -> np.ndarray:
        """(N,) heights above the ground -> (N, 3) points."""
        q = np.asarray(height_m, float) - self.bh_m
        xy = self.p + np.outer(q, self.s) + np.outer(q * q, self.c)
        return np.column_stack([xy, self.ground_z + np.asarray(height_m, float)])

    @property
    def row(self) -> np.ndarray:
        """(8,) float64: p, s, c, ground_z, bh_m."""
        return np.concatenate([self.p, self.s, self.c, [self.ground_z, self.bh_m]]).astype(np.float64)


class Strips(NamedTuple):
    """Edge evidence in every view (V), block (B) and sideways position (U).

    u: (U,) metres from the axis along ``normal`` (V, 2), the horizontal direction across the view. q: (B,) block centre
    heights minus breast height. coherence: (V, B, U) 0..1, 0 where the photo shows nothing. gradient: (V, B, U, 3) mean
    gradient per pixel. px_m: (V,) metres per pixel at the stem. widen: (V,) silhouette half width / radius (lean).
    """

    u: np.ndarray
    q: np.ndarray
    coherence: np.ndarray
    gradient: np.ndarray
    normal: np.ndarray
    px_m: np.ndarray
    widen: np.ndarray


class StripLayout(NamedTuple):
    """How strips are cut. low_m, high_m: between these heights above the ground. block_m, row_m: height of a block and
    of its rows. reach_m: half width. du_m: sideways step. sigma_px: Gaussian derivative. linear: measure in linear
    light (``tau`` is then scaled to it). tau: gradient that counts as noise."""

    low_m: float
    high_m: float
    block_m: float
    row_m: float
    reach_m: float
    du_m: float
    sigma_px: float
    linear: bool
    tau: float = 0.01


class _Sampling(NamedTuple):
    """A layout in numbers: (rows,) heights, rows a block, first place and step sideways, derivative, noise, tones."""

    heights: np.ndarray
    per_block: int
    u0: float
    du: float
    sigma_px: float
    tau: float
    lut: np.ndarray


@njit(inline="always", **FAST)
def axis_at(axis, q):
    """x and y of an axis row ``q`` above breast height."""
    return axis[P_X] + axis[S_X] * q + axis[C_X] * q * q, axis[P_Y] + axis[S_Y] * q + axis[C_Y] * q * q


@njit(inline="always", **FAST)
def across_view(axis, centre):
    """How a camera at ``centre`` sees an axis row: direction across the view, nx and ny, and silhouette half width over
    radius (lean); no direction where it stands above the stem."""
    dx, dy, dz = axis[P_X] - centre[0], axis[P_Y] - centre[1], axis[GROUND_Z] + axis[BH_M] - centre[2]
    flat = np.sqrt(dx * dx + dy * dy)
    if flat < NEAREST_M:
        return 0.0, 0.0, 1.0
    nx, ny = -dy / flat, dx / flat
    along = (axis[S_X] * dx + axis[S_Y] * dy + dz) / np.sqrt(flat * flat + dz * dz)
    a2 = axis[S_X] * axis[S_X] + axis[S_Y] * axis[S_Y] + 1.0 - along * along
    across = axis[S_X] * nx + axis[S_Y] * ny
    return nx, ny, np.sqrt(a2 / max(a2 - across * across, 1e-9))


@njit(inline="always", **FAST)
def derivative(sigma, half, rise):
    """(2 half + 1,) taps of a Gaussian derivative whose response to a ramp is its rise over ``rise`` samples."""
    taps = np.empty(2 * half + 1, np.float32)
    total = 0.0
    for k in range(2 * half + 1):
        t = (k - half) / sigma
        g = np.exp(-0.5 * t * t)
        taps[k] = -t * g
        total += t * g * (k - half)
    for k in range(2 * half + 1):
        taps[k] = -taps[k] / total * rise
    return taps


@njit(inline="always", **FAST)
def _opponent(pixels, k, lut):
    """Three channels of the pixel whose blue lies at ``k``."""
    blue, green, red = lut[pixels[k]], lut[pixels[k + 1]], lut[pixels[k + 2]]
    return (
        np.float32(0.299) * red + np.float32(0.587) * green + np.float32(0.114) * blue,
        np.float32(0.5) * (red - green),
        np.float32(0.5) * (blue - green),
    )


@njit(inline="always", **FAST)
def _between(start, end, size, at, share):
    """Whole pixels before evenly spaced places from ``start`` to ``end``, (wide,) int32, and the share of a pixel
    beyond them, (wide,) float32; edges are clamped."""
    # Small numbers: float32 to some 1e-5 pixels.
    base = np.floor(min(start, end))
    low, high = np.float32(-base), np.float32(size - 1.001 - base)
    first, step = np.float32(start - base), np.float32((end - start) / (at.size - 1))
    whole = np.int32(base)
    for i in range(at.size):
        place = min(max(first + np.float32(np.int32(i)) * step, low), high)
        before = np.int32(np.floor(place))
        share[i] = place - np.float32(before)
        at[i] = before + whole


@njit(inline="always", **FAST)
def _read_line(pixels, start, shape, ends, lut, line, at, share):
    """:func:`fetch` at evenly spaced places between the ends (u, v, u, v), (3, wide). Several places lie between the
    same four pixels, which are looked up once. at, share: (2, wide) int32 and float32 to work with."""
    rows, columns = shape
    _between(ends[0], ends[2], columns, at[0], share[0])
    _between(ends[1], ends[3], rows, at[1], share[1])
    wide = line.shape[1]
    i = 0
    while i < wide:
        column, row = at[0, i], at[1, i]
        k = start + (np.int64(row) * columns + column) * 3
        m = k + columns * 3
        # Of each channel: the upper left pixel, and what rightwards, downwards and both add.
        a0, a1, a2 = _opponent(pixels, k, lut)
        b0, b1, b2 = _opponent(pixels, k + 3, lut)
        c0, c1, c2 = _opponent(pixels, m, lut)
        d0, d1, d2 = _opponent(pixels, m + 3, lut)
        d0, d1, d2 = d0 + a0 - b0 - c0, d1 + a1 - b1 - c1, d2 + a2 - b2 - c2
        b0, b1, b2 = b0 - a0, b1 - a1, b2 - a2
        c0, c1, c2 = c0 - a0, c1 - a1, c2 - a2
        while i < wide and at[0, i] == column and at[1, i] == row:
            x, y = share[0, i], share[1, i]
            line[0, i] = a0 + x * b0 + y * (c0 + x * d0)
            line[1, i] = a1 + x * b1 + y * (c1 + x * d1)
            line[2, i] = a2 + x * b2 + y * (c2 + x * d2)
            i += 1


@njit(inline="always", **FAST)
def _read_row(photos, v, axis, h, across, lut, line, at, share):
    """One row of a strip, (3, wide), at height ``h``; False where the crop ends earlier. across: direction across the
    view, first place and length, metres."""
    nx, ny, first, reach = across
    cam, corner = photos.camera[v], photos.corner[v]
    rows, columns = photos.shape[v, 0], photos.shape[v, 1]
    x, y = axis_at(axis, h - axis[BH_M])
    z = axis[GROUND_Z] + h
    ua, va, _ = project(cam, x + first * nx, y + first * ny, z)
    ub, vb, _ = project(cam, x + (first + reach) * nx, y + (first + reach) * ny, z)
    ua -= 0.5 + corner[1]
    ub -= 0.5 + corner[1]
    va -= 0.5 + corner[0]
    vb -= 0.5 + corner[0]
    # Half of the strip may fall outside the crop; the stem itself may not.
    um = 0.5 * (ua + ub)
    vm = 0.5 * (va + vb)
    if um < 2 or vm < 2 or um > columns - 3 or vm > rows - 3:
        return False
    _read_line(photos.pixels, photos.start[v], (rows, columns), (ua, va, ub, vb), lut, line, at, share)
    return True


@njit(inline="always", **FAST)
def _add_slopes(line, taps, slope, mean, power):
    """Derivative of a row: added to (3, U) mean, its square to (U,) power. The taps are odd: one multiplication for two
    samples, three taps at a time."""
    n_u, half = slope.size, taps.size // 2
    for ch in range(3):
        row = line[ch]
        slope[:] = np.float32(0.0)
        m = 1
        while m + 2 <= half:
            t0, t1, t2 = taps[half + m], taps[half + m + 1], taps[half + m + 2]
            p0, q0 = row[half + m : half + m + n_u], row[half - m : half - m + n_u]
            p1, q1 = row[half + m + 1 : half + m + 1 + n_u], row[half - m - 1 : half - m - 1 + n_u]
            p2, q2 = row[half + m + 2 : half + m + 2 + n_u], row[half - m - 2 : half - m - 2 + n_u]
            for i in range(n_u):
                slope[i] += t0 * (p0[i] - q0[i]) + t1 * (p1[i] - q1[i]) + t2 * (p2[i] - q2[i])
            m += 3
        while m <= half:
            tap, p, q = taps[half + m], row[half + m : half + m + n_u], row[half - m : half - m + n_u]
            for i in range(n_u):
                slope[i] += tap * (p[i] - q[i])
            m += 1
        for i in range(n_u):
            mean[ch, i] += slope[i]
            power[i] += slope[i] * slope[i]


@njit(parallel=True, **FAST)
def _strips_kernel(photos, wanted, axis, sampling, strips):
    """Fill ``strips`` (a :class:`Strips`) along an axis row in the ``wanted`` photos."""
    heights, per_block, u0, du, sigma_px, tau, lut = sampling
    camera, centre = photos.camera, photos.centre
    # By name, not unpacked: Numba drops what a parallel loop writes to arrays that it does not know for arguments.
    coherence, gradient, normal = strips.coherence, strips.gradient, strips.normal
    px_m, widen = strips.px_m, strips.widen
    n_views, n_blocks, n_u = coherence.shape
    for v in prange(n_views):
        nx, ny, widen[v] = across_view(axis, centre[v])
        _, _, depth = project(camera[v], axis[P_X], axis[P_Y], axis[GROUND_Z] + axis[BH_M])
        if (nx == 0.0 and ny == 0.0) or depth < NEAREST_M:
            continue
        normal[v, 0], normal[v, 1] = nx, ny
        px = max(depth / camera[v, FX], FINEST_GSD_M)
        px_m[v] = px
        if not wanted[v]:
            continue
        sigma = sigma_px * px / du
        half = int(np.ceil(3.0 * sigma))
        taps = derivative(sigma, half, px / du)
        wide = n_u + 2 * half
        line = np.empty((3, wide), np.float32)
        at, share = np.empty((2, wide), np.int32), np.empty((2, wide), np.float32)
        mean = np.empty((3, n_u), np.float32)
        power = np.empty(n_u, np.float32)
        slope = np.empty(n_u, np.float32)
        reach = (wide - 1) * du
        first = u0 - half * du
        for b in range(n_blocks):
            mean[:] = 0.0
            power[:] = 0.0
            seen = True
            for k in range(per_block):
                h = heights[b * per_block + k]
                seen = _read_row(photos, v, axis, h, (nx, ny, first, reach), lut, line, at, share)
                if not seen:
                    break
                _add_slopes(line, taps, slope, mean, power)
            if not seen:
                continue
            scale = np.float32(1.0 / per_block)
            for i in range(n_u):
                g0 = mean[0, i] * scale
                g1 = mean[1, i] * scale
                g2 = mean[2, i] * scale
                coherence[v, b, i] = (g0 * g0 + g1 * g1 + g2 * g2) / (power[i] * scale + tau * tau)
                gradient[v, b, i, 0] = g0
                gradient[v, b, i, 1] = g1
                gradient[v, b, i, 2] = g2


def cut_strips(stack: PhotoStack, axis: StemAxis, layout: StripLayout, wanted: np.ndarray | None = None) -> Strips:
    """Cut strips along ``axis`` and measure edge coherence per block. wanted: (V,) bool, views to cut (others stay
    empty)."""
    per_block = max(int(round(layout.block_m / layout.row_m)), 2)
    n_blocks = max(int((layout.high_m - layout.low_m) / layout.block_m + 1e-6), 1)
    heights = layout.low_m + (np.arange(n_blocks * per_block) + 0.5) * (layout.block_m / per_block)
    n_u = 2 * int(round(layout.reach_m / layout.du_m)) + 1
    u0 = -layout.du_m * (n_u // 2)
    n = len(stack)
    strips = Strips(
        u=u0 + layout.du_m * np.arange(n_u),
        q=heights.reshape(n_blocks, per_block).mean(axis=1) - axis.bh_m,
        coherence=np.zeros((n, n_blocks, n_u), np.float32),
        gradient=np.zeros((n, n_blocks, n_u, 3), np.float32),
        normal=np.zeros((n, 2)),
        px_m=np.full(n, 0.02),
        widen=np.ones(n),
    )
    tau, lut = layout.tau * (0.7 if layout.linear else 1.0), LUT_LINEAR if layout.linear else LUT_GAMMA
    sampling = _Sampling(heights, per_block, u0, layout.du_m, layout.sigma_px, tau, lut)
    wanted = np.ones(n, bool) if wanted is None else wanted
    _strips_kernel(stack.arrays, wanted, axis.row, sampling, strips)
    return strips


@njit(inline="always", **FAST)
def draw_row(e, gradient, width, ridge, unit):
    """Local maxima of a row's coherence (U,) as Gaussians ``width`` samples wide, with their colour direction, of
    gradients (U, 3)."""
    n_u, reach = e.size, int(np.ceil(3 * width))
    for i in range(1, n_u - 1):
        peak = e[i]
        if peak < 0.05 or e[i - 1] > peak or e[i + 1] >= peak:
            continue
        g0, g1, g2 = gradient[i, 0], gradient[i, 1], gradient[i, 2]
        norm = np.sqrt(g0 * g0 + g1 * g1 + g2 * g2) + 1e-9
        curve = e[i - 1] - 2 * peak + e[i + 1]
        shift = 0.5 * (e[i - 1] - e[i + 1]) / curve if curve < -1e-9 else 0.0
        for j in range(max(0, i - reach), min(n_u, i + reach + 1)):
            t = (j - i - shift) / width
            value = peak * np.exp(-0.5 * t * t)
            if value > ridge[j]:
                ridge[j] = value
                unit[j, 0] = g0 / norm
                unit[j, 1] = g1 / norm
                unit[j, 2] = g2 / norm


@njit(parallel=True, **FAST)
def _ridges_kernel(coherence, gradient, width, ridge, unit):
    n_views, n_blocks, _ = coherence.shape
    for v in prange(n_views):
        for b in range(n_blocks):
            draw_row(coherence[v, b], gradient[v, b], width, ridge[v, b], unit[v, b])


def draw_ridges(coherence: np.ndarray, gradient: np.ndarray, width_samples: float) -> tuple[np.ndarray, np.ndarray]:
    """Keep the local maxima of the coherence along u, redrawn as narrow Gaussians, with the maxima's colour direction.

    Without this, one thick ridge serves as both edges of a stem. Returns ridge (V, B, U) float32 and unit gradient
    (V, B, U, 3) float32.
    """
    ridge = np.zeros_like(coherence)
    unit = np.zeros_like(gradient)
    _ridges_kernel(coherence, gradient, width_samples, ridge, unit)
    return ridge, unit


@njit(parallel=True, **FAST)
def _known_kernel(strips, axis, centre, known, margin):
    us, q, coherence, normal = strips.u, strips.q, strips.coherence, strips.normal
    u0, du = us[0], us[1] - us[0]
    n_views, n_blocks, n_u = coherence.shape
    for v in prange(n_views):
        nx, ny = normal[v, 0], normal[v, 1]
        dx, dy = ny, -nx
        for b in range(n_blocks):
            x, y = axis_at(axis, q[b])
            x -= centre[v, 0]
            y -= centre[v, 1]
            z = axis[GROUND_Z] + axis[BH_M] + q[b] - centre[v, 2]
            own = x * dx + y * dy
            side = x * nx + y * ny
            for k in range(known.shape[0]):
                stem = known[k]
                t = 0.0
                along = 1.0
                across = 0.0
                for _ in range(3):
                    bend = min(max(t, -1.5), 2.5)
                    ex = stem[P_X] + stem[S_X] * t + stem[C_X] * bend * bend - centre[v, 0]
                    ey = stem[P_Y] + stem[S_Y] * t + stem[C_Y] * bend * bend - centre[v, 1]
                    along = ex * dx + ey * dy
                    across = ex * nx + ey * ny
                    t = centre[v, 2] + z * along / own - stem[GROUND_Z] - stem[BH_M]
                if t < -stem[BH_M] - 0.2 or t > 7.0 or along < NEAREST_M:
                    continue
                wide = max(stem[RADIUS] + stem[SLOPE] * t, 0.4 * stem[RADIUS]) + margin + 0.012 * max(t, 0.0)
                middle = across * own / along - side
                half = wide * own / along
                low = max(int((middle - half - u0) / du + 1), 0)
                high = min(int((middle + half - u0) / du), n_u - 1)
                for i in range(low, high + 1):
                    coherence[v, b, i] = 0.0


def hide_known(strips: Strips, stack: PhotoStack, axis: StemAxis, known: np.ndarray, margin_m: float = 0.025) -> None:
    """Clear what known stems explain: their silhouettes in front of or behind ``axis``. In place.

    known: (K, 10) float64: :attr:`StemAxis.row`, radius at breast height and its slope.
    """
    if len(known):
        _known_kernel(strips, axis.row, stack.centre, known, margin_m)
