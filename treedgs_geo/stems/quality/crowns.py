"""Which cells of a canopy height grid are the crown of which stem: regions that grow down from the treetops.

From the highest cell to the lowest, each one joins the crown beside it from which it descends, while it is not too far
below that crown's top, nor too far beside it (Dalponte and Coomes 2016, "Tree-centric mapping of forest carbon density
from airborne laser scanning and hyperspectral data", with the order of a watershed: Meyer 1994). Treetops that are no
measured stem's grow too, so that no crown spreads over its neighbour.
"""

from __future__ import annotations

import heapq

import numpy as np
from numba import njit
from scipy.ndimage import median_filter

from .tips import rises, tips_of

#: A crown's cells are at least this high, metres and share of its top, and as far from the top as this share of it.
_MIN_M, _MIN_SHARE, _REACH_SHARE = 2.0, 0.5, 0.4
#: A tip is a stem's where it lies this near to its treetop: metres aside, metres and share of the height.
_ASIDE_M, _HIGH_M, _HIGH_SHARE = 2.0, 1.0, 0.06
#: A tip that is no stem's is another tree's where it rises so far above the way to higher ground, metres.
_OWN_RISE_M = 1.0


def crown_cells(x: np.ndarray, y: np.ndarray, height_m: np.ndarray, tops: np.ndarray) -> np.ndarray:
    """The crowns of stems in a canopy height grid.

    Args:
        x: (C,), y: (R,) metres of the cell centres, evenly spaced. height_m: (R, C) above the ground, NaN where nothing
            stands. tops: (S, 3) x, y, height above the ground of each stem's treetop; NaN where it is not known.

    Returns:
        (R, C) int32: number of the stem, from 1, whose crown the cell is; 0 no crown, below 0 that of another tree.
    """
    filled = median_filter(np.nan_to_num(height_m, nan=0.0), 3)
    # No two cells are equally high: a flat top is one tip, not two that each rise above everything.
    filled[filled > 0] += 1e-6 * np.linspace(0, 1, int((filled > 0).sum()))
    tips = tips_of(x, y, np.where(filled > 0, filled, np.nan))
    label = np.zeros(len(tips), np.int32)
    aside = np.linalg.norm(tops[:, None, :2] - tips[None, :, :2], axis=2)
    off = np.abs(tops[:, None, 2] - tips[None, :, 2])
    # Which is NaN, and no tip's, where a top is not known.
    near = (aside <= _ASIDE_M) & (off <= _HIGH_M + _HIGH_SHARE * tops[:, None, 2])
    taken = np.zeros(len(tops), bool)
    for stem, tip in sorted(
        np.argwhere(near).tolist(), key=lambda pair: aside[pair[0], pair[1]] + off[pair[0], pair[1]]
    ):
        if not taken[stem] and not label[tip]:
            label[tip], taken[stem] = stem + 1, True
    others = np.flatnonzero(label == 0)
    others = others[rises(x, y, filled, tips[others]) >= _OWN_RISE_M]
    label[others] = -1 - np.arange(len(others))
    seeds = np.flatnonzero(label)
    rows = np.abs(y[:, None] - tips[None, seeds, 1]).argmin(axis=0)
    columns = np.abs(x[:, None] - tips[None, seeds, 0]).argmin(axis=0)
    return _grow(filled, rows, columns, label[seeds], float(x[1] - x[0]) if len(x) > 1 else 1.0)


@njit(cache=True)
def _grow(height, rows, columns, labels, cell):  # pragma: no cover - compiled
    """(R, C) labels grown from the seeds' cells, always at the highest cell of the shore."""
    found = np.zeros(height.shape, np.int32)
    shore = [(0.0, 0, 0, 0)]
    shore.clear()
    for k in range(len(labels)):
        found[rows[k], columns[k]] = labels[k]
        heapq.heappush(shore, (-height[rows[k], columns[k]], rows[k], columns[k], k))
    while len(shore):
        _, r, c, k = heapq.heappop(shore)
        top = height[rows[k], columns[k]]
        for i, j in ((r - 1, c), (r + 1, c), (r, c - 1), (r, c + 1)):
            if not (0 <= i < height.shape[0] and 0 <= j < height.shape[1]) or found[i, j] != 0:
                continue
            away = cell * np.hypot(i - rows[k], j - columns[k])
            if max(_MIN_M, _MIN_SHARE * top) <= height[i, j] <= top and away <= _REACH_SHARE * top:
                found[i, j] = labels[k]
                heapq.heappush(shore, (-height[i, j], i, j, k))
    return found
