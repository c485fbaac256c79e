"""Draws of trees to tape: their probabilities are what they say, and the draw repeats."""

import numpy as np
import pytest

from treedgs_geo.core.errors import InputError
from treedgs_geo.inventory.double_sampling.designs import allocate, draw_trees, strata


def stand(n=80, seed=3):
    rng = np.random.default_rng(seed)
    size = rng.gamma(3, 0.02, n)
    flag = np.where(rng.random(n) < 0.15, "check", "ok").astype(object)
    flag[rng.random(n) < 0.08] = "reject"
    return size, flag


def test_a_draws_stated_probabilities_are_how_often_each_tree_is_drawn():
    size, flag = stand()
    often, stated = np.zeros(len(size)), np.full(len(size), np.nan)
    for seed in range(1500):
        draw = draw_trees(size, flag, 20, seed)
        assert len(draw.index) == 20 and (np.diff(draw.index) > 0).all()
        often[draw.index] += 1
        stated[draw.index] = draw.prob
    assert np.isfinite(stated).all() and stated.sum() == pytest.approx(20)
    assert np.abs(often / 1500 - stated).max() < 5 * np.sqrt(0.25 / 1500)


def test_the_same_seed_draws_the_same_trees_and_another_one_others():
    size, flag = stand()
    first, again, other = (draw_trees(size, flag, 20, seed).index for seed in (7, 7, 8))
    assert (first == again).all() and not np.array_equal(first, other)


def test_strata_are_flags_and_classes_of_equal_basal_area():
    size, flag = stand(400)
    names = strata(size, flag, 30)
    assert set(names[flag == "check"]) == {"check"} and set(names[flag == "reject"]) == {"no DBH"}
    classes = sorted(set(names[flag == "ok"]))
    sums = [size[names == name].sum() for name in classes]
    assert len(classes) >= 3 and max(sums) < 1.15 * min(sums)
    assert all(size[names == a].max() <= size[names == b].min() for a, b in zip(classes, classes[1:], strict=False))
    counts = allocate(names, size, flag, 30)
    assert sum(counts.values()) == 30 and min(counts.values()) >= 2


@pytest.mark.parametrize("n", [2, 3, 5, 10])
def test_few_tapes_leave_no_stratum_with_one_of_several_trees(n):
    size, flag = stand()
    draw = draw_trees(size, flag, n, 0)
    assert len(draw.index) == n
    for name in set(draw.stratum):
        mine = draw.stratum == name
        assert mine.sum() >= 2 or draw.prob[mine].min() == 1


def test_one_tree_all_trees_no_tree_one_tape():
    assert draw_trees(np.ones(1), np.array(["ok"], object), 5, 0).prob.tolist() == [1.0]
    every = draw_trees(np.ones(9), np.array(["ok"] * 9, object), 9, 0)
    assert every.index.tolist() == list(range(9)) and (every.prob == 1).all()
    refused = np.array(["reject"] * 12, object)
    assert len(draw_trees(np.ones(12), refused, 4, 0).index) == 4
    with pytest.raises(InputError, match="no tree to draw from"):
        draw_trees(np.zeros(0), np.zeros(0, object), 5, 0)
    with pytest.raises(InputError, match="at least 2"):
        draw_trees(np.ones(4), np.array(["ok"] * 4, object), 1, 0)
