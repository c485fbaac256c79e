"""What the search of a piece of ground learns first - where the sun stood, how thick the stand's stems are, how much
contrast chance reaches, how soft the photos are - and what is kept of it, so that a further stem is fitted there as
the others were."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...core.progress import Reporter
from ...reconstruction.area import Area
from .fit.null_model import build_null
from .fit.search import Prior
from .images.axis_patches import StemAxis
from .images.background import Backdrop, Silhouette
from .images.crops import GroundGrid, PhotoStack
from .images.sharpness import soft_px
from .images.sun import sun_azimuths
from .network.inference import OddsMaps
from .options import PhotoStemOptions
from .propose.edge_voting import Proposals, Seed
from .stem_fit import Fitter
from .tuned import MIN_PLACES, PRIOR_SDS, STEM_FREE_M, THERE_LLR


@dataclass(frozen=True)
class Look:
    """Of one piece of ground."""

    #: The network was asked.
    network: bool
    #: (flights,) azimuth of the sun, rad from east, NaN = unknown.
    sun: np.ndarray
    #: Radius of the stand's stems at breast height and its standard deviation, m.
    r: float
    r_sd: float
    #: Silhouette contrast that places without a stem reach, infinite where silhouettes say nothing.
    chance: float
    #: (N, 2) random places that chance is measured at, local frame.
    places: np.ndarray
    #: Of the photos (:func:`.images.sharpness.soft_px`), px.
    soft_px: float = 0.0

    def fitter(
        self,
        stack: PhotoStack,
        grid: GroundGrid,
        options: PhotoStemOptions,
        backdrop: Backdrop | None,
        shown: OddsMaps | None,
    ) -> Fitter:
        """The fitter of the search. stack, grid: of the same piece of ground, with the same options. backdrop: the
        ground behind the stems. shown: what the network takes for bark."""
        null = build_null(stack, grid, self.places, options, self.sun)
        known = stack, grid, options, null, self.sun, Prior(r=self.r, r_sd=self.r_sd), backdrop, self.chance
        return Fitter(*known, shown=shown, soft_px=self.soft_px)


def look_of(fitter: Fitter, places: np.ndarray) -> Look:
    """What to keep of a search. places: (N, 2) at which its null scores were measured."""
    prior = fitter.prior
    return Look(fitter.shown is not None, fitter.sun, prior.r, prior.r_sd, float(fitter.chance), places, fitter.soft_px)


def first_look(
    stack: PhotoStack,
    grid: GroundGrid,
    proposals: Proposals,
    places: np.ndarray,
    options: PhotoStemOptions,
    reporter: Reporter,
) -> Look:
    """Fit the clearest stems once to learn where the sun stood and how thick the stand's stems are. places: (N, 2)
    random ones. Says where the photos are soft."""
    unknown = np.full(max(view.flight for view in stack.views) + 1, np.nan)
    fitter = Fitter(stack, grid, options, build_null(stack, grid, places, options, unknown), unknown)
    clear = [
        fit
        for fit in (fitter.fit(seed, quick=True) for seed in proposals.seeds[:30] if seed.score > proposals.threshold)
        if fit and fit.evidence.llr > THERE_LLR
    ]
    sun = sun_azimuths(stack, [(fit.axis, fit.r0, fit.seen) for fit in clear])
    prior = Prior()
    radii = np.array([fit.r0 for fit in clear])
    if len(radii) >= 6:
        prior = Prior(r=float(np.median(radii)), r_sd=float(max(PRIOR_SDS * radii.std(), 0.06)))
    soft = soft_px(stack, reporter)
    return Look(False, sun, prior.r, prior.r_sd, np.inf, places, soft)


def with_chance(fitter: Fitter, places: np.ndarray) -> Fitter:
    """The same, with the contrast that chance reaches at (N, 2) places."""
    if fitter.backdrop is None:
        return fitter
    chance = chance_contrast(fitter.silhouette, fitter.ground, places, fitter.null.radii, fitter.options.bh_m)
    return replace(fitter, chance=chance)


def away_from(seeds: list[Seed], places: np.ndarray) -> np.ndarray:
    """Those of (N, 2) places that lie away from all seeds; all, if there are few of these."""
    if not seeds:
        return places
    gap = np.min([np.hypot(places[:, 0] - seed.x, places[:, 1] - seed.y) for seed in seeds], axis=0)
    return places[gap > STEM_FREE_M] if (gap > STEM_FREE_M).sum() >= MIN_PLACES else places


def chance_contrast(
    outline_of: Callable[[StemAxis], Silhouette], ground: GroundGrid, places: np.ndarray, radii: np.ndarray, bh_m: float
) -> float:
    """Silhouette contrast that a place without a stem hardly reaches: twice the median of the best at (N, 2) random
    places (a few of which may well hold a stem)."""
    best = []
    for place in places:
        foot = float(ground.at(place[:1], place[1:])[0])
        outline = outline_of(StemAxis(place, np.zeros(2), np.zeros(2), foot, bh_m))
        best.append(max((outline.contrast(shape) for shape in outline.peaks(radii, most=1)), default=0.0))
    return 2.0 * max(float(np.median(best)), 1e-6)


def random_places(tile: Area, rng: np.random.Generator, n: int = 16) -> np.ndarray:
    """(n, 2) places spread evenly over the circles of a piece of ground, local frame."""
    k = rng.integers(len(tile.radii_m), size=n)
    angle, far = rng.uniform(0, 2 * np.pi, n), np.sqrt(rng.uniform(size=n))
    return tile.centres[k] + (tile.radii_m[k] * far)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
