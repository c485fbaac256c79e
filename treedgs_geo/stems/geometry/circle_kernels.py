"""The compiled parts of :mod:`.circles`: hypotheses drawn and counted, seeded per slice whatever the threads."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from .cone_kernels import cholesky_solve

_FOR_LEVEL = 36
#: Density of stray points inside a ring of bark over that outside.
INSIDE_SHARE = 0.3


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
def solid_batch(points, weights, starts, power, hypotheses, least, r_min, r_max, seeds):  # pragma: no cover - compiled
    """(S, 3) best solid circle of every slice, NaN where none was drawn; starts: (S + 1,) first point of each."""
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
        state = seeds[s]
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
def ring_score(points, weights, x, y, r, noise, area):  # pragma: no cover - compiled
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
def ring_consensus(points, weights, hypotheses, noise, area, r_min, r_max, seed):  # pragma: no cover - compiled
    """(3,) ring through three of the points with the best :func:`ring_score`; NaN where none was found."""
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
        score = ring_score(q, weights, cx, cy, np.sqrt(r2), 1.5 * noise, area)
        if score > best:
            best = score
            out[0] = cx + mx
            out[1] = cy + my
            out[2] = np.sqrt(r2)
    return out


@njit(cache=True)
def _normal(points, vector, residual, w, normal, right):  # pragma: no cover - compiled
    """Normal matrix (3, 3) and right side of a step of x, y, r."""
    normal[:] = 0.0
    right[:] = 0.0
    for m in range(points.shape[0]):
        d = residual[m] + vector[2]
        ux, uy = (vector[0] - points[m, 0]) / d, (vector[1] - points[m, 1]) / d
        normal[0, 0] += w[m] * ux * ux
        normal[1, 0] += w[m] * ux * uy
        normal[1, 1] += w[m] * uy * uy
        normal[2, 0] -= w[m] * ux
        normal[2, 1] -= w[m] * uy
        normal[2, 2] += w[m]
        right[0] -= w[m] * ux * residual[m]
        right[1] -= w[m] * uy * residual[m]
        right[2] += w[m] * residual[m]
    normal[0, 1], normal[0, 2], normal[1, 2] = normal[1, 0], normal[2, 0], normal[2, 1]


@njit(cache=True)
def _step(normal, right, vector, longest):  # pragma: no cover - compiled
    """Moves ``vector`` by at most ``longest``; the length it wanted, or -1 where the circle ran away."""
    step = np.zeros(3)
    if not cholesky_solve(normal + 1e-12 * np.eye(3), right, step):
        return -1.0
    largest = np.abs(step).max()
    vector += step * min(1.0, longest / max(largest, 1e-12))
    if not np.isfinite(vector).all() or vector[2] <= 0 or vector[2] > 5:
        return -1.0
    return largest


@njit(cache=True)
def _residual(points, vector, out):  # pragma: no cover - compiled
    for m in range(points.shape[0]):
        dx, dy = points[m, 0] - vector[0], points[m, 1] - vector[1]
        out[m] = max(np.sqrt(dx * dx + dy * dy), 1e-9) - vector[2]


@njit(cache=True)
def geometric_fit(points, weights, start, noise, rounds):  # pragma: no cover - compiled
    """Robust geometric fit of a circle: whether it held, (3,) x, y, r, (3, 3) covariance, (N,) robust weights."""
    n = points.shape[0]
    vector = start.copy()
    residual, robust, w = np.empty(n), np.empty(n), np.empty(n)
    normal, right = np.zeros((3, 3)), np.zeros(3)
    for scale in (4 * noise, 2.5 * noise):
        for _ in range(rounds):
            _residual(points, vector, residual)
            for m in range(n):
                share = scale * scale / (scale * scale + residual[m] * residual[m])
                robust[m] = share * share if abs(residual[m]) <= 4 * scale else 0.0
                w[m] = weights[m] * robust[m]
            _normal(points, vector, residual, w, normal, right)
            largest = _step(normal, right, vector, 0.1)
            if largest < 0:
                return False, vector, normal, robust
            if largest < 1e-7:
                break
    variance = (w * residual * residual).sum() / max(w.sum() * (1 - 3 / max(robust.sum(), 4.0)), 1e-12)
    # Weights are relative: the covariance uses their effective number, not their sum.
    if (robust > 0).any():
        normal /= max(weights[robust > 0].mean(), 1e-12)
    return True, vector, max(variance, 1e-10) * np.linalg.pinv(normal), robust


@njit(cache=True)
def mixture_fit(points, weights, start, noise_m, area):  # pragma: no cover - compiled
    """:func:`.circles._mixture_circle`: whether it held, (3,), (3, 3)."""
    n = points.shape[0]
    vector = start.copy()
    residual, posterior = np.empty(n), np.empty(n)
    normal, right = np.zeros((3, 3)), np.zeros(3)
    noise, share = 2.0 * noise_m, 0.7
    for _ in range(80):
        _residual(points, vector, residual)
        peak = share / (noise * 2.5066 * 2 * np.pi * max(vector[2], 0.01))
        # The same odds on both sides, or the ring would be pulled to one of them.
        for m in range(n):
            bark = peak * np.exp(-0.5 * (residual[m] / noise) ** 2)
            posterior[m] = bark / (bark + (1.0 - share) / area)
        w = weights * posterior
        share = min(max(w.sum() / max(weights.sum(), 1e-300), 0.3), 0.995)
        _normal(points, vector, residual, w, normal, right)
        largest = _step(normal, right, vector, 0.05)
        if largest < 0:
            return False, vector, normal
        if noise == noise_m and largest < 1e-7:
            break
        noise = max(noise_m, 0.8 * noise)
    total = posterior.sum()
    if total < 3:
        return False, vector, normal
    variance = max((w * residual * residual).sum() / w.sum() * total / max(total - 3, 1.0), 1e-10)
    return True, vector, variance * np.linalg.pinv(normal / max(w.sum() / total, 1e-12))
