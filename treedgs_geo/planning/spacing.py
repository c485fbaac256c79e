"""Where naturally grown trees stand: at random, none too near to another, denser in some places than in others."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import cKDTree

#: Naturally grown trees stand no nearer to each other than this, m, or than this share of their mean distance.
MIN_DISTANCE_M, MIN_SHARE = 1.2, 0.45
#: Spread of the logarithm of natural density from place to place, and the size of those places, m.
CLUSTER_SPREAD, CLUSTER_M = 0.5, 6.0


def least_distance(stems_per_ha: float) -> float:
    """The least distance between naturally grown trees, m."""
    return min(MIN_DISTANCE_M, MIN_SHARE * 100 / np.sqrt(stems_per_ha))


def natural(rng: np.random.Generator, stems_per_ha: float, stand_radius_m: float) -> np.ndarray:
    """(N, 2) trees at random, none nearer to another than :func:`least_distance`, denser in some places than others:
    trees that are drawn one after the other are kept where there is room."""
    wanted = round(stems_per_ha / 1e4 * np.pi * stand_radius_m**2)
    cells = int(2 * stand_radius_m) + 2
    dense = gaussian_filter(rng.standard_normal((cells, cells)), CLUSTER_M / 2, mode="wrap")
    dense = np.exp(CLUSTER_SPREAD * dense / dense.std())
    tries = rng.uniform(-stand_radius_m, stand_radius_m, (20 * wanted + 200, 2))
    odds = map_coordinates(dense, (tries + stand_radius_m).T, order=1, mode="nearest") / dense.max()
    tries = tries[(rng.random(len(tries)) < odds) & (np.hypot(*tries.T) < stand_radius_m)]
    least = least_distance(stems_per_ha)
    # Of two that are too near the one drawn later goes, unless what it was too near to has gone before.
    near = cKDTree(tries).query_ball_point(tries, least)
    kept = np.zeros(len(tries), bool)
    count = 0
    for k, others in enumerate(near):
        if count == wanted:
            break
        kept[k] = not kept[others].any()
        count += int(kept[k])
    return tries[kept]
