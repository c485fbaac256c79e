"""Dense noisy clouds, as mobile scanners make them: no stem is lost by being seen better."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_cloud import stem_points

from treedgs_geo.pointcloud.cloud import PointCloud, thin
from treedgs_geo.stems.cloud.estimate.cloud import measure_cloud
from treedgs_geo.stems.cloud.propose.segment import find_stems
from treedgs_geo.terrain.ground import dtm_from_cloud
from treedgs_lab.benchmarks.clouds.mobile_clouds import MobileScan, ground, mobile_cloud, stem


def nearest(trees, place):
    return min(trees, key=lambda tree: np.hypot(tree.x - place[0], tree.y - place[1]))


@pytest.mark.parametrize("noise_m, drift_m", [(0.015, 0.010), (0.02, 0.015)])
def test_more_points_give_no_fewer_stems(noise_m, drift_m):
    """Full rings in bark as thick as SLAM makes it: all are found at every density, and nothing else is ``ok``."""
    cloud = mobile_cloud(
        21,
        MobileScan(
            stems=8,
            size_m=8.5,
            noise_m=noise_m,
            drift_m=drift_m,
            bark=16_000,
            dbh_cm=(13.0, 30.0),
            saplings=4,
            shrubs=8,
        ),
    )
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
    clean, thick = (
        mobile_cloud(23, MobileScan(stems=4, size_m=6.0, noise_m=noise, drift_m=0.0, bark=8000, saplings=0, shrubs=2))
        for noise in (0.004, 0.02)
    )
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
    kept = thin(xyz + 1000.0, 0.5, 1000)
    assert np.count_nonzero(kept < 20_000) == 1000 and np.count_nonzero(kept >= 20_000) == 50
    assert 80 < np.count_nonzero(marked[kept]) < 130 and (np.diff(kept) > 0).all()
    assert len(thin(np.empty((0, 3)), 0.5, 10)) == 0


def test_half_rings_of_a_single_scan_are_measured():
    cloud = mobile_cloud(
        25,
        MobileScan(
            stems=6,
            size_m=7.5,
            noise_m=0.005,
            drift_m=0.0,
            walks=1,
            seen_deg=155.0,
            ghosts=0.005,
            bark=12_000,
            saplings=2,
            shrubs=4,
        ),
    )
    for share in (1.0, 0.25):
        xyz = cloud.thinned(share)
        trees, _ = measure_cloud(PointCloud(xyz), dtm_from_cloud(xyz))
        inside = 0
        for x, y, dbh in cloud.trees:
            tree = nearest(trees, (x, y))
            assert np.hypot(tree.x - x, tree.y - y) < 0.05 and tree.dbh_cm == pytest.approx(dbh, abs=2.0)
            assert tree.arc_deg <= 210
            inside += tree.dbh_lo_cm <= dbh <= tree.dbh_hi_cm
        assert inside >= 4


def test_what_stands_out_and_cannot_be_measured_is_listed():
    """A stem of 8 cm in noise of 2.5 cm, and a sliver of bark: refused, with the reason. Shrubs are not listed."""
    scan = MobileScan(
        stems=6, size_m=8.0, noise_m=0.025, drift_m=0.005, bark=12_000, saplings=2, shrubs=8, dbh_cm=(18.0, 30.0)
    )
    cloud = mobile_cloud(27, scan)
    rng = np.random.default_rng(1)
    thin = stem(rng, np.array([9.5, 2.0]), 9.0, scan)
    floor = rng.uniform((8, 0), (11, 8), (9000, 2))
    xyz = np.concatenate([cloud.xyz, thin, np.column_stack([floor, ground(floor) + rng.normal(0, 0.02, 9000)])])
    trees, _ = measure_cloud(PointCloud(xyz), dtm_from_cloud(xyz))
    tree = nearest(trees, (9.5, 2.0))
    assert np.hypot(tree.x - 9.5, tree.y - 2.0) < 0.1 and tree.qc_flag == "reject"
    assert tree.qc_reason.split(",")[0] in ("too_small", "occluded")
    assert sum(tree.qc_flag == "reject" for tree in trees) <= 2


@pytest.mark.parametrize("fork_m, spread", [(1.8, 0.2), (2.2, 0.15), (2.5, 0.2), (3.0, 0.1)])
@pytest.mark.parametrize("per_m", [3000, 400])
def test_a_fork_above_breast_height_is_one_tree(fork_m, spread, per_m):
    rng = np.random.default_rng(1)
    floor = rng.uniform(0, 6, (8000, 2))
    parts = [
        np.column_stack([floor, rng.normal(0, 0.01, 8000)]),
        stem_points(rng, 30.0, int(per_m * fork_m), 0.008, high=fork_m, xy=(3, 3), low=0.1),
    ]
    for side in (-1, 1):
        parts.append(
            stem_points(
                rng,
                20.0,
                int(0.66 * per_m * (9 - fork_m)),
                0.008,
                low=fork_m - 0.1,
                high=9.0,
                lean=(side * spread, 0.03),
                taper_cm_m=0.8,
                xy=(3 + side * (0.09 - spread * (fork_m - 1.37)), 3),
            )
        )
    xyz = np.concatenate([*parts, np.column_stack([rng.normal(3, 1, (3000, 2)), rng.uniform(9, 14, 3000)])])
    trees, _ = measure_cloud(PointCloud(xyz), dtm_from_cloud(xyz))
    assert len(trees) == 1 and trees[0].dbh_cm == pytest.approx(30.0, abs=0.8)
