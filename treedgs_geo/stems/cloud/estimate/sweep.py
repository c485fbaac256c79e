"""Bowed stems: the axis followed up and down from breast height, and the points brought back about a straight one.

A straight cone through a bowed stem is too thick: it has to hold both sides of the bow. Short cones that may bend are
fitted one after the other, each started where its neighbour leads; a Hermite spline through their centres and slopes
is the axis. Its horizontal sections are put over each other, the stretch of the local lean taken out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from ...geometry.cone import Cone, fit_cone
from ...geometry.section_kernels import near_bark
from ...quality.priors import USUAL_TAPER
from ..propose.sensors import Sensor

#: Distance of the short cones and half of their length, m.
STEP_M, HALF_M = 0.4, 0.5
#: Between these heights the axis is followed.
LOWEST_M, HIGHEST_M = 0.5, 4.4
#: A stem whose axis leaves the straight one by more than this within the fitted window is bowed, m: twice what the
#: prior of the bend (3 cm of sweep over the lower 3 m) makes of an ordinary stem.
BOWED_M = 0.02
#: Short cones needed to say so, and mean square of their distances in standard errors: 1 to 3 on straight stems, 30 to
#: 700 on bows of 15 cm in 4 m (simulated drone LiDAR; ``tests/stems/cloud/test_bow.py``).
LEAST_CONES, SURE = 4, 4.0
#: Prior sd of slope and bend (per metre) of the short cones: a bow of 40 cm in 4 m has slopes of 0.3.
_SLOPE_SD, _BEND_SD = 0.3, 0.15
#: A short cone is refused where it lies farther than this from where its neighbour leads, or changes its radius by
#: more than this share.
_JUMP_M, _CHANGE = 0.10, 0.15
#: Points farther than this from the bark that is expected are not looked at.
_REACH_M = 0.20
#: A short cone's points beyond this many add nothing but time.
MOST_POINTS = 1000


@dataclass(frozen=True)
class BowedAxis:
    """A curved axis: (K,) heights, (K, 2) centres, (K, 2) slopes, ascending; straight on beyond the ends. errors: (K,)
    standard errors of the centres. radius_m: at breast height."""

    heights: np.ndarray
    centres: np.ndarray
    slopes: np.ndarray
    errors: np.ndarray
    radius_m: float

    def at(self, h: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """(N, 2) centres and (N, 2) slopes at (N,) heights."""
        h = np.atleast_1d(np.asarray(h, float))
        within = np.clip(h, self.heights[0], self.heights[-1])
        spline = CubicHermiteSpline(self.heights, self.centres, self.slopes)
        slope = spline(within, 1)
        return spline(within) + slope * (h - within)[:, None], slope

    def straightened(self, points: np.ndarray, at_m: float) -> np.ndarray:
        """(N, 3) points as if the axis stood upright at its place at height ``at_m``, sections across the axis."""
        centre, slope = self.at(points[:, 2])
        offset = points[:, :2] - centre
        size = np.hypot(slope[:, 0], slope[:, 1])
        direction = slope / np.maximum(size, 1e-9)[:, None]
        along = (offset * direction).sum(axis=1)
        offset = offset + (along * (np.cos(np.arctan(size)) - 1.0))[:, None] * direction
        return np.column_stack([self.at(at_m)[0] + offset, points[:, 2]])


def follow_axis(points: np.ndarray, cone: Cone, sensor: Sensor, bh_m: float) -> BowedAxis | None:
    """The axis of the stem near ``cone`` in (N, 3) points; ``None`` where fewer than three short cones hold."""
    points = np.ascontiguousarray(points, dtype=float)
    coarse = min(0.08, 0.5 * float(cone.radius(bh_m)))
    first = _short_cone(points, replace_at(cone, bh_m), sensor, (coarse, 0.6 * coarse, 0.03))
    # A straight cone is too thick for a bowed stem, never much too thin.
    if first is None or first.r > (1 + _CHANGE) * float(cone.radius(bh_m)):
        return None
    found = [first]
    for step in (-STEP_M, STEP_M):
        current, h = first, bh_m + step
        while LOWEST_M <= h <= HIGHEST_M:
            predicted = replace_at(current, h)
            piece = _short_cone(points, predicted, sensor, (0.04, 0.025))
            if piece is None or np.hypot(piece.x - predicted.x, piece.y - predicted.y) > _JUMP_M:
                break
            if abs(piece.r / predicted.r - 1) > _CHANGE:
                break
            found.append(piece)
            current, h = piece, h + step
    if len(found) < 3:
        return None
    found.sort(key=lambda piece: piece.h_ref)
    errors = np.array([np.sqrt(np.trace(np.asarray(piece.covariance)[:2, :2])) for piece in found])
    table = np.array([[piece.h_ref, piece.x, piece.y, piece.dx, piece.dy] for piece in found])
    return BowedAxis(table[:, 0], table[:, 1:3], table[:, 3:], errors, first.r)


def is_bowed(axis: BowedAxis, cone: Cone, window: tuple[float, float]) -> bool:
    """Whether the axis surely leaves the cone's own in the window of heights: enough short cones, far, beyond error."""
    inside = (axis.heights > window[0] - 0.01) & (axis.heights < window[1] + 0.01)
    if inside.sum() < LEAST_CONES:
        return False
    apart = np.hypot(*(axis.centres - cone.centre(axis.heights)).T)[inside]
    return bool(apart.max() > BOWED_M and np.mean((apart / axis.errors[inside]) ** 2) > SURE)


def replace_at(cone: Cone, h: float) -> Cone:
    """The same cone with its reference at height h, its axis straight on from there."""
    (x, y), t = cone.centre(h).tolist(), h - cone.h_ref
    slope = cone.dx + cone.bx * t, cone.dy + cone.by * t
    return Cone(x, y, *slope, float(cone.radius(h)), USUAL_TAPER, h, cone.sigma)


def _short_cone(points: np.ndarray, start: Cone, sensor: Sensor, schedule: tuple[float, ...]) -> Cone | None:
    near = near_bark(points, start.vector, start.h_ref, HALF_M, _REACH_M)
    if len(near) < sensor.least_points:
        return None
    points = points[near[:: max(len(near) // MOST_POINTS, 1)]]
    piece = fit_cone(points, start, None, schedule, sensor.floor_m, sensor.cap_m, lean_sd=_SLOPE_SD, bend_sd=_BEND_SD)
    if piece is None or np.count_nonzero(np.abs(piece.residuals(points)) < 3 * piece.sigma) < sensor.least_points:
        return None
    return piece
