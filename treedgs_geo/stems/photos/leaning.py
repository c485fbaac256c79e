"""Strongly leaning stems: a second look at what the upright ones leave, along slanted edges.

The first search takes edges that are vertical within the window, which a stem leaning 20 degrees shows only to photos
that look along its lean. Here an edge may run along three slants in each photo, lines of layers lean from 8 degrees
on, and the edges of the stems that are known already are taken away before.
"""

from __future__ import annotations

import numpy as np

from ..area import Area
from .detect import Detector, Seed, lean_grid
from .options import PhotoStemOptions
from .plumb import hide_in_map, make_map
from .stack import GroundGrid, PhotoStack

#: Stems up to this lean are left to the first search, degrees.
UPRIGHT_DEG = 8.0
#: Slants of edges across the view, m/m: each holds within about 0.13 of it over the window.
SLANTS = (-0.26, 0.0, 0.26)
#: Leans are this far apart (m/m); the fit searches within 0.05 of a seed's. Radii: first, last, step, metres.
LEAN_STEP, RADII_M = 0.05, (0.05, 0.30, 0.035)
#: Layers that are added, from the ground up (0.5 to 3 m): further up, a lean half a step off has left the stem.
LAYERS = 5
#: Evidence a lean costs, log likelihood units per (m/m)^2.
PENALTY = 25.0
#: The axis leaves the plot's outline by this much on its way up, metres.
EDGE_M = 1.8
#: Chance reaches further here (edges may slant, lines may lean): margin over the best decoy, and most seeds fitted.
GATE_MARGIN, MOST_SEEDS = 5.0, 12


def leaning_seeds(
    stack: PhotoStack,
    grid: GroundGrid,
    area: Area,
    tile: Area,
    box: tuple[float, float, float, float],
    options: PhotoStemOptions,
    known: np.ndarray,
    rng: np.random.Generator,
) -> tuple[list[Seed], float]:
    """Seeds of leaning stems, best first, and the score that chance reaches. known: (K, 10) rows of found stems."""
    outline = np.vstack([tile.outline(options.margin_m + 1.0), tile.centres])
    z = grid.at(outline[:, 0], outline[:, 1])
    points = np.vstack([np.column_stack([outline, z]), np.column_stack([outline, z + 5.2])])
    maps = []
    for view in range(len(stack)):
        plumb = make_map(stack, view, grid, points, slants=SLANTS)
        hide_in_map(plumb, known)
        maps.append(plumb)
    cell = options.cell_m
    x0, y0 = box[0] - EDGE_M, box[1] - EDGE_M
    columns, rows = (int((box[k + 2] - box[k] + 2 * EDGE_M) / cell) + 1 for k in (0, 1))
    gx, gy = np.meshgrid(x0 + cell * np.arange(columns), y0 + cell * np.arange(rows))
    mask = area.contains(np.column_stack([gx.ravel(), gy.ravel()]), options.margin_m + EDGE_M).reshape(gx.shape)
    radii = np.arange(RADII_M[0], min(RADII_M[1], options.dbh_max_cm / 200) + 0.01, RADII_M[2])
    detector = Detector(maps, [], radii, grid, x0, y0, cell, mask, options.bh_m)
    total, chance = detector.accumulate(rng)
    leans = lean_grid(options.max_lean_deg, LEAN_STEP)
    leans = leans[np.hypot(*leans.T) > np.tan(np.radians(UPRIGHT_DEG))]
    total, chance = (np.ascontiguousarray(each[:, :, :LAYERS]) for each in (total, chance))
    seeds = detector.seeds(total, leans, penalty=PENALTY)
    decoys = detector.seeds(chance, leans, penalty=PENALTY, most=3)
    gate = max(8.0, decoys[0].score + GATE_MARGIN if decoys else 0.0)
    places = np.array([(seed.x, seed.y) for seed in seeds]).reshape(-1, 2)
    near = area.contains(places, options.margin_m + 0.1)
    return [seed for seed, keep in zip(seeds, near, strict=True) if keep and seed.score > gate][:MOST_SEEDS], gate
