"""Stems under ivy, in simulated photos: no number that is 10 cm too thick."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest
from clear_fit import clear_photo_fit, with_changes

from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import search_photos
from treedgs_geo.stems.photos.tuned import COVER_CM
from treedgs_lab.benchmarks.plot import site_of
from treedgs_lab.simulate.settings import SimulateSettings
from treedgs_lab.simulate.simulate import simulate_plot

CLEAR_FIT = clear_photo_fit(0.0, 30.0, llr=120.0, seen=np.ones(12))
FIT = replace(CLEAR_FIT, axis=replace(CLEAR_FIT.axis, p=np.zeros(2)))


@pytest.mark.parametrize(
    ("share", "flag"), [(0.0, "ok"), (0.12, "ok"), (0.13, "check"), (0.3, "check"), (0.31, "reject"), (np.nan, "ok")]
)
def test_flagged_or_refused_by_the_share_of_ivy(share, flag):
    judged = FIT.knowing(covered=share)
    assert judged.flag == flag and (judged.reasons == ("covered",)) == (flag != "ok")
    if flag == "check":  # the interval reaches the stem under the ivy, on that side only
        assert judged.assessment.lo_cm == pytest.approx(30 - COVER_CM, abs=0.3)
        assert judged.assessment.hi_cm == pytest.approx(FIT.assessment.hi_cm, abs=0.2)


def test_all_that_is_open_lies_in_the_interval():
    judged = FIT.knowing(twins=20.0, covered=0.25)
    assert set(judged.reasons) == {"merged", "covered"}
    assert judged.assessment.lo_cm < 12.5 and judged.assessment.hi_cm < 32


def test_a_refused_stem_learns_it_too_so_that_nothing_measures_it_again():
    refused = with_changes(FIT, flag="reject", reasons=("disagree",), contrast=2.0)
    judged = refused.knowing(covered=0.25)
    assert judged.flag == "reject" and judged.reasons == ("disagree", "covered")


def test_stems_under_ivy_are_refused_or_inside_their_interval_and_the_others_measured_as_before(tmp_path):
    plot = tmp_path / "plot"
    simulate_plot(
        SimulateSettings(output=plot, preset="micro", lidar_density_m2=0.0, ivy_stems=2, bark_variety=True, seed=12)
    )
    site = site_of(plot)
    ways = PhotoStemOptions(), PhotoStemOptions(stem_network="off")
    fits, plain = (search_photos(site.views, site.ground, site.area, options).fits for options in ways)
    with open(plot / "truth" / "looks.csv", encoding="utf-8") as stream:
        ivy = {row["tree_id"]: float(row["ivy_m"]) for row in csv.DictReader(stream)}
    with open(plot / "truth" / "trees.csv", encoding="utf-8") as stream:
        trees = [row for row in csv.DictReader(stream) if row["in_plot"] == "True"]
    covered = []
    for tree in trees:
        place = site.frame.to_local(np.array([[float(tree[name]) for name in ("E_bh", "N_bh", "h_bh")]]))[0, :2]
        near, before = (min(found, key=lambda fit: np.hypot(*(fit.axis.p - place))) for found in (fits, plain))
        if ivy[tree["tree_id"]] > 1.8:
            covered.append(near)
            assert near.flag != "ok" and (not near.measured or "covered" in near.reasons)
            assert not near.measured or near.assessment.lo_cm <= float(tree["dbh_cm"]) <= near.assessment.hi_cm
            assert before.dbh_cm > float(tree["dbh_cm"]) + 5
        else:
            assert near.dbh_cm == pytest.approx(before.dbh_cm, abs=0.5) and near.flag == before.flag
    assert 0 < len(covered) < len(trees)
