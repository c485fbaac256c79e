"""Soft photos: what they add to the error of every diameter measured in them.

A lens or motion blurs light, which the fit expects: up to a pixel it changes no diameter. Noise reduction, resizing and
dewarping blur what a program has coded already, and stems look thicker in such photos, all of them alike. Nothing in a
photo says which of the two it was, so that both count the same (``docs/evidence/photos.md``).
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ....core.progress import Reporter
from .crops import MAX_READERS, PhotoStack

#: Sharpness of photos (descending, :func:`edge_sharpness`) and the error of a diameter (px, one standard deviation,
#: shared by all photos) at it: rendered photos blurred by 0.6 to 1.5 px, in light and as coded
#: (docs/results/altered_photos.json).
SHARP = (0.50, 0.40, 0.345)
SOFT_PX = (0.0, 0.3, 0.65)
#: Photos that are looked at, spread over all.
LOOKED_AT = 12
#: Edges that count: the strongest share of a photo's, and no weaker than this (of 255); and which of their sharpnesses
#: is the photo's. Textures blur the others.
STRONGEST, MIN_STEP, QUANTILE = 0.005, 8.0, 0.75
#: Below this part of a pixel nothing is said about it.
_SAY_PX = 0.1


def edge_sharpness(grey: np.ndarray) -> float:
    """What part of a step of brightness over four pixels the steepest pixel of them has, at a photo's strongest edges.

    0.25 for a ramp, 1 for a step between two pixels; 0.55 to 0.67 in photos of a sharp lens, 0.4 in ones blurred by a
    pixel more. NaN for a photo that shows no edge. grey: (H, W) float32, 0..255.
    """
    found = []
    for rows in (grey, grey.T):
        whole = np.abs(rows[:, 4:] - rows[:, :-4])
        if not whole.size:
            continue
        line, first = np.nonzero(whole >= max(float(np.quantile(whole, 1 - STRONGEST)), MIN_STEP))
        values = rows[line[:, None], first[:, None] + np.arange(5)]
        steepest = np.abs(np.diff(values, axis=1)).max(axis=1)
        found.append(np.minimum(steepest / whole[line, first], 1.0))
    every = np.concatenate(found) if found else np.empty(0)
    return float(np.quantile(every, QUANTILE)) if len(every) else float("nan")


def soft_px(stack: PhotoStack, reporter: Reporter | None = None) -> float:
    """Standard deviation of a diameter in pixels that the softness of the photos makes; warns where it counts."""
    numbers = np.unique(np.linspace(0, len(stack) - 1, LOOKED_AT).astype(int)) if len(stack) else np.empty(0, int)
    with ThreadPoolExecutor(min(os.cpu_count() or 1, MAX_READERS)) as readers:
        each = np.array(list(readers.map(lambda number: edge_sharpness(stack.grey(number)), numbers)), float)
    if not np.isfinite(each).any():
        return 0.0
    found = float(np.nanmedian(each))
    off_px = float(np.interp(found, SHARP[::-1], SOFT_PX[::-1]))
    if reporter is not None and off_px > _SAY_PX:
        reporter.warn(
            f"The photos are soft: sharpness {found:.2f} where {SHARP[0]:.2f} or more is expected; {off_px:.1f} pixel "
            "is added to the error of every diameter. Give the camera's original photos (not resized, dewarped or "
            "smoothed), or fly with a shorter exposure and check the focus."
        )
    return off_px
