"""No ground, no breast height: clouds whose lowest metres are missing and DTMs that are not theirs, by the commands."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pyproj
import pytest
from synthetic_cloud import plot_cloud, stem_points

from treedgs_geo.cli import main
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import write_cloud
from treedgs_geo.stems.quality.ground import with_ground_error
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.terrain.dtm import Dtm, write_dtm
from treedgs_geo.terrain.ground import dtm_from_cloud

STEMS = [(3.0, 3.0, 25.0), (8.0, 8.0, 35.0), (3.5, 8.5, 20.0), (9.0, 3.5, 30.0)]
AT = np.array([500000.0, 4000000.0, 0.0])
UTM = pyproj.CRS.from_epsg(32615)


@pytest.fixture(scope="module")
def xyz():
    return plot_cloud(np.random.default_rng(1), STEMS, bark=600) + AT


@pytest.fixture(scope="module")
def whole(xyz, tmp_path_factory):
    return write(tmp_path_factory.mktemp("whole") / "plot.laz", xyz)


def write(path, xyz):
    write_cloud(path, PointCloud(xyz, UTM))
    return path


def height(xyz):
    x, y = (xyz[:, :2] - AT[:2]).T
    return xyz[:, 2] - 100 - 0.05 * x - 0.1 * np.sin(y / 3)


def read(output, *arguments):
    """The tree layer by the place of the stems, and what was said."""
    assert main([*map(str, arguments), "--output", str(output), "--log-format", "plain"]) == 0
    table = gpd.read_file(output, layer="trees")
    away = np.hypot(*(table[["x", "y"]].to_numpy()[:, None] - AT[:2] - [stem[:2] for stem in STEMS]).transpose(2, 0, 1))
    assert sorted(away.argmin(axis=1)) == [0, 1, 2, 3] and away.min(axis=1).max() < 0.3
    return table.iloc[away.argmin(axis=0)].reset_index(drop=True)


@pytest.mark.parametrize("cut", [0.5, 1.0, 2.0])
def test_a_cloud_without_its_lowest_metres_has_no_ok_tree(xyz, tmp_path, capsys, cut):
    cloud = write(tmp_path / "cut.laz", xyz[height(xyz) > cut])
    table = read(tmp_path / "trees.gpkg", "pointcloud-to-dbh", "--input", cloud)
    assert "shows no ground surface between the stems" in capsys.readouterr().err
    # How far below the stems' lowest points the ground lies is unknown: the interval says so.
    assert (table["qc_flag"] == "check").all() and table["qc_reason"].str.contains("no_ground").all()
    truth = np.array([stem[2] for stem in STEMS])
    assert (table["dbh_lo_cm"] < truth).all() and (table["dbh_hi_cm"] > truth).all()
    # By single steps: what is not known at the first step is not known at the second.
    stems = tmp_path / "stems.laz"
    assert main(["segment-stems", "--input", str(cloud), "--output", str(stems), "--log-format", "quiet"]) == 0
    steps = read(tmp_path / "steps.gpkg", "measure-dbh", "--input", stems)
    assert (steps["qc_flag"] == "check").all() and steps["qc_reason"].str.contains("no_ground").all()
    false = tmp_path / "false.tif"
    assert main(["terrain", "--input", str(cloud), "--output", str(false), "--log-format", "plain"]) == 0
    assert "shows no ground surface" in capsys.readouterr().err
    # With a DTM the stems are back.
    dtm = tmp_path / "dtm.tif"
    write_dtm(dtm, dtm_from_cloud(xyz, crs=UTM))
    table = read(tmp_path / "given.gpkg", "pointcloud-to-dbh", "--input", cloud, "--dtm", dtm)
    if cut < 2:
        np.testing.assert_allclose(table["dbh_cm"], [stem[2] for stem in STEMS], atol=1.0)


def test_stems_whose_feet_show_are_measured(tmp_path):
    """Ground filtered out, the stems whole down to their swell: breast height is known to some decimetres."""
    rng = np.random.default_rng(9)
    parts = []
    for x, y, dbh in STEMS:
        points = stem_points(rng, dbh, 12_000, 0.004, low=0.15, high=6.0, taper_cm_m=0.9)
        swell = 0.3 * dbh / 200 * np.exp(-points[:, 2] / 0.25)
        angle = np.arctan2(points[:, 1], points[:, 0])
        points[:, :2] += swell[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        parts.append(points + (x, y, 0.0) + AT)
    xyz = np.concatenate(parts)
    table = read(tmp_path / "feet.gpkg", "pointcloud-to-dbh", "--input", write(tmp_path / "feet.laz", xyz))
    assert (table["qc_flag"] == "ok").all()
    assert (table["dbh_lo_cm"] < [stem[2] for stem in STEMS]).all()
    assert (table["dbh_hi_cm"] > [stem[2] for stem in STEMS]).all()
    clipped = write(tmp_path / "clipped.laz", xyz[xyz[:, 2] > 1.2])
    table = read(tmp_path / "clipped.gpkg", "pointcloud-to-dbh", "--input", clipped)
    assert (table["qc_flag"] == "check").all() and table["qc_reason"].str.contains("no_ground").all()
    assert (table["dbh_hi_cm"] > [stem[2] for stem in STEMS]).all()


def test_one_bare_tree_is_measured_from_its_lowest_points(tmp_path):
    rng = np.random.default_rng(10)
    points = stem_points(rng, 30.0, 16_000, 0.004, low=0.02, high=8.0, taper_cm_m=0.9)
    swell = 0.045 * np.exp(-points[:, 2] / 0.25)
    angle = np.arctan2(points[:, 1], points[:, 0])
    points[:, :2] += swell[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    # From its swollen foot on, clipped above it, and as a normalised cloud.
    for name, cut, z, flag, reason in (
        ("whole", 0.0, 50.0, "ok", ""),
        ("clipped", 2.0, 50.0, "check", "no_ground"),
        ("height", 0.4, 0.0, "ok", ""),
    ):
        path = write(tmp_path / f"{name}.laz", points[points[:, 2] > cut] + (3.0, 3.0, z) + AT)
        out = tmp_path / f"{name}.gpkg"
        assert main(["pointcloud-to-dbh", "--input", str(path), "--output", str(out), "--log-format", "quiet"]) == 0
        table = gpd.read_file(out, layer="trees")
        assert list(table["qc_flag"]) == [flag] and table["qc_reason"][0] == reason, name
        assert table["dbh_lo_cm"][0] < 30.0 < table["dbh_hi_cm"][0]


def test_ground_that_shows_changes_nothing(whole, tmp_path, capsys):
    table = read(tmp_path / "trees.gpkg", "pointcloud-to-dbh", "--input", whole)
    assert (table["qc_flag"] == "ok").all() and "no_ground" not in capsys.readouterr().err
    np.testing.assert_allclose(table["dbh_cm"], [stem[2] for stem in STEMS], atol=0.6)
    assert (table["dbh_se_cm"] < 1.0).all()
    stems = tmp_path / "stems.laz"
    assert main(["segment-stems", "--input", str(whole), "--output", str(stems), "--log-format", "quiet"]) == 0
    steps = read(tmp_path / "steps.gpkg", "measure-dbh", "--input", stems)
    assert (steps["qc_flag"] == "ok").all() and (steps["dbh_se_cm"] < 1.0).all()


def test_no_stem_vanishes_over_gaps_and_unmarked_zeros_of_a_dtm(xyz, whole, tmp_path, capsys):
    dtm = dtm_from_cloud(xyz, crs=UTM)
    x, _ = dtm.centres()
    for name, value, said in (("gap", np.nan, "has no height in"), ("zero", 0.0, "hold 0 m (or a blend")):
        path = tmp_path / f"{name}.tif"
        write_dtm(path, Dtm(np.where(x - AT[0] < 5, value, dtm.heights), dtm.transform, UTM))
        table = read(tmp_path / f"{name}.gpkg", "pointcloud-to-dbh", "--input", whole, "--dtm", path)
        assert said in capsys.readouterr().err
        np.testing.assert_allclose(table["dbh_cm"], [stem[2] for stem in STEMS], atol=0.6)


def test_stems_over_a_gap_without_ground_stand_on_that_of_the_others(xyz, tmp_path):
    dtm = dtm_from_cloud(xyz, crs=UTM)
    x, _ = dtm.centres()
    write_dtm(tmp_path / "gap.tif", Dtm(np.where(x - AT[0] < 5, np.nan, dtm.heights), dtm.transform, UTM))
    hidden = (height(xyz) < 0.6) & (xyz[:, 0] - AT[0] < 6)
    cloud = write(tmp_path / "hidden.laz", xyz[~hidden])
    table = read(tmp_path / "trees.gpkg", "pointcloud-to-dbh", "--input", cloud, "--dtm", tmp_path / "gap.tif")
    np.testing.assert_allclose(table["dbh_cm"], [stem[2] for stem in STEMS], atol=1.0)
    assert (table["dbh_lo_cm"] < [stem[2] for stem in STEMS]).all()
    assert (table["dbh_hi_cm"] > [stem[2] for stem in STEMS]).all()


def test_a_tilted_dtm_is_checked_tree_by_tree(xyz, whole, tmp_path):
    dtm = dtm_from_cloud(xyz, crs=UTM)
    x, _ = dtm.centres()
    write_dtm(tmp_path / "tilt.tif", Dtm(dtm.heights + 0.1 * (x - AT[0] - 8), dtm.transform, UTM))
    table = read(tmp_path / "trees.gpkg", "pointcloud-to-dbh", "--input", whole, "--dtm", tmp_path / "tilt.tif")
    assert list(table["qc_flag"]) == ["check", "ok", "check", "ok"]
    assert (table["dbh_lo_cm"] < [stem[2] for stem in STEMS]).all()
    assert (table["dbh_hi_cm"] > [stem[2] for stem in STEMS]).all()


def test_the_dry_run_says_what_the_run_would_say(xyz, whole, tmp_path, capsys):
    cloud = write(tmp_path / "cut.laz", xyz[height(xyz) > 1.0])
    out = tmp_path / "out.gpkg"

    def dry(*arguments):
        code = main(
            [
                "pointcloud-to-dbh",
                *map(str, arguments),
                "--output",
                str(out),
                "--dry-run",
                "true",
                "--log-format",
                "plain",
            ]
        )
        assert not out.exists()
        return code, capsys.readouterr().err

    code, said = dry("--input", cloud)
    assert code == 0 and "shows no ground surface between the stems" in said
    code, said = dry("--input", whole)
    assert code == 0 and "no ground" not in said
    dtm = dtm_from_cloud(xyz, crs=UTM)
    write_dtm(tmp_path / "low.tif", dtm.moved(np.array([0, 0, -22.5])))
    code, said = dry("--input", whole, "--dtm", tmp_path / "low.tif")
    assert code == 2 and "-22.5 m" in said
    write_dtm(tmp_path / "right.tif", dtm)
    code, said = dry("--input", cloud, "--dtm", tmp_path / "right.tif")
    assert code == 0


def test_a_tree_on_unsure_ground_is_wider_to_check_or_refused():
    tree = Tree(1, 0.0, 0.0, dbh_cm=30.0, dbh_se_cm=0.4, taper_cm_m=-1.2, qc_flag="ok").finish()
    assert with_ground_error(tree, 0.03, "points").qc_flag == "ok"
    assert with_ground_error(tree, 0.03, "points").dbh_se_cm == pytest.approx(0.4, abs=0.002)
    unsure = with_ground_error(tree, 0.5, "points")
    assert unsure.qc_flag == "check" and unsure.qc_reason == "no_ground"
    assert unsure.dbh_se_cm == pytest.approx(np.hypot(0.4, 0.6))
    gone = with_ground_error(tree, 99.0, "points")
    assert gone.qc_flag == "reject" and gone.qc_reason == "no_ground" and gone.dbh_cm is None and gone.dbh_lo_cm is None
    published = Tree(2, 0.0, 0.0, dbh_cm=30.0, qc_flag="check", qc_reason="unchecked").finish()
    assert with_ground_error(published, 0.5, "points").qc_reason == "unchecked,no_ground"
    refused = Tree(3, 0.0, 0.0, qc_flag="reject", qc_reason="no_ground").finish()
    assert with_ground_error(refused, 99.0, "points").qc_reason == "no_ground"
