"""Tips of a canopy height grid, and which of them are tops of their own."""

from __future__ import annotations

import heapq

import numpy as np
from numba import njit
from scipy.ndimage import maximum_filter

#: Two tips are at least so far apart, metres and share of the height.
_CLOSE_M, _CLOSE_SHARE = 0.3, 0.015


def tips_of(x: np.ndarray, y: np.ndarray, height_m: np.ndarray) -> np.ndarray:
    """The highest places of a canopy.

    Args:
        x: (C,), y: (R,) metres of the cell centres, evenly spaced. height_m: (R, C) above the ground, NaN where nothing
            stands.

    Returns:
        (K, 3) x, y, height, from the highest down: no higher cell lies within 0.3 m and 1.5 % of the height (a window
        that grows with height: Popescu and Wynne 2004); of equally high ones the first counts.
    """
    filled = np.where(np.isfinite(height_m), height_m, -np.inf)
    rows, columns = np.nonzero(
        (filled == maximum_filter(filled, 3, mode="constant", cval=-np.inf)) & np.isfinite(filled)
    )
    cell = x[1] - x[0] if len(x) > 1 else 1.0
    kept: list[np.ndarray] = []
    taken: dict[float, list[np.ndarray]] = {}
    for k in np.argsort(-filled[rows, columns], kind="stable"):
        row, column = rows[k], columns[k]
        height = filled[row, column]
        reach = _CLOSE_M + _CLOSE_SHARE * height
        span = int(reach / cell)
        part = (slice(max(row - span, 0), row + span + 1), slice(max(column - span, 0), column + span + 1))
        away = np.hypot(x[None, part[1]] - x[column], y[part[0], None] - y[row])
        tip = np.array([x[column], y[row], height])
        alike = taken.setdefault(float(height), [])
        if (filled[part][away <= reach] > height).any() or any(np.hypot(*(t - tip)[:2]) <= reach for t in alike):
            continue
        alike.append(tip)
        kept.append(tip)
    return np.array(kept).reshape(-1, 3)


def rises(x: np.ndarray, y: np.ndarray, height_m: np.ndarray, tips: np.ndarray, reach_m: float = 4.0) -> np.ndarray:
    """(K,) metres that each tip (K, 3) rises above the highest way to higher ground within ``reach_m`` (its topographic
    prominence; the tip's height above 0 where there is none): the rim of a neighbour's crown rises hardly at all."""
    filled = np.nan_to_num(height_m, nan=0.0)
    cell = x[1] - x[0] if len(x) > 1 else 1.0
    span = int(np.ceil(reach_m / cell))
    found = np.empty(len(tips))
    for k, tip in enumerate(tips):
        row, column = int(np.abs(y - tip[1]).argmin()), int(np.abs(x - tip[0]).argmin())
        low = max(row - span, 0), max(column - span, 0)
        found[k] = _rise(filled[low[0] : row + span + 1, low[1] : column + span + 1], row - low[0], column - low[1])
    return found


@njit(cache=True)
def _rise(part, row, column):  # pragma: no cover - compiled
    """The flood from one cell of ``part``, always over the highest cell of its shore, until one is higher."""
    top = lowest = part[row, column]
    seen = np.zeros(part.shape, np.bool_)
    seen[row, column] = True
    shore = [(-top, row, column)]
    while len(shore):
        level, r, c = heapq.heappop(shore)
        if -level > top:
            return top - lowest
        lowest = min(lowest, -level)
        for i in range(max(r - 1, 0), min(r + 2, part.shape[0])):
            for j in range(max(c - 1, 0), min(c + 2, part.shape[1])):
                if not seen[i, j]:
                    seen[i, j] = True
                    heapq.heappush(shore, (-part[i, j], i, j))
    return top
