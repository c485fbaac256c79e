"""Seeds of stems where the network (:mod:`.network.inference`) sees them: its log odds added up along leaning lines.

As in the search for edges (:mod:`.edge_voting`), decoys - each photo moved by a random offset - show how high chance
reaches.
"""

from __future__ import annotations

import numpy as np

from ....reconstruction.area import Area
from ..fit.null_model import BREAST
from ..images.crops import GroundGrid
from ..network.inference import NetworkMaps
from ..network.silhouettes import cut_bark, stem_layers
from ..options import PhotoStemOptions
from ..tuned import CELL_M, CERTAIN_SCORE, DECOY_M, HEIGHTS, LEAN_STEP, LINE_SCORE, MAX_SEEDS
from .edge_voting import Seed, best_lines, lean_grid
from .space_carving import clearest, lines_through, searched


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
    x0, y0, rows, columns = searched(box)
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
    lines = lines_through(layers, leans, (x0, y0), area, ground, options)
    seeds = []
    for line, axis in lines[:MAX_SEEDS]:
        score = line / chance
        if score <= LINE_SCORE:
            break
        found = clearest(cut_bark(maps.either, axis, BREAST.silhouette), axis, 1.0, options)
        seeds.append(Seed(found.x, found.y, found.lx, found.ly, found.r, score, score > CERTAIN_SCORE))
    return seeds
