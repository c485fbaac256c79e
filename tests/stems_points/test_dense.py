"""Dense noisy clouds, as mobile scanners make them: no stem is lost by being seen better."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from treedgs_geo.measure.cloud import measure_cloud
from treedgs_geo.pointcloud.cloud import PointCloud, thin_crowded
from treedgs_geo.stems.segment import find_stems
from treedgs_geo.terrain.ground import dtm_from_cloud

sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))
from mobile_clouds import MobileScan, mobile_cloud  # noqa: E402


def nearest(trees, place):
    return min(trees, key=lambda tree: np.hypot(tree.x - place[0], tree.y - place[1]))


@pytest.mark.parametrize("noise_m, drift_m", [(0.015, 0.010), (0.02, 0.015)])
def test_more_points_give_no_fewer_stems(noise_m, drift_m):
    """Full rings in bark as thick as SLAM makes it: all are found at every density, and nothing else is ``ok``."""
    cloud = mobile_cloud(21, MobileScan(stems=8, size_m=8.5, noise_m=noise_m, drift_m=drift_m, bark=16_000,
                                        dbh_cm=(13.0, 30.0), saplings=4, shrubs=8))
    for share in (1.0, 0.25, 1 / 16):
        xyz = cloud.thinned(share)
        trees, _ = measure_cloud(PointCloud(xyz), dtm_from_cloud(xyz))
        inside = 0
        for x, y, dbh in cloud.trees:
            tree = nearest(trees, (x, y))
            assert np.hypot(tree.x - x, tree.y - y) < 0.05 and tree.dbh_cm == pytest.approx(dbh, abs=3.5), share
            inside += tree.dbh_lo_cm <= dbh <= tree.dbh_hi_cm
        assert inside >= 6
        assert sum(tree.qc_flag == "ok" for tree in trees) <= len(cloud.trees)


def test_the_noise_is_the_clouds_own_whatever_its_density():
    clean, thick = (mobile_cloud(23, MobileScan(stems=4, size_m=6.0, noise_m=noise, drift_m=0.0, bark=8000, saplings=0,
                                                shrubs=2)) for noise in (0.004, 0.02))
    for cloud, low, high in ((clean, 0.010, 0.0101), (thick, 0.018, 0.023)):
        for share in (1.0, 0.25):
            xyz = cloud.thinned(share)
            stems = find_stems(PointCloud(xyz), dtm_from_cloud(xyz)).stems
            assert len(stems) == 4 and all(stem.noise_m and low <= stem.noise_m <= high for stem in stems)


def test_crowded_voxels_keep_their_proportions():
    """A ghost among two hundred points on the bark stays one in two hundred."""
    rng = np.random.default_rng(0)
    xyz = np.concatenate([rng.uniform(0, 0.4, (20_000, 3)), rng.uniform(1, 1.4, (50, 3))])
    marked = rng.random(len(xyz)) < 0.1
    kept = thin_crowded(xyz + 1000.0, 0.5, 1000)
    assert np.count_nonzero(kept < 20_000) == 1000 and np.count_nonzero(kept >= 20_000) == 50
    assert 80 < np.count_nonzero(marked[kept]) < 130 and (np.diff(kept) > 0).all()
    assert len(thin_crowded(np.empty((0, 3)), 0.5, 10)) == 0
