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
#: An axis does not move farther than this once it is fitted coarsely.
_MOVES_M = 0.12


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
        return np.array([x, y]) if t.ndim == 0 else np.stack([x, y], axis=-1)

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
    vector, covariance, sigma = _fit(points, weights, start.vector, start.h_ref, np.array(schedule_m, float), floor_m,
                                     cap_m, lean_sd, taper_sd, bend_sd, rounds)
    if not sigma > 0:
        return None
    x, y, dx, dy, r, taper, bx, by = vector.tolist()
    return Cone(x, y, dx, dy, r, taper, start.h_ref, float(sigma), covariance, bx, by)


@njit(cache=True)
def _fit(points, weights, start, h_ref, schedule, floor_m, cap_m, lean_sd, taper_sd, bend_sd,
         rounds):  # pragma: no cover - compiled
    """:func:`fit_cone` without its refusals: vector (8,), its covariance (8, 8) and sigma, -1 where it ran away."""
    vector = start.copy()
    powers = 5 if bend_sd > 0 else 3
    if powers == 3:
        vector[6:] = 0.0
    bend = max(bend_sd, 1e-7)
    prior = np.array([0.0, 0.0, 0.0, 0.0, 0.0, TAPER_PRIOR, 0.0, 0.0])
    prior_sd = np.array([np.inf, np.inf, lean_sd, lean_sd, np.inf, taper_sd, bend, bend])
    normal = np.zeros((8, 8))
    x, y, t = points[:, 0].copy(), points[:, 1].copy(), points[:, 2] - h_ref
    last = 2.5 * cap_m
    for stage in range(len(schedule)):
        scale = schedule[stage]
        if not _gauss_newton(x, y, t, weights, vector, normal, scale, max(scale / 2, floor_m), prior, prior_sd, powers,
                             rounds):
            return vector, normal, -1.0
        if stage == 0:
            # What is farther than any later scale looks, and than the axis will move, is left behind.
            reach = 4 * max(last, schedule[1:].max() if len(schedule) > 1 else 0.0) + _MOVES_M
            near = np.abs(_away(x, y, t, vector)) < reach
            x, y, t, weights = x[near], y[near], t[near], weights[near]
    sigma = _noise(_away(x, y, t, vector), floor_m, cap_m)
    for _ in range(2):
        if not _gauss_newton(x, y, t, weights, vector, normal, 2.5 * sigma, sigma, prior, prior_sd, powers, rounds):
            return vector, normal, -1.0
        sigma = _noise(_away(x, y, t, vector), floor_m, cap_m)
    # Held to something very wide, so that what no point tells is unknown and not certain.
    return vector, np.linalg.inv(normal + 1e-6 * np.eye(8)), sigma


@njit(cache=True)
def _noise(residual, floor_m, cap_m):  # pragma: no cover - compiled
    """Spread of the bark points: MAD of what lies within two and a half times the cap."""
    near = np.abs(residual)
    near = near[near < 2.5 * cap_m]
    if near.shape[0] < 6:
        return cap_m
    return min(max(1.4826 * np.median(near), floor_m), cap_m)


@njit(cache=True)
def distance(x, y, h, vector, h_ref):  # pragma: no cover - compiled
    """Distance of a point at height h from the bark of the cone ``vector``, positive outside."""
    t = h - h_ref
    sx, sy = vector[2] + vector[6] * t, vector[3] + vector[7] * t
    length = np.sqrt(1.0 + sx * sx + sy * sy)
    ex = x - vector[0] - (vector[2] + 0.5 * vector[6] * t) * t
    ey = y - vector[1] - (vector[3] + 0.5 * vector[7] * t) * t
    along = (ex * sx + ey * sy) / length
    d = np.sqrt(max(ex * ex + ey * ey - along * along, 1e-12))
    return d - (vector[4] + vector[5] * (t + along / length))


@njit(cache=True)
def _residuals(points, vector, h_ref):  # pragma: no cover - compiled
    out = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        out[i] = distance(points[i, 0], points[i, 1], points[i, 2], vector, h_ref)
    return out


@njit(cache=True, fastmath={"contract", "arcp", "nsz"}, error_model="numpy")
def _away(x, y, t, vector):  # pragma: no cover - compiled
    """:func:`distance` of many points, t = h - h_ref, written so that it becomes vector code."""
    out = np.empty(x.shape[0])
    vx, vy, vdx, vdy, vr, vt, vbx, vby = vector
    for i in range(x.shape[0]):
        sx, sy = vdx + vbx * t[i], vdy + vby * t[i]
        inverse = 1.0 / np.sqrt(1.0 + sx * sx + sy * sy)
        ex = x[i] - vx - (vdx + 0.5 * vbx * t[i]) * t[i]
        ey = y[i] - vy - (vdy + 0.5 * vby * t[i]) * t[i]
        along = (ex * sx + ey * sy) * inverse
        d = np.sqrt(max(ex * ex + ey * ey - along * along, 1e-12))
        out[i] = d - (vr + vt * (t[i] + along * inverse))
    return out


@njit(cache=True, fastmath={"contract", "arcp", "nsz"}, error_model="numpy")
def _gauss_newton(x, y, t, weights, vector, normal, scale, sigma, prior, prior_sd, powers,
                  rounds):  # pragma: no cover - compiled
    """Re-weighted steps of ``vector`` in place; ``normal`` is that of the last step. False where the fit ran away.

    A residual changes by (ux, uy, 1) h^k (k = 0, 1; with a bend 2 for ux, uy), so the normal matrix is made of the
    moments of these three, multiplied two by two, with powers of h. powers: 3 (the axis stays straight) or 5."""
    right, step = np.zeros(8), np.empty(8)
    damped = np.empty((8, 8))
    moments, pulls = np.zeros((6, 5)), np.zeros((3, 3))
    # Of each unknown: which of the three, the power of h, and its factor.
    which, power = (0, 1, 0, 1, 2, 2, 0, 1), (0, 0, 1, 1, 0, 1, 2, 2)
    factor = (-1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -0.5, -0.5)
    pair = ((0, 1, 3), (1, 2, 4), (3, 4, 5))
    for _ in range(rounds):
        moments[:] = 0.0
        pulls[:] = 0.0
        away = _away(x, y, t, vector)
        for i in range(x.shape[0]):
            e = away[i]
            if abs(e) > 4 * scale:
                continue
            sx, sy = vector[2] + vector[6] * t[i], vector[3] + vector[7] * t[i]
            inverse = 1.0 / np.sqrt(1.0 + sx * sx + sy * sy)
            ex = x[i] - vector[0] - (vector[2] + 0.5 * vector[6] * t[i]) * t[i]
            ey = y[i] - vector[1] - (vector[3] + 0.5 * vector[7] * t[i]) * t[i]
            along = (ex * sx + ey * sy) * inverse
            h = t[i] + along * inverse
            per_d = 1.0 / (e + vector[4] + vector[5] * h)
            g = scale * scale / (scale * scale + e * e)
            w = weights[i] * g * g
            ux, uy = (ex - along * sx * inverse) * per_d, (ey - along * sy * inverse) * per_d
            wx, wy = w * ux, w * uy
            xx, xy, yy = wx * ux, wx * uy, wy * uy
            pull = w * e
            for k in range(powers):
                moments[0, k] += xx
                moments[1, k] += xy
                moments[2, k] += yy
                moments[3, k] += wx
                moments[4, k] += wy
                moments[5, k] += w
                xx, xy, yy, wx, wy, w = xx * h, xy * h, yy * h, wx * h, wy * h, w * h
            for k in range(3):
                pulls[0, k] += pull * ux
                pulls[1, k] += pull * uy
                pulls[2, k] += pull
                pull *= h
        normal[:] = 0.0
        right[:] = 0.0
        known = 6 if powers == 3 else 8
        for a in range(known):
            right[a] = -factor[a] * pulls[which[a], power[a]] / (sigma * sigma)
            for b in range(known):
                normal[a, b] = (factor[a] * factor[b] * moments[pair[which[a]][which[b]], power[a] + power[b]]
                                / (sigma * sigma))
        for a in range(8):
            if np.isfinite(prior_sd[a]):
                normal[a, a] += 1.0 / prior_sd[a] ** 2
                right[a] -= (vector[a] - prior[a]) / prior_sd[a] ** 2
        damped[:] = normal
        for a in range(8):
            damped[a, a] += 1e-3 * normal[a, a] + 1e-6
        if not _solved(damped, right, step):
            return False
        largest = np.sqrt(step[0] ** 2 + step[1] ** 2)
        if largest > 0.1:
            step *= 0.1 / largest
        if abs(step[4]) > 0.05:
            step *= 0.05 / abs(step[4])
        vector += step
        if np.max(np.abs(step)) < 1e-6:
            break
    if not np.isfinite(vector).all():
        return False
    return 0.01 < vector[4] <= 1.5 and vector[2] ** 2 + vector[3] ** 2 <= 0.49


@njit(cache=True)
def _solved(matrix, right, out):  # pragma: no cover - compiled
    """Cholesky in place: ``matrix`` (K, K) positive definite, ``out`` the solution; False where it is not."""
    k = right.shape[0]
    for a in range(k):
        for b in range(a + 1):
            value = matrix[a, b]
            for c in range(b):
                value -= matrix[a, c] * matrix[b, c]
            if a == b:
                if not value > 0.0:
                    return False
                matrix[a, a] = np.sqrt(value)
            else:
                matrix[a, b] = value / matrix[b, b]
    for a in range(k):
        value = right[a]
        for c in range(a):
            value -= matrix[a, c] * out[c]
        out[a] = value / matrix[a, a]
    for a in range(k - 1, -1, -1):
        value = out[a]
        for c in range(a + 1, k):
            value -= matrix[c, a] * out[c]
        out[a] = value / matrix[a, a]
    return True
