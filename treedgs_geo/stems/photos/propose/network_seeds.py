"""Seeds of stems where the network (:mod:`.network.inference`) sees them: its log odds added up along leaning lines.

As in the search for edges (:mod:`.edge_voting`), decoys - each photo moved by a random offset - show how high chance
reaches.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.ndimage import maximum_filter

from ....reconstruction.area import Area
from ..fit.null_model import BREAST
from ..fit.pattern_search import DISC_MOVES, disc_step, pattern_search
from ..images.axis_patches import StemAxis
from ..images.background import Silhouette
from ..images.background_kernels import contrast_of
from ..images.crops import GroundGrid
from ..network.inference import NetworkMaps
from ..network.silhouettes import cut_bark, stem_layers
from ..options import PhotoStemOptions
from ..tuned import (
    APART_M,
    CELL_M,
    CERTAIN_SCORE,
    DECOY_M,
    HEIGHTS,
    LEAN_STEP,
    LINE_SCORE,
    MAX_SEEDS,
    RIM_M,
    START_RADIUS_M,
)
from .edge_voting import Seed, best_lines, lean_grid

_FAST = {"nogil": True, "cache": True, "fastmath": True}


@njit(**_FAST)
def _clearest(silhouette, p, r_low, r_high):
    """Pattern search for the clearest silhouette over place, lean and radius; p is changed in place."""
    return pattern_search(contrast_of, silhouette, disc_step, DISC_MOVES, p, r_low, r_high, (2.0, 1.0, 0.5), 12)


def network_seeds(
    maps: NetworkMaps,
    ground: GroundGrid,
    area: Area,
    box: tuple[float, float, float, float],
    options: PhotoStemOptions,
    rng: np.random.Generator,
) -> list[Seed]:
    """Stems that the network sees, with ivy or without, clearest first; their score is in units of what chance reaches.

    box: x0, y0, x1, y1 of the ground searched. rng: of the decoys.
    """
    x0, y0, rows, columns = _searched(box)
    x, y = np.meshgrid(x0 + CELL_M * np.arange(columns), y0 + CELL_M * np.arange(rows))
    z = ground.at(x.ravel(), y.ravel()).reshape(x.shape).astype(np.float32)
    cells = GroundGrid(x0, y0, CELL_M, z)
    leans = lean_grid(options.max_lean_deg, LEAN_STEP)
    count = len(maps.stem.centre)
    angle, far = rng.uniform(0, 2 * np.pi, count), rng.uniform(*DECOY_M, count)
    moved = far[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    decoys = stem_layers(maps.stem, moved, cells, HEIGHTS)[..., None]
    best, _, _ = best_lines(decoys, np.ones(z.shape, bool), leans, HEIGHTS - options.bh_m, CELL_M)
    chance = max(float(best.max()), 1.0)
    layers = stem_layers(maps.stem, np.zeros((count, 2)), cells, HEIGHTS)
    lines = _lines_through(layers, leans, (x0, y0), area, ground, options)
    seeds = []
    for line, axis in lines[:MAX_SEEDS]:
        score = line / chance
        if score <= LINE_SCORE:
            break
        seeds.append(_seed_of(cut_bark(maps.either, axis, BREAST.silhouette), axis, score, options))
    return seeds


def _lines_through(
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


def _searched(box: tuple[float, float, float, float]) -> tuple[float, float, int, int]:
    """x and y of the first cell of the grid that is searched about a box (x0, y0, x1, y1), and its rows and columns."""
    columns, rows = (int((box[k + 2] - box[k] + 2 * RIM_M) / CELL_M) + 1 for k in (0, 1))
    return box[0] - RIM_M, box[1] - RIM_M, rows, columns


def _seed_of(silhouette: Silhouette, axis: StemAxis, score: float, options: PhotoStemOptions) -> Seed:
    """The line moved to where its silhouette stands out most."""
    p = np.array([0.0, 0.0, 0.0, 0.0, START_RADIUS_M])
    _clearest(silhouette, p, 0.03, options.max_dbh_cm / 200)
    x, y, lx, ly = np.concatenate([axis.p, axis.s]) + p[:4]
    return Seed(float(x), float(y), float(lx), float(ly), float(p[4]), score, score > CERTAIN_SCORE)
