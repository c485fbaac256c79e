"""Circles through stem slices: the published solid-circle RANSAC, and ring fits for points that lie on bark.

All functions take (N, 2) metres. Of degenerate input (fewer than three distinct points, collinear points, NaN)
``fit_circle`` returns ``None``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...core.errors import InputError
from ...core.seeding import stream
from .circle_kernels import mixture_fit, ring_consensus, ring_score, solid_batch
from .section_kernels import SECTORS

_METHODS = ("ring", "paper", "hyper")


@dataclass(frozen=True)
class SolidCircle:
    """Constants of the weighted solid-circle RANSAC (``paper.tex``, Experimental Settings)."""

    power: float = 0.6
    hypotheses: int = 2000
    least_inliers: float = 0.1
    r_min_m: float = 0.02
    r_max_m: float = 1.0
    #: Denser slices are thinned to this many points, evenly: the score is a share, its noise is below 2 %.
    most_points: int = 800


@dataclass(frozen=True)
class CircleFit:
    """A circle. x, y, r: metres. sd_r: standard error of r from the residuals, ``nan`` where the method has none.
    arc_deg: circumference with points (15 degree sectors). inside: share of points within the bark. rms: of the ring.
    """

    x: float
    y: float
    r: float
    sd_r: float
    arc_deg: float
    inside: float
    rms: float
    points: int


def fit_circle(
    points: np.ndarray,
    weights: np.ndarray | None = None,
    method: str = "ring",
    solid: SolidCircle | None = None,
    noise_m: float = 0.01,
    seed: int = 0,
    start: np.ndarray | None = None,
) -> CircleFit | None:
    """One circle.

    points: (N, 2). weights: (N,), not negative; ``None`` = all alike. seed: 0 or more, of what is drawn by chance.
    method: ``paper`` = weighted solid-circle RANSAC (eq:weighted_score); ``ring`` = consensus over arcs, then a robust
    geometric fit with bark noise about ``noise_m``; ``hyper`` = the algebraic Hyper fit, for clean arcs.
    start: (3,) x, y, r of a circle that is known to be near: ``ring`` then looks nowhere else.

    Returns:
        The circle in the points' unit, or ``None`` where the points show none.

    Raises:
        InputError: an argument of another shape or kind.

    Examples:
        >>> import numpy as np
        >>> import treedgs_geo as tg
        >>> angle = np.linspace(0, np.pi, 60)
        >>> found = tg.fit_circle(np.column_stack([5 + 0.15 * np.cos(angle), 3 + 0.15 * np.sin(angle)]))
        >>> round(float(found.r), 3)
        0.15
    """
    points = _array("points", points, (None, 2))
    weights = np.ones(len(points)) if weights is None else _array("weights", weights, (len(points),))
    start = None if start is None else _array("start", start, (3,))
    if method not in _METHODS:
        raise InputError(f"method: found {method!r}, expected one of {', '.join(_METHODS)}; give one of them.")
    if not (isinstance(noise_m, int | float | np.number) and 0 < noise_m < np.inf):
        raise InputError(f"noise_m: found {noise_m!r}, expected metres above 0; give the spread of the bark.")
    if not (isinstance(seed, int | np.integer) and 0 <= seed < 2**64):
        raise InputError(f"seed: found {seed!r}, expected a whole number, 0 or more; give one.")
    if not _usable(points, weights):
        return None
    if method == "paper":
        found = fit_solid_circles([points], [weights], solid or SolidCircle(), seed)[0]
        return None if not np.isfinite(found[2]) else _describe(found, points, weights, 2 * noise_m, np.nan)
    if method == "hyper":
        vector = hyper_circle(points, weights)
        return None if vector is None else _describe(vector, points, weights, 2 * noise_m, np.nan)
    return _ring(points, weights, noise_m, seed, start)


def fit_solid_circles(
    slices: Sequence[np.ndarray], weights: Sequence[np.ndarray], solid: SolidCircle, seed: int | Sequence[int] = 0
) -> np.ndarray:
    """Weighted solid-circle RANSAC in many slices at once: (S, 3) x, y, r; NaN where no hypothesis is valid.

    seed: one a slice (0 to 2**64 - 1), or one number from which they are counted; a slice's circle depends on its own
    points, weights and seed only.

    Exactly the four steps of sec:dbh_weighted: three indices drawn without replacement with probability proportional to
    weight; the circle through them; inliers inside the disc, hypotheses with an abnormal radius or fewer than
    ``least_inliers`` of the points dropped; the largest (inlier weight) / r**power wins.
    """
    seeds = [stream(int(seed), k) for k in range(len(slices))] if isinstance(seed, int | np.integer) else list(seed)
    thinned, kept = [], []
    for points, weight, own in zip(slices, weights, seeds, strict=True):
        if len(points) > solid.most_points:
            pick = np.sort(np.random.default_rng(own).choice(len(points), solid.most_points, replace=False))
            points, weight = points[pick], weight[pick]
        thinned.append(np.ascontiguousarray(points, float))
        kept.append(np.ascontiguousarray(weight, float))
    if not thinned:
        return np.empty((0, 3))
    starts = np.concatenate([[0], np.cumsum([len(points) for points in thinned])]).astype(np.int64)
    return solid_batch(
        np.concatenate(thinned),
        np.concatenate(kept),
        starts,
        solid.power,
        solid.hypotheses,
        solid.least_inliers,
        solid.r_min_m,
        solid.r_max_m,
        np.array(seeds, np.uint64),
    )


def hyper_circle(points: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray | None:
    """(3,) x, y, r by the Hyper fit (Al-Sharadqah & Chernov 2009): no essential bias. ``None`` if degenerate."""
    weights = np.ones(len(points)) if weights is None else weights
    total = weights.sum()
    mean = (weights[:, None] * points).sum(axis=0) / total
    centred = points - mean
    scale = np.sqrt((weights * (centred**2).sum(axis=1)).sum() / total)
    if not scale > 0:
        return None
    u, v = (centred / scale).T
    z = u * u + v * v
    rows = np.stack([z, u, v, np.ones_like(u)])
    moment = (rows * weights) @ rows.T / total
    zm, um, vm = moment[0, 3], moment[1, 3], moment[2, 3]
    constraint = np.array([[8 * zm, 4 * um, 4 * vm, 2], [4 * um, 1, 0, 0], [4 * vm, 0, 1, 0], [2, 0, 0, 0]])
    try:
        values, vectors = np.linalg.eig(np.linalg.solve(constraint, moment))
    except np.linalg.LinAlgError:
        return None
    values, vectors = values.real, vectors.real
    # The constraint has one negative eigenvalue: the fit is the smallest positive one.
    order = [index for index in np.argsort(values) if values[index] > -1e-12]
    for index in order:
        a, b, c, d = vectors[:, index]
        if abs(a) < 1e-9 * np.abs(vectors[:, index]).max():
            continue
        under = (b * b + c * c) / (4 * a * a) - d / a
        if under > 0:
            return np.array([mean[0] - scale * b / (2 * a), mean[1] - scale * c / (2 * a), scale * np.sqrt(under)])
    return None


def covered_arc_deg(points: np.ndarray, x: float, y: float, r: float, tolerance_m: float) -> float:
    """Circumference with points within ``tolerance_m`` of the ring, in 15 degree sectors."""
    offset = points - (x, y)
    near = np.abs(np.hypot(offset[:, 0], offset[:, 1]) - r) < tolerance_m
    sector = np.floor((np.arctan2(offset[near, 1], offset[near, 0]) + np.pi) / (2 * np.pi) * SECTORS).astype(int)
    return 360.0 / SECTORS * len(np.unique(sector % SECTORS))


def _array(name: str, values: np.ndarray, shape: tuple[int | None, ...]) -> np.ndarray:
    """Numbers of a shape; ``None`` in it is any length."""
    wanted = f"({', '.join('N' if size is None else str(size) for size in shape)}{',' * (len(shape) == 1)})"
    try:
        found = np.asarray(values, float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: found no numbers, expected an array of shape {wanted}; give one.") from None
    if not found.size and shape[0] is None:
        return found.reshape(0, *shape[1:])
    if found.ndim != len(shape) or any(
        size not in (None, there) for size, there in zip(shape, found.shape, strict=True)
    ):
        raise InputError(f"{name}: found an array of shape {found.shape}, expected {wanted}; give that.")
    return found


def _usable(points: np.ndarray, weights: np.ndarray) -> bool:
    if len(points) < 3 or not np.isfinite(points).all() or not np.isfinite(weights).all():
        return False
    if (weights < 0).any() or (weights > 0).sum() < 3:
        return False
    # Points that spread well in both directions are neither few nor in a line; what is unclear is looked at in full.
    counted = points[weights > 0]
    x, y = (counted - counted.mean(axis=0)).T
    xx, xy, yy = float(x @ x), float(x @ y), float(y @ y)
    if xx * yy - xy * xy > 1e-4 * (xx + yy) ** 2 and xx + yy > 1e-6:
        return True
    distinct = np.unique(points[weights > 0], axis=0)
    if len(distinct) < 3:
        return False
    spread = np.linalg.svd(distinct - distinct.mean(axis=0), compute_uv=False)
    return bool(spread[1] > 1e-9 * max(spread[0], 1e-12) and spread[1] > 1e-9)


def _describe(
    vector: np.ndarray, points: np.ndarray, weights: np.ndarray, tolerance_m: float, sd_r: float
) -> CircleFit:
    x, y, r = (float(value) for value in vector)
    residual = np.hypot(points[:, 0] - x, points[:, 1] - y) - r
    on = np.abs(residual) < max(3 * tolerance_m, 1e-9)
    rms = float(np.sqrt(np.average(residual[on] ** 2, weights=weights[on]))) if weights[on].sum() > 0 else float("nan")
    inside = float(weights[residual < -2 * tolerance_m].sum() / weights.sum())
    arc = covered_arc_deg(points, x, y, r, 2 * tolerance_m)
    return CircleFit(x, y, r, float(sd_r), arc, inside, rms, int(on.sum()))


def _ring(
    points: np.ndarray, weights: np.ndarray, noise_m: float, seed: int, start: np.ndarray | None
) -> CircleFit | None:
    # The 1st and 99th percentile of x and y, as numpy has them, at a tenth of the time.
    ordered, place = np.sort(points, axis=0), np.array([0.01, 0.99]) * (len(points) - 1)
    below = np.floor(place).astype(int)
    step = ordered[np.minimum(below + 1, len(points) - 1)] - ordered[below]
    low, high = ordered[below] + (place - below)[:, None] * step
    area = float(np.prod(np.maximum(high - low, 4 * noise_m)))
    starts = [] if start is None else [np.asarray(start, float)]
    if start is None:
        algebraic = hyper_circle(points, weights)
        if algebraic is not None:
            starts.append(algebraic)
        consensus = ring_consensus(
            np.ascontiguousarray(points), np.ascontiguousarray(weights), 600, noise_m, area, 0.01, 1.5, np.uint64(seed)
        )
        if np.isfinite(consensus[2]):
            starts.append(consensus)
    best, best_score = None, -np.inf
    for near in starts:
        fitted = _mixture_circle(points, weights, near, noise_m, area)
        if fitted is None:
            continue
        score = ring_score(points, weights, *fitted[0], noise_m, area)
        if score > best_score:
            best, best_score = fitted, score
    if best is None:
        return None
    vector, covariance = best
    return _describe(vector, points, weights, noise_m, float(np.sqrt(covariance[2, 2])))


def _mixture_circle(
    points: np.ndarray, weights: np.ndarray, start: np.ndarray, noise_m: float, area: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """Bark or clutter: expectation-maximisation of :func:`ring_score`'s model from ``start``, noise shrinking to
    ``noise_m``. ``(x, y, r)`` and (3, 3) covariance; ``None`` if it runs away."""
    done, vector, covariance = mixture_fit(
        np.ascontiguousarray(points), np.asarray(weights, float), np.asarray(start, float), noise_m, area
    )
    return (vector, covariance) if done else None
