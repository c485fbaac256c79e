"""Soft photos widen every error and are reported; sharp ones are not."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from listener import Listener

from treedgs_geo.core.progress import Reporter
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.stems.photos.fit_records import look_of_record, look_record
from treedgs_geo.stems.photos.images.crops import GroundGrid, load_stack
from treedgs_geo.stems.photos.images.sharpness import edge_sharpness, soft_px
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import search_photos
from treedgs_geo.stems.photos.tile_calibration import Look
from treedgs_geo.stems.photos.tuned import SOFT_PX
from treedgs_lab.benchmarks.plot import TruePlot


@pytest.fixture(scope="module")
def scene(simulated_plot):
    truth = TruePlot.load(simulated_plot)
    ground = truth.dtm.local(truth.frame).height
    stems = truth.trees[truth.trees["in_plot"].astype(str) == "True"]
    area = Area.circle(float(stems["x_bh"].mean()), float(stems["y_bh"].mean()), 3.0)
    return truth.views(), ground, area


def blurred(views: list[View], folder, sigma_px: float) -> list[View]:
    out = []
    for view in views:
        path = folder / view.path.name
        cv2.imwrite(str(path), cv2.GaussianBlur(cv2.imread(str(view.path)), (0, 0), sigma_px))
        out.append(replace(view, path=path))
    return out


def off_px(views: list[View], scene, reporter: Reporter | None = None) -> float:
    _, ground, area = scene
    return soft_px(load_stack(views, area, GroundGrid.sample(ground, area, 4.0), 24, 2.0), reporter)


@pytest.mark.parametrize(("sigma_px", "expected"), [(0.5, 0.50), (1.0, 0.36), (1.5, 0.30)])
def test_the_sharpness_of_an_edge_is_that_of_its_blur(sigma_px, expected):
    # A step that crosses the pixels at an angle; lens and pixels blur it. Its strongest places lie mid in a pixel.
    y, x = np.mgrid[0:640, 0:640].astype(np.float32)
    fine = np.where(x + 0.07 * y > 340, np.float32(200), np.float32(20))
    photo = cv2.GaussianBlur(fine, (0, 0), 10 * sigma_px).reshape(64, 10, 64, 10).mean(axis=(1, 3))
    assert edge_sharpness(photo) == pytest.approx(expected, abs=0.03)


def test_a_photo_that_shows_no_edge_has_no_sharpness():
    assert np.isnan(edge_sharpness(np.full((40, 40), 90.0, np.float32)))
    assert np.isnan(edge_sharpness(np.zeros((3, 3), np.float32)))


def test_photos_as_the_camera_took_them_add_nothing(scene):
    heard = Listener()
    assert off_px(scene[0], scene, heard) == 0.0
    assert not heard.warnings


def test_the_softer_the_photos_the_more_they_add_and_it_is_reported(scene, tmp_path):
    heard = Listener()
    little, much = (off_px(blurred(scene[0], tmp_path, sigma), scene, heard) for sigma in (1.0, 1.5))
    assert 0.15 < little < much <= SOFT_PX[-1]
    assert len(heard.warnings) == 2
    assert "soft" in heard.warnings[1] and f"{much:.1f} pixel" in heard.warnings[1]


def test_no_photos_are_not_soft(scene):
    assert off_px([], scene) == 0.0


@pytest.mark.slow
def test_every_diameter_of_soft_photos_has_a_wider_interval(scene, tmp_path):
    views, ground, area = scene
    heard, options = Listener(), PhotoStemOptions(stem_network="off")
    sharp = search_photos(views, ground, area, options)
    soft = search_photos(blurred(views, tmp_path, 1.2), ground, area, options, heard)
    look = soft.looks[0]
    assert look is not None and look.soft_px > 0.2 and sharp.looks[0].soft_px == 0.0
    pixel_cm = 100 * np.median([np.linalg.norm(v.centre - [*area.centres[0], 0.0]) for v in views]) / views[0].camera.fx
    for fit in soft.fits:
        assert fit.se_cm > 0.7 * look.soft_px * pixel_cm
    assert any("soft" in text for text in heard.warnings)


def test_what_is_kept_of_a_search_keeps_it_and_older_records_have_none():
    look = Look(True, np.array([0.3, np.nan]), 0.15, 0.05, np.inf, np.zeros((2, 2)), 0.31)
    again = look_of_record(look_record(look))
    assert again.soft_px == 0.31 and np.isinf(again.chance) and np.isnan(again.sun[1])
    old = look_record(look)
    del old["soft_px"]
    assert look_of_record(old).soft_px == 0.0
