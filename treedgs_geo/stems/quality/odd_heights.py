"""Trees whose heights no stand has: the cloud's heights are probably not in metres, and breast height is elsewhere."""

from __future__ import annotations

import numpy as np

from ...core.progress import Reporter
from ...pointcloud.cloud import PointCloud
from ...pointcloud.sanity import TALL_M, tall_share
from ...terrain.dtm import Dtm
from .limits import judge
from .tree import Tree

#: Trees with height and diameter that a median of height over diameter needs. Stands have 40 to 110 (58 to 87 in the
#: clouds of docs/evidence/point-clouds.md), single dense ones 150; heights in feet give 3.3 times as much.
SLENDER_TREES = 5
#: Thinner stems count as this thick, cm: culms of bamboo and poles of thickets are more slender than any tree, and thin
#: trees in feet are as tall as only thick ones can be.
THIN_CM = 15.0
#: Points looked at.
_SAMPLE = 400_000


def mark_odd_heights(trees: list[Tree], cloud: PointCloud, dtm: Dtm, reporter: Reporter | None = None) -> bool:
    """Flag every measured tree ``check`` with ``odd_heights`` where the stand is taller or more slender than stands
    are; ``True`` when it did.

    Trees without a height (the cloud stops below the crowns) say nothing.
    """
    xyz = cloud.xyz[:: max(len(cloud) // _SAMPLE, 1)]
    above = xyz[:, 2] - dtm.height(xyz[:, 0], xyz[:, 1])
    above = above[np.isfinite(above)]
    measured = {"tall_share": tall_share(above, TALL_M)} if len(above) else {}
    ratios = [100 * tree.height_m / max(tree.dbh_cm, THIN_CM) for tree in trees if tree.dbh_cm and tree.height_m]
    if len(ratios) >= SLENDER_TREES:
        measured["slenderness"] = float(np.median(ratios))
    found = judge("survey", measured)
    if not found.reasons:
        return False
    if "slenderness" in found.quantities and reporter is not None:
        reporter.warn(
            f"The trees are {np.median(ratios):.0f} times as tall as they are thick (median of "
            f"{len(ratios)}), expected 40 to 110: the cloud's heights are probably in feet; convert them to "
            "metres and measure again (every tree is marked for checking, odd_heights)."
        )
    for tree in trees:
        tree.add_reason("odd_heights")
    return True
