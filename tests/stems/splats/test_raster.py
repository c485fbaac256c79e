"""Rasteriser against its float64 twin, gradients against finite differences, one pixel convention, bad splats."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gaussian_reference import (
    camera_gaussians,
    distance_plane,
    ray_maximum,
    render_reference,
    seen,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

torch = pytest.importorskip("torch")

from treedgs_geo.stems.splats.camera import CropCamera  # noqa: E402
from treedgs_geo.stems.splats.on_torch.rasterize import draw, projected, rasterize, tensors_of  # noqa: E402
from treedgs_geo.stems.splats.raster import pull_back  # noqa: E402

ROTATION = Rotation.from_euler("xyz", [150, 5, 20], degrees=True).as_matrix()


def camera(width: int = 40, height: int = 37) -> CropCamera:
    return CropCamera(width, height, 270.0, 260.0, 20.3, 18.1, ROTATION, np.array([0.05, -0.1, 8.0]))


def cloud(count: int = 30, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    p = np.zeros((count, 14))
    p[:, :3] = rng.normal(0, 0.3, (count, 3))
    p[:, 3:7] = rng.normal(size=(count, 4))
    p[:, 7:10] = np.log(rng.uniform(0.01, 0.15, (count, 3)))
    p[:, 10] = rng.normal(0, 1, count)
    p[:, 11:] = rng.uniform(0, 1, (count, 3))
    return p


@pytest.mark.parametrize("dilation", [0.0, 0.3])
def test_forward_equals_the_reference(dilation):
    planes = draw(cloud(), camera(), True, dilation)
    truth = render_reference(cloud(), camera(), dilation)
    np.testing.assert_allclose(np.moveaxis(planes[:3], 0, -1), truth["colour"], atol=2e-5)
    np.testing.assert_allclose(planes[3], truth["trans"], atol=2e-5)
    np.testing.assert_allclose(planes[4], truth["depth_sum"], atol=1e-4)
    np.testing.assert_allclose(np.moveaxis(planes[6:9], 0, -1), truth["normal_sum"], atol=2e-5)
    np.testing.assert_array_equal(np.isnan(planes[5]), np.isnan(truth["median"]))
    different = ~np.isclose(planes[5], truth["median"], atol=1e-4, equal_nan=True)
    assert different.mean() < 0.005  # T = 0.5 decided differently in float32


@pytest.mark.parametrize("dilation", [0.0, 0.3])
@pytest.mark.parametrize("full", [False, True])
def test_gradients_equal_finite_differences(dilation, full):
    p, view = cloud(12), camera(24, 22)
    given = np.random.default_rng(1).normal(size=(8 if full else 4, 22, 24)).astype(np.float32)
    # A tiny cut-off: a pixel that enters or leaves an ellipse must not disturb the difference quotient.
    tensors = tensors_of(p, dtype=torch.float64)
    shown = rasterize(*tensors, view, geometry=full, dilation_px2=dilation, alpha_min=1e-7)
    (shown.planes * torch.tensor(given)).sum().backward()
    analytic = np.column_stack([tensor.grad.numpy() for tensor in tensors])

    def loss(q: np.ndarray) -> float:
        r = render_reference(q, view, dilation, 1e-7)
        value = (given[:3] * np.moveaxis(r["colour"], -1, 0)).sum() + (given[3] * r["alpha"]).sum()
        if full:
            value += (given[4] * r["depth_sum"]).sum() + (given[5:8] * np.moveaxis(r["normal_sum"], -1, 0)).sum()
        return value

    step = 1e-6
    for gaussian in (0, 5):
        for column in range(14):
            up, down = p.copy(), p.copy()
            up[gaussian, column] += step
            down[gaussian, column] -= step
            numeric = (loss(up) - loss(down)) / (2 * step)
            scale = np.abs(analytic[:, column]).max() + 1e-3
            assert abs(analytic[gaussian, column] - numeric) < 2e-3 * scale, (gaussian, column)


def test_distance_plane_is_the_tangent_of_the_exact_ray_maximum():
    view, p = camera(), cloud(5)
    centres, covariances = camera_gaussians(p, view)
    for centre, covariance in zip(centres, covariances, strict=True):
        distance, slope, normal = distance_plane(centre, covariance, view)
        pixel = np.array([view.fx * centre[0] / centre[2] + view.cx, view.fy * centre[1] / centre[2] + view.cy])

        def exact(u, centre=centre, covariance=covariance):
            ray = np.array([(u[0] - view.cx) / view.fx, (u[1] - view.cy) / view.fy, 1.0])
            return ray_maximum(centre, covariance, ray / np.linalg.norm(ray))[0]

        assert exact(pixel) == pytest.approx(distance, abs=1e-12)
        for axis in range(2):
            step = np.eye(2)[axis] * 1e-3
            numeric = (exact(pixel + step) - exact(pixel - step)) / 2e-3
            assert numeric == pytest.approx(slope[axis], rel=1e-6, abs=1e-9)
        assert normal @ centre < 0  # faces the camera


def test_pixel_centres_are_at_half():
    """The alpha-weighted mean of the pixel centres is where the camera model puts the Gaussian; a half-pixel slip
    fails.
    """
    view = camera()
    p = cloud(1)
    p[0, :3], p[0, 7:10], p[0, 10] = [0.02, 0.01, 0.0], np.log(0.08), 0.0
    alpha = seen(p, view).alpha
    u, v = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    pixel = view.project(p[:, :3])[0][0]
    mean = np.array([(alpha * u).sum(), (alpha * v).sum()]) / alpha.sum()
    np.testing.assert_allclose(mean, pixel, atol=0.03)


def test_moving_the_principal_point_moves_the_picture_by_whole_pixels():
    view = camera()
    shifted = replace(view, cx=view.cx + 3, cy=view.cy - 2)
    one, two = seen(cloud(), view).alpha, seen(cloud(), shifted).alpha
    np.testing.assert_allclose(one[2:, :-3], two[:-2, 3:], atol=2e-5)


def test_halving_keeps_corners_not_centres():
    half = camera(40, 36).scaled(0.5)
    pixels, _ = camera(40, 36).project(cloud(4)[:, :3])
    np.testing.assert_allclose(half.project(cloud(4)[:, :3])[0], pixels / 2)


def test_depth_of_a_flat_wall():
    """An opaque wall square to the axis: both distances are the distance to it, and normals face the camera."""
    view = CropCamera(20, 20, 100.0, 100.0, 10.0, 10.0, np.eye(3), np.zeros(3))
    x, y = np.meshgrid(np.linspace(-1, 1, 25), np.linspace(-1, 1, 25))
    p = np.zeros((x.size, 14))
    p[:, :3] = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 5.0)])
    p[:, 3], p[:, 7:9], p[:, 9], p[:, 10] = 1, np.log(0.1), np.log(1e-4), 5
    wall = seen(p, view)
    expected = 5 / view.pixel_rays()[..., 2]
    np.testing.assert_allclose(wall.depth, expected, rtol=2e-3)
    np.testing.assert_allclose(wall.median_depth, expected, rtol=2e-3)
    assert np.all(wall.normals[..., 2] < -0.99)


@pytest.mark.parametrize("factor", [1e-3, 1e3, 1e6])
def test_scale_of_the_scene_does_not_matter(factor):
    view, p = camera(), cloud()
    scaled = p.copy()
    scaled[:, :3] *= factor
    scaled[:, 7:10] += np.log(factor)
    far = replace(view, translation=view.translation * factor)
    one, two = seen(p, view), seen(scaled, far)
    np.testing.assert_allclose(one.colour, two.colour, atol=2e-4)
    np.testing.assert_allclose(one.depth * factor, two.depth, rtol=1e-4)


def test_camera_inside_or_behind_a_splat_draws_nothing():
    view = CropCamera(16, 16, 50.0, 50.0, 8.0, 8.0, np.eye(3), np.zeros(3))
    p = cloud(3)
    p[:, 10] = 3
    p[:, 7:10] = np.log(1.0)
    p[:, :3] = [[0, 0, 0.1], [0, 0, -5], [0, 0, 2.0]]
    assert projected(p, view).shape[1] == 0
    assert np.all(seen(p, view).alpha == 0)


def test_empty_field_and_one_pixel_crop():
    view = CropCamera(1, 1, 50.0, 50.0, 0.5, 0.5, np.eye(3), np.zeros(3))
    nothing = np.zeros((0, 14))
    empty = seen(nothing, view)
    assert empty.alpha.shape == (1, 1) and empty.alpha[0, 0] == 0 and np.isnan(empty.depth).all()
    assert pull_back(projected(nothing, view), draw(nothing, view, True), np.ones((9, 1, 1))).shape == (15, 0)


@settings(max_examples=40)
@given(
    st.lists(st.floats(-18, 6), min_size=3, max_size=3),
    st.lists(st.floats(-3, 3), min_size=3, max_size=3),
    st.floats(-12, 12),
    st.lists(st.floats(-1, 1), min_size=4, max_size=4),
    st.sampled_from([0.0, 0.3]),
)
def test_any_splat_gives_finite_pictures_and_gradients(log_scales, mean, logit, quaternion, dilation):
    """Needles, discs, giants and specks, in front of, beside and around the camera, zero quaternions included."""
    p = cloud(2)
    p[0, :3], p[0, 3:7], p[0, 7:10], p[0, 10] = mean, quaternion, log_scales, logit
    view = CropCamera(16, 16, 60.0, 60.0, 8.0, 8.0, np.eye(3), np.array([0, 0, 1.5]))
    planes = draw(p, view, True, dilation)
    assert np.isfinite(planes[[0, 1, 2, 3, 4, 6, 7, 8]]).all()
    assert planes[3].min() >= 0 and planes[3].max() <= 1
    tensors = tensors_of(p)
    rasterize(*tensors, view, geometry=True, dilation_px2=dilation).planes.sum().backward()
    assert all(torch.isfinite(tensor.grad).all() for tensor in tensors)
