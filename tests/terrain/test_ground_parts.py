"""A large cloud is worked on part by part: to the bit what it gives as a whole."""

from __future__ import annotations

import numpy as np
from synthetic_cloud import plot_cloud

from treedgs_geo.pointcloud import cloud as clouds
from treedgs_geo.pointcloud.cloud import PointCloud, concatenate, slices
from treedgs_geo.terrain import credibility, ground


def test_parts_make_no_difference(monkeypatch):
    xyz = plot_cloud(np.random.default_rng(1), [(4.0, 4.0, 30.0), (8.0, 7.0, 20.0)]) + [600000.0, 5.2e6, 0.0]

    def figures():
        dtm = ground.dtm_from_cloud(xyz)
        layer = credibility.GroundLayer.of(xyz, dtm)
        return dtm.heights, dtm.support, layer.ground, layer.above, ground.height_above_ground(xyz, dtm)

    whole = figures()
    for module in (ground, credibility):
        monkeypatch.setattr(module, "slices", lambda count: slices(count, 777))
    for one, other in zip(whole, figures(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_pieces_are_joined_in_their_order():
    xyz = np.random.default_rng(2).normal(size=(1000, 3))
    pieces = (PointCloud(xyz[part], attributes={"n": np.arange(1000)[part]}) for part in slices(1000, 130))
    joined = concatenate(pieces)
    np.testing.assert_array_equal(joined.xyz, xyz)
    np.testing.assert_array_equal(joined.attributes["n"], np.arange(1000))
    assert sum(part.stop - part.start for part in clouds.slices(10, 3)) == 10
