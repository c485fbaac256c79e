"""Seeds become fits, strongest first; what a fitted stem explains is hidden from the later ones."""

from __future__ import annotations

import numpy as np

from ...core.progress import Reporter
from .deduplicate import known_rows, plausible
from .fit.edge_adjustment import NO_STEMS
from .fit.photo_fit import PhotoFit
from .propose.edge_voting import EdgeSeeds, Seed
from .stem_fit import Fitter

#: Seeds this far below the threshold are still fitted (log likelihood units), and how many at most.
REACH_BELOW, MAX_SEEDS = 22.0, 90
#: Second stems are looked for this close to a found one, m, at so many places at most.
BESIDE_MAX_M, MAX_BESIDE = 0.6, 40


def fits_of_seeds(
    fitter: Fitter, seeds: list[Seed], threshold: float, reporter: Reporter, known: np.ndarray = NO_STEMS
) -> list[PhotoFit]:
    """The seeds that are stems. threshold: score that chance hardly reaches. known: (K, 10) stems that stand there."""
    fits: list[PhotoFit] = []
    waiting = [seed for seed in seeds if seed.score > threshold - REACH_BELOW][:MAX_SEEDS]
    for tried, seed in enumerate(waiting):
        reporter.progress(tried / len(waiting))
        if (np.hypot(known[:, 0] - seed.x, known[:, 1] - seed.y) < known[:, 8] + 0.08).any():
            continue
        fit = fitter.fit(seed, known)
        if fit is None and seed.sure:
            fit = fitter.refused(seed)
        if fit is None or not (seed.sure or plausible(fit, threshold)):
            continue
        fits.append(fit)
        if fit.measured:
            known = np.vstack([known, fit.row])
    return fits


def fits_of_edges(fitter: Fitter, seen: list[Seed], edges: EdgeSeeds, reporter: Reporter) -> list[PhotoFit]:
    """Stems at what the network sees, at what edges propose, and second ones beside them (limbs of low forks, twins),
    which the first round's spacing passed over."""
    fits = fits_of_seeds(fitter, seen, 1.0, reporter)
    fits += fits_of_seeds(fitter, edges.seeds, edges.threshold, reporter, known_rows(fits))
    known = known_rows(fits)
    done = np.array([(seed.x, seed.y) for seed in edges.seeds]).reshape(-1, 2)
    close = []
    for seed in edges.beside:
        gap = np.hypot(known[:, 0] - seed.x, known[:, 1] - seed.y)
        again = (np.hypot(done[:, 0] - seed.x, done[:, 1] - seed.y) < 0.02).any()
        if seed.score > edges.threshold and not again and (gap < BESIDE_MAX_M).any():
            close.append(seed)
    return fits + fits_of_seeds(fitter, close[:MAX_BESIDE], edges.threshold, reporter, known)
