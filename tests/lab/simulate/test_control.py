"""Ground control of the simulator: plates that photos show where the marks say, and receivers without PPK."""

from __future__ import annotations

import csv
import json

import cv2
import numpy as np
import pytest
from bare_stem import side_view, stem_world
from PIL import Image

from treedgs_geo.geotags.control import read_control_rows
from treedgs_lab.benchmarks.plot import TruePlot
from treedgs_lab.simulate import control
from treedgs_lab.simulate.settings import SimulateSettings
from treedgs_lab.simulate.simulate import simulate_plot

POINTS = 5


@pytest.fixture(scope="module")
def marked(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sim") / "marked"
    simulate_plot(
        SimulateSettings(
            output=folder, preset="micro", seed=8, photos=14, samples=4, stems_per_ha=500.0, leaf_area_m2=6.0,
            lidar_density_m2=0.0, control_points=POINTS, gnss="consumer",
        )
    )  # fmt: skip
    return folder


def marks(folder):
    lines = (folder / "gcp_list.txt").read_text().splitlines()
    assert lines[0] == "EPSG:6344"
    rows = [line.split() for line in lines[1:]]
    return [(np.array(row[:3], float), np.array(row[3:5], float), row[5], row[6]) for row in rows]


def true_points(folder):
    with open(folder / "truth" / "control_points.csv", encoding="utf-8") as stream:
        return {row["label"]: row for row in csv.DictReader(stream)}


def test_survey_and_marks_have_their_noise(marked):
    points, views = true_points(marked), {view.name: view for view in TruePlot.load(marked).views()}
    found = marks(marked)
    assert len(points) == POINTS and len(found) >= 3 * POINTS
    errors, off = {}, []
    for surveyed, pixel, image, label in found:
        row = points[label]
        errors[label] = surveyed - [float(row[k]) for k in ("E", "N", "h")]
        plate = np.array([[float(row[k]) for k in "xyz"]])
        off.append(pixel - views[image].project(plate)[0][0])
    assert 0.001 < np.std(list(errors.values())) < 0.03
    assert np.std(off) == pytest.approx(control.MARK_SD_PX, rel=0.25)
    seen = {label: sum(mark[3] == label for mark in found) for label in points}
    assert seen == {label: int(row["n_photos"]) for label, row in points.items()}


def test_the_chain_reads_the_list(marked):
    crs, rows = read_control_rows(marked / "gcp_list.txt")
    assert crs.to_epsg() == 6344
    assert set(rows["label"]) == set(true_points(marked)) and len(rows) == len(marks(marked))


def test_the_photo_shows_the_plate_where_it_is_marked(marked):
    """The middle of the checkered plate by image gradients (saddle point), against the true projection."""
    points, views = true_points(marked), {view.name: view for view in TruePlot.load(marked).views()}
    off, spread = [], []
    for _, _, image, label in marks(marked):
        plate = np.array([[float(points[label][k]) for k in "xyz"]])
        true = views[image].project(plate)[0][0]
        grey = cv2.imread(str(views[image].path), cv2.IMREAD_GRAYSCALE)
        start = (true - 0.5).astype(np.float32).reshape(1, 1, 2)
        rule = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 0.01)
        corner = cv2.cornerSubPix(grey, start, (3, 3), (-1, -1), rule)[0, 0] + 0.5
        off.append(corner - true)
        u, v = np.floor(true).astype(int)
        patch = grey[v - 5 : v + 6, u - 5 : u + 6]
        spread.append(np.ptp(patch))
    assert np.median(np.abs(off)) < 0.3
    # Light and dark quarters, also in the shade.
    assert min(spread) > 40


def test_a_hidden_plate_is_not_marked():
    world, _, _ = stem_world()
    view = side_view()
    before, behind = np.array([0.6, -1.0, 0.0]), np.array([0.0, 1.2, 0.0])
    assert control.sees(world, view, before)
    assert not control.sees(world, view, behind)
    assert not control.sees(world, view, np.array([30.0, 0.0, 0.0]))


def test_plates_lie_in_the_open_and_apart(marked):
    rows = list(true_points(marked).values())
    xy = np.array([[float(row["x"]), float(row["y"])] for row in rows])
    gaps = [np.hypot(*(a - b)) for k, a in enumerate(xy) for b in xy[:k]]
    assert min(gaps) > 1.0
    stems = json.loads((marked / "truth" / "stems.json").read_text())["stems"]
    feet = np.array([profile[0][2:4] for profile in stems.values()])
    assert min(np.hypot(*(feet - spot).T).min() for spot in xy) > 0.9


def test_a_consumer_drone_has_only_rough_positions(marked):
    assert not list(marked.glob("*.MRK")) and not list(marked.glob("*.pos"))
    plot = TruePlot.load(marked)
    off = []
    for view in plot.views():
        gps = Image.open(view.path).getexif().get_ifd(0x8825)
        data = view.path.read_bytes()
        assert b"RtkFlag" not in data
        off.append(gps[6] - (view.centre[2] + plot.frame.origin[2]))
    off = np.array(off)
    # A bias of metres that changes slowly.
    assert np.abs(off).max() > 0.3 and np.abs(np.diff(off)).max() < 0.6
