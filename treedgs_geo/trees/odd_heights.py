"""Trees whose heights no stand has: the cloud's heights are probably not in metres, and breast height is elsewhere."""

from __future__ import annotations

import numpy as np

from ..core.progress import Reporter
from ..pointcloud.cloud import PointCloud
from ..pointcloud.sanity import TALL_M, TALL_SHARE, tall_share
from ..terrain.dtm import Dtm
from .tree import Tree

#: Height over diameter: stands have 40 to 110 (median; 58 to 87 in the clouds of docs/evidence/point-clouds.md), single
#: dense ones 150. Heights in feet give 3.3 times as much.
SLENDER, SLENDER_TREES = 150.0, 5
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
    tall = len(above) > 0 and tall_share(above, TALL_M) >= TALL_SHARE
    ratios = [100 * tree.height_m / tree.dbh_cm for tree in trees if tree.dbh_cm and tree.height_m]
    slender = len(ratios) >= SLENDER_TREES and float(np.median(ratios)) > SLENDER
    if not tall and not slender:
        return False
    if slender and reporter is not None:
        reporter.warn(
            f"The trees are {np.median(ratios):.0f} times as tall as they are thick (median of "
            f"{len(ratios)}), expected 40 to 110: the cloud's heights are probably in feet; convert them to "
            "metres and measure again (every tree is marked for checking, odd_heights)."
        )
    for tree in trees:
        if "odd_heights" not in tree.qc_reason.split(","):
            tree.qc_reason = ",".join(filter(None, [tree.qc_reason, "odd_heights"]))
        tree.qc_flag = "check" if tree.qc_flag == "ok" else tree.qc_flag
    return True
