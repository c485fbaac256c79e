"""Photos finer than needed are averaged, and nothing shifts by it."""

from __future__ import annotations

import numpy as np
import pytest
from rendered_stems import Stem, oblique_views, render

from treedgs_geo.reconstruction.area import Area
from treedgs_geo.reconstruction.cameras import Camera
from treedgs_geo.reconstruction.images import shrink, shrink_factor, shrunk_camera
from treedgs_geo.stems.photos.images.crops import GroundGrid, load_stack
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import search_photos


def flat(x, y):
    return np.zeros_like(np.asarray(x, float))


def test_how_much_a_photo_is_reduced():
    fine = Camera(8192, 5460, 8000.0, 8000.0, 4096.0, 2730.0)
    assert [shrink_factor(fine, depth) for depth in (90.0, 40.0, 31.0, 20.0)] == [1, 1, 2, 3]


@pytest.mark.parametrize("k", [2, 3])
def test_a_mark_stays_where_it_is_and_light_is_kept(k):
    # A bright blob on a dark photo: its centre of light, in the pixels of the full photo, must not move.
    y, x = np.mgrid[0:60, 0:66] + 0.5
    blob = 0.05 + 0.9 * np.exp(-((x - 31.3) ** 2 + (y - 26.8) ** 2) / 50.0)
    image = np.repeat(np.rint(255 * blob ** (1 / 2.2)).astype(np.uint8)[..., None], 3, axis=2)
    small = shrink(image, k)
    camera = shrunk_camera(Camera(66, 60, 100.0, 100.0, 33.0, 30.0), k)
    assert small.shape == (camera.height, camera.width, 3) and small.flags.c_contiguous

    def centre(picture, scale):
        light = (picture[..., 0] / 255.0) ** 2.2 - 0.05
        v, u = np.mgrid[0 : light.shape[0], 0 : light.shape[1]] + 0.5
        return np.array([(u * light).sum(), (v * light).sum()]) / light.sum() * scale, light.mean()

    before, mean = centre(image, 1)
    after, small_mean = centre(small, k)
    assert np.abs(after - before).max() < 0.02  # half a small pixel would be 1.0 or more
    assert small_mean == pytest.approx(mean, rel=0.01)


def test_reduced_photos_take_a_quarter_of_the_memory_and_give_the_diameter(tmp_path):
    stem = Stem(0.2, 0.1, 0.15)
    views = oblique_views(tmp_path, 12, height=30.0, distance=20.0, width=460, rows=520, focal=2600.0)
    render(views, [stem])
    area = Area.circle(0.0, 0.0, 0.5)
    grid = GroundGrid.sample(flat, area, 3.0)
    full = load_stack(views, area, grid, 96, 0.8).pixels.size
    assert load_stack(views, area, grid, 96, 0.8, finest_m=0.028).pixels.size < 0.3 * full
    fits = search_photos(views, flat, area, PhotoStemOptions(margin_m=0.2, finest_gsd_m=0.028)).fits
    nearest = min(fits, key=lambda f: np.hypot(f.axis.p[0] - stem.x, f.axis.p[1] - stem.y))
    assert nearest.dbh_cm == pytest.approx(200 * stem.r, abs=0.8)
