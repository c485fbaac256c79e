"""A stem as a leaning, tapering cylinder, fitted robustly to the points on its bark.

Coordinates: local metres, z = height above ground. The axis passes through ``(x, y)`` at ``h_ref`` with slopes
``(dx, dy)`` per metre of height and may bend (``bx``, ``by``: change of slope per metre); the radius is perpendicular
to the axis, ``r + taper (h - h_ref)``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .cone_kernels import CONE_LEAN_SD, CONE_TAPER_SD, bark_distances, fit_vector


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
        if t.ndim == 0:
            return np.array([x, y])
        centre = np.empty((*t.shape, 2))  # np.stack takes as long as the rest
        centre[..., 0], centre[..., 1] = x, y
        return centre

    def radius(self, h: np.ndarray | float) -> np.ndarray:
        """Radius at heights ``h`` of the axis."""
        return self.r + self.taper * (np.asarray(h, float) - self.h_ref)

    def residuals(self, points: np.ndarray) -> np.ndarray:
        """(N,) distance from the bark, positive outside."""
        return bark_distances(np.ascontiguousarray(points, dtype=float), self.vector, self.h_ref)

    def azimuths(self, points: np.ndarray) -> np.ndarray:
        """(N,) direction of the points around the axis, radians (-pi, pi]."""
        offset = points[:, :2] - self.centre(points[:, 2])
        return np.arctan2(offset[:, 1], offset[:, 0])

    def sectors(self, points: np.ndarray, count: int) -> np.ndarray:
        """(N,) which of ``count`` sectors around the axis, from direction -pi on, the points lie in."""
        return np.floor((self.azimuths(points) + np.pi) / (2 * np.pi) * count).astype(int) % count


def fit_cone(
    points: np.ndarray,
    start: Cone,
    weights: np.ndarray | None = None,
    schedule_m: tuple[float, ...] = (0.06, 0.04, 0.025),
    floor_m: float = 0.008,
    cap_m: float = 0.03,
    lean_sd: float = CONE_LEAN_SD,
    taper_sd: float = CONE_TAPER_SD,
    bend_sd: float = 0.0,
    rounds: int = 6,
) -> Cone | None:
    """Fit (N, 3) points from ``start`` by graduated Geman-McClure re-weighting.

    schedule_m: scales from coarse to fine; then the noise is estimated from the near points (``floor_m`` to ``cap_m``)
    and the fit finished with it. bend_sd = 0 keeps the axis straight. Returns ``None`` when the fit runs away
    (radius <= 1 cm or > 2.5 m, lean > 35 deg).
    """
    points = np.ascontiguousarray(points, dtype=float)
    if len(points) < 6 or not np.isfinite(points).all():
        return None
    weights = np.ones(len(points)) if weights is None else np.ascontiguousarray(weights, dtype=float)
    vector, covariance, sigma = fit_vector(
        points,
        weights,
        start.vector,
        start.h_ref,
        np.array(schedule_m, float),
        floor_m,
        cap_m,
        lean_sd,
        taper_sd,
        bend_sd,
        rounds,
    )
    if not sigma > 0:
        return None
    x, y, dx, dy, r, taper, bx, by = vector.tolist()
    return Cone(x, y, dx, dy, r, taper, start.h_ref, float(sigma), covariance, bx, by)
