"""The compiled parts of :mod:`.circles`: hypotheses drawn and counted, seeded per slice whatever the threads."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

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
