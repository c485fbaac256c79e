"""The four point-cloud verbs from the command line: results, and one sentence where something is wrong."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pyproj
import pytest
from synthetic_cloud import plot_cloud, stem_points

from treedgs_geo.cli import main
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud, write_cloud
from treedgs_geo.stems.cloud.estimate.cloud import measure_stems
from treedgs_geo.stems.cloud.estimate.options import MeasureOptions
from treedgs_geo.terrain.dtm import read_dtm, write_dtm
from treedgs_geo.terrain.ground import dtm_from_cloud

STEMS = [(3.0, 3.0, 25.0), (8.0, 8.0, 35.0)]
AT = np.array([500000.0, 4000000.0, 0.0])


@pytest.fixture(scope="module")
def laz(tmp_path_factory):
    path = tmp_path_factory.mktemp("cloud") / "plot.laz"
    xyz = plot_cloud(np.random.default_rng(1), STEMS) + AT
    write_cloud(path, PointCloud(xyz, pyproj.CRS.from_epsg(32615), {"intensity": np.full(len(xyz), 7, np.uint16)}))
    return path


def run(*arguments):
    return main([*map(str, arguments), "--log-format", "quiet"])


def test_the_chain_by_steps_and_in_one_go(laz, tmp_path):
    dtm, stems, trees, direct = (tmp_path / name for name in ("dtm.tif", "stems.laz", "trees.gpkg", "direct.gpkg"))
    assert run("terrain", "--input", laz, "--output", dtm) == 0
    assert read_dtm(dtm).crs.to_epsg() == 32615
    assert run("segment-stems", "--input", laz, "--dtm", dtm, "--output", stems) == 0
    assert set(np.unique(read_cloud(stems).attributes["tree_id"])) == {1, 2}
    assert run("measure-dbh", "--input", stems, "--output", trees) == 0
    assert run("pointcloud-to-dbh", "--input", laz, "--output", direct) == 0
    for path in (trees, direct):
        table = gpd.read_file(path, layer="trees").sort_values("x")
        assert table.crs.to_epsg() == 32615 and table.geometry.has_z.all()
        np.testing.assert_allclose(table["dbh_cm"], [25.0, 35.0], atol=0.8)
        assert (table["qc_flag"] == "ok").all()


@pytest.mark.parametrize("mossy", [(0, 1, 2, 3), (1, 3)])
def test_no_stem_under_moss_is_ok(mossy, tmp_path):
    """Moss 2 to 4 cm thick over 90 % of the bark of stems 20 to 38 cm thick, in drone LiDAR."""
    path, out, rng = tmp_path / "moss.laz", tmp_path / "trees.gpkg", np.random.default_rng(5)
    stems = [(x, y, dbh) for (x, y), dbh in zip([(3, 3), (9, 3), (3, 9), (9, 9)], (20, 26, 32, 38), strict=True)]
    xyz = plot_cloud(rng, stems, bark=2400)
    for x, y, dbh in (stems[number] for number in mossy):
        out_of = xyz[:, :2] - (x, y)
        far = np.hypot(*out_of.T)
        bark = (far < dbh / 200 + 0.06) & (xyz[:, 2] > 100.9) & (rng.uniform(size=len(xyz)) < 0.9)
        xyz[bark, :2] += out_of[bark] * (rng.uniform(0.02, 0.04, bark.sum()) / far[bark])[:, None]
    write_cloud(path, PointCloud(xyz + AT, pyproj.CRS.from_epsg(32615)))
    assert run("pointcloud-to-dbh", "--input", path, "--output", out, "--sheets", "none") == 0
    table = gpd.read_file(out, layer="trees")
    xy = np.column_stack([table.geometry.x, table.geometry.y]) - AT[:2]
    for number, (x, y, dbh) in enumerate(stems):
        row = table.iloc[int(np.hypot(*(xy - (x, y)).T).argmin())]
        assert (row["qc_flag"] == "ok") == (number not in mossy)
        assert "covered" in row["qc_reason"] or "double" in row["qc_reason"] or number not in mossy
        assert row["qc_flag"] == "reject" or row["dbh_lo_cm"] <= dbh <= row["dbh_hi_cm"]


def test_a_dtm_off_the_clouds_ground_is_reported_and_widens_the_intervals(laz, tmp_path, capsys):
    dtm, shifted = tmp_path / "dtm.tif", tmp_path / "shifted.tif"
    assert run("terrain", "--input", laz, "--output", dtm) == 0
    write_dtm(shifted, read_dtm(dtm).moved(np.array([0.0, 0.0, 0.6])))
    tables = []
    for ground, reported in ((dtm, False), (shifted, True)):
        out = tmp_path / f"{ground.stem}.gpkg"
        assert (
            main(
                [
                    "pointcloud-to-dbh",
                    "--input",
                    str(laz),
                    "--dtm",
                    str(ground),
                    "--output",
                    str(out),
                    "--log-format",
                    "plain",
                ]
            )
            == 0
        )
        assert ("+0.60 m from the ground that the cloud shows" in capsys.readouterr().err) == reported
        tables.append(gpd.read_file(out, layer="trees").sort_values("x"))
    right, wrong = tables
    se = np.hypot(right["dbh_se_cm"], 0.6 * wrong["taper_cm_m"].abs())
    np.testing.assert_allclose(wrong["dbh_se_cm"], se, rtol=0.2)
    assert (wrong["dbh_se_cm"].to_numpy() > right["dbh_se_cm"].to_numpy()).all()


def test_bad_input_is_one_sentence_and_leaves_nothing(laz, tmp_path, capsys):
    out = tmp_path / "out.gpkg"

    def refused(*arguments):
        assert main([*map(str, arguments), "--log-format", "plain"]) == 2
        assert not list(tmp_path.glob("*out*"))
        return capsys.readouterr().err

    assert "not found" in refused("pointcloud-to-dbh", "--input", tmp_path / "no.laz", "--output", out)
    assert "but --crs says" in refused("pointcloud-to-dbh", "--input", laz, "--crs", "EPSG:32616", "--output", out)
    assert "same intensity" in refused("pointcloud-to-dbh", "--input", laz, "--weights", "intensity", "--output", out)
    found = refused("pointcloud-to-dbh", "--input", laz, "--weights", "opacity", "--output", out)
    assert "no attribute 'opacity'" in found
    assert "no dimension 'tree_id'" in refused("measure-dbh", "--input", laz, "--output", out)
    assert "class (2)" in refused("terrain", "--input", laz, "--use-classes", "true", "--output", tmp_path / "out.tif")
    far = tmp_path / "far.tif"
    moved = tmp_path / "far.laz"
    cloud = read_cloud(laz)
    write_cloud(moved, PointCloud(cloud.xyz + (5000, 0, 0), cloud.crs))
    assert run("terrain", "--input", moved, "--output", far) == 0
    assert "covers the plot" in refused("pointcloud-to-dbh", "--input", laz, "--dtm", far, "--output", out)
    broken = tmp_path / "broken.laz"
    broken.write_bytes(laz.read_bytes()[:40000])
    assert "broken.laz" in refused("pointcloud-to-dbh", "--input", broken, "--output", out)


def test_local_scan_and_a_plot_without_stems(tmp_path):
    xyz = plot_cloud(np.random.default_rng(2), [])
    bare, out = tmp_path / "bare.laz", tmp_path / "a.gpkg"
    write_cloud(bare, PointCloud(xyz))
    for more in ((), ("--crs", "local")):
        assert run("pointcloud-to-dbh", "--input", bare, *more, "--output", out) == 0
        assert len(gpd.read_file(out, layer="trees")) == 0


def test_filled_stems_are_measured_with_doubt():
    """Surface samples of splats: no ring is there; the number comes with a wide error and a flag."""
    rng = np.random.default_rng(3)
    xyz = plot_cloud(rng, [])
    parts, ids = [xyz], [np.zeros(len(xyz), int)]
    for number, dbh in enumerate((20.0, 35.0), start=1):
        points = stem_points(rng, dbh, 4000, 0.015, filled=True, xy=(3 * number, 5.0), lean=(0.08, 0.0))
        points[:, 2] += 100 + 0.05 * 3 * number + 0.1 * np.sin(5 / 3)
        parts.append(points)
        ids.append(np.full(len(points), number))
    xyz = np.concatenate(parts)
    cloud = PointCloud(xyz, None, {"opacity": np.full(len(xyz), 0.5, np.float32)})
    dtm = dtm_from_cloud(xyz)
    trees = measure_stems(cloud, np.concatenate(ids), dtm, MeasureOptions(weights="opacity", source="splat"))
    for tree, dbh in zip(trees, (20.0, 35.0), strict=True):
        assert abs(tree.dbh_cm - dbh) < 4.0 and tree.dbh_se_cm > 2.0 and tree.qc_flag == "check"
        assert tree.opac_mean == pytest.approx(0.5)


@pytest.mark.parametrize("flag", [{"classification": 7}, {"classification": 18}, {"withheld": 1}])
def test_noise_and_withheld_points_are_no_bark_in_any_verb(flag, tmp_path, capsys):
    rng = np.random.default_rng(1)
    xyz = plot_cloud(rng, STEMS)
    coat = plot_cloud(rng, [(x, y, dbh + 8) for x, y, dbh in STEMS], per_m2=0, bark=900, shrubs=0)
    beside = plot_cloud(rng, [(x + 2, y, dbh) for x, y, dbh in STEMS], per_m2=0, bark=400, shrubs=0)
    added = np.r_[np.zeros(len(xyz)), np.ones(len(coat) + len(beside))].astype(np.uint8)
    cloud = PointCloud(np.concatenate([xyz, coat, beside]) + AT, pyproj.CRS.from_epsg(32615))
    for name, value in flag.items():
        cloud = cloud.with_attribute(name, added * np.uint8(value))
    path, stems, trees, direct = (tmp_path / name for name in ("plot.laz", "stems.laz", "trees.gpkg", "direct.gpkg"))
    write_cloud(path, cloud)
    assert main(["pointcloud-to-dbh", "--input", str(path), "--output", str(direct), "--log-format", "plain"]) == 0
    said = "".join(capsys.readouterr())
    assert f"{added.sum():,} points" in said and "noise or withheld" in said
    assert run("segment-stems", "--input", path, "--keep-all", "--output", stems) == 0
    labelled = read_cloud(stems)
    assert len(labelled) == len(cloud) and not labelled.attributes["tree_id"][added > 0].any()
    assert run("measure-dbh", "--input", stems, "--output", trees) == 0
    for layer in (trees, direct):
        table = gpd.read_file(layer, layer="trees").sort_values("x")
        np.testing.assert_allclose(table["dbh_cm"], [25.0, 35.0], atol=0.8)
