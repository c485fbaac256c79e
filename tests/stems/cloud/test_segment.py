"""Stems found in synthetic plots: all of them, nothing else, whatever the coordinates."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_cloud import plot_cloud, stem_points

from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.stems.cloud.propose.labelling import Labeller
from treedgs_geo.stems.cloud.propose.segment import SegmentOptions, find_stems
from treedgs_geo.stems.geometry.cone import Cone, fit_cone
from treedgs_geo.terrain.ground import dtm_from_cloud, height_above_ground

STEMS = [(2.0, 2.5, 14.0), (6.0, 3.0, 30.0), (9.5, 8.0, 22.0), (4.0, 9.0, 45.0), (8.0, 5.2, 18.0)]


def feet(stems):
    return np.array([stem.cone.centre(1.37) + stems.origin for stem in stems.stems]).reshape(-1, 2)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_drone_like_plot(seed):
    xyz = plot_cloud(np.random.default_rng(seed), STEMS)
    cloud = PointCloud(xyz)
    dtm = dtm_from_cloud(xyz)
    stems = find_stems(cloud, dtm)
    assert stems.sensor == "uls" and len(stems.stems) == len(STEMS)
    for x, y, dbh in STEMS:
        gap = np.hypot(*(feet(stems) - (x, y)).T)
        assert gap.min() < 0.02
        assert 200 * stems.stems[gap.argmin()].cone.radius(1.37) == pytest.approx(dbh, abs=1.0)
    label = Labeller(stems)(xyz, height_above_ground(xyz, dtm))
    assert label.dtype == np.int32 and set(np.unique(label)) == set(range(len(STEMS) + 1))


def test_dense_scan_and_utm_coordinates_and_order():
    """Translation to UTM-size coordinates and the order of the points change nothing."""
    rng = np.random.default_rng(3)
    xyz = plot_cloud(rng, STEMS, bark=12_000, per_m2=400, noise_m=0.004)
    here = find_stems(PointCloud(xyz), dtm_from_cloud(xyz))
    assert here.sensor == "tls" and len(here.stems) == len(STEMS)
    moved = xyz[rng.permutation(len(xyz))] + (611300.0, 3718400.0, 20.0)
    there = find_stems(PointCloud(moved), dtm_from_cloud(moved))
    assert len(there.stems) == len(STEMS)
    np.testing.assert_allclose(feet(there) - (611300, 3718400), feet(here), atol=0.01)
    radii = [[stem.cone.radius(1.37) for stem in found.stems] for found in (here, there)]
    np.testing.assert_allclose(radii[0], radii[1], atol=0.003)


def test_filled_stems_with_opacity_are_splats():
    rng = np.random.default_rng(5)
    xyz = plot_cloud(rng, [])
    parts, opacity = [xyz], [np.full(len(xyz), 0.3)]
    for x, y, dbh in STEMS[:3]:
        points = stem_points(rng, dbh, 3000, 0.01, xy=(x, y), filled=True)
        points[:, 2] += 100 + 0.05 * x + 0.1 * np.sin(y / 3)
        parts.append(points)
        opacity.append(rng.uniform(0.5, 1, len(points)))
    cloud = PointCloud(np.concatenate(parts), None, {"opacity": np.concatenate(opacity)})
    stems = find_stems(cloud, dtm_from_cloud(cloud.xyz))
    assert stems.sensor == "splat" and len(stems.stems) == 3
    for x, y, _ in STEMS[:3]:
        assert np.hypot(*(feet(stems) - (x, y)).T).min() < 0.03


def test_shrubs_and_leaves_are_no_stems():
    rng = np.random.default_rng(6)
    xyz = plot_cloud(rng, [], shrubs=3000)
    leaves = np.column_stack([rng.uniform(0, 12, (6000, 2)), 100 + rng.uniform(0.5, 12, 6000)])
    cloud = PointCloud(np.vstack([xyz, leaves]))
    stems = find_stems(cloud, dtm_from_cloud(xyz))
    assert stems.stems == ()
    assert (Labeller(stems)(cloud.xyz, cloud.xyz[:, 2] - 100) == 0).all()


def test_leaning_stem_is_followed():
    rng = np.random.default_rng(7)
    xyz = plot_cloud(rng, [])
    leaning = stem_points(rng, 24.0, 400, lean=(0.25, 0.1), xy=(5, 5), high=8)
    leaning[:, 2] += 100 + 0.25 + 0.1 * np.sin(5 / 3)
    cloud = PointCloud(np.vstack([xyz, leaning]))
    stems = find_stems(cloud, dtm_from_cloud(xyz), SegmentOptions(source="uls"))
    assert len(stems.stems) == 1
    assert stems.stems[0].cone.lean_deg == pytest.approx(np.degrees(np.arctan(np.hypot(0.25, 0.1))), abs=1.0)


@pytest.mark.parametrize("lean", [(0.0, 0.0), (0.17, 0.0), (0.2, 0.3)])
def test_cone_fit_is_unbiased(lean):
    errors, z = [], []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        points = stem_points(rng, 25.0, 250, 0.012, lean=lean, low=0.4, high=4.2)
        fitted = fit_cone(points, Cone(0.03, -0.02, 0.0, 0.0, 0.15, -0.005, 1.37))
        errors.append(200 * fitted.radius(1.37) - 25.0)
        z.append(errors[-1] / (200 * np.sqrt(fitted.covariance[4, 4])))
        assert fitted.lean_deg == pytest.approx(np.degrees(np.arctan(np.hypot(*lean))), abs=0.8)
    assert abs(np.mean(errors)) < 0.12 and np.std(errors) < 0.3
    assert 0.4 < np.sqrt(np.mean(np.square(z))) < 2.0


def test_cone_fit_refuses_nonsense():
    start = Cone(0, 0, 0, 0, 0.1, 0, 1.3)
    assert fit_cone(np.zeros((3, 3)), start) is None
    assert fit_cone(np.full((50, 3), np.nan), start) is None
