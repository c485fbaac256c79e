"""The main job on a simulated plot: photos in, tree points out; resumed, repeated, and scored against the truth."""

from __future__ import annotations

import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest
import rasterio
from chain_runs import chain_arguments

from treedgs_geo.cli import main
from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.inventory.accuracy.scores import score_against_truth
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.stems.quality.tops import HEIGHT_REASONS


def test_stems_are_found_and_measured(finished, simulated_plot):
    accuracy, table = score_against_truth(
        read_trees(finished / "trees.gpkg"), simulated_plot / "truth" / "trees.csv", 3
    )
    print(table.to_string())
    # The plot has a handful of stems: these bounds catch a broken chain, the benchmarks judge the accuracy.
    assert accuracy.n_false == 0
    assert accuracy.success_rate >= 0.5
    assert accuracy.rmse_cm <= 2.0


def test_the_layer_lies_where_the_plot_is(finished, simulated_plot):
    trees = read_trees(finished / "trees.gpkg")
    plot = pd.read_csv(simulated_plot / "plots.csv").iloc[0]
    assert trees.crs.to_epsg() == 6344
    assert np.hypot(trees["x"] - plot["easting"], trees["y"] - plot["northing"]).max() < plot["radius_m"] + 2
    measured = trees[trees["dbh_cm"].notna()]
    assert (measured["dbh_lo_cm"] < measured["dbh_cm"]).all() and (measured["dbh_hi_cm"] > measured["dbh_cm"]).all()
    assert (trees.loc[trees["dbh_cm"].isna(), "qc_reason"] != "").all()


def test_the_block_is_measured_in_ground_metres(finished):
    """The plot lies 1.2 degrees from its zone's meridian: 0.025 % less on the map than on the ground."""
    assert LocalFrame.load(finished / "work" / "sfm" / "frame.json").scale == pytest.approx(0.99974, abs=2e-5)


def test_the_record_says_what_was_done(finished):
    record = json.loads((finished / "work" / "run.json").read_text())
    assert {"geotag", "reconstruct", "ground", "measure", "heights", "sheets", "write", "orthophoto", "view"} == set(
        record["stages"]
    )
    for stage in record["stages"].values():
        assert stage["status"] == "done" and stage["seconds"] >= 0 and stage["peak_memory_mb"] > 0
    assert record["crs"] and record["libraries"]["pycolmap"]
    for name in ("geotags.gpkg", "sfm/images.bin", "sfm/frame.json", "dtm.tif", "trees.gpkg", "report.html"):
        assert (finished / "work" / name).exists(), name


def test_every_stem_has_its_evidence_sheet(finished):
    """A picture a tree, measured or not, small, named by the layer's columns and linked from the report."""
    trees = read_trees(finished / "trees.gpkg")
    page = (finished / "work" / "report.html").read_text(encoding="utf-8")
    for tree in trees.itertuples():
        sheet = finished / "work" / "sheets" / tree.run_id / f"{tree.tree_id}.jpg"
        assert 5_000 < sheet.stat().st_size <= 80_000
        assert f"data-sheet='sheets/{tree.run_id}/{tree.tree_id}.jpg'" in page
    assert len(list((finished / "work" / "sheets").rglob("*.jpg"))) == len(trees) > 0


def test_trees_have_heights_or_the_reason_why_not(finished, simulated_plot):
    trees, truth = read_trees(finished / "trees.gpkg"), pd.read_csv(simulated_plot / "truth" / "trees.csv")
    assert (trees["height_m"].isna() == trees["height_why"].isin(HEIGHT_REASONS)).all()
    for tree in trees[trees["height_m"].notna()].itertuples():
        true = truth.loc[np.hypot(truth["E_bh"] - tree.x, truth["N_bh"] - tree.y).idxmin()]
        assert abs(tree.height_m - true["height_m"]) < 3 * tree.height_se_m < 0.4 * tree.height_m
    with rasterio.open(finished / "work" / "chm.tif") as chm:
        heights = chm.read(1, masked=True)
        assert chm.crs.to_epsg() == 6344 and chm.descriptions == ("canopy height above ground",)
    assert 5 < heights.max() < truth["height_m"].max() + 1.5


def test_heights_are_left_out_where_they_are_not_wanted(finished, simulated_plot, tmp_path):
    shutil.copytree(finished / "work", tmp_path / "work")
    assert main([*chain_arguments(simulated_plot, tmp_path), "--heights", "none"]) == 0
    assert read_trees(tmp_path / "trees.gpkg")[["height_m", "height_why"]].isna().all(axis=None)


def test_the_ground_below_the_crowns_is_a_picture(finished, simulated_plot, tmp_path):
    """In the project CRS, over the plot; trouble with it is a warning, and the trees are the same."""
    plot = pd.read_csv(simulated_plot / "plots.csv").iloc[0]
    with rasterio.open(finished / "work" / "ortho.tif") as picture:
        assert picture.crs.to_epsg() == 6344 and picture.count == 3
        row, column = picture.index(plot["easting"], plot["northing"])
        assert abs(row - picture.height / 2) < 40 and abs(column - picture.width / 2) < 40
        assert (picture.dataset_mask() > 0).mean() > 0.5
    shutil.copytree(finished / "work", tmp_path / "work")
    (tmp_path / "work" / "ortho.tif").unlink()
    (tmp_path / "work" / "ortho.tif").mkdir()
    assert main(chain_arguments(simulated_plot, tmp_path)) == 0
    record = json.loads((tmp_path / "work" / "run.json").read_text())["stages"]
    assert record["orthophoto"]["status"] == "failed" and record["write"]["status"] == "done"
    one, two = read_trees(finished / "trees.gpkg"), read_trees(tmp_path / "trees.gpkg")
    assert one["dbh_cm"].equals(two["dbh_cm"])


def test_the_stand_in_3d_is_linked_and_trouble_with_it_costs_no_tree(finished, simulated_plot, tmp_path, capsys):
    trees, work = read_trees(finished / "trees.gpkg"), finished / "work"
    page = (work / "report_3d.html").read_text(encoding="utf-8")
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)[1])
    assert [stem["id"] for stem in data["stems"]] == sorted(trees["tree_id"])
    for stem in data["stems"]:
        tree = trees[trees["tree_id"] == stem["id"]].iloc[0]
        path = np.array(stem["path"])
        at_bh = [np.interp(tree["z_ground"] + tree["bh_m"], path[:, 2], path[:, axis]) for axis in (0, 1, 3)]
        assert np.hypot(at_bh[0] - tree["x"], at_bh[1] - tree["y"]) < 0.03
        assert np.isnan(tree["dbh_cm"]) or abs(200 * at_bh[2] - tree["dbh_cm"]) < 0.1 * tree["dbh_cm"]
        assert (work / stem["sheet"]).is_file()
    assert data["picture"] and data["points"] and not data["gaussians"] and not data["crowns"]
    assert (work / "report_3d.html").stat().st_size < 5e6
    assert "href='report_3d.html'" in (work / "report.html").read_text(encoding="utf-8")
    shutil.copytree(work, tmp_path / "work")
    (tmp_path / "work" / "report_3d.html").unlink()
    (tmp_path / "work" / "report_3d.html").mkdir()
    assert main(chain_arguments(simulated_plot, tmp_path)) == 0
    assert "No 3D view: " in capsys.readouterr().err
    assert read_trees(tmp_path / "trees.gpkg")["dbh_cm"].equals(trees["dbh_cm"])
    assert "report_3d.html" not in (tmp_path / "work" / "report.html").read_text(encoding="utf-8")


def test_a_second_run_keeps_finished_stages(finished, simulated_plot, capsys):
    before = json.loads((finished / "work" / "run.json").read_text())["stages"]["reconstruct"]["seconds"]
    assert main(chain_arguments(simulated_plot, finished)) == 0
    text = capsys.readouterr().err
    for stage in ("geotag", "reconstruct", "ground", "measure", "heights", "sheets", "orthophoto"):
        assert f"{stage}: unchanged since the last run, kept" in text
    assert json.loads((finished / "work" / "run.json").read_text())["stages"]["reconstruct"]["seconds"] == before


def test_damaged_stages_are_named_and_give_the_same_trees_again(finished, simulated_plot, tmp_path, capsys):
    shutil.copytree(finished / "work", tmp_path / "work")
    (tmp_path / "work" / "trees.json").write_text('[{"height": 3}]')
    ground = tmp_path / "work" / "dtm.tif"
    ground.write_bytes(ground.read_bytes()[:-100])
    assert main(chain_arguments(simulated_plot, tmp_path)) == 0
    text = capsys.readouterr().err
    for name, stage in (("trees.json", "measure"), ("dtm.tif", "ground")):
        assert f"{name}: is not as the run left it (damaged or changed); the stage {stage} is done again" in text
    assert "reconstruct: unchanged" in text
    one, two = read_trees(finished / "trees.gpkg"), read_trees(tmp_path / "trees.gpkg")
    pd.testing.assert_frame_equal(
        pd.DataFrame(one.drop(columns="geometry")), pd.DataFrame(two.drop(columns="geometry"))
    )


def test_a_ground_that_the_photos_contradict_is_reported_and_widens_the_intervals(finished, simulated_plot, tmp_path):
    shutil.copytree(finished / "work", tmp_path / "work")
    with rasterio.open(finished / "work" / "dtm.tif") as source:
        profile, heights = source.profile, source.read(1)
    with rasterio.open(tmp_path / "high.tif", "w", **profile) as target:
        target.write(np.where(heights == profile["nodata"], heights, heights + 0.6).astype(heights.dtype), 1)
    assert main(chain_arguments(simulated_plot, tmp_path, dtm=str(tmp_path / "high.tif"))) == 0
    stage = json.loads((tmp_path / "work" / "run.json").read_text())["stages"]["ground"]
    assert stage["result"]["above_photos_m"] == pytest.approx(0.6, abs=0.02)
    assert "0.60 m from the ground" in stage["result"]["warnings"][0]
    right, high = (read_trees(folder / "trees.gpkg").set_index("tree_id") for folder in (finished, tmp_path))
    both = right.index[right["dbh_cm"].notna()].intersection(high.index[high["dbh_cm"].notna()])
    # Half a metre too high reads the taper's share thinner; the interval knows.
    wider = high.loc[both, "dbh_se_cm"] - right.loc[both, "dbh_se_cm"]
    assert len(both) >= 2 and (wider.median() > 0.1)
    # A warning beside numbers that are ok would be none.
    assert (high.loc[both, "qc_flag"] == "check").all() and high.loc[both, "qc_reason"].str.contains("no_ground").all()
    assert not right["qc_reason"].fillna("").str.contains("no_ground").any()


def test_another_breast_height_and_thickest_stem_keep_the_cameras(finished, simulated_plot, tmp_path, capsys):
    shutil.copytree(finished / "work", tmp_path / "work")
    asked = {"bh_m": "1.30", "max_dbh_cm": "20", "output": str(tmp_path / "trees.shp")}
    assert main(chain_arguments(simulated_plot, tmp_path, **asked)) == 0
    assert "reconstruct: unchanged" in capsys.readouterr().err
    trees = read_trees(tmp_path / "trees.shp")
    assert (trees["bh_m"] == 1.30).all() and len(trees)
    assert read_trees(finished / "trees.gpkg")["dbh_cm"].max() > 20 and not (trees["dbh_cm"] > 20).any()
