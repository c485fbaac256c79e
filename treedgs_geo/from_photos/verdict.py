"""Accept a fitted stem, doubt it or refuse it."""

from __future__ import annotations

from typing import Literal

import numpy as np

from .choice import LOW_CONFIDENCE_GAP
from .options import PhotoStemOptions

#: How probable the chosen diameter has to be among the explanations (:func:`.choice.choose`): below the first refused,
#: below the second doubtful.
SURE_MEASURED, SURE_OK = 0.50, 0.90
#: Gain of "another stem touches it" over one stem (log likelihood units) from which that is doubted, and from which it
#: is taken for true.
GAIN_LOW_CONFIDENCE, GAIN_MERGED = 38.0, 62.0
#: Gain from which such a pair is fitted and weighed against one stem (one in forty); at :data:`GAIN_LOW_CONFIDENCE` it
#: is one in ten, at :data:`GAIN_MERGED` nine in ten.
GAIN_WEIGHED = 30.0
#: Edge score (log likelihood ratio) from which a stem is measured and from which without doubt: where the silhouette
#: stands out, and where the edges are all there is (chance reaches about 45).
LLR_MEASURED, LLR_OK = 18.0, 35.0
LLR_MEASURED_ALONE, LLR_OK_ALONE = 52.0, 60.0
#: Silhouette contrast (of what chance reaches) below which a stem is doubted.
FAINT = 0.7
#: The silhouette reads this much thinner than the edges (cm): ground shows through at the blurred rim. And how far it
#: may be off before the tree is doubted or refused, cm and share of the diameter.
OUTLINE_OFFSET_CM, OUTLINE_LOW_CONFIDENCE, OUTLINE_REFUSE = 1.0, (2.5, 0.10), (4.0, 0.18)


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
    sure: float = np.nan,
    contrast: float = np.nan,
    outline_cm: float = np.nan,
    gain: float = 0.0,
) -> tuple[Literal["ok", "check", "reject"], tuple[str, ...]]:
    """Accept, doubt or refuse. Wrong explanations show in a low likelihood, close rivals, ragged edges and a silhouette
    of another width. sure, contrast, outline_cm: as in :class:`StemFit`, NaN where no silhouette is to be had.
    gain: of a pair of stems over one (log likelihood units)."""
    refuse: list[str] = []
    doubt: list[str] = []
    solid = contrast > 1.0

    def judge(reason: str, refused: bool, doubted: bool) -> None:
        if refused:
            refuse.append(reason)
        elif doubted:
            doubt.append(reason)

    judge("too_small", dbh_cm < options.min_dbh_cm, dbh_cm < 10)
    judge("too_large", dbh_cm > options.max_dbh_cm, False)
    enough, plenty = (LLR_MEASURED, LLR_OK) if solid else (LLR_MEASURED_ALONE, LLR_OK_ALONE)
    thin = n_views < 5 or kish < 4
    judge("few_views", n_views < 3 or kish < 2.5 or score < enough, thin or score < plenty)
    if not solid:
        ragged = rms_px > 0.555 and score < 100 or rms_px > 0.535 and score < 50
        judge("occluded", ragged, rms_px > 0.535 and score < 100 or contrast < FAINT)
    if np.isfinite(sure):
        judge("ambiguous", sure < SURE_MEASURED, sure < SURE_OK)
    else:
        judge("ambiguous", gap < 4, gap < 1 + LOW_CONFIDENCE_GAP)
    # With a silhouette, that is the second opinion; without one, the coarse stage has to do.
    if solid:
        off = abs(outline_cm + OUTLINE_OFFSET_CM - dbh_cm)
        refused, doubted = (
            max(limit_cm, share * dbh_cm) for limit_cm, share in (OUTLINE_REFUSE, OUTLINE_LOW_CONFIDENCE)
        )
    else:
        off, refused, doubted = abs(dbh_cm - polish_cm), 4.0, 2.8
    judge("disagree", off > refused, off > doubted)
    judge("no_taper", abs(r1 + 0.0045) > 0.008, abs(r1 + 0.0045) > 0.006)
    judge("merged", False, gain > GAIN_LOW_CONFIDENCE)
    judge("lean", lean > np.tan(np.radians(27)), False)
    pair = gain > GAIN_MERGED
    judge("wide_error", se_cm > 0.25 * dbh_cm, se_cm > 0.06 * dbh_cm and not pair)
    # One doubt is for the forester to look at; several together are how wrong explanations look. But a possible
    # companion is a doubt of its own only where the diameter is unsure as well; and where the explanations were weighed
    # against each other, a low edge score and a silhouette somewhat off are in that balance already.
    count = len(doubt) - ("merged" in doubt and not {"ambiguous", "disagree"} & set(doubt))
    if np.isfinite(sure):
        count -= ("few_views" in doubt and not thin) + ("disagree" in doubt and "merged" not in doubt)
    if refuse or count >= 2:
        return "reject", tuple(dict.fromkeys(refuse + doubt))
    return ("check" if doubt else "ok"), tuple(doubt)


def companion_share(gain: float) -> float:
    """Probability that another stem touches this one, from the gain of the pair (log likelihood units)."""
    middle, spread = 0.5 * (GAIN_LOW_CONFIDENCE + GAIN_MERGED), (GAIN_MERGED - GAIN_LOW_CONFIDENCE) / (2 * np.log(9))
    return float(1 / (1 + np.exp((middle - gain) / spread)))
