"""A stem in a field of opacities: the cone inside which points are opaque.

Points in and about a stem carry the opacity that lies in front of them in the photos (``stems/splats/sample.py``): high
inside the wood, low outside. The published reading counts the points that a circle holds, so it follows where the
Gaussians are rather than where opacity ends, and whatever hangs about a stem makes it thicker. Here all heights are
read at once: the tapered, leaning cone that best separates high from low, each side at a level of its own,

    opacity ~ outside + (inside - outside) sigmoid((r(h) - distance from the axis) / edge).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...quality.priors import BREAST_HEIGHT_M, START_TAPER, TAPER_SD

#: Softness of the edge, metres: about half a pixel's footprint.
EDGE_M = 0.012
#: Heights read, about breast height; where the axis is sought about the middle of the points; thinnest and thickest.
REACH_M, SEARCH_M, LEAST_M, MOST_M = 1.1, 0.3, 0.03, 0.5
#: Below this contrast between inside and outside there is no stem to read.
LEAST_CONTRAST = 0.005
#: Largest radius as a share of the distance that the points reach from the axis.
MOST_OF_BORDER = 0.75
_CELL_M = 0.02
#: Means and sds of slope (2) and of the radius' change with height.
_PRIOR, _PRIOR_SD = np.array([0.0, 0.0, START_TAPER]), np.array([0.15, 0.15, TAPER_SD])
#: Standard deviation of one point's opacity about the model; points are far from independent.
_NOISE = 3.0


@dataclass(frozen=True)
class OpacityCone:
    """x, y: axis at breast height; slope_x, slope_y: metres a metre; radius_m there; taper_m: change of the radius a
    metre; inside, outside: opacities; explained: share of the opacities' variance that the cone explains."""

    x: float
    y: float
    slope_x: float
    slope_y: float
    radius_m: float
    taper_m: float
    inside: float
    outside: float
    explained: float

    @property
    def dbh_cm(self) -> float:
        """Diameter at breast height, cm."""
        return 200 * self.radius_m


def fit_opacity_cone(points: np.ndarray, opacity: np.ndarray, bh_m: float = BREAST_HEIGHT_M) -> OpacityCone | None:
    """points: (N, 3) metres, z = height above ground, one stem's. opacity: (N,) 0..1. None where too few points lie
    about breast height, or inside and outside differ too little."""
    q = points[:, 2] - bh_m
    near = np.abs(q) <= REACH_M
    q, xy, value = q[near], np.asarray(points[near, :2], float), np.asarray(opacity[near], float)
    if len(q) < 200:
        return None
    middle = np.median(xy, axis=0)
    xy = xy - middle
    start = _start(xy[np.abs(q) < 0.6], value[np.abs(q) < 0.6])
    if start is None:
        return None
    shape = np.array([*start[:2], 0.0, 0.0, start[2], _PRIOR[2]])
    levels = np.array(start[3:])
    for _ in range(20):
        step = _step(shape, levels, xy, q, value)
        shape, levels = shape + step[:6], np.clip(levels + step[6:], 0.0, 1.0)
        shape[4] = np.clip(shape[4], LEAST_M, MOST_M)
        if np.abs(step[:6]).max() < 1e-5:
            break
    left = value - _model(shape, levels, xy, q)[0]
    explained = 1 - left.var() / max(value.var(), 1e-12)
    found = OpacityCone(*map(float, [shape[0] + middle[0], shape[1] + middle[1], *shape[2:], *levels, explained]))
    if not np.isfinite(shape).all() or found.inside - found.outside < LEAST_CONTRAST:
        return None
    # An edge at the border of the points is their own, not a stem's.
    border = np.percentile(np.hypot(*(xy - shape[:2] - np.outer(q, shape[2:4])).T), 95)
    return found if found.radius_m < MOST_OF_BORDER * border else None


def _start(xy: np.ndarray, value: np.ndarray) -> tuple[float, float, float, float, float] | None:
    """Upright start (x, y, radius, inside, outside): the circle that splits a map of mean opacities best."""
    edges = np.arange(-0.6, 0.6001, _CELL_M)
    count = np.histogram2d(xy[:, 0], xy[:, 1], bins=edges)[0]
    total = np.histogram2d(xy[:, 0], xy[:, 1], bins=edges, weights=value)[0]
    i, j = np.nonzero(count)
    if len(i) < 50:
        return None
    mean, centre = total[i, j] / count[i, j], edges[:-1] + _CELL_M / 2
    x, y = centre[i], centre[j]
    steps = np.arange(-SEARCH_M, SEARCH_M + 1e-9, 0.03)
    best: tuple[float, tuple[float, float, float, float, float] | None] = (np.inf, None)
    rings = np.arange(0, 0.6, 0.01)
    for cx in steps:
        for cy in steps:
            ring = np.minimum((np.hypot(x - cx, y - cy) / 0.01).astype(int), len(rings) - 1)
            n, s = np.bincount(ring, minlength=len(rings)).cumsum(), np.bincount(ring, mean, len(rings)).cumsum()
            with np.errstate(divide="ignore", invalid="ignore"):
                inside, outside = s / n, (s[-1] - s) / (n[-1] - n)
                gain = n * inside**2 + (n[-1] - n) * outside**2
            fits = (rings + 0.01 >= LEAST_M) & (rings < 0.36) & (n < n[-1]) & (inside > outside)
            if not fits.any():
                continue
            k = int(np.argmax(np.where(fits, gain, -np.inf)))
            if -gain[k] < best[0]:
                best = -gain[k], (float(cx), float(cy), float(rings[k] + 0.01), float(inside[k]), float(outside[k]))
    return best[1]


def _model(shape: np.ndarray, levels: np.ndarray, xy: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, ...]:
    """(N,) opacity, (N,) share inside, (N, 2) direction from the axis."""
    offset = xy - shape[:2] - np.outer(q, shape[2:4])
    away = np.maximum(np.hypot(*offset.T), 1e-6)
    within = 1 / (1 + np.exp(-np.clip((shape[4] + shape[5] * q - away) / EDGE_M, -40, 40)))
    return levels[1] + (levels[0] - levels[1]) * within, within, offset / away[:, None]


def _step(shape: np.ndarray, levels: np.ndarray, xy: np.ndarray, q: np.ndarray, value: np.ndarray) -> np.ndarray:
    """(8,) Gauss-Newton step of shape and levels."""
    shown, within, direction = _model(shape, levels, xy, q)
    residual = value - shown
    edge = (levels[0] - levels[1]) * within * (1 - within) / EDGE_M
    along = direction * edge[:, None]
    design = np.column_stack([along, along * q[:, None], edge, edge * q, within, 1 - within])
    # Against the priors, residuals count relative to the contrast: a translucent stem is as good as an opaque one.
    weight = 1000 / len(q) / max(levels[0] - levels[1], 1e-3) ** 2 / _NOISE**2
    left, right = design.T @ design * weight, design.T @ residual * weight
    for row, mean, sd in zip((2, 3, 5), _PRIOR, _PRIOR_SD, strict=True):
        left[row, row] += 1 / sd**2
        right[row] += (mean - shape[row]) / sd**2
    left[np.diag_indices(8)] += 1e-9 + 1e-3 * np.diag(left)
    step = np.linalg.solve(left, right)
    return step * min(1.0, 0.05 / max(np.abs(step[[0, 1, 4]]).max(), 1e-9))
