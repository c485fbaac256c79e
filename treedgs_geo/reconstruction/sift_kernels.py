"""Compiled parts of :mod:`.sift`: extrema, orientations and descriptors, in one octave of a photo at a time."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..core.machine import FAST

#: Levels of an octave that extrema are looked for in; an octave has three Gaussians more.
LEVELS = 3
#: Bins of the histograms: of orientations, and a descriptor's cells each way and orientations in each.
TURNS, CELLS, BINS = 36, 4, 8
#: A descriptor's cell, and the reach of an orientation, in units of a feature's scale.
CELL_SCALES, REACH_SCALES = 3.0, 4.5
#: Extrema are not looked for so near the border, pixels; moved by so many steps at most.
_BORDER, _STEPS = 5, 5
#: A second orientation counts from this share of the first.
_SECOND = 0.8
_TWO_PI = np.float32(2 * np.pi)


@njit(**FAST)
def _is_extremum(layers, s, y, x, value):
    for k in range(s - 1, s + 2):
        for j in range(y - 1, y + 2):
            for i in range(x - 1, x + 2):
                other = layers[k, j, i]
                if (value > 0 and other > value) or (value < 0 and other < value):
                    return False
    return True


@njit(**FAST)
def _settled(layers, s, y, x):
    """An extremum moved to a fraction of a pixel by a parabola through its neighbours.

    Returns:
        Whether it comes to rest; level, row and column; how far off them it lies (x, y, level); its value; trace and
        determinant of its curvature in the photo.
    """
    height, width = layers.shape[1], layers.shape[2]
    half, quarter, two, zero = np.float32(0.5), np.float32(0.25), np.float32(2), np.float32(0)
    for _ in range(_STEPS):
        one, here, next_ = layers[s - 1], layers[s], layers[s + 1]
        gx = half * (here[y, x + 1] - here[y, x - 1])
        gy = half * (here[y + 1, x] - here[y - 1, x])
        gs = half * (next_[y, x] - one[y, x])
        twice = two * here[y, x]
        hxx = here[y, x + 1] + here[y, x - 1] - twice
        hyy = here[y + 1, x] + here[y - 1, x] - twice
        hss = next_[y, x] + one[y, x] - twice
        hxy = quarter * (here[y + 1, x + 1] - here[y + 1, x - 1] - here[y - 1, x + 1] + here[y - 1, x - 1])
        hxs = quarter * (next_[y, x + 1] - next_[y, x - 1] - one[y, x + 1] + one[y, x - 1])
        hys = quarter * (next_[y + 1, x] - next_[y - 1, x] - one[y + 1, x] + one[y - 1, x])
        a, b, c = hyy * hss - hys * hys, hxs * hys - hxy * hss, hxy * hys - hxs * hyy
        determinant = hxx * a + hxy * b + hxs * c
        if determinant == 0:
            break
        d, e, f = hxx * hss - hxs * hxs, hxy * hxs - hxx * hys, hxx * hyy - hxy * hxy
        dx = -(a * gx + b * gy + c * gs) / determinant
        dy = -(b * gx + d * gy + e * gs) / determinant
        ds = -(c * gx + e * gy + f * gs) / determinant
        if abs(dx) < 0.6 and abs(dy) < 0.6 and abs(ds) < 0.6:
            peak = here[y, x] + half * (gx * dx + gy * dy + gs * ds)
            return True, s, y, x, dx, dy, ds, peak, hxx + hyy, f
        if abs(dx) > 5 or abs(dy) > 5 or abs(ds) > 5:
            break
        x, y, s = x + int(np.round(dx)), y + int(np.round(dy)), s + int(np.round(ds))
        if s < 1 or s > LEVELS or x < _BORDER or y < _BORDER or x >= width - _BORDER or y >= height - _BORDER:
            break
    return False, s, y, x, zero, zero, zero, zero, zero, zero


@njit(inline="always", **FAST)
def _candidates(layer, row, least, out):
    """Pixels of a row that may be extrema, (W - 2,) bool: high or low enough, and beyond their four neighbours."""
    left, here, right = layer[row, :-2], layer[row, 1:-1], layer[row, 2:]
    up, down = layer[row - 1, 1:-1], layer[row + 1, 1:-1]
    for x in range(out.size):
        value = here[x]
        highest, lowest = max(left[x], right[x], up[x], down[x]), min(left[x], right[x], up[x], down[x])
        out[x] = ((value > least) & (highest <= value)) | ((value < -least) & (lowest >= value))


@njit(**FAST)
def extrema(layers, least, most_edge, found):
    """Extrema of the differences of Gaussians, moved to a fraction of a pixel (Lowe 2004, section 4).

    Args:
        layers: (5, H, W) float32. least: of the value at the extremum. most_edge: ratio of the curvatures. found: (N,
            5) float32 for x, y, level, value (with its sign) and the level's number; as many as fit.

    Returns:
        How many there are.
    """
    count, height, width = 0, layers.shape[1], layers.shape[2]
    first = np.float32(0.8 * least)
    worst = (most_edge + 1) ** 2 / most_edge
    likely = np.empty(width - 2, np.bool_)
    for level in range(1, LEVELS + 1):
        for row in range(_BORDER, height - _BORDER):
            _candidates(layers[level], row, first, likely)
            for column in range(_BORDER, width - _BORDER):
                if not likely[column - 1]:
                    continue
                value = layers[level, row, column]
                if not _is_extremum(layers, level, row, column, value):
                    continue
                settled, s, y, x, dx, dy, ds, peak, trace, area = _settled(layers, level, row, column)
                if not settled or abs(peak) < least or area <= 0 or trace * trace > worst * area:
                    continue
                if count < len(found):
                    found[count, 0], found[count, 1], found[count, 2] = x + dx, y + dy, s + ds
                    found[count, 3], found[count, 4] = peak, s
                    count += 1
    return count


@njit(**FAST)
def gradients(image, size, turn):
    """Length and direction (0 to 2 pi) of the grey values' gradient, (H, W) float32 each; zero at the border."""
    height, width = image.shape
    for y in range(1, height - 1):
        above, below, left, right = image[y - 1, 1:-1], image[y + 1, 1:-1], image[y, :-2], image[y, 2:]
        sizes, turns = size[y, 1:-1], turn[y, 1:-1]
        for x in range(width - 2):
            gx = np.float32(0.5) * (right[x] - left[x])
            gy = np.float32(0.5) * (below[x] - above[x])
            ax, ay = abs(gx), abs(gy)
            low, high = min(ax, ay), max(ax, ay)
            # Arc tangent by a polynomial, right to 1e-4 (Hastings).
            t = low / (high + np.float32(1e-12))
            q = t * t
            angle = t * (
                np.float32(0.9998660)
                + q
                * (
                    np.float32(-0.3302995)
                    + q * (np.float32(0.1801410) + q * (np.float32(-0.0851330) + q * np.float32(0.0208351)))
                )
            )
            angle = np.float32(np.pi / 2) - angle if ay > ax else angle
            angle = np.float32(np.pi) - angle if gx < 0 else angle
            angle = _TWO_PI - angle if gy < 0 else angle
            sizes[x] = np.sqrt(gx * gx + gy * gy)
            turns[x] = angle


@njit(**FAST)
def orientations(size, turn, feature, scale, decay, histogram, found):
    """Up to two directions of one feature, radians; how many.

    feature: x, y in pixels of the octave; scale: in these pixels. decay: (K,) exp(-k / 16). histogram: (TURNS + 2,).
    """
    height, width = size.shape
    radius = int(np.round(REACH_SCALES * scale))
    x0, y0 = int(np.round(feature[0])), int(np.round(feature[1]))
    per = np.float32(16 / (2 * (REACH_SCALES / 3 * scale) ** 2))
    bins = np.float32(TURNS) / _TWO_PI
    histogram[:] = 0
    most2 = radius * radius
    for y in range(max(y0 - radius, 1), min(y0 + radius, height - 2) + 1):
        for x in range(max(x0 - radius, 1), min(x0 + radius, width - 2) + 1):
            u, v = np.float32(x) - feature[0], np.float32(y) - feature[1]
            square = u * u + v * v
            if square > most2:
                continue
            at = turn[y, x] * bins - np.float32(0.5)
            low = int(np.floor(at))
            share = at - np.float32(low)
            value = size[y, x] * decay[min(int(square * per), len(decay) - 1)]
            low = low + TURNS if low < 0 else low
            high = low + 1 if low < TURNS - 1 else 0
            histogram[low] += (np.float32(1) - share) * value
            histogram[high] += share * value
    for _ in range(6):
        first, before = histogram[0], histogram[TURNS - 1]
        for k in range(TURNS):
            after = histogram[k + 1] if k < TURNS - 1 else first
            here = histogram[k]
            histogram[k] = (before + here + after) / np.float32(3)
            before = here
    highest = np.float32(0)
    for k in range(TURNS):
        highest = max(highest, histogram[k])
    values = np.zeros(2, np.float32)
    count = 0
    for k in range(TURNS):
        here, before, after = histogram[k], histogram[(k - 1) % TURNS], histogram[(k + 1) % TURNS]
        if here < _SECOND * highest or here <= before or here < after:
            continue
        shift = np.float32(0.5) * (before - after) / (before - 2 * here + after)
        angle = ((k + shift + np.float32(0.5)) / bins) % _TWO_PI
        if count < 2:
            values[count], found[count] = here, angle
            count += 1
        else:
            weaker = 0 if values[0] < values[1] else 1
            if here > values[weaker]:
                values[weaker], found[weaker] = here, angle
    return count


@njit(**FAST)
def describe(size, turn, feature, scale, angle, decay, cells, out):
    """A feature's descriptor (128,) uint8: root of the shares of its histogram (Arandjelovic and Zisserman 2012).

    Gaussians of two pixels and more hide nothing between every second pixel: only those are summed. cells: (CELLS + 2,
    CELLS + 2, BINS + 1) to work in.
    """
    height, width = size.shape
    cell = np.float32(CELL_SCALES * scale)
    c, s = np.cos(angle) / cell, np.sin(angle) / cell
    reach = int(np.floor(np.sqrt(2.0) * cell * (CELLS + 1) * 0.5 + 0.5))
    x0, y0 = int(np.round(feature[0])), int(np.round(feature[1]))
    half = np.float32(CELLS / 2)
    per = np.float32(16 / (2 * half * half))
    bins = np.float32(BINS) / _TWO_PI
    cells[:] = 0
    for y in range(max(y0 - reach, 1), min(y0 + reach, height - 2) + 1, 2):
        v = np.float32(y) - feature[1]
        for x in range(max(x0 - reach, 1), min(x0 + reach, width - 2) + 1, 2):
            u = np.float32(x) - feature[0]
            across, down = c * u + s * v, c * v - s * u
            column, row = across + half + np.float32(0.5), down + half + np.float32(0.5)
            if column <= 0 or row <= 0 or column >= CELLS + 1 or row >= CELLS + 1:
                continue
            at = (turn[y, x] - angle) * bins
            at = at + np.float32(BINS) if at < 0 else at
            i, j, k = int(column), int(row), int(at)
            k = min(k, BINS - 1)
            fi, fj, fk = column - np.float32(i), row - np.float32(j), at - np.float32(k)
            value = size[y, x] * decay[min(int((across * across + down * down) * per), len(decay) - 1)]
            upper, lower = value * (np.float32(1) - fj), value * fj
            a, b = upper * (np.float32(1) - fi), upper * fi
            d, e = lower * (np.float32(1) - fi), lower * fi
            cells[j, i, k] += a * (np.float32(1) - fk)
            cells[j, i, k + 1] += a * fk
            cells[j, i + 1, k] += b * (np.float32(1) - fk)
            cells[j, i + 1, k + 1] += b * fk
            cells[j + 1, i, k] += d * (np.float32(1) - fk)
            cells[j + 1, i, k + 1] += d * fk
            cells[j + 1, i + 1, k] += e * (np.float32(1) - fk)
            cells[j + 1, i + 1, k + 1] += e * fk
    total = np.float32(1e-12)
    for j in range(1, CELLS + 1):
        for i in range(1, CELLS + 1):
            cells[j, i, 0] += cells[j, i, BINS]
            for k in range(BINS):
                total += cells[j, i, k]
    for j in range(CELLS):
        for i in range(CELLS):
            for k in range(BINS):
                value = np.float32(512) * np.sqrt(cells[j + 1, i + 1, k] / total) + np.float32(0.5)
                out[(j * CELLS + i) * BINS + k] = np.uint8(min(value, np.float32(255)))


@njit(**FAST)
def describe_level(size, turn, features, sigma0, decay, kept, turned, described):
    """Orientations and descriptors of the features of one level.

    features: (K, 3) float32 x, y in pixels of the octave, level with its fraction. sigma0: scale of level 0. kept: (2
    K,) int64, which feature each row of ``described`` (2 K, 128) uint8 is of.

    Returns:
        How many rows there are.
    """
    histogram, found = np.empty(TURNS + 2, np.float32), np.empty(2, np.float32)
    cells = np.empty((CELLS + 2, CELLS + 2, BINS + 1), np.float32)
    rows = 0
    for n in range(len(features)):
        scale = np.float32(sigma0 * 2 ** (features[n, 2] / LEVELS))
        count = orientations(size, turn, features[n], scale, decay, histogram, found)
        for which in range(count):
            describe(size, turn, features[n], scale, found[which], decay, cells, described[rows])
            kept[rows], turned[rows] = n, found[which]
            rows += 1
    return rows
