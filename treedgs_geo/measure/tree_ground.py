"""What the ground under a tree, known more or less well, means for its diameter: interval, flag and reason."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from .foot import LEAST_STEMS, STRAIGHT, SWOLLEN, foot_swell
from .trees import Tree, with_block_errors

if TYPE_CHECKING:
    from ..terrain.cloud_ground import CloudGround

#: A ground whose height is less sure than this makes a tree one to check; one this unsure is no ground at all, m.
UNSURE_GROUND_M, NO_GROUND_M = 0.25, 5.0
#: The ground lies so far below the lowest points of stems that show their feet there (1 sd), m.
FEET_SE_M = 0.5
#: A stem's foot takes up this much more than its radius at breast height (butt swell, lean), and so much in all where
#: the radius is not known, metres.
FOOT_M, USUAL_FOOT_M = 0.15, 0.30


def with_ground(trees: list[Tree], ground: CloudGround, xyz: np.ndarray) -> list[Tree]:
    """Trees measured in (N, 3) points, whose intervals and flags allow for how well the ground under each is known."""
    xy = np.array([[tree.x, tree.y] for tree in trees]).reshape(-1, 2)
    radius_m = np.array([np.nan if tree.dbh_cm is None else tree.dbh_cm / 200 for tree in trees])
    return [
        with_ground_error(tree, float(se_m))
        for tree, se_m in zip(trees, stem_ground_se(ground, xy, radius_m, xyz), strict=True)
    ]


def stem_ground_se(ground: CloudGround, xy: np.ndarray, radius_m: np.ndarray, xyz: np.ndarray) -> np.ndarray:
    """(K,) standard error of the ground's height, metres, at (K, 2) stems with (K,) radii (NaN: not known) in (N, 3)
    points. :data:`NO_GROUND_M` and more: no ground is known."""
    se_m = ground.se_m(xy, np.where(np.isfinite(radius_m), radius_m + FOOT_M, USUAL_FOOT_M))
    lost = se_m >= NO_GROUND_M
    if ground.given is not None or not (ground.lowest or lost.any()):
        return se_m
    height = xyz[:, 2] - ground.dtm.height(xyz[:, 0], xyz[:, 1])
    swell, stems = foot_swell(xyz, height, xy, radius_m)
    if ground.lowest and swell < STRAIGHT:
        return np.full(len(xy), NO_GROUND_M)
    return np.where(lost, FEET_SE_M, se_m) if stems >= LEAST_STEMS and swell >= SWOLLEN else se_m


def with_ground_error(tree: Tree, ground_m: float, unsure_m: float = UNSURE_GROUND_M) -> Tree:
    """The tree with the error of the ground's height under it, and so of breast height, added to its own.

    ground_m: standard error of that height. Above ``unsure_m`` the tree is to be checked, from :data:`NO_GROUND_M` on
    it is refused: no ground, no breast height.
    """
    if ground_m >= NO_GROUND_M:
        reasons = _with_reason(tree.qc_reason, "no_ground")
        return replace(tree, qc_flag="reject", qc_reason=reasons).finish()
    tree = with_block_errors(tree, 0.0, ground_m)
    if ground_m <= unsure_m:
        return tree
    flag: Literal["ok", "check", "reject"] = "check" if tree.qc_flag == "ok" else tree.qc_flag
    return replace(tree, qc_flag=flag, qc_reason=_with_reason(tree.qc_reason, "no_ground"))


def _with_reason(reasons: str, reason: str) -> str:
    return ",".join(dict.fromkeys([*filter(None, reasons.split(",")), reason]))


def stem_feet(xyz: np.ndarray, tree_id: np.ndarray, height: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``(ids, (K, 2) places, (K,) radii)`` of the trees in (N, 3) labelled points: the middle of each one's points
    from 1 to 2 m (of all, where it has none there), and their median distance from it. height: (N,) above the ground.
    """
    owned = np.flatnonzero(tree_id > 0)
    order = owned[np.argsort(tree_id[owned], kind="stable")]
    ids, starts = np.unique(tree_id[order], return_index=True)
    places, radii = np.empty((len(ids), 2)), np.empty(len(ids))
    for k, group in enumerate(np.split(order, starts[1:]) if len(ids) else []):
        with np.errstate(invalid="ignore"):
            low = group[(height[group] > 1.0) & (height[group] < 2.0)]
        xy = xyz[low if len(low) else group, :2]
        places[k] = 0.5 * (np.percentile(xy, 2, axis=0) + np.percentile(xy, 98, axis=0))
        radii[k] = np.median(np.hypot(*(xy - places[k]).T))
    return ids, places, radii
