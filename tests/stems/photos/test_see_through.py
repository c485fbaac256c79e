"""A place where other stems line up: their edges make a stem there, and other photos show the ground through it."""

from __future__ import annotations

import numpy as np
import pytest
from clear_fit import CLEAR
from rendered_stems import Stem, oblique_views, render

from treedgs_geo.reconstruction.area import Area
from treedgs_geo.stems.photos.evidence.opacity_test import ground_correlation, showing_ground
from treedgs_geo.stems.photos.images.axis_patches import StemAxis
from treedgs_geo.stems.photos.images.background import make_backdrop
from treedgs_geo.stems.photos.images.crops import GroundGrid, load_stack
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.quality_control import Evidence, quality_control
from treedgs_geo.stems.photos.route import search_photos
from treedgs_geo.stems.photos.targeted_fit import GivenStems
from treedgs_geo.stems.photos.tuned import SEEN_CORRELATION

PHOTOS = 18
#: Photos that have a stem before the middle of the plot, where none stands; 1.6 m before it, as thick as the others.
BLOCKED = (0, 4, 7, 11, 14)
RADIUS_M = 0.15


def flat(x, y):
    return np.zeros_like(np.asarray(x, float))


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """Photos, and the stems that line up before the middle."""
    views = oblique_views(tmp_path_factory.mktemp("lined_up"), PHOTOS)
    turn = 2 * np.pi * (np.array(BLOCKED) + 0.3) / PHOTOS
    stems = [Stem(1.6 * np.cos(a), 1.6 * np.sin(a), RADIUS_M) for a in turn]
    render(views, stems)
    return views, stems


def correlation_at(views, x, y, radius_m=RADIUS_M):
    area = Area.circle(0, 0, 2.5)
    grid = GroundGrid.sample(flat, area, 4.0)
    stack = load_stack(views, area, grid, 96, 2.0)
    backdrop = make_backdrop(stack, grid, area.bounds(4.0))
    axis = StemAxis(np.array([x, y]), np.zeros(2), np.zeros(2), 0.0, 1.37)
    return ground_correlation(stack, grid, backdrop, axis, (radius_m, -0.005), (0.6, 3.5))


def test_a_stem_that_stands_hides_the_ground_from_every_photo(scene):
    views, stems = scene
    for stem in stems:
        found = correlation_at(views, stem.x, stem.y)
        assert np.isfinite(found).all() and found.max() < 0.6 < SEEN_CORRELATION
        assert showing_ground(found) == 0


def test_where_none_stands_the_other_photos_show_the_ground(scene):
    found = correlation_at(scene[0], 0.0, 0.0)
    clear = np.ones(PHOTOS, bool)
    clear[list(BLOCKED)] = False
    assert (found[clear] > SEEN_CORRELATION).sum() >= 8 and found[~clear].max() < SEEN_CORRELATION
    assert showing_ground(found) > len(BLOCKED)


def test_a_photo_that_does_not_hold_the_place_says_nothing(scene):
    far = correlation_at(scene[0], 40.0, 0.0)
    assert np.isnan(far).all() and showing_ground(far) == 0


def test_stems_that_line_up_make_no_stem(scene):
    # Without the check this is a stem of 29 cm, flagged, at 0.85 cm stated. The search does not propose it; asked for:
    options = PhotoStemOptions(margin_m=0.2, max_dbh_cm=60, stem_network="off")
    given = GivenStems(np.zeros((1, 2)), 0.3)
    fits = search_photos(scene[0], flat, Area.circle(0, 0, 0.8), options, given=given).fits
    middle = min(fits, key=lambda fit: np.hypot(*fit.axis.p))
    assert np.hypot(*middle.axis.p) < 0.1 and "see_through" in middle.reasons
    assert not any(fit.measured for fit in fits)


@pytest.mark.parametrize(("through", "flag"), [(0, "ok"), (4, "ok"), (5, "check"), (9, "reject")])
def test_how_many_photos_show_the_ground_decides(through, flag):
    found, reasons, _ = quality_control(Evidence(**CLEAR, n_through=through))
    assert found == flag and ("see_through" in reasons) == (flag != "ok")
    # Flagged for another reason, too, it is none.
    assert quality_control(Evidence(**CLEAR | {"kish": 4}, n_through=through))[0] == {"ok": "check"}.get(flag, "reject")
