"""Rotations from gimbal angles, and fitting one set of camera poses to another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: A camera agrees within so many standard deviations of its geotag, and so many metres for the model's own error.
INLIER_SD, SLACK_M = 4.0, 0.3
#: Triples that are tried.
TRIALS = 500
_CAMERA_FROM_BODY = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
_NED_FROM_ENU = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])


def rotation_from_gimbal(yaw_deg: float, pitch_deg: float, roll_deg: float) -> np.ndarray:
    """(3, 3) world (grid E, N, U) -> camera (x right, y down, z forward) from DJI gimbal angles.

    Angles: NED, z-y'-x'' order; yaw clockwise from GRID north (true yaw minus convergence), pitch -90 = straight down.
    """
    yaw, pitch, roll = np.radians([yaw_deg, pitch_deg, roll_deg])
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    nod = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
    tilt = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    return _CAMERA_FROM_BODY @ (turn @ nod @ tilt).T @ _NED_FROM_ENU


def nearest_rotation(matrix: np.ndarray) -> np.ndarray:
    """The rotation closest to a 3 x 3 matrix."""
    u, _, vt = np.linalg.svd(matrix)
    return u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt


def rotation_angle_deg(rotations: np.ndarray) -> np.ndarray:
    """Angle of (..., 3, 3) rotations, degrees."""
    trace = np.trace(rotations, axis1=-2, axis2=-1)
    return np.degrees(np.arccos(np.clip((trace - 1) / 2, -1, 1)))


@dataclass(frozen=True)
class Similarity:
    """``target = scale * rotation @ source + shift``."""

    scale: float
    rotation: np.ndarray
    shift: np.ndarray

    def apply(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) source -> (N, 3) target."""
        return self.scale * points @ self.rotation.T + self.shift


def fit_similarity(source: np.ndarray, target: np.ndarray, weights: np.ndarray) -> Similarity:
    """Weighted least-squares similarity (Umeyama 1991) of (N, 3) points; N >= 3, not on one line."""
    w = weights / weights.sum()
    mean_s, mean_t = w @ source, w @ target
    s, t = source - mean_s, target - mean_t
    rotation = nearest_rotation((t * w[:, None]).T @ s)
    scale = float(np.sum(w[:, None] * t * (s @ rotation.T)) / np.sum(w[:, None] * s * s))
    return Similarity(scale, rotation, mean_t - scale * rotation @ mean_s)


def fit_similarity_robust(
    source: np.ndarray, target: np.ndarray, sd: np.ndarray, rng: np.random.Generator
) -> tuple[Similarity, np.ndarray] | None:
    """Similarity that most cameras agree with (RANSAC over triples, then refitted).

    Args:
        source: (N, 3) centres of a free model. target: (N, 3) geotags, metres. sd: (N,) of the geotags, metres.

    Returns:
        The similarity and the (N,) inlier mask; None when fewer than three cameras agree or they stand on one line.
    """
    count = len(source)
    if count < 3:
        return None
    limit = INLIER_SD * sd + SLACK_M
    best: tuple[int, np.ndarray] | None = None
    spread = np.linalg.norm(target - target.mean(axis=0), axis=1).max()
    for _ in range(TRIALS):
        pick = rng.choice(count, 3, replace=False)
        area = np.linalg.norm(np.cross(target[pick[1]] - target[pick[0]], target[pick[2]] - target[pick[0]]))
        if area < 0.01 * spread**2:
            continue
        trial = fit_similarity(source[pick], target[pick], np.ones(3))
        if not 0 < trial.scale < np.inf:
            continue
        inliers = np.linalg.norm(trial.apply(source) - target, axis=1) <= limit
        if best is None or inliers.sum() > best[0]:
            best = int(inliers.sum()), inliers
    if best is None or best[0] < 3:
        return None
    inliers = best[1]
    for _ in range(5):
        fitted = fit_similarity(source[inliers], target[inliers], 1 / np.maximum(sd[inliers], 0.02) ** 2)
        again = np.linalg.norm(fitted.apply(source) - target, axis=1) <= limit
        if again.sum() < 3 or (again == inliers).all():
            break
        inliers = again
    return fitted, inliers
