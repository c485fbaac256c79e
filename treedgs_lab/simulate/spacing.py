"""Where the trees of the synthetic stand grow: in jittered rows, or naturally."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

#: One plot, at the origin.
ORIGIN = np.zeros((1, 2))


def centre_distance(xy: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """(N, 2), (n, 2) -> (N,) metres to the nearest of the plots' centres."""
    return np.min([np.hypot(*(xy - centre).T) for centre in centres], axis=0)


def rows(rng: np.random.Generator, stems_per_ha: float, stand_radius_m: float) -> np.ndarray:
    """(N, 2) jittered planting rows of any heading, some trees missing."""
    spacing = 3.4 * np.sqrt(700 / stems_per_ha)
    along = 1e4 / stems_per_ha / spacing * 0.94
    half = int(stand_radius_m / min(spacing, along)) + 3
    azimuth, shift = rng.uniform(0, np.pi), rng.uniform(-0.5, 0.5, 2)
    steps = np.arange(-half, half + 1)
    u, v = np.meshgrid((steps + shift[0]) * spacing, (steps + shift[1]) * along)
    q = np.column_stack([u.ravel(), v.ravel()]) + rng.normal(0, 0.32, (u.size, 2)) * [1.0, 1.4]
    q = q[rng.random(len(q)) < 0.94]
    xy = q @ np.array([[np.cos(azimuth), np.sin(azimuth)], [-np.sin(azimuth), np.cos(azimuth)]])
    xy = xy[np.hypot(*xy.T) < stand_radius_m]
    pairs = cKDTree(xy).query_pairs(min(1.5, 0.55 * along), output_type="ndarray")
    return np.delete(xy, np.unique(pairs[:, 1]) if len(pairs) else [], axis=0)


def plant(
    rng: np.random.Generator,
    stems_per_ha: float,
    radius_m: float,
    stand_radius_m: float,
    centres: np.ndarray = ORIGIN,
    draw: Callable[[np.random.Generator, float, float], np.ndarray] = rows,
) -> np.ndarray:
    """(N, 2) stem positions as ``draw`` has them; the count inside the plots is that of the density, +- 15 % or one."""
    expected = len(centres) * stems_per_ha / 1e4 * np.pi * radius_m**2
    best = None
    for _ in range(60):
        xy = draw(rng, stems_per_ha, stand_radius_m)
        away = centre_distance(xy, centres)
        miss = abs((away < radius_m - 0.05).sum() - expected)
        # Which of the trees on the rim of many plots are inside, the truth knows.
        edge = np.abs(away - radius_m).min() < 0.05 and len(centres) == 1
        if not edge and (best is None or miss < best[0]):
            best = miss, xy
        if best is not None and best[0] <= max(1.0, 0.15 * expected):
            break
    assert best is not None
    return best[1]
