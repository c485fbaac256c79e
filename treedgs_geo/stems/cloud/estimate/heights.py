"""Tree heights from a cloud that reaches the crowns: the tips of its canopy, joined with the stems along their lean."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.spatial import cKDTree

from ....core.machine import in_threads
from ...quality.tips import rises, tips_of
from ...quality.tops import MIN_SCATTER, Joined, join_tops

#: Points above this are canopy; a cloud of whose canopy less than 1 % is above :data:`_CROWNS_M` has no crowns, metres.
_MIN_M, _CROWNS_M = 2.0, 5.0
#: Cells of the canopy: at least this wide, and wide enough for so many points above 2 m on average.
_CELL_M, _POINTS_A_CELL = 0.2, 6.0
#: Most cells of a piece, and most stems of one; crowns lean so far over its rim, metres.
_MOST_CELLS, _MAX_STEMS, _RIM_M = 4_000_000, 400, 8.0
#: The highest point of a cell counts with so many others within :data:`_NEAR_M` of its height in the cells about it:
#: birds, masts of noise and other single returns have none.
_OTHERS, _NEAR_M = 2, 1.0
#: So many of the highest points of each cell are looked at.
_KEPT = 4
#: A tip that rises less than this above the way to higher ground may be the rim of a neighbour's crown, metres. It is a
#: tree's where the height suits its diameter within this share.
_OWN_RISE_M, _SUITS = 1.0, 0.10
#: A crown reaches over its stem's axis by this share of the way to the next stem, within limits, metres. A tip there
#: that is not the joined one may be off the plot's curve by so many of its scatters.
_REACH_SHARE, _REACH_M, _MAX_OFF = 0.3, (1.2, 4.0), 2.0
#: Standard error of the height of a tip of its own, metres, and of another one as a share of the height, at least.
_TIP_SE_M, _RIM_SHARE = 0.3, 0.06


@dataclass(frozen=True)
class TreeHeights:
    """height_m, se_m: (T,) NaN where there is none. why: (T,) str, a key of ``HEIGHT_REASONS`` or empty; empty too
    where the whole cloud ends below the crowns."""

    height_m: np.ndarray
    se_m: np.ndarray
    why: np.ndarray


def tree_heights(
    xyz: np.ndarray,
    height: np.ndarray,
    places: np.ndarray,
    slopes: np.ndarray,
    z_ground: np.ndarray,
    dbh_cm: np.ndarray,
    bh_m: float,
) -> TreeHeights:
    """Heights of trees over their feet.

    Args:
        xyz: (N, 3) metres, height: (N,) above the ground. places: (T, 2) axes at ``bh_m`` above the ground, slopes:
            (T, 2) metres sideways for one metre up, z_ground: (T,) of the feet (NaN: the ground under the tip counts).
            dbh_cm: (T,), NaN where unknown.
    """
    count = len(places)
    found = TreeHeights(np.full(count, np.nan), np.full(count, np.nan), np.full(count, "", object))
    for own, (x, y, top, point) in canopies_over(xyz, height, places):
        known = top[np.isfinite(top)]
        if not len(known) or np.quantile(known, 0.99) < _CROWNS_M:
            continue
        tips = tips_of(x, y, top)
        at = places[own][:, None] + slopes[own][:, None] * (tips[None, :, 2:] - bh_m)
        joined = join_tops(at, tips, dbh_cm[own])
        chosen = _highest_of_crowns(joined, places[own], at, tips, dbh_cm[own])
        found.why[own] = np.where(chosen < 0, joined.reason, "")
        own, chosen = own[chosen >= 0], chosen[chosen >= 0]
        for tree, tip, rise in zip(own, tips[chosen], rises(x, y, top, tips[chosen]), strict=True):
            highest = point[np.abs(y - tip[1]).argmin(), np.abs(x - tip[0]).argmin()]
            over_foot = float(xyz[highest, 2] - z_ground[tree])
            high = over_foot if np.isfinite(over_foot) else float(tip[2])
            se = _error(joined, rise, high, float(dbh_cm[tree]))
            if np.isfinite(se):
                found.height_m[tree], found.se_m[tree] = high, se
            else:
                found.why[tree] = "other_tree"
    return found


def _highest_of_crowns(
    joined: Joined, places: np.ndarray, at: np.ndarray, tips: np.ndarray, dbh_cm: np.ndarray
) -> np.ndarray:
    """(T,) tip of each tree, -1 where it has none: the joined one, or a higher one that is nobody's, nearest to this
    tree's axis and within its crown (broad crowns have several), if its height suits the diameter."""
    chosen = joined.top.copy()
    spacing = cKDTree(places).query(places, k=2)[0][:, 1] if len(places) > 1 else np.full(len(places), np.inf)
    reach = np.clip(_REACH_SHARE * spacing, *_REACH_M)
    if not len(tips):
        return chosen
    away = np.linalg.norm(at - tips[None, :, :2], axis=2)
    owner = away.argmin(axis=0)
    free = away[owner, np.arange(len(tips))] <= reach[owner]
    free[chosen[chosen >= 0]] = False
    limit = _MAX_OFF * max(float(np.nan_to_num(joined.scatter)), MIN_SCATTER)
    # From the highest down: the first that is taken is the top.
    for tip in np.flatnonzero(free):
        tree = owner[tip]
        off = float(joined.over_curve(tips[tip, 2], dbh_cm[tree]))
        if (chosen[tree] < 0 or tips[tip, 2] > tips[chosen[tree], 2]) and not abs(off) > limit:
            chosen[tree] = tip
    return chosen


def _error(joined: Joined, rise_m: float, high_m: float, dbh_cm: float) -> float:
    """Standard error of a height, metres; NaN where the tip is probably another tree's. A stem without a diameter has
    an axis too unsure, and nothing else, to tell its tip from its neighbours'."""
    if rise_m >= _OWN_RISE_M and np.isfinite(dbh_cm):
        return _TIP_SE_M
    off = float(joined.over_curve(np.array(high_m), np.array(dbh_cm)))
    if abs(off) > _SUITS:
        return np.nan
    # Without a curve nothing says whose tip it is.
    share = max(float(joined.scatter), _RIM_SHARE) if np.isfinite(off) else 2 * _SUITS
    return float(np.hypot(_TIP_SE_M, share * high_m))


def _pieces(places: np.ndarray) -> list[np.ndarray]:
    """Trees that are joined with their tops together: halves, along the longer side, until a piece is small enough."""
    waiting, done = [np.arange(len(places))] if len(places) else [], []
    while waiting:
        own = waiting.pop()
        span = np.ptp(places[own], axis=0)
        if len(own) < 2 or (len(own) <= _MAX_STEMS and np.prod(span + 2 * _RIM_M) <= _MOST_CELLS * _CELL_M**2):
            done.append(own)
            continue
        order = own[np.argsort(places[own, span.argmax()], kind="stable")]
        waiting += [order[: len(own) // 2], order[len(own) // 2 :]]
    return done


def canopies_over(
    xyz: np.ndarray, height: np.ndarray, places: np.ndarray
) -> Iterator[tuple[np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]]:
    """Numbers of the stems of a piece of ground and the canopy over it (:func:`canopy_of_points`), piece by piece.

    xyz: (N, 3) metres, height: (N,) above the ground. places: (T, 2) of the stems.
    """
    height, pieces = np.ascontiguousarray(height, float), _pieces(places)
    boxes = [np.concatenate([places[own].min(axis=0) - _RIM_M, places[own].max(axis=0) + _RIM_M]) for own in pieces]
    return zip(pieces, in_threads(lambda box: canopy_of_points(xyz, height, box), boxes), strict=True)


def canopy_of_points(
    xyz: np.ndarray, height: np.ndarray, box: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The canopy of a cloud in a box (x0, y0, x1, y1).

    Returns:
        x: (C,), y: (R,) cell centres, the height above the ground of the highest point that does not stand alone
        (R, C), NaN where there is none, and that point's number (R, C), -1.
    """
    low, span = box[:2], box[2:] - box[:2]
    count, covered_m2 = _covered(xyz, height, low, box[2:], _MIN_M)
    cell = max(_CELL_M, float(np.sqrt(_POINTS_A_CELL * covered_m2 / max(count, 1))))
    columns, rows = (int(n) for n in np.ceil(span / cell))
    highest = _highest(xyz, height, low, cell, rows, columns, _MIN_M, _KEPT)
    point = _supported(highest, height, _OTHERS, _NEAR_M)
    top = np.where(point >= 0, height[point], np.nan)
    return low[0] + (np.arange(columns) + 0.5) * cell, low[1] + (np.arange(rows) + 0.5) * cell, top, point


@njit(cache=True, nogil=True)
def _covered(xyz, height, low, high, least):  # pragma: no cover - compiled
    """How many points above ``least`` lie in the box, and in how many square metres of it."""
    there = np.zeros((int(np.ceil(high[0] - low[0])) + 1, int(np.ceil(high[1] - low[1])) + 1), np.bool_)
    count = 0
    for m in range(xyz.shape[0]):
        x, y = xyz[m, 0], xyz[m, 1]
        if height[m] > least and low[0] <= x < high[0] and low[1] <= y < high[1]:
            there[int(x - low[0]), int(y - low[1])] = True
            count += 1
    return count, there.sum()


@njit(cache=True, nogil=True)
def _highest(xyz, height, low, cell, rows, columns, least, kept):  # pragma: no cover - compiled
    """(rows, columns, kept) numbers of the highest points of each cell above ``least``, -1 where there are fewer."""
    found = np.full((rows, columns, kept), -1, np.int64)
    for m in range(xyz.shape[0]):
        h = height[m]
        if not h > least:
            continue
        i, j = int(np.floor((xyz[m, 1] - low[1]) / cell)), int(np.floor((xyz[m, 0] - low[0]) / cell))
        if i < 0 or j < 0 or i >= rows or j >= columns:
            continue
        new = m
        for k in range(kept):
            old = found[i, j, k]
            if old < 0 or height[new] > height[old]:
                found[i, j, k] = new
                new = old
                if new < 0:
                    break
    return found


@njit(cache=True, nogil=True)
def _supported(highest, height, others, near):  # pragma: no cover - compiled
    """(R, C) number of each cell's highest point that has ``others`` points within ``near`` of its height among the
    highest of the cell and of those about it, -1 where none has."""
    rows, columns, kept = highest.shape
    found = np.full((rows, columns), -1, np.int64)
    for i in range(rows):
        for j in range(columns):
            for k in range(kept):
                m = highest[i, j, k]
                if m < 0:
                    break
                count = -1
                for a in range(max(i - 1, 0), min(i + 2, rows)):
                    for b in range(max(j - 1, 0), min(j + 2, columns)):
                        for c in range(kept):
                            n = highest[a, b, c]
                            count += n >= 0 and abs(height[n] - height[m]) <= near
                if count >= others:
                    found[i, j] = m
                    break
    return found
