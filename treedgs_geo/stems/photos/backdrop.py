"""The ground behind the stems, and how little of it is seen where a stem stands.

Every photo of a flight sees the same ground under the same sun. Its colour there is the median over the photos: what
hides it in one photo hides other places in the next. In each photo the ground then shows through everywhere except
where something stands before it, and along an upright axis that something is a stem: its silhouette, found without any
edge. This is the check that edges cannot give: the lit half of a stem has clear edges but its other half is not ground.
Own method; what it brought is in ``docs/stems-from-photos.md``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange

from .stack import GroundGrid, PhotoStack
from .strips import LUT_GAMMA, Axis, fetch, project

_FAST = {"nogil": True, "cache": True, "fastmath": True}
#: Photos a flight needs for a ground of its own, and how many of a flight are used at most.
LEAST_VIEWS, MOST_VIEWS = 6, 32
#: Noise floors and ceilings of the ground's colour: luma, and the two colour differences.
_FLOOR = np.array([0.030, 0.008, 0.008], np.float32)
_CEILING = np.array([0.060, 0.020, 0.020], np.float32)
#: Share of ground pixels that look like their median, and the density of those over that of any other colour.
_SHARE, _PEAK = 0.6, 40.0
#: Height band of the silhouette above ground, row and block heights, metres.
BAND = 0.4, 3.3
_ROW_M, _BLOCK_ROWS = 0.05, 10
#: Half width of the strips and sample spacing; how far beside the stem the ground is compared, metres.
_REACH_M, _STEP_M, _BESIDE_M = 0.75, 0.01, 0.25
#: Blur of an edge: left out between two explanations, metres.
_CLEAR_M = 0.014


@dataclass(frozen=True)
class Backdrop:
    """Ground colours. mean, spread: (F, rows, columns, 3) float32, NaN = not seen; rows from ``y0``, columns from
    ``x0``, every ``cell`` metres. layer: (V,) int64, which of the F a photo belongs to."""

    x0: float
    y0: float
    cell: float
    mean: np.ndarray
    spread: np.ndarray
    layer: np.ndarray


def make_backdrop(
    stack: PhotoStack, ground: GroundGrid, box: tuple[float, float, float, float], cell: float = 0.05
) -> Backdrop | None:
    """The ground of each flight inside ``box`` (x0, y0, x1, y1); flights with few photos are pooled.

    ``None`` where too few photos show the ground for a median.
    """
    flights = np.array([view.flight for view in stack.views], np.int64)
    names, layer, counts = np.unique(flights, return_inverse=True, return_counts=True)
    if (counts < LEAST_VIEWS).any():
        layer, names = np.zeros(len(flights), np.int64), names[:1]
    if len(flights) < LEAST_VIEWS:
        return None
    x = np.arange(box[0], box[2], cell)
    y = np.arange(box[1], box[3], cell)
    gx, gy = (grid.ravel() for grid in np.meshgrid(x, y))
    gz = ground.at(gx, gy)
    mean = np.empty((len(names), len(y), len(x), 3), np.float32)
    spread = np.empty_like(mean)
    for index in range(len(names)):
        members = np.flatnonzero(layer == index)
        members = members[np.unique(np.linspace(0, len(members) - 1, min(len(members), MOST_VIEWS)).astype(int))]
        colours = np.empty((len(gx), len(members), 3), np.float32)
        _sample_kernel(*_only(stack, members), gx, gy, gz, LUT_GAMMA, colours)
        _median_kernel(colours, LEAST_VIEWS - 2, mean[index].reshape(-1, 3), spread[index].reshape(-1, 3))
    return Backdrop(float(x[0]), float(y[0]), cell, mean, spread, layer.astype(np.int64))


@dataclass(frozen=True)
class Silhouette:
    """How little ground is seen around one axis.

    total: (V, B, U + 1) running sums over the sideways samples of the ground likelihood (log ratio). u0: place of
    the first sample, m. q: (B,) block heights minus breast height. normal: (V, 2) direction across each view. widen:
    (V,) silhouette half width over radius (lean). blind: (V,) photos that do not show the whole strip.
    """

    total: np.ndarray
    u0: float
    q: np.ndarray
    normal: np.ndarray
    widen: np.ndarray
    blind: np.ndarray
    taper: float = -0.0045

    def contrast(self, vector: np.ndarray) -> float:
        """How much less ground is seen inside than beside a stem (x, y, lx, ly, r relative to the axis): the summed
        square error that the silhouette explains, over all photos and heights."""
        return float(_contrast(*self._common, *map(float, vector), self.taper, self.u0))

    @property
    def _common(self) -> tuple[np.ndarray, ...]:
        return self.total, self.q, self.normal, self.widen, self.blind

    def peaks(self, radii: np.ndarray, reach_m: float = 0.26, most: int = 6, share: float = 0.3) -> list[np.ndarray]:
        """The best silhouettes of upright stems near the axis, best first: (5,) vectors with no lean."""
        from scipy.ndimage import maximum_filter

        offsets = np.arange(-reach_m, reach_m + 0.01, 0.02)
        score = np.empty((len(offsets), len(offsets), len(radii)), np.float32)
        _grid_kernel(*self._common, offsets, radii, self.taper, self.u0, score)
        top = np.argwhere((score >= maximum_filter(score, size=5)) & (score > share * max(float(score.max()), 1e-6)))
        order = np.argsort(-score[tuple(top.T)], kind="stable")[:most]
        return [np.array([offsets[b], offsets[a], 0.0, 0.0, radii[k]]) for a, b, k in top[order]]


    def between(self, inner: np.ndarray, outer: np.ndarray) -> tuple[float, float]:
        """What shows between the edges of two explanations, one inside the other: mean ground log likelihood ratio
        (> 0: ground, so that the outer one is too wide; < 0: not ground, so that the inner one is a part) and how many
        samples tell. Only where ground shows outside both and none inside both."""
        total, count = _between(*self._common, inner, outer, self.taper, self.u0)
        return (float(total / count) if count > 0 else 0.0), float(count)


def cut_silhouette(stack: PhotoStack, backdrop: Backdrop, ground: GroundGrid, axis: Axis) -> Silhouette:
    """Ground likelihood in every photo along an axis."""
    heights = np.arange(BAND[0], BAND[1], _ROW_M)
    heights = heights[: len(heights) // _BLOCK_ROWS * _BLOCK_ROWS]
    u = np.arange(-_REACH_M, _REACH_M + _STEP_M / 2, _STEP_M)
    blocks = len(heights) // _BLOCK_ROWS
    total = np.zeros((len(stack), blocks, len(u) + 1))
    normal, widen = np.zeros((len(stack), 2)), np.ones(len(stack))
    blind = np.zeros(len(stack), np.bool_)
    grid = (ground.x0, ground.y0, ground.cell, ground.z)
    picture = (backdrop.x0, backdrop.y0, backdrop.cell, backdrop.mean, backdrop.spread, backdrop.layer)
    _likelihood_kernel(
        *stack.arrays,
        *grid,
        *picture,
        axis.row,
        heights,
        _BLOCK_ROWS,
        u,
        LUT_GAMMA,
        _FLOOR,
        _CEILING,
        total,
        normal,
        widen,
        blind,
    )
    q = heights.reshape(blocks, _BLOCK_ROWS).mean(axis=1) - axis.bh_m
    return Silhouette(total, float(u[0]), q, normal, widen, blind)


def _only(stack: PhotoStack, members: np.ndarray) -> tuple[np.ndarray, ...]:
    return (stack.pixels, stack.start[members], stack.shape[members], stack.corner[members], stack.camera[members])


@njit(parallel=True, **_FAST)
def _sample_kernel(pixels, start, shape, corner, camera, x, y, z, lut, colours):
    for i in prange(x.size):
        out = np.empty(3, np.float32)
        for v in range(camera.shape[0]):
            u, w, depth = project(camera[v], x[i], y[i], z[i])
            u -= 0.5 + corner[v, 1]
            w -= 0.5 + corner[v, 0]
            if depth < 1.0 or u < 1.0 or w < 1.0 or u > shape[v, 1] - 2 or w > shape[v, 0] - 2:
                colours[i, v, 0] = np.float32(-9.0)
                continue
            fetch(pixels, start[v], shape[v, 0], shape[v, 1], u, w, lut, out)
            colours[i, v] = out


@njit(parallel=True, **_FAST)
def _median_kernel(colours, least, mean, spread):
    for i in prange(colours.shape[0]):
        values = np.empty(colours.shape[1], np.float32)
        for channel in range(3):
            n = 0
            for v in range(colours.shape[1]):
                if colours[i, v, 0] > np.float32(-8.0):
                    values[n] = colours[i, v, channel]
                    n += 1
            if n < least:
                mean[i, channel] = np.nan
                spread[i, channel] = np.nan
                continue
            some = values[:n]
            middle = np.median(some)
            mean[i, channel] = middle
            for k in range(n):
                some[k] = abs(some[k] - middle)
            spread[i, channel] = np.float32(1.4826) * np.median(some)


@njit(parallel=True, **_FAST)
def _likelihood_kernel(
    pixels,
    start,
    shape,
    corner,
    camera,
    centre,
    gx0,
    gy0,
    gcell,
    gz,
    bx0,
    by0,
    bcell,
    mean,
    spread,
    layer,
    axis,
    heights,
    per_block,
    us,
    lut,
    floor,
    ceiling,
    total,
    normal,
    widen,
    blind,
):
    rows, columns = mean.shape[1], mean.shape[2]
    for v in prange(camera.shape[0]):
        colour = np.empty(3, np.float32)
        sums = np.zeros(us.size)
        dx = axis[0] - centre[v, 0]
        dy = axis[1] - centre[v, 1]
        flat = np.sqrt(dx * dx + dy * dy)
        if flat < 1.0:
            blind[v] = True
            continue
        nx = -dy / flat
        ny = dx / flat
        normal[v, 0] = nx
        normal[v, 1] = ny
        dz = axis[6] + axis[7] - centre[v, 2]
        far = np.sqrt(flat * flat + dz * dz)
        along = (axis[2] * dx + axis[3] * dy + dz) / far
        a2 = axis[2] * axis[2] + axis[3] * axis[3] + 1.0 - along * along
        across = axis[2] * nx + axis[3] * ny
        widen[v] = np.sqrt(a2 / max(a2 - across * across, 1e-9))
        for i in range(heights.size):
            q = heights[i] - axis[7]
            ax = axis[0] + axis[2] * q + axis[4] * q * q
            ay = axis[1] + axis[3] * q + axis[5] * q * q
            z = axis[6] + heights[i]
            for j in range(us.size):
                x = ax + us[j] * nx
                y = ay + us[j] * ny
                u, w, depth = project(camera[v], x, y, z)
                u -= 0.5 + corner[v, 1]
                w -= 0.5 + corner[v, 0]
                if depth < 1.0 or u < 1.0 or w < 1.0 or u > shape[v, 1] - 2 or w > shape[v, 0] - 2:
                    blind[v] = True
                    break
                # The viewing ray goes on behind the axis down to the ground.
                zg = axis[6]
                hx = x
                hy = y
                for _ in range(2):
                    share = (zg - z) / (z - centre[v, 2])
                    hx = x + share * (x - centre[v, 0])
                    hy = y + share * (y - centre[v, 1])
                    a = min(max(int((hy - gy0) / gcell + 0.5), 0), gz.shape[0] - 1)
                    b = min(max(int((hx - gx0) / gcell + 0.5), 0), gz.shape[1] - 1)
                    zg = gz[a, b]
                a = int((hy - by0) / bcell + 0.5)
                b = int((hx - bx0) / bcell + 0.5)
                if a < 0 or b < 0 or a >= rows or b >= columns:
                    blind[v] = True
                    break
                fetch(pixels, start[v], shape[v, 0], shape[v, 1], u, w, lut, colour)
                f = layer[v]
                error = np.float32(0.0)
                for k in range(3):
                    s = spread[f, a, b, k]
                    m = mean[f, a, b, k]
                    if not (s >= np.float32(0.0) and s < np.float32(9.0)):
                        blind[v] = True
                        break
                    s = min(s, ceiling[k])
                    error += (colour[k] - m) ** 2 / (s * s + floor[k] * floor[k])
                if blind[v]:
                    break
                sums[j] += np.log(_SHARE * _PEAK * np.exp(-0.5 * error) + (1.0 - _SHARE))
            if blind[v]:
                break
            if (i + 1) % per_block == 0:
                block = i // per_block
                running = 0.0
                for j in range(us.size):
                    running += sums[j] / per_block
                    total[v, block, j + 1] = running
                    sums[j] = 0.0


@njit(inline="always", **_FAST)
def _at(total, v, b, place):
    k = int(place)
    share = place - k
    return total[v, b, k] * (1.0 - share) + total[v, b, min(k + 1, total.shape[2] - 1)] * share


@njit(**_FAST)
def _contrast(total, qs, normal, widen, blind, x, y, lx, ly, r, taper, u0):
    samples = total.shape[2] - 1
    result = 0.0
    for v in range(total.shape[0]):
        if blind[v]:
            continue
        for b in range(total.shape[1]):
            c = (x + lx * qs[b]) * normal[v, 0] + (y + ly * qs[b]) * normal[v, 1]
            half = widen[v] * max(r + taper * qs[b], 0.015)
            left = (c - half - u0) / _STEP_M + 0.5
            right = (c + half - u0) / _STEP_M + 0.5
            low = max((c - half - _BESIDE_M - u0) / _STEP_M + 0.5, 0.0)
            high = min((c + half + _BESIDE_M - u0) / _STEP_M + 0.5, samples - 1e-6)
            inside = right - left
            beside = high - low - inside
            if left < low or right > high or inside < 1.0 or beside < 1.0:
                continue
            within = _at(total, v, b, right) - _at(total, v, b, left)
            around = _at(total, v, b, high) - _at(total, v, b, low) - within
            step = around / beside - within / inside
            result += inside * beside / (inside + beside) * step * abs(step)
    return result


@njit(**_FAST)
def _mean(total, v, b, a, c, u0):
    """Mean over the samples from place a to place c (m), NaN outside the strip or with less than half a sample."""
    if c < a:
        a, c = c, a
    low = (a - u0) / _STEP_M + 0.5
    high = (c - u0) / _STEP_M + 0.5
    if low < 0 or high > total.shape[2] - 1 or high - low < 0.5:
        return np.nan, 0.0
    return (_at(total, v, b, high) - _at(total, v, b, low)) / (high - low), high - low


@njit(**_FAST)
def _between(total, qs, normal, widen, blind, inner, outer, taper, u0):
    summed, count = 0.0, 0.0
    for v in range(total.shape[0]):
        if blind[v]:
            continue
        nx, ny = normal[v, 0], normal[v, 1]
        for b in range(total.shape[1]):
            q = qs[b]
            ci = (inner[0] + inner[2] * q) * nx + (inner[1] + inner[3] * q) * ny
            co = (outer[0] + outer[2] * q) * nx + (outer[1] + outer[3] * q) * ny
            ri = widen[v] * max(inner[4] + taper * q, 0.015)
            ro = widen[v] * max(outer[4] + taper * q, 0.015)
            for side in (-1.0, 1.0):
                ui = ci + side * ri
                uo = co + side * ro
                if side * (uo - ui) < _CLEAR_M + 0.012:
                    continue
                beyond, _ = _mean(total, v, b, uo + side * 0.01, uo + side * 0.06, u0)
                within, _ = _mean(total, v, b, ui - side * 0.01, ui - side * min(0.06, ri), u0)
                if not beyond > 1.0 or not within < 1.0:
                    continue
                value, samples = _mean(total, v, b, ui + side * 0.5 * _CLEAR_M, uo - side * 0.5 * _CLEAR_M, u0)
                if samples > 0.0:
                    summed += value * samples
                    count += samples
    return summed, count


@njit(parallel=True, **_FAST)
def _grid_kernel(total, qs, normal, widen, blind, offsets, radii, taper, u0, score):
    for a in prange(offsets.size):
        for b in range(offsets.size):
            for k in range(radii.size):
                score[a, b, k] = _contrast(
                    total, qs, normal, widen, blind, offsets[b], offsets[a], 0.0, 0.0, radii[k], taper, u0
                )
