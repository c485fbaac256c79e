"""Clouds whose z is height above ground: with and without their ground, crowns and neighbours, by the commands."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
from shared_data import needs_shared
from synthetic_cloud import plot_cloud, stem_points

from treedgs_geo.cli import main
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud, write_cloud
from treedgs_geo.terrain.cloud_ground import lowest_height
from treedgs_geo.terrain.dtm import write_dtm
from treedgs_geo.terrain.ground import dtm_from_cloud, flat_ground

STEMS = [(3.0, 3.0, 25.0), (8.0, 8.0, 35.0), (3.5, 8.5, 20.0), (9.0, 3.5, 30.0)]


def height(xyz, slope):
    return xyz[:, 2] - 100 - slope * xyz[:, 0] - 0.1 * np.sin(xyz[:, 1] / 3)


@pytest.fixture(scope="module")
def normalised():
    """A plot on a slope of 30 %, its ground taken off from z."""
    xyz = plot_cloud(np.random.default_rng(1), STEMS, bark=2000, slope=0.3)
    return np.column_stack([xyz[:, :2], height(xyz, 0.3)])


def measured(tmp_path, xyz, *more, code=0):
    write_cloud(tmp_path / "cloud.laz", PointCloud(xyz))
    out = tmp_path / "trees.gpkg"
    words = ["pointcloud-to-dbh", "--input", tmp_path / "cloud.laz", "--output", out, "--crs", "local", *more]
    assert main([*map(str, words), "--log-format", "plain"]) == code
    return gpd.read_file(out, layer="trees") if code == 0 else None


@pytest.mark.parametrize("cut", [0.1, 0.3, 0.5, 0.9])
@pytest.mark.parametrize("top", [7.0, 99.0])
def test_a_plot_without_its_ground_is_measured_as_with_it(normalised, tmp_path, cut, top):
    xyz = normalised[(normalised[:, 2] > cut) & (normalised[:, 2] < top)]
    table = measured(tmp_path, xyz)
    away = np.hypot(*(table[["x", "y"]].to_numpy()[:, None] - [stem[:2] for stem in STEMS]).transpose(2, 0, 1))
    table = table.iloc[away.argmin(axis=0)]
    assert away.min(axis=0).max() < 0.3 and (table["qc_flag"] == "ok").all()
    np.testing.assert_allclose(table["dbh_cm"], [stem[2] for stem in STEMS], atol=0.6)


def test_what_z_is_can_be_said(normalised, tmp_path, capsys):
    xyz = normalised[normalised[:, 2] > 0.5]
    assert "z is taken as height above ground" in (measured(tmp_path, xyz) is not None and capsys.readouterr().err)
    table = measured(tmp_path, xyz, "--z-is", "elevation")
    assert not (table["qc_flag"] == "ok").any()
    table = measured(tmp_path, xyz, "--z-is", "height")
    assert (table["qc_flag"] == "ok").sum() >= 4
    measured(tmp_path, xyz + (0, 0, 250), "--z-is", "height", code=2)
    assert "the ground at z = 0 (--z-is height)" in capsys.readouterr().err


def test_a_single_tree_with_a_flat_terrain_model(tmp_path):
    """Its crown is all that most of the ground has above it."""
    rng = np.random.default_rng(2)
    stem = stem_points(rng, 25.0, 20_000, 0.004, low=0.3, high=9.0, taper_cm_m=0.9)
    crown = np.column_stack([rng.normal(0, 1.5, (4000, 2)), rng.uniform(6, 14, 4000)])
    xyz = np.concatenate([stem, crown]) + (5, 5, 0)
    write_dtm(tmp_path / "flat.tif", flat_ground(xyz, None, 0.0))
    for more in ((), ("--dtm", tmp_path / "flat.tif")):
        table = measured(tmp_path, xyz, *more)
        assert list(table["qc_flag"]) == ["ok"] and table["dbh_cm"][0] == pytest.approx(25.0, abs=0.5)


def test_large_clouds_are_told_the_same(normalised, tmp_path, monkeypatch):
    monkeypatch.setattr("treedgs_geo.terrain.thinned.WHOLE_CLOUD_POINTS", 1000)
    write_cloud(tmp_path / "cloud.laz", PointCloud(normalised[normalised[:, 2] > 0.5]))
    words = ["segment-stems", "--input", str(tmp_path / "cloud.laz"), "--crs", "local", "--log-format", "quiet"]
    assert main([*words, "--output", str(tmp_path / "stems.laz")]) == 0
    found = read_cloud(tmp_path / "stems.laz", crs="local")
    np.testing.assert_allclose(found.attributes["height_m"], found.xyz[:, 2], atol=0.01)
    assert found.attributes["ground_se_m"].max() == pytest.approx(0.1)


def test_other_clouds_are_not_taken_for_normalised(normalised):
    assert lowest_height(normalised) is not None
    # A slope in local heights from zero on; a clip far above the ground; elevations.
    slope = np.column_stack([normalised[:, :2], normalised[:, 2] + 0.3 * normalised[:, 0]])
    assert lowest_height(slope[slope[:, 2] - 0.3 * slope[:, 0] > 0.3]) is None
    assert lowest_height(normalised[normalised[:, 2] > 1.5]) is None
    assert lowest_height(normalised + (0, 0, 250)) is None


def test_a_real_plot(tmp_path):
    folder = needs_shared("lidar_treels")
    cloud = read_cloud(folder / "pine_plot.laz", crs="local")
    whole = measured(tmp_path, cloud.xyz)
    xyz = cloud.xyz - [0, 0, 1] * dtm_from_cloud(cloud.xyz).height(*cloud.xyz[:, :2].T)[:, None]
    table = measured(tmp_path, xyz[xyz[:, 2] > 0.3])
    both = table[table["dbh_cm"].notna()]
    assert (both["qc_flag"] == "ok").sum() >= (whole["qc_flag"] == "ok").sum() - 1
    for tree in both.itertuples():
        near = whole.iloc[np.hypot(whole["x"] - tree.x, whole["y"] - tree.y).argmin()]
        assert near["dbh_cm"] == pytest.approx(tree.dbh_cm, abs=0.4)
