"""Stems that the search for upright edges missed: what stands where no photo sees the ground through.

Each photo says of every place on the ground whether it sees it (:mod:`.images.background`). A point in the air
through which some photos see the ground is empty; a point in a stem, however it leans, shows ground to none. So the
ground's log likelihood ratio, carried along the viewing rays, is summed over the photos on a grid of points in layers;
what is lower than its surroundings is added up along straight, leaning lines. The strongest lines are moved to where
their silhouettes are clearest and handed to the fit as seeds. Space carving (Kutulakos and Seitz 2000), with the known
ground for the scene's colours and sums for hard decisions.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit, prange
from scipy.ndimage import maximum_filter, uniform_filter

from ....reconstruction.area import Area
from ..fit.pattern_search import DISC_MOVES, disc_step, pattern_search
from ..images.axis_patches import StemAxis, crop_place, fetch
from ..images.background import Backdrop, Silhouette
from ..images.background_kernels import TONES, UNKNOWN, contrast_of, ground_ratio
from ..images.crops import GroundGrid, PhotoStack
from ..options import PhotoStemOptions
from ..tuned import (
    APART_M,
    AROUND_M,
    CELL_M,
    CONTRAST_A_M,
    FAINT,
    HEIGHTS,
    LEAN_STEP,
    MAX_LINES,
    RIM_M,
    STANDS_OUT,
    START_RADIUS_M,
)
from .edge_voting import Seed, best_lines, lean_grid

_FAST = {"nogil": True, "cache": True, "fastmath": True}


@njit(parallel=True, **_FAST)
def _ground_shown(photos, v, ground, backdrop, tones, shown):
    """Log likelihood ratio of "photo ``v`` shows the ground" at every cell of ``ground``; 0 where nothing is known."""
    lut, floor, ceiling, ratio = tones.lut, tones.floor, tones.ceiling, tones.ratio
    x0, y0, cell, z = ground
    mean, spread, layer = backdrop.mean, backdrop.spread, backdrop.layer[v]
    for i in prange(z.shape[0]):
        colour = np.empty(3, np.float32)
        for j in range(z.shape[1]):
            shown[i, j] = 0.0
            u, w, inside = crop_place(photos, v, x0 + j * cell, y0 + i * cell, z[i, j])
            if not inside:
                continue
            fetch(photos, v, u, w, lut, colour)
            value = ground_ratio(colour, mean, spread, layer, i, j, floor, ceiling, ratio)
            if value != UNKNOWN:
                shown[i, j] = value


@njit(parallel=True, **_FAST)
def _carve(shown, centre, ground, gx0, gy0, gcell, heights, total):
    """Add what a photo shows behind every point of the (layers, rows, columns) grid."""
    x0, y0, cell, z = ground
    rows, columns = shown.shape
    for i in prange(total.shape[1]):
        y = gy0 + i * gcell
        a0 = min(max(int((y - y0) / cell + 0.5), 0), rows - 1)
        for j in range(total.shape[2]):
            x = gx0 + j * gcell
            b0 = min(max(int((x - x0) / cell + 0.5), 0), columns - 1)
            for m in range(heights.size):
                top = z[a0, b0] + heights[m]
                if top >= centre[2]:
                    continue
                behind = 1.0 / (top - centre[2])
                a, b = a0, b0
                inside = True
                for _ in range(2):
                    share = (z[a, b] - top) * behind
                    a = int((y + share * (y - centre[1]) - y0) / cell + 0.5)
                    b = int((x + share * (x - centre[0]) - x0) / cell + 0.5)
                    inside = a >= 0 and b >= 0 and a < rows and b < columns
                    if not inside:
                        break
                if inside:
                    total[m, i, j] += shown[a, b]


@njit(**_FAST)
def _clearest(silhouette, p, r_low, r_high):
    """Pattern search for the clearest silhouette over place, lean and radius; p is changed in place."""
    return pattern_search(contrast_of, silhouette, disc_step, DISC_MOVES, p, r_low, r_high, (2.0, 1.0, 0.5), 12)


def carved_seeds(
    layers: np.ndarray,
    corner: tuple[float, float],
    ground: GroundGrid,
    silhouette_of: Callable[[StemAxis], Silhouette],
    area: Area,
    options: PhotoStemOptions,
    known: np.ndarray,
    chance: float,
) -> list[Seed]:
    """Seeds of stems whose silhouette stands out, clearest first; their score is in units of what chance reaches.

    layers: (layers, rows, columns) of evidence at ``HEIGHTS``, changed in place; corner: x and y of the first cell.
    silhouette_of: an axis -> its silhouette. known: (K, 10) rows of found stems, which are left out. chance: contrast
    that places without a stem reach.
    """
    clear_known(layers, known, *corner, options.bh_m)
    steepest_deg = options.max_lean_deg + np.degrees(LEAN_STEP)
    leans = lean_grid(steepest_deg, LEAN_STEP)
    lines = lines_through(layers, leans, corner, area, ground, options)
    bar = STANDS_OUT * float(np.median([score for score, _ in lines])) if lines else 0.0
    seeds = [clearest(silhouette_of(axis), axis, chance, options) for score, axis in lines[:MAX_LINES] if score > bar]
    seeds = [seed for seed in seeds if np.hypot(seed.lx, seed.ly) < np.tan(np.radians(steepest_deg))]
    seeds = [seed for seed in seeds if seed.score > max(FAINT, CONTRAST_A_M * seed.r)]
    return sorted(seeds, key=lambda seed: -seed.score)


def lines_through(
    layers: np.ndarray,
    leans: np.ndarray,
    corner: tuple[float, float],
    area: Area,
    ground: GroundGrid,
    options: PhotoStemOptions,
) -> list[tuple[float, StemAxis]]:
    """The clearest lines of their surroundings through (layers, rows, columns) of evidence at ``HEIGHTS``, in and
    near an area: sum and axis, best first. leans: (K, 2). corner: x and y of the first cell."""
    mask = np.ones(layers.shape[1:], bool)
    best, which, _ = best_lines(layers[..., None], mask, leans, HEIGHTS - options.bh_m, CELL_M)
    peaks = np.argwhere(best >= maximum_filter(best, int(APART_M / CELL_M)))
    places = np.array(corner) + CELL_M * peaks[:, ::-1]
    peaks, places = (each[area.contains(places, options.margin_m + 0.1)] for each in (peaks, places))
    score, feet = best[tuple(peaks.T)], ground.at(places[:, 0], places[:, 1])
    lean, still = leans[which[tuple(peaks.T)]], np.zeros(2)
    order = np.argsort(-score, kind="stable")
    return [(float(score[k]), StemAxis(places[k], lean[k], still, float(feet[k]), options.bh_m)) for k in order]


def searched(box: tuple[float, float, float, float]) -> tuple[float, float, int, int]:
    """x and y of the first cell of the grid that is searched about a box (x0, y0, x1, y1), and its rows and columns."""
    columns, rows = (int((box[k + 2] - box[k] + 2 * RIM_M) / CELL_M) + 1 for k in (0, 1))
    return box[0] - RIM_M, box[1] - RIM_M, rows, columns


def hidden_ground(
    stack: PhotoStack, grid: GroundGrid, backdrop: Backdrop, x0: float, y0: float, rows: int, columns: int
) -> np.ndarray:
    """(layers, rows, columns) how much less ground shows through points above the ground than through those around
    them, summed over the photos; rows from ``y0``, columns from ``x0``, every :data:`.tuned.CELL_M`."""
    ny, nx = backdrop.mean.shape[1:3]
    gx, gy = np.meshgrid(backdrop.x0 + backdrop.cell * np.arange(nx), backdrop.y0 + backdrop.cell * np.arange(ny))
    z = grid.at(gx.ravel(), gy.ravel()).reshape(ny, nx).astype(np.float32)
    cells = GroundGrid(backdrop.x0, backdrop.y0, backdrop.cell, z)
    shown, total = np.empty((ny, nx), np.float32), np.zeros((len(HEIGHTS), rows, columns), np.float32)
    for v in range(len(stack)):
        _ground_shown(stack.arrays, v, cells, backdrop, TONES, shown)
        _carve(uniform_filter(shown, 3), stack.centre[v], cells, x0, y0, CELL_M, HEIGHTS, total)
    size = int(AROUND_M / CELL_M)
    return np.array([uniform_filter(layer, size) - layer for layer in total])


def clear_known(layers: np.ndarray, known: np.ndarray, x0: float, y0: float, bh_m: float) -> None:
    """Set the surroundings of known stems, (K, 10), to nothing. In place."""
    x = x0 + CELL_M * np.arange(layers.shape[2])
    y = y0 + CELL_M * np.arange(layers.shape[1])
    for row in known:
        for layer, q in zip(layers, HEIGHTS - bh_m, strict=True):
            cx, cy = row[:2] + q * row[2:4] + q * q * row[4:6]
            layer[np.hypot(x[None] - cx, y[:, None] - cy) < row[8] + START_RADIUS_M] = 0.0


def clearest(silhouette: Silhouette, axis: StemAxis, chance: float, options: PhotoStemOptions) -> Seed:
    """The line moved to where its silhouette stands out most."""
    p = np.array([0.0, 0.0, 0.0, 0.0, START_RADIUS_M])
    contrast = _clearest(silhouette, p, 0.03, options.max_dbh_cm / 200)
    x, y, lx, ly = np.concatenate([axis.p, axis.s]) + p[:4]
    return Seed(float(x), float(y), float(lx), float(ly), float(p[4]), float(contrast / chance))
