"""Cones at candidates: grown from a layer to the whole band, and followed up the stem."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...geometry.cone import Cone, fit_cone
from ...geometry.cone_kernels import grow
from ...quality.priors import USUAL_TAPER
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


def fit_candidate(
    near: np.ndarray,
    weights: np.ndarray | None,
    xy: np.ndarray,
    h: float,
    radius: float,
    sensor: Sensor,
    options: SegmentOptions,
) -> list[Cone]:
    """Cones grown from the candidate's layer to the whole band of (N, 3) points, from several starting radii."""
    if np.count_nonzero(np.abs(near[:, 2] - h) < _LAYER_M) < 6 or len(near) < sensor.least_points:
        return []
    # A few thousand points settle a fit; the judging counts them all.
    stride = max(len(near) // MAX_FITTED, 1)
    some = np.ascontiguousarray(near[::stride])
    weight = np.ones(len(some)) if weights is None else np.ascontiguousarray(weights[::stride])
    steepest = float(np.tan(np.radians(options.max_lean_deg)))
    fits = list(
        zip(
            *grow(some, weight, xy, h, radius, _LAYER_M, sensor.floor_m, sensor.cap_m, _LAYER_LEAN_SD, steepest, 6),
            strict=True,
        )
    )
    if not fits and not sensor.solid and radius <= THIN_M:
        # The vote for a thin half ring lies on its bark: its centre is a radius away to some side.
        for step in _SIDES:
            fits += zip(
                *grow(
                    some,
                    weight,
                    xy + radius * step,
                    h,
                    radius,
                    _LAYER_M,
                    sensor.floor_m,
                    sensor.cap_m,
                    _LAYER_LEAN_SD,
                    steepest,
                    6,
                ),
                strict=True,
            )
    grown = []
    for vector, covariance, sigma in fits:
        x, y, dx, dy, r, taper, _, _ = vector.tolist()
        cone = Cone(x, y, dx, dy, r, taper, float(h), float(sigma), covariance)
        grown.append(_solid_radius(cone, near, weights) if sensor.solid else cone)
    return grown


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
    best = float(r[usable][np.argmax(mass[usable] / r[usable])])
    return replace(cone, r=best)


def follow_up(
    points: np.ndarray, tree: Nearby, weights: np.ndarray | None, cone: Cone, sensor: Sensor, options: SegmentOptions
) -> tuple[Cone, ...]:
    """Cones of 1.5 m length every metre above the band, as long as there is bark where the axis leads."""
    pieces: list[Cone] = []
    current = cone
    h = 4.75
    while h < options.grow_m - 0.75:
        middle = current.centre(h)
        near = tree.within(middle, float(current.radius(h)) + 0.15, h - 0.75, h + 0.75)
        if len(near) < sensor.least_points // 3:
            break
        near = near[:: max(len(near) // MAX_FITTED, 1)]
        start = Cone(
            float(middle[0]),
            float(middle[1]),
            current.dx,
            current.dy,
            float(current.radius(h)),
            USUAL_TAPER,
            h,
            current.sigma,
        )
        piece = fit_cone(
            points[near],
            start,
            None if weights is None else weights[near],
            (0.03,),
            sensor.floor_m,
            sensor.cap_m,
            lean_sd=0.1,
        )
        if piece is None or np.hypot(piece.x - middle[0], piece.y - middle[1]) > 0.10:
            break
        if not 0.75 < piece.r / start.r < 1.2 or piece.r < 0.015:
            break
        residual = np.abs(piece.residuals(points[near]))
        if (residual < tolerance(piece, sensor)).mean() < 0.3:
            break
        pieces.append(piece)
        current = piece
        h += 1.0
    return tuple(pieces)
