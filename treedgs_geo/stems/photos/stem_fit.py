"""One seed -> one fitted stem with its error, or the reason why not."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .coarse import SEEN_MEAN_Z, SEEN_PRIOR, Z_CAP, Mode, Null, NullBuilder, Prior, Search, terminators
from .detect import Seed
from .fine import NO_STEMS, FineFit, refine
from .options import PhotoStemOptions
from .stack import GroundGrid, PhotoStack
from .strips import Axis, cut_strips, draw_ridges, hide_known

#: The band that is searched (m above ground) and the one that is fitted.
COARSE_BAND = 0.5, 3.3
FINE_BAND = 0.3, 3.5
#: A view counts as seeing the stem above this z-score.
CLEAR_Z = 2.5
#: Scores on the grid and after polishing below which a seed is not worth refining.
MIN_RAW, MIN_POLISHED = 38.0, 50.0
#: Log likelihood ratio from which a stem is measured, and from which without doubt (chance reaches about 45).
LLR_MEASURED, LLR_OK = 52.0, 60.0
#: Lead over the next explanation that still leaves a doubt.
DOUBTED_GAP = 9.0


@dataclass(frozen=True)
class StemFit:
    """A stem as the photos show it, local frame.

    axis: stem axis, ``axis.p`` at breast height. r0, r1: radius at breast height (m) and its slope (m/m).
    dbh_cm, se_cm: diameter and its standard error given that the right edges were found. flag: ok, check or reject;
    reasons: keys of ``measure.quality.REASONS``. seed_score: of the detection. llr: log likelihood ratio of the fit.
    gap: its lead over the next different explanation. n_views: photos that see it clearly. kish: effective photos.
    arc_deg: spread of their azimuths. rms_px: edge residual. polish_cm: diameter of the coarse stage. seen: (V,)
    probability that each photo sees it.
    """

    axis: Axis
    r0: float
    r1: float
    dbh_cm: float
    se_cm: float
    flag: str
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
    """What all fits on one stack of photos share. sun: (flights,) azimuth, rad from east, NaN = unknown."""

    stack: PhotoStack
    ground: GroundGrid
    options: PhotoStemOptions
    null: Null
    sun: np.ndarray
    prior: Prior = Prior()

    def fit(self, seed: Seed, known: np.ndarray = NO_STEMS, quick: bool = False) -> StemFit | None:
        """Fit a seed. known: (K, 10) stems found before, whose edges are not this one's (:func:`.strips.hide_known`).
        quick: only the best explanation (a first look).

        None where nothing can be fitted at all.
        """
        ground_z = float(self.ground.at(np.array([seed.x]), np.array([seed.y]))[0])
        start = Axis(np.array([seed.x, seed.y]), np.array([seed.lx, seed.ly]), np.zeros(2), ground_z, self.options.bh_m)
        strips, ridge, unit, border = _coarse_strips(self.stack, start, self.options, self.sun, known)
        search = Search(strips, ridge, unit, border, self.null, self.prior)
        raw = search.modes(0.24)
        if not raw or raw[0].score < MIN_RAW:
            return None
        share = 0.8 if quick else 0.4
        modes = sorted((search.polish(m) for m in raw if m.score > share * raw[0].score), key=lambda m: -m.score)
        if modes[0].score < MIN_POLISHED:
            return None
        tried = []
        finalists = [mode for mode in distinct(modes)[:4] if mode.score > 0.5 * modes[0].score]
        finalists = finalists[:1] if quick else distinct(finalists + search.wholes(modes[0]), 0.012, 0.006)
        for mode in finalists:
            seen = seen_probability(search.z(mode.vector))
            axis = Axis(start.p + mode.vector[:2], start.s + mode.vector[2:4], np.zeros(2), ground_z, self.options.bh_m)
            fine = refine(self.stack, axis, mode.r, -0.0045, seen, *FINE_BAND, self.options.offset_sd_px,
                          cuts=1 if quick else 3, known=known)
            if fine is None or fine.r0 < 0.015:
                continue
            vector = np.array([*(fine.axis.p - start.p), *(fine.axis.s - start.s), fine.r0])
            tried.append((search.score(vector), mode, fine, vector))
        if not tried:
            return None
        tried.sort(key=lambda item: -item[0])
        best = prefer_whole(tried, self.sun)
        score, mode, fine, vector = best
        # A part of the chosen stem is no rival of the whole; where it won by far there is doubt all the same.
        others = [item for item in tried if different(item[3], vector)]
        parts = [item[0] for item in others if contains(vector, item[3])]
        gap = score - max([item[0] for item in others if not contains(vector, item[3])], default=0.0)
        if parts and max(parts) > 1.25 * score:
            gap = min(gap, DOUBTED_GAP)
        z = search.z(vector)
        final = None if quick else refine(self.stack, fine.axis, fine.r0, fine.r1, seen_probability(z), *FINE_BAND,
                       self.options.offset_sd_px, cuts=1, windows_px=(2.2,), known=known)
        return self._judge(seed, mode, final or fine, score, gap, z)

    def _judge(self, seed: Seed, mode: Mode, fine: FineFit, score: float, gap: float, z: np.ndarray) -> StemFit:
        weight = fine.view_weight * seen_probability(z)
        kish = float(weight.sum() ** 2 / max((weight**2).sum(), 1e-12))
        clear = z > CLEAR_Z
        se = standard_error_cm(fine, weight)
        azimuth = np.arctan2(fine.axis.p[1] - self.stack.centre[clear, 1], fine.axis.p[0] - self.stack.centre[clear, 0])
        dbh = 200 * fine.r0
        flag, reasons = verdict(dbh, 200 * mode.r, fine.r1, float(np.hypot(*fine.axis.s)), score, gap, int(clear.sum()),
                                kish, se, fine.rms_px, self.options)
        return StemFit(axis=fine.axis, r0=fine.r0, r1=fine.r1, dbh_cm=dbh, se_cm=se, flag=flag, reasons=reasons,
                       seed_score=seed.score, llr=score, gap=gap, n_views=int(clear.sum()), kish=kish,
                       arc_deg=azimuth_spread(azimuth), rms_px=fine.rms_px, polish_cm=200 * mode.r,
                       seen=seen_probability(z))


def _coarse_strips(stack: PhotoStack, axis: Axis, options: PhotoStemOptions, sun: np.ndarray,
                   known: np.ndarray = NO_STEMS) -> tuple:
    reach = options.dbh_max_cm / 200 + 0.37
    strips = cut_strips(stack, axis, *COARSE_BAND, 0.28, 0.04, reach, 0.01, 1.0, linear=False)
    hide_known(strips, stack, axis, known)
    ridge, unit = draw_ridges(strips.coherence, strips.gradient, 1.3)
    flights = np.array([view.flight for view in stack.views], int)
    return strips, ridge, unit, terminators(strips.normal, sun[flights])


def build_null(stack: PhotoStack, ground: GroundGrid, places: np.ndarray, options: PhotoStemOptions,
               sun: np.ndarray) -> Null:
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


def prefer_whole(tried: list[tuple], sun: np.ndarray) -> tuple:
    """The best explanation, or a larger one that holds it and explains nearly as much (the shaded part of a stem is no
    stem); less is enough where the larger one grows towards the sun."""
    best = tried[0]
    for item in tried[1:]:
        if not contains(item[3], best[3]):
            continue
        grown = np.arctan2(item[3][1] - best[3][1], item[3][0] - best[3][0])
        sunward = np.isfinite(sun).any() and np.nanmax(np.cos(grown - sun)) > 0.6
        if item[0] > (0.6 if sunward else 0.8) * best[0]:
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


def verdict(dbh_cm: float, polish_cm: float, r1: float, lean: float, score: float, gap: float, n_views: int,
            kish: float, se_cm: float, rms_px: float, options: PhotoStemOptions) -> tuple[str, tuple[str, ...]]:
    """Accept, doubt or refuse. Wrong explanations show in a low likelihood, close rivals and ragged edges."""
    refuse, doubt = [], []
    if dbh_cm < options.dbh_min_cm:
        refuse.append("too_small")
    elif dbh_cm < 10:
        doubt.append("too_small")
    if dbh_cm > options.dbh_max_cm:
        refuse.append("too_large")
    if n_views < 3 or kish < 2.5 or score < LLR_MEASURED:
        refuse.append("few_views")
    elif n_views < 5 or kish < 4 or score < LLR_OK:
        doubt.append("few_views")
    if rms_px > 0.555 and score < 100 or rms_px > 0.535 and score < 50:
        refuse.append("occluded")
    elif rms_px > 0.535 and score < 100:
        doubt.append("occluded")
    if gap < 4:
        refuse.append("ambiguous")
    elif gap < 1 + DOUBTED_GAP:
        doubt.append("ambiguous")
    if abs(r1 + 0.0045) > 0.008:
        refuse.append("no_taper")
    elif abs(r1 + 0.0045) > 0.006:
        doubt.append("no_taper")
    if abs(dbh_cm - polish_cm) > 4:
        refuse.append("disagree")
    elif abs(dbh_cm - polish_cm) > 2.8:
        doubt.append("disagree")
    if lean > np.tan(np.radians(25)):
        refuse.append("lean")
    if se_cm > 0.25 * dbh_cm:
        refuse.append("wide_error")
    elif se_cm > 0.06 * dbh_cm:
        doubt.append("wide_error")
    # One doubt is for the forester to look at; several together are how wrong explanations look.
    if refuse or len(doubt) >= 2:
        return "reject", tuple(dict.fromkeys(refuse + doubt))
    return ("check" if doubt else "ok"), tuple(doubt)
