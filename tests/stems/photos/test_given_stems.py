"""Stems at places that a person gives: found where they stand, refused where nothing stands, as the search would."""

from __future__ import annotations

import numpy as np
import pytest
from clear_fit import with_changes
from rendered_stems import Stem, oblique_views, render

from treedgs_geo.core.progress import Reporter
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.stems.photos.fit_records import KeptFits, look_record, read_fits, write_fits
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import Searched, fits_again, search_photos
from treedgs_geo.stems.photos.targeted_fit import GivenStems, partners

STEMS = [Stem(0.6, 0.4, 0.15), Stem(-1.5, 0.9, 0.11, lx=0.03), Stem(1.2, -1.6, 0.19)]
AREA, OPTIONS = Area.circle(0, 0, 3.0), PhotoStemOptions(margin_m=0.3)
#: Nothing stands within a metre.
EMPTY = (-1.2, -1.4)


def flat(x, y):
    return np.zeros_like(np.asarray(x, float))


@pytest.fixture(scope="module")
def views(tmp_path_factory):
    made = oblique_views(tmp_path_factory.mktemp("photos"), 14)
    render(made, STEMS)
    return made


@pytest.fixture(scope="module")
def searched(views) -> Searched:
    return search_photos(views, flat, AREA, OPTIONS)


def at(views, searched: Searched, places, known, reach_m: float = 0.5):
    given = GivenStems(np.array(places, float), reach_m)
    return fits_again(views, flat, AREA, OPTIONS, searched.looks, given, known, Reporter())


def of_stem(fits, stem):
    return min(fits, key=lambda fit: np.hypot(fit.axis.p[0] - stem.x, fit.axis.p[1] - stem.y))


@pytest.mark.parametrize("off", [(0.0, 0.0), (0.2, -0.1), (-0.25, 0.3)])
def test_a_stem_that_was_left_out_is_measured_at_its_place(views, searched, off):
    own = of_stem(searched.fits, STEMS[0])
    known = [fit for fit in searched.fits if fit is not own]
    (fit,) = at(views, searched, [(STEMS[0].x + off[0], STEMS[0].y + off[1])], known)
    assert fit is not None and fit.measured and np.hypot(*(fit.axis.p - own.axis.p)) < 0.02
    assert abs(fit.dbh_cm - own.dbh_cm) < 0.3 and abs(fit.dbh_cm - 200 * STEMS[0].r) < 0.8
    assert set(fit.photos) <= {view.name for view in views} and len(fit.photos) == len(fit.seen)


def test_where_nothing_stands_nothing_is_measured(views, searched):
    (fit,) = at(views, searched, [EMPTY], searched.fits)
    assert fit is not None and not fit.measured and fit.reasons == ("not_found",)
    assert np.allclose(fit.axis.p, EMPTY)


def test_each_place_has_its_answer_in_its_order(views, searched):
    places = [EMPTY, (STEMS[2].x, STEMS[2].y), (40.0, 40.0)]
    nothing, stem, beyond = at(views, searched, places, [])
    assert not nothing.measured and stem.measured and beyond is None
    assert abs(stem.dbh_cm - 200 * STEMS[2].r) < 0.8


def test_what_the_search_learnt_survives_its_file(searched, tmp_path):
    write_fits(tmp_path / "fits.json", KeptFits(searched.fits, looks=searched.looks))
    (look,), (kept,) = searched.looks, read_fits(tmp_path / "fits.json").looks
    assert look_record(kept) == look_record(look) and np.array_equal(kept.places, look.places)
    assert kept.network is True


def test_stems_of_a_field_crew_guide_the_search(views, searched):
    """Each is a stem of the result: one that the search finds by itself once, one where nothing stands refused."""
    field = [(stem.x + 0.2, stem.y - 0.2) for stem in STEMS] + [EMPTY]
    given = GivenStems(np.array(field), 0.5)
    fits = search_photos(views, flat, AREA, OPTIONS, given=given).fits
    assert [fit.measured for fit in fits].count(True) == len(STEMS)
    which = partners(given, fits)
    assert None not in which and len(set(which)) == len(field)
    assert [fits[k].measured for k in which] == [True, True, True, False] and fits[which[3]].reasons == ("not_found",)
    plain = sorted(round(fit.dbh_cm, 6) for fit in searched.fits if fit.measured)
    assert plain == sorted(round(fit.dbh_cm, 6) for fit in fits if fit.measured), "found by itself: as without"


def test_partners_are_one_to_one_and_measured_ones_first(searched):
    fit = of_stem(searched.fits, STEMS[0])
    both = GivenStems(np.array([fit.axis.p, fit.axis.p + [0.1, 0.0]]), 0.4)
    assert partners(both, [fit]) == [0, None]

    refused = with_changes(fit, flag="reject", reasons=("ambiguous",))
    one = GivenStems(np.array([fit.axis.p]), 0.4)
    assert partners(one, [refused, fit]) == [1] and partners(one, [refused]) == [0] and partners(one, []) == [None]
