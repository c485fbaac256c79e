"""Soft photos: what they add to the error of every diameter measured in them.

A lens or motion blurs light, which the fit expects: up to a pixel it changes no diameter. Noise reduction, resizing and
dewarping blur what a program has coded already, and stems look thicker in such photos, all of them alike. Nothing in a
photo says which of the two it was, so that both count the same (``docs/evidence/photos.md``).
"""

from __future__ import annotations

import numpy as np

from ..core.progress import Reporter
from ..geotags.sharpness import sharpness
from .stack import PhotoStack

#: Sharpness of photos (descending) and the error of a diameter (px, one standard deviation, shared by all photos) at
#: it: rendered photos blurred by 0.6 to 1.5 px, in light and as coded (docs/results/altered_photos.json).
SHARP = (0.20, 0.125, 0.093)
SOFT_PX = (0.0, 0.3, 0.65)
#: Photos that are looked at, spread over all.
LOOKED_AT = 12
#: Below this part of a pixel nothing is said about it.
_SAY_PX = 0.1


def soft_px(stack: PhotoStack, reporter: Reporter | None = None) -> float:
    """Standard deviation of a diameter in pixels that the softness of the photos makes; warns where it counts."""
    numbers = np.unique(np.linspace(0, len(stack) - 1, LOOKED_AT).astype(int)) if len(stack) else []
    found = float(np.median([sharpness(stack.grey(number)) for number in numbers])) if len(numbers) else np.inf
    off_px = float(np.interp(found, SHARP[::-1], SOFT_PX[::-1]))
    if reporter is not None and off_px > _SAY_PX:
        reporter.warn(
            f"The photos are soft: sharpness {found:.2f} where {SHARP[0]:.2f} or more is expected; {off_px:.1f} pixel "
            "is added to the error of every diameter. Give the camera's original photos (not resized, dewarped or "
            "smoothed), or fly with a shorter exposure and check the focus."
        )
    return off_px
