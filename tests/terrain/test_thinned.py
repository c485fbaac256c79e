"""A large cloud is read without the points that measuring does not need: the stems stay as they are."""

from __future__ import annotations

import numpy as np
import pyproj
import pytest
from listener import Listener
from synthetic_cloud import plot_cloud

from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud, write_cloud
from treedgs_geo.run.cloud_input import read_checked
from treedgs_geo.stems.cloud.estimate.cloud import measure_cloud
from treedgs_geo.terrain import thinned
from treedgs_geo.terrain.ground import dtm_from_cloud, height_above_ground
from treedgs_geo.terrain.thinned import LAYER_M, read_thinned

STEMS = [(3.0, 3.0, 18.0), (9.0, 3.0, 26.0), (3.0, 9.0, 34.0), (9.0, 9.0, 22.0)]


@pytest.fixture(scope="module")
def dense(tmp_path_factory):
    """2,000 ground points a square metre on a slope of 30 %, and as many bark points a stem."""
    rng = np.random.default_rng(3)
    xyz = plot_cloud(rng, STEMS, slope=0.3, per_m2=2000, bark=2000) + (611300.0, 3718400.0, 0.0)
    path = tmp_path_factory.mktemp("dense") / "dense.laz"
    zero = np.zeros(len(xyz))
    write_cloud(path, PointCloud(xyz, pyproj.CRS.from_epsg(32615), {"gps_time": zero, "intensity": zero + 7}))
    return path


def test_the_stem_band_is_whole_and_the_ground_is_thinned(dense):
    cloud, thinned = read_cloud(dense), read_thinned(dense, None, ("gps_time", "intensity"), True)
    dtm = dtm_from_cloud(cloud.xyz)
    height, kept = height_above_ground(cloud.xyz, dtm), height_above_ground(thinned.xyz, dtm)
    band = [(h > LAYER_M + 0.1) & (h < 8.0) for h in (height, kept)]
    assert band[0].sum() == band[1].sum() > 6000
    ground = [np.abs(h) < 0.1 for h in (height, kept)]
    assert 0.15 < ground[1].sum() / ground[0].sum() < 0.3
    assert "gps_time" not in thinned.attributes and (thinned.attributes["intensity"] == 7).all()


def test_diameters_are_those_of_all_points(dense):
    found = []
    for cloud in (read_cloud(dense), read_thinned(dense, None, (), True)):
        trees, _ = measure_cloud(cloud, dtm_from_cloud(cloud.xyz))
        found.append(sorted((tree.dbh_cm, tree.qc_flag) for tree in trees))
    assert [flag for _, flag in found[0]] == [flag for _, flag in found[1]] == ["ok"] * 4
    assert np.abs(np.subtract([d for d, _ in found[0]], [d for d, _ in found[1]])).max() < 0.1


def test_only_large_clouds_are_thinned(dense, monkeypatch):
    said = Listener()
    whole, _ = read_checked(dense, None, said, ("intensity",))
    monkeypatch.setattr(thinned, "WHOLE_CLOUD_POINTS", 100_000)
    assert len(read_checked(dense, None, said, ("intensity",))[0]) < 0.6 * len(whole)
    assert len(read_checked(dense, None, said)[0]) == len(whole)


@pytest.mark.parametrize("coarse", [False, True])
def test_the_returns_of_a_pulse_stay_together(tmp_path, coarse):
    rng = np.random.default_rng(5)
    xy, ground = rng.uniform(0, 6, (60_000, 2)), rng.uniform(0, 6, (20_000, 2))
    first = np.column_stack([xy, rng.uniform(18.0, 24.0, len(xy))])
    crowns = np.stack([first, first - (0.0, 0.0, 2.0)], axis=1).reshape(-1, 3)
    xyz = np.concatenate([crowns, np.column_stack([ground, rng.normal(0, 0.01, len(ground))])])
    pulse = np.r_[np.repeat(np.arange(len(xy)), 2), len(xy) + np.arange(len(ground))]
    number = np.r_[np.tile([1, 2], len(xy)), np.ones(len(ground), int)].astype(np.uint8)
    time = np.floor(pulse / 500) if coarse else 3e8 + pulse * 4e-6
    cloud = PointCloud(xyz + (611300.0, 3718400.0, 0.0), pyproj.CRS.from_epsg(32615), {"gps_time": time})
    write_cloud(tmp_path / "crowns.laz", cloud.with_attribute("return_number", number).with_attribute("pulse", pulse))
    kept = read_thinned(tmp_path / "crowns.laz", None, ("gps_time", "return_number", "pulse"), True)
    # What lies beside the top of its cell, or at the edge of crowns, is kept for its height.
    crown = (kept.xyz[:, 2] > 16.0) & (kept.xyz[:, 2] < 22.0)
    count = np.bincount(kept.attributes["pulse"][crown], minlength=len(xy))[: len(xy)]
    whole = (first[:, 2] > 18.1) & (first[:, 2] < 21.9)
    assert 0.15 < (count[whole] > 0).mean() < 0.3
    assert (count[whole] != 1).all()
