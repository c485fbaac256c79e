"""Clouds whose coordinates lie on a lattice: each axis' step is found, and is part of the error."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
from synthetic_cloud import plot_cloud

from treedgs_geo.cli import main
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import write_cloud
from treedgs_geo.stems.cloud.estimate.rounding import lattice_steps

STEMS = [(3.0, 3.0, 25.0), (8.0, 8.0, 35.0), (3.5, 8.5, 20.0), (9.0, 3.5, 30.0)]


@pytest.fixture(scope="module")
def xyz():
    return plot_cloud(np.random.default_rng(1), STEMS, bark=3000)


def through_floats(xyz, east=425000.0, north=3718000.0):
    return (xyz + (east, north, 0)).astype(np.float32).astype(float) - (east, north, 0)


def test_steps_are_those_of_each_axis(xyz):
    assert lattice_steps(through_floats(xyz)) == pytest.approx([0.03125, 0.25, 0.0], abs=0.001)
    assert lattice_steps(np.round(xyz, 2))[:2] == pytest.approx(0.01)
    assert lattice_steps(np.round(xyz / 0.05) * 0.05) == pytest.approx(0.05)
    assert lattice_steps(np.round(xyz, 3)).max() <= 0.001 and lattice_steps(xyz[:300]).max() == 0
    assert lattice_steps(xyz[:1]).tolist() == [0, 0, 0]


@pytest.mark.parametrize(
    ("change", "said", "flags"),
    [
        (through_floats, "25.0 cm in y", {"reject"}),
        (lambda xyz: np.round(xyz / 0.1) * 0.1, "10.0 cm in x", {"check", "reject"}),
        (lambda xyz: np.round(xyz, 2), "", {"ok"}),
    ],
)
def test_no_stem_on_a_coarse_lattice_is_ok(xyz, tmp_path, capsys, change, said, flags):
    write_cloud(tmp_path / "c.laz", PointCloud(change(xyz)))
    out = tmp_path / "t.gpkg"
    words = ["pointcloud-to-dbh", "--input", str(tmp_path / "c.laz"), "--crs", "local", "--output", str(out)]
    assert main([*words, "--log-format", "plain"]) == 0
    warned = capsys.readouterr().err
    assert said in warned and ("lattice" in warned) == bool(said)
    assert set(gpd.read_file(out, layer="trees")["qc_flag"]) <= flags
