"""Heights of trees: how far up along its stem's axis a crown is seen.

What neighbouring photos show alike round the axis gives the likelihood of every height
(:mod:`treedgs_geo.reconstruction.canopy`). All trees together tell the stand's curve of height over diameter, which
weighs these heights; and where the crown of a taller tree is likely to be over the axis, what is seen there is no sign
of this one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.ndimage import map_coordinates

from ...reconstruction.canopy import CELL_M, MIN_PAIRS, STANDS, Alike, CanopyVolume, edges_of, log_likelihood
from ...reconstruction.ground_sight import GroundSight
from ..quality.tops import EXPONENT

#: Radius (s.d.) of the core of a crown round its axis, metres; by as much (s.d.) it stands beside the stem's axis at
#: this height, metres.
_CORE_M, _ASIDE_HEIGHT_M = 0.35, 20.0
#: Heights of trees of one diameter scatter so much about the stand's curve (s.d. of the logarithm), with tails of
#: Student's t of so many degrees of freedom; at this diameter they are one of these; mean and s.d. of its logarithm
#: over stands.
_SCATTERS, _TAILS = (0.05, 0.07, 0.1, 0.14), 3.0
_MIDDLE_CM, _LEVELS_M, _USUAL = 25.0, np.arange(5.0, 60.0, 0.25), (float(np.log(19.0)), 0.4)
#: Taller trees than this are looked for over a tree, share of its height; their crowns begin at this share of theirs,
#: have this radius (s.d., share) and are this probable over their middle.
_TALLER, _CROWN_BASE, _CROWN_RADIUS, _COVERS = 1.1, 0.4, 0.07, 0.6
#: So much of a crown's top may be too thin to be seen alike, metres.
_TIPS_M = (0.0, 1.2)
#: That nothing stands so far above a top, metres, must be seen by ``MIN_PAIRS`` of photos.
_ABOVE_M = 2.0
#: What a height is unsure by beside its likelihood, metres: the thin top of a crown shows more in one stand than in
#: another (the means of 19 simulated plots lay 1.2 m too low to 0.6 m too high, s.d. 0.6 m).
_SE_M = 0.7
#: A height that is off the stand's curve by more (logarithm) is another tree's; one with a larger standard error (share
#: of it) says no more than the curve.
_OFF_CURVE = 0.15
#: And so is one that nothing speaks for but the crowns of others: log likelihood over that nothing stands.
_OWN = 0.0


@dataclass(frozen=True)
class Heights:
    """Heights of S trees above their foot. height_m, se_m: (S,) with standard errors, NaN where none is known. why:
    (S,) str, a key of ``HEIGHT_REASONS`` where there is none, else empty."""

    height_m: np.ndarray
    se_m: np.ndarray
    why: np.ndarray


class Profile(NamedTuple):
    """What photos show of S crowns at O places beside the axis, the axis first, by L levels: what neighbours show alike
    there, and log odds of a crown by the ground behind, (S, O, L)."""

    alike: Alike
    hides: np.ndarray

    @classmethod
    def joined(cls, parts: Sequence[Profile]) -> Profile:
        """One after the other."""
        return cls(Alike.joined([part.alike for part in parts]), np.concatenate([part.hides for part in parts]))


def profiles(volume: CanopyVolume, sight: GroundSight, places: np.ndarray, slopes: np.ndarray) -> Profile:
    """What is seen in the core of each crown.

    Args:
        places: (S, 2) local metres, the axes at the ground. slopes: (S, 2) metres sideways for one metre up.
    """
    levels = volume.levels_m
    moved = np.minimum(levels / _ASIDE_HEIGHT_M, 1.2)[:, None] * _aside()[:, None]
    at = places[:, None, None] + slopes[:, None, None] * levels[:, None] + moved[None]
    rows, columns = (at[..., 1] - volume.y[0]) / CELL_M, (at[..., 0] - volume.x[0]) / CELL_M
    where = np.stack([np.broadcast_to(np.arange(len(levels)), rows.shape), rows, columns])
    ground_z = map_coordinates(volume.ground_z, where[1:], order=1, mode="nearest")
    points = np.concatenate([at, (ground_z + levels)[..., None]], axis=-1)
    return Profile(volume.smoothed(_CORE_M).at(where), sight.hides(points))


def _aside() -> np.ndarray:
    """(O, 2) places that are tried beside the axis at a height of 20 m: the axis, and a ring where a place is as
    probable as 1 / e of the axis."""
    angle = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    return np.vstack([np.zeros(2), np.sqrt(2) * _CORE_M * np.column_stack([np.cos(angle), np.sin(angle)])])


def heights_of(
    profile: Profile, levels_m: np.ndarray, dbh_cm: np.ndarray, foot: np.ndarray, slopes: np.ndarray
) -> Heights:
    """The heights of a stand's trees.

    Args:
        profile: of :func:`profiles`. levels_m: (L,). dbh_cm: (S,) NaN where unknown. foot, slopes: (S, 2) as in
            :func:`profiles`.
    """
    edges, log_d = edges_of(levels_m), np.log(np.asarray(dbh_cm, float) / _MIDDLE_CM)
    off_axis = -0.5 * (np.linalg.norm(_aside(), axis=1) / _CORE_M) ** 2
    likelihood = _likelihood(profile, off_axis, 0.0)
    seen = likelihood.max(axis=1) > likelihood[:, 0] + STANDS
    expected, curve = _curve_of_stand(likelihood, edges, log_d)
    for _ in range(2):
        others = _other_crowns(expected, levels_m, foot, slopes)
        likelihood = _likelihood(profile, off_axis, others[:, None])
        expected, curve = _curve_of_stand(likelihood, edges, log_d)
    height, sd = _moments(likelihood + curve, edges)
    own = likelihood[np.arange(len(log_d)), np.searchsorted(edges, height).clip(max=len(edges) - 1)] - likelihood[:, 0]
    se = np.hypot(sd, _SE_M)
    why = np.full(len(log_d), "", object)
    why[se > _OFF_CURVE * height] = "unclear"
    above = np.minimum(np.searchsorted(levels_m, height + _ABOVE_M), len(levels_m) - 1)
    # Without a diameter nothing tells a crown from the one above it.
    why[(profile.alike.pairs[np.arange(len(log_d)), 0, above] < MIN_PAIRS) | np.isnan(log_d)] = "unclear"
    why[(np.abs(np.log(height / expected)) > _OFF_CURVE) | (own < _OWN)] = "other_tree"
    why[~seen] = "no_top"
    known = why == ""
    return Heights(np.where(known, height, np.nan), np.where(known, se, np.nan), why)


def _likelihood(profile: Profile, off_axis: np.ndarray, others: np.ndarray | float) -> np.ndarray:
    """(S, E) log likelihood of each height, wherever beside its axis the crown stands. off_axis: (O,) log density."""
    crowns = product(np.moveaxis(profile.hides, -1, 0), _TIPS_M)
    each = [log_likelihood(profile.alike, others, hides, tip_m) for hides, tip_m in crowns]
    by_place = np.logaddexp.reduce(each) - np.log(len(each)) + off_axis[:, None]
    return np.logaddexp.reduce(by_place, axis=1) - np.log(len(off_axis))


def _other_crowns(height_m: np.ndarray, levels_m: np.ndarray, foot: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """(S, L) probability that the crown of a taller tree is over each axis at a level. height_m: (S,) expected ones,
    NaN where unknown."""
    at = foot[:, None] + slopes[:, None] * levels_m[:, None]
    tall, own = np.nan_to_num(height_m)[:, None], np.nan_to_num(height_m, nan=np.inf)
    crown = (levels_m < tall) & (levels_m > _CROWN_BASE * tall)
    free = np.ones((len(foot), len(levels_m)))
    for tree in range(len(foot)):  # all pairs at once would not do for a thousand trees
        apart = np.linalg.norm(at - at[tree], axis=-1)
        covers = _COVERS * np.exp(-0.5 * (apart / np.maximum(_CROWN_RADIUS * tall, CELL_M)) ** 2)
        free[tree] = np.prod(1 - covers * (crown & (tall > _TALLER * own[tree])), axis=0)
    return 1 - free


def _curve_of_stand(likelihood: np.ndarray, edges: np.ndarray, log_d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The curve of height over diameter that explains all trees best, whatever the height of each (empirical Bayes).

    Args:
        likelihood: (S, E) log likelihood of each tree's height. log_d: (S,) logarithm of the diameter over
            ``_MIDDLE_CM``, NaN where unknown.

    Returns:
        (S,) heights by the curve; (S, E) log density of each tree's heights about it, 0 without a diameter.
    """
    known, best = np.isfinite(log_d), -np.inf
    curve = np.full(len(log_d), np.nan), np.zeros_like(likelihood)
    for level, scatter in product(np.log(_LEVELS_M), _SCATTERS):
        expected = level + EXPONENT * log_d
        away = (np.log(edges) - expected[:, None]) / scatter
        density = -0.5 * (_TAILS + 1) * np.log1p(away**2 / _TAILS) - np.log(scatter)
        all_trees = np.logaddexp.reduce((likelihood + density)[known], axis=1).sum()
        all_trees -= 0.5 * ((level - _USUAL[0]) / _USUAL[1]) ** 2
        if all_trees > best:
            best, curve = all_trees, (np.exp(expected), np.where(known[:, None], density, 0.0))
    return curve


def _moments(log_density: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(S,) mean and s.d. over the heights of (S, E) densities."""
    weight = np.exp(log_density - log_density.max(axis=1, keepdims=True))
    weight /= weight.sum(axis=1, keepdims=True)
    mean = weight @ edges
    return mean, np.sqrt((weight * (edges - mean[:, None]) ** 2).sum(axis=1))
