"""Which explanation is the stem: stems that others touch, evidence over the same photos, errors from few photos."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rendered_stems import Stem, oblique_views, render

from treedgs_geo.reconstruction.area import Area
from treedgs_geo.stems.photos.evidence.error_budget import (
    scatter_cm,
    seen_oval_error_cm,
)
from treedgs_geo.stems.photos.fit.edge_adjustment import FineFit
from treedgs_geo.stems.photos.fit.search import Hypothesis, Prior
from treedgs_geo.stems.photos.fit.selection import Explanation, choose
from treedgs_geo.stems.photos.images.axis_patches import StemAxis
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.quality_control import ErrorParts
from treedgs_geo.stems.photos.route import search_photos
from treedgs_geo.stems.photos.tuned import ERROR_WEIGHTS

STEM, ALONE = Stem(0.5, 0.3, 0.15), Stem(-0.6, -0.5, 0.17)
SAPLING = Stem(0.5 + 0.185 * np.cos(0.8), 0.3 + 0.185 * np.sin(0.8), 0.035)


#: A stand of which nothing is known.
NOWHERE = Prior(r_sd=10.0)


@pytest.fixture(scope="module")
def fits(tmp_path_factory):
    folder = tmp_path_factory.mktemp("touched")
    made = oblique_views(folder, 14)
    render(made, [STEM, SAPLING, ALONE], seed=5)
    flat = lambda x, y: np.zeros_like(np.asarray(x, float))  # noqa: E731
    return search_photos(made, flat, Area.circle(0, 0, 1.0), PhotoStemOptions(margin_m=0.2)).fits


def nearest(fits, stem):
    return min(fits, key=lambda fit: np.hypot(fit.axis.p[0] - stem.x, fit.axis.p[1] - stem.y))


def test_a_touched_stem_is_not_round(fits):
    fit = nearest(fits, STEM)
    # Stem and sapling together are 37 cm wide.
    assert fit.flag != "ok" and "not_round" in fit.reasons and abs(fit.dbh_cm - 30) < 3.5


def test_a_stem_beside_it_is_measured(fits):
    fit = nearest(fits, ALONE)
    assert fit.flag == "ok" and fit.reasons == () and abs(fit.dbh_cm - 34) < 0.8


def explanation(dbh_cm: float, contrast: float, evidence: float, edges: float = 50.0, rms: float = 0.5) -> Explanation:
    nothing = np.zeros(3)
    fine = FineFit(
        StemAxis(np.zeros(2), np.zeros(2), np.zeros(2), 0.0, 1.37),
        dbh_cm / 200,
        -0.005,
        nothing,
        nothing,
        rms,
        0.001,
    )
    vector = np.array([0, 0, 0, 0, dbh_cm / 200])
    return Explanation(
        edges, contrast, Hypothesis(0, 0, 0, 0, dbh_cm / 200, edges), fine, vector, nothing, evidence, rms
    )


def test_evidence_over_the_same_photos_beats_a_high_edge_score():
    half, whole = explanation(22, 1.0, 2000, edges=120), explanation(30, 1.4, 2500, edges=60)
    choice = choose([half, whole], 1.0, 1.0, Prior(), np.array([np.nan]))
    assert choice.best is whole and choice.sure > 0.95


def test_two_diameters_with_equal_support_are_even_odds_and_one_diameter_is_sure():
    one, same, other = explanation(30, 1.2, 2000), explanation(30.8, 1.2, 2000), explanation(36, 1.2, 2000)
    assert choose([one, other], 1.0, 1.0, NOWHERE, np.array([np.nan])).sure == pytest.approx(0.5, abs=1e-4)
    assert choose([one, same], 1.0, 1.0, NOWHERE, np.array([np.nan])).sure == pytest.approx(1.0)
    assert choose([one, same, other], 1.0, 1.0, NOWHERE, np.array([np.nan])).sure == pytest.approx(2 / 3, abs=1e-4)


def test_where_edges_alone_speak_a_part_is_no_rival_of_its_whole():
    whole, part, other = (explanation(dbh, 0.0, 0.0, edges) for dbh, edges in ((30, 100), (24, 110), (36, 90)))
    choice = choose([whole, part], 0.0, 1.0, Prior(), np.array([np.nan]))
    assert choice.best is whole and choice.sure == pytest.approx(1.0)
    beside = replace(other, vector=other.vector + np.array([0.15, 0, 0, 0, 0]))
    assert choose([whole, beside], 0.0, 1.0, Prior(), np.array([np.nan])).sure == pytest.approx(0.9, abs=1e-3)


def test_between_two_limbs_stands_no_third_stem():
    def at(x: float, item: Explanation) -> Explanation:
        return replace(item, vector=item.vector + np.array([x, 0, 0, 0, 0]))

    limb, middle = at(0.0, explanation(15, 0.9, 2000, edges=176)), at(0.09, explanation(15, 2.0, 2400, edges=89))
    whole = at(0.0, explanation(24, 2.0, 2400, edges=89))
    assert choose([limb, middle], 1.0, 1.0, Prior(), np.array([np.nan])).best is limb
    assert choose([limb, whole], 1.0, 1.0, Prior(), np.array([np.nan])).best is whole


def test_ragged_edges_and_an_odd_taper_count_against():
    smooth = explanation(30, 1.2, 2000, rms=0.46)
    ragged = explanation(36, 1.2, 2000, rms=0.56)
    odd = replace(explanation(36, 1.2, 2000, rms=0.46), fine=replace(smooth.fine, r0=0.18, r1=0.003))
    for rival in (ragged, odd):
        choice = choose([rival, smooth], 1.0, 1.0, Prior(), np.array([np.nan]))
        assert choice.best is smooth and 0.6 < choice.sure < 1.0


def test_a_diameter_that_no_stem_of_the_stand_has_needs_clearer_witnesses():
    usual, thick = explanation(28, 1.2, 2000), explanation(80, 1.5, 2000)
    here = Prior(r=0.14, r_sd=0.03)
    assert choose([usual, thick], 1.0, 1.0, NOWHERE, np.array([np.nan])).best is thick
    choice = choose([usual, thick], 1.0, 1.0, here, np.array([np.nan]))
    assert choice.best is usual and choice.sure > 0.99
    # A stand has stems that are not like the others.
    assert choose([usual, replace(thick, contrast=12.0)], 1.0, 1.0, here, np.array([np.nan])).best.contrast == 12.0


def test_photos_that_agree_leave_the_error_of_their_mean():
    def se_cm(n: int) -> float:
        return scatter_cm(0.004 * np.resize([-1.0, 1.0], n), np.ones(n))

    assert se_cm(1) > 40
    assert se_cm(4) / se_cm(24) == pytest.approx(np.sqrt(6)) and se_cm(24) == pytest.approx(0.8 / np.sqrt(24))


def test_the_error_is_that_of_its_weighted_parts():
    parts = ErrorParts(formal=0.3, above=0.4)
    weighted = ERROR_WEIGHTS["formal"] * 0.3, ERROR_WEIGHTS["above"] * 0.4
    assert parts.se_cm == pytest.approx(np.hypot(*weighted)) and set(ERROR_WEIGHTS) == set(ErrorParts._fields)


def test_an_oval_that_the_photos_show_widens_the_error_and_scatter_alone_does_not():
    azimuth, weight = np.radians(np.arange(0, 360, 20.0)), np.ones(18)
    scatter = np.random.default_rng(5).normal(0, 0.3, (40, 18))
    oval = 1.2 * np.cos(2 * (azimuth - 0.4))
    plain = [seen_oval_error_cm(30, noise, azimuth, weight) for noise in scatter]
    seen = [seen_oval_error_cm(30, noise + oval, azimuth, weight) for noise in scatter]
    assert np.mean(plain) < 0.02 and np.median(seen) == pytest.approx(1.2 - 0.15, rel=0.1)
    # Photos from one side show nothing of an oval; photos without both edges are left out.
    assert seen_oval_error_cm(30, scatter[0], np.zeros(18), weight) < 0.3
    hidden = np.where(np.arange(18) % 2, np.nan, scatter[0] + oval)
    assert seen_oval_error_cm(30, hidden, azimuth, weight) == seen_oval_error_cm(
        30, (scatter[0] + oval)[::2], azimuth[::2], weight[::2]
    )
    assert seen_oval_error_cm(30, np.full(18, np.nan), azimuth, weight) == 0.0
