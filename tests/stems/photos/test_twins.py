"""Two full stems that touch: across the pair they are one wide stem, along it the photos show a narrow one."""

from __future__ import annotations

import numpy as np
import pytest
from clear_fit import CLEAR
from rendered_stems import Stem, oblique_views, render

from treedgs_geo.reconstruction.area import Area
from treedgs_geo.stems.photos.evidence.double_stem import find_twins, halves
from treedgs_geo.stems.photos.fit.null_model import BREAST, build_null, coarse_strips
from treedgs_geo.stems.photos.fit.search import Prior, Search
from treedgs_geo.stems.photos.images.axis_patches import StemAxis
from treedgs_geo.stems.photos.images.background import cut_silhouette, make_backdrop
from treedgs_geo.stems.photos.images.crops import GroundGrid, load_stack
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.quality_control import Evidence, quality_control
from treedgs_geo.stems.photos.tuned import MIN_SPLIT_M
from treedgs_geo.stems.quality.limits import bound_of

OPTIONS = PhotoStemOptions(max_dbh_cm=60, stem_network="off")
NO_SUN = np.array([np.nan])
#: Two that stand a centimetre apart, together 43 cm wide; one alone that wide, one thin.
PAIR, WIDE, THIN = [Stem(-0.115, 0.0, 0.11), Stem(0.105, 0.0, 0.10)], Stem(2.4, 0.5, 0.215), Stem(-2.0, -1.2, 0.09)


def flat(x, y):
    return np.zeros_like(np.asarray(x, float))


@pytest.fixture(scope="module")
def gain(tmp_path_factory):
    """``gain(x, y, r)``: of two stems inside that disc; ``silhouettes=False``: without them."""
    views = oblique_views(tmp_path_factory.mktemp("twins"), 12)
    render(views, [*PAIR, WIDE, THIN])
    area = Area.circle(0, 0, 3.5)
    grid = GroundGrid.sample(flat, area, 4.0)
    stack = load_stack(views, area, grid, 96, 2.0)
    backdrop = make_backdrop(stack, grid, area.bounds(4.0))
    places = np.random.default_rng(1).uniform(-2.5, 2.5, (40, 2))
    null = build_null(stack, grid, places, OPTIONS, NO_SUN)

    def of(x: float, y: float, r: float, silhouettes: bool = True) -> float:
        axis = StemAxis(np.array([x, y]), np.zeros(2), np.zeros(2), 0.0, OPTIONS.bh_m)
        search = Search(*coarse_strips(stack, axis, OPTIONS, NO_SUN), null, Prior())
        outline = cut_silhouette(stack, backdrop, grid, axis, BREAST.silhouette) if silhouettes else None
        return find_twins(search, np.array([0.0, 0.0, 0.0, 0.0, r]), outline)

    return of


def test_two_stems_explain_a_pair_better_than_the_disc_that_holds_them(gain):
    twins = gain(-0.01, 0.0, 0.215)
    assert twins.gain > bound_of("photos", "twins", "reject")
    assert twins.share > bound_of("photos", "twins_share", "check")


@pytest.mark.parametrize("stem", [WIDE, THIN])
def test_a_stem_alone_is_no_pair(gain, stem):
    twins = gain(stem.x, stem.y, stem.r)
    assert not twins.gain > 0.0 and not twins.share > 0.0


def test_nothing_is_said_of_thin_discs_and_without_silhouettes(gain):
    assert np.isnan(gain(THIN.x, THIN.y, 0.9 * MIN_SPLIT_M)).all()
    assert np.isnan(gain(-0.01, 0.0, 0.215, silhouettes=False)).all()


def test_halves_fill_their_disc_in_one_direction():
    disc = np.array([0.1, -0.2, 0.02, 0.0, 0.2])
    for pair in halves(disc):
        apart = np.hypot(*(pair[5:7] - pair[:2]))
        assert apart == pytest.approx(pair[4] + pair[9]) == pytest.approx(disc[4])
        for part in (pair[:5], pair[5:]):
            assert np.hypot(*(part[:2] - disc[:2])) + part[4] == pytest.approx(disc[4])


def test_what_the_gain_means_for_the_tree():
    flags = [quality_control(Evidence(**CLEAR, twins=gain)) for gain in (np.nan, -40.0, 14.0, 16.0, 31.0)]
    assert [flag for flag, *_ in flags] == ["ok", "ok", "ok", "check", "reject"]
    assert flags[-1][1] == ("merged",)
    alone = [
        Evidence(**CLEAR, twins_share=share, thicker_sd=sd)
        for share, sd in ((0.0, 2.6), (0.24, 2.6), (0.26, 2.4), (0.26, 2.6))
    ]
    assert [quality_control(evidence)[0] for evidence in alone] == ["ok", "ok", "ok", "check"]
    assert quality_control(alone[-1])[1] == ("merged",)
    assert alone[-1].open_cm == [12.0] and not any(evidence.open_cm for evidence in alone[:-1])
