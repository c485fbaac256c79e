"""The cylinder baseline: RANSAC and robust least squares as the paper describes it (after DigiForests)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.seeding import own_order
from ...pointcloud.cloud import thin

#: Constants of ``paper.tex``, "Cylinder fitting baseline", and of the method that it follows.
_VOXEL_M, _LOW_M, _HIGH_M = 0.05, 0.5, 4.0
_ROUNDS, _SAMPLE, _INLIER_M, _STEEPEST_RAD, _R_MAX_M = 10_000, 5, 0.005, np.pi / 8, 0.5
_KERNEL_M, _STEPS, _STOP = 0.10, 1000, 1e-5


@dataclass(frozen=True)
class CylinderFit:
    """centre (3,), axis (3,) unit and upward, r: metres. height_m: mean height of the inliers, where r is read."""

    centre: np.ndarray
    axis: np.ndarray
    r: float
    inlier_share: float
    height_m: float
    points: int


def fit_cylinder(points: np.ndarray, seed: int = 0) -> CylinderFit | None:
    """A cylinder through (N, 3) stem points, z = height above ground; ``None`` if no model is upright and thin enough.

    Known to read the diameter at about 2.25 m (no taper), and too thin by its starting radius: it is a baseline.
    """
    points = points[(points[:, 2] >= _LOW_M) & (points[:, 2] <= _HIGH_M)]
    points = points[np.isfinite(points).all(axis=1)]
    points = points[own_order(points)]
    points = points[thin(points, _VOXEL_M)]
    if len(points) < _SAMPLE:
        return None
    origin = points.mean(axis=0)
    local = points - origin
    start = _ransac(local, np.random.default_rng(seed))
    if start is None:
        return None
    refined = _refine(local, start)
    best = start
    if refined is not None and _inliers(local, refined).sum() > _inliers(local, start).sum():
        best = refined
    inlier = _inliers(local, best)
    height = float(points[inlier, 2].mean()) if inlier.any() else float(points[:, 2].mean())
    axis = best[3:6] / np.linalg.norm(best[3:6])
    axis = axis if axis[2] >= 0 else -axis
    return CylinderFit(best[:3] + origin, axis, float(best[6]), float(inlier.mean()), height, len(points))


def _distance(points: np.ndarray, model: np.ndarray) -> np.ndarray:
    axis = model[3:6] / np.linalg.norm(model[3:6])
    offset = points - model[:3]
    return np.linalg.norm(offset - (offset @ axis)[:, None] * axis, axis=1) - model[6]


def _inliers(points: np.ndarray, model: np.ndarray) -> np.ndarray:
    return np.abs(_distance(points, model)) < _INLIER_M


def _ransac(points: np.ndarray, rng: np.random.Generator) -> np.ndarray | None:
    """Centre = mean, axis and radius from the covariance of five points (radius = root of the second eigenvalue)."""
    picks = rng.integers(0, len(points), (_ROUNDS, _SAMPLE))
    sample = points[picks]
    centres = sample.mean(axis=1)
    spread = sample - centres[:, None]
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", spread, spread) / _SAMPLE)
    axes = vectors[:, :, 2]
    radii = np.sqrt(np.maximum(values[:, 1], 0))
    fine = (np.abs(axes[:, 2]) >= np.cos(_STEEPEST_RAD)) & (radii <= _R_MAX_M) & (radii > 1e-3)
    best, most = None, -1
    for low in range(0, int(fine.sum()), 500):
        chosen = np.flatnonzero(fine)[low : low + 500]
        offset = points[None] - centres[chosen, None]
        along = np.einsum("nki,ni->nk", offset, axes[chosen])
        distance = np.sqrt(np.maximum((offset**2).sum(axis=2) - along**2, 0)) - radii[chosen, None]
        count = (np.abs(distance) < _INLIER_M).sum(axis=1)
        top = int(np.argmax(count))
        if count[top] > most:
            most = int(count[top])
            best = np.concatenate([centres[chosen[top]], axes[chosen[top]], [radii[chosen[top]]]])
    return best


def _refine(points: np.ndarray, start: np.ndarray) -> np.ndarray | None:
    """Gauss-Newton with unit damping on centre, axis and radius under the Geman-McClure kernel."""
    model = start.copy()
    for _ in range(_STEPS):
        axis = model[3:6] / np.linalg.norm(model[3:6])
        offset = points - model[:3]
        along = offset @ axis
        radial = offset - along[:, None] * axis
        length = np.maximum(np.linalg.norm(radial, axis=1), 1e-9)
        unit = radial / length[:, None]
        residual = length - model[6]
        weight = (_KERNEL_M**2 / (_KERNEL_M**2 + residual**2)) ** 2
        jacobian = np.column_stack([-unit, -along[:, None] * unit, -np.ones(len(points))])
        normal = (jacobian * weight[:, None]).T @ jacobian + np.eye(7)
        step = -np.linalg.solve(normal, (jacobian * weight[:, None]).T @ residual)
        model = model + step
        model[3:6] /= np.linalg.norm(model[3:6])
        if not np.isfinite(model).all() or not 0 < model[6] < 5:
            return None
        if np.linalg.norm(step) < _STOP:
            break
    return model
