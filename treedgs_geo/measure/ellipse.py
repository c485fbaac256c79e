"""An ellipse through a section's bark, and whether it is needed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .circles import _SECTORS, covered_arc_deg, fit_circle


@dataclass(frozen=True)
class EllipseFit:
    """An ellipse. a, b: half axes, a >= b, metres. turn: direction of a, rad. girth_d: girth over pi, as a tape reads.
    gain: how much better it is than the circle by the corrected AIC (> 0: the section is not round)."""

    x: float
    y: float
    a: float
    b: float
    turn: float
    girth_d: float
    gain: float


def fit_ellipse(points: np.ndarray, weights: np.ndarray | None = None, noise_m: float = 0.01,
                start: np.ndarray | None = None) -> EllipseFit | None:
    """A robust geometric ellipse through points on bark, started at the ring; ``None`` without a ring, with less than
    240 degrees of bark (an arc does not tell an ellipse) or with axes further apart than 2 : 1.

    Residuals are radial distances; a corrected AIC compares it with the circle, each sector counting once. start: (3,)
    x, y, r of the ring, where it is known roughly.
    """
    points = np.asarray(points, float).reshape(-1, 2)
    weights = np.ones(len(points)) if weights is None else np.asarray(weights, float)
    ring = fit_circle(points, weights, "ring", noise_m=max(noise_m, 0.004), start=start)
    if ring is None:
        return None
    if covered_arc_deg(points, ring.x, ring.y, ring.r, 0.3 * ring.r) < 240:
        return None
    scale = max(4 * noise_m, 0.15 * ring.r)
    # r(t) = r0 + c1 cos t + s1 sin t (centre) + c2 cos 2t + s2 sin 2t (an ellipse to first order), then refined.
    vector = np.array([ring.x, ring.y, ring.r, 0.0, 0.0])
    for _ in range(25):
        offset = points - vector[:2]
        angle, distance = np.arctan2(offset[:, 1], offset[:, 0]), np.hypot(offset[:, 0], offset[:, 1])
        residual = distance - _ellipse_radius(angle, *vector[2:])
        robust = (scale * scale / (scale * scale + residual * residual)) ** 2
        basis = np.column_stack([np.cos(angle), np.sin(angle), np.ones_like(angle), np.cos(2 * angle),
                                 np.sin(2 * angle)])
        w = weights * robust
        step = np.linalg.solve((basis * w[:, None]).T @ basis + 1e-12 * np.eye(5), (basis * w[:, None]).T @ residual)
        vector = vector + step
        scale = max(0.7 * scale, 2.5 * noise_m)
        if np.abs(step).max() < 1e-8 and scale == 2.5 * noise_m:
            break
    swing = float(np.hypot(vector[3], vector[4]))
    a, b = float(vector[2] + swing), float(vector[2] - swing)
    if not np.isfinite(vector).all() or b <= 0.5 * a:
        return None
    # Corrected AIC over sector means, whose spread holds the shape and not only the noise of single points.
    on = robust > 0.25
    sector = np.floor((angle + np.pi) / (2 * np.pi) * _SECTORS).astype(int) % _SECTORS
    circle = np.hypot(points[:, 0] - ring.x, points[:, 1] - ring.y) - ring.r
    count = np.bincount(sector[on], minlength=_SECTORS)
    filled = count > 0
    n = int(filled.sum())
    floor = (noise_m**2 / np.maximum(count[filled], 1)).mean()
    chi = [float(((np.bincount(sector[on], e[on], minlength=_SECTORS)[filled] / count[filled]) ** 2).mean() + floor)
           for e in (circle, residual)]
    criterion = [n * np.log(value) + 2 * k + 2 * k * (k + 1) / max(n - k - 1, 1)
                 for value, k in zip(chi, (4, 6), strict=True)]
    h = ((a - b) / (a + b)) ** 2
    girth = (a + b) * (1 + 3 * h / (10 + np.sqrt(4 - 3 * h)))
    return EllipseFit(float(vector[0]), float(vector[1]), a, b, float(0.5 * np.arctan2(vector[4], vector[3])),
                      float(girth), float(criterion[0] - criterion[1]))


def _ellipse_radius(angle: np.ndarray, mean: float, c2: float, s2: float) -> np.ndarray:
    """Radius of the ellipse with half axes mean +- hypot(c2, s2) about its centre."""
    swing = np.hypot(c2, s2)
    a, b, turn = mean + swing, mean - swing, 0.5 * np.arctan2(s2, c2)
    return a * b / np.sqrt((b * np.cos(angle - turn)) ** 2 + (a * np.sin(angle - turn)) ** 2)
