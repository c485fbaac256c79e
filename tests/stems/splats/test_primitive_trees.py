"""Stem primitives as trees: flags, doubles, second measurements, coordinates."""

from __future__ import annotations

import math

import numpy as np
import pyproj
import pytest

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.stems.splats.primitive.fit import PrimitiveFit
from treedgs_geo.stems.splats.train import FoundStem
from treedgs_geo.stems.splats.trees import trees_of_primitives

FRAME = LocalFrame(pyproj.CRS.from_epsg(6344), np.array([611337.0, 3718451.0, 38.0]))


def stem(x: float, r: float = 0.15, **change) -> FoundStem:
    values = {"se_cm": 0.6, "n_views": 9, "gap": math.inf, "evidence": 0.05, "loss": 0.25, **change}
    shape = np.array([0.02, -0.01, 0.05, 0.0, 0.0, 0.0, r, -0.0045])
    primitive = PrimitiveFit(shape, texture=np.zeros((24, 13, 3)), **values)
    return FoundStem(np.array([x, 2.0, 1.0]), primitive)


def test_a_clear_stem_is_a_tree_where_it_stands():
    tree = trees_of_primitives({3: stem(5.0)}, FRAME, 1.37)[0]
    assert (tree.tree_id, tree.qc_flag, tree.method) == (4, "ok", "gaussians-stem")
    assert tree.dbh_cm == pytest.approx(30) and tree.taper_cm_m == pytest.approx(-0.9)
    assert (tree.x, tree.y, tree.z_ground) == pytest.approx((611342.02, 3718452.99, 39.0))
    assert tree.lean_deg == pytest.approx(2.86, abs=0.01) and tree.dbh_lo_cm < 30 < tree.dbh_hi_cm


@pytest.mark.parametrize(
    "change,flag,reason",
    [
        ({"n_views": 1}, "reject", "few_views"),
        ({"n_views": 3}, "check", "few_views"),
        ({"gap": 1e-4}, "reject", "ambiguous"),
        ({"gap": 8e-4}, "check", "ambiguous"),
        ({"r": 0.03}, "reject", "too_small"),
        ({"n_views": 3, "gap": 8e-4}, "reject", "few_views,ambiguous"),
        ({"evidence": 0.001}, "reject", "occluded"),
        ({"se_cm": 9.0}, "reject", "wide_error"),
    ],
)
def test_limits_flag_or_refuse(change, flag, reason):
    tree = trees_of_primitives({0: stem(0.0, **change)}, FRAME, 1.37)[0]
    assert tree.qc_flag == flag and reason in tree.qc_reason
    assert (tree.dbh_cm is None) == (flag == "reject")


def test_two_primitives_in_one_place_are_one_stem_and_methods_are_compared():
    trees = trees_of_primitives(
        {0: stem(0.0, loss=0.3), 1: stem(0.1, loss=0.2), 2: stem(4.0)}, FRAME, 1.37, {1: 30.5, 2: 36.0}
    )
    assert [tree.qc_flag for tree in trees] == ["reject", "ok", "check"]
    assert trees[0].qc_reason == "merged" and trees[2].qc_reason == "disagree"
    # What the other method refused is no stem to be sure of; what it did not measure is.
    alone = trees_of_primitives({0: stem(0.0), 1: stem(4.0)}, FRAME, 1.37, {0: None})
    assert [tree.qc_flag for tree in alone] == ["check", "ok"] and alone[0].qc_reason == "disagree"
    same = trees_of_primitives({0: stem(0.0), 1: stem(0.0)}, FRAME, 1.37)
    assert [tree.qc_flag for tree in same] == ["ok", "reject"]  # exactly one survives a tie


def test_what_soft_photos_add_is_in_the_error():
    sharp, soft = trees_of_primitives({0: stem(0.0), 1: stem(4.0)}, FRAME, 1.37, soft_cm={1: 0.9})
    own_cm = stem(0.0).primitive.se_cm
    assert sharp.dbh_se_cm == pytest.approx(own_cm)
    assert soft.dbh_se_cm == pytest.approx(np.hypot(own_cm, 0.9))
