"""Compiled parts of the search over edge pairs (:mod:`.fit.search`): scores, the mixture over photos, the polish."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from ....core.machine import FAST
from ..tuned import SEEN_MEAN_Z, SEEN_PRIOR, SIGN_WEIGHT, SINGLE_WEIGHT, Z_CAP
from .pattern_search import DISC_MOVES, disc_step, pattern_search

#: The grid search reads the mixture from a table: from this z-score on, so many entries a unit.
Z_LOW, Z_STEPS = -9.0, 1024.0


class Edges(NamedTuple):
    """Edges in V views, B blocks and U places, as the kernels take them.

    ridge: (V, B, U) float32, how clear; unit: (V, B, U, 3) float32, their colour direction; filled: (V, B) bool, which
    blocks show anything. q, widen, normal: as :class:`.images.axis_patches.Strips` has them. terminator: (V,) border
    of light and shade (:func:`.search.terminators`). u0, du: first place and step, m. taper: change of a disc's radius
    with height, m/m.
    """

    ridge: np.ndarray
    unit: np.ndarray
    filled: np.ndarray
    q: np.ndarray
    widen: np.ndarray
    normal: np.ndarray
    terminator: np.ndarray
    u0: float
    du: float
    taper: float


class Null(NamedTuple):
    """Scores of edge pairs at random places. radii: (R,) metres; mean, sd: (V, R) per view and radius."""

    radii: np.ndarray
    mean: np.ndarray
    sd: np.ndarray


@njit(inline="always", **FAST)
def edge_factor(ridge, unit, v, b, i, j, terminator):
    """By what the product of two edges counts more or less, of view ``v`` and block ``b``: the left one at sample i,
    the right one at sample j.

    Opposite colour gradients (dark stem on light ground or the reverse) count more. Equal ones do so only where the
    border of light and shade on the bark lies between them, at ``terminator`` (share of the radius; 2 = unknown), and
    turns the other way: without this the shaded part of a stem alone beats the whole stem.
    """
    gi0, gi1, gi2 = unit[v, b, i, 0], unit[v, b, i, 1], unit[v, b, i, 2]
    gj0, gj1, gj2 = unit[v, b, j, 0], unit[v, b, j, 1], unit[v, b, j, 2]
    dot = gi0 * gj0 + gi1 * gj1 + gi2 * gj2
    factor = 1.0 - SIGN_WEIGHT * dot
    if dot > 0.1 and terminator < 0.9 and terminator > -0.9 and ridge[v, b, i] * ridge[v, b, j] > 0.01:
        m = int(0.5 * (i + j) + 0.5 * terminator * (j - i) + 0.5)
        best = 0.0
        for k in range(max(m - 2, i + 3), min(m + 3, j - 2)):
            turn = -0.5 * (
                unit[v, b, k, 0] * (gi0 + gj0) + unit[v, b, k, 1] * (gi1 + gj1) + unit[v, b, k, 2] * (gi2 + gj2)
            )
            best = max(best, turn * ridge[v, b, k])
        factor += 2 * SIGN_WEIGHT * dot * best
    return factor


@njit(inline="always", **FAST)
def edge_pair(ridge, unit, v, b, i, j, terminator):
    """Score of a pair of edges at whole samples (:func:`edge_factor`)."""
    one, other = ridge[v, b, i], ridge[v, b, j]
    return one * other * edge_factor(ridge, unit, v, b, i, j, terminator) + SINGLE_WEIGHT * (one + other)


@njit(inline="always", **FAST)
def edges_between(ridge, unit, v, b, left, right, terminator):
    """Score of a pair of edges at places between samples, whose colours are those of the nearest ones."""
    i, j = int(left), int(right)
    a, d = left - i, right - j
    i2 = i + 1 if a > 0.5 else i
    j2 = j + 1 if d > 0.5 else j
    factor = edge_factor(ridge, unit, v, b, i2, j2, terminator)
    el = ridge[v, b, i] * (1 - a) + ridge[v, b, i + 1] * a
    er = ridge[v, b, j] * (1 - d) + ridge[v, b, j + 1] * d
    product = ridge[v, b, i2] * ridge[v, b, j2]
    if product < 1e-9:
        factor *= product * 1e9
    return factor * (el * er) + SINGLE_WEIGHT * (el + er)


@njit(inline="always", **FAST)
def above_null(null, v, radius, score):
    """z-score of a view's mean score of edge pairs this far apart (half of it, m) against those of chance."""
    radii, mean, sd = null
    f = min(max((radius - radii[0]) / (radii[1] - radii[0]), 0.0), radii.size - 1.001)
    k = int(f)
    f -= k
    return (score - mean[v, k] * (1 - f) - mean[v, k + 1] * f) / (sd[v, k] * (1 - f) + sd[v, k + 1] * f)


@njit(inline="always", **FAST)
def mixture(z):
    """Log likelihood ratio of one view."""
    z = min(z, Z_CAP)
    return np.log(1.0 - SEEN_PRIOR + SEEN_PRIOR * np.exp(SEEN_MEAN_Z * z - 0.5 * SEEN_MEAN_Z * SEEN_MEAN_Z))


@njit(inline="always", **FAST)
def seen_sum(z):
    """:func:`mixture` summed over (V,) z-scores, without views that show nothing."""
    total = 0.0
    for v in range(z.size):
        if z[v] > -8.9:
            total += mixture(z[v])
    return total


@njit(parallel=True, **FAST)
def null_scores(ridge, unit, terminator, u0, du, centres, radii, total, square, count):
    """Sums, sums of squares and counts, (V, R), of the edge scores of pairs at ``centres``, where no stem stands."""
    n_views, n_blocks, n_u = ridge.shape
    for v in prange(n_views):
        blocks = 0
        for b in range(n_blocks):
            filled = False
            for i in range(0, n_u, 4):
                if ridge[v, b, i] > 0:
                    filled = True
                    break
            blocks += filled
        if blocks < n_blocks:
            continue
        for m in range(radii.size):
            for k in range(centres.size):
                i = int((centres[k] - radii[m] - u0) / du + 0.5)
                j = int((centres[k] + radii[m] - u0) / du + 0.5)
                t = 0.0
                for b in range(n_blocks):
                    t += edge_pair(ridge, unit, v, b, i, j, terminator[v])
                t /= n_blocks
                total[v, m] += t
                square[v, m] += t * t
        count[v] += centres.size


@njit(**FAST)
def pair_table(ridge, unit, v, b, terminator, first, last, widest, table):
    """:func:`edge_pair` of every left edge in ``first <= i < last``, every width up to ``widest`` samples: (D, U)."""
    e, g = ridge[v, b], unit[v, b]
    n_u = e.size
    sign, single, one = np.float32(SIGN_WEIGHT), np.float32(SINGLE_WEIGHT), np.float32(1.0)
    red, green, blue = g[:, 0].copy(), g[:, 1].copy(), g[:, 2].copy()
    lit = terminator < 0.9 and terminator > -0.9
    dots = np.empty(n_u, np.float32)
    for d in range(1, widest + 1):
        n = min(last, n_u - d) - first
        if n <= 0:
            break
        out, dot = table[d, first : first + n], dots[:n]
        e1, e2 = e[first : first + n], e[first + d : first + d + n]
        r1, r2 = red[first : first + n], red[first + d : first + d + n]
        g1, g2 = green[first : first + n], green[first + d : first + d + n]
        b1, b2 = blue[first : first + n], blue[first + d : first + d + n]
        for k in range(n):
            dot[k] = r1[k] * r2[k] + g1[k] * g2[k] + b1[k] * b2[k]
            out[k] = e1[k] * e2[k] * (one - sign * dot[k]) + single * (e1[k] + e2[k])
        if lit:
            for k in range(n):
                if dot[k] > np.float32(0.1) and e1[k] * e2[k] > np.float32(0.01):
                    out[k] = edge_pair(ridge, unit, v, b, first + k, first + k + d, terminator)


@njit(parallel=True, **FAST)
def table_scores(edges, null, leans, offsets, gain, table):
    """LLR of every view for every extra lean, sideways offset and radius: table (L, V, C, R).

    gain: ``GAIN``, the mixture over z. Pairs of samples are scored once a block and looked up from then on.
    """
    ridge, unit, valid, q, widen, normal, terminator, u0, du, taper = edges
    radii, mean, sd = null
    n_views, n_blocks, n_u = ridge.shape
    n_r = radii.size
    for v in prange(n_views):
        n_valid = 0
        for b in range(n_blocks):
            n_valid += valid[v, b]
        if n_valid < max(2, n_blocks // 3):
            continue
        total = np.zeros((leans.shape[0], offsets.size, n_r), np.float32)
        pairs = np.zeros((n_u, n_u), np.float32)
        half = np.empty(n_r)
        for b in range(n_blocks):
            if not valid[v, b]:
                continue
            for r in range(n_r):
                half[r] = widen[v] * (radii[r] + taper * q[b]) / du
            most = 0.0
            for m in range(leans.shape[0]):
                most = max(most, abs(leans[m, 0] * normal[v, 0] + leans[m, 1] * normal[v, 1]))
            low = offsets[0] - most * abs(q[b])
            high = offsets[-1] + most * abs(q[b])
            first = max(int((low - u0) / du - half[n_r - 1]) - 1, 0)
            last = min(int((high - u0) / du - half[0]) + 3, n_u)
            pair_table(ridge, unit, v, b, terminator[v], first, last, int(2 * half[n_r - 1]) + 2, pairs)
            for m in range(leans.shape[0]):
                slope = leans[m, 0] * normal[v, 0] + leans[m, 1] * normal[v, 1]
                for k in range(offsets.size):
                    c = (offsets[k] + slope * q[b] - u0) / du + 0.5
                    out = total[m, k]
                    for r in range(n_r):
                        i = int(c - half[r])
                        j = int(c + half[r])
                        if i < 0 or j >= n_u or j <= i:
                            continue
                        out[r] += pairs[j - i, i]
        share = np.float32(1.0 / n_valid)
        for m in range(leans.shape[0]):
            for k in range(offsets.size):
                for r in range(n_r):
                    z = (total[m, k, r] * share - np.float32(mean[v, r])) / np.float32(sd[v, r])
                    z = min(max(z, np.float32(Z_LOW)), np.float32(Z_CAP))
                    place = (z - np.float32(Z_LOW)) * np.float32(Z_STEPS)
                    cell = min(int(place), gain.size - 2)
                    part = place - np.float32(cell)
                    table[m, v, k, r] = gain[cell] * (np.float32(1.0) - part) + gain[cell + 1] * part


@njit(parallel=True, **FAST)
def sum_scores(table, normal, xs, ys, c0, dc, score, best_lean):
    """Sum of the views' LLR on the (x, y, r) grid, best over leans."""
    n_leans, n_views, n_c, n_r = table.shape
    for a in prange(ys.size):
        line = np.empty(n_r, np.float32)
        for b in range(xs.size):
            for m in range(n_leans):
                line[:] = 0.0
                for v in range(n_views):
                    k = int((normal[v, 0] * xs[b] + normal[v, 1] * ys[a] - c0) / dc + 0.5)
                    k = min(max(k, 0), n_c - 1)
                    for r in range(n_r):
                        line[r] += table[m, v, k, r]
                for r in range(n_r):
                    if line[r] > score[a, b, r]:
                        score[a, b, r] = line[r]
                        best_lean[a, b, r] = m


@njit(**FAST)
def view_z(edges, null, p, z):
    """z-score of one explanation, (5,) x, y, lx, ly, r, in every view; a view without data gets -9."""
    ridge, unit, valid, q, widen, normal, terminator, u0, du, taper = edges
    n_views, n_blocks, n_u = ridge.shape
    for v in range(n_views):
        t, n_valid = 0.0, 0
        middle = (p[0] * normal[v, 0] + p[1] * normal[v, 1] - u0) / du
        slope = (p[2] * normal[v, 0] + p[3] * normal[v, 1]) / du
        for b in range(n_blocks):
            c = middle + slope * q[b]
            w = widen[v] * (p[4] + taper * q[b]) / du
            if c - w < 0 or int(c + w) >= n_u - 1 or w <= 0 or not valid[v, b]:
                continue
            n_valid += 1
            t += edges_between(ridge, unit, v, b, c - w, c + w, terminator[v])
        z[v] = above_null(null, v, p[4], t / n_valid) if n_valid >= max(2, n_blocks // 3) else -9.0


@njit(**FAST)
def objective(data, p):
    """Summed log likelihood ratio of (5,) x, y, lx, ly, r. data: edges, null, row of the prior, scratch (V,)."""
    edges, null, prior, z = data
    view_z(edges, null, p, z)
    total = seen_sum(z)
    ex = p[0] - prior[0]
    ey = p[1] - prior[1]
    return (
        total
        - 0.5
        * (
            (ex * ex + ey * ey) / (prior[4] * prior[4])
            + ((p[2] - prior[2]) ** 2 + (p[3] - prior[3]) ** 2) / (prior[5] * prior[5])
        )
        - 0.5 * ((p[4] - prior[6]) / prior[7]) ** 2
    )


@njit(**FAST)
def polish_one(data, p, r_low, r_high):
    """Pattern search over place, lean, radius and "one edge stays" moves; p is changed in place."""
    return pattern_search(objective, data, disc_step, DISC_MOVES, p, r_low, r_high, (1.0, 0.5, 0.25, 0.12), 12)


@njit(parallel=True, **FAST)
def polish_many(edges, null, prior, starts, r_low, r_high, best):
    """:func:`polish_one` of (M, 5) starts, side by side; starts and (M,) best are changed in place."""
    for m in prange(starts.shape[0]):
        z = np.empty(edges.ridge.shape[0])
        best[m] = polish_one((edges, null, prior, z), starts[m], r_low[m], r_high)


@njit(parallel=True, **FAST)
def score_many(edges, null, prior, trials, best):
    """``objective`` of (M, 5) explanations -> (M,) best."""
    for m in prange(trials.shape[0]):
        z = np.empty(edges.ridge.shape[0])
        best[m] = objective((edges, null, prior, z), trials[m])


def gain_table() -> np.ndarray:
    """The mixture's log likelihood ratio over z, from ``Z_LOW`` to ``Z_CAP``: linear between is exact to 3e-7."""
    z = Z_LOW + np.arange(int((Z_CAP - Z_LOW) * Z_STEPS) + 1) / Z_STEPS
    return np.log(1.0 - SEEN_PRIOR + SEEN_PRIOR * np.exp(SEEN_MEAN_Z * z - 0.5 * SEEN_MEAN_Z**2)).astype(np.float32)


GAIN = gain_table()
