"""What the coarse search compares along an axis, and what chance reaches there: scores at random places."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..images.axis_patches import StemAxis, StripLayout, cut_strips, draw_ridges, hide_known
from ..images.background import BAND
from ..images.crops import GroundGrid, PhotoStack
from ..options import PhotoStemOptions
from .edge_adjustment import NO_STEMS
from .search import Null, NullBuilder, terminators


class Bands(NamedTuple):
    """Heights above the ground (m) at which a stem is looked for: searched, fitted, and compared with its
    silhouette."""

    coarse: tuple[float, float]
    fine: tuple[float, float]
    silhouette: tuple[float, float]


#: About breast height; fitted above the butt, whose swell a straight taper would carry up.
BREAST = Bands((0.5, 3.3), (0.6, 3.5), BAND)
#: Above what hides breast height; as many heights are searched, so that chance reaches as high.
ABOVE = Bands((2.2, 5.0), (2.2, 5.0), (2.2, 5.0))


def coarse_strips(
    stack: PhotoStack,
    axis: StemAxis,
    options: PhotoStemOptions,
    sun: np.ndarray,
    known: np.ndarray = NO_STEMS,
    band: tuple[float, float] = BREAST.coarse,
) -> tuple:
    """Strips along an axis, their ridges, and where light and shade part on a stem (:func:`.search.terminators`). sun:
    (flights,) azimuth, rad from east, NaN = unknown. known: as for :func:`.images.axis_patches.hide_known`. band:
    heights above the ground, m."""
    reach = options.max_dbh_cm / 200 + 0.37
    strips = cut_strips(stack, axis, StripLayout(*band, 0.28, 0.04, reach, 0.01, sigma_px=1.0, linear=False))
    hide_known(strips, stack, axis, known)
    ridge, unit = draw_ridges(strips.coherence, strips.gradient, 1.3)
    flights = np.array([view.flight for view in stack.views], int)
    return strips, ridge, unit, terminators(strips.normal, sun[flights])


def build_null(
    stack: PhotoStack, ground: GroundGrid, places: np.ndarray, options: PhotoStemOptions, sun: np.ndarray
) -> Null:
    """Null scores at (N, 2) random places."""
    radii = np.arange(0.03, options.max_dbh_cm / 200 + 0.005, 0.01)
    builder = NullBuilder(len(stack), radii)
    for place in places:
        z = float(ground.at(place[:1], place[1:])[0])
        axis = StemAxis(place, np.zeros(2), np.zeros(2), z, options.bh_m)
        builder.add(*coarse_strips(stack, axis, options, sun))
    return builder.finish()
