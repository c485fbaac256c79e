"""Stems judged beside the plot's others: thicker rings of points, and bark inside them."""

from __future__ import annotations

import numpy as np
import pytest

from treedgs_geo.stems.cloud.estimate.cloud import bark_inside, beside_the_others
from treedgs_geo.stems.cloud.estimate.rings import Inside
from treedgs_geo.stems.cloud.estimate.stem import StemMeasure, refuse
from treedgs_geo.stems.quality.assessment import Assessment


def stem(noise_m: float, flag: str = "ok") -> StemMeasure:
    return StemMeasure(None, Assessment(30.0, 1.0, flag=flag), noise_m=noise_m)  # type: ignore[arg-type]


USUAL = [stem(0.008), stem(0.0085), stem(0.0075), stem(0.008)]


@pytest.mark.parametrize(
    ("noise_m", "flag"), [(0.0115, "ok"), (0.0125, "check"), (0.0140, "check"), (0.0150, "reject"), (np.nan, "ok")]
)
def test_a_thick_ring_is_flagged_and_a_thicker_one_refused(noise_m, flag):
    *others, last = beside_the_others([*USUAL, stem(noise_m)])
    assert repr(others) == repr(USUAL)
    assert last.assessment.flag == flag and ("covered" in last.assessment.reasons) == (flag != "ok")


def test_the_error_of_a_flagged_one_grows_with_the_excess():
    less, more = (beside_the_others([*USUAL, stem(noise)])[-1].assessment.se_cm for noise in (0.0120, 0.0140))
    assert 1.0 < less < more and more > 4


def test_refused_stems_do_not_count_and_few_stems_are_not_compared():
    kept = beside_the_others([*USUAL, refuse("occluded"), stem(0.02, "check")])
    thick = kept[5].assessment
    assert repr(kept[4]) == repr(refuse("occluded")) and thick.reasons == ("covered",) and thick.flag == "reject"
    few = [stem(0.008), stem(0.03), refuse("few_points")]
    # By their texts: from Python 3.13 on NaN makes a dataclass differ from itself.
    assert repr(beside_the_others(few)) == repr(few)


def leaning(skew_se: float, depth_m: float = 0.03) -> StemMeasure:
    return StemMeasure(None, Assessment(30.0, 0.5), inside=Inside(skew_se, depth_m))


@pytest.mark.parametrize(
    ("skew_se", "flagged"),
    [
        ([0.3, -1, 0.5, -0.2, 0.0, -2, 1, 0.8, 2.3], 0),  # by chance
        ([0.3, -1, 0.5, -0.2, 0.0, -2, 1, 0.8, 2.9], 1),
        ([1.9, 2.1, 1.8, 2.4, 2.0, 1.7, 2.2, 1.6, 2.3], 9),  # each by chance, but not all
        ([-3.0] * 9, 0),
        ([np.nan, 3.0], 1),
    ],
)
def test_bark_inside_the_ring_counts_with_that_of_the_others(skew_se, flagged):
    found = [each.assessment for each in bark_inside([leaning(value) for value in skew_se])]
    covered = [each for each in found if "covered" in each.reasons]
    assert len(covered) == flagged and all(each.flag == "check" for each in covered)
    # The bark may lie as deep as what shows: 6 cm of diameter less.
    assert all(each.lo_cm == pytest.approx(30 - 6 - 1.645 * 0.5, abs=0.01) for each in covered)


def test_a_plot_without_bark_inside_stays_as_it_is():
    some = [*USUAL, refuse("occluded")]
    assert repr(bark_inside(some)) == repr(some)
