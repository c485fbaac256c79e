"""Trees that are far too short for their diameter are flagged, and refused where that is the third reason."""

from __future__ import annotations

import numpy as np
import pytest

from treedgs_geo.stems.quality.proportions import check_heights
from treedgs_geo.stems.quality.tree import Tree


def height(d):
    return 1.37 + (d / (1.1 + 0.19 * d)) ** 2


def stand(n=30, spread=0.05, seed=1):
    rng = np.random.default_rng(seed)
    d = rng.uniform(12, 45, n)
    return [
        Tree(k, float(3 * k), 0.0, dbh_cm=float(d[k]), dbh_se_cm=0.9,
             height_m=float(1.37 + (height(d[k]) - 1.37) * np.exp(rng.normal(0, spread))))
        for k in range(n)
    ]  # fmt: skip


def test_a_sapling_read_as_a_tree_is_refused_and_a_broken_one_to_check():
    """As on a rendered plot: 5.3 cm read as 11.0 on half a circumference, under twigs of 7.6 m."""
    sapling = Tree(
        90, 0, 9, dbh_cm=11.0, dbh_se_cm=1.8, height_m=7.57, qc_flag="check", qc_reason="short_arc,wide_error"
    )
    broken = Tree(91, 5, 9, dbh_cm=30.0, dbh_se_cm=0.9, height_m=11.0)
    unsure = Tree(92, 9, 9, dbh_cm=30.0, dbh_se_cm=0.9, height_m=11.0, qc_flag="check", qc_reason="edge")
    trees = [*(tree.finish() for tree in stand()), sapling.finish(), broken.finish(), unsure.finish()]
    check_heights(trees)
    assert (sapling.qc_flag, sapling.dbh_cm) == ("reject", None)
    assert sapling.qc_reason == "short_arc,wide_error,too_short"
    assert (broken.qc_flag, broken.qc_reason, broken.dbh_cm) == ("check", "too_short", 30.0)
    assert (unsure.qc_flag, unsure.qc_reason) == ("check", "edge,too_short")
    assert all(tree.qc_flag == "ok" for tree in trees[:30])


@pytest.mark.parametrize("spread", [0.0, 0.05, 0.08, 0.12])
def test_heights_of_a_stand_are_not_doubted(spread):
    for seed in range(20):
        trees = stand(40, spread, seed)
        check_heights(trees)
        assert sum(tree.qc_flag != "ok" for tree in trees) <= 1


def test_nothing_to_compare_with_is_no_doubt():
    low = Tree(90, 0, 9, dbh_cm=30.0, dbh_se_cm=0.9, height_m=6.0)
    for others in (
        stand(8),
        [],
        [Tree(k, k, 0, dbh_cm=20.0, height_m=15.0) for k in range(30)],
        [Tree(k, k, 0, dbh_cm=20.0 + k) for k in range(30)],
    ):
        check_heights([*others, low])
        assert low.qc_flag == "ok"
    refused = Tree(91, 0, 9, qc_flag="reject", qc_reason="occluded", height_m=4.0)
    check_heights([*stand(), refused])
    assert refused.qc_reason == "occluded"


def test_a_stem_under_another_crown_does_not_keep_its_height():
    """As on plot_e: 13 cm under a crown of 21 m, which the tree's own points do not tell from it."""
    under = Tree(90, 0, 9, dbh_cm=12.4, dbh_se_cm=0.5, height_m=float(2.0 * height(12.4))).finish()
    trees = [*(tree.finish() for tree in stand()), under]
    check_heights(trees)
    assert (under.height_m, under.height_why, under.qc_flag, under.dbh_cm) == (None, "other_tree", "ok", 12.4)
    assert all(tree.height_m is not None for tree in trees[:30])
