"""``tg.open``: a finished run for reading, its page in a notebook, and what is no run."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

import treedgs_geo as tg


def test_every_part_of_a_finished_run_is_there(finished, simulated_plot):
    before = {path: path.stat().st_mtime_ns for path in (finished / "work").rglob("*")}
    run = tg.open(finished / "work")
    assert len(run.stations) == len(list((simulated_plot / "images").iterdir()))
    assert run.trees.equals(tg.read_trees(finished / "work" / "trees.gpkg"))
    assert set(run.evidence.index) == set(run.trees["tree_id"])
    assert {"dbh_cm", "se_cm", "outline_cm", "sure", "n_views", "rms_px"} <= set(run.evidence)
    assert set(run.sheets) == set(run.trees["tree_id"]) and all(path.is_file() for path in run.sheets.values())
    assert (run.stages["status"] == "done").all() and run.searched["share"].between(0, 1).all()
    # A stem projects into a photo in which it was seen: cameras, frame and ground belong together.
    tree = run.trees[run.trees["dbh_cm"].notna()].iloc[0]
    ground = run.ground.height(np.array([tree.x]), np.array([tree.y]))
    foot = run.frame.to_local(np.array([[tree.x, tree.y, ground[0]]]))
    pixels = [view.project(foot)[0][0] / (view.camera.width, view.camera.height) for view in run.cameras.values()]
    assert sum(bool(((pixel > 0) & (pixel < 1)).all()) for pixel in pixels) >= tree.n_views
    shown = run._repr_html_()
    assert shown.count("<img") == 1 and f"<td>{tree.dbh_cm:.1f}</td>" in shown
    assert {path: path.stat().st_mtime_ns for path in (finished / "work").rglob("*")} == before


def test_photos_that_were_moved_are_given(finished, simulated_plot, tmp_path):
    shutil.copytree(finished / "work", tmp_path / "work")
    layer = tmp_path / "work" / "geotags.gpkg"
    stations = tg.open(tmp_path / "work").stations
    stations["path"] = "/nowhere/" + stations["name"]
    layer.unlink()
    stations.to_file(layer, layer="stations")
    with pytest.raises(tg.TreeDGSError, match="give the photo folder that was reconstructed"):
        tg.open(tmp_path / "work").cameras  # noqa: B018
    assert len(tg.open(tmp_path / "work", photos=simulated_plot / "images").cameras) == len(stations)


def test_what_is_no_run_is_said_in_one_sentence(finished, tmp_path):
    with pytest.raises(tg.TreeDGSError, match="holds no run"):
        tg.open(tmp_path)
    (tmp_path / "run.json").write_text('{"version": 3}')
    with pytest.raises(tg.TreeDGSError, match="is not a TreeDGS run record"):
        tg.open(tmp_path)
    shutil.copy(finished / "work" / "run.json", tmp_path)
    stopped = tg.open(tmp_path)
    assert stopped._repr_html_() == "" and "geotag" in repr(stopped)
    for part in ("stations", "cameras", "ground", "trees", "evidence", "sheets", "searched"):
        with pytest.raises(tg.TreeDGSError, match="the run did not come so far"):
            getattr(stopped, part)
