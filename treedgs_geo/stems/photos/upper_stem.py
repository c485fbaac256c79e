"""Stems that nothing shows at breast height: measured farther up, and the diameter carried down by a taper that is the
plot's own more than the stem's.

A stem that only shows 2 to 5 m above the ground has few edges there, and the slope of its radius that they give,
carried down by 2.2 m, would be most of its error. The other stems of the plot say better what a stem loses on the way:
the mean slope of those that are seen well differs from their true loss between breast height and 3.6 m by 0.2 cm at
most (five plots of two renderers; ``docs/evidence/photos.md``), and stems differ from it by
``priors.TAPER_SD``. Butts swell below the heights that are fitted (0.6 m) and are not in it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...core.progress import Reporter
from ..quality.priors import TAPER_SD, USUAL_TAPER
from .deduplicate import known_rows, plausible
from .evidence.error_budget import formal_error_cm
from .fit.edge_adjustment import USUAL, FineFit, Sighting, TaperPrior, refine
from .fit.null_model import ABOVE
from .fit.photo_fit import PhotoFit
from .propose.edge_voting import Seed
from .stem_fit import Fitter
from .tuned import ERROR_WEIGHTS, START_M, WINDOWS_PX

#: What refuses a stem for good: farther up it is no other.
_FOR_GOOD = frozenset({"too_small", "too_large", "lean", "covered"})


def carried_down(fits: list[PhotoFit], fitter: Fitter, reporter: Reporter) -> list[PhotoFit]:
    """The fits; refused ones that can be measured 2 to 5 m above the ground are measured there.

    Their diameters are those at breast height by the taper of the plot's stems, their errors larger; they are flagged
    (``carried_down``). fitter: as the fits were made.
    """
    known, above, out = known_rows(fits), replace(fitter, bands=ABOVE), []
    taper = stand_taper(fits)
    for done, fit in enumerate(fits):
        reporter.progress(done / len(fits))
        found = None if fit.measured or set(fit.reasons) <= _FOR_GOOD else measured_above(fit, above, known)
        if found is None:
            out.append(fit)
            continue
        found = held_to(taper, found, above, known)
        out.append(found)
        known = np.vstack([known, found.row])
    return out


def measured_above(fit: PhotoFit, above: Fitter, known: np.ndarray) -> PhotoFit | None:
    """The stem as its upper part shows it, carried down by its own taper; ``None`` where that is not certain. above:
    the fitter at the heights of :data:`.fit.null_model.ABOVE`. known: (K, 10) other stems."""
    (x, y), (lx, ly) = fit.axis.p, fit.axis.s
    found = above.fit(Seed(float(x), float(y), float(lx), float(ly), fit.r0, fit.seed_score, True), known)
    if (
        found is None
        or found.flag != "ok"
        or not plausible(found, np.inf)
        or np.hypot(*(found.axis.p - fit.axis.p)) > START_M
    ):
        return None
    return found.knowing(carried_m=sum(ABOVE.fine) / 2 - found.axis.bh_m)


def held_to(taper: TaperPrior, found: PhotoFit, above: Fitter, known: np.ndarray) -> PhotoFit:
    """What :func:`measured_above` found, with its slope held to ``taper``, and its error for that.

    Formal errors are too small by their weight in :data:`.tuned.ERROR_WEIGHTS`, since edges of one stem err together:
    so is what its few edges say of the slope, and the spread of the prior is divided by as much. The error of the
    diameter is then that of both, over the 2.2 m that it is carried.
    """
    free, held = (_refined(found, above, known, prior) for prior in (USUAL, _as_formal(taper)))
    if free is None or held is None:
        return found
    moved_m, seen, (formal, oval) = held.r0 - free.r0, found.evidence, formal_error_cm(held)
    dbh_cm, outline_cm = seen.dbh_cm + 200 * moved_m, seen.outline_cm + 200 * moved_m
    error = seen.error and seen.error._replace(formal=formal, oval=oval)
    found = replace(found, r0=found.r0 + moved_m, r1=held.r1)
    return found.knowing(dbh_cm=dbh_cm, error=error, outline_cm=outline_cm)


def stand_taper(fits: list[PhotoFit]) -> TaperPrior:
    """What the next stem's slope is expected to be: the mean over the stems that are ``ok``, with that of other stands
    (``priors.USUAL_TAPER``) as prior, and the spread of stems about it."""
    slopes = np.array([fit.r1 for fit in fits if fit.flag == "ok" and not fit.carried])
    spread = max(float(slopes.std()), TAPER_SD) if len(slopes) else TAPER_SD
    # Stands differ from each other about as much as stems of one stand do.
    of_stand, of_stems = 1 / TAPER_SD**2, len(slopes) / spread**2
    mean = (of_stand * USUAL_TAPER + float(slopes.sum()) / spread**2) / (of_stand + of_stems)
    return TaperPrior(mean, float(np.sqrt(TAPER_SD**2 + 1 / (of_stand + of_stems))))


def _as_formal(taper: TaperPrior) -> TaperPrior:
    return taper._replace(sd=taper.sd / ERROR_WEIGHTS["formal"])


def _refined(found: PhotoFit, above: Fitter, known: np.ndarray, taper: TaperPrior) -> FineFit | None:
    sighting, sd_px = Sighting(found.seen, known, above.shown), above.options.offset_sd_px
    window = WINDOWS_PX[2:]
    return refine(above.stack, found.axis, found.r0, found.r1, sighting, ABOVE.fine, sd_px, window, True, taper)
