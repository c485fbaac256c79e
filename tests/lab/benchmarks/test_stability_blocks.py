"""Flights through the reconstruction: a wrong scale is found, a shifted block is no wrong scale, a crash no refusal."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from treedgs_geo.core.crs import LocalFrame, project_crs
from treedgs_geo.core.settings import build
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_lab.benchmarks import blocks, processes
from treedgs_lab.benchmarks.blocks import camera_errors, on_true_ground, scale_error, wrong_scale
from treedgs_lab.benchmarks.markdown import markdown
from treedgs_lab.benchmarks.plot import TruePlot
from treedgs_lab.benchmarks.processes import ChainCrash, photo_inputs, run_photo_chain
from treedgs_lab.benchmarks.stability.block_report import block_report, block_rows, by_block_level
from treedgs_lab.benchmarks.stability.cases import Case
from treedgs_lab.benchmarks.stability.factor_type import CHAIN
from treedgs_lab.benchmarks.stability.factors import FACTORS, factor
from treedgs_lab.benchmarks.stability.perturb import scaled_views
from treedgs_lab.benchmarks.stability.suite import write_stability
from treedgs_lab.simulate.settings import SimulateSettings, resolve

FRAME = LocalFrame(project_crs("EPSG:6344"), np.array([600000.0, 3700000.0, 40.0]))
SFM = Path("sfm")


class Ring(TruePlot):
    """Twelve oblique photos about three stems, without files."""

    def views(self) -> list[View]:
        camera = Camera(720, 540, 3800, 3800, 362, 268, k1=-0.1, p1=0.0008, k3=-0.2)
        return [photo(k, camera) for k in range(12)]

    trees = pd.DataFrame(
        {
            "E_bh": FRAME.origin[0] + np.array([0.5, -1.0, 1.5]),
            "N_bh": FRAME.origin[1] + np.array([0.0, 1.0, -1.5]),
            "h_bh": FRAME.origin[2] + 1.3,
            "near": True,
        }
    )


def photo(number: int, camera: Camera) -> View:
    turn = number * np.pi / 6
    centre = np.array([45 * np.cos(turn), 45 * np.sin(turn), 70.0])
    forward = -centre / np.linalg.norm(centre)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    moved = np.array([0.08, -0.05, 0.0])
    return View(f"{number}.jpg", Path(f"{number}.jpg"), camera, rotation, -rotation @ centre, number // 7, moved)


PLOT = Ring(Path("plot"), FRAME, 4.0)


def block_of(monkeypatch, views, frame=FRAME):
    monkeypatch.setattr(blocks, "load_views", lambda *_: (frame, views))


def test_a_true_block_is_true(monkeypatch):
    block_of(monkeypatch, PLOT.views())
    assert scale_error(PLOT, SFM) == pytest.approx(0, abs=1e-9)
    found = camera_errors(PLOT, SFM)
    assert found["centre_max_cm"] == 0 and found["focal_error_pct"] == [0.0, 0.0]


def test_a_block_too_large_makes_every_width_too_large(monkeypatch):
    block_of(monkeypatch, scaled_views(PLOT.views(), 1.02))
    assert scale_error(PLOT, SFM) == pytest.approx(0.02, abs=2e-4)


def test_a_focal_length_too_long_makes_them_too_small_where_the_cameras_stay(monkeypatch):
    longer = [replace(v, camera=replace(v.camera, fx=v.camera.fx * 1.01, fy=v.camera.fy * 1.01)) for v in PLOT.views()]
    block_of(monkeypatch, longer)
    assert scale_error(PLOT, SFM) == pytest.approx(-0.01, abs=1e-3)
    assert camera_errors(PLOT, SFM)["focal_error_pct"] == [1.0, 1.0]


def test_a_lens_whose_distortion_is_wrong_is_seen_too(monkeypatch):
    bent = [replace(view, camera=replace(view.camera, k1=view.camera.k1 + 3.0)) for view in PLOT.views()]
    block_of(monkeypatch, bent)
    assert abs(scale_error(PLOT, SFM)) > 5e-4


def test_a_block_that_lies_elsewhere_is_no_wrong_scale_and_its_trees_are_placed(monkeypatch):
    tilt = np.radians(0.5)
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    shift = np.array([3.0, -2.0, 5.0])
    moved = []
    for view in PLOT.views():
        rotation = view.rotation @ turn.T
        centre = turn @ view.centre + shift
        travel = turn @ view.readout_travel_m
        moved.append(replace(view, rotation=rotation, translation=-rotation @ centre, readout_travel_m=travel))
    # The same block in a frame with another origin.
    other = LocalFrame(FRAME.crs, FRAME.origin + [10.0, -20.0, 7.0])
    away = FRAME.origin - other.origin
    block_of(monkeypatch, [replace(v, translation=v.translation - v.rotation @ away) for v in moved], other)
    assert scale_error(PLOT, SFM) == pytest.approx(0, abs=1e-9)
    assert camera_errors(PLOT, SFM)["centre_rms_3d_cm"] > 500
    tree = np.array([[1.0, 2.0, 0.5]])
    placed = on_true_ground(PLOT, SFM, FRAME.to_project(tree @ turn.T + shift))
    assert FRAME.to_local(placed) == pytest.approx(tree, abs=1e-6)


def test_a_photo_that_looks_elsewhere_is_counted_and_is_no_error_of_the_scale(monkeypatch):
    views = PLOT.views()
    centre, turned = views[3].centre, views[8].rotation
    views[3] = replace(views[3], rotation=turned, translation=-turned @ centre)
    block_of(monkeypatch, views)
    found = camera_errors(PLOT, SFM)
    assert found["turned_photos"] == 1 and found["centre_max_cm"] == 0
    assert scale_error(PLOT, SFM) == pytest.approx(0, abs=1e-9)


def test_photos_that_the_block_has_placed_wrong_do_not_move_its_trees(monkeypatch):
    views = PLOT.views()
    views[3] = replace(views[3], translation=views[3].translation - views[3].rotation @ [15.0, 8.0, 0.0])
    block_of(monkeypatch, views)
    tree = np.array([[1.0, 2.0, 0.5]])
    assert FRAME.to_local(on_true_ground(PLOT, SFM, FRAME.to_project(tree))) == pytest.approx(tree, abs=1e-6)


def test_what_counts_as_a_wrong_scale():
    assert wrong_scale(0.0069, 0.001) is False and wrong_scale(-0.0071, 0.001) is True
    assert wrong_scale(0.0051, None) is True and wrong_scale(None, 0.001) is None


def test_the_chain_is_given_nothing_true(tmp_path):
    (tmp_path / "truth").mkdir()
    (tmp_path / "dtm.tif").touch()
    plain = list(map(str, photo_inputs(tmp_path)))
    assert "--geotags" not in plain and "--gcp" not in plain and not any("truth" in w or "dtm" in w for w in plain)
    (tmp_path / "a_Timestamp.MRK").touch()
    (tmp_path / "gcp_list.txt").touch()
    full = list(map(str, photo_inputs(tmp_path)))
    assert full[full.index("--geotags") + 1] == str(tmp_path) and full[-1].endswith("gcp_list.txt")


def test_a_refusal_is_told_from_a_crash(tmp_path, monkeypatch):
    def ends(code):
        words = [sys.executable, "-c", f"import sys; print('error: because.', file=sys.stderr); sys.exit({code})"]
        monkeypatch.setattr(processes, "python_command", lambda *_: words)
        return run_photo_chain(tmp_path, "EPSG:6344", tmp_path / "ws")

    assert ends(0) == "" and ends(2) == "error: because."
    for code in (1, 3, 4, 130):
        with pytest.raises(ChainCrash, match=f"exit code {code}: error: because"):
            ends(code)


@pytest.mark.parametrize("one", [f for f in FACTORS if CHAIN in f.inputs], ids=lambda f: f.key)
def test_every_level_of_a_flight_can_be_simulated(one, tmp_path):
    seen = []
    for level in one.levels:
        settings = Case(one, level, 1, "whole chain").plot_settings
        seen.append(resolve(build(SimulateSettings, {**settings, "output": tmp_path}))[0])
    assert all(seen[0] != other for other in seen[1:]) and len(set(seen)) == len(seen)
    assert [one.label(level) for level in one.levels] == list(dict.fromkeys(map(one.label, one.levels)))


def record(key, level, rows, seed=1, refused="", **block):
    found = {
        "photos": 28,
        "registered": 28,
        "scale_sd": 0.001,
        "scale_error": 0.0005,
        "centre_rms_3d_cm": 3.0,
        "turned_photos": 1,
        "focal_error_pct": [0.02, -0.05],
    }
    return {
        "code": "c",
        "factor": key,
        "level": level,
        "seed": seed,
        "stand": seed,
        "method": "whole chain",
        "refused": refused,
        "rows": rows,
        "block": {} if refused else found | block,
    }


def row(true, read, flag="ok", **more):
    near = {"lo_cm": None, "hi_cm": None} if read is None else {"lo_cm": read - 1, "hi_cm": read + 1}
    return {
        "tree_id": "a",
        "kind": "normal",
        "true_cm": true,
        "read_cm": read,
        "se_cm": 0.6,
        **near,
        "flag": flag,
        "reason": "",
        "clear": 5,
        **more,
    }


OK = [row(20.0, 20.1), row(30.0, 30.1)]
RECORDS = [
    record("readout", 0.0, OK),
    record("lens", 0.0, OK),
    record("readout", 10.0, OK, scale_error=-0.0161),
    record("readout", 20.0, [row(20.0, 19.6), row(30.0, 29.4), row(25.0, 25.9, "check")], seed=2),
    # A wrong scale that no ok tree has is no wrong ok tree.
    record("readout", 20.0, [row(20.0, 19.0, "check")], scale_error=-0.05),
    record("readout", 30.0, [row(20.0, None, "absent")], refused="3 of 28 photos could be registered."),
    record("grid", 70.0, [row(20.0, 20.1, plot_id="p_1"), row(30.0, None, "reject", plot_id="p_2")], registered=21),
]


def test_wrong_scales_and_refusals_are_counted_by_level():
    rows = block_rows(RECORDS)
    assert rows["base"].tolist() == [False, True] + [False] * 5
    levels = by_block_level(rows).set_index(["factor", "level"])
    assert levels.loc[("readout", 10.0), ["wrong_scale", "wrong_ok_scale"]].tolist() == [1, 0]
    assert levels.loc[("readout", 20.0), ["cases", "wrong_scale", "wrong_ok_scale"]].tolist() == [2, 0, 1]
    assert levels.loc[("readout", 20.0), "scale_error_pct"] == -5.0
    assert levels.loc[("readout", 20.0), "ok_error_pct"] == pytest.approx(-2.0)
    gone = levels.loc[("readout", 30.0)]
    assert gone["cases_refused"] == 1 and gone["wrong_scale"] == 0 and np.isnan(gone["centre_rms_cm"])
    assert levels.loc[("readout", 0.0), "focal_error_pct"] == -0.05
    assert levels.loc[("grid", 70.0), "least_registered"] == 0.75
    text = markdown(block_report(rows))
    assert "6 cases, 1 refused, 1 with ok trees in a block" in text and "(1 by the median" in text
    name = "height of a grid flight over four plots"
    assert f"| {name} | 70 m | 1 | 0 | 75 | 1 | 3.0 | -0.05 | 0.10 | +0.05 | +0.50 | 0 | 0 |" in text
    assert "drone at 4 m/s, 30 ms, seed 1: refused: 3 of 28 photos could be registered." in text
    assert f"- {name}, 70 m, seed 1: measured in p_1: 1 of 1, p_2: 0 of 1." in text


def test_the_figures_of_blocks_are_in_the_tables_and_the_page(tmp_path):
    plain = {key: value for key, value in record("lean", 0.0, OK).items() if key != "block"} | {"method": "photos"}
    write_stability(tmp_path, [*RECORDS, plain], 8)
    levels = pd.read_csv(tmp_path / "stability.csv").set_index(["factor", "level"])
    assert levels.loc[("readout", 10.0), "scale_error_pct"] == -1.61 and levels.loc[("readout", 30.0), "cases_refused"]
    assert np.isnan(levels.loc[("lean", 0.0), "cases_refused"])
    assert len(pd.read_csv(tmp_path / "stability-blocks.csv")) == len(RECORDS)
    page = (tmp_path / "stability.html").read_text()
    assert "Through the reconstruction" in page and "<h2>reconstruction</h2>" in page
    assert (tmp_path / "stability-reconstruction.svg").stat().st_size > 1000


def test_levels_without_a_number_have_words():
    assert factor("grid").label(0.0) == "rings" and factor("grid").label_with_unit(70.0) == "70 m"
    assert factor("consumer").label(9.0) == "PPK" and factor("consumer").label_with_unit(3.0) == "3 points"
