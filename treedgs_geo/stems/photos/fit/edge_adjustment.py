"""Sub-pixel refinement of one explanation: edge positions in linear light, robust joint least squares over all views
(:mod:`.edge_points` has the edges and their model)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...quality.priors import OVAL_SD, TAPER_SD, USUAL_TAPER
from ..images.axis_patches import NEAREST_M, StemAxis, StripLayout, Strips, cut_strips, hide_known
from ..images.crops import PhotoStack
from ..network.inference import OddsMaps
from ..network.silhouettes import weigh_edges
from ..tuned import CURVATURE_SD
from .edge_points import Damping, EdgePoints, State, edge_candidates, expectation, gathered, radii

NO_STEMS = np.empty((0, 10))


@dataclass(frozen=True)
class FineFit:
    """A refined stem.

    axis: at breast height. r0: radius there, metres; r1: its slope, m/m. view_r: (V,) radius deviation of each view,
    metres, NaN without both edges. view_weight: (V,) its weight. rms_px: edge residual. fit_sd_m: formal standard error
    of r0; oval_sd_m: what of it the unknown oval of the section makes. evidence: summed log likelihood ratio of "one of
    the edges found is the stem's" to "none is", over photos, blocks and sides, with the prior of the taper. oval: (2,)
    second harmonic of the half width, metres.
    """

    axis: StemAxis
    r0: float
    r1: float
    view_r: np.ndarray
    view_weight: np.ndarray
    rms_px: float
    fit_sd_m: float
    oval_sd_m: float = 0.0
    evidence: float = 0.0
    oval: np.ndarray = field(default_factory=lambda: np.zeros(2))


@dataclass(frozen=True)
class Sighting:
    """What is known of a stem's photos."""

    #: (V,) probability that a photo sees it.
    seen: np.ndarray
    #: (K, 10) other stems (:func:`.images.axis_patches.hide_known`).
    known: np.ndarray
    #: What the network takes for bark, where its word on each edge counts.
    bark: OddsMaps | None = None


class TaperPrior(NamedTuple):
    """What the slope of a stem's radius is expected to be, and its standard deviation, m/m."""

    slope: float = USUAL_TAPER
    sd: float = TAPER_SD


USUAL = TaperPrior()


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
        strips = _strips_about(stack, axis, r0, r1, sighting, band_m)
        place, prior = edge_candidates(strips, r0, r1, window)
        edges = gathered(strips, place, prior, seen, window)
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


def _strips_about(
    stack: PhotoStack, axis: StemAxis, r0: float, r1: float, sighting: Sighting, band_m: tuple[float, float]
) -> Strips:
    """Strips along an axis in linear light, of the photos that may see it, other stems hidden."""
    layout = StripLayout(*band_m, 0.10, 0.025, r0 + 0.14, 0.005, sigma_px=0.8, linear=True)
    wanted = sighting.seen > 0.04
    strips = cut_strips(stack, axis, layout, wanted)
    # Tangents from a near camera touch the stem before its widest place.
    near = r0 / np.maximum(np.hypot(*(stack.centre[:, :2] - axis.p).T), NEAREST_M)
    strips.widen[:] /= np.sqrt(1.0 - np.minimum(near, 0.9) ** 2)
    hide_known(strips, stack, axis, sighting.known, 0.01)
    if sighting.bark is not None:
        weigh_edges(strips, wanted, axis, r0, r1, sighting.bark)
    return strips


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
    strips = _strips_about(stack, axis, r0, r1, sighting, band_m)
    place, prior = edge_candidates(strips, r0, r1, window_px)
    n = len(stack)
    edges = gathered(strips, place, prior, sighting.seen, window_px)
    if edges is None:
        nothing, whole = np.empty(0), np.empty(0, int)
        none = np.full(n, np.nan)
        return EdgesFound(whole, nothing, nothing, whole, nothing, np.zeros(n), none, strips.normal, strips.widen)
    shape = np.array([0, 0, 0, 0, 0, 0, r0, r1, *oval], float)
    damping = Damping(np.full(10, 1e12), 1 / (offset_sd_px * strips.px_m) ** 2, shape)
    state = State(shape.copy(), np.zeros(n), np.zeros(len(edges.u)), np.zeros(len(edges.none)), np.zeros((10, 10)))
    expectation(edges, damping, state)
    view_r, _ = radii(strips, edges, state)
    block = edges.group // 2 % len(strips.q)
    height = strips.q[block] + axis.bh_m
    return EdgesFound(
        edges.v, height, edges.u, edges.group % 2, state.post, state.offset, view_r, strips.normal, strips.widen
    )


def _damping(
    strips: Strips, axis: StemAxis, offset_sd_px: float, r0: float, oval: bool, taper: TaperPrior = USUAL
) -> Damping:
    lam = np.zeros(10)
    lam[0:2], lam[2:4], lam[4:6] = 1 / 0.3**2, 1 / 0.05**2, 1 / CURVATURE_SD**2
    lam[7] = 1 / taper.sd**2
    lam[8:10] = 1 / (OVAL_SD * r0) ** 2 if oval else 1e12
    rest = np.array([0, 0, 0, 0, -axis.c[0], -axis.c[1], 0, taper.slope, 0, 0])
    return Damping(lam, 1 / (offset_sd_px * strips.px_m) ** 2, rest)


def _solve(
    strips: Strips, edges: EdgePoints, r0: float, r1: float, damping: Damping, axis: StemAxis
) -> tuple[np.ndarray, FineFit] | None:
    """The change of the axis and radius that explains the edges best, and the stem after it; None if singular."""
    x = np.array([0, 0, 0, 0, 0, 0, r0, r1, 0, 0], float)
    offset, post, total = np.zeros(len(strips.px_m)), np.zeros(len(edges.u)), np.zeros(len(edges.none))
    matrix = np.zeros((10, 10))
    state = State(x, offset, post, total, matrix)
    try:
        expectation(edges, damping, state)
    except np.linalg.LinAlgError:
        return None
    v, none = edges.v, edges.none
    px = strips.px_m[v]
    e = edges.u - edges.design @ x - offset[v]
    view_r, weight = radii(strips, edges, state)
    there = none > 0
    evidence = float(np.log((total[there] + none[there]) / none[there]).sum())
    evidence -= 0.5 * damping.unknowns[7] * (x[7] - damping.rest[7]) ** 2
    # The same with the section known: rows and columns of the oval left out.
    of_r0, of_round = np.linalg.inv(matrix)[6, 6], np.linalg.inv(matrix[:8, :8])[6, 6]
    fit = FineFit(
        axis=StemAxis(axis.p + x[0:2], axis.s + x[2:4], axis.c + x[4:6], axis.ground_z, axis.bh_m),
        r0=float(x[6]),
        r1=float(x[7]),
        view_r=view_r,
        view_weight=weight,
        rms_px=float(np.sqrt((post * (e / px) ** 2).sum() / max(post.sum(), 1e-9))),
        fit_sd_m=float(np.sqrt(of_r0)),
        oval_sd_m=float(np.sqrt(max(of_r0 - of_round, 0.0))),
        evidence=evidence,
        oval=x[8:10],
    )
    return x, fit
