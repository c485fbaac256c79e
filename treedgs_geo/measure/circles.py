"""Circles through stem slices: the published solid-circle RANSAC, and ring fits for points that lie on bark.

All functions take (N, 2) metres. Degenerate input (fewer than three distinct points, collinear points, NaN) is refused:
``fit_circle`` returns ``None``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit, prange

_SECTORS = 24
_FOR_LEVEL = 36
#: Density of stray points inside a ring of bark over that outside.
INSIDE_SHARE = 0.3


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


def fit_circle(points: np.ndarray, weights: np.ndarray | None = None, method: str = "ring",
               solid: SolidCircle | None = None, noise_m: float = 0.01, seed: int = 0) -> CircleFit | None:
    """One circle.

    method: ``paper`` = weighted solid-circle RANSAC (eq:weighted_score); ``ring`` = consensus over arcs, then a robust
    geometric fit with bark noise about ``noise_m``; ``hyper`` = the algebraic Hyper fit, for clean arcs.
    """
    points = np.asarray(points, float).reshape(-1, 2)
    weights = np.ones(len(points)) if weights is None else np.asarray(weights, float)
    if not _usable(points, weights):
        return None
    if method == "paper":
        found = fit_solid_circles([points], [weights], solid or SolidCircle(), seed)[0]
        return None if not np.isfinite(found[2]) else _describe(found, points, weights, 2 * noise_m, np.nan)
    if method == "hyper":
        vector = hyper_circle(points, weights)
        return None if vector is None else _describe(vector, points, weights, 2 * noise_m, np.nan)
    if method != "ring":
        raise ValueError(f"method {method!r}: expected ring, paper or hyper")
    return _ring(points, weights, noise_m, seed)


def fit_solid_circles(slices: Sequence[np.ndarray], weights: Sequence[np.ndarray], solid: SolidCircle,
                      seed: int = 0) -> np.ndarray:
    """Weighted solid-circle RANSAC in many slices at once: (S, 3) x, y, r; NaN where no hypothesis is valid.

    Exactly the four steps of sec:dbh_weighted: three indices drawn without replacement with probability proportional to
    weight; the circle through them; inliers inside the disc, hypotheses with an abnormal radius or fewer than
    ``least_inliers`` of the points dropped; the largest (inlier weight) / r**power wins. Seeded per slice.
    """
    thinned, kept = [], []
    for number, (points, weight) in enumerate(zip(slices, weights, strict=True)):
        if len(points) > solid.most_points:
            pick = np.sort(np.random.default_rng(seed + number).choice(len(points), solid.most_points, replace=False))
            points, weight = points[pick], weight[pick]
        thinned.append(np.ascontiguousarray(points, float))
        kept.append(np.ascontiguousarray(weight, float))
    if not thinned:
        return np.empty((0, 3))
    starts = np.concatenate([[0], np.cumsum([len(points) for points in thinned])]).astype(np.int64)
    return _solid_batch(np.concatenate(thinned), np.concatenate(kept), starts, solid.power, solid.hypotheses,
                        solid.least_inliers, solid.r_min_m, solid.r_max_m, np.uint64(seed))


def hyper_circle(points: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray | None:
    """(3,) x, y, r by the Hyper fit (Al-Sharadqah & Chernov 2009): no essential bias. ``None`` if degenerate."""
    weights = np.ones(len(points)) if weights is None else weights
    total = weights.sum()
    mean = (weights[:, None] * points).sum(axis=0) / total
    centred = points - mean
    scale = np.sqrt((weights * (centred ** 2).sum(axis=1)).sum() / total)
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


def geometric_circle(points: np.ndarray, weights: np.ndarray, start: np.ndarray, noise_m: float,
                     rounds: int = 30) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Robust geometric fit: ``(x, y, r)``, (3, 3) covariance, (N,) robust weights; ``None`` if it runs away."""
    vector = np.asarray(start, float).copy()
    for scale in (4 * noise_m, 2.5 * noise_m):
        for _ in range(rounds):
            offset = points - vector[:2]
            distance = np.maximum(np.hypot(offset[:, 0], offset[:, 1]), 1e-9)
            residual = distance - vector[2]
            robust = (scale * scale / (scale * scale + residual * residual)) ** 2
            robust[np.abs(residual) > 4 * scale] = 0.0
            w = weights * robust
            jacobian = np.column_stack([-offset / distance[:, None], -np.ones(len(points))])
            normal = (jacobian * w[:, None]).T @ jacobian + 1e-12 * np.eye(3)
            step = np.linalg.solve(normal, -(jacobian * w[:, None]).T @ residual)
            largest = np.abs(step).max()
            vector = vector + step * min(1.0, 0.1 / max(largest, 1e-12))
            if not np.isfinite(vector).all() or vector[2] <= 0 or vector[2] > 5:
                return None
            if largest < 1e-7:
                break
    variance = (w * residual * residual).sum() / max(w.sum() * (1 - 3 / max(robust.sum(), 4)), 1e-12)
    # Weights are relative: the covariance uses their effective number, not their sum.
    effective = w / max(weights[robust > 0].mean(), 1e-12) if (robust > 0).any() else w
    covariance = max(variance, 1e-10) * np.linalg.pinv((jacobian * effective[:, None]).T @ jacobian)
    return vector, covariance, robust


def covered_arc_deg(points: np.ndarray, x: float, y: float, r: float, tolerance_m: float) -> float:
    """Circumference with points within ``tolerance_m`` of the ring, in 15 degree sectors."""
    offset = points - (x, y)
    near = np.abs(np.hypot(offset[:, 0], offset[:, 1]) - r) < tolerance_m
    sector = np.floor((np.arctan2(offset[near, 1], offset[near, 0]) + np.pi) / (2 * np.pi) * _SECTORS).astype(int)
    return 360.0 / _SECTORS * len(np.unique(sector % _SECTORS))


def _usable(points: np.ndarray, weights: np.ndarray) -> bool:
    if len(points) < 3 or not np.isfinite(points).all() or not np.isfinite(weights).all():
        return False
    if (weights < 0).any() or (weights > 0).sum() < 3:
        return False
    distinct = np.unique(points[weights > 0], axis=0)
    if len(distinct) < 3:
        return False
    spread = np.linalg.svd(distinct - distinct.mean(axis=0), compute_uv=False)
    return bool(spread[1] > 1e-9 * max(spread[0], 1e-12) and spread[1] > 1e-9)


def _describe(vector: np.ndarray, points: np.ndarray, weights: np.ndarray, tolerance_m: float,
              sd_r: float) -> CircleFit:
    x, y, r = (float(value) for value in vector)
    residual = np.hypot(points[:, 0] - x, points[:, 1] - y) - r
    on = np.abs(residual) < max(3 * tolerance_m, 1e-9)
    rms = float(np.sqrt(np.average(residual[on] ** 2, weights=weights[on]))) if weights[on].sum() > 0 else float("nan")
    inside = float(weights[residual < -2 * tolerance_m].sum() / weights.sum())
    arc = covered_arc_deg(points, x, y, r, 2 * tolerance_m)
    return CircleFit(x, y, r, float(sd_r), arc, inside, rms, int(on.sum()))


def _ring(points: np.ndarray, weights: np.ndarray, noise_m: float, seed: int) -> CircleFit | None:
    starts = []
    algebraic = hyper_circle(points, weights)
    if algebraic is not None:
        starts.append(algebraic)
    low, high = np.percentile(points, [1, 99], axis=0)
    area = float(np.prod(np.maximum(high - low, 4 * noise_m)))
    consensus = _ring_consensus(np.ascontiguousarray(points), np.ascontiguousarray(weights), 600, noise_m, area, 0.01,
                                1.5, np.uint64(seed))
    if np.isfinite(consensus[2]):
        starts.append(consensus)
    best, best_score = None, -np.inf
    for start in starts:
        fitted = _mixture_circle(points, weights, start, noise_m, area)
        if fitted is None:
            continue
        score = _ring_score(points, weights, *fitted[0], noise_m, area)
        if score > best_score:
            best, best_score = fitted, score
    if best is None:
        return None
    vector, covariance = best
    return _describe(vector, points, weights, noise_m, float(np.sqrt(covariance[2, 2])))


def _mixture_circle(points: np.ndarray, weights: np.ndarray, start: np.ndarray, noise_m: float,
                    area: float) -> tuple[np.ndarray, np.ndarray] | None:
    """Bark or clutter: expectation-maximisation of :func:`_ring_score`'s model from ``start``, noise shrinking to
    ``noise_m``. ``(x, y, r)`` and (3, 3) covariance; ``None`` if it runs away."""
    vector = np.asarray(start, float).copy()
    noise, share = 2.0 * noise_m, 0.7
    for _ in range(80):
        offset = points - vector[:2]
        distance = np.maximum(np.hypot(offset[:, 0], offset[:, 1]), 1e-9)
        residual = distance - vector[2]
        bark = np.exp(-0.5 * (residual / noise) ** 2) / (noise * 2.5066 * 2 * np.pi * max(vector[2], 0.01))
        # The same odds on both sides, or the ring would be pulled to one of them.
        posterior = share * bark / (share * bark + (1.0 - share) / area)
        share = float(np.clip(np.average(posterior, weights=weights), 0.3, 0.995))
        w = weights * posterior
        jacobian = np.column_stack([-offset / distance[:, None], -np.ones(len(points))])
        normal = (jacobian * w[:, None]).T @ jacobian + 1e-12 * np.eye(3)
        step = np.linalg.solve(normal, -(jacobian * w[:, None]).T @ residual)
        largest = np.abs(step).max()
        vector = vector + step * min(1.0, 0.05 / max(largest, 1e-12))
        if not np.isfinite(vector).all() or vector[2] <= 0 or vector[2] > 5:
            return None
        if noise == noise_m and largest < 1e-7:
            break
        noise = max(noise_m, 0.8 * noise)
    total = posterior.sum()
    if total < 3:
        return None
    variance = max(float((w * residual**2).sum() / w.sum()) * total / max(total - 3, 1.0), 1e-10)
    effective = posterior * weights / max(float(np.average(weights, weights=posterior)), 1e-12)
    return vector, variance * np.linalg.pinv((jacobian * effective[:, None]).T @ jacobian)


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


def fit_ellipse(points: np.ndarray, weights: np.ndarray | None = None, noise_m: float = 0.01) -> EllipseFit | None:
    """A robust geometric ellipse through points on bark, started at the ring; ``None`` without a ring, with less than
    240 degrees of bark (an arc does not tell an ellipse) or with axes further apart than 2 : 1.

    Residuals are radial distances; a corrected AIC compares it with the circle, each sector counting once.
    """
    points = np.asarray(points, float).reshape(-1, 2)
    weights = np.ones(len(points)) if weights is None else np.asarray(weights, float)
    ring = fit_circle(points, weights, "ring", noise_m=max(noise_m, 0.004))
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


@njit(cache=True)
def _next(state):  # pragma: no cover - compiled
    """splitmix64: the same stream whatever the number of threads."""
    state = state + np.uint64(0x9E3779B97F4A7C15)
    z = state
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return state, np.float64(z >> np.uint64(11)) / 9007199254740992.0


@njit(cache=True)
def _three(cumulative, state):  # pragma: no cover - compiled
    """Three distinct indices, probability proportional to weight; -1 when the draw keeps repeating."""
    n = cumulative.shape[0]
    picked = np.full(3, -1, np.int64)
    count = 0
    for _ in range(60):
        state, u = _next(state)
        k = min(np.searchsorted(cumulative, u * cumulative[n - 1], side="right"), n - 1)
        fresh = True
        for j in range(count):
            if picked[j] == k:
                fresh = False
        if fresh:
            picked[count] = k
            count += 1
            if count == 3:
                break
    return state, picked


@njit(cache=True)
def _through(p, i, j, k):  # pragma: no cover - compiled
    """Centre and squared radius of the circle through three points (x2 + y2 + a x + b y + d = 0)."""
    x1, y1, x2, y2, x3, y3 = p[i, 0], p[i, 1], p[j, 0], p[j, 1], p[k, 0], p[k, 1]
    det = (x2 - x1) * (y3 - y1) - (x3 - x1) * (y2 - y1)
    if abs(det) < 1e-14:
        return 0.0, 0.0, -1.0
    s2 = (x2 * x2 + y2 * y2) - (x1 * x1 + y1 * y1)
    s3 = (x3 * x3 + y3 * y3) - (x1 * x1 + y1 * y1)
    cx = (s2 * (y3 - y1) - s3 * (y2 - y1)) / (2 * det)
    cy = (s3 * (x2 - x1) - s2 * (x3 - x1)) / (2 * det)
    return cx, cy, (x1 - cx) ** 2 + (y1 - cy) ** 2


@njit(cache=True, fastmath=True)
def _mass_inside(x, y, w, cx, cy, limit):  # pragma: no cover - compiled
    """Weight and number of the points within a squared distance; branch-free, so that it becomes vector code."""
    mass = np.float32(0.0)
    count = np.float32(0.0)
    for m in range(x.shape[0]):
        dx, dy = x[m] - cx, y[m] - cy
        inside = np.float32(1.0) if dx * dx + dy * dy <= limit else np.float32(0.0)
        mass += inside * w[m]
        count += inside
    return mass, count


@njit(cache=True, parallel=True)
def _solid_batch(points, weights, starts, power, hypotheses, least, r_min, r_max, seed):  # pragma: no cover - compiled
    slices = starts.shape[0] - 1
    out = np.full((slices, 3), np.nan)
    for s in prange(slices):
        low, high = starts[s], starts[s + 1]
        n = high - low
        if n < 3:
            continue
        mx, my = points[low:high, 0].mean(), points[low:high, 1].mean()
        q = np.empty((n, 2))
        q[:, 0] = points[low:high, 0] - mx
        q[:, 1] = points[low:high, 1] - my
        w = weights[low:high]
        cumulative = np.cumsum(w)
        total = cumulative[n - 1]
        if not total > 0:
            continue
        # Counting in single precision: about the slice's mean that is a ten-thousandth of a millimetre.
        x, y, mass_of = q[:, 0].astype(np.float32), q[:, 1].astype(np.float32), (w / total).astype(np.float32)
        state = seed * np.uint64(1000003) + np.uint64(s)
        best = -1.0
        for _ in range(hypotheses):
            state, pick = _three(cumulative, state)
            if pick[2] < 0:
                continue
            cx, cy, r2 = _through(q, pick[0], pick[1], pick[2])
            if r2 < r_min * r_min or r2 > r_max * r_max:
                continue
            # No disc holds more than everything: wide ones that could not win even so are not counted.
            worth = r2 ** (-0.5 * power)
            if worth <= best:
                continue
            # The three points lie on the circle: a hair of slack keeps them inside.
            mass, count = _mass_inside(x, y, mass_of, np.float32(cx), np.float32(cy), np.float32(r2 * (1 + 1e-5)))
            if count < least * n:
                continue
            score = mass * worth
            if score > best:
                best = score
                out[s, 0] = cx + mx
                out[s, 1] = cy + my
                out[s, 2] = np.sqrt(r2)
    return out


@njit(cache=True)
def _ring_score(points, weights, x, y, r, noise, area):  # pragma: no cover - compiled
    """Mean log likelihood ratio of "bark around a ring, clutter elsewhere" to "clutter everywhere".

    Bark spreads over the circumference, so that a wide ring has to hold more points to win; clutter is uniform, and
    rarer inside (bark is opaque). Each sector counts once more with what it holds at best: covered angle matters.
    """
    best = np.zeros(_FOR_LEVEL)
    total = 0.0
    mass = 0.0
    peak = area / (noise * 2.5066 * 2 * np.pi * max(r, 0.01))
    for m in range(points.shape[0]):
        dx, dy = points[m, 0] - x, points[m, 1] - y
        e = np.sqrt(dx * dx + dy * dy) - r
        mass += weights[m]
        ratio = 0.7 * peak * np.exp(-0.5 * (e / noise) ** 2) + 0.3 * (INSIDE_SHARE if e < 0 else 1.0)
        value = np.log(ratio)
        total += weights[m] * value
        if abs(e) < 2.5 * noise:
            k = int((np.arctan2(dy, dx) + np.pi) / (2 * np.pi) * _FOR_LEVEL) % _FOR_LEVEL
            best[k] = max(best[k], value)
    return total / max(mass, 1e-12) + 0.5 * best.sum() / _FOR_LEVEL


@njit(cache=True)
def _ring_consensus(points, weights, hypotheses, noise, area, r_min, r_max, seed):  # pragma: no cover - compiled
    n = points.shape[0]
    cumulative = np.cumsum(weights)
    best = -np.inf
    out = np.full(3, np.nan)
    state = seed + np.uint64(77)
    mx, my = points[:, 0].mean(), points[:, 1].mean()
    q = np.empty((n, 2))
    q[:, 0] = points[:, 0] - mx
    q[:, 1] = points[:, 1] - my
    for _ in range(hypotheses):
        state, pick = _three(cumulative, state)
        if pick[2] < 0:
            continue
        cx, cy, r2 = _through(q, pick[0], pick[1], pick[2])
        if r2 < r_min * r_min or r2 > r_max * r_max:
            continue
        score = _ring_score(q, weights, cx, cy, np.sqrt(r2), 1.5 * noise, area)
        if score > best:
            best = score
            out[0] = cx + mx
            out[1] = cy + my
            out[2] = np.sqrt(r2)
    return out
