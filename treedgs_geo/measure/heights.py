"""Tree heights from a cloud that reaches the crowns."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree


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
    # Axes are compared layer by layer: exact enough, and one tree query a layer.
    owner = np.full(len(upper), -1)
    layer = np.floor(height[upper]).astype(int)
    for level in np.unique(layer):
        here = np.flatnonzero(layer == level)
        axes = cKDTree(feet + slopes * (0.5 * (level - 3.0) + 3.0))
        distance, nearest = axes.query(xyz[upper[here], :2])
        owner[here] = np.where(distance <= reach[nearest], nearest, -1)
    for tree in range(len(feet)):
        own = np.sort(height[upper[owner == tree]])
        if len(own) < 20:
            continue
        gaps = np.flatnonzero(np.diff(own) > gap_m)
        own = own[:gaps[0] + 1] if len(gaps) else own
        if len(own) >= 20 and own[-1] > 5.0:
            tops[tree] = own[-3]
    return tops
