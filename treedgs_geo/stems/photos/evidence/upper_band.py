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
from ..quality_control import ErrorParts
from ..tuned import ABOVE_SE_CM, MAX_MOVED, MAX_SE_CM, SEEN_PRIOR


def reading_above(
    stack: PhotoStack, fine: FineFit, sighting: Sighting, offset_sd_px: float, windows_px: tuple[float, ...]
) -> float:
    """By how much the edges above make the diameter at breast height thicker, cm; NaN where too few are found.

    offset_sd_px, windows_px: as for :func:`.fit.edge_adjustment.refine`.
    """
    looked = replace(sighting, seen=np.maximum(sighting.seen, SEEN_PRIOR))
    found = refine(stack, fine.axis, fine.r0, fine.r1, looked, ABOVE.fine, offset_sd_px, windows_px, oval=True)
    if found is None:
        return np.nan
    most = MAX_MOVED.at(200 * fine.r0)
    return float(np.clip(200 * (found.r0 - fine.r0), -most, most))


def weight_above(se_cm: float) -> float:
    """0..1, of the reading from above beside a fit with this standard error (cm)."""
    variance = min(se_cm, MAX_SE_CM) ** 2
    return variance / (variance + ABOVE_SE_CM**2)


def averaged(fine: FineFit, error: ErrorParts, above_cm: float) -> tuple[FineFit, ErrorParts]:
    """The fit with its radius at breast height moved by the weight of what the reading from above says, which adds to
    its error. error: of the fit alone."""
    if not np.isfinite(above_cm):
        return fine, error
    moved_cm = weight_above(error.se_cm) * above_cm
    return replace(fine, r0=fine.r0 + moved_cm / 200), error._replace(above=moved_cm)
