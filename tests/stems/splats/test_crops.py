"""Crops: the ground texture, the foliage split, photos cut and averaged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.stems.splats.bands import averaged_photos
from treedgs_geo.stems.splats.crops import (
    Crop,
    FoliageRule,
    GroundPlane,
    band_outline,
    crop_camera,
    cut_out,
    foliage_rule,
    median_texture,
    near_axis,
)
from treedgs_geo.stems.splats.project import CropCamera

RNG = np.random.default_rng(0)
DOWN = np.diag([1.0, -1.0, -1.0])


def nadir_crops(colour_of, size=80, half_m=1.0, cell_m=0.05) -> tuple[GroundPlane, list[Crop]]:
    """Three crops straight down on a plane, painted by ``colour_of(x, y)``, with a blob in one of them."""
    plane = GroundPlane(0.0, 0.0, 0.0, half_m, cell_m)
    crops = []
    for number, shift in enumerate((-0.3, 0.0, 0.3)):
        view = CropCamera(size, size, 400.0, 400.0, size / 2, size / 2, DOWN, -DOWN @ np.array([shift, 0, 10.0]))
        texels = plane.texels(view)
        xy = texels * plane.cell_m - plane.half_m
        image = colour_of(xy[..., 0], xy[..., 1]).astype(np.float32)
        if number == 1:
            image[30:50, 30:50] = 0.9
        clear = np.ones((size, size), np.float32)
        crops.append(Crop(view, image, clear, texels, clear, 0))
    return plane, crops


def test_the_median_ground_looks_behind_what_stands_in_one_view():
    def paint(x, y):
        return np.stack([0.5 + 0.3 * x, 0.5 + 0.3 * y, 0.4 + 0 * x], -1)

    plane, crops = nadir_crops(paint)
    texture = median_texture(plane, crops)
    rows, columns = np.mgrid[12:28, 12:28]
    points = plane.points(columns.ravel(), rows.ravel())
    np.testing.assert_allclose(texture[rows.ravel(), columns.ravel()], paint(points[:, 0], points[:, 1]), atol=0.02)
    assert np.isfinite(texture).all()


def test_a_ground_of_many_cells():
    # More cells than OpenCV's maps may be long (32767): large crops on a slope had stopped the whole route.
    plane, crops = nadir_crops(lambda x, y: np.stack([0.5 + 0.1 * x, 0.5 + 0.1 * y, 0.4 + 0 * x], -1), 280, 4.0, 0.025)
    texture = median_texture(plane, crops)
    rows, columns = (part.ravel() for part in np.mgrid[60:260:7, 60:260:7])
    points = plane.points(columns, rows)
    np.testing.assert_allclose(texture[rows, columns, 0], 0.5 + 0.1 * points[:, 0], atol=0.01)
    assert sum(np.unique(np.floor(crop.texels).reshape(-1, 2), axis=0).shape[0] for crop in crops[:1]) > 32767


def test_the_ground_learns_nothing_where_the_stem_may_stand():
    plane, crops = nadir_crops(lambda x, y: np.stack([0.5 + 0 * x] * 3, -1))
    for crop in crops:  # a stem that every view shows at the same place on the ground
        crop.image[:] = 0.5
        crop.image[35:45, 35:45] = 0.1
        crop.ground[35:45, 35:45] = 0
    np.testing.assert_allclose(median_texture(plane, crops)[15:25, 15:25], 0.5, atol=1e-6)


def test_rays_near_an_axis():
    near = CropCamera(200, 200, 400.0, 400.0, 100.0, -50.0, DOWN, -DOWN @ np.array([0.0, 3.0, 10.0]))
    shadow = near_axis(near, 0.2, 0.0, 2.0)
    on, _ = near.project(np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 1.0], [0.0, 0.0, 1.9]]))
    off, _ = near.project(np.array([[0.5, 0.0, 0.1], [0.0, 0.0, 3.0], [0.0, 0.6, 0.0]]))
    assert all(shadow[int(v), int(u)] for u, v in on)
    assert not any(shadow[int(v), int(u)] for u, v in off)


def test_texels_of_a_sloping_plane():
    plane = GroundPlane.around(lambda x, y: 100 + 0.1 * x - 0.2 * y, np.array([5.0, 6.0, 99.3]), 2.0, 0.1)
    assert (plane.a, plane.b, plane.c) == pytest.approx((0.1, -0.2, 0.0))
    view = CropCamera(30, 30, 300.0, 300.0, 15.0, 15.0, DOWN, -DOWN @ np.array([0.2, -0.1, 20.0]))
    texels = plane.texels(view)
    pixels, _ = view.project(plane.points(texels[..., 0].ravel() - 0.5, texels[..., 1].ravel() - 0.5))
    expected = np.stack(np.meshgrid(np.arange(30) + 0.5, np.arange(30) + 0.5), -1).reshape(-1, 2)
    np.testing.assert_allclose(pixels, expected, atol=1e-3)
    flat = GroundPlane.around(lambda x, y: np.full_like(x, np.nan), np.zeros(3), 2.0, 0.1)
    assert (flat.a, flat.b, flat.c) == (0, 0, 0)


def test_cut_out_takes_the_lens_distortion_out():
    """A photo painted with its own undistorted coordinates: the crop shows those of its pinhole camera."""
    camera = Camera(200, 160, 300, 300, 99, 81, k1=-0.1)
    u, v = np.meshgrid(np.arange(200) + 0.5, np.arange(160) + 0.5)
    x, y = camera.undistort(u, v)
    painted = np.clip(np.stack([128 + 300 * x, 128 + 300 * y, 0 * x], -1), 0, 255).astype(np.uint8)
    view = View("a", Path("a"), camera, DOWN, -DOWN @ np.array([0, 0, 50.0]))
    crop = crop_camera(view, np.array([8.0, 5.0, 0]), band_outline(3.0, 0.0, 1.0))
    image, inside = cut_out(painted, view, crop)
    rays = crop.pixel_rays()
    assert inside.all()
    assert np.abs(image[..., 0] - (128 + 300 * rays[..., 0] / rays[..., 2])).max() < 2
    assert np.abs(image[..., 1] - (128 + 300 * rays[..., 1] / rays[..., 2])).max() < 2
    assert crop_camera(view, np.array([80.0, 0, 0]), band_outline(3.0, 0.0, 1.0)) is None
    assert crop_camera(view, np.array([0, 0, 49.9]), band_outline(3.0, 0.0, 1.0)) is None


def test_the_foliage_split_is_learned_or_not_made():
    noise = RNG.normal(0, 4, (4000, 3))
    bark, leaves = np.clip([120, 110, 90] + noise, 0, 255), np.clip([90, 130, 60] + noise, 0, 255)
    rule = foliage_rule(np.concatenate([bark, leaves]).astype(np.uint8))
    assert isinstance(rule, FoliageRule)
    assert rule.weight(np.full((5, 5, 3), [120, 110, 90], np.uint8)).min() == 1
    assert rule.weight(np.full((5, 5, 3), [90, 130, 60], np.uint8)).max() < 0.6
    assert foliage_rule(bark.astype(np.uint8)) is None
    assert foliage_rule(np.zeros((1000, 3), np.uint8)) is None
    red = np.clip([170, 70, 60] + noise, 0, 255)
    assert foliage_rule(np.concatenate([bark, red]).astype(np.uint8)) is None


def test_photos_finer_than_a_stem_needs_are_read_as_coarser_ones():
    fine, coarse = Camera(1000, 700, 9000.0, 9000.0, 500.0, 350.0), Camera(320, 240, 3000.0, 3000.0, 160.0, 120.0)
    views = [
        View(name, Path(name), camera, DOWN, DOWN @ [0, 0, -30.0])
        for name, camera in (("fine", fine), ("coarse", coarse))
    ]
    picture = RNG.integers(0, 255, (700, 1000, 3)).astype(np.uint8)
    # 30 m away a pixel is 3.3 mm in one and 1 cm in the other.
    averaged, read = averaged_photos(views, [np.zeros(3)], lambda view: picture if view is views[0] else picture[:9])
    assert averaged[1] is views[1] and read(averaged[1]).shape == (9, 1000, 3)
    assert (averaged[0].camera.width, averaged[0].camera.fx) == (500, 4500.0)
    assert read(averaged[0]).shape == (350, 500, 3)
    point = np.array([[0.2, -0.1, 0.5]])
    assert averaged[0].project(point)[0] == pytest.approx(views[0].project(point)[0] / 2)
    assert averaged_photos(views, [], None)[0][0] is views[0]
