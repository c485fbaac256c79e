"""The cloth simulation filter: a cloth that falls on the cloud turned upside down, and what lies near it.

Zhang, W. et al. (2016): An easy-to-use airborne LiDAR data filtering method based on cloth simulation. Remote Sensing
8(6), 501. The constants that the paper does not name (damping, gravity's step, when the cloth rests) are those of the
authors' program, so that settings mean the same; what their program lets down over slopes in the end,
:mod:`treedgs_geo.terrain.ground` follows up from the ground beside it. Compiled here because their package has no
wheels for newer Pythons; it runs in one fixed order, so that the same points give the same ground on any number of
cores.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .options import ClothSimulation

#: Memory of a particle of the cloth: its height now and before, the terrain's under it and where that was taken from.
PARTICLE_BYTES = 64
#: Cells of cloth beyond the points on every side.
_RIM = 2
_START_M = 0.05
_DAMPING = 0.01
_STEP_S, _GRAVITY = 0.65, 0.2
#: The cloth rests when no particle moves farther in a step.
_REST_M = 0.005


def particles_over(points: np.ndarray, method: ClothSimulation) -> tuple[int, int]:
    """Rows (y) and columns (x) of the cloth over (N, 3) points."""
    cols, rows = np.floor(np.ptp(points[:, :2], axis=0) / method.cloth_m).astype(int) + 2 * _RIM
    return int(rows), int(cols)


def near_cloth(points: np.ndarray, method: ClothSimulation) -> np.ndarray:
    """(N,) bool: which of (N, 3) points lie within ``method.threshold_m`` of the cloth at rest."""
    from scipy.ndimage import distance_transform_edt, map_coordinates

    rows, cols = particles_over(points, method)
    corner = points[:, :2].min(axis=0) - _RIM * method.cloth_m
    place = (points[:, :2] - corner) / method.cloth_m
    terrain = _under(place, -points[:, 2], rows, cols)
    nearest = distance_transform_edt(np.isnan(terrain), return_distances=False, return_indices=True)
    terrain = terrain[tuple(nearest)]
    share = 1 - 0.7**method.rigidness, 0.5 * (1 - 0.4**method.rigidness)
    cloth = _fall(terrain, float(terrain.max()) + _START_M, method.rounds, share[0], share[1])
    return np.abs(map_coordinates(cloth, place.T[::-1], order=1) + points[:, 2]) < method.threshold_m


@njit(cache=True)
def _under(place, z, rows, cols):  # pragma: no cover - compiled
    """(rows, cols) height of the point nearest to each particle, NaN where none is in its cell."""
    height = np.full((rows, cols), np.nan)
    away = np.full((rows, cols), np.inf)
    for m in range(len(z)):
        i, j = min(int(place[m, 1] + 0.5), rows - 1), min(int(place[m, 0] + 0.5), cols - 1)
        distance = (place[m, 0] - j) ** 2 + (place[m, 1] - i) ** 2
        if distance < away[i, j]:
            away[i, j], height[i, j] = distance, z[m]
    return height


@njit(cache=True)
def _fall(terrain, start, rounds, single, double):  # pragma: no cover - compiled
    """Heights of the cloth at rest.

    single, double: share of a difference in height between two particles that is made up in a step, by the free one of
    the two, or by each of two free ones; the rigidness in closed form.
    """
    rows, cols = terrain.shape
    cloth, before = np.full((rows, cols), start), np.full((rows, cols), start)
    free = np.ones((rows, cols), np.bool_)
    fall = _GRAVITY * _STEP_S**4
    for _ in range(rounds):
        for i in range(rows):
            for j in range(cols):
                if free[i, j]:
                    now = cloth[i, j]
                    cloth[i, j] = now + (now - before[i, j]) * (1 - _DAMPING) - fall
                    before[i, j] = now
        # Every pair of neighbours is drawn together twice, once from each of its ends.
        for i in range(rows):
            for j in range(cols):
                for reach in (1, 2):
                    for di in range(-reach, reach + 1, reach):
                        for dj in range(-reach, reach + 1, reach):
                            p, q = i + di, j + dj
                            if (di == 0 and dj == 0) or p < 0 or q < 0 or p >= rows or q >= cols:
                                continue
                            gap = cloth[p, q] - cloth[i, j]
                            if free[i, j] and free[p, q]:
                                cloth[i, j] += double * gap
                                cloth[p, q] -= double * gap
                            elif free[i, j]:
                                cloth[i, j] += single * gap
                            elif free[p, q]:
                                cloth[p, q] -= single * gap
        most = 0.0
        for i in range(rows):
            for j in range(cols):
                if free[i, j]:
                    most = max(most, abs(cloth[i, j] - before[i, j]))
                if cloth[i, j] < terrain[i, j]:
                    cloth[i, j], free[i, j] = terrain[i, j], False
        if most < _REST_M:
            break
    return cloth
