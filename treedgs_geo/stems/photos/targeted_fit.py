"""Stems at places that a person gives: looked for there, however weak the search's own evidence of them was.

What is known of the place stands in for the detection; all that decides about the diameter (edges, silhouettes, limits)
is as for any other stem. A place where the photos show nothing of a stem stays as a refused one, with the reason.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from ...core.progress import Reporter
from ...reconstruction.area import Area
from .deduplicate import known_rows, plausible
from .fit.edge_adjustment import NO_STEMS
from .fit.photo_fit import PhotoFit
from .images.crops import PhotoStack
from .propose.edge_voting import Seed
from .stem_fit import Fitter
from .tuned import CLEAR_LLR, FEW_LLR, LEAD_LLR, MAX_FOLLOWED, MIN_PHOTOS, START_M, START_RADIUS_M


@dataclass(frozen=True)
class GivenStems:
    """xy: (K, 2) places, local frame. reach_m: how far their stems may stand from them."""

    xy: np.ndarray
    reach_m: float

    def within(self, area: Area, box: tuple[float, float, float, float], margin_m: float) -> GivenStems:
        """Those in a box x0, y0, x1, y1 that lie in the area, grown by ``margin_m``."""
        x, y = self.xy.T
        inside = (x >= box[0]) & (x < box[2]) & (y >= box[1]) & (y < box[3])
        return replace(self, xy=self.xy[inside & area.contains(self.xy, margin_m)])


def fits_of_given(
    fitter: Fitter, given: GivenStems, found: list[PhotoFit], reporter: Reporter, others: Sequence[PhotoFit] = ()
) -> list[PhotoFit]:
    """Fits of the given stems that are not among ``found``, each a stem or refused. others: stems that stand there and
    are none of the given ones."""
    partner = partners(given, found)
    known, fits = known_rows([*found, *others]), []
    waiting = [place for place, fit in zip(given.xy, partner, strict=True) if fit is None or not found[fit].measured]
    for done, place in enumerate(waiting):
        reporter.progress(done / len(waiting))
        fit = fit_at(fitter, place, given.reach_m, known)
        fits.append(fit)
        if fit.measured:
            known = np.vstack([known, fit.row])
    return fits


def partners(given: GivenStems, found: list[PhotoFit]) -> list[int | None]:
    """Index of the fit that each given stem is, ``None`` where there is none within reach: one to one, measured ones
    before refused ones, the sum of the distances least."""
    if not len(given.xy) or not found:
        return [None] * len(given.xy)
    places = np.array([fit.axis.p for fit in found])
    gap = np.linalg.norm(given.xy[:, None] - places[None], axis=2)
    refused = np.array([not fit.measured for fit in found])
    # A refused fit within reach is taken only where no measured one is left.
    cost = np.where(gap <= given.reach_m, gap + given.reach_m * refused[None], 10.0 * given.reach_m)
    out: list[int | None] = [None] * len(given.xy)
    for i, j in zip(*linear_sum_assignment(cost), strict=True):
        if gap[i, j] <= given.reach_m:
            out[int(i)] = int(j)
    return out


def fit_at(fitter: Fitter, place: np.ndarray, reach_m: float, known: np.ndarray = NO_STEMS) -> PhotoFit:
    """The stem within ``reach_m`` of a place (2,), measured or refused. known: (K, 10) stems that are there already."""
    if photos_showing(fitter.stack, place, _height(fitter, place)) < MIN_PHOTOS:
        return _nothing(fitter, place, "few_views")
    starts = _free(_starts(place, reach_m), known)
    # Where a stem is clear at the place itself, the ground about it need not be looked at.
    nearest = fitter.fit(starts[0], known, quick=True)
    if nearest is not None and nearest.evidence.llr >= CLEAR_LLR and _away(nearest, place) <= min(START_M, reach_m):
        fit = _best([fitter.fit(_seed(*nearest.axis.p), known)], place, reach_m)
        if fit is not None and fit.measured:
            return fit
    quick = [nearest, *(fitter.fit(seed, known, quick=True) for seed in starts[1:])]
    looked = sorted(((fit.evidence.llr, *fit.axis.p) for fit in quick if fit is not None), reverse=True)
    followed: list[tuple[float, float]] = []
    for _, x, y in looked:
        if all(np.hypot(x - a, y - b) > START_RADIUS_M for a, b in followed):
            followed.append((float(x), float(y)))
    # The place itself is looked at in any case: a silhouette may stand there without edges.
    seeds = [_seed(*middle) for middle in followed[:MAX_FOLLOWED]] + starts[:1]
    best = _best([fitter.fit(seed, known) for seed in seeds], place, reach_m)
    return _nothing(fitter, place, "not_found") if best is None else best


def _best(fits: list[PhotoFit | None], place: np.ndarray, reach_m: float) -> PhotoFit | None:
    """The one that is the stem meant, if the photos say anything of one."""
    near = [replace(fit, seed_score=0.0) for fit in fits if fit is not None and _away(fit, place) <= reach_m + fit.r0]
    near = [fit for fit in near if _says_something(fit)]
    if not near:
        return None
    best = max(near, key=lambda fit: (fit.measured, fit.evidence.llr - LEAD_LLR * (_away(fit, place) / reach_m) ** 2))
    return None if best.measured and not plausible(best, np.inf) else best


def photos_showing(stack: PhotoStack, place: np.ndarray, height: float) -> int:
    """How many photos of the stack hold a point: (2,) place and height, local frame."""
    point, count = np.array([[*place, height]]), 0
    for view, corner, size in zip(stack.views, stack.corner, stack.shape, strict=True):
        pixel, depth = view.project(point)
        row, column = pixel[0, 1] - corner[0], pixel[0, 0] - corner[1]
        count += bool(depth[0] > 0 and 0 <= row < size[0] and 0 <= column < size[1])
    return count


def _height(fitter: Fitter, place: np.ndarray) -> float:
    return float(fitter.ground.at(place[:1], place[1:])[0]) + fitter.options.bh_m


def _starts(place: np.ndarray, reach_m: float) -> list[Seed]:
    """The place, and a hexagonal grid of places about it, up to where a fit sees the end of the reach."""
    n = int(np.ceil(reach_m / START_M))
    steps = [(a + 0.5 * b, b * np.sqrt(0.75)) for a in range(-n, n + 1) for b in range(-n, n + 1)]
    near_first = sorted((float(np.hypot(a, b)), float(a), float(b)) for a, b in steps)
    return [
        _seed(place[0] + START_M * a, place[1] + START_M * b)
        for far, a, b in near_first
        if START_M * far <= max(reach_m - 0.5 * START_M, 0.0) + 1e-9 or far == 0
    ]


def _free(starts: list[Seed], known: np.ndarray) -> list[Seed]:
    """Those that do not lie in a known stem; all, where every one does."""
    free = [s for s in starts if not (np.hypot(known[:, 0] - s.x, known[:, 1] - s.y) < known[:, 8]).any()]
    return free or starts


def _seed(x: float, y: float) -> Seed:
    return Seed(float(x), float(y), 0.0, 0.0, START_RADIUS_M, 0.0, True)


def _away(fit: PhotoFit, place: np.ndarray) -> float:
    return float(np.hypot(*(fit.axis.p - place)))


def _says_something(fit: PhotoFit) -> bool:
    stands_out = fit.evidence.solid and fit.evidence.llr >= FEW_LLR
    return bool(stands_out or fit.evidence.llr >= LEAD_LLR)


def _nothing(fitter: Fitter, place: np.ndarray, reason: str) -> PhotoFit:
    """A place without a stem that could be measured."""
    return fitter.refused(_seed(*place), reason)
