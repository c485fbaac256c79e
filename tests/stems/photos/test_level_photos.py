"""Photos taken among the stems, the horizon in view: no ground behind the stems, cameras between them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from clear_fit import clear_photo_fit, with_changes
from rendered_stems import Stem, oblique_views, render

from treedgs_geo.reconstruction.area import Area, area_seen
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.stems.photos.evidence.opacity_test import seen_behind, without_seen_through
from treedgs_geo.stems.photos.evidence.surface import surface_likeness
from treedgs_geo.stems.photos.images.axis_patches import StemAxis
from treedgs_geo.stems.photos.images.background import make_backdrop
from treedgs_geo.stems.photos.images.crops import GroundGrid, load_stack
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import search_photos
from treedgs_geo.stems.quality.limits import judge

STEMS = [Stem(-1.4, 0.6, 0.15), Stem(1.2, -1.0, 0.11, 0.02, 0.01), Stem(0.3, 1.7, 0.19)]
AREA = Area.circle(0, 0, 2.5)
OPTIONS = PhotoStemOptions(margin_m=0.2, max_dbh_cm=60)


def flat(x, y):
    return np.zeros_like(np.asarray(x, float))


def walked(folder, sky: float) -> list[View]:
    """A ring of photos at eye level, and some from its middle outwards."""
    folder.mkdir(exist_ok=True)
    ring = oblique_views(folder, 24, 1.6, 7.0, 640, 480, 520.0)
    inner = oblique_views(folder, 6, 1.6, 0.2, 640, 480, 520.0)
    inner = [
        replace(view, name=f"inner_{view.name}", path=folder / f"inner_{view.name}", flight=view.flight)
        for view in inner
    ]
    render([*ring, *inner], STEMS, sky=sky)
    return [*ring, *inner]


@pytest.fixture(scope="module")
def views(tmp_path_factory):
    return walked(tmp_path_factory.mktemp("walked"), 0.8)


@pytest.fixture(scope="module")
def fits(views):
    return search_photos(views, flat, AREA, OPTIONS).fits


def nearest(fits, stem):
    return min(fits, key=lambda fit: np.hypot(fit.axis.p[0] - stem.x, fit.axis.p[1] - stem.y))


def test_stems_are_measured_before_the_horizon_and_nothing_else(fits):
    assert sum(fit.measured for fit in fits) == len(STEMS)
    for stem in STEMS:
        fit = nearest(fits, stem)
        assert fit.flag == "ok" and abs(fit.dbh_cm - 200 * stem.r) < 0.6
        assert np.hypot(fit.axis.p[0] - stem.x, fit.axis.p[1] - stem.y) < 0.02


def test_level_photos_have_no_ground_behind_the_stems(views):
    grid = GroundGrid.sample(flat, AREA, 4.0)
    stack = load_stack(views, AREA, grid, 96, 2.0)
    assert len(stack) == len(views)
    assert make_backdrop(stack, grid, AREA.bounds(4.0)) is None


def test_overexposed_sky_widens_the_error(fits, tmp_path):
    searched = search_photos(walked(tmp_path / "sky", 3.0), flat, AREA, OPTIONS)
    glaring = searched.fits
    assert not searched.looks[0].network, "no ground is seen behind the stems"
    for stem in STEMS:
        plain, clipped = nearest(fits, stem), nearest(glaring, stem)
        assert clipped.measured and clipped.evidence.error.soft > 2 * plain.evidence.error.soft
        # It makes stems look thinner, by less than twice what is stated.
        assert -2 * clipped.se_cm < clipped.dbh_cm - 200 * stem.r < 0.2


def test_without_a_plot_stems_are_looked_for_about_the_cameras(views):
    area = area_seen(views, 0.0)
    assert area.contains(np.array([[0.0, 0.0]])).all()
    assert not area.contains(np.array([[0.0, 25.0], [25.0, 0.0]])).any()


def test_a_stem_behind_which_photos_show_another_is_none(views):
    names = tuple(view.name for view in views[:9])
    centre = np.array([view.centre for view in views[:9]])
    clear = clear_photo_fit(0.0, 20.0, photos=names, llr=200.0)
    # On the way from the first camera to the clear stem.
    place = 0.5 * (centre[0, :2] + clear.axis.p)
    thick = with_changes(clear, axis=replace(clear.axis, p=place, ground_z=0.0), r0=0.25, llr=90.0, n_views=2)
    clear = replace(clear, axis=replace(clear.axis, ground_z=0.0))
    assert seen_behind(thick, clear, centre)[0] and not seen_behind(clear, thick, centre).any()
    flags = [fit.flag for fit in without_seen_through([thick, clear], views)]
    assert flags == ["check", "ok"]
    doubtful = thick.knowing(kish=4.0)
    assert doubtful.flag == "check" and without_seen_through([doubtful, clear], views)[0].flag == "reject"
    # Photos that do not show the clear stem do not speak against the other.
    blind = with_changes(clear, seen=np.full(9, 0.3))
    assert not seen_behind(thick, blind, centre).any()


def test_bark_is_alike_where_a_stem_is_round_and_not_where_it_is_a_strip_of_wall(fits, tmp_path):
    for stem in STEMS:
        evidence = nearest(fits, stem).evidence
        assert evidence.on_bark > 0.2 and evidence.bark_lead > 0.1
    # A wall: a stem so thick that a strip of it is flat.
    views = oblique_views(tmp_path, 48, 1.6, 9.0, 640, 480, 520.0)
    render(views, [Stem(0.0, 0.0, 3.0)])
    front = [view for view in views if view.centre[0] > 7.0]
    area = Area.circle(3.0, 0.0, 1.0)
    stack = load_stack(front, area, GroundGrid.sample(flat, area, 3.0), 96, 2.0)
    strip = StemAxis(np.array([3.0, 0.0]), np.zeros(2), np.zeros(2), 0.0, 1.3)
    alike, lead = surface_likeness(stack, strip, (0.2, 0.0), (0.9, 1.9), np.ones(len(stack)))
    assert np.isfinite(alike) and lead < 0
    assert "see_through" in judge("photos", {"bark_lead": lead}, 40.0).reasons
    # What no two photos show from near one another is no bark.
    alike, _ = surface_likeness(stack, strip, (0.2, 0.0), (0.9, 1.9), np.zeros(len(stack)))
    assert judge("photos", {"on_bark": alike}, 40.0).flag("photos") == "reject"
