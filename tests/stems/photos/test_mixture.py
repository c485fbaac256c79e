"""Where it is unsure which explanation is right, the interval carries all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from clear_fit import CLEAR, clear_photo_fit

from treedgs_geo.core.intervals import HALF_WIDTH_SE
from treedgs_geo.stems.photos.deduplicate import merge
from treedgs_geo.stems.photos.evidence.other_explanations import other_explanations
from treedgs_geo.stems.photos.fit.edge_adjustment import FineFit
from treedgs_geo.stems.photos.fit.photo_fit import PhotoFit
from treedgs_geo.stems.photos.fit.search import Hypothesis
from treedgs_geo.stems.photos.fit.selection import Explanation, Selected
from treedgs_geo.stems.photos.images.axis_patches import StemAxis
from treedgs_geo.stems.photos.quality_control import Evidence, explanations
from treedgs_geo.stems.photos.tuned import OPEN_SHARE, WRONG_SD
from treedgs_geo.stems.quality.mixture import Mixture
from treedgs_geo.stems.quality.tree import Tree, with_block_errors


def explanation(dbh_cm: float) -> Explanation:
    nothing = np.zeros(3)
    axis = StemAxis(np.zeros(2), np.zeros(2), np.zeros(2), 0.0, 1.37)
    fine = FineFit(axis, dbh_cm / 200, -0.005, nothing, nothing, 0.5, 0.001)
    return Explanation(50.0, 1.0, Hypothesis(0, 0, 0, 0, dbh_cm / 200, 50.0), fine, np.zeros(5), nothing)


def choice(*dbh_and_share: tuple[float, float]) -> Selected:
    rivals = tuple(explanation(dbh) for dbh, _ in dbh_and_share)
    return Selected(rivals[0], 0.7, rivals, np.array([share for _, share in dbh_and_share]))


def test_one_explanation_is_the_plain_interval():
    one = Mixture(np.ones(1), np.array([30.0]), np.array([0.5]))
    assert one.interval_cm == pytest.approx((30 - HALF_WIDTH_SE * 0.5, 30 + HALF_WIDTH_SE * 0.5), abs=0.01)


def test_a_rival_pulls_its_side_of_the_interval_only():
    low, high = Mixture(np.array([0.8, 0.2]), np.array([62.9, 56.7]), np.array([0.4, 0.4])).interval_cm
    assert low < 56.7 < 62.9 < high < 64.0


def test_the_interval_holds_as_often_as_it_says():
    mixture = Mixture(np.array([0.6, 0.3, 0.1]), np.array([30.0, 36.0, 20.0]), np.array([0.5, 0.8, 1.0]))
    rng = np.random.default_rng(5)
    of = rng.choice(3, size=20000, p=mixture.share)
    truth = rng.normal(mixture.dbh_cm[of], mixture.se_cm[of])
    low, high = mixture.interval_cm
    assert np.mean((truth > low) & (truth < high)) == pytest.approx(0.9, abs=0.01)


def mixture(others, wrong=0.12, besides=()):
    return explanations(Evidence(**CLEAR | {"dbh_cm": 30.2, "others": others}), wrong, besides)


def test_what_is_wrong_lies_half_at_the_other_explanations_and_half_anywhere():
    several = mixture(other_explanations(choice((30.0, 0.7), (41.0, 0.2), (22.0, 0.1)), 30.2, 0.5))
    assert several.share.sum() == pytest.approx(1.0) and several.dbh_cm[:2] == pytest.approx([30.2, 30.2])
    assert several.share[:2] == pytest.approx([0.88, 0.06])
    assert several.se_cm[:2] == pytest.approx([0.5, WRONG_SD * 30.2])
    # Those others by their probabilities; the one that was taken is not among them.
    assert several.share[2:] == pytest.approx([0.04, 0.02]) and several.dbh_cm[2:] == pytest.approx([41.0, 22.0])
    alone = mixture(other_explanations(choice((30.0, 1.0)), 30.2, 0.5))
    assert alone.share == pytest.approx([0.88, 0.12])


def test_the_interval_grows_with_the_probability_that_the_diameter_is_wrong():
    others = other_explanations(choice((30.0, 0.7), (22.0, 0.3)), 30.2, 0.5)
    wide = [2 * mixture(others, wrong).se_of_interval_cm for wrong in (0.0, 0.01, 0.05, 0.1)]
    assert wide[0] == pytest.approx(2 * 0.5, abs=0.02) and wide[1] < 1.1 * wide[0]
    assert np.all(np.diff(wide) > 0) and wide[3] > 1.5 * wide[0]
    assert mixture(others).interval_cm[0] < 22.5  # towards the other explanation


def test_the_interval_reaches_what_is_open_besides():
    one_sided = mixture((), 0.0, [24.0])
    assert one_sided.share[[0, -1]] == pytest.approx([1 - OPEN_SHARE, OPEN_SHARE])
    assert one_sided.interval_cm == pytest.approx((24.0, 30.2 + HALF_WIDTH_SE * 0.5), abs=0.1)


def test_errors_that_a_plot_shares_widen_each_side_by_itself():
    tree = Tree(1, 0, 0, dbh_cm=30.0, dbh_se_cm=3.0, dbh_lo_cm=29.0, dbh_hi_cm=37.0, taper_cm_m=-1.0).finish()
    wide = with_block_errors(tree, 0.02, 0.0)
    extra = HALF_WIDTH_SE * 0.6
    assert wide.dbh_lo_cm == pytest.approx(30 - np.hypot(1.0, extra)) and wide.dbh_hi_cm == pytest.approx(
        30 + np.hypot(7.0, extra)
    )
    assert wide.dbh_se_cm == pytest.approx(np.hypot(3.0, 0.6))
    same = with_block_errors(replace(tree), 0.0, 0.0)
    assert (same.dbh_lo_cm, same.dbh_hi_cm) == (29.0, 37.0)


def fitted(dbh_cm: float, llr: float, x: float = 0.0) -> PhotoFit:
    return clear_photo_fit(x, dbh_cm, llr=llr, contrast=2.0, flag="ok")


def test_of_two_fits_of_one_stem_the_clearer_one_is_kept():
    better, other, beside = fitted(30.0, 120.0), fitted(34.0, 100.0, x=0.02), fitted(25.0, 110.0, x=1.0)
    assert merge([other, beside, better]) == [better, beside]
