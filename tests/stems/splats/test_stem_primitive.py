"""The stem primitive: its geometry against an independent twin, its gradient, and fits of a painted scene."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest
from painted_stem import FRAME, STEM, ground, scene

from treedgs_geo.core.errors import InputError
from treedgs_geo.stems.splats.crops import Crop, GroundPlane, sample_texture
from treedgs_geo.stems.splats.options import GaussianOptions
from treedgs_geo.stems.splats.primitive.fit import fit_primitive
from treedgs_geo.stems.splats.primitive.model import (
    GAMMA,
    Coverage,
    Lens,
    Region,
    StemView,
    axis_xy,
    cover,
    normal_equations,
    radius_m,
)
from treedgs_geo.stems.splats.primitive.views import (
    PrimitiveSettings,
    Sight,
    compare,
    draw,
    empty_coverage,
    ground_seen,
    textures,
)
from treedgs_geo.stems.splats.project import CropCamera
from treedgs_geo.stems.splats.train import bark_gaussians, fit_with_report

BH = 1.37
SHAPE = np.array([0.06, -0.04, 0.04, 0.03, 0.002, -0.001, 0.14, -0.005])


def looking_at(turn: float, tilt: float, far: float, target: np.ndarray, size: int = 220, focal: float = 2200.0):
    centre = target + far * np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
    forward = (target - centre) / far
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    return CropCamera(size, size, focal, focal, size / 2, size / 2, rotation, -rotation @ centre)


def covered(camera: CropCamera, shape: np.ndarray, blur: float, shift: float = 0.0) -> Coverage:
    out = empty_coverage((camera.height, camera.width))
    lens = Lens(np.ascontiguousarray(camera.rotation), camera.centre, camera.intrinsics)
    cover(StemView(shape, BH, shift, blur), lens, Region(0.45, 0.3, 2.9), out)
    return out


def hits(camera: CropCamera, shape: np.ndarray, fine: int = 4) -> np.ndarray:
    """Twin of the silhouette by brute force: share of sub-pixel rays that come inside the radius of the axis anywhere
    between the ground and 4 m."""
    many = camera.scaled(fine)
    rays = many.pixel_rays() @ many.rotation
    heights = np.arange(-0.2, 3.6, 0.008)
    axis = np.column_stack([axis_xy(shape, BH, heights), heights])
    radius = radius_m(shape, BH, heights)
    inside = np.zeros(rays.shape[:2], bool)
    t = axis - many.centre
    for point, r in zip(t, radius, strict=True):  # horizontal discs
        along = point[2] / rays[..., 2]
        away = np.hypot(rays[..., 0] * along - point[0], rays[..., 1] * along - point[1])
        inside |= away < r
    return inside.reshape(camera.height, fine, camera.width, fine).mean(axis=(1, 3))


@pytest.mark.parametrize("turn,tilt", [(0.3, 0.8), (2.0, 1.2), (4.1, 0.5)])
def test_silhouette_is_that_of_the_solid(turn, tilt):
    camera = looking_at(turn, tilt, 60.0, np.array([0, 0, 1.5]), 110, 2200.0)
    got, true = covered(camera, SHAPE, 0.3), hits(camera, SHAPE)
    window = got.window
    assert window.sum() > 500
    wide = [np.where(window, image, 0).sum() for image in (got.alpha, true)]
    # A quarter of a percent of the width is 0.03 px a side: half a pixel's slip would be 8 %.
    assert wide[0] == pytest.approx(wide[1], rel=0.01)
    middle = [
        (np.where(window, image, 0) * np.arange(110)).sum() / value
        for image, value in zip((got.alpha, true), wide, strict=True)
    ]
    assert middle[0] == pytest.approx(middle[1], abs=0.03)


def test_shift_moves_the_stem_by_that_many_pixels():
    camera = looking_at(0.3, 0.9, 60.0, np.array([0, 0, 1.5]))
    straight, moved = (covered(camera, SHAPE, 0.6, shift) for shift in (0.0, 2.0))
    both = straight.window & moved.window
    rows = both.sum(axis=1) > 20
    centre = [(image.alpha[rows] * np.arange(220)).sum() / image.alpha[rows].sum() for image in (straight, moved)]
    assert abs(centre[1] - centre[0]) == pytest.approx(2.0, abs=0.05)


@cache
def _silhouettes(shape: tuple, views: int) -> list[np.ndarray]:
    return [
        hits(looking_at(2 * np.pi * k / views, 0.9, 60.0, np.array([0, 0, 1.4]), 150, 2200.0), np.array(shape), 3)
        for k in range(views)
    ]


def painted(
    shape: np.ndarray, views: int = 14, seed: int = 0, noise: float = 0.02
) -> tuple[list[Crop], GroundPlane, dict[int, np.ndarray]]:
    """Crops of a stem over speckled ground, the stem drawn by the twin."""
    rng = np.random.default_rng(seed)
    plane = GroundPlane(0, 0, 0, 6.0, 0.08)
    texture = rng.uniform(0.45, 0.8, (plane.cells, plane.cells, 1)).astype(np.float32).repeat(3, axis=2)
    crops = []
    for number in range(views):
        wide = looking_at(2 * np.pi * number / views, 0.9, 60.0, np.array([0, 0, 1.4]), 150, 2200.0)
        inside = _silhouettes(tuple(shape), views)[number][..., None]
        behind = np.empty((150, 150, 3), np.float32)
        texels = plane.texels(wide)
        sample_texture(texture, texels, behind)
        # A lens blurs light, not photo values.
        light = cv2.GaussianBlur(inside * 0.18**GAMMA + (1 - inside) * behind**GAMMA, (0, 0), 0.55)
        image = np.clip(light ** (1 / GAMMA) + rng.normal(0, noise, light.shape), 0, 1).astype(np.float32)
        clear = np.ones((150, 150), np.float32)
        crops.append(Crop(wide, image, clear, texels, clear, 0))
    return crops, plane, {0: texture}


def test_gradient_points_to_the_true_shape():
    crops, _, texture = painted(SHAPE, 3, noise=0.0)
    settings = PrimitiveSettings(blur_px=0.4, sharpness=0.0)
    for at, step in ((0, 0.006), (2, 0.01), (6, 0.004), (7, 0.003)):
        wrong = SHAPE.copy()
        wrong[at] += step
        total = np.zeros(9)
        sights = [Sight.of(crop, ground_seen(crop, texture[0])) for crop in crops]
        draw(sights, wrong, np.zeros(3), 0.4, settings)
        colour = textures(sights, settings, True)
        colour[:] = 0.18**GAMMA
        compare(sights, colour, settings)
        for v, s in enumerate(sights):
            h = np.zeros((9, 9))
            stem = StemView(wrong, BH, 0.0, 0.4)
            normal_equations(stem, s.lens, s.coverage, colour[v], s.scene, s.composite, 0.0, h, total)
        assert total[at] < 0  # too large by ``step``: the right-hand side pulls back


def test_a_painted_stem_is_measured_to_millimetres_from_a_poor_start():
    crops, plane, texture = painted(SHAPE)
    found = fit_primitive(crops, plane, texture)
    assert found is not None
    assert found.dbh_cm == pytest.approx(200 * SHAPE[6], abs=0.4)
    np.testing.assert_allclose(axis_xy(found.shape, BH, [0.8, 2.0]), axis_xy(SHAPE, BH, [0.8, 2.0]), atol=0.006)
    assert found.n_views >= 10 and found.findings.reasons == ()


def test_no_stem_is_refused():
    crops, plane, texture = painted(np.array([0, 0, 0, 0, 0, 0, 1e-6, 0]), 8)
    found = fit_primitive(crops, plane, texture)
    assert found is None or found.findings.refused


@pytest.mark.slow
def test_constant_and_masked_crops_give_nothing_or_a_refusal():
    crops, plane, texture = painted(SHAPE)
    flat = [replace(crop, image=np.full_like(crop.image, 0.4)) for crop in crops]
    hidden = [replace(crop, weight=np.zeros_like(crop.weight)) for crop in crops]
    for kind, ground_colour in ((flat, np.full_like(texture[0], 0.4)), (hidden, texture[0])):
        found = fit_primitive(kind, plane, {0: ground_colour})
        assert found is None or (found.findings.refused and np.isfinite(found.shape).all())


def test_bark_gaussians_lie_on_the_bark_and_keep_the_budget():
    crops, plane, texture = painted(SHAPE)
    found = fit_primitive(crops, plane, texture)
    assert found is not None
    bark = bark_gaussians(found, BH, 0.3, 2.9, 0.05, 1000)
    assert 100 < len(bark) <= 1000
    away = np.hypot(*(bark[:, :2] - axis_xy(found.shape, BH, bark[:, 2])).T)
    np.testing.assert_allclose(away, radius_m(found.shape, BH, bark[:, 2]), atol=0.006)


def test_a_stem_in_photos_is_found_and_reported():
    """Photos drawn by splats of 3 cm about 13 cm radius: soft edges half a radius out, the place is what counts."""
    views, photos = scene()
    options = GaussianOptions(threads=1)
    field, report = fit_with_report(
        views, FRAME, ground, np.array([STEM + [0.08, -0.06]]), options, None, lambda view: photos[view.name]
    )
    stem = report.primitives[0]
    assert np.linalg.norm(stem.origin[:2] + stem.primitive.shape[:2] - STEM) < 0.01
    assert report.stems[0]["dbh_cm"] == round(stem.primitive.dbh_cm, 2) and report.stems[0]["crops"] == 12
    assert 100 < len(field) == report.stems[0]["gaussians"] <= options.gaussians and field.opacities.min() > 0.9


def test_one_view_is_doubted():
    views, photos = scene()
    options = GaussianOptions(threads=1)
    try:
        _, report = fit_with_report(views[:1], FRAME, ground, STEM[None], options, None, lambda view: photos[view.name])
    except InputError:
        return
    assert report.primitives[0].primitive.findings.refused


def test_outlying_crops_are_harmless():
    """A view that looks past the stem adds nothing and breaks nothing."""
    crops, plane, texture = painted(SHAPE)
    past = looking_at(1.0, 0.9, 60.0, np.array([30.0, 0, 1.4]), 150, 2200.0)
    stray = replace(crops[0], camera=past, texels=plane.texels(past), image=np.zeros_like(crops[0].image))
    found = fit_primitive([*crops, stray], plane, texture)
    assert found is not None and found.dbh_cm == pytest.approx(200 * SHAPE[6], abs=0.6)
