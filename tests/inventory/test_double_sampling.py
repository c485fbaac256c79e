"""The difference estimator against numbers by hand and against every possible sample."""

from itertools import combinations

import numpy as np
import pytest

from treedgs_geo.core.errors import InputError
from treedgs_geo.inventory.double_sampling.designs import draw_trees
from treedgs_geo.inventory.double_sampling.estimators import (
    Tapes,
    correct_total,
    more_tapes_to_halve,
    share_out,
    t_factor,
    without_unanswered,
)

X = np.array([2.0, 3.0, 5.0, 4.0, 7.0, 6.0])
Y = np.array([2.5, 2.0, 6.0, 4.5, 7.5, 0.0])


def test_the_difference_estimator_is_unbiased_over_all_samples_and_its_variance_too():
    found, variances = [], []
    for chosen in combinations(range(6), 3):
        mine = np.array(chosen)
        tapes = Tapes(np.full(3, 0.5), np.full(3, "all", object))
        made = correct_total(tapes, X.sum(), X[mine], Y[mine], np.zeros(3))
        found.append(made.total)
        variances.append(made.se**2)
    assert np.mean(found) == pytest.approx(Y.sum())
    assert np.mean(variances) == pytest.approx(np.var(found))


def test_the_variance_is_the_textbooks_for_a_stratified_sample():
    prob = np.array([0.5, 0.5, 0.2, 0.2, 0.2])
    stratum = np.array(["a", "a", "b", "b", "b"], object)
    value = np.array([1.0, 3.0, 2.0, 2.5, 6.0])
    got, df = Tapes(prob, stratum).variance(value)
    by_hand = sum(n**2 * (1 - m / n) * np.var(v, ddof=1) / m for n, m, v in ((4, 2, value[:2]), (15, 3, value[2:])))
    assert got == pytest.approx(by_hand)
    assert 0 < df <= 3


def test_tapes_of_all_trees_leave_the_tapes_own_error():
    made = correct_total(Tapes(np.ones(6), np.full(6, "all", object)), X.sum(), X, Y, np.full(6, 0.3))
    assert made.total == pytest.approx(Y.sum()) and made.se == pytest.approx(0.3 * np.sqrt(6))


def test_the_variance_holds_the_tapes_own_error_whatever_the_chance_of_the_draw():
    rng = np.random.default_rng(3)
    for n in (2, 5):
        found, variances = [], []
        for chosen in combinations(range(6), n):
            mine, tapes = np.array(chosen), Tapes(np.full(n, n / 6), np.full(n, "all", object))
            for noise in rng.normal(0, 2.0, (1500, n)):
                made = correct_total(tapes, X.sum(), X[mine], Y[mine] + noise, np.full(n, 2.0))
                found.append(made.total)
                variances.append(made.se**2)
        assert np.mean(variances) == pytest.approx(np.var(found), rel=0.04)


def test_a_lone_tape_of_a_stratum_joins_its_neighbour_and_alone_says_nothing():
    stratum = np.array(["a", "b", "b"], object)
    variance, _ = Tapes(np.full(3, 0.1), stratum).variance(np.array([1.0, 2.0, 4.0]))
    assert np.isfinite(variance) and variance > 0
    variance, df = Tapes(np.array([0.1]), np.array(["a"], object)).variance(np.array([1.0]))
    assert np.isnan(variance) and np.isnan(df) and np.isnan(t_factor(0.9, df))


def test_trees_that_were_not_reached_are_represented_by_their_stratum():
    tapes = Tapes(np.array([0.5, 0.5, 0.25, 0.25]), np.array(["a", "a", "b", "b"], object))
    left = without_unanswered(tapes, np.array([True, True, True, False]))
    assert left.prob.tolist() == [0.5, 0.5, 0.125]
    assert left.total(np.ones(3)) == pytest.approx(tapes.total(np.ones(4)))
    with pytest.raises(InputError, match="Of stratum 'b' no tree was taped"):
        without_unanswered(tapes, np.array([True, True, False, False]))


def test_trees_that_the_map_lacks_count_once_whichever_trees_were_drawn():
    rng = np.random.default_rng(5)
    plot = np.repeat([0, 1, 2, 3], [10, 20, 5, 25])
    size, flag = rng.gamma(3, 1, 60), np.array(["ok"] * 60, object)
    lacking = [(0, 1.5), (1, 0.5), (1, 2.0), (3, 1.0)]
    members = {k: int((plot == k).sum()) for k in range(4)}
    found = []
    for seed in range(3000):
        draw = draw_trees(size, flag, 12, seed)
        seen = set(plot[draw.index])
        extra = [(where, None, value) for where, value in lacking if where in seen]
        shared = share_out(draw.index.astype(object), plot[draw.index].astype(object), members, extra)
        found.append(np.sum(shared / draw.prob))
    assert np.mean(found) == pytest.approx(5.0, abs=5 * np.std(found) / np.sqrt(3000))
    assert share_out(np.array([7], object), np.array([0], object), members, [(None, 7, 2.0)]).tolist() == [2.0]
    with pytest.raises(InputError, match="plot 9, where no tree was taped"):
        share_out(np.array([7], object), np.array([0], object), members, [(9, None, 1.0)])


def test_more_tapes_to_halve():
    # With very many trees four times as many tapes; with few, fewer, by the finite population correction.
    assert more_tapes_to_halve(20, 10**9) == 60
    more = more_tapes_to_halve(20, 91)
    se = [np.sqrt(1 / n - 1 / 91) for n in (20, 20 + more, 19 + more)]
    assert se[1] <= se[0] / 2 < se[2]
    assert more_tapes_to_halve(91, 91) == 0
