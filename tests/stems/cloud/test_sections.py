"""The stem curve: sections of known stems, their errors, where it ends, and its layer."""

from __future__ import annotations

import json

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from shared_data import SHARED, needs_shared
from synthetic_cloud import stem_points

from treedgs_geo.cli import main
from treedgs_geo.stems.cloud.estimate.sections import sections_of

BH = 1.37


@pytest.mark.parametrize("noise, count", [(0.004, 20_000), (0.012, 900)])
@pytest.mark.parametrize("lean", [(0.0, 0.0), (0.12, -0.08)])
@pytest.mark.parametrize("dbh_cm", [14.0, 44.0])
def test_a_known_stem(noise, count, lean, dbh_cm):
    """Dense scan and drone LiDAR: every half metre, within its 90 % interval, along a lean."""
    points = stem_points(np.random.default_rng(1), dbh_cm, count, noise, lean=lean, low=0.2, high=9.0)
    found = sections_of(points, dbh_cm, BH)
    heights = np.array([section.height for section in found])
    assert len(found) >= 13 and np.allclose(heights % 0.5, 0) and heights[0] == 0.5 and heights[-1] >= 7.0
    off = np.array([200 * section.radius for section in found]) - (dbh_cm - (heights - BH))
    errors = np.array([section.se_cm for section in found])
    assert np.mean(np.abs(off) < 1.645 * errors) >= 0.9 and np.sqrt(np.mean(off**2)) < 0.5
    centres = np.array([section.centre for section in found])
    np.testing.assert_allclose(centres, np.outer(heights - BH, lean), atol=0.03)


def test_it_goes_on_over_a_whorl_and_ends_in_the_crown():
    rng = np.random.default_rng(2)
    points = stem_points(rng, 30, 12_000, 0.005, low=0.2, high=12.0)
    points = points[(points[:, 2] < 4.2) | (points[:, 2] > 5.1)]  # two sections are hidden
    crown = np.column_stack([rng.normal(0, 0.5, (20_000, 2)), rng.uniform(8, 16, 20_000)])
    bare = points[points[:, 2] < 8]
    found = sections_of(np.vstack([bare, crown]), 30, BH)
    heights = [section.height for section in found]
    assert 3.5 in heights and 5.5 in heights and 7.5 in heights and max(heights) < 9.0


def test_foliage_about_a_stem_makes_it_no_thicker():
    rng = np.random.default_rng(3)
    bare = stem_points(rng, 40, 8_000, 0.005, low=0.2, high=6.0)
    h = rng.uniform(6, 14, 20_000)
    radius = 0.2 + 0.02 * (h - 6) + rng.normal(0, 0.01, len(h))
    angle = rng.uniform(0, 2 * np.pi, len(h))
    sleeve = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), h])
    found = sections_of(np.vstack([bare, sleeve]), 40, BH)
    assert max(section.height for section in found) < 8 and max(200 * section.radius for section in found) < 43


def test_half_a_ring_and_few_points_give_no_section():
    rng = np.random.default_rng(4)
    assert sections_of(stem_points(rng, 30, 4000, 0.005, arc_deg=100), 30, BH) == []
    assert sections_of(stem_points(rng, 30, 30, 0.005), 30, BH) == []
    assert sections_of(np.empty((0, 3)), 30, BH) == []


def test_the_layer_of_a_plot_with_truth(tmp_path):
    """Shared plot H, simulated drone LiDAR: against its profiles to 8 m; stems that are flagged may be off."""
    needs_shared("plot_h")
    out = tmp_path / "trees.gpkg"
    cloud = SHARED / "plot_h" / "lidar" / "plot_h_uls.laz"
    assert main(["pointcloud-to-dbh", "--input", str(cloud), "--output", str(out), "--sheets", "none"]) == 0
    trees, sections = gpd.read_file(out, layer="trees"), gpd.read_file(out, layer="sections")
    assert set(sections["tree_id"]) <= set(trees.loc[trees["dbh_cm"].notna(), "tree_id"])
    truth = pd.read_csv(SHARED / "plot_h" / "truth" / "trees.csv").set_index("tree_id")
    profiles = json.loads((SHARED / "plot_h" / "truth" / "stems.json").read_text())["stems"]
    off, errors = [], []
    for tree in trees[trees["qc_flag"] == "ok"].itertuples():
        away = np.hypot(truth["E_bh"] - tree.x, truth["N_bh"] - tree.y)
        own = sections[(sections["tree_id"] == tree.tree_id) & (sections["height_m"] <= 8)]
        if away.min() > 0.5 or away.idxmin() not in profiles:
            continue
        profile = np.array(profiles[away.idxmin()])
        off += (own["d_cm"] - np.interp(own["height_m"], profile[:, 0], profile[:, 1])).tolist()
        errors += own["d_se_cm"].tolist()
    off, errors = np.array(off), np.array(errors)
    assert len(off) > 500 and np.mean(np.abs(off) < 1.645 * errors) > 0.88 and np.sqrt(np.mean(off**2)) < 0.8
