"""Stems under ivy, in simulated photos: no number that is 10 cm too thick."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest
from clear_fit import clear_photo_fit, with_changes

from treedgs_geo.reconstruction.area import Area
from treedgs_geo.stems.photos.evidence.ivy import with_cover
from treedgs_geo.stems.photos.fit.photo_fit import PhotoFit
from treedgs_geo.stems.photos.low_confidence import may_be_settled
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import search_photos
from treedgs_geo.stems.photos.search_steps import certain_stems, why_network
from treedgs_geo.stems.photos.tuned import COVER_CM
from treedgs_lab.benchmarks.plot import site_of
from treedgs_lab.simulate.settings import SimulateSettings
from treedgs_lab.simulate.simulate import simulate_plot

CLEAR_FIT = clear_photo_fit(0.0, 30.0, llr=120.0, seen=np.ones(12))
FIT = replace(CLEAR_FIT, axis=replace(CLEAR_FIT.axis, p=np.zeros(2)))


@pytest.mark.parametrize(
    ("share", "flag"), [(0.0, "ok"), (0.23, "ok"), (0.24, "check"), (0.42, "check"), (0.43, "reject"), (np.nan, "ok")]
)
def test_flagged_or_refused_by_the_share_of_ivy(share, flag):
    judged = with_cover(FIT, share)
    assert judged.flag == flag and (judged.reasons == ("covered",)) == (flag != "ok")
    if flag == "check":
        assert judged.se_cm == pytest.approx(np.hypot(0.5, COVER_CM * share))
        assert judged.assessment.lo_cm < 30 - 1.6 * judged.se_cm and judged.assessment.hi_cm > 30 + 1.6 * judged.se_cm


def test_a_wider_interval_of_before_is_kept():
    judged = with_cover(with_changes(FIT, flag="check", reasons=("ambiguous",), lo_cm=12.0, hi_cm=31.0), 0.25)
    assert judged.reasons == ("ambiguous", "covered")
    assert judged.assessment.lo_cm == 12.0 and judged.assessment.hi_cm > 35


def test_a_refused_stem_learns_it_too_so_that_nothing_measures_it_again():
    judged = with_cover(with_changes(FIT, flag="reject", reasons=("disagree",)), 0.25)
    assert judged.flag == "reject" and judged.reasons == ("disagree", "covered") and judged.se_cm == FIT.se_cm
    assert not may_be_settled(with_changes(judged, contrast=2.0))
    assert may_be_settled(with_changes(judged, reasons=("disagree",), contrast=2.0))


def test_certain_stems_are_the_ok_and_the_small_ones_of_the_area_each_once():
    def at(x: float, **changes) -> PhotoFit:
        return with_changes(FIT, axis=replace(FIT.axis, p=np.array([x, 0.0])), **changes)

    unsure = at(-2.0, flag="check", reasons=("ambiguous",))
    small = at(2.0, flag="reject", reasons=("too_small", "occluded"), dbh_cm=6.0, r0=0.03)
    hardly = with_changes(small, axis=replace(FIT.axis, p=np.array([3.0, 0.0])), dbh_cm=7.0)
    refused = at(-4.0, flag="reject", reasons=("disagree",))
    # A refused look at the first stem is not another stem.
    again = at(0.1, flag="reject", reasons=("few_views",), llr=30.0)
    fits, circle = [FIT, at(30.0), unsure, small, hardly, refused, again], Area.circle(0, 0, 5.0)
    assert certain_stems(fits, circle, 7.5) == (2, 5)
    assert certain_stems(fits, circle, 9.0) == (3, 5)
    assert certain_stems([], circle, 7.5) == (0, 0)


def test_the_network_is_asked_where_stems_are_uncertain_or_hidden():
    options, circle = PhotoStemOptions(), Area.circle(0, 0, 5.0)
    # Photos that look elsewhere (probability 0) hide nothing.
    half = with_changes(FIT, seen=np.repeat([1.0, 1e-3, 0.0], 20))
    assert why_network([half], circle, options) == ""
    assert why_network([], circle, options) == ""
    unsure = with_changes(half, flag="check", reasons=("ambiguous",))
    assert "0 of 1 stems are certain" in why_network([unsure], circle, options)
    hidden = with_changes(FIT, seen=np.repeat([1.0, 1e-3], [12, 28]))
    assert "hidden in 70 % of the photos" in why_network([hidden], circle, options)


def test_stems_under_ivy_are_refused_and_the_others_measured_as_before(tmp_path):
    plot = tmp_path / "plot"
    simulate_plot(
        SimulateSettings(output=plot, preset="micro", lidar_density_m2=0.0, ivy_stems=2, bark_variety=True, seed=12)
    )
    site = site_of(plot)
    ways = PhotoStemOptions(most_asked=0, enough_certain=0.0, min_seen=0.0), PhotoStemOptions(stem_network="off")
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
            assert near.flag != "ok" and "covered" in near.reasons
            assert before.dbh_cm > float(tree["dbh_cm"]) + 5
        else:
            assert (near.dbh_cm, near.se_cm, near.flag) == (before.dbh_cm, before.se_cm, before.flag)
    assert len(covered) < len(trees) and any(not fit.measured for fit in covered)
