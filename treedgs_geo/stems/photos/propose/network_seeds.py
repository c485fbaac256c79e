"""Seeds of stems where the network (:mod:`.network.inference`) sees them: its log odds added up along leaning lines.

As in the search for edges (:mod:`.edge_voting`), decoys - each photo moved by a random offset - show how high chance
reaches.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.ndimage import maximum_filter

from ....core.machine import FAST
from ....reconstruction.area import Area
from ..fit.null_model import BREAST
from ..fit.pattern_search import DISC_MOVES, disc_step, pattern_search
from ..images.axis_patches import StemAxis
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
from .edge_voting import Proposals, Seed, best_lines, lean_grid


@njit(**FAST)
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
) -> Proposals:
    """Stems that the network sees, with ivy or without, each moved to where its silhouette stands out most; their score
    is in units of what chance reaches. Second ones are not moved: the silhouettes of two may be one.

    box: x0, y0, x1, y1 of the ground searched. rng: of the decoys.
    """
    x0, y0, rows, columns = _searched(box)
    x, y = np.meshgrid(x0 + CELL_M * np.arange(columns), y0 + CELL_M * np.arange(rows))
    z = ground.at(x.ravel(), y.ravel()).reshape(x.shape).astype(np.float32)
    cells, count = GroundGrid(x0, y0, CELL_M, z), len(maps.stem.centre)
    angle, far = rng.uniform(0, 2 * np.pi, count), rng.uniform(*DECOY_M, count)
    moved = far[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    leans, everywhere = lean_grid(options.max_lean_deg, LEAN_STEP), np.ones(z.shape, bool)
    (decoys, _), (best, lean) = (
        best_lines(
            stem_layers(maps.stem, shifts, cells, HEIGHTS)[..., None], everywhere, leans, HEIGHTS - options.bh_m, CELL_M
        )[:2]
        for shifts in (moved, np.zeros((count, 2)))
    )
    score = best / max(float(decoys.max()), 1.0)

    def lines(apart_m: float) -> list[tuple[float, StemAxis]]:
        """Score and axis of those in and near the area that are the clearest within half a distance, best first."""
        peaks = np.argwhere((score >= maximum_filter(score, 2 * int(apart_m / CELL_M / 2) + 1)) & (score > LINE_SCORE))
        peaks = peaks[np.argsort(-score[tuple(peaks.T)], kind="stable")]
        places = np.array([x0, y0]) + CELL_M * peaks[:, ::-1]
        near = area.contains(places, options.margin_m + 0.1)
        peaks, places = peaks[near][:MAX_SEEDS], places[near][:MAX_SEEDS]
        feet = ground.at(places[:, 0], places[:, 1])
        return [
            (float(score[i, j]), StemAxis(place, leans[lean[i, j]], np.zeros(2), float(foot), options.bh_m))
            for (i, j), place, foot in zip(peaks, places, feet, strict=True)
        ]

    start = np.array([0.0, 0.0, 0.0, 0.0, START_RADIUS_M])
    seeds = []
    for value, axis in lines(APART_M):
        p = start.copy()
        _clearest(cut_bark(maps.either, axis, BREAST.silhouette), p, 0.03, options.max_dbh_cm / 200)
        seeds.append(_seed(axis, p, value, value > CERTAIN_SCORE))
    return Proposals(seeds, [_seed(axis, start, value) for value, axis in lines(APART_M / 2)], LINE_SCORE)


def _seed(axis: StemAxis, p: np.ndarray, score: float, sure: bool = False) -> Seed:
    """A seed at (5,) x, y, lx, ly, r off an axis."""
    x, y, lx, ly, r = (np.array([*axis.p, *axis.s, 0.0]) + p).tolist()
    return Seed(x, y, lx, ly, r, score, sure)


def _searched(box: tuple[float, float, float, float]) -> tuple[float, float, int, int]:
    """x and y of the first cell of the grid that is searched about a box (x0, y0, x1, y1), and its rows and columns."""
    columns, rows = (int((box[k + 2] - box[k] + 2 * RIM_M) / CELL_M) + 1 for k in (0, 1))
    return box[0] - RIM_M, box[1] - RIM_M, rows, columns
