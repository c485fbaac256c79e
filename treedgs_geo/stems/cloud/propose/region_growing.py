"""The search of a tile: cones at candidates, grown from a layer to the whole band, and followed up the stem."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...geometry.cone import Cone, fit_cone
from ...geometry.cone_kernels import grow
from ...quality.priors import USUAL_TAPER
from .evidence import stands_at
from .nearby import Nearby
from .options import SegmentOptions
from .sensors import Sensor, tolerance

#: Points farther than this from a candidate's ring do not matter to it, m.
REACH_M = 0.75
#: Points that a candidate's cone is fitted to at most.
MAX_FITTED = 3000
#: A candidate's layer, half of its thickness, m, and the prior sd of its lean.
_LAYER_M, _LAYER_LEAN_SD = 0.8, 0.08
#: Candidates up to this radius that give no cone are started again from beside them, to these sides.
THIN_M, _SIDES = 0.09, np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])


class Search:
    """A tile's (N, 3) points with (N,) weights, if any, and what has been found among them: ``free`` (N,) bool, points
    that no stem explains; ``axes`` (K, 9), see :func:`.evidence.stands_at`."""

    def __init__(self, points: np.ndarray, weights: np.ndarray | None, sensor: Sensor, options: SegmentOptions) -> None:
        self.points, self.weights, self.sensor, self.options = points, weights, sensor, options
        self.tree = Nearby(points)
        self.free = np.ones(len(points), bool)
        self.axes = np.empty((0, 9))

    def near(self, xy: np.ndarray, radius: float = 0.0) -> np.ndarray:
        """(M,) free points that matter to a ring of ``radius`` at (2,) ``xy``."""
        index = self.tree.within(xy, REACH_M + radius, *self.options.fitted_m)
        return index[self.free[index]]

    def is_stem(
        self, xy: np.ndarray, h: float, share: float = 1.0, least_m: float = 0.0, beyond_m: float = 0.0
    ) -> bool:
        """Does a found stem stand at (2,) ``xy``? See :func:`.evidence.stands_at`."""
        return bool(stands_at(self.axes, xy[0], xy[1], h, share, least_m, beyond_m))

    def add(self, *cones: Cone) -> None:
        """Found stems."""
        self.axes = np.vstack([self.axes, *(np.r_[cone.vector, cone.h_ref] for cone in cones)])

    def cones(
        self, near: np.ndarray, xy: np.ndarray, h: float, radius: float, options: SegmentOptions | None = None
    ) -> list[Cone]:
        """Cones grown from a candidate's layer to the whole band of the points ``near`` (M,), from several radii."""
        points, options, sensor = self.points[near], options or self.options, self.sensor
        if np.count_nonzero(np.abs(points[:, 2] - h) < _LAYER_M) < 6 or len(points) < sensor.least_points:
            return []
        weights = None if self.weights is None else self.weights[near]
        # A few thousand points settle a fit; the judging counts them all.
        stride = max(len(points) // MAX_FITTED, 1)
        some = np.ascontiguousarray(points[::stride])
        weight = np.ones(len(some)) if weights is None else np.ascontiguousarray(weights[::stride])
        steepest = float(np.tan(np.radians(options.max_lean_deg)))
        limits = (radius, _LAYER_M, sensor.floor_m, sensor.cap_m, _LAYER_LEAN_SD, steepest, 6)
        fits = list(zip(*grow(some, weight, xy, h, *limits), strict=True))
        if not fits and not sensor.solid and radius <= THIN_M:
            # The vote for a thin half ring lies on its bark: its centre is a radius away to some side.
            for step in _SIDES:
                fits += zip(*grow(some, weight, xy + radius * step, h, *limits), strict=True)
        grown = []
        for vector, covariance, sigma in fits:
            x, y, dx, dy, r, taper, _, _ = vector.tolist()
            cone = Cone(x, y, dx, dy, r, taper, float(h), float(sigma), covariance)
            grown.append(_solid_radius(cone, points, weights) if sensor.solid else cone)
        return grown

    def follow_up(self, cone: Cone) -> tuple[Cone, ...]:
        """Cones of 1.5 m length every metre above the band, as long as there is bark where the axis leads."""
        pieces: list[Cone] = []
        current, sensor = cone, self.sensor
        h = 4.75
        while h < self.options.grow_m - 0.75:
            (x, y), radius = current.centre(h).tolist(), float(current.radius(h))
            near = self.tree.within(np.array([x, y]), radius + 0.15, h - 0.75, h + 0.75)
            if len(near) < sensor.least_points // 3:
                break
            near = near[:: max(len(near) // MAX_FITTED, 1)]
            points, weights = self.points[near], None if self.weights is None else self.weights[near]
            start = Cone(x, y, current.dx, current.dy, radius, USUAL_TAPER, h, current.sigma)
            piece = fit_cone(points, start, weights, (0.03,), sensor.floor_m, sensor.cap_m, lean_sd=0.1)
            if piece is None or np.hypot(piece.x - x, piece.y - y) > 0.10:
                break
            if not 0.75 < piece.r / start.r < 1.2 or piece.r < 0.015:
                break
            if (np.abs(piece.residuals(points)) < tolerance(piece, sensor)).mean() < 0.3:
                break
            pieces.append(piece)
            current = piece
            h += 1.0
        return tuple(pieces)


def _solid_radius(cone: Cone, points: np.ndarray, weights: np.ndarray | None) -> Cone:
    """Radius of a filled stem: the largest mass within r over r (eq:weighted_score with p = 1, centre known)."""
    distance = cone.residuals(points) + cone.radius(points[:, 2])
    near = distance < 0.8
    order = np.argsort(distance[near])
    mass = np.cumsum(np.ones(near.sum()) if weights is None else weights[near][order])
    r = distance[near][order]
    usable = r > 0.03
    if not usable.any():
        return cone
    return replace(cone, r=float(r[usable][np.argmax(mass[usable] / r[usable])]))
