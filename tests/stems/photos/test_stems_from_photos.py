"""Stems found and fitted straight in painted photos; rules of the verdict; shapes and refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pyproj
import pytest
from listener import Listener
from rendered_stems import Stem, oblique_views, render

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.files import read_json, write_json
from treedgs_geo.reconstruction.area import Area, _cover, area_seen
from treedgs_geo.stems.photos.evidence.error_budget import azimuth_spread
from treedgs_geo.stems.photos.fit.search import terminators
from treedgs_geo.stems.photos.fit_records import KeptFits, read_fits, write_fits
from treedgs_geo.stems.photos.images.axis_patches import StemAxis, StripLayout, cut_strips
from treedgs_geo.stems.photos.images.crops import GroundGrid, choose_views, load_stack
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.propose.edge_voting import N_BINS, lean_grid, rank_lut
from treedgs_geo.stems.photos.route import search_photos
from treedgs_geo.stems.photos.tiles import split
from treedgs_geo.stems.photos.trees import trees_of_photo_fits

STEMS = [Stem(0.6, 0.4, 0.15), Stem(-1.5, 0.9, 0.11, lx=0.03), Stem(1.2, -1.6, 0.19, ly=-0.14), Stem(-0.9, -1.3, 0.13)]
FRAME = LocalFrame(pyproj.CRS.from_epsg(32615), np.array([500000.0, 3700000.0, 40.0]))


def flat(x, y):
    return np.zeros_like(np.asarray(x, float))


@pytest.fixture(scope="module")
def views(tmp_path_factory):
    folder = tmp_path_factory.mktemp("photos")
    made = oblique_views(folder, 14)
    render(made, STEMS)
    return made


@pytest.fixture(scope="module")
def fits(views):
    return search_photos(views, flat, Area.circle(0, 0, 3.0), PhotoStemOptions(margin_m=0.3)).fits


def nearest(fits, stem):
    return min(fits, key=lambda fit: np.hypot(fit.axis.p[0] - stem.x, fit.axis.p[1] - stem.y))


def test_every_stem_is_found_and_measured(fits):
    for stem in STEMS:
        fit = nearest(fits, stem)
        assert np.hypot(fit.axis.p[0] - stem.x, fit.axis.p[1] - stem.y) < 0.03
        assert fit.measured
        assert abs(fit.dbh_cm - 200 * stem.r) < 0.8
        assert abs(fit.lean_deg - np.degrees(np.arctan(np.hypot(stem.lx, stem.ly)))) < 0.8


def test_nothing_else_is_measured(fits):
    for fit in fits:
        distance = min(np.hypot(fit.axis.p[0] - stem.x, fit.axis.p[1] - stem.y) for stem in STEMS)
        assert not fit.measured or distance < 0.1


def test_same_inputs_give_the_same_stems(views, fits):
    again = search_photos(views, flat, Area.circle(0, 0, 3.0), PhotoStemOptions(margin_m=0.3)).fits
    assert [round(fit.dbh_cm, 6) for fit in again] == [round(fit.dbh_cm, 6) for fit in fits]


def test_fits_are_kept_as_they_are(fits, views, tmp_path):
    """A later stage, or a later run, goes on from them."""
    write_fits(tmp_path / "fits.json", KeptFits(fits))
    record = read_json(tmp_path / "fits.json")
    for fit in record["fits"]:
        fit["soft_cm"] = 0.1  # earlier versions kept more
    write_json(tmp_path / "fits.json", record | {"second_cm": {"1": 27.25}})
    kept = read_fits(tmp_path / "fits.json").fits
    assert len(kept) == len(fits)
    for fit, again in zip(fits, kept, strict=True):
        assert set(again.photos) <= {view.name for view in views} and len(again.photos) == len(again.seen)
        assert np.allclose(fit.row, again.row, rtol=0, atol=0) and np.allclose(fit.seen, again.seen, atol=1e-4)
        # NaN is not equal to itself: as text.
        assert (str(fit.evidence), str(fit.assessment)) == (str(again.evidence), str(again.assessment))
        assert (fit.photos, fit.foot_z) == (again.photos, again.foot_z)
    (tmp_path / "fits.json").write_text('{"fits": [{"axis": 3}]}')
    with pytest.raises(InputError, match="no fitted stems of this version"):
        read_fits(tmp_path / "fits.json")


def test_trees_in_project_coordinates(fits):
    trees = trees_of_photo_fits(fits, FRAME, plot_id="p", first_id=5)
    assert [tree.tree_id for tree in trees] == list(range(5, 5 + len(fits)))
    for tree, fit in zip(trees, fits, strict=True):
        assert tree.method == "photos" and tree.plot_id == "p"
        assert tree.x == pytest.approx(500000 + fit.axis.p[0]) and tree.z_ground == pytest.approx(40, abs=0.01)
        if fit.flag == "reject":
            assert tree.dbh_cm is None and tree.qc_reason
        else:
            assert tree.dbh_lo_cm < tree.dbh_cm < tree.dbh_hi_cm


def test_too_few_photos_warn_and_give_nothing(views):
    listener = Listener()
    assert search_photos(views[:2], flat, Area.circle(0, 0, 3.0), PhotoStemOptions(), listener).fits == []
    assert "2 oblique photos" in listener.warnings[0]


def test_ground_must_cover_the_plot(views):
    with pytest.raises(InputError, match="no height in the plot"):
        search_photos(views, lambda x, y: np.full(np.shape(x), np.nan), Area.circle(0, 0, 3.0))


def test_a_photo_of_another_size_is_refused(views):
    wrong = [replace(view, camera=replace(view.camera, width=600)) for view in views]
    ground = GroundGrid.sample(flat, Area.circle(0, 0, 3.0), 2.0)
    with pytest.raises(InputError, match="expected 600 x 400"):
        load_stack(wrong, Area.circle(0, 0, 3.0), ground, 96, 1.0)


def test_an_unreadable_photo_is_left_out(views, tmp_path):
    broken = tmp_path / "broken.png"
    broken.write_bytes(b"no image")
    listener = Listener()
    ground = GroundGrid.sample(flat, Area.circle(0, 0, 3.0), 2.0)
    stack = load_stack([replace(views[0], path=broken), *views[1:5]], Area.circle(0, 0, 3.0), ground, 96, 1.0, listener)
    assert len(stack) == 4 and "broken.png" in listener.warnings[0]


def test_thinning_keeps_all_directions(views):
    chosen = choose_views(views * 5, Area.circle(0, 0, 3.0), 0.0, 14)
    azimuths = {round(float(np.arctan2(*(views * 5)[k].centre[:2])), 3) for k in chosen}
    assert len(chosen) == 14 and len(azimuths) == 14


def test_edges_stand_where_the_stem_ends(views):
    ground = GroundGrid.sample(flat, Area.circle(0, 0, 3.0), 2.0)
    stack = load_stack(views, Area.circle(0, 0, 3.0), ground, 96, 1.0)
    stem = STEMS[0]
    axis = StemAxis(np.array([stem.x, stem.y]), np.zeros(2), np.zeros(2), 0.0, 1.37)
    strips = cut_strips(stack, axis, StripLayout(1.2, 1.6, 0.2, 0.04, 0.3, 0.01, sigma_px=1.0, linear=True))
    power = np.linalg.norm(strips.gradient, axis=-1).mean(axis=(0, 1))
    left, right = power[:31].argmax(), 30 + power[30:].argmax()
    assert strips.u[right] == pytest.approx(stem.r, abs=0.015) and strips.u[left] == pytest.approx(-stem.r, abs=0.015)


def test_rank_calibration_ignores_contrast():
    counts = np.zeros((1, 1, N_BINS), np.int64)
    counts[..., :100] = 50
    stretched = np.zeros_like(counts)
    stretched[..., 100:300:2] = 50
    one, other = rank_lut(counts)[0, 0], rank_lut(stretched)[0, 0]
    assert np.allclose(one[:100], other[100:300:2]) and np.all(np.diff(one[:100]) >= 0)


def test_lean_grid_is_upright_first_and_bounded():
    leans = lean_grid(10)
    assert np.allclose(leans[0], 0) and np.hypot(*leans.T).max() <= np.tan(np.radians(10)) + 1e-6


def test_border_of_light_and_shade():
    # Camera west of the stem looking east, sun in the south: the lit half is on the right (south), the border central.
    normal = np.array([[0.0, 1.0]])
    assert terminators(normal, np.array([-np.pi / 2]))[0] == pytest.approx(0.0, abs=1e-9)
    assert terminators(normal, np.array([np.nan]))[0] == 2.0


def test_azimuth_spread():
    assert azimuth_spread(np.radians([0, 90, 180, 270])) == pytest.approx(270)
    assert azimuth_spread(np.radians([10.0])) == 0


def test_areas():
    area = Area.circles(np.array([[0, 0], [10, 0]]), np.array([2, 3]))
    assert area.contains(np.array([[1.9, 0], [2.5, 0], [12.9, 0]])).tolist() == [True, False, True]
    assert area.bounds(1) == (-3, -4, 14, 4)
    pieces = split(Area.circle(0, 0, 40), 1.0)
    assert len(pieces) > 4 and all(box[2] - box[0] <= 26 for _, box in pieces)


def test_overlapping_circles_are_searched_once_and_wholly():
    area = Area.circles(np.array([[0, 0], [9, 0], [70, 5], [0.5, 0.5]]), np.array([30, 28, 9, 5]))
    pieces = split(area, 1.0)
    alone = sum(len(split(Area.circle(*c, r), 1.0)) for c, r in zip(area.centres, area.radii_m, strict=True))
    assert len(pieces) < alone
    ground = np.stack(np.meshgrid(np.arange(-40, 90, 0.25), np.arange(-40, 45, 0.25)), -1).reshape(-1, 2)
    ground = ground[area.contains(ground, 0.5)]
    boxes = np.array([box for _, box in pieces])
    inside = [((ground >= box[:2] - 0.3) & (ground <= box[2:] + 0.3)).all(axis=1) for box in boxes]
    assert np.any(inside, axis=0).all()


@pytest.mark.parametrize("shape", [(24, 3000), (300, 300)])
def test_all_ground_seen_is_searched(shape):
    """A corridor of 3 km lost a fifth of its ground to a limit on the number of circles."""
    seen = np.ones(shape, bool)
    area = _cover(seen, np.arange(shape[1]) * 1.0, np.arange(shape[0]) * 1.0)
    ground = np.argwhere(seen[4:-4, 4:-4])[::7, ::-1] + 4.0  # its rim is not
    covered = np.zeros(len(ground), bool)
    for centre, radius in zip(area.centres, area.radii_m, strict=True):
        covered |= np.hypot(*(ground - centre).T) <= radius
    assert covered.mean() > 0.995


def test_area_without_plot(views):
    area = area_seen(views, 0.0, n_views=8)
    assert area.contains(np.array([[0.0, 0.0]]))[0] and not area.contains(np.array([[60.0, 0.0]]))[0]
    assert len(area_seen(views, 0.0, n_views=50).radii_m) == 0
