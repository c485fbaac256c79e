"""Where edges of many photos agree on a stem: seeds, and the score that chance hardly reaches."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....reconstruction.area import Area
from ..images.crops import GroundGrid, PhotoStack
from ..images.vertical_rectification import PlumbGrid, make_map
from ..options import PhotoStemOptions
from .edge_voting import Detector, Seed, lean_grid

#: Seeds are this far apart, m; those beside a found stem, which may be a second one, this far.
APART_M, BESIDE_M = 0.4, 0.2
#: A lean costs seeds this much (log likelihood units per (m/m)^2).
LEAN_COST = 60.0
#: The search for edges takes leans up to this, degrees; the rest is for :mod:`.space_carving`.
UPRIGHT_MAX_DEG = 10.0
#: The threshold lies this far above the best decoy, and never below the minimum (log likelihood units).
ABOVE_CHANCE, MIN_THRESHOLD = 3.0, 8.0
#: Cells around the area, m: leaning stems carry their upper layers there.
_EDGE_M = 0.5


class EdgeSeeds(NamedTuple):
    """What the edges propose, clearest first."""

    #: In and near the area, :data:`APART_M` apart.
    seeds: list[Seed]
    #: The same, :data:`BESIDE_M` apart, wherever they are.
    beside: list[Seed]
    #: Score (log likelihood units) that chance hardly reaches.
    threshold: float


def edge_seeds(
    stack: PhotoStack,
    grid: GroundGrid,
    plumbs: list[PlumbGrid],
    area: Area,
    box: tuple[float, float, float, float],
    options: PhotoStemOptions,
    rng: np.random.Generator,
) -> EdgeSeeds:
    """Seeds of a piece of ground. plumbs: one a photo. box: x0, y0, x1, y1 of the piece, m, local frame."""
    detector = _detector(stack, grid, plumbs, area, box, options)
    total, chance = detector.accumulate(rng)
    leans = lean_grid(min(options.max_lean_deg, UPRIGHT_MAX_DEG))
    lines = detector.lines(total, leans, LEAN_COST)
    seeds, beside = (detector.peaks(lines, leans, apart) for apart in (APART_M, BESIDE_M))
    decoys = detector.seeds(chance, leans, APART_M, LEAN_COST)
    threshold = max(MIN_THRESHOLD, decoys[0].score + ABOVE_CHANCE if decoys else 0.0)
    near = area.contains(np.array([(seed.x, seed.y) for seed in seeds]).reshape(-1, 2), options.margin_m + 0.1)
    return EdgeSeeds([seed for seed, keep in zip(seeds, near, strict=True) if keep], beside, threshold)


def _detector(
    stack: PhotoStack, grid: GroundGrid, plumbs: list[PlumbGrid], area: Area, box: tuple, options: PhotoStemOptions
) -> Detector:
    maps = (make_map(stack, view, grid, plumb) for view, plumb in enumerate(plumbs))
    x0, y0 = box[0] - _EDGE_M, box[1] - _EDGE_M
    columns = int((box[2] - box[0] + 2 * _EDGE_M) / options.cell_m) + 1
    rows = int((box[3] - box[1] + 2 * _EDGE_M) / options.cell_m) + 1
    gx, gy = np.meshgrid(x0 + options.cell_m * np.arange(columns), y0 + options.cell_m * np.arange(rows))
    mask = area.contains(np.column_stack([gx.ravel(), gy.ravel()]), options.margin_m + _EDGE_M).reshape(gx.shape)
    radii = np.arange(0.04, options.max_dbh_cm / 200 + 0.01, 0.025)
    return Detector(maps, radii, grid, x0, y0, options.cell_m, mask, options.bh_m)
