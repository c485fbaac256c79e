"""The ground behind the stems: silhouettes of known width on a simulated plot."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from treedgs_geo.core.crs import LocalFrame, project_crs
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.stems.photos.fit.null_model import BREAST
from treedgs_geo.stems.photos.images.axis_patches import StemAxis
from treedgs_geo.stems.photos.images.background import cut_silhouette, make_backdrop
from treedgs_geo.stems.photos.images.crops import GroundGrid, PhotoStack, load_stack
from treedgs_geo.terrain.dtm import read_dtm

RADII = np.arange(0.03, 0.40, 0.01)


@pytest.fixture(scope="module")
def scene(simulated_plot) -> tuple[PhotoStack, GroundGrid, Area, list[dict[str, str]]]:
    """Crops with the true cameras, the true ground, the plot and its stems."""
    config = json.loads((simulated_plot / "truth" / "config.json").read_text())
    frame = LocalFrame(project_crs("EPSG:6344"), np.array(config["origin_E_N_h"], float))
    views = [_view(row, simulated_plot / "images") for row in _rows(simulated_plot / "truth" / "cameras.csv")]
    plot = _rows(simulated_plot / "plots.csv")[0]
    x, y = float(plot["easting"]) - frame.origin[0], float(plot["northing"]) - frame.origin[1]
    area = Area.circle(x, y, float(plot["radius_m"]))
    ground = GroundGrid.sample(read_dtm(simulated_plot / "dtm.tif", frame.crs).local(frame).height, area, 4.0)
    stems = [row for row in _rows(simulated_plot / "truth" / "trees.csv") if row["in_plot"] == "True"]
    return load_stack(views, area, ground, 96, 2.0), ground, area, stems


def _rows(path: Path) -> list[dict[str, str]]:
    with open(path, newline="") as stream:
        return list(csv.DictReader(stream))


def _view(row: dict[str, str], photos: Path) -> View:
    size = int(row["width"]), int(row["height"])
    camera = Camera(*size, *(float(row[name]) for name in ("fx", "fy", "cx", "cy", "k1", "k2")))
    rotation = np.array([[float(row[f"r{i}{j}"]) for j in range(3)] for i in range(3)])
    translation = np.array([float(row[name]) for name in ("tx", "ty", "tz")])
    return View(row["image"], photos / row["image"], camera, rotation, translation, int(row["flight"]))


def _axis(ground: GroundGrid, xy: np.ndarray) -> StemAxis:
    return StemAxis(xy, np.zeros(2), np.zeros(2), float(ground.at(xy[:1], xy[1:])[0]), 1.37)


def test_silhouettes_are_as_wide_as_the_stems(scene):
    stack, ground, area, stems = scene
    backdrop = make_backdrop(stack, ground, area.bounds(4.0))
    assert backdrop is not None and np.isfinite(backdrop.mean).mean() > 0.5
    errors = []
    for stem in stems:
        xy = np.array([float(stem["x_bh"]), float(stem["y_bh"])])
        outline = cut_silhouette(stack, backdrop, ground, _axis(ground, xy + [0.05, -0.03]), BREAST.silhouette)
        shapes = outline.peaks(RADII)
        # The stem is among the silhouettes proposed: right place, right width.
        near = [abs(200 * s[4] - float(stem["dbh_cm"])) for s in shapes if np.hypot(s[0] + 0.05, s[1] - 0.03) < 0.06]
        errors.append(min(near, default=99.0))
    assert np.median(errors) < 3.0


def test_stems_stand_out_from_open_ground(scene):
    stack, ground, area, stems = scene
    backdrop = make_backdrop(stack, ground, area.bounds(4.0))
    true = np.array([[float(stem["x_bh"]), float(stem["y_bh"])] for stem in stems])
    rng = np.random.default_rng(0)
    places = area.centres[0] + rng.uniform(-1, 1, (60, 2)) * area.radii_m[0]
    open_ground = places[np.linalg.norm(places[:, None] - true[None], axis=2).min(axis=1) > 1.0][:12]
    assert len(open_ground) >= 5

    def best(xy: np.ndarray) -> float:
        outline = cut_silhouette(stack, backdrop, ground, _axis(ground, xy), BREAST.silhouette)
        return max((outline.contrast(shape) for shape in outline.peaks(RADII, most=1)), default=0.0)

    assert np.median([best(xy) for xy in true]) > 1.5 * np.median([best(xy) for xy in open_ground])


def test_too_few_photos_give_no_ground(scene):
    stack, ground, area, _ = scene
    few = PhotoStack(
        stack.views[:4],
        stack.pixels,
        stack.start[:4],
        stack.shape[:4],
        stack.corner[:4],
        stack.camera[:4],
        stack.centre[:4],
    )
    assert make_backdrop(few, ground, area.bounds(2.0)) is None
