"""Stem primitives -> tree records."""

from __future__ import annotations

import numpy as np

from ...core.crs import LocalFrame
from ..quality.findings import Findings
from ..quality.limits import judge
from ..quality.tree import Tree
from .primitive.model import axis_xy
from .train import FoundStem


def trees_of_primitives(
    found: dict[int, FoundStem],
    frame: LocalFrame,
    bh_m: float,
    second: dict[int, float | None] | None = None,
    soft_cm: dict[int, float] | None = None,
) -> list[Tree]:
    """Primitives as trees in project coordinates, numbered from 1 in the order of their seeds.

    second: diameters (cm) of the same seeds by another method, None where it refused; a tree that differs, or that the
    other method refused, is flagged. Two primitives in one place are one stem: the one that predicts the photos worse
    is refused. soft_cm: what soft photos add to the error of each, cm.
    """
    second, soft_cm = second or {}, soft_cm or {}
    places = {seed: place_of(stem, bh_m) for seed, stem in found.items()}
    trees = []
    for seed, stem in sorted(found.items()):
        primitive = stem.primitive
        judged = primitive.findings + judge("gaussians", {"apart": _apart(seed, found, places)})
        if seed in second:
            judged += _compared(primitive.dbh_cm, second[seed])
        judged += judge("gaussians", {"dbh_cm": primitive.dbh_cm})
        flag = judged.flag("gaussians")
        refused = flag == "reject"
        x, y, z = frame.to_project(np.array([[*places[seed], stem.origin[2]]]))[0]
        slope = primitive.shape[2:4]
        trees.append(
            Tree(
                tree_id=seed + 1,
                x=float(x),
                y=float(y),
                z_ground=float(z),
                dbh_cm=None if refused else primitive.dbh_cm,
                dbh_se_cm=None if refused else float(np.hypot(primitive.se_cm, soft_cm.get(seed, 0.0))),
                bh_m=bh_m,
                lean_deg=float(np.degrees(np.arctan(np.hypot(*slope)))),
                n_views=primitive.n_views,
                taper_cm_m=None if refused else 200 * float(primitive.shape[7]),
                method="gaussians-stem",
                qc_flag=flag,
                qc_reason=",".join(judged.reasons),
            ).finish()
        )
    return trees


def _apart(seed: int, found: dict[int, FoundStem], places: dict[int, np.ndarray]) -> float:
    """Distance to the nearest primitive that predicts the photos better, over the sum of both radii."""
    own = found[seed].primitive
    return min(
        (
            float(np.hypot(*(places[other] - places[seed]))) / (rival.primitive.shape[6] + own.shape[6])
            for other, rival in found.items()
            if (rival.primitive.loss, other) < (own.loss, seed)
        ),
        default=np.inf,
    )


def _compared(dbh_cm: float, other_cm: float | None) -> Findings:
    """Against another method's diameter, cm; ``None``: that method refused the stem."""
    off_cm = np.inf if other_cm is None else abs(other_cm - dbh_cm)
    return judge("gaussians", {"other_off_cm": off_cm}, other_cm or 0.0)


def place_of(stem: FoundStem, bh_m: float) -> np.ndarray:
    """(2,) axis at breast height, local frame."""
    return stem.origin[:2] + axis_xy(stem.primitive.shape, bh_m, np.array([bh_m]))[0]
