"""Where neighbouring photos show the same thing above the ground: a volume that follows the ground, and the top of what
stands in it.

A crown in wind is seen alike by few pieces of few photos, so no single cell says where it ends. The mean over a crown's
core does: it falls to that of empty air where the crown ends. The top is where that change is most likely
(change-point of a mean; Page 1955, "A test for a change in a parameter occurring at an unknown point").
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from ..core.progress import Reporter
from .multi_view_correlation import Pictures

#: Cell and level, metres.
CELL_M = 0.3
#: Smallest height that counts as canopy, metres.
MIN_M = 2.0
#: Highest part of a volume where nothing stands, metres.
AIR_M = 4.0
#: Correlations of levels nearer than this are not independent, metres.
_INDEPENDENT_M = 1.7
#: So far below its top a crown is seen on every level, from opaque to thin ones, metres; farther down on every
#: fifth.
_CROWNS_M, _SEEN_BELOW = (1.0, 5.0), 0.2
#: Least noise of a mean over one pair, and what counts as no pair.
_MIN_NOISE, _NO_PAIR = 0.05, 0.01
#: A crown is as alike as its clearest level, less so many s.d. of chance, at least this; s.d. within it, share.
_CLEAR, _MIN_CROWN, _SPREAD = 2.0, 0.02, 0.5
#: Photos from nearly the same direction still show a crown alike somewhat above it: so large a share of its correlation
#: is air's.
_HALO = 0.2
#: A piece of a photo that shows a top reaches above it, metres.
_REACH_M = 0.1
#: By this something must stand along a stem, rather than nothing: log likelihood; and at one of thousands of cells:
#: s.d. of chance, on the clearest level.
STANDS, _CELL_STANDS_SD = 2.0, 5.0
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

    def smoothed(self, radius_m: float) -> Alike:
        """The mean round each cell, Gaussian of ``radius_m`` (s.d.) on its level."""
        width = (0.0, radius_m / CELL_M, radius_m / CELL_M)
        pairs = gaussian_filter(self.pairs.astype(np.float32), width)
        total = gaussian_filter(self.alike * self.pairs, width)
        return Alike.of(np.divide(total, pairs, out=np.zeros_like(total), where=pairs > _NO_PAIR), pairs)


@dataclass(frozen=True)
class Alike:
    """Mean correlation over pairs of photos, and what chance makes of it. mean, pairs: (...) alike. noise: s.d. of the
    mean in empty air is this over the root of ``pairs``."""

    mean: np.ndarray
    pairs: np.ndarray
    noise: float

    @classmethod
    def of(cls, mean: np.ndarray, pairs: np.ndarray) -> Alike:
        """With the noise that the negative values tell: what stands is alike, and chance has no sign."""
        below = mean < 0
        noise = np.sqrt(np.mean(mean[below] ** 2 * pairs[below])) if below.any() else 0.0
        return cls(mean, pairs, max(float(noise), _MIN_NOISE))

    @classmethod
    def joined(cls, parts: Sequence[Alike]) -> Alike:
        """One after the other, along the first axis."""
        mean, pairs = (np.concatenate([getattr(part, name) for part in parts]) for name in ("mean", "pairs"))
        return cls(mean, pairs, float(np.sqrt(np.mean([part.noise**2 for part in parts]))))

    def at(self, where: np.ndarray) -> Alike:
        """Between cells: where (3, ...) level, row, column."""
        mean, pairs = (map_coordinates(values, where, order=1, mode="constant") for values in (self.mean, self.pairs))
        return Alike(mean, pairs, self.noise)


def log_likelihood(
    alike: Alike, others: np.ndarray | float = 0.0, hides: np.ndarray | float = 0.0, tip_m: float = 0.0
) -> np.ndarray:
    """(..., L) by level -> (..., L + 1) log likelihood that what stands ends below level k, over that nothing stands.
    others: (..., L) probability that the crown of another tree is there anyway. hides: (..., L) log odds of a crown by
    the ground behind (:meth:`.ground_sight.GroundSight.hides`). tip_m: so much of a crown's top is too
    thin to be alike.

    How alike a crown is in the photos depends on its leaves and on wind: each is held against its own clearest level.
    """
    seen, chance = np.maximum(alike.mean, 0.0), alike.noise**2 / np.maximum(alike.pairs, _NO_PAIR)
    crown = (seen - _CLEAR * np.sqrt(chance)).max(axis=-1, keepdims=True).clip(_MIN_CROWN)
    air, stands = chance + (_HALO * crown) ** 2, chance + (_SPREAD * crown) ** 2
    odds = 0.5 * (seen**2 / air - (seen - crown) ** 2 / stands + np.log(air / stands))
    thin = int(round(tip_m / CELL_M))
    odds = np.concatenate([odds[..., :1].repeat(thin, axis=-1), odds[..., : odds.shape[-1] - thin]], axis=-1) + hides
    odds = -np.log(others + (1 - others) * np.exp(-odds.clip(-50.0)))
    below = np.logaddexp(np.log(_SEEN_BELOW) + odds, np.log(1 - _SEEN_BELOW))
    ends, below = (_summed(values * (CELL_M / _INDEPENDENT_M)) for values in (odds, below))
    found = []
    for deep in (int(crown_m / CELL_M) for crown_m in _CROWNS_M):
        found.append(ends.copy())
        found[-1][..., deep:] += (below - ends)[..., :-deep]
    return np.logaddexp.reduce(found) - np.log(len(found))


def _summed(values: np.ndarray) -> np.ndarray:
    return np.concatenate([np.zeros((*values.shape[:-1], 1)), np.cumsum(values, axis=-1)], axis=-1)


def edges_of(levels_m: np.ndarray) -> np.ndarray:
    """(L + 1,) heights at which what stands may end, metres."""
    return np.append(levels_m - CELL_M / 2, levels_m[-1] + CELL_M / 2) - _REACH_M


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
    by_level = volume.smoothed(CELL_M)
    mean, pairs = (np.moveaxis(values, 0, -1) for values in (by_level.mean, by_level.pairs))
    found = log_likelihood(Alike(mean, pairs, by_level.noise))
    at = found.argmax(axis=-1)[..., None]
    top = edges_of(volume.levels_m)[at[..., 0]]
    shown = np.take_along_axis(pairs, np.minimum(at, pairs.shape[-1] - 1), axis=-1)[..., 0]
    below = np.arange(pairs.shape[-1]) < at
    clearest = (below * mean * np.sqrt(pairs)).max(axis=-1) / by_level.noise
    stands = (clearest > _CELL_STANDS_SD) & (shown >= MIN_PAIRS) & np.isfinite(volume.ground_z)
    return np.where(stands & (top < volume.levels_m[-1] - AIR_M), top, np.nan)
