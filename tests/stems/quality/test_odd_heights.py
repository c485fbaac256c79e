"""Heights in feet are flagged, slender stands are not."""

from __future__ import annotations

import numpy as np
import pytest

from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.stems.quality.odd_heights import mark_odd_heights
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.terrain.ground import flat_ground


@pytest.mark.parametrize(
    ("dbh_cm", "height_m", "odd"),
    [
        (9.0, 15.7, False),  # bamboo
        (7.0, 9.0, False),  # a thicket of poles
        (9.0, 9.0 / 0.3048, True),
        (12.0, 11.0 / 0.3048, True),
        (25.0, 18.0, False),
        (25.0, 18.0 / 0.3048, True),
    ],
)
def test_thin_stems_may_be_slender_and_none_is_as_tall_as_in_feet(dbh_cm, height_m, odd):
    trees = [
        Tree(k, float(k), 0.0, dbh_cm=dbh_cm, dbh_se_cm=0.5, height_m=height_m, method="").finish() for k in range(8)
    ]
    xyz = np.random.default_rng(0).uniform((0, 0, 0), (10, 10, 12), (2000, 3))
    assert mark_odd_heights(trees, PointCloud(xyz), flat_ground(xyz)) == odd
    assert {tree.qc_flag for tree in trees} == {"check" if odd else "ok"}
