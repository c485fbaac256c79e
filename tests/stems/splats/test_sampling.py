"""Candidate points, their opacity, hidden points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from gaussian_reference import point_opacity_reference
from scipy.spatial.transform import Rotation

pytest.importorskip("torch")

from treedgs_geo.core.errors import InputError
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.stems.splats.camera import CropCamera
from treedgs_geo.stems.splats.field import GaussianField
from treedgs_geo.stems.splats.on_torch.rasterize import draw
from treedgs_geo.stems.splats.on_torch.sample import draw_candidates, sample_surface, view_opacity
from treedgs_geo.stems.splats.options import SampleOptions

ROTATION = Rotation.from_euler("xyz", [150, 5, 20], degrees=True).as_matrix()


def view(distance: float = 8.0, rotation: np.ndarray = ROTATION, size: int = 200, k1: float = 0.0) -> View:
    camera = Camera(size, size, 4.0 * size, 3.95 * size, size / 2 + 1, size / 2 - 1, k1)
    return View("a.jpg", Path("a.jpg"), camera, rotation, np.array([0.05, -0.1, distance]))


def cloud(count: int = 50, seed: int = 0) -> GaussianField:
    rng = np.random.default_rng(seed)
    p = np.zeros((count, 14))
    p[:, :3] = rng.normal(0, 0.3, (count, 3))
    p[:, 3:7] = rng.normal(size=(count, 4))
    p[:, 7:10] = np.log(rng.uniform(0.01, 0.15, (count, 3)))
    p[:, 10] = rng.normal(0, 1, count)
    p[:, 11:] = 0.5
    return GaussianField.from_packed(p)


def ring_of_views(count: int = 8, tilt_deg: float = 55, distance: float = 40.0) -> list[View]:
    """Views from a circle above, all looking at the origin."""
    found = []
    for angle in np.arange(count) * 2 * np.pi / count:
        tilt = np.radians(tilt_deg)
        centre = distance * np.array([np.sin(tilt) * np.cos(angle), np.sin(tilt) * np.sin(angle), np.cos(tilt)])
        forward = -centre / distance
        right = np.cross(forward, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        camera = Camera(300, 300, 2000, 2000, 150, 150)
        found.append(View(f"{angle:.2f}", Path("x"), camera, rotation, -rotation @ centre))
    return found


def test_opacity_equals_the_reference():
    field, seen = cloud(), view()
    points = draw_candidates(field, 30, 0)
    opacity, foreground = view_opacity(field.packed, seen, points)
    expected, whole = point_opacity_reference(field.packed, CropCamera.of(seen), points)
    inside = seen.contains(seen.project(points)[0])
    assert inside.mean() > 0.9
    np.testing.assert_array_equal(foreground, (whole > 0) & inside)
    np.testing.assert_allclose(opacity[inside], expected[inside], atol=3e-4)


def test_points_and_pixels_share_one_convention():
    """Far behind everything, the point query at a pixel centre is the rendered alpha there; half a pixel off it is
    not.
    """
    field, seen = cloud(), view()
    alpha = 1 - draw(field.packed, CropCamera.of(seen))[3]
    rows, columns = np.nonzero((alpha > 0.3) & (alpha < 0.9))

    def query(shift: float) -> np.ndarray:
        rays = seen.rays(np.column_stack([columns + 0.5 + shift, rows + 0.5 + shift]))
        return view_opacity(field.packed, seen, seen.centre + 50 * rays)[0]

    assert np.abs(query(0.0) - alpha[rows, columns]).max() < 2e-3
    assert np.abs(query(0.5) - alpha[rows, columns]).mean() > 5e-3


def test_lens_distortion_only_decides_what_is_inside_the_photo():
    field = cloud()
    points = draw_candidates(field, 10, 0)
    plain, bent = view_opacity(field.packed, view(), points)[0], view_opacity(field.packed, view(k1=-0.05), points)[0]
    np.testing.assert_allclose(plain, bent, atol=1e-5)


def test_flying_height_does_not_cost_precision():
    """70 m or 70 km away at the same footprint: the same opacity (distances are taken relative to a near one)."""
    field = cloud()
    points = draw_candidates(field, 20, 0)
    found = []
    for distance in (7e3, 7e4):
        camera = Camera(300, 300, 80 * distance, 80 * distance, 150, 150)
        away = View("a", Path("a"), camera, ROTATION, np.array([0, 0, distance]))
        found.append(view_opacity(field.packed, away, points)[0])
    assert np.abs(found[0] - found[1]).mean() < 0.02


def test_thinning_keeps_alpha_times_m_points():
    field = cloud(200)
    points = draw_candidates(field, 100, 3)
    np.testing.assert_array_equal(points, draw_candidates(field, 100, 3))
    assert abs(len(points) - 100 * field.opacities.sum()) < 6 * np.sqrt(200 * 25)
    alone = field.select(np.arange(200) == 0)
    own = draw_candidates(alone, 10_000, 3)
    offset = (own - alone.means[0]) @ alone.rotations[0] / alone.scales[0]
    np.testing.assert_allclose(offset.std(axis=0), 1, atol=0.03)


def test_what_a_shell_hides_is_scored_solid_and_what_no_photo_shows_is_dropped():
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(800, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    p = np.zeros((802, 14))  # an opaque shell, a Gaussian within, and one far off
    p[:800, :3] = 0.3 * directions
    p[801, :3] = [0, 0, 900]
    p[:, 3], p[:, 7:10], p[:, 10] = 1, np.log(0.04), 4
    # from above and below: the shell is closed to all views
    views = ring_of_views() + ring_of_views(tilt_deg=125)
    points = sample_surface(GaussianField.from_packed(p), views, SampleOptions(samples=10, threads=1))
    away = np.linalg.norm(points.xyz, axis=1)
    assert away.max() < 1 and np.all(points.attributes["n_views"] > 0)
    opacity = points.attributes["opacity"]
    assert np.median(opacity[away > 0.39]) < 0.6 and np.median(opacity[away < 0.27]) > 0.99
    assert (away < 0.1).sum() > 5 and np.all(opacity[away < 0.1] > 0.9)


def test_opacity_is_the_minimum_over_views_and_threads_do_not_matter():
    field, views = cloud(), ring_of_views(5, distance=10)
    one = sample_surface(field, views, SampleOptions(samples=20, threads=1))
    two = sample_surface(field, views, SampleOptions(samples=20, threads=2))
    np.testing.assert_array_equal(one.attributes["opacity"], two.attributes["opacity"])
    each = [view_opacity(field.packed, v, one.xyz) for v in views]
    low = np.min([np.where(f, o, 1) for o, f in each], axis=0)
    np.testing.assert_allclose(one.attributes["opacity"], low, atol=1e-6)
    np.testing.assert_array_equal(one.attributes["n_views"], np.sum([f for _, f in each], axis=0))


def test_refusals():
    with pytest.raises(InputError, match="empty"):
        sample_surface(GaussianField.from_packed(np.zeros((0, 14))), ring_of_views(2))
    with pytest.raises(InputError, match="no registered photo"):
        sample_surface(cloud(), [])
    away = cloud()
    moved = GaussianField.from_packed(away.packed + np.r_[0, 0, 500, np.zeros(11)])
    with pytest.raises(InputError, match="None of the photos"):
        sample_surface(moved, ring_of_views(2))
