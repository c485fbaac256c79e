"""Which fits are stems, and which of several fits of one stem counts."""

from __future__ import annotations

import numpy as np

from .fit.photo_fit import PhotoFit
from .tuned import CLEAR_LLR, FEW_LLR, LEAD_LLR


def known_rows(fits: list[PhotoFit]) -> np.ndarray:
    """(K, 10) of the measured stems, for :func:`.images.axis_patches.hide_known`."""
    return np.array([fit.row for fit in fits if fit.measured]).reshape(-1, 10)


def plausible(fit: PhotoFit, gate: float) -> bool:
    """Is this a stem at all? What the search itself did not find has to be seen the more clearly in the fit."""
    if fit.evidence.solid and fit.evidence.llr >= FEW_LLR:
        return fit.seed_score >= gate or fit.measured
    if fit.seed_score >= gate:
        return fit.evidence.llr >= LEAD_LLR
    return fit.evidence.llr >= CLEAR_LLR and fit.measured


def one_stem(apart_m: float, one_m: float, other_m: float) -> bool:
    """Whether discs of these radii (m) overlap so far that they are one stem. apart_m: between their middles."""
    return bool(apart_m < 0.7 * (one_m + other_m) + 0.05)


def merge(fits: list[PhotoFit]) -> list[PhotoFit]:
    """One entry a stem: measured ones first, best first; what overlaps a better one is dropped."""
    kept: list[PhotoFit] = []
    for fit in sorted(fits, key=lambda f: (not f.measured, -f.evidence.llr)):
        if not any(one_stem(np.hypot(*(fit.axis.p - other.axis.p)), fit.r0, other.r0) for other in kept):
            kept.append(fit)
    return kept
