"""Which treetop is which stem's: one crown, one stem, joined along the stem's lean.

A top belongs to the stem whose axis, followed up, passes nearest, if its height suits the diameter as those of the
plot's other trees do: without this a sapling gets the height of the crown above it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linear_sum_assignment

if TYPE_CHECKING:
    from .tree import Tree

#: How far a top stands from its stem's axis followed straight up: metres, and share of the height (1 s.d.).
_STRAY_M, _STRAY_SHARE = 0.25, 0.02
#: Heights of trees of one diameter scatter so much within a plot (1 s.d. of their logarithm), at least.
MIN_SCATTER = 0.12
#: Exponent of the diameter in the height: log-log slope within a stand is 0.4 to 0.6 (Zeide and Curtis 2002).
EXPONENT = 0.5
#: Squared standard deviations at which a top is nobody's, and at which a second top would do about as well.
_FAR, _RIVAL = 9.0, 1.0
#: Pairs that must agree before the diameter counts.
_MIN_PAIRS = 5


@dataclass(frozen=True)
class Joined:
    """top: (S,) int index of each stem's top, -1 where it has none. reason: (S,) str, why not (a key of
    :data:`HEIGHT_REASONS`), empty where it has one. scatter: s.d. of the logarithm of height about the plot's own
    curve over the diameter, level: of that curve (:meth:`over_curve`); NaN where it has no curve. apart_m: (S,) how
    much lower another top is that would suit the stem about as well, 0 where there is none."""

    top: np.ndarray
    reason: np.ndarray
    scatter: float
    level: float
    apart_m: np.ndarray

    def over_curve(self, height_m: np.ndarray, dbh_cm: np.ndarray) -> np.ndarray:
        """(N,) logarithm of heights over what the plot's curve gives their diameters; NaN where either is unknown."""
        return np.log(height_m) - self.level - EXPONENT * np.log(dbh_cm)


#: Why a tree has no height.
HEIGHT_REASONS = {
    "no_top": "no treetop is seen along the stem's axis: it stands under another crown, or is bare",
    "other_tree": "the treetop above this stem is too high or too low for its diameter, or suits another stem better",
    "two_tops": "a second, higher treetop suits this stem about as well, and its diameter does not tell which",
    "unclear": (
        "where this crown ends is not clear: fewer than six pairs of photos show the top, it moved between them, is "
        "bare, or another stands above it"
    ),
}


def heights_sentence(trees: Sequence[Tree]) -> str:
    """How many trees with a DBH have a height, and why the others have none; empty where heights were not sought."""
    counted = [tree for tree in trees if tree.dbh_cm is not None]
    missing = Counter(tree.height_why for tree in counted if tree.height_m is None and tree.height_why)
    known = sum(tree.height_m is not None for tree in counted)
    if not known and not missing:
        return ""
    why = "; ".join(f"{count}: {HEIGHT_REASONS[reason]}" for reason, count in missing.most_common())
    return f"Heights of {known} of {len(counted)} trees with a DBH" + (f" (without: {why})" if why else "")


def join_tops(at_height: np.ndarray, tops: np.ndarray, dbh_cm: np.ndarray) -> Joined:
    """Assign tops to stems.

    Args:
        at_height: (S, K, 2) where the axis of stem s is at the height of top k. tops: (K, 3) x, y and height above the
            ground, metres. dbh_cm: (S,) diameters, NaN where unknown.

    Returns:
        The assignment that costs least over all stems (Kuhn 1955, Hungarian method, in scipy).
    """
    stems, count = len(dbh_cm), len(tops)
    if not stems or not count:
        return Joined(np.full(stems, -1), np.full(stems, "no_top", object), np.nan, np.nan, np.zeros(stems))
    stray = np.linalg.norm(at_height - tops[None, :, :2], axis=2) / (_STRAY_M + _STRAY_SHARE * tops[None, :, 2])
    log_h, log_d = np.log(tops[:, 2]), np.log(np.asarray(dbh_cm, float))
    level, scatter = _curve(stray, log_h, log_d)
    misfit = np.zeros_like(stray)
    if np.isfinite(level):
        misfit = (log_h[None] - level - EXPONENT * log_d[:, None]) / max(scatter, MIN_SCATTER)
        misfit = np.nan_to_num(misfit)
    cost = stray**2 + misfit**2
    # A stem without a top costs as much as the farthest top that would still be its own.
    rows, columns = linear_sum_assignment(np.hstack([np.minimum(cost, 1e3), np.full((stems, stems), _FAR)]))
    top = np.full(stems, -1)
    top[rows] = np.where(columns < count, columns, -1)
    reason = np.full(stems, "", object)
    free, apart_m = np.ones(count, bool), np.zeros(stems)
    free[top[top >= 0]] = False
    for stem in range(stems):
        if top[stem] < 0:
            reason[stem] = "other_tree" if (stray[stem] ** 2 < _FAR).any() else "no_top"
            continue
        # A lower one may be a branch of the same crown; only a higher one can be the leader instead.
        rivals = free & (tops[:, 2] > 1.05 * tops[top[stem], 2])
        rivals &= cost[stem] < cost[stem, top[stem]] + _RIVAL
        if rivals.any() and np.isfinite(level) and np.isfinite(log_d[stem]):
            # A broad crown has several tips, and a tree is as high as its highest.
            lower, top[stem] = top[stem], np.flatnonzero(rivals)[tops[rivals, 2].argmax()]
            apart_m[stem] = tops[top[stem], 2] - tops[lower, 2]
            free[top[stem]] = False
        elif rivals.any():
            top[stem], reason[stem] = -1, "two_tops"
    return Joined(top, reason, scatter, level, apart_m)


def _curve(stray: np.ndarray, log_h: np.ndarray, log_d: np.ndarray) -> tuple[float, float]:
    """Level and scatter (1.48 median absolute deviations) of log height over log diameter, from pairs that are each
    other's nearest; NaN where there are too few."""
    nearest = stray.argmin(axis=1)
    mutual = stray.argmin(axis=0)[nearest] == np.arange(len(stray))
    mutual &= (stray[np.arange(len(stray)), nearest] < 2.0) & np.isfinite(log_d)
    if mutual.sum() < _MIN_PAIRS:
        return np.nan, np.nan
    ratio = log_h[nearest[mutual]] - EXPONENT * log_d[mutual]
    level = float(np.median(ratio))
    return level, float(1.4826 * np.median(np.abs(ratio - level)))
