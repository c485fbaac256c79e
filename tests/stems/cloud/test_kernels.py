"""The compiled parts against what numpy and scipy say, slowly."""

import numpy as np
import pytest
from scipy import fft
from scipy.ndimage import maximum_filter

from treedgs_geo.pointcloud.cloud import extent
from treedgs_geo.stems.cloud.propose.candidates import _kernel, _largest_near
from treedgs_geo.stems.cloud.propose.evidence import stands_at
from treedgs_geo.stems.geometry.cone import Cone
from treedgs_geo.stems.geometry.cone_kernels import _bent_sums, _straight_sums


@pytest.mark.parametrize("reach", [0, 1, 3, 7, 16])
def test_largest_near_is_a_maximum_filter(reach):
    image = np.random.default_rng(reach).random((31, 45)).astype(np.float32)
    np.testing.assert_array_equal(_largest_near(image, reach), maximum_filter(image, size=2 * reach + 1))


def test_ring_kernel_wraps_around_its_corner():
    kernel = np.round(fft.irfft2(_kernel(0.2, (40, 48), solid=False), s=(40, 48)), 5)
    i, j = (np.minimum(np.arange(size), size - np.arange(size)) * 0.05 for size in kernel.shape)
    distance = np.hypot(i[:, None], j[None])
    np.testing.assert_array_equal(kernel == 1.0, np.abs(distance - 0.2) <= 0.045)
    np.testing.assert_array_equal(kernel == -1.0, distance < 0.155)
    assert (kernel[distance > 0.345] == 0).all()


def test_extent_says_when_a_column_holds_no_number():
    points = np.random.default_rng(0).normal(size=(50, 3))
    np.testing.assert_array_equal(extent(points), (points.min(axis=0), points.max(axis=0)))
    np.testing.assert_array_equal(extent(points[:, :2]), (points.min(axis=0)[:2], points.max(axis=0)[:2]))
    points[20, 1] = np.nan
    low, high = extent(points)
    assert np.isnan(low[1]) and np.isnan(high[1]) and np.isfinite(low[[0, 2]]).all()


def test_a_bent_axis_without_bend_is_a_straight_one():
    rng = np.random.default_rng(3)
    x, y, t = rng.normal(0, 0.2, 500), rng.normal(0, 0.2, 500), rng.uniform(-1, 3, 500)
    weights, vector = rng.random(500), np.array([0.01, -0.02, 0.05, -0.03, 0.15, -0.005, 0.0, 0.0])
    straight, bent = (np.zeros((6, 5)), np.zeros((3, 3))), (np.zeros((6, 5)), np.zeros((3, 3)))
    _straight_sums(x, y, t, weights, vector, 0.02, *straight)
    _bent_sums(x, y, t, weights, vector, 0.02, *bent)
    assert straight[0][5, 0] > 10
    np.testing.assert_allclose(straight[0][:, :3], bent[0][:, :3], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(straight[1][:, :2], bent[1][:, :2], rtol=1e-9, atol=1e-12)


def test_stands_at_asks_the_axis_at_that_height():
    cone = Cone(2.0, 3.0, 0.1, 0.0, 0.2, -0.01, 1.3, bx=0.02)
    axes = np.r_[cone.vector, cone.h_ref][None]
    x, y = cone.centre(4.0)
    reach = 0.8 * float(cone.radius(4.0))
    assert stands_at(axes, x + 0.99 * reach, y, 4.0, 0.8, 0.05, 0.0)
    assert not stands_at(axes, x + 1.01 * reach, y, 4.0, 0.8, 0.05, 0.0)
    assert stands_at(axes, x + reach + 0.5, y, 4.0, 0.8, 0.05, 0.6)
    assert not stands_at(axes[:0], x, y, 4.0, 0.8, 0.05, 0.0)
