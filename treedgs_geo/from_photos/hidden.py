"""Stems that nothing shows at breast height: measured farther up, and the diameter carried down by the usual taper."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core.progress import Reporter
from ..trees.limits import judge
from .chance import ABOVE
from .detect import Seed
from .fit import Fitter, PhotoFit
from .settle import known_rows

#: What refuses a stem for good: farther up it is no other.
_FOR_GOOD = frozenset({"too_small", "too_large", "lean", "covered"})
#: What leaves it open which stem that is: not to be carried anywhere. Nor is what more than one reason speaks against.
_OPEN = frozenset({"ambiguous", "merged"})
#: The stem found above stands this close to where it was looked for, m.
_NEAR_M = 0.3


def carried_down(fits: list[PhotoFit], fitter: Fitter, reporter: Reporter) -> list[PhotoFit]:
    """The fits; refused ones that can be measured 2 to 5 m above the ground are measured there.

    Their diameters are those at breast height by the taper that is usual for stems, their errors larger; they are
    flagged (``carried_down``). fitter: as the fits were made.
    """
    known, above, out = known_rows(fits), replace(fitter, bands=ABOVE), []
    for done, fit in enumerate(fits):
        reporter.progress(done / len(fits))
        found = None if fit.measured or set(fit.reasons) <= _FOR_GOOD else _above(fit, above, known)
        if found is None:
            out.append(fit)
            continue
        out.append(found)
        known = np.vstack([known, found.row])
    return out


def _above(fit: PhotoFit, above: Fitter, known: np.ndarray) -> PhotoFit | None:
    """The refused stem as its upper part shows it; ``None`` where that is refused too."""
    (x, y), (lx, ly) = fit.axis.p, fit.axis.s
    found = above.fit(Seed(float(x), float(y), float(lx), float(ly), fit.r0, fit.seed_score, True), known)
    if found is None or not found.measured or np.hypot(*(found.axis.p - fit.axis.p)) > _NEAR_M:
        return None
    if _OPEN & set(found.reasons) or len(found.reasons) > 1:
        return None
    far = judge("photos", {"carried_m": sum(ABOVE.fine) / 2 - found.axis.bh_m})
    return replace(found, flag="check", reasons=(*found.reasons, *far.reasons), carried=True)
