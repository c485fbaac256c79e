"""A stem looked at again in painted photos: edges that count, photos to show, pictures the right way round."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from clear_fit import clear_photo_fit, error_of, with_changes
from rendered_stems import Stem, oblique_views, render

from treedgs_geo.core.progress import Reporter
from treedgs_geo.inventory.evidence.canvas import MAX_BYTES
from treedgs_geo.inventory.evidence.photo_sheet import PhotoEvidence, compass, photo_sheet
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.stems.photos.fit.edge_adjustment import NO_STEMS
from treedgs_geo.stems.photos.fit.photo_fit import PhotoFit
from treedgs_geo.stems.photos.images.axis_patches import StemAxis
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.search_steps import photos_of
from treedgs_geo.stems.photos.stem_images import DrawnStem, choose_photos, look_at, straightened
from treedgs_geo.stems.quality.tree import Tree

STEM = Stem(0.6, 0.4, 0.15)
OPTIONS = PhotoStemOptions(margin_m=0.3)


def fitted(radius_m: float, photos: tuple[str, ...], **change) -> PhotoFit:
    axis = StemAxis(np.array([STEM.x, STEM.y]), np.zeros(2), np.zeros(2), 0.0, 1.37)
    fit = clear_photo_fit(
        0.0, 200 * radius_m, axis=axis, r1=-0.005, error=error_of(0.4), n_views=len(photos), arc_deg=300.0
    )
    return with_changes(fit, **{"seen": np.ones(len(photos)), "photos": photos} | change)


@pytest.fixture(scope="module")
def stack(tmp_path_factory):
    views = oblique_views(tmp_path_factory.mktemp("photos"), 12)
    render(views, [STEM, Stem(-1.5, 0.9, 0.11)])
    flat = lambda x, y: np.zeros_like(np.asarray(x, float))  # noqa: E731
    return photos_of(views, flat, Area.circle(0, 0, 3.0), OPTIONS, Reporter())[1]


@pytest.fixture(scope="module")
def shown(stack):
    fit = fitted(STEM.r, tuple(view.name for view in stack.views))
    return look_at(stack, fit, DrawnStem(fit.axis, fit.r0, fit.r1), NO_STEMS, OPTIONS)


def test_photos_one_by_one_read_the_stem(shown):
    assert shown.sees.all() and np.isfinite(shown.reading_cm).sum() >= 10
    assert abs(np.nanmedian(shown.reading_cm) - 200 * STEM.r) < 0.8
    worst = np.abs(shown.reading_cm - 200 * STEM.r)
    assert shown.worst == int(np.nanargmax(worst))


def test_diameters_along_the_stem_taper(shown):
    table = shown.diameters()
    assert len(table) > 15 and table[:, 0].min() > 0.5 and table[:, 0].max() < 3.6
    expected = 200 * (STEM.r + STEM.taper * (table[:, 0] - 1.37))
    assert np.median(np.abs(table[:, 1] - expected)) < 0.6
    assert (table[:, 2] <= table[:, 1]).all() and (table[:, 1] <= table[:, 3]).all()


def test_a_wrong_outline_shows_as_one(stack):
    """The outline's radius is 1.5 cm too large: the edges that count are not drawn where they are wanted."""
    fit = fitted(STEM.r + 0.015, tuple(view.name for view in stack.views))
    wrong = look_at(stack, fit, DrawnStem(fit.axis, fit.r0, fit.r1), NO_STEMS, OPTIONS)
    assert np.nanmedian(wrong.reading_cm) < 200 * fit.r0 - 1.5


def test_an_oval_is_drawn_as_wide_as_each_side_shows_it(stack, shown):
    """What each photo reads is what it shows, whatever oval is drawn; how far it is off is counted from the oval."""
    fit = fitted(STEM.r, tuple(view.name for view in stack.views), oval=(0.006, -0.008))
    drawn = DrawnStem(fit.axis, fit.r0, fit.r1, fit.oval)
    oval = look_at(stack, fit, drawn, NO_STEMS, OPTIONS)
    both = np.isfinite(oval.reading_cm) & np.isfinite(shown.reading_cm)
    assert both.sum() >= 8 and np.abs(oval.reading_cm - shown.reading_cm)[both].max() < 0.5
    beside_cm = 200 * drawn.beside(oval.edges.normal)
    assert np.ptp(beside_cm) > 3.0
    off_cm = 200 * oval.edges.radius_m
    assert np.abs(off_cm + beside_cm)[both].mean() < 0.5 < np.abs(off_cm)[both].mean()


def test_a_section_is_as_wide_as_its_oval_and_as_long_round_as_its_radius():
    drawn = DrawnStem(StemAxis(np.zeros(2), np.zeros(2), np.zeros(2), 0.0, 1.37), 0.15, -0.005, (0.006, -0.008))
    outline = drawn.section()
    assert np.linalg.norm(np.diff(outline, axis=0), axis=1).sum() == pytest.approx(2 * np.pi * 0.15, rel=2e-3)
    for turn in np.radians([0, 30, 75, 120]):
        across = np.array([np.cos(turn), np.sin(turn)])
        wide = 0.15 + drawn.beside(across)[0]
        assert np.ptp(outline @ across) == pytest.approx(2 * wide, abs=5e-4)
    assert np.hypot(*DrawnStem(drawn.axis, 0.15, -0.005).section().T) == pytest.approx(0.15)


def test_photos_are_known_by_name(stack):
    """Photos in another order, and some that were not looked at, are told apart by their names."""
    names = tuple(view.name for view in stack.views)
    fit = fitted(STEM.r, (names[3], names[0]), seen=np.array([0.9, 0.2]))
    again = look_at(stack, fit, DrawnStem(fit.axis, fit.r0, fit.r1), NO_STEMS, OPTIONS)
    assert again.seen[3] == 0.9 and again.seen[0] == 0.2 and again.sees.sum() == 1
    assert choose_photos(again, np.ones(len(stack), bool), 4)[:1] != [] and 3 in choose_photos(again, again.sees, 4)


def test_photos_to_look_at_come_from_all_sides(shown):
    chosen = choose_photos(shown, np.ones(len(shown.seen), bool), 6)
    assert len(set(chosen)) == 6 and shown.worst in chosen
    azimuths = np.sort(shown.azimuth[chosen])
    gaps = np.diff(np.append(azimuths, azimuths[0] + 2 * np.pi))
    assert np.degrees(gaps.max()) < 130
    clockwise = (np.pi / 2 - shown.azimuth[chosen]) % (2 * np.pi)
    assert (np.diff(clockwise) > 0).all()
    every = np.ones(len(shown.seen), bool)
    assert sorted(choose_photos(shown, every, 99)) == np.flatnonzero(every).tolist(), "each once, the worst one too"
    only = np.arange(len(shown.seen)) == 4
    assert choose_photos(shown, only, 6) == [4]


def test_pictures_are_not_mirrored_and_to_scale(stack, shown):
    """A place to the right in the photo is to the right in the picture; the stem is as wide as it is."""
    for v in (0, 5):
        picture = straightened(stack, v, shown, 0.0, 3.6, 0.5, 0.01)
        assert picture.shape == (360, 100, 3)
        axis, normal = shown.shape.axis, shown.edges.normal[v]
        left, right = (axis.at(np.array([1.37])) + sign * 0.4 * np.array([*normal, 0]) for sign in (1, -1))
        pixels = stack.views[v].project(np.vstack([left, right]))[0]
        assert pixels[1, 0] > pixels[0, 0]
        image = cv2.imread(str(stack.views[v].path))
        for column, (u, w) in ((10, pixels[0]), (90, pixels[1])):
            row = round((3.6 - 1.37) / 0.01)
            there = image[int(w) - 1 : int(w) + 2, int(u) - 1 : int(u) + 2, 1].mean()
            assert abs(float(picture[row - 2 : row + 3, column - 2 : column + 3, 1].mean()) - there) < 25
    clear = straightened(stack, 0, shown, 0.0, 3.6, 0.5, 0.01)  # no other stem stands behind it
    rows = clear[150:300, :, 1].mean(axis=0)
    light = rows > 0.5 * (rows[45:55].mean() + np.median(rows[[*range(20), *range(80, 100)]]))
    width = np.flatnonzero(light[50:])[0] + np.flatnonzero(light[49::-1])[0]
    assert abs(width - 30) <= 5, "bark is darker than the ground: 30 cm of it"


def test_a_photo_that_ends_before_the_stem_gives_no_picture(stack, shown):
    far = replace(shown, shape=DrawnStem(replace(shown.shape.axis, p=np.array([60.0, 0.0])), 0.15, -0.005))
    assert straightened(stack, 0, far, 0.0, 3.6, 0.5, 0.01) is None


HOSTILE = "A<b onmouseover='x'>\n\r\t\x00\u202e" + "0123456789" * 20


@pytest.mark.parametrize("flag", ["ok", "check", "reject"])
def test_a_sheet_is_small_and_takes_any_text(stack, shown, flag):
    names = tuple(view.name for view in stack.views)
    reasons = {"ok": "", "check": "ambiguous,wide_error", "reject": "few_views,occluded,ambiguous,lean,edge"}[flag]
    dbh = None if flag == "reject" else 30.0
    tree = Tree(
        7, 5e5, 5.2e6, plot_id=HOSTILE, dbh_cm=dbh, dbh_se_cm=dbh and 0.4, method="photos", qc_flag=flag,
        qc_reason=reasons, n_views=12, arc_deg=300.0, taper_cm_m=-1.0, lean_deg=0.0,
    ).finish()  # fmt: skip
    sheet = photo_sheet(PhotoEvidence(tree, fitted(STEM.r, names), shown, stack))
    oval = replace(shown, shape=replace(shown.shape, oval=(0.003, 0.004)))
    assert len(photo_sheet(PhotoEvidence(tree, fitted(STEM.r, names), oval, stack)).jpeg()) <= MAX_BYTES
    data = sheet.jpeg()
    assert len(data) <= MAX_BYTES
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape[1] == 1200 and 700 < picture.shape[0] < 1400


def test_a_stem_that_no_photo_sees_has_a_sheet_too(stack):
    names = tuple(view.name for view in stack.views)
    fit = fitted(STEM.r, names, seen=np.zeros(len(names)), error=None, rms_px=np.nan, flag="reject")
    blind = look_at(stack, fit, DrawnStem(fit.axis, fit.r0, fit.r1), NO_STEMS, OPTIONS)
    assert blind.worst is None and len(blind.diameters()) == 0
    tree = Tree(1, 5e5, 5.2e6, method="photos", qc_flag="reject", qc_reason="occluded").finish()
    assert len(photo_sheet(PhotoEvidence(tree, fit, blind, stack)).jpeg()) <= MAX_BYTES


def test_directions_have_their_names():
    assert [compass(a) for a in np.radians([0, 90, 180, -90, 44, -180])] == [
        "from E", "from N", "from W", "from S", "from NE", "from W",
    ]  # fmt: skip
