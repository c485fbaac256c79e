"""PLY out: what programs without LAS read, CloudCompare of Debian among them."""

from __future__ import annotations

import laspy
import numpy as np
import pyproj
import pytest
from synthetic_cloud import plot_cloud

import treedgs_geo as tg
from treedgs_geo.pointcloud import stream

NUMPY = {"double": "<f8", "float": "<f4", "int": "<i4", "uint": "<u4", "ushort": "<u2", "uchar": "<u1", "short": "<i2"}


def read_ply(path):
    head, _, body = path.read_bytes().partition(b"end_header\n")
    lines = [line.split() for line in head.decode().splitlines()]
    assert lines[:2] == [["ply"], ["format", "binary_little_endian", "1.0"]]
    rows = np.frombuffer(body, [(line[2], NUMPY[line[1]]) for line in lines if line[0] == "property"])
    assert [["element", "vertex", str(len(rows))]] == [line for line in lines if line[0] == "element"]
    return rows


@pytest.fixture
def cloud():
    xyz = plot_cloud(np.random.default_rng(5), [(3, 3, 20.0), (8, 5, 30.0)]) + (611300.0, 3718400.0, 0.0)
    named = {
        "tree_id": np.arange(len(xyz)),
        "seen": np.arange(len(xyz)) % 2 == 0,
        "two words": np.ones(len(xyz), "<f4"),
    }
    return tg.PointCloud(xyz, pyproj.CRS.from_epsg(32615), named)


def test_coordinates_and_attributes_are_exact(tmp_path, cloud):
    tg.write_cloud(tmp_path / "all.ply", cloud)
    rows = read_ply(tmp_path / "all.ply")
    np.testing.assert_array_equal(np.column_stack([rows[axis] for axis in "xyz"]), cloud.xyz)
    for name, values in cloud.attributes.items():
        np.testing.assert_array_equal(rows["scalar_" + name.replace(" ", "_")], values)


def test_colours_are_those_of_viewers(tmp_path):
    for given in (200, 200 * 256):
        colours = dict.fromkeys(("red", "green", "blue"), np.array([0, given], np.uint16))
        tg.write_cloud(tmp_path / "c.ply", tg.PointCloud(np.zeros((2, 3)), attributes=colours))
        assert read_ply(tmp_path / "c.ply")["green"].tolist() == [0, 200]


def test_stems_as_ply_are_those_of_laz(tmp_path, cloud, monkeypatch):
    monkeypatch.setattr(stream, "_CHUNK", 5000)
    tg.write_cloud(tmp_path / "in.laz", cloud)
    for ending in ("ply", "laz"):
        found = tg.segment_stems(input=tmp_path / "in.laz", output=tmp_path / f"stems.{ending}")
        assert found.n_stems == 2
    rows, las = read_ply(tmp_path / "stems.ply"), laspy.read(tmp_path / "stems.laz")
    for name in ("tree_id", "height_m", "stem_class", "ground_se_m", "seen"):
        np.testing.assert_array_equal(rows[f"scalar_{name}"], las[name])
    np.testing.assert_array_equal(np.column_stack([rows[axis] for axis in "xyz"]), las.xyz)
    tg.segment_stems(input=tmp_path / "in.laz", output=tmp_path / "stems.ply", source="uls")  # ours: written over
