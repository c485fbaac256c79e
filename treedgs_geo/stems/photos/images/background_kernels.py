"""Compiled parts of the ground behind the stems (:mod:`.background`): medians, likelihoods, contrasts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from ....core.machine import FAST
from ..tuned import BESIDE_M, CEILING, FLOOR, STEP_M
from .axis_patches import BH_M, GROUND_Z, LUT_GAMMA, across_view, axis_at, crop_place, fetch

#: Log likelihood ratio of ground over the squared colour error: read from a table, so many entries a unit (to 1e-6).
RATIO_STEPS = 128.0
#: 0.6 of the ground's pixels look like their median, 40 times as densely as any other colour.
RATIO = np.log(0.6 * 40 * np.exp(-0.5 * np.arange(0, 42, 1 / RATIO_STEPS)) + 0.4).astype(np.float32)


class Tones(NamedTuple):
    """What colours are compared by. lut: (256,) of the photos' values. floor, ceiling: (3,) limits of the ground's
    noise. ratio: ``RATIO``."""

    lut: np.ndarray
    floor: np.ndarray
    ceiling: np.ndarray
    ratio: np.ndarray


TONES = Tones(LUT_GAMMA, FLOOR, CEILING, RATIO)
#: Far outside every ground, m.
NOWHERE = 1e7
#: Stands for the ratio of a place whose ground no photo shows.
UNKNOWN = np.float32(-99.0)


@njit(inline="always", **FAST)
def _insert(row, n, value):
    """Put a value among the first ``n`` of a row, which are in order."""
    while n > 0 and row[n - 1] > value:
        row[n] = row[n - 1]
        n -= 1
    row[n] = value


@njit(inline="always", **FAST)
def _median(row, n):
    """Median of the first ``n`` of a row, which are in order, and the median deviation from it."""
    half = np.float32(0.5)
    middle = half * (row[(n - 1) // 2] + row[n // 2])
    low, high, before, last = 0, n - 1, np.float32(0), np.float32(0)
    for _ in range(n // 2 + 1):  # the next largest deviation lies at one of the ends
        before, left, right = last, middle - row[low], row[high] - middle
        last = max(left, right)
        low, high = (low + 1, high) if left > right else (low, high - 1)
    return middle, last if n % 2 else half * (before + last)


@njit(parallel=True, **FAST)
def ground_medians(photos, x, y, z, lut, least, mean, spread):
    """Median colour of (N,) ground points over the photos that show them, and 1.4826 times its median deviation."""
    for i in prange(x.size):
        colours = np.empty((3, photos.start.size), np.float32)
        out = np.empty(3, np.float32)
        n = 0
        for v in range(photos.start.size):
            u, w, shown = crop_place(photos, v, x[i], y[i], z[i])
            if not shown:
                continue
            fetch(photos, v, u, w, lut, out)
            for channel in range(3):
                _insert(colours[channel], n, out[channel])
            n += 1
        if n < least:
            mean[i], spread[i] = np.nan, np.nan
            continue
        for channel in range(3):
            mean[i, channel], deviation = _median(colours[channel], n)
            spread[i, channel] = np.float32(1.4826) * deviation


@njit(inline="always", **FAST)
def ground_ratio(colour, mean, spread, f, a, b, floor, ceiling, ratio):
    """Log likelihood ratio of "this is the ground ``f`` at cell (a, b)"; :data:`UNKNOWN` where none is known."""
    error = np.float32(0.0)
    for k in range(3):
        s = spread[f, a, b, k]
        if not (s >= np.float32(0.0) and s < np.float32(9.0)):
            return UNKNOWN
        s = min(s, ceiling[k])
        error += (colour[k] - mean[f, a, b, k]) ** 2 / (s * s + floor[k] * floor[k])
    place = min(error, np.float32((ratio.size - 1.001) / RATIO_STEPS)) * np.float32(RATIO_STEPS)
    cell = int(place)
    part = place - np.float32(cell)
    return ratio[cell] * (np.float32(1.0) - part) + ratio[cell + 1] * part


@njit(inline="always", **FAST)
def behind_on_ground(ground, centre, start_z, x, y, z):
    """x and y where the viewing ray through a point meets the ground behind it; :data:`NOWHERE` for a ray that does not
    go down. start_z: a first guess of its height; centre: (3,) of the camera."""
    gx0, gy0, gcell, gz = ground
    if z >= centre[2]:
        return NOWHERE, NOWHERE
    behind = 1.0 / (z - centre[2])
    hx, hy, zg = x, y, start_z
    for _ in range(2):
        share = (zg - z) * behind
        hx = x + share * (x - centre[0])
        hy = y + share * (y - centre[1])
        a = min(max(int((hy - gy0) / gcell + 0.5), 0), gz.shape[0] - 1)
        b = min(max(int((hx - gx0) / gcell + 0.5), 0), gz.shape[1] - 1)
        zg = gz[a, b]
    return hx, hy


@njit(parallel=True, **FAST)
def likelihoods(photos, ground, backdrop, tones, axis, heights, us, silhouette):
    """Fill ``silhouette`` (a :class:`.background.Silhouette`) along an axis row, at (rows,) heights and (U,) places."""
    centre = photos.centre
    lut, floor, ceiling, ratio = tones.lut, tones.floor, tones.ceiling, tones.ratio
    bx0, by0, bcell, mean, spread, layer = backdrop
    total, normal, widen, blind = silhouette.total, silhouette.normal, silhouette.widen, silhouette.blind
    per_block = heights.size // total.shape[1]
    rows, columns = mean.shape[1], mean.shape[2]
    for v in prange(len(centre)):
        colour = np.empty(3, np.float32)
        sums = np.zeros(us.size)
        nx, ny, widen[v] = across_view(axis, centre[v])
        normal[v, 0], normal[v, 1] = nx, ny
        if nx == 0.0 and ny == 0.0:
            blind[v] = True
            continue
        for i in range(heights.size):
            ax, ay = axis_at(axis, heights[i] - axis[BH_M])
            z = axis[GROUND_Z] + heights[i]
            for j in range(us.size):
                x = ax + us[j] * nx
                y = ay + us[j] * ny
                u, w, shown = crop_place(photos, v, x, y, z)
                if not shown:
                    blind[v] = True
                    break
                hx, hy = behind_on_ground(ground, centre[v], axis[GROUND_Z], x, y, z)
                a = int((hy - by0) / bcell + 0.5)
                b = int((hx - bx0) / bcell + 0.5)
                if a < 0 or b < 0 or a >= rows or b >= columns:
                    blind[v] = True
                    break
                fetch(photos, v, u, w, lut, colour)
                value = ground_ratio(colour, mean, spread, layer[v], a, b, floor, ceiling, ratio)
                if value == UNKNOWN:
                    blind[v] = True
                    break
                sums[j] += value
            if blind[v]:
                break
            if (i + 1) % per_block == 0:
                block = i // per_block
                running = 0.0
                for j in range(us.size):
                    running += sums[j] / per_block
                    total[v, block, j + 1] = running
                    sums[j] = 0.0


@njit(inline="always", **FAST)
def sum_at(total, v, b, place):
    """Running sum of view v, block b at a place between samples."""
    k = int(place)
    share = place - k
    return total[v, b, k] * (1.0 - share) + total[v, b, min(k + 1, total.shape[2] - 1)] * share


@njit(inline="always", **FAST)
def step_contrast(total, v, b, first, last, u0):
    """How much less ground shows from place ``first`` to ``last`` (m) than beside it, weighted; 0 at the rim."""
    left = (first - u0) / STEP_M + 0.5
    right = (last - u0) / STEP_M + 0.5
    low = max((first - BESIDE_M - u0) / STEP_M + 0.5, 0.0)
    high = min((last + BESIDE_M - u0) / STEP_M + 0.5, total.shape[2] - 1 - 1e-6)
    inside = right - left
    beside = high - low - inside
    if left < low or right > high or inside < 1.0 or beside < 1.0:
        return 0.0
    within = sum_at(total, v, b, right) - sum_at(total, v, b, left)
    around = sum_at(total, v, b, high) - sum_at(total, v, b, low) - within
    step = around / beside - within / inside
    return inside * beside / (inside + beside) * step * abs(step)


@njit(**FAST)
def contrast_of(silhouette, p):
    """:meth:`.background.Silhouette.contrast` of (5,) x, y, lx, ly, r."""
    total, u0, qs, normal, widen, blind, taper = silhouette
    x, y, lx, ly, r = p[0], p[1], p[2], p[3], p[4]
    result = 0.0
    for v in range(total.shape[0]):
        if blind[v]:
            continue
        for b in range(total.shape[1]):
            c = (x + lx * qs[b]) * normal[v, 0] + (y + ly * qs[b]) * normal[v, 1]
            half = widen[v] * max(r + taper * qs[b], 0.015)
            result += step_contrast(total, v, b, c - half, c + half, u0)
    return result


@njit(parallel=True, **FAST)
def grid_contrasts(silhouette, offsets, radii, score):
    """``contrast_of`` of upright stems at every pair of offsets and radius: (Y, X, R).

    A photo sees of a place only how far it lies across the view: its contrast is tabled along that line, one entry a
    sample, and read between the entries.
    """
    total, u0, qs, normal, widen, blind, taper = silhouette
    n = offsets.size
    last = total.shape[2] - 1
    reach = 0.0
    for p in range(n):
        reach = max(reach, abs(offsets[p]))
    entries = int(np.ceil(2 * reach * np.sqrt(2.0) / STEP_M)) + 3
    first = -0.5 * STEP_M * (entries - 1)
    for k in prange(radii.size):
        line, table = np.zeros(n * n), np.empty(entries)
        for v in range(total.shape[0]):
            if blind[v]:
                continue
            table[:] = 0.0
            for b in range(total.shape[1]):
                sums = total[v, b]
                half = widen[v] * max(radii[k] + taper * qs[b], 0.015) / STEP_M
                inside = 2 * half
                if inside < 1.0:
                    continue
                for p in range(entries):
                    middle = (first + STEP_M * p - u0) / STEP_M + 0.5
                    left = middle - half
                    right = middle + half
                    low = max(left - BESIDE_M / STEP_M, 0.0)
                    high = min(right + BESIDE_M / STEP_M, last - 1e-6)
                    beside = high - low - inside
                    valid = left >= low and right <= high and beside >= 1.0
                    at = max(left, 0.0)
                    i = min(int(at), last - 1)
                    s1 = sums[i] + (sums[i + 1] - sums[i]) * (at - i)
                    at = max(min(right, float(last)), 0.0)
                    i = min(int(at), last - 1)
                    s2 = sums[i] + (sums[i + 1] - sums[i]) * (at - i)
                    at = min(low, float(last))
                    i = min(int(at), last - 1)
                    s0 = sums[i] + (sums[i + 1] - sums[i]) * (at - i)
                    at = max(high, 0.0)
                    i = min(int(at), last - 1)
                    s3 = sums[i] + (sums[i + 1] - sums[i]) * (at - i)
                    beside = max(beside, 1.0)
                    within = s2 - s1
                    step = (s3 - s0 - within) / beside - within / inside
                    value = inside * beside / (inside + beside) * step * abs(step)
                    table[p] += value if valid else 0.0
            for p in range(n * n):
                across = offsets[p % n] * normal[v, 0] + offsets[p // n] * normal[v, 1]
                at = (across - first) / STEP_M
                i = min(max(int(at), 0), entries - 2)
                line[p] += table[i] + (table[i + 1] - table[i]) * (at - i)
        for p in range(n * n):
            score[p // n, p % n, k] = line[p]
