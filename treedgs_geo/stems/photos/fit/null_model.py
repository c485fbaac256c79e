"""What the coarse search compares along an axis, and what chance reaches there: scores at random places."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..images.axis_patches import StemAxis, StripLayout, cut_strips, draw_ridges, hide_known
from ..images.crops import GroundGrid, PhotoStack
from ..options import PhotoStemOptions
from ..tuned import STRAIGHT_M
from .edge_adjustment import NO_STEMS
from .search import terminators
from .search_kernels import Null, null_scores


class Bands(NamedTuple):
    """Heights above the ground (m) at which a stem is looked for: searched, fitted, and compared with its
    silhouette."""

    coarse: tuple[float, float]
    fine: tuple[float, float]
    silhouette: tuple[float, float]


#: About breast height; fitted above the butt, whose swell a straight taper would carry up.
BREAST = Bands((0.5, 3.3), (0.6, 3.5), (0.4, 3.3))
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
    strips = cut_strips(stack, axis, StripLayout(*band, STRAIGHT_M, 0.04, reach, 0.01, sigma_px=1.0, linear=False))
    hide_known(strips, stack, axis, known)
    ridge, unit = draw_ridges(strips.coherence, strips.gradient, 1.3)
    flights = np.array([view.flight for view in stack.views], int)
    return strips, ridge, unit, terminators(strips.normal, sun[flights])


def build_null(
    stack: PhotoStack, ground: GroundGrid, places: np.ndarray, options: PhotoStemOptions, sun: np.ndarray
) -> Null:
    """Null scores at (N, 2) random places: mean and sd per view and radius; a view with too few places takes those of
    all views."""
    radii = np.arange(0.03, options.max_dbh_cm / 200 + 0.005, 0.01)
    total, square, count = np.zeros((len(stack), len(radii))), np.zeros((len(stack), len(radii))), np.zeros(len(stack))
    for place, z in zip(places, ground.at(places[:, 0], places[:, 1]), strict=True):
        axis = StemAxis(place, np.zeros(2), np.zeros(2), float(z), options.bh_m)
        strips, ridge, unit, border = coarse_strips(stack, axis, options, sun)
        reach = -strips.u[0] - radii.max() - 0.01
        centres = np.arange(-reach, reach + 1e-6, 0.04)
        null_scores(ridge, unit, border, strips.u[0], strips.u[1] - strips.u[0], centres, radii, total, square, count)
    n, pooled = count[:, None], max(float(count.sum()), 1.0)
    mean_all = total.sum(axis=0) / pooled
    sd_all = np.sqrt(np.maximum(square.sum(axis=0) / pooled - mean_all**2, 1e-8))
    own = total / np.maximum(n, 1)
    own_sd = np.sqrt(np.maximum(square / np.maximum(n, 1) - own**2, 1e-8))
    mean, sd = np.where(n >= 100, own, mean_all), np.where(n >= 100, own_sd, sd_all)
    return Null(radii, mean, np.maximum(sd, 0.25 * sd_all))
