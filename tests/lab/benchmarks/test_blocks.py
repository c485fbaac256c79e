"""Blocks against the truth, and what the chain is given of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from treedgs_geo.core.crs import LocalFrame, project_crs
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_lab.benchmarks.plot import TruePlot
from treedgs_lab.benchmarks.processes import photo_inputs
from treedgs_lab.benchmarks.reconstruction import accuracy
from treedgs_lab.benchmarks.reconstruction.accuracy import camera_errors

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
    monkeypatch.setattr(accuracy, "load_views", lambda *_: (frame, views))


def test_a_true_block_is_true(monkeypatch):
    block_of(monkeypatch, PLOT.views())
    found = camera_errors(PLOT, SFM)
    assert found["centre_max_cm"] == 0 and found["focal_error_pct"] == [0.0, 0.0]


def test_a_focal_length_too_long_is_seen_in_each_flight(monkeypatch):
    longer = [replace(v, camera=replace(v.camera, fx=v.camera.fx * 1.01, fy=v.camera.fy * 1.01)) for v in PLOT.views()]
    block_of(monkeypatch, longer)
    assert camera_errors(PLOT, SFM)["focal_error_pct"] == [1.0, 1.0]


def test_a_photo_that_looks_elsewhere_is_counted(monkeypatch):
    views = PLOT.views()
    centre, turned = views[3].centre, views[8].rotation
    views[3] = replace(views[3], rotation=turned, translation=-turned @ centre)
    block_of(monkeypatch, views)
    found = camera_errors(PLOT, SFM)
    assert found["turned_photos"] == 1 and found["centre_max_cm"] == 0


def test_a_block_in_a_frame_with_another_origin_lies_where_it_lies(monkeypatch):
    other = LocalFrame(FRAME.crs, FRAME.origin + [10.0, -20.0, 7.0])
    away = FRAME.origin - other.origin + [3.0, -2.0, 5.0]
    block_of(monkeypatch, [replace(v, translation=v.translation - v.rotation @ away) for v in PLOT.views()], other)
    found = camera_errors(PLOT, SFM)
    assert found["common_shift_cm"] == [300.0, -200.0, 500.0]


def test_the_chain_is_given_nothing_true(tmp_path):
    (tmp_path / "truth").mkdir()
    (tmp_path / "dtm.tif").touch()
    plain = list(map(str, photo_inputs(tmp_path)))
    assert "--geotags" not in plain and "--gcp" not in plain and not any("truth" in w or "dtm" in w for w in plain)
    (tmp_path / "a_Timestamp.MRK").touch()
    (tmp_path / "gcp_list.txt").touch()
    full = list(map(str, photo_inputs(tmp_path)))
    assert full[full.index("--geotags") + 1] == str(tmp_path) and full[-1].endswith("gcp_list.txt")
