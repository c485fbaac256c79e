"""Trees whose sizes hardly a stand has: the cloud, or its heights, are probably not in metres."""

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
#: DBH times height, m2 (median of the trees), from which on a cloud that names no unit may be in feet: they make it
#: 10.8 times as much. Of 600 plots drawn in 15 stands of old growth (Mount Rainier) one in fifteen has more; stands
#: have 2 to 20. Height over DBH is the second where the cloud stops below the crowns.
LARGE_M2, SLENDERNESS = 25.0, 70.0
_FOOT_M = 0.3048
#: Points looked at.
_SAMPLE = 400_000


def mark_odd_heights(trees: list[Tree], cloud: PointCloud, dtm: Dtm, reporter: Reporter | None = None) -> bool:
    """Flag every measured tree ``check`` with ``odd_heights`` where the stand is taller or more slender than stands
    are; ``True`` when it did. Says where a cloud without a CRS, whose unit nobody names, may be in feet.

    Trees without a height (the cloud stops below the crowns) are not asked how slender they are.
    """
    xyz = cloud.xyz[:: max(len(cloud) // _SAMPLE, 1)]
    above = xyz[:, 2] - dtm.height(xyz[:, 0], xyz[:, 1])
    above = above[np.isfinite(above)]
    measured = {"tall_share": tall_share(above, TALL_M)} if len(above) else {}
    ratios = [100 * tree.height_m / max(tree.dbh_cm, THIN_CM) for tree in trees if tree.dbh_cm and tree.height_m]
    if len(ratios) >= SLENDER_TREES:
        measured["slenderness"] = float(np.median(ratios))
    found = judge("survey", measured)
    if cloud.crs is None and reporter is not None and "slenderness" not in found.quantities:
        reporter.tell(_perhaps_feet(trees))
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


def _perhaps_feet(trees: list[Tree]) -> list[str]:
    """What to say of trees so large that the cloud may be in feet."""
    sizes = [(t.dbh_cm, t.height_m or SLENDERNESS * t.dbh_cm / 100) for t in trees if t.dbh_cm]
    if not sizes or np.median([d * h / 100 for d, h in sizes]) < LARGE_M2:
        return []
    d, h = np.median(sizes, axis=0)
    tall = f" and {h:.0f} m tall", f" and {_FOOT_M * h:.0f} m"
    if not any(tree.height_m for tree in trees if tree.dbh_cm):
        tall = "", ""
    return [
        f"The trees are {d:.0f} cm thick{tall[0]} (medians of {len(sizes)}), as few stands on earth are, and the cloud "
        f"names no unit: if x, y and z are in feet, they are {_FOOT_M * d:.0f} cm{tall[1]}; then multiply all three by "
        f"{_FOOT_M} and measure again."
    ]
