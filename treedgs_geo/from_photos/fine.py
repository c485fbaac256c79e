"""Sub-pixel refinement of one explanation: edge positions in linear light, robust joint least squares over all views.

Every view, 10 cm block and side offers its sub-pixel gradient maxima near the current edge; expectation-maximisation
weighs them (normal inliers against a uniform background); the model u = n.(dp + ds q + dc q^2) +- f (r0 + r1 q + h_v)
+ o_v is linear in its parameters, with one sideways offset o_v a view (pose error) eliminated by a Schur complement.
h_v is what an oval section shows across view v beside its mean: the second harmonic of its support function, a cos 2
phi + b sin 2 phi with phi the direction across the view. The mean of the half widths over all directions is girth over
2 pi (Cauchy), so that r0 is the radius that a tape reads, from whatever directions the photos are.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numba import njit, prange

from ..trees.priors import OVAL_SD, TAPER_SD, USUAL_TAPER
from .stack import PhotoStack
from .strips import StemAxis, StripLayout, Strips, cut_strips, hide_known

_FAST = {"nogil": True, "cache": True, "fastmath": True}

#: Inlier sd of an edge, pixels; prior sd of the curvature, 1/m.
EDGE_SD_PX = 0.45
CURVATURE_SD = 0.004
#: Rounds of expectation-maximisation after each cut, and edges kept near each expected one.
ROUNDS, MOST_EDGES = 6, 4
#: Inverse variance that keeps an unknown where it is.
_FIXED = 1e12
NO_STEMS = np.empty((0, 10))


@dataclass(frozen=True)
class FineFit:
    """A refined stem.

    axis: at breast height. r0: radius there, metres; r1: its slope, m/m. view_r: (V,) radius deviation of each view,
    metres, NaN without both edges. view_weight: (V,) its weight. two_sided: (V,) bool, both edges seen.
    n_edges: effective number of edges. spread: (V,) share of blocks with a supported edge pair. rms_px: edge residual.
    fit_sd_m: formal standard error of r0. oval: (2,) second harmonic of the half width, metres. evidence: summed log
    likelihood ratio of "one of the edges found is the stem's" to "none is", over photos, blocks and sides, with the
    prior of the taper.
    """

    axis: StemAxis
    r0: float
    r1: float
    view_r: np.ndarray
    view_weight: np.ndarray
    two_sided: np.ndarray
    support: np.ndarray
    n_edges: float
    rms_px: float
    fit_sd_m: float
    evidence: float = 0.0
    oval: np.ndarray = field(default_factory=lambda: np.zeros(2))


@dataclass(frozen=True)
class Sighting:
    """What is known of a stem's photos. seen: (V,) probability that a view sees it. known: other stems
    (:func:`.strips.hide_known`). skip: (V, 2) bool, left and right sides that are not its own edge."""

    seen: np.ndarray
    known: np.ndarray
    skip: np.ndarray | None = None


class TaperPrior(NamedTuple):
    """What the slope of a stem's radius is expected to be, and its standard deviation, m/m."""

    slope: float = USUAL_TAPER
    sd: float = TAPER_SD


USUAL = TaperPrior()


class _EdgePoints(NamedTuple):
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


class _Damping(NamedTuple):
    """Priors as inverse variances: of the 10 unknowns around ``rest``, and of each view's offset around 0."""

    unknowns: np.ndarray
    offsets: np.ndarray
    rest: np.ndarray


class _State(NamedTuple):
    """Unknowns (10,), offsets of the views, posterior of the edges, total of the groups, normal matrix (10, 10)."""

    x: np.ndarray
    offset: np.ndarray
    post: np.ndarray
    total: np.ndarray
    matrix: np.ndarray


@njit(**_FAST)
def _expectation(edges, damping, rounds, state):
    """Expectation-maximisation of :func:`_solve`; the state is changed in place.

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
    for step in range(rounds):
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


@njit(parallel=True, **_FAST)
def _candidates_kernel(strips, radius, slope, window_px, place, weight):
    """Sub-pixel maxima of the mean gradient near both expected edges: place, weight (V, B, 2, K); place NaN if none."""
    us, q, coherence, gradient, _, px_m, widen = strips
    u0, du, most = us[0], us[1] - us[0], place.shape[3]
    n_views, n_blocks, n_u = coherence.shape
    for v in prange(n_views):
        power = np.empty(n_u, np.float32)
        for b in range(n_blocks):
            for i in range(n_u):
                g = gradient[v, b, i]
                power[i] = np.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
            for side in range(2):
                sign = 2 * side - 1
                expected = sign * widen[v] * (radius + slope * q[b])
                low = max(1, int((expected - window_px * px_m[v] - u0) / du + 0.5))
                high = min(n_u - 2, int((expected + window_px * px_m[v] - u0) / du + 0.5))
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
    strips: Strips, radius: float, slope: float, window_px: float, most: int = MOST_EDGES
) -> tuple[np.ndarray, np.ndarray]:
    """(V, B, 2, most) positions in metres from the axis (NaN = none) and their coherence."""
    shape = (*strips.coherence.shape[:2], 2, most)
    place, weight = np.full(shape, np.nan), np.zeros(shape)
    _candidates_kernel(strips, radius, slope, window_px, place, weight)
    return place, weight


def refine(
    stack: PhotoStack,
    axis: StemAxis,
    r0: float,
    r1: float,
    sighting: Sighting,
    band_m: tuple[float, float],
    offset_sd_px: float,
    windows_px: tuple[float, ...],
    oval: bool = False,
    taper: TaperPrior = USUAL,
) -> FineFit | None:
    """Refine a stem, in as many cuts as there are windows. band_m: heights above the ground that are fitted.
    offset_sd_px: prior of a view's sideways error. windows_px: edges are looked for this far from where they are
    expected, cut by cut. oval: the section may be oval, as stems are (``priors.OVAL_SD``). taper: prior of ``r1``.

    Returns None where too few edges are found.
    """
    fit, seen = None, sighting.seen
    for window in windows_px:
        layout = StripLayout(*band_m, 0.10, 0.025, r0 + 0.14, 0.005, sigma_px=0.8, linear=True)
        strips = cut_strips(stack, axis, layout, wanted=seen > 0.04)
        hide_known(strips, stack, axis, sighting.known, 0.01)
        place, prior = edge_candidates(strips, r0, r1, window)
        if sighting.skip is not None:
            place[np.broadcast_to(sighting.skip[:, None, :, None], place.shape)] = np.nan
        edges = _gathered(strips, place, prior, seen, window)
        solved = (
            None
            if edges is None
            else _solve(strips, edges, r0, r1, _damping(strips, axis, offset_sd_px, r0, oval, taper), axis)
        )
        if solved is None:
            return None
        delta, fit = solved
        axis, r0, r1 = fit.axis, fit.r0, fit.r1
        if r0 < 0.01 or r0 > 1.0 or not np.isfinite(delta).all():
            return None
    return fit


class EdgesFound(NamedTuple):
    """Edges near those of a given shape. view: (N,) index. height_m: (N,) above the axis' ground. across_m: (N,)
    sideways from the axis, along :attr:`normal`. side: (N,) 0 left, 1 right. used: (N,) probability that it is the
    stem's. Of each of V photos: offset_m, by how much it shows the stem sideways (pose error); radius_m, by how much
    thicker it shows the radius, NaN without both edges; normal (V, 2), direction across the view; widen (V,),
    silhouette half width over radius.
    """

    view: np.ndarray
    height_m: np.ndarray
    across_m: np.ndarray
    side: np.ndarray
    used: np.ndarray
    offset_m: np.ndarray
    radius_m: np.ndarray
    normal: np.ndarray
    widen: np.ndarray


def edges_near(
    stack: PhotoStack,
    axis: StemAxis,
    r0: float,
    r1: float,
    sighting: Sighting,
    band_m: tuple[float, float],
    offset_sd_px: float,
    window_px: float,
    oval: tuple[float, float] = (0.0, 0.0),
) -> EdgesFound:
    """The edges that :func:`refine` weighs about a shape that stays as it is, and how probably each is the stem's.

    oval: as of :class:`FineFit`."""
    layout = StripLayout(*band_m, 0.10, 0.025, r0 + 0.14, 0.005, sigma_px=0.8, linear=True)
    strips = cut_strips(stack, axis, layout, wanted=sighting.seen > 0.04)
    hide_known(strips, stack, axis, sighting.known, 0.01)
    place, prior = edge_candidates(strips, r0, r1, window_px)
    n = len(stack)
    edges = _gathered(strips, place, prior, sighting.seen, window_px)
    if edges is None:
        nothing, whole = np.empty(0), np.empty(0, int)
        none = np.full(n, np.nan)
        return EdgesFound(whole, nothing, nothing, whole, nothing, np.zeros(n), none, strips.normal, strips.widen)
    shape = np.array([0, 0, 0, 0, 0, 0, r0, r1, *oval], float)
    damping = _Damping(np.full(10, _FIXED), 1 / (offset_sd_px * strips.px_m) ** 2, shape)
    state = _State(shape.copy(), np.zeros(n), np.zeros(len(edges.u)), np.zeros(len(edges.none)), np.zeros((10, 10)))
    _expectation(edges, damping, ROUNDS, state)
    view_r, _, _ = _radii(strips, edges, state)
    block = edges.group // 2 % len(strips.q)
    height = strips.q[block] + axis.bh_m
    return EdgesFound(
        edges.v, height, edges.u, edges.group % 2, state.post, state.offset, view_r, strips.normal, strips.widen
    )


def doubled(normal: np.ndarray) -> np.ndarray:
    """(N, 2) cosine and sine of twice the angle of directions (N, 2): times ``FineFit.oval`` what an oval section
    shows across them beside its mean half width."""
    return np.column_stack([normal[:, 0] ** 2 - normal[:, 1] ** 2, 2 * normal[:, 0] * normal[:, 1]])


def _radii(strips: Strips, edges: _EdgePoints, state: _State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of each photo, (V,): by how much thicker it shows the radius (m; NaN without both edges), how many edges of its
    lesser side say so, and whether it shows both."""
    n_views, v = len(strips.px_m), edges.v
    side = edges.group % 2
    sign = 2.0 * side - 1.0
    e = edges.u - edges.design @ state.x - state.offset[v]
    mass = np.bincount(v * 2 + side, state.post, 2 * n_views).reshape(-1, 2)
    moment = np.bincount(v * 2 + side, state.post * e * sign, 2 * n_views).reshape(-1, 2)
    two_sided = np.all(mass >= 1.0, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        view_r = np.where(two_sided, (moment / mass).mean(axis=1) / strips.widen, np.nan)
        weight = np.where(two_sided, 1.0 / (1.0 / mass[:, 0] + 1.0 / mass[:, 1]), 0.0)
    return view_r, weight, two_sided


def _gathered(
    strips: Strips, place: np.ndarray, prior: np.ndarray, seen: np.ndarray, window_px: float
) -> _EdgePoints | None:
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
    return _EdgePoints(v, group, u, p, design, EDGE_SD_PX * px, none)


def _damping(
    strips: Strips, axis: StemAxis, offset_sd_px: float, r0: float, oval: bool, taper: TaperPrior = USUAL
) -> _Damping:
    lam = np.zeros(10)
    lam[0:2], lam[2:4], lam[4:6] = 1 / 0.3**2, 1 / 0.05**2, 1 / CURVATURE_SD**2
    lam[7] = 1 / taper.sd**2
    lam[8:10] = 1 / (OVAL_SD * r0) ** 2 if oval else _FIXED
    rest = np.array([0, 0, 0, 0, -axis.c[0], -axis.c[1], 0, taper.slope, 0, 0])
    return _Damping(lam, 1 / (offset_sd_px * strips.px_m) ** 2, rest)


def _solve(
    strips: Strips, edges: _EdgePoints, r0: float, r1: float, damping: _Damping, axis: StemAxis
) -> tuple[np.ndarray, FineFit] | None:
    """The change of the axis and radius that explains the edges best, and the stem after it; None if singular."""
    n_views, n_groups = len(strips.px_m), len(edges.none)
    x = np.array([0, 0, 0, 0, 0, 0, r0, r1, 0, 0], float)
    offset, post, total = np.zeros(n_views), np.zeros(len(edges.u)), np.zeros(n_groups)
    matrix = np.zeros((10, 10))
    state = _State(x, offset, post, total, matrix)
    try:
        _expectation(edges, damping, ROUNDS, state)
    except np.linalg.LinAlgError:
        return None
    v, none = edges.v, edges.none
    px = strips.px_m[v]
    e = edges.u - edges.design @ x - offset[v]
    view_r, weight, two_sided = _radii(strips, edges, state)
    there = none > 0
    evidence = float(np.log((total[there] + none[there]) / none[there]).sum())
    evidence -= 0.5 * damping.unknowns[7] * (x[7] - damping.rest[7]) ** 2
    best = np.zeros(n_groups)
    np.maximum.at(best, edges.group, post)
    pairs = best.reshape(n_views, -1, 2).min(axis=2)
    fit = FineFit(
        axis=StemAxis(axis.p + x[0:2], axis.s + x[2:4], axis.c + x[4:6], axis.ground_z, axis.bh_m),
        r0=float(x[6]),
        r1=float(x[7]),
        view_r=view_r,
        view_weight=weight,
        two_sided=two_sided,
        support=pairs.mean(axis=1),
        n_edges=float(post.sum()),
        rms_px=float(np.sqrt((post * (e / px) ** 2).sum() / max(post.sum(), 1e-9))),
        fit_sd_m=float(np.sqrt(np.linalg.inv(matrix)[6, 6])),
        evidence=evidence,
        oval=x[8:10],
    )
    return x, fit
