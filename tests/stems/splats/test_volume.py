"""Points spread over a stem's surroundings, and the cone at whose bark their opacity ends."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyproj
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st

from treedgs_geo.core.errors import InputError
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.stems.cloud.estimate.cloud import measure_stems
from treedgs_geo.stems.cloud.estimate.opacity_cone import fit_opacity_cone
from treedgs_geo.stems.cloud.estimate.options import MeasureOptions
from treedgs_geo.stems.splats.field import GaussianField, empty_field
from treedgs_geo.stems.splats.joint_fit import surface_gaussians
from treedgs_geo.stems.splats.opacity_samples import sample_volume
from treedgs_geo.stems.splats.options import SampleOptions
from treedgs_geo.stems.splats.primitive.fit import PrimitiveFit
from treedgs_geo.terrain.dtm import Dtm

BH = 1.37


def ring_of_views(count: int) -> list[View]:
    """Photos from a circle 40 m away, 50 degrees from straight down, 2 cm a pixel."""
    found = []
    for angle in np.arange(count) * 2 * np.pi / count:
        forward = -np.array([np.sin(0.87) * np.cos(angle), np.sin(0.87) * np.sin(angle), np.cos(0.87)])
        right = np.cross(forward, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        found.append(
            View(
                "x",
                Path("x"),
                Camera(300, 300, 2000, 2000, 150, 150),
                rotation,
                -rotation @ (np.array([0, 0, 1.4]) - 40 * forward),
            )
        )
    return found


def opacities(shape: np.ndarray, levels: tuple[float, float], seed: int = 0, count: int = 6000) -> tuple:
    """Even points and noisy opacities about a cone x, y, slopes, radius, taper; with a shrub of fog beside it."""
    rng = np.random.default_rng(seed)
    r, angle = 0.5 * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    points = np.column_stack([r * np.cos(angle), r * np.sin(angle), rng.uniform(0.2, 2.8, count)])
    q = points[:, 2] - BH
    away = np.hypot(*(points[:, :2] - shape[:2] - np.outer(q, shape[2:4])).T)
    value = np.where(away < shape[4] + shape[5] * q, levels[0], levels[1]) * rng.uniform(0.2, 1.8, count)
    fog = np.linalg.norm(points - [0.3, 0.3, 0.9], axis=1) < 0.12
    value[fog] = levels[0]
    return points, np.clip(value, 0, 1)


@pytest.mark.parametrize("levels", [(0.9, 0.1), (0.06, 0.004)])
def test_a_leaning_cone_is_read_to_millimetres_however_translucent(levels):
    shape = np.array([0.12, -0.2, 0.06, -0.04, 0.145, -0.005])
    found = fit_opacity_cone(*opacities(shape, levels))
    assert found is not None
    assert found.dbh_cm == pytest.approx(29.0, abs=0.7)
    np.testing.assert_allclose([found.x, found.y], shape[:2], atol=0.01)
    np.testing.assert_allclose([found.slope_x, found.slope_y], shape[2:4], atol=0.02)
    assert found.inside > 5 * found.outside and 0.2 < found.explained < 1


def test_no_edge_no_cone():
    points, _ = opacities(np.array([0, 0, 0, 0, 0.1, 0.0]), (0.5, 0.1))
    for value in (np.zeros(len(points)), np.full(len(points), 0.7)):
        assert fit_opacity_cone(points, value) is None
    assert fit_opacity_cone(points[:50], np.ones(50)) is None
    # Fog that fills the volume but for its rim.
    assert fit_opacity_cone(points, (np.hypot(*points[:, :2].T) < 0.46).astype(float)) is None
    assert fit_opacity_cone(np.zeros((0, 3)), np.zeros(0)) is None
    assert fit_opacity_cone(points + [0, 0, 30.0], np.ones(len(points))) is None


@settings(max_examples=15, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), flat=st.booleans(), scale=st.sampled_from([1e-3, 1.0, 1e3]))
def test_any_points_give_a_finite_cone_or_none(seed, flat, scale):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(400, 3)) * [scale, 0.0 if flat else scale, 0.5] + [0, 0, BH]
    found = fit_opacity_cone(points, rng.random(400))
    assert found is None or np.isfinite(list(vars(found).values())).all()


def stem_field(group: int = 3) -> GaussianField:
    shape = np.array([0.05, -0.03, 0.02, 0.01, 0.0, 0.0, 0.15, -0.005])
    primitive = PrimitiveFit(shape, 0.4, 20, 0.1, 0.1, 0.1, np.zeros(1), np.full((24, 13, 3), 0.3), 0.0)
    p = surface_gaussians(primitive, BH, 0.2, 3.0, 0.03, 3000)
    rng = np.random.default_rng(0)
    fog = np.tile(p[:1], (150, 1))
    fog[:, :3] = rng.uniform([-0.5, -0.5, 0.2], [0.5, 0.5, 3.0], (150, 3))
    fog[:, 7:10], fog[:, 10] = np.log(0.03), -3.0
    return GaussianField.from_packed(np.concatenate([p, fog]), group)


def test_the_bark_of_a_field_is_found_in_its_volume():
    field, views = stem_field(), ring_of_views(12)
    points = sample_volume(field, views, SampleOptions(samples=30, threads=2))
    assert len(points) == 6000 and set(points.groups) == {3}
    found = fit_opacity_cone(points.xyz, points.opacity)
    assert found is not None and found.dbh_cm == pytest.approx(30.0, abs=1.5)
    again = sample_volume(field, views, SampleOptions(samples=30, threads=1))
    np.testing.assert_array_equal(again.opacity, points.opacity)
    # The command's road: LAZ columns, a terrain, trees.
    crs = pyproj.CRS.from_epsg(6344)
    dtm = Dtm(np.zeros((20, 20)), Affine(0.5, 0, -5.0, 0, -0.5, 5.0), crs)
    cloud = PointCloud(points.xyz, crs, {"opacity": points.opacity, "even": np.ones(len(points), np.uint8)})
    (tree,) = measure_stems(cloud, points.groups + 1, dtm, MeasureOptions(weights="opacity", source="splat"))
    assert tree.dbh_cm == pytest.approx(found.dbh_cm, abs=0.3)
    assert tree.qc_flag == "check" and tree.dbh_se_cm >= 2
    # Without --weights opacity too; other methods would count points that say nothing by their place.
    (tree,) = measure_stems(cloud, points.groups + 1, dtm, MeasureOptions(source="splat"))
    assert tree.dbh_cm == pytest.approx(found.dbh_cm, abs=0.3)
    with pytest.raises(InputError, match="spread evenly"):
        measure_stems(cloud, points.groups + 1, dtm, MeasureOptions(method="paper", weights="opacity"))
    # Opacity that has nothing to do with any stem is refused, not read.
    noise = cloud.with_attribute("opacity", np.random.default_rng(1).random(len(points)).astype(np.float32))
    (tree,) = measure_stems(noise, points.groups + 1, dtm, MeasureOptions(source="splat"))
    assert tree.dbh_cm is None and tree.qc_flag == "reject" and tree.qc_reason == "occluded"


def test_volumes_that_cannot_be_sampled_are_refused():
    views = ring_of_views(4)
    with pytest.raises(InputError, match="field is empty"):
        sample_volume(empty_field(), views)
    with pytest.raises(InputError, match="no registered photo"):
        sample_volume(stem_field(), [])
    far = GaussianField.from_packed(stem_field().packed + np.r_[500.0, np.zeros(13)])
    with pytest.raises(InputError, match="None of the photos"):
        sample_volume(far, views, SampleOptions(samples=2))
