"""Seeds of stems where the network (:mod:`.network.inference`) sees them: its log odds added up along leaning lines.

As in the search for edges (:mod:`.edge_voting`), decoys - each photo moved by a random offset - show how high chance
reaches.
"""

from __future__ import annotations

import numpy as np

from ....reconstruction.area import Area
from ..images.axis_patches import StemAxis
from ..images.crops import GroundGrid
from ..network.inference import NetworkMaps
from ..network.silhouettes import bark_layers, cut_bark
from ..options import PhotoStemOptions
from .edge_voting import Seed, lean_grid
from .space_carving import APART_M, CELL_M, HEIGHTS, LEAN_STEP, clearest, lines_through, searched

#: Decoys are moved this far, metres.
DECOY_M = 0.7, 3.0
#: Seeds at most.
MAX_SEEDS = 120
#: A line is looked at from this part of what chance reaches, and is a stem for certain above this.
LOOKED_AT, CERTAIN = 0.5, 1.1


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
    from scipy.ndimage import maximum_filter

    x0, y0, rows, columns = searched(box)
    x, y = np.meshgrid(x0 + CELL_M * np.arange(columns), y0 + CELL_M * np.arange(rows))
    z = ground.at(x.ravel(), y.ravel()).reshape(x.shape).astype(np.float32)
    cells = GroundGrid(x0, y0, CELL_M, z)
    leans = lean_grid(options.max_lean_deg, LEAN_STEP)
    count = len(maps.either.centre)
    angle, far = rng.uniform(0, 2 * np.pi, count), rng.uniform(*DECOY_M, count)
    moved = far[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    decoys, _ = lines_through(bark_layers(maps.either, moved, cells, HEIGHTS), leans, options.bh_m)
    best, which = lines_through(bark_layers(maps.either, np.zeros((count, 2)), cells, HEIGHTS), leans, options.bh_m)
    chance = max(float(decoys.max()), 1.0)
    peaks = np.argwhere((best >= maximum_filter(best, int(APART_M / CELL_M))) & (best > LOOKED_AT * chance))
    places = np.column_stack([x0 + CELL_M * peaks[:, 1], y0 + CELL_M * peaks[:, 0]])
    peaks, places = (each[area.contains(places, options.margin_m + 0.1)] for each in (peaks, places))
    score = best[tuple(peaks.T)] / chance
    seeds = []
    for k in np.argsort(-score, kind="stable")[:MAX_SEEDS]:
        place, lean = places[k], leans[which[tuple(peaks[k])]]
        foot = float(ground.at(place[:1], place[1:])[0])
        axis = StemAxis(place, lean, np.zeros(2), foot, options.bh_m)
        found = clearest(cut_bark(maps.either, axis), axis, 1.0)
        seeds.append(Seed(found.x, found.y, found.lx, found.ly, found.r, float(score[k]), bool(score[k] > CERTAIN)))
    return seeds
