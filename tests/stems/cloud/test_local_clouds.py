"""Scans in local metres: under a header that says otherwise, with ``--crs local``, and with a terrain model."""

from __future__ import annotations

import geopandas as gpd
import laspy
import numpy as np
import pyproj
import pytest
from synthetic_cloud import plot_cloud

from treedgs_geo.cli import main
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud, write_cloud
from treedgs_geo.terrain.dtm import write_dtm
from treedgs_geo.terrain.ground import dtm_from_cloud

STEMS = [(3.0, 3.0, 25.0), (8.0, 8.0, 35.0)]
UTM = pyproj.CRS.from_epsg(32633)


@pytest.fixture(scope="module")
def xyz():
    return plot_cloud(np.random.default_rng(1), STEMS, bark=600)


@pytest.fixture(scope="module")
def headed(xyz, tmp_path_factory):
    """Local metres under a UTM header."""
    path = tmp_path_factory.mktemp("headed") / "scan.laz"
    write_cloud(path, PointCloud(xyz, UTM))
    return path


def measured(out, *words):
    assert main([*map(str, words), "--output", str(out), "--log-format", "plain"]) == 0
    table = gpd.read_file(out, layer="trees").sort_values("x")
    np.testing.assert_allclose(table["dbh_cm"], [stem[2] for stem in STEMS], atol=1.0)
    return table


def test_a_header_that_contradicts_local_coordinates_is_named_and_set_aside(headed, tmp_path, capsys):
    table = measured(tmp_path / "trees.gpkg", "pointcloud-to-dbh", "--input", headed)
    said = capsys.readouterr().err
    assert "its header says WGS 84 / UTM zone 33N" in said and "set aside" in said and str(headed) in said
    assert not table.crs.is_projected
    assert main(["pointcloud-to-dbh", "--input", str(headed), "--output", str(tmp_path / "o.gpkg"), "--dry-run",
                 "true", "--log-format", "plain"]) == 0  # fmt: skip
    assert "set aside" in capsys.readouterr().err


@pytest.mark.parametrize("large", [False, True])
def test_local_wins_over_a_header_for_every_verb(large, xyz, headed, tmp_path, capsys, monkeypatch):
    if large:
        monkeypatch.setattr("treedgs_geo.terrain.thinned.WHOLE_CLOUD_POINTS", 1000)
    stems = tmp_path / "stems.laz"
    for verb, out in (("segment-stems", stems), ("terrain", tmp_path / "dtm.tif")):
        assert (
            main([verb, "--input", str(headed), "--crs", "local", "--output", str(out), "--log-format", "plain"]) == 0
        )
    assert "set aside" not in capsys.readouterr().err
    with laspy.open(stems) as file:
        assert file.header.parse_crs() is None
    assert read_cloud(headed, crs="LOCAL").crs is None
    measured(tmp_path / "steps.gpkg", "measure-dbh", "--input", stems, "--crs", "local")
    measured(tmp_path / "trees.gpkg", "pointcloud-to-dbh", "--input", headed, "--crs", "local")
    # A header is right where its coordinates can be: local is the user's word all the same.
    there = tmp_path / "there.laz"
    write_cloud(there, PointCloud(xyz + (500000, 5400000, 0), UTM))
    out = tmp_path / "there.gpkg"
    assert main(["pointcloud-to-dbh", "--input", str(there), "--crs", "local", "--output", str(out)]) == 0
    assert not gpd.read_file(out, layer="trees").crs.is_projected


@pytest.mark.parametrize("dtm_crs", [None, UTM])
@pytest.mark.parametrize("place", ["local", "map"])
def test_a_terrain_model_is_enough_for_a_cloud_without_a_crs(dtm_crs, place, xyz, tmp_path):
    xyz = xyz + (500000, 5400000, 0) if place == "map" else xyz
    write_cloud(tmp_path / "scan.laz", PointCloud(xyz))
    dtm = tmp_path / "dtm.tif"
    write_dtm(dtm, dtm_from_cloud(xyz, crs=dtm_crs))
    table = measured(tmp_path / "trees.gpkg", "pointcloud-to-dbh", "--input", tmp_path / "scan.laz", "--dtm", dtm)
    # On the map the model says where; a local scan stays local, whatever its model's header says.
    assert table.crs.is_projected == (dtm_crs is not None and place == "map")


def test_a_file_without_crs_and_with_local_coordinates_is_local(xyz, tmp_path, capsys):
    for name, moved in (("scan.laz", (0.0, 0.0, 0.0)), ("map.laz", (500_000.0, 5_000_000.0, 0.0))):
        write_cloud(tmp_path / name, PointCloud(xyz + moved))
    table = measured(tmp_path / "trees.gpkg", "pointcloud-to-dbh", "--input", tmp_path / "scan.laz")
    assert not table.crs.is_projected and "taken as local metres" in capsys.readouterr().err
    words = ["pointcloud-to-dbh", "--input", str(tmp_path / "map.laz"), "--output", str(tmp_path / "m.gpkg")]
    for more in ([], ["--dry-run", "true"]):
        assert main([*words, *more, "--log-format", "plain"]) == 2
        assert "map.laz: holds no CRS, expected a projected one" in capsys.readouterr().err
