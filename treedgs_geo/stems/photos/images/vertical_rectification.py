"""Photos resampled so that every vertical line in the world is a column: azimuth about the plumb line x nadir angle.

A vertical cylinder of radius r at horizontal distance D then has its edges at azimuth +- asin(r / D), whatever the
camera's tilt. The maps hold edge coherence (see :mod:`.axis_patches`) as thin ridges with their colour direction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from ....core.machine import FAST
from ..tuned import STRAIGHT_M
from .axis_patches import LUT_GAMMA, NEAREST_M, derivative, draw_row, fetch, project
from .crops import FX, GroundGrid, PhotoStack

#: A camera looks down at stems from this height above them on, over their distance.
LOOKS_DOWN = 0.3


class PlumbGrid(NamedTuple):
    """Where the rows and columns of one view's map lie.

    azimuth0, step_a: azimuth of column 0 and column width, rad (counter-clockwise from east). nadir0, step_n: nadir
    angle of row 0 and row height, rad. shape: rows, columns. centre: (3,) camera. distance: (2,) horizontal range of
    the area, metres; middle_m: its median.
    """

    azimuth0: float
    step_a: float
    nadir0: float
    step_n: float
    shape: tuple[int, int]
    centre: np.ndarray
    distance: np.ndarray
    middle_m: float


class PlumbMap(NamedTuple):
    """One view's edge map, on a :class:`PlumbGrid`. ridge: (rows, columns) uint8, coherence x 255. unit: (rows,
    columns, 3) int8, unit colour gradient along the columns x 127."""

    azimuth0: float
    step_a: float
    nadir0: float
    step_n: float
    ridge: np.ndarray
    unit: np.ndarray
    centre: np.ndarray
    distance: np.ndarray


class _Filter(NamedTuple):
    """sigma: of the Gaussian derivative, columns. tau: gradient that counts as noise. window_m: height of the piece
    whose rows must agree, at stems ``below_m`` under the camera and ``middle_m`` away (median). width: of a drawn
    ridge, columns. lut: tones."""

    sigma: float
    tau: float
    window_m: float
    below_m: float
    middle_m: float
    width: float
    lut: np.ndarray


@njit(inline="always", **FAST)
def row_knots(cam, corner, centre, angle, azimuth0, step_a, wide):
    """Crop columns and rows of every 16th of ``wide`` columns of a map's row at a nadir angle; between them, linear."""
    n_knots = wide // 16 + 2
    sn, cn = np.sin(angle), np.cos(angle)
    ku, kv = np.empty(n_knots), np.empty(n_knots)
    for k in range(n_knots):
        a = azimuth0 + k * 16 * step_a
        u, v, _ = project(cam, centre[0] + 50 * sn * np.cos(a), centre[1] + 50 * sn * np.sin(a), centre[2] - 50 * cn)
        ku[k], kv[k] = u - 0.5 - corner[1], v - 0.5 - corner[0]
    return ku, kv


@njit(inline="always", **FAST)
def _read_row(photos, view, centre, angle, azimuth0, step_a, half, lut, line, good):
    """One row of the map, at a nadir angle, with ``half`` more columns on both sides: (3, wide) line, (wide,) good."""
    cam, corner, shape = photos.camera[view], photos.corner[view], photos.shape[view]
    rows, columns = shape[0], shape[1]
    wide = good.size
    ku, kv = row_knots(cam, corner, centre, angle, azimuth0 - half * step_a, step_a, wide)
    colour = np.empty(3, np.float32)
    for j in range(wide):
        k = j // 16
        t = (j - k * 16) / 16.0
        u = ku[k] + t * (ku[k + 1] - ku[k])
        v = kv[k] + t * (kv[k + 1] - kv[k])
        if u < 0 or v < 0 or u > columns - 1 or v > rows - 1:
            continue
        good[j] = True
        fetch(photos, view, u, v, lut, colour)
        line[0, j] = colour[0]
        line[1, j] = colour[1]
        line[2, j] = colour[2]


@njit(inline="always", **FAST)
def _coherence(slope, energy, inside, low, high, tau, mean, e):
    """Coherence (columns,) of the rows low to high, and the sums of their slopes, (3, columns) mean."""
    n_cols = e.size
    n = np.float32(high - low + 1)
    power = np.zeros(n_cols, np.float32)
    for k in range(low, high + 1):
        for ch in range(3):
            to, values = mean[ch], slope[k, ch]
            for j in range(n_cols):
                to[j] += values[j]
        values = energy[k]
        for j in range(n_cols):
            power[j] += values[j]
    for j in range(n_cols):
        if inside[low, j] and inside[high, j]:
            m2 = (mean[0, j] ** 2 + mean[1, j] ** 2 + mean[2, j] ** 2) / (n * n)
            e[j] = m2 / (power[j] / n + np.float32(tau * tau))


@njit(parallel=True, **FAST)
def _map_kernel(photos, view, plumb, filters):
    """Fill the ridge and the colour directions of ``plumb`` (a :class:`PlumbMap`) from one photo."""
    azimuth0, step_a, nadir0, step_n, ridge, unit, centre, _ = plumb
    sigma, tau, window_m, below, middle_m, width, lut = filters
    n_rows, n_cols = ridge.shape
    half = int(np.ceil(3 * sigma))
    taps = derivative(sigma, half, 1.0)
    wide = n_cols + 2 * half
    slope = np.zeros((n_rows, 3, n_cols), np.float32)
    energy = np.empty((n_rows, n_cols), np.float32)
    inside = np.zeros((n_rows, n_cols), np.bool_)
    for i in prange(n_rows):
        line = np.zeros((3, wide), np.float32)
        good = np.zeros(wide, np.bool_)
        _read_row(photos, view, centre, nadir0 + i * step_n, azimuth0, step_a, half, lut, line, good)
        for ch in range(3):
            row = slope[i, ch]
            for m in range(2 * half + 1):
                tap = taps[m]
                shifted = line[ch, m : m + n_cols]
                for j in range(n_cols):
                    row[j] += tap * shifted[j]
        for j in range(n_cols):
            if good[j] and good[j + 2 * half]:
                inside[i, j] = True
            else:
                for ch in range(3):
                    slope[i, ch, j] = 0.0
        for j in range(n_cols):
            energy[i, j] = slope[i, 0, j] ** 2 + slope[i, 1, j] ** 2 + slope[i, 2, j] ** 2
    for i in prange(n_rows):
        angle = nadir0 + i * step_n
        # A camera far above sees one distance in a row; one that looks across sees stems at all of them.
        slant = below / np.cos(angle) if below > LOOKS_DOWN * middle_m else middle_m / np.sin(angle)
        reach = max(int(0.5 * window_m * np.sin(angle) / (slant * step_n) + 0.5), 1)
        low, high = max(0, i - reach), min(n_rows - 1, i + reach)
        mean = np.zeros((3, n_cols), np.float32)
        e = np.zeros(n_cols, np.float32)
        _coherence(slope, energy, inside, low, high, tau, mean, e)
        drawn, colour = np.zeros(n_cols, np.float32), np.zeros((n_cols, 3), np.float32)
        draw_row(e, mean.T, width, drawn, colour)
        for j in range(n_cols):
            ridge[i, j] = int(min(drawn[j], 1.0) * 255 + 0.5)
            for ch in range(3):
                unit[i, j, ch] = int(np.round(127 * colour[j, ch]))


def plumb_grid(stack: PhotoStack, view: int, points: np.ndarray) -> PlumbGrid:
    """Grid of one view over the points' footprint. points: (N, 3) corners of the volume searched, local metres."""
    centre = stack.centre[view]
    ahead = np.isfinite(stack.views[view].project(points)[0]).all(axis=1)
    offset = points[ahead] - centre
    flat = np.hypot(offset[:, 0], offset[:, 1])
    nadir = np.arctan2(flat, -offset[:, 2])
    low_n, first_m = float(nadir.min()), float(flat.min())
    if not ahead.all():
        # The camera stands among the stems: they begin at its feet.
        low_n, first_m = 0.0, NEAREST_M
    middle = offset.mean(axis=0)
    aim = np.arctan2(middle[1], middle[0])
    swing = (np.arctan2(offset[:, 1], offset[:, 0]) - aim + np.pi) % (2 * np.pi) - np.pi
    focal = stack.camera[view, FX]
    sine = np.sin(np.median(nadir))
    step_n = 1.0 / focal
    step_a = 1.0 / (focal * max(sine, 0.1))
    # What the crop shows bounds the map as well.
    rows, columns = stack.shape[view]
    border = np.array([(u, v) for u in np.linspace(0, columns, 5) for v in np.linspace(0, rows, 5)], float)
    rays = stack.views[view].rays(border + stack.corner[view][::-1])
    seen_nadir = np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), -rays[:, 2])
    seen_swing = (np.arctan2(rays[:, 1], rays[:, 0]) - aim + np.pi) % (2 * np.pi) - np.pi
    low_n, high_n = max(low_n, seen_nadir.min()), min(nadir.max(), seen_nadir.max())
    low_a, high_a = max(swing.min(), seen_swing.min()), min(swing.max(), seen_swing.max())
    n_rows = max(int((high_n - low_n) / step_n) + 1, 3)
    n_cols = max(int((high_a - low_a) / step_a) + 1, 16)
    distance = np.array([first_m, flat.max()])
    azimuth0, nadir0 = float(aim + low_a), float(low_n)
    middle_m = float(np.median(flat))
    return PlumbGrid(azimuth0, float(step_a), nadir0, float(step_n), (n_rows, n_cols), centre, distance, middle_m)


def make_map(
    stack: PhotoStack,
    view: int,
    ground: GroundGrid,
    grid: PlumbGrid,
    ridge_m: float = 0.022,
    sigma_px: float = 1.0,
    tau: float = 0.01,
) -> PlumbMap:
    """Edge map of one view."""
    ridge, unit = np.zeros(grid.shape, np.uint8), np.zeros((*grid.shape, 3), np.int8)
    plumb = PlumbMap(*grid[:4], ridge, unit, grid.centre, grid.distance)
    below = float(grid.centre[2] - float(np.median(ground.z)) - 2.0)
    width = float(ridge_m / (grid.step_a * grid.middle_m))
    filters = _Filter(sigma_px, tau, STRAIGHT_M, below, grid.middle_m, width, LUT_GAMMA)
    _map_kernel(stack.arrays, view, plumb, filters)
    return plumb
