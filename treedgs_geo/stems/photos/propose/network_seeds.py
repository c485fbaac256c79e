"""Seeds of stems where the network (:mod:`.network.inference`) sees them: its log odds added up along leaning lines.

As in the search for edges (:mod:`.edge_voting`), decoys - each photo moved by a random offset - show how high chance
reaches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.ndimage import maximum_filter

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
from .edge_voting import Seed, best_lines, lean_grid

_FAST = {"nogil": True, "cache": True, "fastmath": True}


@njit(**_FAST)
def _clearest(silhouette, p, r_low, r_high):
    """Pattern search for the clearest silhouette over place, lean and radius; p is changed in place."""
    return pattern_search(contrast_of, silhouette, disc_step, DISC_MOVES, p, r_low, r_high, (2.0, 1.0, 0.5), 12)


@dataclass(frozen=True)
class NetworkLines:
    """The best line through each cell of a piece of ground, by what the network sees."""

    maps: NetworkMaps
    area: Area
    ground: GroundGrid
    options: PhotoStemOptions
    #: Local x and y of the first cell.
    corner: tuple[float, float]
    #: (rows, columns) log likelihood ratio of a stem, summed over photos and ``HEIGHTS``, in units of what chance
    #: reaches; (rows, columns, 2) lean, m/m.
    score: np.ndarray
    lean: np.ndarray

    def seeds(self) -> list[Seed]:
        """Stems, with ivy or without, clearest first, each moved to where its silhouette stands out most."""
        return [self._moved(score, axis) for score, axis in self._lines(APART_M)]

    def beside(self) -> list[Seed]:
        """The same, half as far apart. Not moved: the silhouettes of two may be one."""
        return [_seed(np.array([*axis.p, *axis.s, START_RADIUS_M]), score) for score, axis in self._lines(APART_M / 2)]

    def _lines(self, apart_m: float) -> list[tuple[float, StemAxis]]:
        """Score and axis of the lines in and near the area that are the clearest within half of a distance, best
        first."""
        window = 2 * int(apart_m / CELL_M / 2) + 1
        peaks = np.argwhere((self.score >= maximum_filter(self.score, window)) & (self.score > LINE_SCORE))
        peaks = peaks[np.argsort(-self.score[tuple(peaks.T)], kind="stable")]
        places = np.array(self.corner) + CELL_M * peaks[:, ::-1]
        near = np.flatnonzero(self.area.contains(places, self.options.margin_m + 0.1))[:MAX_SEEDS]
        score, lean = self.score[tuple(peaks.T)], self.lean[tuple(peaks.T)]
        feet, still, bh_m = self.ground.at(places[:, 0], places[:, 1]), np.zeros(2), self.options.bh_m
        return [(float(score[k]), StemAxis(places[k], lean[k], still, float(feet[k]), bh_m)) for k in near]

    def _moved(self, score: float, axis: StemAxis) -> Seed:
        p = np.array([0.0, 0.0, 0.0, 0.0, START_RADIUS_M])
        _clearest(cut_bark(self.maps.either, axis, BREAST.silhouette), p, 0.03, self.options.max_dbh_cm / 200)
        return _seed(np.array([*axis.p, *axis.s, 0.0]) + p, score, score > CERTAIN_SCORE)


def _seed(vector: np.ndarray, score: float, sure: bool = False) -> Seed:
    x, y, lx, ly, r = vector.tolist()
    return Seed(x, y, lx, ly, r, score, sure)


def network_lines(
    maps: NetworkMaps,
    ground: GroundGrid,
    area: Area,
    box: tuple[float, float, float, float],
    options: PhotoStemOptions,
    rng: np.random.Generator,
) -> NetworkLines:
    """Lines through what the network sees. box: x0, y0, x1, y1 of the ground searched. rng: of the decoys."""
    x0, y0, rows, columns = _searched(box)
    x, y = np.meshgrid(x0 + CELL_M * np.arange(columns), y0 + CELL_M * np.arange(rows))
    z = ground.at(x.ravel(), y.ravel()).reshape(x.shape).astype(np.float32)
    cells, count = GroundGrid(x0, y0, CELL_M, z), len(maps.stem.centre)
    angle, far = rng.uniform(0, 2 * np.pi, count), rng.uniform(*DECOY_M, count)
    leans = lean_grid(options.max_lean_deg, LEAN_STEP)
    best, which = [], []
    for moved in (far[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]), np.zeros((count, 2))):
        layers = stem_layers(maps.stem, moved, cells, HEIGHTS)[..., None]
        found, lean, _ = best_lines(layers, np.ones(z.shape, bool), leans, HEIGHTS - options.bh_m, CELL_M)
        best.append(found)
        which.append(lean)
    score = best[1] / max(float(best[0].max()), 1.0)
    return NetworkLines(maps, area, ground, options, (x0, y0), score, leans[which[1]])


def _searched(box: tuple[float, float, float, float]) -> tuple[float, float, int, int]:
    """x and y of the first cell of the grid that is searched about a box (x0, y0, x1, y1), and its rows and columns."""
    columns, rows = (int((box[k + 2] - box[k] + 2 * RIM_M) / CELL_M) + 1 for k in (0, 1))
    return box[0] - RIM_M, box[1] - RIM_M, rows, columns
