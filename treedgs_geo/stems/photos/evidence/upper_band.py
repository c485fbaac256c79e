"""The same stem farther up: a second reading of its diameter, carried down to breast height.

Shrubs, saplings and light patches spoil the edges of one stretch of a stem; 2 to 5 m up they are other ones. The edges
there are weighed as at breast height, with the usual taper as prior, so that their reading errs differently. What both
say is averaged, and where they differ the error is larger. Figures: ``docs/evidence/photos.md``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..fit.edge_adjustment import FineFit, Sighting, refine
from ..fit.null_model import ABOVE
from ..images.crops import PhotoStack

#: Standard error of the reading from above, cm: the weight of each reading is its inverse variance. Least squares on 80
#: stems of six hard simulated plots (seeds 421 to 426); 35 stems of open ones lose nothing by it.
ABOVE_SE_CM = 0.9
#: A standard error of the fit counts up to this here, cm: what is more unsure is no better known from above.
MAX_SE_CM = 1.0
#: More than this (and this share of the diameter) it does not say: limbs of a fork, another stem.
MAX_CM, MAX_SHARE = 3.0, 0.08
#: A photo may show the stem there even where something hides it at breast height: at least this probable.
SEEN_AT_LEAST = 0.3


def reading_above(
    stack: PhotoStack, fine: FineFit, sighting: Sighting, offset_sd_px: float, windows_px: tuple[float, ...]
) -> float:
    """By how much the edges above make the diameter at breast height thicker, cm; NaN where too few are found.

    offset_sd_px, windows_px: as for :func:`.fit.edge_adjustment.refine`.
    """
    looked = replace(sighting, seen=np.maximum(sighting.seen, SEEN_AT_LEAST), skip=None)
    found = refine(stack, fine.axis, fine.r0, fine.r1, looked, ABOVE.fine, offset_sd_px, windows_px, oval=True)
    if found is None:
        return np.nan
    most = max(MAX_CM, 200 * MAX_SHARE * fine.r0)
    return float(np.clip(200 * (found.r0 - fine.r0), -most, most))


def weight_above(se_cm: float) -> float:
    """0..1, of the reading from above beside a fit with this standard error (cm)."""
    variance = min(se_cm, MAX_SE_CM) ** 2
    return variance / (variance + ABOVE_SE_CM**2)


def averaged(fine: FineFit, se_cm: float, above_cm: float) -> tuple[FineFit, float]:
    """The fit with its radius at breast height moved by the weight of what the reading from above says, and its
    standard error (cm), to which the weighted difference adds. se_cm: of the fit alone."""
    if not np.isfinite(above_cm):
        return fine, se_cm
    moved_cm = weight_above(se_cm) * above_cm
    return replace(fine, r0=fine.r0 + moved_cm / 200), float(np.hypot(se_cm, moved_cm))
