"""Points metres below the ground are left out and said; slopes, ditches and cut-out trees keep theirs."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_cloud import plot_cloud

from treedgs_geo.core.progress import Collector, Reporter
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.run.cloud_input import checked
from treedgs_geo.terrain.cloud_ground import own_ground
from treedgs_geo.terrain.low_noise import low_noise

STEMS = [(3.0, 3.0, 20.0), (8.0, 5.0, 30.0), (4.0, 9.0, 25.0), (10.0, 10.0, 18.0)]
SLOPE = 0.4


def plot(relief=lambda xy: SLOPE * xy[:, 0]):
    return plot_cloud(np.random.default_rng(1), STEMS, per_m2=200, shrubs=1500, relief=relief)


def below(xyz, share, depth, layer):
    rng = np.random.default_rng(2)
    xy = rng.uniform(0, 12, (int(share * len(xyz)), 2))
    down = np.full(len(xy), depth) if layer else rng.uniform(1.2, depth, len(xy))
    return np.column_stack([xy, 100 + SLOPE * xy[:, 0] + 0.1 * np.sin(xy[:, 1] / 3) - down])


@pytest.mark.parametrize("layer", [False, True])
@pytest.mark.parametrize(("share", "depth"), [(0.001, 5.0), (0.003, 20.0), (0.01, 2.0), (0.01, 10.0), (0.03, 5.0)])
def test_the_ground_does_not_follow_points_below_it(share, depth, layer):
    xyz = plot()
    heard = Collector(Reporter())
    cloud, _ = checked(PointCloud(np.vstack([xyz, below(xyz, share, depth, layer)])), "a.laz", heard, crs="local")
    assert ("below the ground" in " ".join(heard.warnings)) or share <= 0.001
    assert np.isin(xyz[:, 0], cloud.xyz[:, 0]).all()
    x, y = np.meshgrid(np.arange(1, 12), np.arange(1, 12))
    off = own_ground(cloud.xyz, None).dtm.height(x, y) - own_ground(xyz, None).dtm.height(x, y)
    assert np.nanmax(np.abs(off)) < 0.05


@pytest.mark.parametrize(
    "relief",
    [
        lambda xy: 0 * xy[:, 0],
        lambda xy: 1.2 * xy[:, 0],
        lambda xy: 1.5 * np.floor(xy[:, 0] / 3),  # terraces
        lambda xy: 0.4 * np.sin(4 * xy[:, 0]) * np.sin(3 * xy[:, 1]),
        lambda xy: -1.2 * np.clip((0.5 - np.abs(xy[:, 0] - 6)) / 0.2, 0, 1),  # a ditch
    ],
)
def test_no_ground_is_left_out(relief):
    assert low_noise(plot(relief))[0].mean() <= 0.001


def test_half_a_cut_out_tree_is_no_noise():
    rng = np.random.default_rng(3)
    butt = rng.uniform((0, 0, 0), (6, 6, 12), (4000, 3))
    floor = np.column_stack([rng.uniform(0, 6, (9000, 2)), rng.normal(14, 0.02, 9000)])
    assert not low_noise(np.vstack([butt, floor]))[0].any()
