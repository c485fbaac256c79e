"""The compiled parts of the fits of stems to their bark: points about a cone, slices, an ellipse (:mod:`.ellipse`)."""

from __future__ import annotations

import numpy as np
from numba import njit

from .circle_kernels import geometric_fit
from .cone_kernels import cholesky_solve, distance

SECTORS = 24
#: Height of the rows that bark is counted in, and of those that its purity is counted in, m; the latter's number.
CELL_M, PURITY_M, _ROWS = 0.10, 0.25, 64


@njit(cache=True, nogil=True)
def _sector(dx, dy):  # pragma: no cover - compiled
    return int(np.floor((np.arctan2(dy, dx) + np.pi) / (2 * np.pi) * SECTORS)) % SECTORS


@njit(cache=True, nogil=True)
def sector_about(point, vector, h_ref):  # pragma: no cover - compiled
    """Sector of a point (3,) about the axis of a cone's ``vector``."""
    t = point[2] - h_ref
    return _sector(
        point[0] - vector[0] - (vector[2] + 0.5 * vector[6] * t) * t,
        point[1] - vector[1] - (vector[3] + 0.5 * vector[7] * t) * t,
    )


@njit(cache=True, nogil=True)
def lobes(points, vector, h_ref, sigma):  # pragma: no cover - compiled
    """Amplitude of the 2nd to 4th harmonics of the section of (N, 3) points about a cone's ``vector``, whose noise is
    ``sigma``, over its radius: 0 = circle, > 0.1 = buttresses."""
    count, mean = np.zeros(SECTORS), np.zeros(SECTORS)
    for m in range(points.shape[0]):
        k = sector_about(points[m], vector, h_ref)
        count[k] += 1
        mean[k] += distance(points[m, 0], points[m, 1], points[m, 2], vector, h_ref)
    filled = np.flatnonzero(count)
    if len(points) < 40 or len(filled) < 16:
        return 0.0
    normal, right = np.zeros((9, 9)), np.zeros(9)
    # Sector means are noisy where points are few: shrink by their noise.
    for k in range(1, 9):
        normal[k, k] = 1 / (0.03 * vector[4]) ** 2
    basis, solution = np.ones(9), np.empty(9)
    for k in filled:
        middle = (k + 0.5) / SECTORS * 2 * np.pi - np.pi
        for wave in range(1, 5):
            basis[2 * wave - 1], basis[2 * wave] = np.cos(wave * middle), np.sin(wave * middle)
        weight = 1 / (sigma**2 / count[k] + 1e-8)
        for a in range(9):
            right[a] += weight * basis[a] * mean[k] / count[k]
            for b in range(9):
                normal[a, b] += weight * basis[a] * basis[b]
    cholesky_solve(normal, right, solution)
    return np.sqrt(np.sum(solution[3:] ** 2)) / vector[4]


@njit(cache=True, nogil=True)
def bark_weights(points, others, vector, h_ref, sigma, floor_m, roundness):  # pragma: no cover - compiled
    """(N,) weights that keep a dense side from pulling an uneven stem, noise^2 / (noise^2 + n_sector shape^2), and (N,)
    share of each point's row that is bark: (density on it - density just outside) / density on it.

    others: (M, 3) points that count as outside, where they lie there."""
    n = points.shape[0]
    tolerance = max(3 * sigma, 0.02)
    sector, row = np.empty(n, np.int64), np.empty(n, np.int64)
    count, on, off = np.zeros(SECTORS), np.zeros(_ROWS), np.zeros(_ROWS)
    for m in range(n):
        e = distance(points[m, 0], points[m, 1], points[m, 2], vector, h_ref)
        sector[m] = sector_about(points[m], vector, h_ref)
        row[m] = min(max(int(np.floor(points[m, 2] / PURITY_M)), 0), _ROWS - 1)
        if abs(e) < tolerance:
            count[sector[m]] += 1
            on[row[m]] += 1
        elif tolerance <= e < tolerance + 0.10:
            off[row[m]] += 1
    for m in range(others.shape[0]):
        e = distance(others[m, 0], others[m, 1], others[m, 2], vector, h_ref)
        if tolerance <= e < tolerance + 0.10:
            off[min(max(int(np.floor(others[m, 2] / PURITY_M)), 0), _ROWS - 1)] += 1
    noise, shape = max(sigma, floor_m) ** 2, (roundness * vector[4]) ** 2
    balance, purity = np.empty(n), np.empty(n)
    for m in range(n):
        balance[m] = noise / (noise + count[sector[m]] * shape)
        bark, stray = on[row[m]] / (2 * tolerance), off[row[m]] / 0.10
        purity[m] = min(max(max(bark - stray, 0.05 * bark + 1e-6) / (bark + 1e-6), 0.05), 1.0)
    return balance, purity


@njit(cache=True, nogil=True)
def bark_cells(points, on, vector, h_ref):  # pragma: no cover - compiled
    """How many cells (row of 10 cm x sector) hold one of the (N, 3) points that ``on`` (N,) marks."""
    low, high = 1 << 30, -(1 << 30)
    for m in range(points.shape[0]):
        if on[m]:
            row = int(np.floor(points[m, 2] / CELL_M))
            low, high = min(low, row), max(high, row)
    if high < low:
        return 0
    seen = np.zeros((high - low + 1, SECTORS), np.bool_)
    for m in range(points.shape[0]):
        if on[m]:
            seen[int(np.floor(points[m, 2] / CELL_M)) - low, sector_about(points[m], vector, h_ref)] = True
    return seen.sum()


@njit(cache=True, nogil=True)
def near_bark(points, vector, h_ref, half_m, reach_m):  # pragma: no cover - compiled
    """Indices of the (N, 3) points within ``half_m`` of the height ``h_ref`` and ``reach_m`` of the bark."""
    found = np.empty(points.shape[0], np.int64)
    count = 0
    for m in range(points.shape[0]):
        if (
            abs(points[m, 2] - h_ref) < half_m
            and abs(distance(points[m, 0], points[m, 1], points[m, 2], vector, h_ref)) < reach_m
        ):
            found[count] = m
            count += 1
    return found[:count]


@njit(cache=True, nogil=True)
def slice_rows(
    flat, heights, weights, centres, thickness, radius, taper, h_ref, noise, floor
):  # pragma: no cover - compiled
    """(S, 5) height, diameter cm, its standard error cm, arc deg, 1 if the centre was free, of slices about an axis.

    flat: (N, 2) across the axis, in ascending (N,) heights. A slice's own taper is taken out, so that thick slices are
    as sharp as thin ones. noise, floor: of the ring with a free centre, and the least of the spread without."""
    rows = np.empty((centres.shape[0], 5))
    count = 0
    low = np.searchsorted(heights, centres - thickness / 2 - 1e-12, side="left")
    high = np.searchsorted(heights, centres + thickness / 2 + 1e-12, side="right")
    for s in range(centres.shape[0]):
        n = high[s] - low[s]
        if n < 8:
            continue
        here, away, sector = np.empty((n, 2)), np.empty(n), np.empty(n, np.int64)
        filled = np.zeros(SECTORS)
        expected = radius + taper * (centres[s] - h_ref)
        for k in range(n):
            m = low[s] + k
            stretch = expected / max(radius + taper * (heights[m] - h_ref), 1e-3)
            here[k, 0], here[k, 1] = flat[m, 0] * stretch, flat[m, 1] * stretch
            away[k] = np.hypot(flat[m, 0], flat[m, 1]) * stretch
            sector[k] = _sector(here[k, 0], here[k, 1])
            filled[sector[k]] += 1
        arc = 360.0 / SECTORS * np.count_nonzero(filled)
        if arc >= 240 and n >= 30:
            weight = np.empty(n)
            for k in range(n):
                weight[k] = weights[low[s] + k] / filled[sector[k]]
            held, circle, covariance, _ = geometric_fit(here, weight, np.array([0.0, 0.0, expected]), noise, 30)
            if held and np.hypot(circle[0], circle[1]) < 0.05:
                rows[count] = centres[s], 200 * circle[2], 200 * np.sqrt(covariance[2, 2]), arc, 1.0
                count += 1
                continue
        if arc >= 90:
            middle = np.median(away)
            spread = 1.4826 * np.median(np.abs(away - middle))
            error = 1.25 * max(spread, floor) / np.sqrt(n) * (360 / arc)
            rows[count] = centres[s], 200 * middle, 200 * error, arc, 0.0
            count += 1
    return rows[:count].copy()


@njit(cache=True, nogil=True)
def ellipse(points, weights, x, y, r, noise):  # pragma: no cover - compiled
    """:func:`.ellipse.fit_ellipse` from a ring: whether it held, (5,) x, y, mean radius and its second harmonic, and
    (4,) mean squares of the circle's and of the ellipse's residuals over sectors, their noise, the sectors filled."""
    n = points.shape[0]
    scale = max(4 * noise, 0.15 * r)
    # r(t) = r0 + c1 cos t + s1 sin t (centre) + c2 cos 2t + s2 sin 2t (an ellipse to first order), then refined.
    vector = np.array([x, y, r, 0.0, 0.0])
    residual, robust = np.empty(n), np.empty(n)
    cosine, sine = np.empty(n), np.empty(n)
    normal, right, step, basis = np.empty((5, 5)), np.empty(5), np.empty(5), np.empty(5)
    sums = np.zeros(4)
    for _ in range(25):
        swing = np.hypot(vector[3], vector[4])
        a, b, turn = vector[2] + swing, vector[2] - swing, 0.5 * np.arctan2(vector[4], vector[3])
        ct, st = np.cos(turn), np.sin(turn)
        normal[:] = 0.0
        right[:] = 0.0
        for m in range(n):
            dx, dy = points[m, 0] - vector[0], points[m, 1] - vector[1]
            d = np.sqrt(dx * dx + dy * dy)
            c, s = (dx / d, dy / d) if d > 0 else (1.0, 0.0)
            cosine[m], sine[m] = c, s
            along, across = b * (c * ct + s * st), a * (s * ct - c * st)
            e = d - a * b / np.sqrt(along * along + across * across)
            residual[m] = e
            share = scale * scale / (scale * scale + e * e)
            robust[m] = share * share
            w = weights[m] * robust[m]
            basis[0], basis[1], basis[2], basis[3], basis[4] = c, s, 1.0, c * c - s * s, 2 * c * s
            for i in range(5):
                wi = w * basis[i]
                right[i] += wi * e
                for j in range(i + 1):
                    normal[i, j] += wi * basis[j]
        for i in range(5):
            normal[i, i] += 1e-12
        if not cholesky_solve(normal, right, step):
            return False, vector, sums
        vector += step
        scale = max(0.7 * scale, 2.5 * noise)
        if np.max(np.abs(step)) < 1e-8 and scale == 2.5 * noise:
            break
    if not np.isfinite(vector).all():
        return False, vector, sums
    # Over sector means, whose spread holds the shape and not only the noise of single points.
    count, of_circle, of_ellipse = np.zeros(SECTORS), np.zeros(SECTORS), np.zeros(SECTORS)
    for m in range(n):
        if robust[m] > 0.25:
            k = _sector(cosine[m], sine[m])
            count[k] += 1
            of_circle[k] += np.hypot(points[m, 0] - x, points[m, 1] - y) - r
            of_ellipse[k] += residual[m]
    for k in range(SECTORS):
        if count[k] > 0:
            sums[0] += (of_circle[k] / count[k]) ** 2
            sums[1] += (of_ellipse[k] / count[k]) ** 2
            sums[2] += noise**2 / count[k]
            sums[3] += 1
    sums[:3] /= max(sums[3], 1.0)
    return True, vector, sums
