"""Odd fields and cameras, drawn at random: finite pictures, gradients and points, or a clear refusal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

torch = pytest.importorskip("torch")

from treedgs_geo.core.errors import InputError  # noqa: E402
from treedgs_geo.reconstruction.cameras import Camera, View  # noqa: E402
from treedgs_geo.stems.splats.camera import CropCamera  # noqa: E402
from treedgs_geo.stems.splats.field import COLOUR, LOG_SCALE, LOGIT, MEAN, QUATERNION, GaussianField  # noqa: E402
from treedgs_geo.stems.splats.on_torch.rasterize import draw, rasterize, tensors_of  # noqa: E402
from treedgs_geo.stems.splats.on_torch.sample import sample_surface, view_opacity  # noqa: E402
from treedgs_lab.published.point_sets import fuse_depth  # noqa: E402

DOWN = np.diag([1.0, -1.0, -1.0])


@st.composite
def odd_fields(draw):
    """Up to 20 Gaussians in one unit system: flat, needle-like, huge, tiny, about or behind the camera."""
    n, scale = draw(st.integers(1, 20)), draw(st.sampled_from([1e-3, 1.0, 1e3]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    p = np.zeros((n, 14))
    p[:, MEAN] = rng.uniform(-3, 3, (n, 3)) * scale
    p[:, 2] *= draw(st.sampled_from([0.0, 1.0, 5.0]))
    p[:, QUATERNION] = rng.standard_normal((n, 4))
    low, high = draw(st.sampled_from([(-14, -8), (-8, 1), (-20, 3), (0, 3)]))
    p[:, LOG_SCALE] = rng.uniform(low, high, (n, 3)) + np.log(scale)
    p[:, LOGIT], p[:, COLOUR] = rng.uniform(-12, 12, n), rng.random((n, 3))
    return p, scale


def camera(scale: float, width: int = 40, height: int = 30) -> CropCamera:
    return CropCamera(width, height, 60.0, 60.0, width / 2, height / 2, DOWN, np.array([0, 0, 6.0 * scale]))


@settings(max_examples=60, deadline=None)
@given(odd_fields())
def test_any_field_draws_finite_pictures_gradients_and_opacities(drawn):
    p, scale = drawn
    planes = draw(p, camera(scale), True, 0.15)
    assert np.isfinite(np.delete(planes, 5, axis=0)).all()  # the median depth is NaN where there is none
    assert (planes[3] >= 0).all() and (planes[3] <= 1).all()
    tensors = tensors_of(p)
    shown = rasterize(*tensors, camera(scale), geometry=True, dilation_px2=0.15)
    (shown.planes * torch.randn(shown.planes.shape, generator=torch.Generator().manual_seed(0))).sum().backward()
    assert all(torch.isfinite(tensor.grad).all() for tensor in tensors)
    view = View("a", Path("a"), Camera(40, 30, 60.0, 60.0, 20.0, 15.0), DOWN, np.array([0, 0, 6.0 * scale]))
    opacity, _ = view_opacity(p, view, p[:, MEAN])
    assert np.isfinite(opacity).all() and (opacity >= 0).all() and (opacity <= 1).all()


@settings(max_examples=20, deadline=None)
@given(odd_fields(), st.floats(0.1, 1000))
def test_units_change_nothing_in_the_picture(drawn, factor):
    p, scale = drawn
    q = p.copy()
    q[:, MEAN] *= factor
    q[:, LOG_SCALE] += np.log(factor)
    both = ((p, scale), (q, scale * factor))
    one, two = (draw(each, camera(size), dilation_px2=0.15) for each, size in both)
    # A pixel on an ellipse's rim may be in or out by rounding; nothing else may move.
    assert np.quantile(np.abs(one - two), 0.98) < 1e-3


def test_coordinates_of_a_map_are_refused_and_empty_things_too():
    p = np.zeros((3, 14))
    p[:, 3], p[:, MEAN] = 1, [611337.0, 3718451.0, 40.0]
    with pytest.raises(InputError, match="local frame"):
        GaussianField.from_packed(p)
    view = View("a", Path("a"), Camera(40, 30, 60.0, 60.0, 20.0, 15.0), DOWN, np.array([0, 0, 6.0]))
    empty = GaussianField.from_packed(np.zeros((0, 14)))
    for call in (lambda: sample_surface(empty, [view]), lambda: fuse_depth(empty, [view], np.zeros((3, 3)))):
        with pytest.raises(InputError):
            call()
    assert (draw(np.zeros((0, 14)), camera(1.0))[3] == 1).all()


def wall(n: int = 900) -> GaussianField:
    """An opaque wall of flat Gaussians in z = 0, seen from above."""
    p = np.zeros((n, 14))
    side = int(np.sqrt(n))
    grid = np.linspace(-1, 1, side)
    p[:, 0], p[:, 1] = (value.ravel() for value in np.meshgrid(grid, grid))
    p[:, 3], p[:, LOG_SCALE], p[:, LOGIT] = 1, np.log([0.06, 0.06, 0.002]), 3.5
    return GaussianField.from_packed(p)


def test_fused_depth_of_a_wall():
    field = wall()
    views = [
        View(str(k), Path("a"), Camera(80, 80, 200, 200, 40, 40), DOWN, -DOWN @ np.array([shift, 0, 8.0]))
        for k, shift in enumerate((-0.5, 0.0, 0.5))
    ]
    points = fuse_depth(field, views, field.means.astype(float))
    assert len(points) > 500 and np.abs(points[:, 2]).max() < 0.02
