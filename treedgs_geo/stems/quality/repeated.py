"""Every stem twice: the same diameters again at one common offset (scans not registered, tiles that overlap)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .tree import Tree

#: Stems this far apart, m, may be one stem seen twice; their offsets agree within so much, m.
NEAREST_M, FARTHEST_M, AGREE_M = 0.08, 2.0, 0.06
#: Diameters that are the same: within so many cm, or this share.
SAME_CM, SAME_SHARE = 1.0, 0.04
#: So many pairs are no chance: they hold this share of all stems, and this share of the stems that have another one at
#: that offset have one of their own diameter.
MIN_PAIRS, HELD, ALIKE = 4, 0.5, 0.8


@dataclass(frozen=True)
class Repeated:
    """pairs: (P, 2) rows of stems that are one. offset_m: (2,) from the first to the second."""

    pairs: np.ndarray
    offset_m: np.ndarray

    def text(self, stems: int) -> str:
        """What was found among so many stems, for a message."""
        east, north = self.offset_m
        return (
            f"{len(self.pairs)} pairs among {stems} stems have the same diameters at one offset of "
            f"{np.hypot(east, north):.2f} m ({east:+.2f} east, {north:+.2f} north): every stem is there twice, from "
            "scans or tiles that are not registered to each other"
        )


def find_repeated(xy: np.ndarray, dbh_cm: np.ndarray) -> Repeated | None:
    """The pairs among (N, 2) stems with (N,) diameters, or ``None``."""
    known = np.flatnonzero(np.isfinite(dbh_cm) & np.isfinite(xy).all(axis=1))
    if len(known) < 2 * MIN_PAIRS:
        return None
    tree = cKDTree(xy[known])
    near = known[tree.query_pairs(FARTHEST_M, output_type="ndarray")]
    if not len(near):
        return None
    near = np.vstack([near, near[:, ::-1]])
    offset = xy[near[:, 1]] - xy[near[:, 0]]
    far = np.hypot(*offset.T) > NEAREST_M
    near, offset = near[far], offset[far]
    if not len(near):
        return None
    thick = dbh_cm[near]
    same = np.abs(thick[:, 0] - thick[:, 1]) < np.maximum(SAME_CM, SAME_SHARE * thick.mean(axis=1))
    close = cKDTree(offset).query_ball_point(offset, AGREE_M)
    best = max((np.array(group) for group in close), key=lambda group: int(same[group].sum()))
    alike = best[same[best]]
    ends = np.unique(near[alike])
    if len(ends) < max(2 * MIN_PAIRS, HELD * len(known)) or len(alike) < ALIKE * len(best):
        return None
    return Repeated(near[alike], np.median(offset[alike], axis=0))


def mark_repeated(trees: list[Tree]) -> str:
    """Flag the stems that are there twice (``double``); what to say about them, empty where there are none."""
    xy = np.array([[tree.x, tree.y] for tree in trees]).reshape(-1, 2)
    found = find_repeated(xy, np.array([tree.dbh_cm or np.nan for tree in trees], float))
    if found is None:
        return ""
    for row in np.unique(found.pairs):
        trees[row].add_reason("double")
    return f"{found.text(len(trees))}; register them, or cut the cloud to one, and measure again."
