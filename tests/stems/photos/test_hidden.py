"""Stems whose breast height is hidden: measured above what hides it; and the reading above that every stem has."""

from __future__ import annotations

import numpy as np
import pytest
from clear_fit import clear_photo_fit, error_of
from rendered_stems import Stem, oblique_views, render

from treedgs_geo.reconstruction.area import Area
from treedgs_geo.stems.photos.evidence.upper_band import averaged, weight_above
from treedgs_geo.stems.photos.fit.edge_adjustment import FineFit
from treedgs_geo.stems.photos.fit_records import fit_of_record, fit_record
from treedgs_geo.stems.photos.images.axis_patches import StemAxis
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import search_photos
from treedgs_geo.stems.photos.upper_stem import stand_taper
from treedgs_geo.stems.quality.priors import TAPER_SD, USUAL_TAPER

#: The second stands in a thicket that is 3.2 m high and wider than any stem that is looked for.
STEMS = [Stem(0.8, 0.9, 0.15), Stem(-0.9, -0.6, 0.16)]
THICKET = Stem(-0.9, -0.6, 0.45, taper=-0.001, top=3.2)


def flat(x, y):
    return np.zeros_like(np.asarray(x, float))


@pytest.fixture(scope="module")
def fits(tmp_path_factory):
    views = oblique_views(tmp_path_factory.mktemp("thicket"), 14)
    render(views, [*STEMS, THICKET])
    # To the network the thicket is growth on the stem, which it refuses.
    options = PhotoStemOptions(margin_m=0.3, max_dbh_cm=60, stem_network="off")
    return search_photos(views, flat, Area.circle(0, 0, 2.5), options).fits


def of_stem(fits, stem):
    return min(fits, key=lambda fit: np.hypot(fit.axis.p[0] - stem.x, fit.axis.p[1] - stem.y))


def test_a_stem_in_a_thicket_is_measured_above_it_and_says_so(fits):
    hidden, clear = of_stem(fits, STEMS[1]), of_stem(fits, STEMS[0])
    assert hidden.flag == "check" and hidden.carried and "carried_down" in hidden.reasons
    assert np.hypot(hidden.axis.p[0] - STEMS[1].x, hidden.axis.p[1] - STEMS[1].y) < 0.08
    assert abs(hidden.dbh_cm - 200 * STEMS[1].r) < 1.645 * hidden.se_cm < 4.0
    assert clear.measured and not clear.carried and hidden.se_cm > clear.se_cm
    assert abs(clear.dbh_cm - 200 * STEMS[0].r) < 1.0


def test_the_thicket_is_no_stem(fits):
    assert all(fit.dbh_cm < 40 for fit in fits if fit.measured)
    assert sum(fit.measured for fit in fits) == len(STEMS)


def test_where_it_was_measured_is_kept(fits):
    hidden = of_stem(fits, STEMS[1])
    again = fit_of_record(fit_record(hidden))
    assert again.carried and again.reasons == hidden.reasons and again.dbh_cm == hidden.dbh_cm


def clear_stem(slope, **changed):
    return clear_photo_fit(0.0, 30.0, **changed | {"r1": slope})


def test_without_other_stems_the_usual_taper_carries():
    alone = stand_taper([])
    assert alone.slope == USUAL_TAPER and alone.sd == pytest.approx(np.sqrt(2) * TAPER_SD)
    # Flagged and carried ones say nothing of the stand.
    assert stand_taper([clear_stem(-0.001, flag="check"), clear_stem(-0.001, carried_m=2.0)]) == alone


def test_the_stand_says_by_how_much_a_diameter_grows_on_the_way_down():
    stand = stand_taper([clear_stem(slope) for slope in (-0.0035, -0.0025) * 6])
    assert stand.slope == pytest.approx((USUAL_TAPER - 12 * 0.003) / 13)
    assert TAPER_SD < stand.sd < 1.05 * TAPER_SD
    # Stems that differ much say less of the next one.
    assert stand_taper([clear_stem(slope) for slope in (-0.008, 0.002) * 6]).sd > stand.sd


def test_readings_are_averaged_and_their_difference_is_in_the_error():
    nothing = np.empty(0)
    axis = StemAxis(np.zeros(2), np.zeros(2), np.zeros(2), 0.0, 1.37)
    fine = FineFit(axis, 0.15, -0.005, nothing, nothing, 0.5, 0.001)
    thicker, error = averaged(fine, error_of(0.9), 2.0)
    assert thicker.r0 == pytest.approx(0.15 + 0.5 * 0.01) and thicker.r1 == fine.r1
    assert error == pytest.approx(error_of(0.9)._replace(above=1.0)) and error.se_cm > 0.9
    # A sure fit hardly moves, and an unsure one no farther than one of a centimetre.
    assert weight_above(0.3) < 0.11 and weight_above(5.0) == weight_above(1.0) < 0.6
    assert averaged(fine, error, np.nan) == (fine, error)
