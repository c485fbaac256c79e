"""Heights of trees: how far up along its stem's axis a crown is seen.

What neighbouring photos show alike round the axis gives the likelihood of every height
(:mod:`treedgs_geo.reconstruction.canopy`); the stand's own curve of height over diameter, fitted to the trees that are
seen well, weighs these heights, so that a sapling does not get the height of the crown above it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from ...reconstruction.canopy import CELL_M, MIN_PAIRS, STANDS, CanopyVolume, Contrast, edges_of
from ..quality.tops import EXPONENT

#: Radius (s.d.) of the core of a crown round its axis, metres; by as much (s.d.) it stands beside the stem's axis at
#: this height, metres.
_CORE_M, _ASIDE_HEIGHT_M = 0.35, 20.0
#: Levels below a top that tell what crowns look like, metres.
_TOP_M = (0.5, 4.0)
#: Heights of trees of one diameter scatter so much at least (s.d. of the logarithm), with tails of Student's t of so
#: many degrees of freedom.
_MIN_SCATTER, _TAILS = 0.06, 3.0
#: Trees that make a curve of the stand.
_MIN_TREES = 5
#: A height that is known no better than this (s.d.) is none, metres and share; one that is known to the first by itself
#: counts for the stand's curve.
_MAX_SD_M, _MAX_SD_SHARE = 1.0, 0.05
#: That nothing stands so far above a top, metres, must be seen by ``MIN_PAIRS`` of photos.
_ABOVE_M = 2.0
#: What a height is unsure by beside its likelihood: metres, and a share of how far the stand's heights lie off its
#: curve.
_SE_M, _SE_SCATTER = 0.4, 0.7
#: A height that is off the stand's curve by more (logarithm) is another tree's; one with a larger standard error (share
#: of it) says no more than the curve.
_OFF_CURVE = 0.15


@dataclass(frozen=True)
class Heights:
    """Heights of S trees above their foot. height_m, se_m: (S,) with standard errors, NaN where none is known. why:
    (S,) str, a key of ``HEIGHT_REASONS`` where there is none, else empty."""

    height_m: np.ndarray
    se_m: np.ndarray
    why: np.ndarray


def profiles(volume: CanopyVolume, places: np.ndarray, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What is seen alike in the core of each crown.

    Args:
        places: (S, 2) local metres, the axes at the ground. slopes: (S, 2) metres sideways for one metre up.

    Returns:
        (S, O, L) correlation at O places beside the axis, by level; (S, L) pairs of photos that show the axis.
    """
    levels = volume.levels_m
    moved = np.minimum(levels / _ASIDE_HEIGHT_M, 1.2)[:, None] * _aside()[:, None]
    at = places[:, None, None] + slopes[:, None, None] * levels[:, None] + moved[None]
    rows, columns = (at[..., 1] - volume.y[0]) / CELL_M, (at[..., 0] - volume.x[0]) / CELL_M
    where = np.stack([np.broadcast_to(np.arange(len(levels)), rows.shape), rows, columns])
    alike = map_coordinates(volume.smoothed(_CORE_M), where, order=1, mode="constant")
    return alike, map_coordinates(volume.pairs, where[:, :, 0], order=0, mode="constant")


def _aside() -> np.ndarray:
    """(O, 2) places that are tried beside the axis at a height of 20 m: the axis, and a ring where a place is as
    probable as 1 / e of the axis."""
    angle = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    return np.vstack([np.zeros(2), np.sqrt(2) * _CORE_M * np.column_stack([np.cos(angle), np.sin(angle)])])


def heights_of(
    alike: np.ndarray, pairs: np.ndarray, levels_m: np.ndarray, air: np.ndarray, dbh_cm: np.ndarray
) -> Heights:
    """The heights of a stand's trees.

    Args:
        alike: (S, O, L), pairs: (S, L), :func:`profiles`. air: (A,) values where nothing stands. dbh_cm: (S,) NaN where
            unknown.
    """
    contrast, edges, log_d = Contrast.of_air(air), edges_of(levels_m), np.log(np.asarray(dbh_cm, float))
    prior_of_place = -0.5 * (np.linalg.norm(_aside(), axis=1) / _CORE_M) ** 2
    curve, off, scatter = np.zeros((len(alike), len(edges))), np.zeros(len(alike)), _MIN_SCATTER
    for _ in range(4):
        by_place = contrast.log_likelihood(alike) + prior_of_place[:, None]
        likelihood = np.logaddexp.reduce(by_place, axis=1) - np.log(len(prior_of_place))
        height, sd = _moments(likelihood + curve, edges)
        seen = likelihood.max(axis=1) > likelihood[:, 0] + STANDS
        good = np.flatnonzero(seen & np.isfinite(log_d) & (sd < _MAX_SD_M))
        if len(good) < _MIN_TREES:
            break
        ratio = np.log(height) - EXPONENT * log_d
        level = float(np.median(ratio[good]))
        scatter = 1.4826 * float(np.median(np.abs(ratio[good] - level)))
        off = np.nan_to_num(ratio - level)
        away = (np.log(edges) - level - EXPONENT * log_d[:, None]) / max(scatter, _MIN_SCATTER)
        curve = np.nan_to_num(-0.5 * (_TAILS + 1) * np.log1p(away**2 / _TAILS))
        core = alike[np.arange(len(alike)), by_place.max(axis=2).argmax(axis=1)]
        below = height[good, None] - levels_m
        if (crowns := (below > _TOP_M[0]) & (below < _TOP_M[1])).any():
            contrast = contrast.with_crowns(core[good][crowns])
    se = np.sqrt(sd**2 + _SE_M**2 + (_SE_SCATTER * scatter * height) ** 2)
    why = np.full(len(alike), "", object)
    why[(sd > np.maximum(_MAX_SD_M, _MAX_SD_SHARE * height)) | (se > _OFF_CURVE * height)] = "unclear"
    above = np.minimum(np.searchsorted(levels_m, height + _ABOVE_M), len(levels_m) - 1)
    # Without a diameter nothing tells a crown from the one above it.
    why[(pairs[np.arange(len(alike)), above] < MIN_PAIRS) | np.isnan(log_d)] = "unclear"
    why[np.abs(off) > _OFF_CURVE] = "other_tree"
    why[~seen] = "no_top"
    known = why == ""
    return Heights(np.where(known, height, np.nan), np.where(known, se, np.nan), why)


def _moments(log_density: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(S,) mean and s.d. over the heights of (S, E) densities."""
    weight = np.exp(log_density - log_density.max(axis=1, keepdims=True))
    weight /= weight.sum(axis=1, keepdims=True)
    mean = weight @ edges
    return mean, np.sqrt((weight * (edges - mean[:, None]) ** 2).sum(axis=1))
