"""The network's word on a place: silhouettes against its maps, and what it alone finds (:mod:`.inference`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit, prange

from ....core.machine import FAST
from ..images.axis_patches import BH_M, GROUND_Z, StemAxis, Strips, across_view, axis_at
from ..images.background import Silhouette, blank
from ..images.crops import GroundGrid
from ..tuned import (
    ABOUT_M,
    CLEAR_STEP,
    COLUMN_M,
    INNER,
    MIN_SHARE,
    MIN_STEP,
    SHARE_WEIGHT,
    STEP_PX,
    WHOLE_SHARE,
)
from .inference import OUTSIDE, STEPS, OddsMaps


@njit(inline="always", **FAST)
def _column(maps, v, x, y):
    """Column of a place in a photo's map, and its horizontal distance from the camera, metres."""
    dx, dy = x - maps.centre[v, 0], y - maps.centre[v, 1]
    swing = np.arctan2(dy, dx) - maps.grid[v, 0]
    swing -= 2 * np.pi * np.floor((swing + 0.2) / (2 * np.pi))
    return swing / maps.grid[v, 1], np.sqrt(dx * dx + dy * dy)


@njit(inline="always", **FAST)
def odds_at(maps, v, x, y, z):
    """Log odds at a point, bilinear; NaN where the photo shows nothing."""
    column, flat = _column(maps, v, x, y)
    return _between(maps, v, column, _row(maps, v, flat, z))


@njit(inline="always", **FAST)
def _row(maps, v, flat, z):
    """Row of a height in a photo's map, so far from the camera."""
    return (np.arctan2(flat, maps.centre[v, 2] - z) - maps.grid[v, 2]) / maps.grid[v, 3]


@njit(inline="always", **FAST)
def _between(maps, v, column, row):
    """:func:`odds_at` a place in a photo's map."""
    rows, columns = maps.shape[v, 0], maps.shape[v, 1]
    if row < 0 or column < 0 or row > rows - 1 or column > columns - 1:
        return np.nan
    i, j = min(int(row), rows - 2), min(int(column), columns - 2)
    a, b = row - i, column - j
    at = maps.start[v] + i * columns + j
    p, q, s, t = maps.odds[at], maps.odds[at + 1], maps.odds[at + columns], maps.odds[at + columns + 1]
    if p == OUTSIDE or q == OUTSIDE or s == OUTSIDE or t == OUTSIDE:
        return np.nan
    return ((p * (1 - b) + q * b) * (1 - a) + (s * (1 - b) + t * b) * a) / STEPS


@njit(parallel=True, **FAST)
def _cut(maps, axis, heights, us, silhouette):
    """Fill ``silhouette`` (a :class:`.images.background.Silhouette`) with the log odds of "no stem"."""
    total, normal, widen, blind = silhouette.total, silhouette.normal, silhouette.widen, silhouette.blind
    per_block = heights.size // total.shape[1]
    for v in prange(maps.centre.shape[0]):
        sums = np.zeros(us.size)
        nx, ny, widen[v] = across_view(axis, maps.centre[v])
        normal[v, 0], normal[v, 1] = nx, ny
        if nx == 0.0 and ny == 0.0:
            blind[v] = True
            continue
        for i in range(heights.size):
            ax, ay = axis_at(axis, heights[i] - axis[BH_M])
            # So short a line is straight along the columns of the map and a parabola along its rows.
            z, far = axis[GROUND_Z] + heights[i], us[-1]
            left, flat = _column(maps, v, ax - far * nx, ay - far * ny)
            top = _row(maps, v, flat, z)
            right, flat = _column(maps, v, ax + far * nx, ay + far * ny)
            bottom = _row(maps, v, flat, z)
            _, flat = _column(maps, v, ax, ay)
            middle = _row(maps, v, flat, z)
            slope, bend = 0.5 * (bottom - top), 0.5 * (bottom + top) - middle
            for j in range(us.size):
                t = us[j] / far
                value = _between(maps, v, left + 0.5 * (1 + t) * (right - left), middle + t * (slope + t * bend))
                if not (value > -99.0):
                    blind[v] = True
                    break
                sums[j] -= SHARE_WEIGHT / (1.0 + np.exp(-value))
            if blind[v]:
                break
            if (i + 1) % per_block == 0:
                block = i // per_block
                running = 0.0
                for j in range(us.size):
                    running += sums[j] / per_block
                    total[v, block, j + 1] = running
                    sums[j] = 0.0


def cut_bark(maps: OddsMaps, axis: StemAxis, band: tuple[float, float]) -> Silhouette:
    """How little stem the network sees around an axis, in every photo: as a silhouette, so that contrast and peaks are
    those of the ground's (:mod:`.images.background`). band: heights above the ground, metres."""
    silhouette, heights, places = blank(len(maps.centre), axis, band)
    _cut(maps, axis.row, heights, places, silhouette)
    return silhouette


def with_bark(ground: Silhouette, bark: Silhouette) -> Silhouette:
    """Both silhouettes as one: their log likelihood ratios are added."""
    return ground._replace(total=ground.total + bark.total, blind=ground.blind | bark.blind)


#: A share outside of a photo's map: so low that a mean with it is negative.
UNKNOWN = -1e9


@njit(parallel=True, **FAST)
def _weigh_edges(strips, seen, axis, r0, r1, maps, apart_px, apart_m):
    us, qs, coherence, _, normal, px_m, _ = strips
    n, middle = us.size, us.size // 2
    for v in prange(coherence.shape[0]):
        if not seen[v]:
            continue
        share = np.empty(n)
        k = max(int(max(apart_px * px_m[v], apart_m) / (us[1] - us[0]) + 0.5), 1)
        for b in range(qs.size):
            x, y = axis_at(axis, qs[b])
            z = axis[GROUND_Z] + axis[BH_M] + qs[b]
            for i in range(n):
                value = odds_at(maps, v, x + us[i] * normal[v, 0], y + us[i] * normal[v, 1], z)
                share[i] = 1.0 / (1.0 + np.exp(-value)) if value > -99.0 else UNKNOWN
            half = int(INNER * max(r0 + r1 * qs[b], 0.01) / (us[1] - us[0]))
            within = share[max(middle - half, 0) : middle + half + 1].mean()
            if within < 0.0:
                continue
            shown = min(max(within / WHOLE_SHARE, MIN_SHARE), 1.0)
            for i in range(n):
                side = 1 if i > middle else -1
                inner, outer = share[min(max(i - side * k, 0), n - 1)], share[min(max(i + side * k, 0), n - 1)]
                step = inner - outer if inner >= 0.0 and outer >= 0.0 else CLEAR_STEP
                coherence[v, b, i] *= np.float32(shown * min(max(step / CLEAR_STEP, MIN_STEP), 1.0))


def weigh_edges(strips: Strips, seen: np.ndarray, axis: StemAxis, r0: float, r1: float, maps: OddsMaps) -> None:
    """Lessen the coherence of strips about a stem where the network does not see it, and where it does not see it end:
    bark on this side, none on the other. In place. seen: (V,) bool, photos that were cut. r0, r1: radius at breast
    height (m) and its slope (m/m)."""
    _weigh_edges(strips, seen, axis.row, r0, r1, maps, STEP_PX, COLUMN_M)


@njit(parallel=True, **FAST)
def _shares(maps, views, axis, radii, heights, across, share):
    for k in prange(share.shape[0]):
        nx, ny, _ = across_view(axis, maps.centre[views[k]])
        for i in range(heights.size):
            ax, ay = axis_at(axis, heights[i] - axis[BH_M])
            total = 0.0
            for j in range(across.size):
                u = across[j] * radii[i]
                value = odds_at(maps, views[k], ax + u * nx, ay + u * ny, axis[GROUND_Z] + heights[i])
                if not (value > -99.0):
                    total = UNKNOWN
                    break
                total += 1.0 / (1.0 + np.exp(-value))
            share[k, i] = total / across.size


def covered_share(
    bark: OddsMaps, either: OddsMaps, views: Sequence[int], axis: StemAxis, r0: float, r1: float
) -> float:
    """Share of ivy in what the network takes for bark or ivy (``either``) within a stem's silhouette about breast
    height, over some photos; NaN where none shows it. r0, r1: radius there (m) and its slope (m/m)."""
    heights = axis.bh_m + np.arange(-ABOUT_M, ABOUT_M + 0.01, 0.1)
    radii = np.maximum(r0 + r1 * (heights - axis.bh_m), 0.01)
    found = []
    for each in (bark, either):
        share = np.full((len(views), len(heights)), np.nan)
        _shares(each, np.array(views, np.int64), axis.row, radii, heights, np.linspace(-INNER, INNER, 7), share)
        found.append(share)
    known = (found[0] >= 0) & (found[1] >= 0)  # below: outside of the photo
    return float(1 - found[0][known].sum() / max(found[1][known].sum(), 1e-9)) if known.any() else np.nan


@njit(parallel=True, **FAST)
def _sum_layers(maps, shifts, x0, y0, cell, z, heights, total):
    for i in prange(total.shape[1]):
        found = np.empty(heights.size)
        middle, far = 0.5 * (heights[0] + heights[-1]), 0.5 * (heights[-1] - heights[0])
        for j in range(total.shape[2]):
            x, y = x0 + j * cell, y0 + i * cell
            found[:] = 0.0
            for v in range(maps.centre.shape[0]):
                column, flat = _column(maps, v, x + shifts[v, 0], y + shifts[v, 1])
                # Upwards the rows are a parabola, too.
                low, high = _row(maps, v, flat, z[i, j] + heights[0]), _row(maps, v, flat, z[i, j] + heights[-1])
                at = _row(maps, v, flat, z[i, j] + middle)
                slope, bend = 0.5 * (high - low), 0.5 * (high + low) - at
                for m in range(heights.size):
                    t = (heights[m] - middle) / far
                    value = _between(maps, v, column, at + t * (slope + t * bend))
                    if value > -99.0:
                        found[m] += value
            for m in range(heights.size):
                total[m, i, j] = found[m]


def stem_layers(maps: OddsMaps, shifts: np.ndarray, cells: GroundGrid, heights: np.ndarray) -> np.ndarray:
    """(layers, rows, columns) float32 log likelihood ratio of "a stem is here", summed over the photos. maps: of
    :func:`.inference.stem_ratios`. shifts: (V, 2) metres by which each photo is moved (decoys). cells: where, on the
    ground; heights: above it, metres."""
    total = np.zeros((len(heights), *cells.z.shape), np.float32)
    _sum_layers(maps, shifts, cells.x0, cells.y0, cells.cell, cells.z, heights, total)
    return total
