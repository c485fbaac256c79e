"""One seed -> one fitted stem with its error, or the reason why not."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..quality.priors import START_TAPER
from .evidence.double_stem import find_twins
from .evidence.upper_band import reading_above
from .fit.edge_adjustment import NO_STEMS, FineFit, Sighting, refine
from .fit.null_model import BREAST, coarse_strips
from .fit.photo_fit import PhotoFit, seen_probability
from .fit.search import Hypothesis, Search, distinct, moved_to_edges
from .fit.selection import Explanation, choose
from .images.axis_patches import StemAxis
from .images.background import Silhouette, cut_silhouette
from .measurement import Fitted, Shared, measured
from .network.silhouettes import cut_bark, with_bark
from .propose.edge_voting import Seed
from .quality_control import Evidence
from .tuned import CHANCE_LLR, MAX_SETTLED, THERE_LLR, WINDOWS_PX


class _Place(NamedTuple):
    """About a seed. known: (K, 10) stems found before; shapes: (5,) each, what stands out from the ground, clearest
    first; clearest: contrast of the first, minus infinity where there is none."""

    start: StemAxis
    known: np.ndarray
    search: Search
    silhouette: Silhouette | None
    shapes: list[np.ndarray]
    clearest: float

    def vector(self, fine: FineFit) -> np.ndarray:
        """(5,) x, y, lx, ly, r of a fit, relative to the start."""
        return np.array([*(fine.axis.p - self.start.p), *(fine.axis.s - self.start.s), fine.r0])


class Fitter(Shared):
    """Fits stems on one stack of photos."""

    def silhouette(self, axis: StemAxis, band: tuple[float, float] | None = None) -> Silhouette:
        """Silhouettes about an axis: where no ground is seen and, with ``shown``, where the network sees a stem. band:
        heights above the ground, metres; ``None``: those of ``self.bands``."""
        assert self.backdrop is not None
        band = band or self.bands.silhouette
        silhouette = cut_silhouette(self.stack, self.backdrop, self.ground, axis, band)
        return silhouette if self.shown is None else with_bark(silhouette, cut_bark(self.shown, axis, band))

    def fit(self, seed: Seed, known: np.ndarray = NO_STEMS, quick: bool = False) -> PhotoFit | None:
        """Fit a seed. known: (K, 10) stems found before, whose edges are not this one's
        (:func:`.images.axis_patches.hide_known`). quick: only the best explanation (a first look).

        None where nothing can be fitted at all.
        """
        place = self._place(seed, known, quick)
        hypotheses = self._hypotheses(place, quick)
        if hypotheses is None:
            return None
        finalists = distinct(hypotheses)[:1] if quick else self._finalists(place, hypotheses)
        tried = self._tried(place, finalists, WINDOWS_PX[:1] if quick else WINDOWS_PX[:2])
        if not tried:
            return None
        if quick:
            best = max(tried, key=lambda item: item.edges)
            return measured(self, seed, Fitted(best, best.fine))
        found = self._chosen(place, self._compared(tried, known))
        fine, sighting = found.fine, Sighting(seen_probability(found.best.z), known, self.shown)
        fine = self._refine(fine.axis, fine.r0, fine.r1, sighting, WINDOWS_PX[2:], oval=True) or fine
        above_cm = np.nan
        if self.bands is BREAST:
            above_cm = reading_above(self.stack, fine, sighting, self.options.offset_sd_px, WINDOWS_PX)
        return measured(self, seed, found._replace(fine=fine, above_cm=above_cm))

    def refused(self, seed: Seed, reason: str = "occluded") -> PhotoFit:
        """A stem that is seen but that no pair of edges fits: its place, and no diameter."""
        return PhotoFit(
            axis=self._start(seed),
            r0=seed.r,
            r1=START_TAPER,
            evidence=Evidence(dbh_cm=200 * seed.r, refused=reason),
            seed_score=seed.score,
            seen=np.zeros(len(self.stack)),
        )

    def _start(self, seed: Seed) -> StemAxis:
        """A seed's axis, from the ground below it."""
        ground_z = float(self.ground.at(np.array([seed.x]), np.array([seed.y]))[0])
        return StemAxis(
            np.array([seed.x, seed.y]), np.array([seed.lx, seed.ly]), np.zeros(2), ground_z, self.options.bh_m
        )

    def _place(self, seed: Seed, known: np.ndarray, quick: bool) -> _Place:
        """Edges and silhouettes about a seed; quick: the silhouettes are not searched."""
        start = self._start(seed)
        strips, ridge, unit, border = coarse_strips(self.stack, start, self.options, self.sun, known, self.bands.coarse)
        search = Search(strips, ridge, unit, border, self.null, self.prior)
        silhouette = None if self.backdrop is None else self.silhouette(start)
        shapes = [] if silhouette is None or quick else silhouette.peaks(self.null.radii)
        clearest = silhouette.contrast(shapes[0]) if silhouette is not None and shapes else -np.inf
        return _Place(start, known, search, silhouette, shapes, clearest)

    def _hypotheses(self, place: _Place, quick: bool) -> list[Hypothesis] | None:
        """Stems by their edges, polished, best first; ``None`` where neither edges nor silhouettes are worth more."""
        stands_out = place.clearest > self.chance
        raw = place.search.hypotheses(0.24)
        if (not raw or raw[0].score < THERE_LLR) and not stands_out:
            return None
        share = 0.8 if quick else 0.3
        hypotheses = place.search.polish_all([m for m in raw if m.score > share * raw[0].score])
        hypotheses.sort(key=lambda m: -m.score)
        return hypotheses if stands_out or (hypotheses and hypotheses[0].score >= CHANCE_LLR) else None

    def _finalists(self, place: _Place, hypotheses: list[Hypothesis]) -> list[Hypothesis]:
        """The best of the edges' stems, wholes of which they may be parts, and what the silhouettes draw; less those
        that neither edges nor silhouettes speak for."""
        search, silhouette = place.search, place.silhouette
        best = [hypothesis for hypothesis in distinct(hypotheses)[:5] if hypothesis.score > 0.4 * hypotheses[0].score]
        drawn = search.polish_all([Hypothesis(*[*map(float, shape), 0.0]) for shape in place.shapes])
        if silhouette is not None and place.clearest > self.chance:
            drawn += [self._settled(search, silhouette, shape) for shape in place.shapes[:MAX_SETTLED]]
        finalists = distinct(best + (search.wholes(hypotheses[0]) if hypotheses else []) + drawn, 0.012, 0.006)
        score = max((hypothesis.score for hypothesis in finalists), default=0.0)
        contrast = [0.0 if silhouette is None else silhouette.contrast(hypothesis.vector) for hypothesis in finalists]
        most = max(contrast, default=0.0) if silhouette is not None else np.inf
        return [m for m, c in zip(finalists, contrast, strict=True) if m.score > 0.5 * score or c > 0.75 * most]

    def _tried(self, place: _Place, finalists: list[Hypothesis], windows_px: tuple[float, ...]) -> list[Explanation]:
        """Each of them refined in the photos that show it."""
        search, start, tried = place.search, place.start, []
        for hypothesis in finalists:
            seen = seen_probability(search.z(hypothesis.vector))
            axis = StemAxis(
                start.p + hypothesis.vector[:2],
                start.s + hypothesis.vector[2:4],
                np.zeros(2),
                start.ground_z,
                start.bh_m,
            )
            fine = self._refine(axis, hypothesis.r, START_TAPER, Sighting(seen, place.known), windows_px)
            if fine is None or fine.r0 < 0.015:
                continue
            vector = place.vector(fine)
            contrast = 0.0 if place.silhouette is None else place.silhouette.contrast(vector)
            tried.append(Explanation(search.score(vector), contrast, hypothesis, fine, vector, search.z(vector)))
        return tried

    def _chosen(self, place: _Place, tried: list[Explanation]) -> Fitted:
        """The stem among the explanations tried, and whether it is one."""
        trust = float(np.clip(place.clearest / self.chance, 0.0, 1.0)) if place.shapes else 0.0
        choice = choose(tried, trust, self.chance, self.prior, self.sun, self.shown is not None)
        twins = find_twins(place.search, choice.best.vector, place.silhouette)
        return Fitted(choice.best, choice.best.fine, choice.sure, place.silhouette, choice, twins=twins)

    def _compared(self, tried: list[Explanation], known: np.ndarray) -> list[Explanation]:
        """The same with evidence and residual over the same photos for all."""
        seen = np.max([seen_probability(item.z) for item in tried], axis=0)
        out = []
        for item in tried:
            fine = item.fine
            again = self._refine(fine.axis, fine.r0, fine.r1, Sighting(seen, known), WINDOWS_PX[2:])
            if again is not None:
                out.append(replace(item, evidence=again.evidence, rms_px=again.rms_px))
        return out or tried

    def _refine(
        self,
        axis: StemAxis,
        r0: float,
        r1: float,
        sighting: Sighting,
        windows_px: tuple[float, ...],
        oval: bool = False,
    ) -> FineFit | None:
        sd_px = self.options.offset_sd_px
        return refine(self.stack, axis, r0, r1, sighting, self.bands.fine, sd_px, windows_px, oval)

    def _settled(self, search: Search, silhouette: Silhouette, shape: np.ndarray) -> Hypothesis:
        p = moved_to_edges(search, silhouette, self.chance, shape)
        return Hypothesis(*[*map(float, p), search.score(p)])
