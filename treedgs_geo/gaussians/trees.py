"""Stem primitives -> tree records."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ..core.crs import LocalFrame
from ..trees.tree import Tree
from .layered import axis_xy
from .train import FoundStem

#: Another method's diameter may differ by this much (cm, and share) before the tree is doubted.
DISAGREE = 2.5, 0.10
#: Thinner primitives are refused: mostly twigs.
LEAST_DBH_CM = 7.5


def trees_of_primitives(
    found: dict[int, FoundStem], frame: LocalFrame, bh_m: float, second: dict[int, float | None] | None = None
) -> list[Tree]:
    """Primitives as trees in project coordinates, numbered from 1 in the order of their seeds.

    second: diameters (cm) of the same seeds by another method, None where it refused; a tree that differs, or that the
    other method refused, is doubted. Two primitives in one place are one stem: the one that predicts the photos worse
    is refused.
    """
    second = second or {}
    places = {seed: place_of(stem, bh_m) for seed, stem in found.items()}
    trees = []
    for seed, stem in sorted(found.items()):
        primitive = stem.primitive
        refuse, doubt = map(list, primitive.doubts)
        for other, rival in found.items():
            touching = 0.7 * (rival.primitive.shape[6] + primitive.shape[6])
            same = other != seed and np.hypot(*(places[other] - places[seed])) < touching
            if same and (rival.primitive.loss, other) < (primitive.loss, seed):
                refuse.append("merged")
        other_cm = second.get(seed)
        if other_cm is None:
            unsure = seed in second
        else:
            unsure = abs(other_cm - primitive.dbh_cm) > max(DISAGREE[0], DISAGREE[1] * other_cm)
        if unsure:
            doubt.append("disagree")
        if primitive.dbh_cm < LEAST_DBH_CM:
            refuse.append("too_small")
        # One doubt is for the forester to look at; several together are how places without a stem look.
        if len(doubt) >= 2:
            refuse += doubt
        x, y, z = frame.to_project(np.array([[*places[seed], stem.origin[2]]]))[0]
        flag: Literal["ok", "check", "reject"] = "reject" if refuse else "check" if doubt else "ok"
        slope = primitive.shape[2:4]
        trees.append(
            Tree(
                tree_id=seed + 1,
                x=float(x),
                y=float(y),
                z_ground=float(z),
                dbh_cm=None if refuse else primitive.dbh_cm,
                dbh_se_cm=None if refuse else primitive.se_cm,
                bh_m=bh_m,
                lean_deg=float(np.degrees(np.arctan(np.hypot(*slope)))),
                n_views=primitive.n_views,
                taper_cm_m=None if refuse else 200 * float(primitive.shape[7]),
                method="gaussians-stem",
                qc_flag=flag,
                qc_reason=",".join(dict.fromkeys(refuse + doubt)),
            ).finish()
        )
    return trees


def place_of(stem: FoundStem, bh_m: float) -> np.ndarray:
    """(2,) axis at breast height, local frame."""
    return stem.origin[:2] + axis_xy(stem.primitive.shape, bh_m, np.array([bh_m]))[0]
