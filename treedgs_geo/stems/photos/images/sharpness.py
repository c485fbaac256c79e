"""Soft and overexposed photos: what they add to the error of every diameter measured in them.

A lens or motion blurs light, which the fit expects: up to a pixel it changes no diameter. Noise reduction, resizing and
dewarping blur what a program has coded already, and stems look thicker in such photos, all of them alike. Nothing in a
photo says which of the two it was, so that both count the same (``docs/evidence/photos.md``).

Where white has no detail any more, as in the sky behind a stem, an edge's light part is cut off, and the stem looks
thinner by a part of a pixel that depends on how bright it was.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ....core.progress import Reporter
from ....geotags.sharpness import MAX_READERS
from ..tuned import CLIPPED_PX, SHARP, SOFT_PX
from .axis_patches import StemAxis
from .crops import PhotoStack


def edge_sharpness(grey: np.ndarray) -> float:
    """What part of a step of brightness over four pixels the steepest pixel of them has, at a photo's strongest edges.

    0.25 for a ramp, 1 for a step between two pixels; 0.55 to 0.67 in photos of a sharp lens, 0.4 in ones blurred by a
    pixel more. NaN for a photo that shows no edge. grey: (H, W) float32, 0..255.
    """
    found = []
    # The strongest two hundredth of its steps, 8 of 255 and more; textures blur some: the upper quartile counts.
    for rows in (grey, grey.T):
        whole = np.abs(rows[:, 4:] - rows[:, :-4])
        if not whole.size:
            continue
        line, first = np.nonzero(whole >= max(float(np.quantile(whole, 0.995)), 8.0))
        values = rows[line[:, None], first[:, None] + np.arange(5)]
        steepest = np.abs(np.diff(values, axis=1)).max(axis=1)
        found.append(np.minimum(steepest / whole[line, first], 1.0))
    every = np.concatenate(found) if found else np.empty(0)
    return float(np.quantile(every, 0.75)) if len(every) else float("nan")


def soft_px(stack: PhotoStack, reporter: Reporter) -> float:
    """Standard deviation of a diameter in pixels that the softness of the photos makes; warns where it counts."""
    numbers = np.unique(np.linspace(0, len(stack) - 1, 12).astype(int)) if len(stack) else np.empty(0, int)
    with ThreadPoolExecutor(min(os.cpu_count() or 1, MAX_READERS)) as readers:
        each = np.array(list(readers.map(lambda number: edge_sharpness(stack.grey(number)), numbers)), float)
    if not np.isfinite(each).any():
        return 0.0
    found = float(np.nanmedian(each))
    off_px = float(np.interp(found, SHARP[::-1], SOFT_PX[::-1]))
    if round(off_px, 1) > 0:
        reporter.warn(
            f"The photos are soft: sharpness {found:.2f} where {SHARP[0]:.2f} or more is expected; {off_px:.1f} pixel "
            "is added to the error of every diameter. Give the camera's original photos (not resized, dewarped or "
            "smoothed), or fly with a shorter exposure and check the focus."
        )
    return off_px


#: Value from which a colour is overexposed; samples up the stem.
_WHITE, _SAMPLES = 250, 20


def clipped_px(
    stack: PhotoStack, axis: StemAxis, radius: tuple[float, float], band_m: tuple[float, float], views: np.ndarray
) -> float:
    """Standard deviation of a stem's diameter in pixels that overexposure beside it makes.

    radius: at breast height (m) and its slope (m/m). band_m: heights above the ground. views: (V,) bool, photos whose
    edges count.
    """
    heights = np.linspace(*band_m, _SAMPLES)
    points, white = axis.at(heights), []
    for v in np.flatnonzero(views):
        view, offset = stack.views[v], axis.p - stack.centre[v, :2]
        px_m = float(np.linalg.norm([*offset, axis.ground_z + axis.bh_m - stack.centre[v, 2]]) / view.camera.fx)
        across = np.array([-offset[1], offset[0], 0.0]) / np.hypot(*offset)
        reach = (radius[0] + radius[1] * (heights - axis.bh_m) + 2 * px_m)[:, None] * across
        pixels, _ = view.project(np.vstack([points - reach, points + reach]))
        place = np.floor(pixels[np.isfinite(pixels).all(axis=1), ::-1]).astype(int) - stack.corner[v]
        row, column = place[((place >= 0) & (place < stack.shape[v])).all(axis=1)].T
        at = stack.start[v] + 3 * (row * stack.shape[v, 1] + column)
        white.append((stack.pixels[at[:, None] + np.arange(3)] >= _WHITE).ravel())
    return CLIPPED_PX * float(np.concatenate(white).mean()) if white else 0.0
