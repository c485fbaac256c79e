"""Which photos can show the same ground: pairs from positions and gimbal angles."""

from __future__ import annotations

import numpy as np

#: Views whose optical axes differ by more than this are not matched by SIFT.
MAX_ANGLE_DEG = 60.0
#: So many photos are matched each with all others.
EXHAUSTIVE_UP_TO = 25


def ground_below(xyz: np.ndarray, relative_altitude_m: np.ndarray) -> float:
    """Height of the take-off point, from camera heights and their relative altitudes; NaN if unknown."""
    below = xyz[:, 2] - relative_altitude_m
    return float(np.nanmedian(below)) if np.isfinite(below).any() else float("nan")


def footprint_centres(xyz: np.ndarray, rotations: np.ndarray, ground_z: float) -> np.ndarray:
    """(N, 2) where the optical axes meet the plane z = ground_z; below the camera where they do not (or no
    rotation).
    """
    centres = xyz[:, :2].copy()
    axis = rotations[:, 2, :]
    for i in range(len(xyz)):
        height = xyz[i, 2] - ground_z
        if np.isfinite(axis[i]).all() and np.isfinite(height) and axis[i, 2] < -0.2:
            centres[i] += axis[i, :2] / -axis[i, 2] * height
    return centres


def select_pairs(
    xyz: np.ndarray, rotations: np.ndarray, ground_z: float, half_field: float, neighbours: int
) -> np.ndarray:
    """(P, 2) pairs i < j worth matching.

    Every photo gets its nearest ``neighbours``, near in a mixture of footprint distance and viewing direction; few
    photos, and those without a position, are paired with all others (:func:`.matching.similar_pairs` chooses of these).

    Args:
        xyz: (N, 3) local metres, NaN unknown. rotations: (N, 3, 3) world -> camera, NaN unknown. ground_z: NaN unknown.
        half_field: tangent of half the longer field of view.
    """
    count = len(xyz)
    if count < 2:
        return np.empty((0, 2), int)
    first, second = np.triu_indices(count, 1)
    if count <= EXHAUSTIVE_UP_TO:
        return np.column_stack([first, second])
    height = np.nanmedian(xyz[:, 2]) - ground_z if np.isfinite(ground_z) else 80.0
    reach = max(2 * half_field * max(height, 10.0), 5.0)
    centres = footprint_centres(xyz, rotations, ground_z)
    gap = np.linalg.norm(centres[first] - centres[second], axis=1) / reach
    axes = rotations[:, 2, :]
    angle = np.degrees(np.arccos(np.clip(np.sum(axes[first] * axes[second], axis=1), -1, 1)))
    known = np.isfinite(angle)
    cost = gap + np.where(known, angle / 40.0, 0.0)
    cost[known & (angle > MAX_ANGLE_DEG)] = np.inf
    cost[gap > 1.2] = np.inf
    table = np.full((count, count), np.inf)
    table[first, second] = table[second, first] = np.where(np.isfinite(cost), cost, np.inf)
    chosen = np.zeros((count, count), bool)
    for i in range(count):
        if np.isfinite(xyz[i]).all():
            order = np.argsort(table[i])[:neighbours]
            chosen[i, order[np.isfinite(table[i, order])]] = True
        else:
            chosen[i] = True
    chosen |= chosen.T
    first, second = np.nonzero(np.triu(chosen, 1))
    return np.column_stack([first, second])
