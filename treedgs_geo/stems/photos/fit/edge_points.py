"""Edges of one explanation in the photos, and the linear model that they are weighed by.

Every view, 10 cm block and side offers its sub-pixel gradient maxima near the current edge (:func:`edge_candidates`);
expectation-maximisation weighs them (normal inliers against a uniform background); the model u = n.(dp + ds q + dc q^2)
+- f (r0 + r1 q + h_v) + o_v is linear in its parameters, with one sideways offset o_v a view (pose error) eliminated by
a Schur complement (:func:`expectation`). h_v is what an oval section shows across view v beside its mean: the second
harmonic of its support function, a cos 2 phi + b sin 2 phi with phi the direction across the view. The mean of the half
widths over all directions is girth over 2 pi (Cauchy), so that r0 is the radius that a tape reads, from whatever
directions the photos are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from ....core.machine import FAST
from ..images.axis_patches import Strips
from ..tuned import EDGE_SD_PX


class EdgePoints(NamedTuple):
    """N candidate edges. v: view. group: view, block and side. u: place, m. p: coherence times the probability that
    the view sees the stem. design: (N, 10) row of the linear model. sd: of an inlier, m. none: (groups,) density of
    "no candidate is the edge"."""

    v: np.ndarray
    group: np.ndarray
    u: np.ndarray
    p: np.ndarray
    design: np.ndarray
    sd: np.ndarray
    none: np.ndarray


class Damping(NamedTuple):
    """Priors as inverse variances: of the 10 unknowns around ``rest``, and of each view's offset around 0."""

    unknowns: np.ndarray
    offsets: np.ndarray
    rest: np.ndarray


class State(NamedTuple):
    """Unknowns (10,), offsets of the views, posterior of the edges, total of the groups, normal matrix (10, 10)."""

    unknowns: np.ndarray
    offset: np.ndarray
    post: np.ndarray
    total: np.ndarray
    matrix: np.ndarray


@njit(**FAST)
def expectation(edges, damping, state):
    """Expectation-maximisation of edges and unknowns; the state is changed in place.

    Each block and side has at most one true edge: its candidates compete, with "none of them" beside them.
    """
    v, group, u, p, design, sd, none = edges
    lam, lam_offset, rest = damping
    x, offset, post, total, normal_matrix = state
    n, k = design.shape
    n_views = offset.size
    h = np.empty(n_views)
    g = np.empty(n_views)
    cross = np.empty((n_views, k))
    right = np.empty(k)
    for step in range(6):
        spread = 1.6 if step == 0 else 1.0
        total[:] = 0.0
        for i in range(n):
            e = u[i] - offset[v[i]]
            for a in range(k):
                e -= design[i, a] * x[a]
            wide = sd[i] * spread
            post[i] = p[i] * np.exp(-0.5 * (e / wide) ** 2) / (wide * 2.5066)
            total[group[i]] += post[i]
        h[:] = lam_offset
        g[:] = 0.0
        cross[:] = 0.0
        right[:] = lam * rest
        normal_matrix[:] = 0.0
        for i in range(n):
            post[i] /= max(total[group[i]] + none[group[i]], 1e-12)
            w = post[i] / (sd[i] * sd[i])
            if w == 0.0:
                continue
            h[v[i]] += w
            g[v[i]] += w * u[i]
            for a in range(k):
                share = w * design[i, a]
                cross[v[i], a] += share
                right[a] += share * u[i]
                for c in range(a + 1):
                    normal_matrix[a, c] += share * design[i, c]
        for m in range(n_views):
            for a in range(k):
                share = cross[m, a] / h[m]
                right[a] -= share * g[m]
                for c in range(a + 1):
                    normal_matrix[a, c] -= share * cross[m, c]
        for a in range(k):
            normal_matrix[a, a] += lam[a]
            for c in range(a):
                normal_matrix[c, a] = normal_matrix[a, c]
        x[:] = np.linalg.solve(normal_matrix, right)
        for m in range(n_views):
            o = g[m]
            for a in range(k):
                o -= cross[m, a] * x[a]
            offset[m] = o / h[m]


@njit(parallel=True, **FAST)
def _candidates_kernel(strips, radius, slope, window_px, place, weight):
    """Sub-pixel maxima of the mean gradient near both expected edges: place, weight (V, B, 2, K); place NaN if none."""
    us, q, coherence, gradient, _, px_m, widen = strips
    u0, du, most = us[0], us[1] - us[0], place.shape[3]
    n_views, n_blocks, n_u = coherence.shape
    for v in prange(n_views):
        power = np.empty(n_u, np.float32)
        for b in range(n_blocks):
            for side in range(2):
                sign = 2 * side - 1
                expected = sign * widen[v] * (radius + slope * q[b])
                low = max(1, int((expected - window_px * px_m[v] - u0) / du + 0.5))
                high = min(n_u - 2, int((expected + window_px * px_m[v] - u0) / du + 0.5))
                for i in range(low - 1, high + 2):
                    g = gradient[v, b, i]
                    power[i] = np.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
                found = 0
                for i in range(low, high + 1):
                    if power[i] <= power[i - 1] or power[i] < power[i + 1] or coherence[v, b, i] < 0.03:
                        continue
                    curve = power[i - 1] - 2 * power[i] + power[i + 1]
                    shift = 0.5 * (power[i - 1] - power[i + 1]) / curve if curve < -1e-12 else 0.0
                    slot = found
                    if found == most:  # keep the most coherent ones
                        slot = 0
                        for k in range(1, most):
                            if weight[v, b, side, k] < weight[v, b, side, slot]:
                                slot = k
                        if coherence[v, b, i] <= weight[v, b, side, slot]:
                            continue
                    else:
                        found += 1
                    place[v, b, side, slot] = u0 + (i + shift) * du
                    weight[v, b, side, slot] = coherence[v, b, i]


def edge_candidates(
    strips: Strips, radius: float, slope: float, window_px: float, most: int = 4
) -> tuple[np.ndarray, np.ndarray]:
    """(V, B, 2, most) positions in metres from the axis (NaN = none) and their coherence."""
    shape = (*strips.coherence.shape[:2], 2, most)
    place, weight = np.full(shape, np.nan), np.zeros(shape)
    _candidates_kernel(strips, radius, slope, window_px, place, weight)
    return place, weight


def gathered(
    strips: Strips, place: np.ndarray, prior: np.ndarray, seen: np.ndarray, window_px: float
) -> EdgePoints | None:
    """The candidates of :func:`edge_candidates` in one list; None where there are hardly any."""
    v, b, s, _ = np.nonzero(np.isfinite(place))
    if len(v) < 20:
        return None
    u = place[np.isfinite(place)]
    p = np.clip(prior[np.isfinite(place)], 0.02, 0.95) * np.clip(seen[v], 0.02, 1.0)
    sign = 2.0 * s - 1.0
    q, n, px, f = strips.q[b], strips.normal[v], strips.px_m[v], strips.widen[v]
    # Unknowns: dp, ds, dc (2 each), r0, r1, oval (2).
    side = sign * f
    design = np.column_stack([n, n * q[:, None], n * (q * q)[:, None], side, side * q, side[:, None] * doubled(n)])
    n_views, n_blocks = strips.coherence.shape[:2]
    group = (v * n_blocks + b) * 2 + s
    none = np.zeros(n_views * n_blocks * 2)
    np.maximum.at(none, group, (1 - p) / (2 * window_px * px))
    return EdgePoints(v, group, u, p, design, EDGE_SD_PX * px, none)


def radii(strips: Strips, edges: EdgePoints, state: State) -> tuple[np.ndarray, np.ndarray]:
    """Of each photo, (V,): by how much thicker it shows the radius (m; NaN without both edges), and how many edges of
    its lesser side say so."""
    n_views, v = len(strips.px_m), edges.v
    side = edges.group % 2
    sign = 2.0 * side - 1.0
    e = edges.u - edges.design @ state.unknowns - state.offset[v]
    mass = np.bincount(v * 2 + side, state.post, 2 * n_views).reshape(-1, 2)
    moment = np.bincount(v * 2 + side, state.post * e * sign, 2 * n_views).reshape(-1, 2)
    two_sided = np.all(mass >= 1.0, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        view_r = np.where(two_sided, (moment / mass).mean(axis=1) / strips.widen, np.nan)
        weight = np.where(two_sided, 1.0 / (1.0 / mass[:, 0] + 1.0 / mass[:, 1]), 0.0)
    return view_r, weight


def doubled(normal: np.ndarray) -> np.ndarray:
    """(N, 2) cosine and sine of twice the angle of directions (N, 2): times ``FineFit.oval`` what an oval section
    shows across them beside its mean half width."""
    return np.column_stack([normal[:, 0] ** 2 - normal[:, 1] ** 2, 2 * normal[:, 0] * normal[:, 1]])
