"""Odd stems in painted photos: strong lean beside close twins, slopes; where breast height is."""

from __future__ import annotations

import numpy as np
import pyproj
import pytest
from rendered_stems import Stem, oblique_views, render

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.stems.photos.fit.breast_height import breast_height, moved
from treedgs_geo.stems.photos.images.axis_patches import StemAxis
from treedgs_geo.stems.photos.images.crops import GroundGrid
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import search_photos
from treedgs_geo.stems.photos.trees import trees_of_photo_fits
from treedgs_geo.stems.photos.tuned import ERROR_WEIGHTS

LEANING = Stem(-0.8, -0.6, 0.13, lx=0.30, ly=0.20)
TWINS = [Stem(1.0, 0.8, 0.09), Stem(1.21, 0.95, 0.085)]


@pytest.fixture(scope="module")
def fits(tmp_path_factory):
    folder = tmp_path_factory.mktemp("odd")
    made = oblique_views(folder, 16)
    render(made, [LEANING, *TWINS], seed=3)
    flat = lambda x, y: np.zeros_like(np.asarray(x, float))  # noqa: E731
    return search_photos(made, flat, Area.circle(0, 0, 2.2), PhotoStemOptions(margin_m=0.3, max_lean_deg=25)).fits


def test_a_stem_leaning_twenty_degrees_is_found_and_measured_across_its_axis(fits):
    slope = np.hypot(LEANING.lx, LEANING.ly)
    # Along the stem, breast height is reached lower: the axis has not gone as far.
    q = 1.37 / np.hypot(1, slope) - 1.37
    place = np.array([LEANING.x + q * LEANING.lx, LEANING.y + q * LEANING.ly])
    fit = min(fits, key=lambda f: np.hypot(*(f.axis.p - place)))
    assert np.hypot(*(fit.axis.p - place)) < 0.04 and fit.measured
    assert fit.lean_deg == pytest.approx(np.degrees(np.arctan(slope)), abs=1.5)
    # The painted cone's radius is horizontal: across the axis it is narrower along the lean.
    assert 200 * LEANING.r / np.hypot(1, slope) - 1.0 < fit.dbh_cm < 200 * LEANING.r + 1.0


def test_nothing_else_is_measured(fits):
    for fit in fits:
        if fit.measured and np.hypot(*(fit.axis.p - [1.1, 0.87])) > 0.2:
            assert np.hypot(*(fit.axis.p - [LEANING.x, LEANING.y])) < 0.2


@pytest.mark.parametrize("lean, dq", [((0.0, 0.0), 0.045), ((0.0, 0.36), -0.036)])
def test_breast_height_on_a_slope(lean, dq):
    """From the uphill side, along the stem: 30 % slope, 15 cm radius."""
    x = 0.25 * np.arange(81) - 10
    grid = GroundGrid(-10, -10, 0.25, (0.3 * x[None, :] * np.ones((81, 1))).astype(np.float32))
    axis = StemAxis(np.array([1.0, 0.0]), np.array(lean), np.zeros(2), 0.3, 1.37)
    found, ground = breast_height(axis, 0.15, grid)
    assert found == pytest.approx(dq, abs=0.003) and ground == pytest.approx(0.345, abs=0.003)
    assert moved(axis, found).p[1] == pytest.approx(found * lean[1], abs=1e-6)


def test_the_layer_has_the_ground_of_the_foot(fits):
    frame = LocalFrame(pyproj.CRS.from_epsg(32615), np.array([5e5, 3.7e6, 40.0]))
    for tree in trees_of_photo_fits(fits, frame):
        assert tree.z_ground == pytest.approx(40.0, abs=0.01)


def test_no_diameter_is_surer_than_one_section_lets_it_be(fits):
    measured = [fit for fit in fits if fit.measured]
    assert measured and all(fit.se_cm > ERROR_WEIGHTS["section"] * fit.dbh_cm for fit in measured)
