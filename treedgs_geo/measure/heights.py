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
    # Axes are compared layer by layer: exact enough, and one grid a layer; no point is farther than the widest reach.
    owner = np.full(len(upper), -1, np.int32)
    # Of 16 bits: sorted by counting.
    layer = np.floor(height[upper]).clip(3, 1000).astype(np.int16)
    order = np.argsort(layer, kind="stable")
    for here in np.split(order, np.flatnonzero(np.diff(layer[order])) + 1):
        axes = cKDTree(feet + slopes * (0.5 * (layer[here[0]] - 3.0) + 3.0))
        distance, nearest = axes.query(xyz[upper[here], :2], distance_upper_bound=float(reach.max()) + 1e-9)
        inside = np.isfinite(distance)
        owner[here[inside]] = np.where(distance[inside] <= reach[nearest[inside]], nearest[inside], -1)
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
