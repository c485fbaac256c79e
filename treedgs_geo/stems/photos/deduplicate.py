"""Which fits are stems, and which of several fits of one stem counts."""

from __future__ import annotations

import numpy as np

from .fit.photo_fit import PhotoFit
from .tuned import APART_M, CLEAR_LLR, FEW_LLR, GAIN_MERGED, LEAD_LLR, SAME_DBH, SAME_LEAN


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


def looked_at_twice(found: list[PhotoFit], refused: list[PhotoFit]) -> list[PhotoFit]:
    """What the second search found, less what the first look had refused as the same stem (place and lean) with another
    diameter: neither is to be trusted. With the same diameter it is flagged (``ambiguous``)."""
    kept = []
    for fit in found:
        before = [
            other
            for other in refused
            if np.hypot(*(fit.axis.p - other.axis.p)) < APART_M and np.hypot(*(fit.axis.s - other.axis.s)) < SAME_LEAN
        ]
        if any(abs(fit.dbh_cm - other.dbh_cm) > SAME_DBH.at(fit.dbh_cm) for other in before):
            continue
        kept.append(fit.with_rival(fit.dbh_cm) if before and fit.flag == "ok" else fit)
    return kept


def one_stem(apart_m: float, one_m: float, other_m: float) -> bool:
    """Whether discs of these radii (m) overlap so far that they are one stem. apart_m: between their middles."""
    return bool(apart_m < 0.7 * (one_m + other_m) + 0.05)


def merge(fits: list[PhotoFit]) -> list[PhotoFit]:
    """One entry a stem: measured ones first, best first; what overlaps a better one is dropped. One that is nearly as
    good and reads another diameter stays open beside the better one."""
    kept: list[PhotoFit] = []
    for fit in sorted(fits, key=lambda f: (not f.measured, -single_llr(f))):
        near = [n for n, k in enumerate(kept) if one_stem(np.hypot(*(fit.axis.p - k.axis.p)), fit.r0, k.r0)]
        if not near:
            kept.append(fit)
            continue
        best = kept[near[0]]
        apart = abs(fit.dbh_cm - best.dbh_cm)
        rival = fit.measured and single_llr(fit) > single_llr(best) - LEAD_LLR
        if rival and apart > SAME_DBH.at(best.dbh_cm):
            kept[near[0]] = best.with_rival(fit.dbh_cm)
    return kept


def single_llr(fit: PhotoFit) -> float:
    """Edge score of the best single stem at the place: two stems explain any place better than one."""
    return fit.evidence.llr - fit.evidence.gain if fit.evidence.gain > GAIN_MERGED else fit.evidence.llr
