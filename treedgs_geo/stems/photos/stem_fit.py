"""One seed -> one fitted stem with its error, or the reason why not."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from .backdrop import Backdrop, Silhouette, cut_silhouette
from .coarse import SEEN_MEAN_Z, SEEN_PRIOR, Z_CAP, Mode, Null, NullBuilder, Prior, Search, terminators
from .detect import Seed
from .fine import NO_STEMS, TAPER_PRIOR, FineFit, refine
from .foot import breast_height, moved
from .options import PhotoStemOptions
from .stack import GroundGrid, PhotoStack
from .strips import Axis, cut_strips, draw_ridges, hide_known

#: The band that is searched (m above ground) and the one that is fitted: above the butt, whose swell a straight taper
#: would carry up to breast height.
COARSE_BAND = 0.5, 3.3
FINE_BAND = 0.6, 3.5
#: A view counts as seeing the stem above this z-score.
CLEAR_Z = 2.5
#: Scores on the grid and after polishing below which a seed is not worth refining, unless its silhouette is clear.
MIN_RAW, MIN_POLISHED = 38.0, 50.0
#: Lead in edge score over the next explanation that still leaves a doubt.
DOUBTED_GAP = 9.0
#: Weights of the further witnesses in the joint score: sub-pixel evidence, taper (sd 0.3 cm/m), ragged edges (1/px).
EVIDENCE_WEIGHT, TAPER_COST, RAGGED_COST = 0.5, 0.02, 1.0
#: Explanations whose diameters differ less than this are one answer, cm.
SAME_DBH_CM = 2.0
#: A lead in the joint score (:func:`choose`) below the first is no decision, below the second doubtful.
LEAD_REFUSED, LEAD_DOUBTFUL = 0.10, 0.45
#: Edge score (log likelihood ratio) from which a stem is measured and from which without doubt: where the silhouette
#: stands out, and where the edges are all there is (chance reaches about 45).
LLR_MEASURED, LLR_OK = 18.0, 35.0
LLR_MEASURED_ALONE, LLR_OK_ALONE = 52.0, 60.0
#: Silhouette contrast (of what chance reaches) below which a stem is doubted.
FAINT = 0.7
#: The silhouette reads this much thinner than the edges (cm): ground shows through at the blurred rim. And how far it
#: may be off before the tree is doubted or refused, cm and share of the diameter.
OUTLINE_OFFSET_CM, OUTLINE_DOUBT, OUTLINE_REFUSE = 1.0, (2.5, 0.10), (4.0, 0.18)


@dataclass(frozen=True)
class StemFit:
    """A stem as the photos show it, local frame.

    axis: stem axis, ``axis.p`` at breast height. r0, r1: radius at breast height (m) and its slope (m/m).
    dbh_cm, se_cm: diameter and its standard error given that the right edges were found. flag: ok, check or reject;
    reasons: keys of ``measure.quality.REASONS``. seed_score: of the detection. llr: log likelihood ratio of the fit.
    gap: its lead over the next different explanation. n_views: photos that see it clearly. kish: effective photos.
    arc_deg: spread of their azimuths. rms_px: edge residual. polish_cm: diameter of the coarse stage. seen: (V,)
    probability that each photo sees it. contrast: of the silhouette, in units of what chance reaches. lead: over the
    next different explanation in the joint score of edges and silhouette. outline_cm: diameter of the silhouette alone.
    foot_z: ground on the uphill side of the foot, local metres.
    """

    axis: Axis
    r0: float
    r1: float
    dbh_cm: float
    se_cm: float
    flag: Literal["ok", "check", "reject"]
    reasons: tuple[str, ...]
    seed_score: float
    llr: float
    gap: float
    n_views: int
    kish: float
    arc_deg: float
    rms_px: float
    polish_cm: float
    seen: np.ndarray = field(repr=False)
    contrast: float = np.nan
    lead: float = np.nan
    outline_cm: float = np.nan
    foot_z: float = np.nan

    @property
    def lean_deg(self) -> float:
        """Angle of the axis from the vertical at breast height."""
        return float(np.degrees(np.arctan(np.hypot(*self.axis.s))))

    @property
    def row(self) -> np.ndarray:
        """(10,) for :func:`.strips.hide_known`."""
        return np.concatenate([self.axis.row, [self.r0, self.r1]])

    @property
    def measured(self) -> bool:
        """Has a diameter."""
        return self.flag != "reject"


@dataclass
class Fitter:
    """What all fits on one stack of photos share. sun: (flights,) azimuth, rad from east, NaN = unknown. backdrop: the
    ground behind the stems, if enough photos show it; chance: silhouette contrast that places without a stem reach."""

    stack: PhotoStack
    ground: GroundGrid
    options: PhotoStemOptions
    null: Null
    sun: np.ndarray
    prior: Prior = Prior()
    backdrop: Backdrop | None = None
    chance: float = np.inf

    def fit(self, seed: Seed, known: np.ndarray = NO_STEMS, quick: bool = False) -> StemFit | None:
        """Fit a seed. known: (K, 10) stems found before, whose edges are not this one's (:func:`.strips.hide_known`).
        quick: only the best explanation (a first look).

        None where nothing can be fitted at all.
        """
        ground_z = float(self.ground.at(np.array([seed.x]), np.array([seed.y]))[0])
        start = Axis(np.array([seed.x, seed.y]), np.array([seed.lx, seed.ly]), np.zeros(2), ground_z, self.options.bh_m)
        strips, ridge, unit, border = _coarse_strips(self.stack, start, self.options, self.sun, known)
        search = Search(strips, ridge, unit, border, self.null, self.prior)
        outline = None if self.backdrop is None else cut_silhouette(self.stack, self.backdrop, self.ground, start)
        shapes = [] if outline is None or quick else outline.peaks(self.null.radii)
        stands_out = outline is not None and bool(shapes) and outline.contrast(shapes[0]) > self.chance
        raw = search.modes(0.24)
        if (not raw or raw[0].score < MIN_RAW) and not stands_out:
            return None
        share = 0.8 if quick else 0.3
        modes = sorted((search.polish(m) for m in raw if m.score > share * raw[0].score), key=lambda m: -m.score)
        if (not modes or modes[0].score < MIN_POLISHED) and not stands_out:
            return None
        finalists = [mode for mode in distinct(modes)[:5] if mode.score > 0.4 * modes[0].score]
        if quick:
            finalists = finalists[:1]
        else:
            drawn = [search.polish(Mode(*[*map(float, shape), 0.0])) for shape in shapes]
            finalists = distinct(finalists + (search.wholes(modes[0]) if modes else []) + drawn, 0.012, 0.006)
        tried = []
        for mode in finalists:
            seen = seen_probability(search.z(mode.vector))
            axis = Axis(start.p + mode.vector[:2], start.s + mode.vector[2:4], np.zeros(2), ground_z, self.options.bh_m)
            fine = refine(
                self.stack,
                axis,
                mode.r,
                -0.0045,
                seen,
                *FINE_BAND,
                self.options.offset_sd_px,
                cuts=1 if quick else 3,
                known=known,
            )
            if fine is None or fine.r0 < 0.015:
                continue
            vector = np.array([*(fine.axis.p - start.p), *(fine.axis.s - start.s), fine.r0])
            contrast = 0.0 if outline is None else outline.contrast(vector)
            tried.append(Explanation(search.score(vector), contrast, mode, fine, vector))
        if not tried:
            return None
        best, gap, lead = choose(tried, 0.0 if outline is None or quick else self._trust(outline, shapes), self.sun)
        z = search.z(best.vector)
        fine = best.fine
        if not quick:
            fine = (
                refine(
                    self.stack,
                    fine.axis,
                    fine.r0,
                    fine.r1,
                    seen_probability(z),
                    *FINE_BAND,
                    self.options.offset_sd_px,
                    cuts=1,
                    windows_px=(2.2,),
                    known=known,
                )
                or fine
            )
        return self._judge(seed, best, fine, gap, lead, z, None if quick else outline)

    def _trust(self, outline: Silhouette, shapes: list[np.ndarray]) -> float:
        """0..1: how much the silhouette says here, by how far it stands out from what chance reaches."""
        if not shapes:
            return 0.0
        return float(np.clip(outline.contrast(shapes[0]) / self.chance, 0.0, 1.0))

    def _judge(
        self,
        seed: Seed,
        best: Explanation,
        fine: FineFit,
        gap: float,
        lead: float,
        z: np.ndarray,
        outline: Silhouette | None,
    ) -> StemFit:
        weight = fine.view_weight * seen_probability(z)
        kish = float(weight.sum() ** 2 / max((weight**2).sum(), 1e-12))
        clear = z > CLEAR_Z
        se = standard_error_cm(fine, weight)
        azimuth = np.arctan2(fine.axis.p[1] - self.stack.centre[clear, 1], fine.axis.p[0] - self.stack.centre[clear, 0])
        dq, foot_z = breast_height(fine.axis, fine.r0, self.ground)
        axis, r0 = moved(fine.axis, dq), fine.r0 + fine.r1 * dq
        dbh = 200 * r0
        contrast = np.nan if outline is None else best.contrast / self.chance
        outline_cm = np.nan if outline is None else 200 * widest(outline, best.vector)
        flag, reasons = verdict(
            dbh_cm=dbh,
            polish_cm=200 * best.mode.r,
            r1=fine.r1,
            lean=float(np.hypot(*fine.axis.s)),
            score=best.edges,
            gap=gap,
            n_views=int(clear.sum()),
            kish=kish,
            se_cm=se,
            rms_px=fine.rms_px,
            options=self.options,
            lead=lead,
            contrast=contrast,
            outline_cm=outline_cm,
        )
        return StemFit(
            axis=axis,
            r0=r0,
            r1=fine.r1,
            dbh_cm=dbh,
            se_cm=se,
            flag=flag,
            reasons=reasons,
            seed_score=seed.score,
            llr=best.edges,
            gap=gap,
            n_views=int(clear.sum()),
            kish=kish,
            arc_deg=azimuth_spread(azimuth),
            rms_px=fine.rms_px,
            polish_cm=200 * best.mode.r,
            seen=seen_probability(z),
            contrast=contrast,
            lead=lead,
            outline_cm=outline_cm,
            foot_z=foot_z,
        )


@dataclass(frozen=True)
class Explanation:
    """One way to explain a place: edge score, silhouette contrast, where the search and the fit put the stem."""

    edges: float
    contrast: float
    mode: Mode
    fine: FineFit
    vector: np.ndarray


def choose(tried: list[Explanation], trust: float, sun: np.ndarray) -> tuple[Explanation, float, float]:
    """The best explanation, its lead in edge score over the next different one, and its lead in the joint score.

    The joint score adds witnesses that fail in different ways: the share of the best edge score; ``trust`` times the
    share of the best silhouette contrast (edges alone mistake the lit half of a stem for the stem, silhouettes alone a
    bush or a sapling beside it for a part); half the share of the best sub-pixel evidence; small costs of an unusual
    taper and of ragged edges.
    """
    edges = max(max(item.edges for item in tried), 1e-6)
    contrast = max(max(item.contrast for item in tried), 1e-6)
    evidence = max(max(item.fine.evidence for item in tried), 1e-6)
    joint = [
        item.edges / edges
        + trust * item.contrast / contrast
        + EVIDENCE_WEIGHT * item.fine.evidence / evidence
        - TAPER_COST * ((item.fine.r1 - TAPER_PRIOR[0]) / (2 * TAPER_PRIOR[1])) ** 2
        - RAGGED_COST * (item.fine.rms_px - 0.5)
        for item in tried
    ]
    order = sorted(range(len(tried)), key=lambda i: -joint[i])
    ranked = [tried[i] for i in order]
    best = ranked[0] if trust > 0.5 else prefer_whole(sorted(tried, key=lambda item: -item.edges), sun)
    at = next(i for i, item in enumerate(tried) if item is best)
    rivals = [i for i, item in enumerate(tried) if item is not best and different(item.vector, best.vector)]
    parts = [i for i in rivals if contains(best.vector, tried[i].vector)]
    others = [i for i in rivals if abs(tried[i].vector[4] - best.vector[4]) > SAME_DBH_CM / 200]
    lead = joint[at] - max((joint[i] for i in others), default=0.0)
    # A part of the chosen stem is no rival of the whole; where it won by far there is doubt all the same.
    gap = best.edges - max((tried[i].edges for i in rivals if i not in parts), default=0.0)
    if max((tried[i].edges for i in parts), default=0.0) > 1.25 * best.edges:
        gap = min(gap, DOUBTED_GAP)
    return best, gap, lead if trust > 0.5 else np.nan


def widest(outline: Silhouette, vector: np.ndarray) -> float:
    """Radius (m) at which the silhouette around a fitted axis is clearest."""
    radii = np.arange(max(0.3 * vector[4], 0.02), 2.0 * vector[4] + 0.06, 0.004)
    return float(radii[np.argmax([outline.contrast(np.r_[vector[:4], r]) for r in radii])])


def _coarse_strips(
    stack: PhotoStack, axis: Axis, options: PhotoStemOptions, sun: np.ndarray, known: np.ndarray = NO_STEMS
) -> tuple:
    reach = options.dbh_max_cm / 200 + 0.37
    strips = cut_strips(stack, axis, *COARSE_BAND, 0.28, 0.04, reach, 0.01, 1.0, linear=False)
    hide_known(strips, stack, axis, known)
    ridge, unit = draw_ridges(strips.coherence, strips.gradient, 1.3)
    flights = np.array([view.flight for view in stack.views], int)
    return strips, ridge, unit, terminators(strips.normal, sun[flights])


def build_null(
    stack: PhotoStack, ground: GroundGrid, places: np.ndarray, options: PhotoStemOptions, sun: np.ndarray
) -> Null:
    """Null scores at (N, 2) random places."""
    radii = np.arange(0.03, options.dbh_max_cm / 200 + 0.005, 0.01)
    builder = NullBuilder(len(stack), radii)
    for place in places:
        z = float(ground.at(place[:1], place[1:])[0])
        axis = Axis(place, np.zeros(2), np.zeros(2), z, options.bh_m)
        builder.add(*_coarse_strips(stack, axis, options, sun))
    return builder.finish()


def seen_probability(z: np.ndarray) -> np.ndarray:
    """(V,) posterior that a view sees the stem, from its z-score."""
    odds = SEEN_PRIOR * np.exp(SEEN_MEAN_Z * np.minimum(z, Z_CAP) - 0.5 * SEEN_MEAN_Z**2)
    return np.where(z > -8.9, odds / (1 - SEEN_PRIOR + odds), 0.0)


def distinct(modes: list[Mode], apart_m: float = 0.03, apart_r: float = 0.015) -> list[Mode]:
    """Best first, without near-copies."""
    kept: list[Mode] = []
    for mode in modes:
        if all(np.hypot(mode.x - k.x, mode.y - k.y) > apart_m or abs(mode.r - k.r) > apart_r for k in kept):
            kept.append(mode)
    return kept


def different(a: np.ndarray, b: np.ndarray) -> bool:
    """Two refined explanations of one place that would give different diameters; a neighbour is no rival."""
    distance = float(np.hypot(a[0] - b[0], a[1] - b[1]))
    if distance > max(a[4], b[4]) + 0.3 * min(a[4], b[4]):
        return False
    return distance > 0.03 or abs(a[4] - b[4]) > 0.0125


def contains(a: np.ndarray, b: np.ndarray) -> bool:
    """Disc a holds disc b (within 2 cm) and is clearly larger."""
    return a[4] > b[4] + 0.012 and np.hypot(a[0] - b[0], a[1] - b[1]) + b[4] < a[4] + 0.02


def prefer_whole(tried: list[Explanation], sun: np.ndarray) -> Explanation:
    """The best explanation by its edges, or a larger one that holds it and explains nearly as much (the shaded part of
    a stem is no stem); less is enough where the larger one grows towards the sun."""
    best = tried[0]
    for item in tried[1:]:
        if not contains(item.vector, best.vector):
            continue
        grown = np.arctan2(item.vector[1] - best.vector[1], item.vector[0] - best.vector[0])
        sunward = np.isfinite(sun).any() and np.nanmax(np.cos(grown - sun)) > 0.6
        if item.edges > (0.6 if sunward else 0.8) * best.edges:
            best = item
    return best


def standard_error_cm(fine: FineFit, weight: np.ndarray) -> float:
    """From the scatter of the views' diameters: sqrt((4 se)^2 + 0.25^2), scaled on rendered plots."""
    good = (weight > 0) & np.isfinite(fine.view_r)
    if good.sum() < 2:
        return 99.0
    w, d = weight[good], 200 * fine.view_r[good]
    scatter = np.sqrt((w * d**2).sum() / w.sum())
    n = max(w.sum() ** 2 / (w**2).sum(), 1.0)
    return float(np.hypot(4.0 * scatter / np.sqrt(n), 0.25))


def azimuth_spread(azimuth: np.ndarray) -> float:
    """Degrees of the circle between the views' azimuths: 360 minus the largest gap."""
    if len(azimuth) < 2:
        return 0.0
    ordered = np.sort(np.degrees(azimuth) % 360)
    gaps = np.diff(np.append(ordered, ordered[0] + 360))
    return float(360 - gaps.max())


def verdict(
    dbh_cm: float,
    polish_cm: float,
    r1: float,
    lean: float,
    score: float,
    gap: float,
    n_views: int,
    kish: float,
    se_cm: float,
    rms_px: float,
    options: PhotoStemOptions,
    lead: float = np.nan,
    contrast: float = np.nan,
    outline_cm: float = np.nan,
) -> tuple[Literal["ok", "check", "reject"], tuple[str, ...]]:
    """Accept, doubt or refuse. Wrong explanations show in a low likelihood, close rivals, ragged edges and a silhouette
    of another width. lead, contrast, outline_cm: as in :class:`StemFit`, NaN where no silhouette is to be had."""
    refuse: list[str] = []
    doubt: list[str] = []
    solid = contrast > 1.0

    def judge(reason: str, refused: bool, doubted: bool) -> None:
        if refused:
            refuse.append(reason)
        elif doubted:
            doubt.append(reason)

    judge("too_small", dbh_cm < options.dbh_min_cm, dbh_cm < 10)
    judge("too_large", dbh_cm > options.dbh_max_cm, False)
    measured, sure = (LLR_MEASURED, LLR_OK) if solid else (LLR_MEASURED_ALONE, LLR_OK_ALONE)
    judge("few_views", n_views < 3 or kish < 2.5 or score < measured, n_views < 5 or kish < 4 or score < sure)
    if not solid:
        ragged = rms_px > 0.555 and score < 100 or rms_px > 0.535 and score < 50
        judge("occluded", ragged, rms_px > 0.535 and score < 100 or contrast < FAINT)
    if np.isfinite(lead):
        judge("ambiguous", lead < LEAD_REFUSED, lead < LEAD_DOUBTFUL)
    else:
        judge("ambiguous", gap < 4, gap < 1 + DOUBTED_GAP)
    # With a silhouette, that is the second opinion; without one, the coarse stage has to do.
    if solid:
        off = abs(outline_cm + OUTLINE_OFFSET_CM - dbh_cm)
        refused, doubted = (max(limit_cm, share * dbh_cm) for limit_cm, share in (OUTLINE_REFUSE, OUTLINE_DOUBT))
    else:
        off, refused, doubted = abs(dbh_cm - polish_cm), 4.0, 2.8
    judge("disagree", off > refused, off > doubted)
    judge("no_taper", abs(r1 + 0.0045) > 0.008, abs(r1 + 0.0045) > 0.006)
    judge("lean", lean > np.tan(np.radians(27)), False)
    judge("wide_error", se_cm > 0.25 * dbh_cm, se_cm > 0.06 * dbh_cm)
    # One doubt is for the forester to look at; several together are how wrong explanations look.
    if refuse or len(doubt) >= 2:
        return "reject", tuple(dict.fromkeys(refuse + doubt))
    return ("check" if doubt else "ok"), tuple(doubt)
