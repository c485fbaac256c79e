"""Heights in feet are flagged, slender stands are not."""

from __future__ import annotations

import numpy as np
import pyproj
import pytest

from treedgs_geo.core.progress import Collector, Reporter
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


@pytest.mark.parametrize(
    ("dbh_cm", "height_m", "said"),
    [
        (12.0, 14.0, False),
        (45.0, 38.0, False),  # old spruce
        (50.0, None, False),
        (98.0, 52.0, True),  # 30 cm and 16 m, in feet
        (59.0, 49.0, True),  # 18 cm and 15 m
        (85.0, None, True),  # 26 cm, cut off below the crowns
    ],
)
def test_a_cloud_that_names_no_unit_may_be_in_feet(dbh_cm, height_m, said):
    trees = [
        Tree(k, float(k), 0.0, dbh_cm=dbh_cm, dbh_se_cm=0.5, height_m=height_m, method="").finish() for k in range(8)
    ]
    xyz = np.random.default_rng(0).uniform((0, 0, 0), (10, 10, 12), (2000, 3))
    for crs in (None, pyproj.CRS.from_epsg(32617)):
        heard = Collector(Reporter())
        assert not mark_odd_heights(trees, PointCloud(xyz, crs), flat_ground(xyz), heard)
        assert ["0.3048" in warning for warning in heard.warnings] == [True] * (said and crs is None)
    assert {tree.qc_flag for tree in trees} == {"ok"}
