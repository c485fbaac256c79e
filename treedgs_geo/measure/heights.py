"""Tree heights from a cloud that reaches the crowns."""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.spatial import cKDTree

from ..stems.nearby import Nearby


def tree_heights(xyz: np.ndarray, height: np.ndarray, feet: np.ndarray, slopes: np.ndarray,
                 gap_m: float = 3.0) -> np.ndarray:
    """(T,) metres above ground of each tree's top; NaN where the cloud stops below the crowns.

    height: (N,) above ground. feet: (T, 2) axis at the ground, slopes: (T, 2) axis slopes. A point above 3 m belongs to
    the tree whose axis, followed up with half its lean, is nearest and within reach: 1.2 m in a stand (a neighbour's
    crown hangs over a suppressed tree), up to 4 m where no neighbour is near. The top is the third highest point below
    the first vertical gap of ``gap_m``.
    """
    tops = np.full(len(feet), np.nan)
    if len(feet) == 0:
        return tops
    with np.errstate(invalid="ignore"):
        upper = np.flatnonzero(height > 3.0)
    if len(upper) < 50 or np.percentile(height[upper], 99) < 5.0:
        return tops
    spacing = cKDTree(feet).query(feet, k=2)[0][:, 1] if len(feet) > 1 else np.array([np.inf])
    reach = np.clip(0.3 * spacing, 1.2, 4.0)
    layer = np.floor(height[upper]).clip(3, 100)
    # No axis strays farther from its foot than this, and no point is an axis's that is farther than its reach.
    drift = float(np.hypot(*slopes.T).max()) * (0.5 * (layer.max() - 3.0) + 3.0)
    near = Nearby(np.column_stack([feet, np.zeros(len(feet))]), cell_m=max(float(reach.max()) + drift, 1.0))
    owner = _owners(xyz[upper, 0], xyz[upper, 1], layer, feet, slopes, reach, near.starts, near.order, near.low,
                    near.cell_m, near.span)
    taken = np.flatnonzero(owner >= 0)
    for tree in np.unique(owner[taken]):
        own = np.sort(height[upper[taken[owner[taken] == tree]]])
        if len(own) < 20:
            continue
        gaps = np.flatnonzero(np.diff(own) > gap_m)
        own = own[:gaps[0] + 1] if len(gaps) else own
        if len(own) >= 20 and own[-1] > 5.0:
            tops[tree] = own[-3]
    return tops


@njit(cache=True)
def _owners(x, y, layer, feet, slopes, reach, starts, order, low, cell_m, span):  # pragma: no cover - compiled
    """(N,) the nearest axis at each point's layer if within its reach, or -1; axes compared layer by layer."""
    owner = np.full(x.shape[0], -1, np.int32)
    for m in range(x.shape[0]):
        up = 0.5 * (layer[m] - 3.0) + 3.0
        i, j = int(np.floor((x[m] - low[0]) / cell_m)), int(np.floor((y[m] - low[1]) / cell_m))
        best, nearest = np.inf, -1
        for a in range(max(i - 1, 0), min(i + 1, span[0] - 1) + 1):
            for b in range(max(j - 1, 0), min(j + 1, span[1] - 1) + 1):
                for k in range(starts[a * span[1] + b], starts[a * span[1] + b + 1]):
                    tree = order[k]
                    dx = x[m] - feet[tree, 0] - slopes[tree, 0] * up
                    dy = y[m] - feet[tree, 1] - slopes[tree, 1] * up
                    if dx * dx + dy * dy < best:
                        best, nearest = dx * dx + dy * dy, tree
        if nearest >= 0 and best <= reach[nearest] ** 2:
            owner[m] = nearest
    return owner
