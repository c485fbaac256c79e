"""Seeds of stems where the network (:mod:`.network.inference`) sees them: its log odds added up along leaning lines.

As in the search for edges (:mod:`.edge_voting`), decoys - each photo moved by a random offset - show how high chance
reaches.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numba import njit
from scipy.ndimage import maximum_filter

from ....reconstruction.area import Area
from ..fit.null_model import BREAST
from ..fit.pattern_search import DISC_MOVES, disc_step, pattern_search
from ..images.axis_patches import BH_M, P_X, P_Y, RADIUS, SLOPE, StemAxis, axis_at
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
    SECOND_M,
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
    """What the network sees along lines."""

    maps: NetworkMaps
    area: Area
    ground: GroundGrid
    options: PhotoStemOptions
    #: (layers, rows, columns) log likelihood ratio of a stem, summed over the photos, at ``HEIGHTS``; local x and y of
    #: the first cell.
    layers: np.ndarray
    corner: tuple[float, float]
    #: Of a line of decoys.
    chance: float

    def seeds(self) -> list[Seed]:
        """Stems, with ivy or without, clearest first; their score is in units of what chance reaches."""
        return [
            _seed_of(cut_bark(self.maps.either, axis, BREAST.silhouette), axis, score, self.options)
            for score, axis in self._lines(self.layers)
        ]

    def beside(self, known: np.ndarray) -> list[Seed]:
        """Stems beside (K, 10) known ones, by what is seen outside of these."""
        layers = self.layers.copy()
        x, y = (corner + CELL_M * np.arange(n) for corner, n in zip(self.corner, layers.shape[:0:-1], strict=True))
        for row, (layer, height) in product(known, zip(layers, HEIGHTS, strict=True)):
            above = height - row[BH_M]
            at_x, at_y = axis_at(row, above)
            own = np.hypot(x - at_x, y[:, None] - at_y) < row[RADIUS] + row[SLOPE] * above + CELL_M / 2
            layer[own] = np.minimum(layer[own], 0)
        return [
            _seed(np.array([*axis.p, *axis.s, START_RADIUS_M]), score)
            for score, axis in self._lines(layers)
            if (np.hypot(known[:, P_X] - axis.p[0], known[:, P_Y] - axis.p[1]) < SECOND_M).any()
        ]

    def _lines(self, layers: np.ndarray) -> list[tuple[float, StemAxis]]:
        """The clearest lines of their surroundings through layers, in and near the area: score and axis, best first."""
        leans = lean_grid(self.options.max_lean_deg, LEAN_STEP)
        mask, bh_m = np.ones(layers.shape[1:], bool), self.options.bh_m
        best, which, _ = best_lines(layers[..., None], mask, leans, HEIGHTS - bh_m, CELL_M)
        peaks = np.argwhere((best >= maximum_filter(best, int(APART_M / CELL_M))) & (best > LINE_SCORE * self.chance))
        peaks = peaks[np.argsort(-best[tuple(peaks.T)], kind="stable")]
        places = np.array(self.corner) + CELL_M * peaks[:, ::-1]
        near = np.flatnonzero(self.area.contains(places, self.options.margin_m + 0.1))[:MAX_SEEDS]
        score, feet = best[tuple(peaks.T)] / self.chance, self.ground.at(places[:, 0], places[:, 1])
        lean, still = leans[which[tuple(peaks.T)]], np.zeros(2)
        return [(float(score[k]), StemAxis(places[k], lean[k], still, float(feet[k]), bh_m)) for k in near]


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
    moved = far[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    decoys = stem_layers(maps.stem, moved, cells, HEIGHTS)[..., None]
    leans = lean_grid(options.max_lean_deg, LEAN_STEP)
    best, _, _ = best_lines(decoys, np.ones(z.shape, bool), leans, HEIGHTS - options.bh_m, CELL_M)
    layers = stem_layers(maps.stem, np.zeros((count, 2)), cells, HEIGHTS)
    return NetworkLines(maps, area, ground, options, layers, (x0, y0), max(float(best.max()), 1.0))


def _searched(box: tuple[float, float, float, float]) -> tuple[float, float, int, int]:
    """x and y of the first cell of the grid that is searched about a box (x0, y0, x1, y1), and its rows and columns."""
    columns, rows = (int((box[k + 2] - box[k] + 2 * RIM_M) / CELL_M) + 1 for k in (0, 1))
    return box[0] - RIM_M, box[1] - RIM_M, rows, columns


def _seed_of(silhouette: Silhouette, axis: StemAxis, score: float, options: PhotoStemOptions) -> Seed:
    """The line moved to where its silhouette stands out most."""
    p = np.array([0.0, 0.0, 0.0, 0.0, START_RADIUS_M])
    _clearest(silhouette, p, 0.03, options.max_dbh_cm / 200)
    return _seed(np.array([*axis.p, *axis.s, 0.0]) + p, score, score > CERTAIN_SCORE)


def _seed(vector: np.ndarray, score: float, sure: bool = False) -> Seed:
    x, y, lx, ly, r = vector.tolist()
    return Seed(x, y, lx, ly, r, score, sure)
