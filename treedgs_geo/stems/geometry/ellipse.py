"""An ellipse through a section's bark, and whether it is needed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .circles import covered_arc_deg, fit_circle
from .section_kernels import ellipse


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


def fit_ellipse(
    points: np.ndarray, weights: np.ndarray | None = None, noise_m: float = 0.01, start: np.ndarray | None = None
) -> EllipseFit | None:
    """A robust geometric ellipse through points on bark, started at the ring; ``None`` without a ring, with less than
    240 degrees of bark (an arc does not show an ellipse) or with axes further apart than 2 : 1.

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
    held, vector, (of_circle, of_ellipse, floor, n) = ellipse(
        np.ascontiguousarray(points), np.ascontiguousarray(weights), ring.x, ring.y, ring.r, noise_m
    )
    swing = float(np.hypot(vector[3], vector[4]))
    a, b = float(vector[2] + swing), float(vector[2] - swing)
    if not held or b <= 0.5 * a:
        return None
    criterion = [
        n * np.log(value + floor) + 2 * k + 2 * k * (k + 1) / max(n - k - 1, 1)
        for value, k in ((of_circle, 4), (of_ellipse, 6))
    ]
    h = ((a - b) / (a + b)) ** 2
    girth = (a + b) * (1 + 3 * h / (10 + np.sqrt(4 - 3 * h)))
    return EllipseFit(
        float(vector[0]),
        float(vector[1]),
        a,
        b,
        float(0.5 * np.arctan2(vector[4], vector[3])),
        float(girth),
        float(criterion[0] - criterion[1]),
    )
