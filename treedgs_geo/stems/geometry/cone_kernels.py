"""The compiled parts of :mod:`.cone`: robust Gauss-Newton fits of a leaning cone, and distances from its bark."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..quality.priors import USUAL_TAPER

#: Prior sd of d(radius)/d(height) about ``USUAL_TAPER``: points show more of it than photos (research: NSVB
#: profiles).
CONE_TAPER_SD = 0.005
#: Prior sd of the axis slopes; 0.15 is 8.5 degrees, more lean has to be earned by the points.
CONE_LEAN_SD = 0.15
#: Prior sd of the bend where it is free: 3 cm of sweep over the lower 3 m.
BEND_SD = 0.006
#: An axis does not move farther than this once it is fitted coarsely.
_MOVES_M = 0.12
#: Radii that a fit of a candidate is started from, in radii of the candidate, and fits that are one and the same.
STARTS, SAME_M = (1.0, 0.7, 1.4, 0.45), 0.0005


@njit(cache=True, nogil=True)
def fit_vector(
    points, weights, start, h_ref, schedule, floor_m, cap_m, lean_sd, taper_sd, bend_sd, rounds
):  # pragma: no cover - compiled
    """:func:`.cone.fit_cone` without its refusals: vector (8,), its covariance (8, 8) and sigma, -1 where
    it ran away."""
    vector = start.copy()
    powers = 5 if bend_sd > 0 else 3
    if powers == 3:
        vector[6:] = 0.0
    bend = max(bend_sd, 1e-7)
    prior = np.array([0.0, 0.0, 0.0, 0.0, 0.0, USUAL_TAPER, 0.0, 0.0])
    prior_sd = np.array([np.inf, np.inf, lean_sd, lean_sd, np.inf, taper_sd, bend, bend])
    normal = np.zeros((8, 8))
    x, y, t = points[:, 0].copy(), points[:, 1].copy(), points[:, 2] - h_ref
    last = 2.5 * cap_m
    for stage in range(len(schedule)):
        scale = schedule[stage]
        if not _gauss_newton(
            x, y, t, weights, vector, normal, scale, max(scale / 2, floor_m), prior, prior_sd, powers, rounds
        ):
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
    # Held to something very wide, so that what no point shows is unknown and not certain.
    return vector, np.linalg.inv(normal + 1e-6 * np.eye(8)), sigma


@njit(cache=True, nogil=True)
def _noise(residual, floor_m, cap_m):  # pragma: no cover - compiled
    """Spread of the bark points: MAD of what lies within two and a half times the cap."""
    near = np.abs(residual)
    near = near[near < 2.5 * cap_m]
    if near.shape[0] < 6:
        return cap_m
    return min(max(1.4826 * np.median(near), floor_m), cap_m)


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def bark_distances(points, vector, h_ref):  # pragma: no cover - compiled
    """:func:`distance` of (N, 3) points."""
    out = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        out[i] = distance(points[i, 0], points[i, 1], points[i, 2], vector, h_ref)
    return out


@njit(cache=True, nogil=True, fastmath={"contract", "arcp", "nsz"}, error_model="numpy")
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


@njit(cache=True, nogil=True, fastmath={"contract", "arcp", "nsz", "nnan", "reassoc"}, error_model="numpy")
def _straight_sums(x, y, t, weights, vector, scale, moments, pulls):  # pragma: no cover - compiled
    """Fills ``moments`` (6, 3) and ``pulls`` (3, 2) of a step of a straight cone; branch-free, each sum a variable, so
    that it becomes vector code."""
    vx, vy, sx, sy, vr, vt = vector[0], vector[1], vector[2], vector[3], vector[4], vector[5]
    inverse = 1.0 / np.sqrt(1.0 + sx * sx + sy * sy)
    square, reach = scale * scale, 16.0 * scale * scale
    a0, a1, a2, b0, b1, b2, c0, c1, c2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    d0, d1, d2, e0, e1, e2, f0, f1, f2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    p0, p1, q0, q1, r0, r1 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(x.shape[0]):
        ex, ey = x[i] - vx - sx * t[i], y[i] - vy - sy * t[i]
        along = (ex * sx + ey * sy) * inverse
        h = t[i] + along * inverse
        d = np.sqrt(max(ex * ex + ey * ey - along * along, 1e-12))
        e = d - (vr + vt * h)
        per_d = 1.0 / d
        g = square / (square + e * e)
        w = weights[i] * g * g if e * e <= reach else 0.0
        ux, uy = (ex - along * sx * inverse) * per_d, (ey - along * sy * inverse) * per_d
        wx, wy = w * ux, w * uy
        xx, xy, yy = wx * ux, wx * uy, wy * uy
        h2 = h * h
        a0, a1, a2 = a0 + xx, a1 + xx * h, a2 + xx * h2
        b0, b1, b2 = b0 + xy, b1 + xy * h, b2 + xy * h2
        c0, c1, c2 = c0 + yy, c1 + yy * h, c2 + yy * h2
        d0, d1, d2 = d0 + wx, d1 + wx * h, d2 + wx * h2
        e0, e1, e2 = e0 + wy, e1 + wy * h, e2 + wy * h2
        f0, f1, f2 = f0 + w, f1 + w * h, f2 + w * h2
        px, py, pr = wx * e, wy * e, w * e
        p0, p1, q0, q1, r0, r1 = p0 + px, p1 + px * h, q0 + py, q1 + py * h, r0 + pr, r1 + pr * h
    moments[0, 0], moments[0, 1], moments[0, 2] = a0, a1, a2
    moments[1, 0], moments[1, 1], moments[1, 2] = b0, b1, b2
    moments[2, 0], moments[2, 1], moments[2, 2] = c0, c1, c2
    moments[3, 0], moments[3, 1], moments[3, 2] = d0, d1, d2
    moments[4, 0], moments[4, 1], moments[4, 2] = e0, e1, e2
    moments[5, 0], moments[5, 1], moments[5, 2] = f0, f1, f2
    pulls[0, 0], pulls[0, 1], pulls[1, 0], pulls[1, 1], pulls[2, 0], pulls[2, 1] = p0, p1, q0, q1, r0, r1


@njit(cache=True, nogil=True, fastmath={"contract", "arcp", "nsz", "nnan", "reassoc"}, error_model="numpy")
def _bent_sums(x, y, t, weights, vector, scale, moments, pulls):  # pragma: no cover - compiled
    """:func:`_straight_sums` of an axis that bends: (6, 5) and (3, 3). Too many sums for one loop: each pair of
    factors has its own."""
    n = x.shape[0]
    vx, vy, vdx, vdy, vr, vt, vbx, vby = vector
    square, reach = scale * scale, 16.0 * scale * scale
    w, u, v, h, e = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        sx, sy = vdx + vbx * t[i], vdy + vby * t[i]
        inverse = 1.0 / np.sqrt(1.0 + sx * sx + sy * sy)
        ex, ey = x[i] - vx - (vdx + 0.5 * vbx * t[i]) * t[i], y[i] - vy - (vdy + 0.5 * vby * t[i]) * t[i]
        along = (ex * sx + ey * sy) * inverse
        h[i] = t[i] + along * inverse
        d = np.sqrt(max(ex * ex + ey * ey - along * along, 1e-12))
        e[i] = d - (vr + vt * h[i])
        per_d = 1.0 / d
        g = square / (square + e[i] * e[i])
        w[i] = weights[i] * g * g if e[i] * e[i] <= reach else 0.0
        u[i], v[i] = (ex - along * sx * inverse) * per_d, (ey - along * sy * inverse) * per_d
    _powers(w, u, u, h, moments[0])
    _powers(w, u, v, h, moments[1])
    _powers(w, v, v, h, moments[2])
    one = np.ones(n)
    _powers(w, u, one, h, moments[3])
    _powers(w, v, one, h, moments[4])
    _powers(w, one, one, h, moments[5])
    for i in range(n):
        w[i] *= e[i]
    _powers(w, u, one, h, pulls[0])
    _powers(w, v, one, h, pulls[1])
    _powers(w, one, one, h, pulls[2])


@njit(cache=True, nogil=True, fastmath={"contract", "nsz", "nnan", "reassoc"}, error_model="numpy")
def _powers(w, u, v, h, out):  # pragma: no cover - compiled
    """Fills ``out`` (3,) or (5,) with the sums of w u v h^k."""
    s0, s1, s2, s3, s4 = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(w.shape[0]):
        a = w[i] * u[i] * v[i]
        b = h[i] * h[i]
        s0, s1, s2, s3, s4 = s0 + a, s1 + a * h[i], s2 + a * b, s3 + a * b * h[i], s4 + a * b * b
    out[0], out[1], out[2] = s0, s1, s2
    if out.shape[0] == 5:
        out[3], out[4] = s3, s4


@njit(cache=True, nogil=True)
def _gauss_newton(
    x, y, t, weights, vector, normal, scale, sigma, prior, prior_sd, powers, rounds
):  # pragma: no cover - compiled
    """Re-weighted steps of ``vector`` in place; ``normal`` is that of the last step. False where the fit ran away.

    A residual changes by (ux, uy, 1) h^k (k = 0, 1; with a bend 2 for ux, uy), so the normal matrix is made of the
    moments of these three, multiplied two by two, with powers of h. powers: 3 (the axis stays straight) or 5."""
    known = 6 if powers == 3 else 8
    right, step = np.zeros(8), np.zeros(8)
    damped = np.empty((8, 8))
    moments, pulls = np.zeros((6, 5)), np.zeros((3, 3))
    # Of each unknown: which of the three, the power of h, and its factor.
    which, power = (0, 1, 0, 1, 2, 2, 0, 1), (0, 0, 1, 1, 0, 1, 2, 2)
    factor = (-1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -0.5, -0.5)
    pair = ((0, 1, 3), (1, 2, 4), (3, 4, 5))
    for _ in range(rounds):
        if powers == 3:
            _straight_sums(x, y, t, weights, vector, scale, moments, pulls)
        else:
            _bent_sums(x, y, t, weights, vector, scale, moments, pulls)
        normal[:] = 0.0
        right[:] = 0.0
        for a in range(known):
            right[a] = -factor[a] * pulls[which[a], power[a]] / (sigma * sigma)
            for b in range(known):
                normal[a, b] = (
                    factor[a] * factor[b] * moments[pair[which[a]][which[b]], power[a] + power[b]] / (sigma * sigma)
                )
        for a in range(8):
            if np.isfinite(prior_sd[a]):
                normal[a, a] += 1.0 / prior_sd[a] ** 2
                right[a] -= (vector[a] - prior[a]) / prior_sd[a] ** 2
        damped[:] = normal
        for a in range(8):
            damped[a, a] += 1e-3 * normal[a, a] + 1e-6
        # A straight axis has no bend to solve for: it is zero, and so is what draws it there.
        if not cholesky_solve(damped[:known, :known], right[:known], step[:known]):
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
    return 0.01 < vector[4] <= 2.5 and vector[2] ** 2 + vector[3] ** 2 <= 0.49


@njit(cache=True, nogil=True)
def cholesky_solve(matrix, right, out):  # pragma: no cover - compiled
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


@njit(cache=True, nogil=True)
def grow(
    points, weights, place, h, radius, layer_m, floor_m, cap_m, layer_lean_sd, steepest, rounds
):  # pragma: no cover - compiled
    """Cones from a candidate at (2,) ``place``: fitted to the layer within ``layer_m`` of height ``h`` from several
    radii, then to all (N, 3) points. Those that hold: (K, 8) vectors, (K, 8, 8) covariances, (K,) sigmas."""
    vectors, covariances, sigmas = np.empty((4, 8)), np.empty((4, 8, 8)), np.empty(4)
    near = np.abs(points[:, 2] - h) < layer_m
    layer, weight = points[near], weights[near]
    starts = np.empty((4, 8))
    known, count = 0, 0
    if layer.shape[0] < 6:
        return vectors[:0], covariances[:0], sigmas[:0]
    start = np.zeros(8)
    for factor in STARTS:
        start[:] = 0.0
        start[0], start[1], start[4], start[5] = place[0], place[1], radius * factor, USUAL_TAPER
        coarse = min(0.05, 0.5 * start[4])
        vector, _, sigma = fit_vector(
            layer,
            weight,
            start,
            h,
            np.array([coarse, 0.6 * coarse]),
            floor_m,
            cap_m,
            layer_lean_sd,
            CONE_TAPER_SD,
            0.0,
            rounds,
        )
        if not sigma > 0:
            continue
        fresh = True
        for k in range(known):
            fresh = fresh and not np.max(np.abs(vector - starts[k])) < SAME_M
        if not fresh:
            continue
        starts[known] = vector
        known += 1
        vector, covariance, sigma = fit_vector(
            points,
            weights,
            vector,
            h,
            np.array([1.2 * coarse, 0.7 * coarse]),
            floor_m,
            cap_m,
            CONE_LEAN_SD,
            CONE_TAPER_SD,
            0.0,
            rounds,
        )
        if not sigma > 0 or np.hypot(vector[2], vector[3]) > steepest:
            continue
        if np.hypot(vector[0] - place[0], vector[1] - place[1]) > 0.25 + 0.5 * radius:
            continue
        vectors[count], covariances[count], sigmas[count] = vector, covariance, sigma
        count += 1
    return vectors[:count], covariances[:count], sigmas[:count]
