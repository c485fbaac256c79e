"""Where neighbouring photos show the same thing above the ground: a volume that follows the ground, and the top of what
stands in it.

A crown in wind is seen alike by few pieces of few photos, so no single cell says where it ends. The mean over a crown's
core does: it falls to that of empty air where the crown ends. The top is where that change is most likely
(change-point of a mean; Page 1955, "A test for a change in a parameter occurring at an unknown point").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from ..core.progress import Reporter
from .multi_view_correlation import Pictures

#: Cell and level, metres.
CELL_M = 0.3
#: Smallest height that counts as canopy, metres.
MIN_M = 2.0
#: Highest part of a volume where nothing stands, metres: what empty air looks like.
AIR_M = 4.0
#: Correlations of levels nearer than this are not independent, metres.
_INDEPENDENT_M = 1.0
#: So far below its top a crown is seen on every level, on average; farther down on about half of them.
_CROWN_M, _SEEN_BELOW = 5.0, 0.5
#: The air's s.d. is not below this, and that much larger among crowns than above them.
_MIN_AIR_SD, _AMONG_CROWNS = 0.01, 1.1
#: Photos from nearly the same direction still show a crown alike somewhat above it: so large a share of its correlation
#: is air's.
_HALO = 0.2
#: A piece of a photo that shows a top reaches above it, metres.
_REACH_M = 0.2
#: Log likelihood by which something must stand there, rather than nothing: along a stem, and at one of thousands of
#: cells.
STANDS, _CELL_STANDS = 3.0, 10.0
#: A cell's top must be seen by so many pairs of photos.
MIN_PAIRS = 6


@dataclass(frozen=True)
class CanopyVolume:
    """Mean correlation between neighbouring photos over the ground.

    x: (C,) local metres of the cell centres. y: (R,) the same, from south to north. levels_m: (L,) heights above the
    ground, evenly spaced by ``CELL_M``. ground_z: (R, C) local height of the ground, NaN where unknown. alike:
    (L, R, C) float32, -1 to 1; 0 where no photos show the place or the ground is unknown. pairs: (L, R, C) uint8,
    pairs of photos that show it.
    """

    x: np.ndarray
    y: np.ndarray
    levels_m: np.ndarray
    ground_z: np.ndarray
    alike: np.ndarray
    pairs: np.ndarray

    def smoothed(self, radius_m: float) -> np.ndarray:
        """(L, R, C) mean round each cell, Gaussian of ``radius_m`` (s.d.)."""
        return gaussian_filter(self.alike, (0.0, radius_m / CELL_M, radius_m / CELL_M))


@dataclass(frozen=True)
class Contrast:
    """Correlation of a crown and of empty air. air_sd: s.d. in the air, where the mean is 0. crown, crown_sd: mean and
    s.d. in crowns."""

    air_sd: float
    crown: float
    crown_sd: float

    @classmethod
    def of_air(cls, alike: np.ndarray) -> Contrast:
        """From values in the air; of crowns it is only known that they are seen far better."""
        sd = 1.4826 * float(np.median(np.abs(alike))) if len(alike) else 0.0
        sd = _AMONG_CROWNS * max(sd, _MIN_AIR_SD)
        return cls(sd, 4 * sd, 4 * sd)

    def with_crowns(self, alike: np.ndarray) -> Contrast:
        """From values in crowns too."""
        return Contrast(self.air_sd, max(float(alike.mean()), 1.5 * self.air_sd), max(float(alike.std()), self.air_sd))

    def log_likelihood(self, alike: np.ndarray) -> np.ndarray:
        """(..., L) correlation by level -> (..., L + 1) log likelihood that what stands ends below level k, over that
        nothing stands."""
        seen = np.maximum(alike, 0.0)
        air_sd = max(self.air_sd, _HALO * self.crown)
        odds = 0.5 * (seen / air_sd) ** 2 - 0.5 * ((seen - self.crown) / self.crown_sd) ** 2
        odds += np.log(air_sd / self.crown_sd)
        below = np.logaddexp(np.log(_SEEN_BELOW) + odds, np.log(1 - _SEEN_BELOW))
        crown, below = (_summed(values * (CELL_M / _INDEPENDENT_M)) for values in (odds, below))
        deep = int(_CROWN_M / CELL_M)
        crown[..., deep:] += (below - crown)[..., :-deep]
        return crown


def _summed(values: np.ndarray) -> np.ndarray:
    return np.concatenate([np.zeros((*values.shape[:-1], 1)), np.cumsum(values, axis=-1)], axis=-1)


def edges_of(levels_m: np.ndarray) -> np.ndarray:
    """(L + 1,) heights at which what stands may end, metres."""
    return np.append(levels_m - CELL_M / 2, levels_m[-1] + CELL_M / 2) - _REACH_M


def is_air(levels_m: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """(L, ...) bool: in the highest ``AIR_M``, where photos look. pairs: (L, ...)."""
    high = levels_m > levels_m[-1] - AIR_M
    return high.reshape(-1, *[1] * (pairs.ndim - 1)) & (pairs >= MIN_PAIRS)


def volume_of(
    pictures: Pictures,
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    box: tuple[float, float, float, float],
    highest_m: float,
    reporter: Reporter | None = None,
) -> CanopyVolume:
    """The volume over a box.

    Args:
        ground: local x, y (N,) -> local z, NaN where unknown (nothing is looked for there).
        box: x0, y0, x1, y1, local metres.
        highest_m: above the ground, where the volume ends; nothing stands in its highest ``AIR_M``.
    """
    reporter = reporter or Reporter()
    x, y = (np.arange(low + CELL_M / 2, high, CELL_M) for low, high in ((box[0], box[2]), (box[1], box[3])))
    gx, gy = np.meshgrid(x, y)
    z = np.asarray(ground(gx.ravel(), gy.ravel()), float).reshape(gx.shape)
    known = np.isfinite(z)
    levels = np.arange(MIN_M, highest_m, CELL_M)
    alike, pairs = (np.zeros((len(levels), *gx.shape), kind) for kind in (np.float32, np.uint8))
    for k, level in enumerate(levels):
        reporter.progress(k / len(levels))
        points = np.column_stack([gx[known], gy[known], z[known] + level])
        alike[k][known], pairs[k][known] = pictures.alike(points)
    return CanopyVolume(x, y, levels, z, alike, pairs)


def surface_of(volume: CanopyVolume) -> np.ndarray:
    """(R, C) height above the ground of what stands over each cell, metres; NaN where nothing is seen to stand."""
    smoothed = volume.smoothed(CELL_M)
    alike, contrast = np.moveaxis(smoothed, 0, -1), Contrast.of_air(smoothed[is_air(volume.levels_m, volume.pairs)])
    found = contrast.log_likelihood(alike)
    at = found.argmax(axis=-1)
    pairs = np.take_along_axis(volume.pairs, np.minimum(at, len(volume.pairs) - 1)[None], axis=0)[0]
    top = edges_of(volume.levels_m)[at]
    stands = (found.max(axis=-1) > _CELL_STANDS) & (pairs >= MIN_PAIRS) & np.isfinite(volume.ground_z)
    return np.where(stands & (top < volume.levels_m[-1] - AIR_M), top, np.nan)
