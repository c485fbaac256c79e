"""A stem as a leaning, tapering cylinder, fitted robustly to the points on its bark.

Coordinates: local metres, z = height above ground. The axis passes through ``(x, y)`` at ``h_ref`` with slopes
``(dx, dy)`` per metre of height and may bend (``bx``, ``by``: change of slope per metre); the radius is perpendicular
to the axis, ``r + taper (h - h_ref)``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

#: Prior of d(radius)/d(height): planted pine loses 0.5 cm of radius a metre, sd 0.5 cm (research: NSVB profiles).
TAPER_PRIOR = -0.005
TAPER_SD = 0.005
#: Prior sd of the axis slopes; 0.15 is 8.5 degrees, more lean has to be earned by the points.
LEAN_SD = 0.15
#: Prior sd of the bend where it is free: 3 cm of sweep over the lower 3 m.
BEND_SD = 0.006


@dataclass(frozen=True)
class Cone:
    """A fitted stem. x, y, r at ``h_ref``, metres; dx, dy, taper per metre; sigma: spread of the bark points;
    covariance: (8, 8) of :attr:`vector`; bx, by: bend, per metre squared."""

    x: float
    y: float
    dx: float
    dy: float
    r: float
    taper: float
    h_ref: float
    sigma: float = 0.0
    covariance: np.ndarray | None = None
    bx: float = 0.0
    by: float = 0.0

    @property
    def vector(self) -> np.ndarray:
        """(8,) x, y, dx, dy, r, taper, bx, by."""
        return np.array([self.x, self.y, self.dx, self.dy, self.r, self.taper, self.bx, self.by])

    @property
    def lean_deg(self) -> float:
        """Angle of the axis from the vertical."""
        return float(np.degrees(np.arctan(np.hypot(self.dx, self.dy))))

    def centre(self, h: np.ndarray | float) -> np.ndarray:
        """(..., 2) axis position at heights ``h``."""
        t = np.asarray(h, float) - self.h_ref
        x, y = self.x + (self.dx + 0.5 * self.bx * t) * t, self.y + (self.dy + 0.5 * self.by * t) * t
        return np.stack([x, y], axis=-1)

    def radius(self, h: np.ndarray | float) -> np.ndarray:
        """Radius at heights ``h`` of the axis."""
        return self.r + self.taper * (np.asarray(h, float) - self.h_ref)

    def residuals(self, points: np.ndarray) -> np.ndarray:
        """(N,) distance from the bark, positive outside."""
        return _residuals(np.ascontiguousarray(points, dtype=float), self.vector, self.h_ref)

    def azimuths(self, points: np.ndarray) -> np.ndarray:
        """(N,) direction of the points around the axis, radians (-pi, pi]."""
        offset = points[:, :2] - self.centre(points[:, 2])
        return np.arctan2(offset[:, 1], offset[:, 0])


def fit_cone(points: np.ndarray, start: Cone, weights: np.ndarray | None = None,
             schedule_m: tuple[float, ...] = (0.06, 0.04, 0.025), floor_m: float = 0.008, cap_m: float = 0.03,
             lean_sd: float = LEAN_SD, taper_sd: float = TAPER_SD, bend_sd: float = 0.0,
             rounds: int = 6) -> Cone | None:
    """Fit (N, 3) points from ``start`` by graduated Geman-McClure re-weighting.

    schedule_m: scales from coarse to fine; then the noise is estimated from the near points (``floor_m`` to ``cap_m``)
    and the fit finished with it. bend_sd = 0 keeps the axis straight. Returns ``None`` when the fit runs away
    (radius <= 1 cm or > 1.5 m, lean > 35 deg).
    """
    points = np.ascontiguousarray(points, dtype=float)
    if len(points) < 6 or not np.isfinite(points).all():
        return None
    weights = np.ones(len(points)) if weights is None else np.ascontiguousarray(weights, dtype=float)
    vector, h_ref = start.vector, start.h_ref
    bend = max(bend_sd, 1e-7)
    if bend_sd == 0.0:
        vector[6:] = 0.0
    prior = np.array([0.0, 0.0, 0.0, 0.0, 0.0, TAPER_PRIOR, 0.0, 0.0])
    prior_sd = np.array([np.inf, np.inf, lean_sd, lean_sd, np.inf, taper_sd, bend, bend])
    for scale in schedule_m:
        spread = max(scale / 2, floor_m)
        vector, _ = _gauss_newton(points, weights, vector, h_ref, scale, spread, prior, prior_sd, rounds)
        if _ran_away(vector):
            return None
    sigma = _noise(_residuals(points, vector, h_ref), weights, floor_m, cap_m)
    covariance = None
    for _ in range(2):
        vector, normal = _gauss_newton(points, weights, vector, h_ref, 2.5 * sigma, sigma, prior, prior_sd, rounds)
        if _ran_away(vector):
            return None
        sigma = _noise(_residuals(points, vector, h_ref), weights, floor_m, cap_m)
    covariance = np.linalg.pinv(normal)
    x, y, dx, dy, r, taper, bx, by = vector.tolist()
    return Cone(x, y, dx, dy, r, taper, h_ref, sigma, covariance, bx, by)


def _ran_away(vector: np.ndarray) -> bool:
    return bool(not np.isfinite(vector).all() or not 0.01 < vector[4] <= 1.5 or np.hypot(vector[2], vector[3]) > 0.7)


def _noise(residual: np.ndarray, weights: np.ndarray, floor_m: float, cap_m: float) -> float:
    """Spread of the bark points: MAD of what lies within three times the cap."""
    near = np.abs(residual) < 2.5 * cap_m
    if near.sum() < 6:
        return cap_m
    return float(np.clip(1.4826 * np.median(np.abs(residual[near])), floor_m, cap_m))


@njit(cache=True)
def _residuals(points, vector, h_ref):  # pragma: no cover - compiled
    n = points.shape[0]
    out = np.empty(n)
    for i in range(n):
        t = points[i, 2] - h_ref
        sx, sy = vector[2] + vector[6] * t, vector[3] + vector[7] * t
        length = np.sqrt(1.0 + sx * sx + sy * sy)
        ex = points[i, 0] - vector[0] - (vector[2] + 0.5 * vector[6] * t) * t
        ey = points[i, 1] - vector[1] - (vector[3] + 0.5 * vector[7] * t) * t
        along = (ex * sx + ey * sy) / length
        d = np.sqrt(max(ex * ex + ey * ey - along * along, 1e-12))
        out[i] = d - (vector[4] + vector[5] * (t + along / length))
    return out


@njit(cache=True)
def _gauss_newton(points, weights, vector, h_ref, scale, sigma, prior, prior_sd, rounds):  # pragma: no cover - compiled
    n = points.shape[0]
    vector = vector.copy()
    normal = np.zeros((8, 8))
    for _ in range(rounds):
        normal = np.zeros((8, 8))
        right = np.zeros(8)
        row = np.empty(8)
        for i in range(n):
            t = points[i, 2] - h_ref
            sx, sy = vector[2] + vector[6] * t, vector[3] + vector[7] * t
            length = np.sqrt(1.0 + sx * sx + sy * sy)
            ex = points[i, 0] - vector[0] - (vector[2] + 0.5 * vector[6] * t) * t
            ey = points[i, 1] - vector[1] - (vector[3] + 0.5 * vector[7] * t) * t
            along = (ex * sx + ey * sy) / length
            d = np.sqrt(max(ex * ex + ey * ey - along * along, 1e-12))
            height = t + along / length
            e = d - (vector[4] + vector[5] * height)
            if abs(e) > 4 * scale:
                continue
            g = scale * scale / (scale * scale + e * e)
            w = weights[i] * g * g / (sigma * sigma)
            ux = (ex - along * sx / length) / d
            uy = (ey - along * sy / length) / d
            row[0] = -ux
            row[1] = -uy
            row[2] = -ux * height
            row[3] = -uy * height
            row[4] = -1.0
            row[5] = -height
            row[6] = -ux * 0.5 * height * height
            row[7] = -uy * 0.5 * height * height
            for a in range(8):
                right[a] -= w * row[a] * e
                for b in range(8):
                    normal[a, b] += w * row[a] * row[b]
        for a in range(8):
            if np.isfinite(prior_sd[a]):
                normal[a, a] += 1.0 / prior_sd[a] ** 2
                right[a] -= (vector[a] - prior[a]) / prior_sd[a] ** 2
        damped = normal.copy()
        for a in range(8):
            damped[a, a] += 1e-3 * normal[a, a] + 1e-6
        step = np.linalg.solve(damped, right)
        largest = np.sqrt(step[0] ** 2 + step[1] ** 2)
        if largest > 0.1:
            step *= 0.1 / largest
        if abs(step[4]) > 0.05:
            step *= 0.05 / abs(step[4])
        vector += step
        if np.max(np.abs(step)) < 1e-6:
            break
    return vector, normal
