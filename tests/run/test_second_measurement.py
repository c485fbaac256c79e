"""Stems of low confidence measured again: which ones, and what each result changes."""

from __future__ import annotations

import math

import numpy as np
import pyproj
import pytest
from clear_fit import clear_photo_fit, with_changes

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.run.second_measurement import MAX_MEASURED_AGAIN, stems_to_measure_again, with_second_measurements
from treedgs_geo.stems.photos.fit.photo_fit import PhotoFit
from treedgs_geo.stems.photos.trees import trees_of_photo_fits
from treedgs_geo.stems.splats.primitive.fit import PrimitiveFit
from treedgs_geo.stems.splats.train import FoundStem

FRAME = LocalFrame(pyproj.CRS.from_epsg(6344), np.array([611337.0, 3718451.0, 38.0]))


def edges(
    x: float, dbh_cm: float, flag: str, *reasons: str, llr: float = 90.0, contrast: float = 2.0, **change: float
) -> PhotoFit:
    changed = {"se_cm": 0.4, "flag": flag, "reasons": reasons, "llr": llr, "contrast": contrast, **change}
    return clear_photo_fit(x, dbh_cm, foot_z=1.0, **changed)


def bark(x: float, dbh_cm: float, **change) -> FoundStem:
    values = {"se_cm": 0.8, "n_views": 9, "gap": math.inf, "evidence": 0.05, "loss": 0.25, **change}
    shape = np.array([0.0, 0.0, 0.05, 0.0, 0.0, 0.0, dbh_cm / 200, -0.0045])
    return FoundStem(
        np.array([x, 2.0, 1.0]),
        PrimitiveFit(shape, texture=np.zeros((24, 13, 3)), **values),
    )


def after(fits, found):
    return with_second_measurements(trees_of_photo_fits(fits, FRAME), fits, found, 1.37)


def test_only_stems_of_low_confidence_are_measured_again_the_clearest_first():
    fits = [
        edges(0, 30, "ok"),
        edges(2, 30, "reject", "ambiguous", llr=50),
        edges(4, 30, "check", "ambiguous"),
        edges(6, 6, "reject", "too_small"),
        edges(8, 30, "reject", "lean"),
        edges(10, 30, "reject", "occluded", llr=20, contrast=0.3),
        edges(12, 30, "reject", "ambiguous"),
    ]
    inside = np.array([True] * 6 + [False])
    assert stems_to_measure_again(fits, inside) == [2, 1]
    assert stems_to_measure_again(fits, inside, everyone=True) == [2, 1, 0]
    many = [edges(2 * k, 30, "reject", "ambiguous", llr=50 + k) for k in range(30)]
    assert stems_to_measure_again(many, np.ones(30, bool)) == list(range(29, 29 - MAX_MEASURED_AGAIN, -1))


def test_a_stem_with_another_at_its_side_is_not_measured_again():
    # A single cylinder takes a touching sapling, or the other limb of a fork, for a part of the stem.
    assert stems_to_measure_again([edges(0, 43, "reject", "ambiguous", gain=50.0)], np.ones(1, bool)) == []
    pair = [edges(0, 17, "check", "occluded"), edges(0.4, 16, "ok")]
    assert stems_to_measure_again(pair, np.ones(2, bool), everyone=True) == []
    apart = [edges(0, 17, "check", "occluded"), edges(0.8, 16, "ok"), edges(0.3, 16, "reject", "ambiguous")]
    assert stems_to_measure_again(apart, np.ones(3, bool)) == [0]


def test_what_soft_photos_add_to_the_error_stays_in_it():
    for read_cm in (30.8, 33.0):
        sharp, soft = (
            after([edges(0, 30, "reject", "ambiguous", soft_cm=cm)], {0: bark(0, read_cm)})[0][0] for cm in (0.0, 0.9)
        )
        assert soft.dbh_se_cm == pytest.approx(math.hypot(sharp.dbh_se_cm, 0.9))
        assert soft.dbh_hi_cm - soft.dbh_lo_cm > sharp.dbh_hi_cm - sharp.dbh_lo_cm


def test_a_refused_stem_that_both_see_alike_gets_the_photos_diameter():
    trees, again = after([edges(0, 30, "reject", "ambiguous")], {0: bark(0, 30.8)})
    tree = trees[0]
    assert (tree.qc_flag, tree.qc_reason, tree.method) == ("check", "ambiguous", "photos")
    assert tree.dbh_cm == 30 and tree.dbh_se_cm == pytest.approx(math.hypot(0.4, 0.4))
    assert tree.dbh_lo_cm < 30 < tree.dbh_hi_cm and tree.ba_m2 == pytest.approx(math.pi * 0.15**2)
    assert (again.measured, again.agreed, again.gained, again.flagged) == (1, 1, 1, 0)


def test_a_refused_stem_that_they_see_differently_gets_the_bark_s_diameter_and_both_reasons():
    trees, again = after([edges(0, 30, "reject", "ambiguous")], {0: bark(0.1, 35)})
    tree = trees[0]
    assert (tree.qc_flag, tree.qc_reason, tree.method) == ("check", "ambiguous,disagree", "gaussians-stem")
    assert tree.dbh_cm == pytest.approx(35) and tree.x == pytest.approx(611337.1) and tree.n_views == 9
    assert tree.lean_deg == pytest.approx(2.86, abs=0.01) and again.gained == 1 and again.agreed == 0
    assert tree.dbh_lo_cm < 31 and tree.dbh_hi_cm > 39


def test_a_refused_stem_whose_two_diameters_lie_far_apart_stays_refused():
    trees, again = after([edges(0, 17, "reject", "disagree")], {0: bark(0, 30)})
    assert trees == trees_of_photo_fits([edges(0, 17, "reject", "disagree")], FRAME) and again.gained == 0


def test_two_methods_that_agree_settle_which_explanation_is_right():
    unsure = with_changes(edges(0, 30, "check", "ambiguous"), se_cm=4.0, lo_cm=24.0, hi_cm=31.0)
    alone = trees_of_photo_fits([unsure], FRAME)[0]
    assert (alone.dbh_lo_cm, alone.dbh_hi_cm, alone.dbh_se_cm) == (24.0, 31.0, 4.0)
    tree = after([unsure], {0: bark(0, 30.6)})[0][0]
    assert tree.qc_flag == "check" and tree.dbh_se_cm == pytest.approx(math.hypot(0.8, 0.3))
    assert tree.dbh_lo_cm > 28


def test_a_measured_stem_that_they_see_differently_is_flagged_and_its_interval_holds_both():
    for flag in ("ok", "check"):
        trees, again = after([edges(0, 24, flag)], {0: bark(0, 18)})
        assert (trees[0].qc_flag, trees[0].qc_reason, trees[0].dbh_cm) == ("check", "disagree", 24)
        assert trees[0].dbh_lo_cm < 19.1 and again.flagged == 1
    trees, again = after([edges(0, 24, "ok")], {0: bark(0, 24.9)})
    assert trees[0].qc_flag == "ok" and trees[0].dbh_se_cm == 0.4 and again.agreed == 1


def test_a_primitive_that_edges_and_silhouette_contradict_together_says_nothing():
    fit = with_changes(edges(0, 15, "check", "disagree", contrast=1.1), outline_cm=13.2)
    trees, again = after([fit], {0: bark(0, 52)})
    assert trees == trees_of_photo_fits([fit], FRAME) and again.flagged == 0
    # Less far off, it may be right; so it may where no silhouette stands out.
    assert after([fit], {0: bark(0, 21)})[0][0].dbh_se_cm > 3


@pytest.mark.parametrize(
    "shown", [{"outline_cm": 30.0}, {"outline_cm": math.nan}, {"outline_cm": 15.0, "contrast": 0.8}]
)
def test_a_measured_stem_whose_diameter_the_other_leaves_open_is_refused(shown):
    fit = with_changes(edges(0, 15, "ok"), **shown)
    tree = after([fit], {0: bark(0, 52)})[0][0]
    assert (tree.qc_flag, tree.qc_reason, tree.dbh_cm) == ("reject", "disagree,wide_error", None)


@pytest.mark.parametrize("change", [{"n_views": 3}, {"gap": 1e-4}, {"evidence": 0.001}, {"se_cm": 9.0}])
def test_a_primitive_of_low_confidence_says_nothing(change):
    for fit in (edges(0, 30, "reject", "ambiguous"), edges(0, 24, "ok")):
        trees, again = after([fit], {0: bark(0, 30, **change)})
        assert trees == trees_of_photo_fits([fit], FRAME) and (again.agreed, again.gained, again.flagged) == (
            0,
            0,
            0,
        )


def test_a_primitive_that_slid_onto_its_neighbour_or_onto_a_twig_gives_nothing():
    fits = [edges(0, 30, "reject", "ambiguous"), edges(0.4, 30, "ok")]
    assert after(fits, {0: bark(0.35, 30)})[0] == trees_of_photo_fits(fits, FRAME)
    assert after(fits[:1], {0: bark(0, 6.0)})[0] == trees_of_photo_fits(fits[:1], FRAME)
    assert after(fits, {0: bark(-0.05, 30)})[0][0].dbh_cm == 30
