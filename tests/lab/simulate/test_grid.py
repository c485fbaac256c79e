"""Flights as people fly them: the overlaps that were asked for, the plots covered, the ground followed."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from treedgs_geo.core.errors import InputError
from treedgs_geo.reconstruction.cameras import View
from treedgs_lab.benchmarks.plot import TruePlot
from treedgs_lab.simulate import grid, layout, terrain
from treedgs_lab.simulate.camera import make_camera
from treedgs_lab.simulate.flight import rotation_from_angles
from treedgs_lab.simulate.settings import SimulateSettings, resolve
from treedgs_lab.simulate.simulate import simulate_plot


def planned(seed=1, **more):
    settings, sizes = resolve(
        SimulateSettings(output="x", preset="plot", flight="grid", image_width=2736, image_height=1824, **more)
    )
    camera = make_camera(settings, sizes)
    rng = np.random.default_rng(seed)
    centres = layout.plot_centres(rng, settings.plots, sizes.radius_m)
    area = grid.survey_area(rng, centres, sizes.radius_m)
    return settings, sizes, camera, centres, grid.grid_shots(rng, settings, camera, area)


def views_of(shots, camera):
    views = []
    for shot in shots:
        rotation = rotation_from_angles(shot.yaw_deg, shot.pitch_deg, shot.roll_deg)
        views.append(View("", "", camera, rotation, -rotation @ shot.xyz, shot.flight))
    return views


def seen(view, xy):
    pixels, _ = view.project(np.column_stack([xy, np.zeros(len(xy))]))
    return view.contains(pixels)


@pytest.mark.parametrize("height, front, side", [(70.0, 80.0, 70.0), (120.0, 70.0, 60.0)])
def test_overlaps_are_those_asked_for(height, front, side):
    """Share of a photo's ground that the next photo of the line, and the nearest of the next line, sees too."""
    _, _, camera, _, shots = planned(
        plots=9, height_m=height, front_overlap_pct=front, side_overlap_pct=side, oblique_deg=0.0
    )
    views = views_of(shots, camera)
    width, tall = (n / camera.fx * height for n in (camera.width, camera.height))
    cells = np.stack(np.meshgrid(np.linspace(-0.48, 0.48, 40), np.linspace(-0.48, 0.48, 40)), -1).reshape(-1, 2)
    along, across = [], []
    for k in range(len(shots)):
        turn = grid.axes(shots[k].yaw_deg)
        ground = shots[k].xyz[:2] + cells @ (turn[::-1] * [[width], [tall]])
        shares = np.array([seen(view, ground).mean() for view in views])
        offset = (np.array([shot.xyz[:2] for shot in shots]) - shots[k].xyz[:2]) @ turn.T
        ahead = np.flatnonzero((np.abs(offset[:, 1]) < 2) & (offset[:, 0] > 2))
        beside = np.flatnonzero((np.abs(offset[:, 0]) < 2) & (offset[:, 1] > 2))
        along += [shares[ahead[np.argmin(offset[ahead, 0])]]] if len(ahead) else []
        across += [shares[beside[np.argmin(offset[beside, 1])]]] if len(beside) else []
    assert len(along) > 5 and len(across) > 5
    # The lines are spread evenly, so that there is a little more than was asked for.
    assert front - 2 < 100 * np.mean(along) < front + 8
    assert side - 2 < 100 * np.mean(across) < side + 12


def test_plots_are_covered_from_all_sides_and_aimed_at_by_nobody():
    settings, sizes, camera, centres, shots = planned(plots=4)
    views = views_of(shots, camera)
    ring = np.array([[np.cos(a), np.sin(a)] for a in np.linspace(0, 2 * np.pi, 12)])
    for centre in centres:
        rim = centre + sizes.radius_m * ring
        covered = np.array([seen(view, rim).all() for view in views])
        nadir = np.array([shot.kind == "nadir" for shot in shots])
        assert (covered & nadir).sum() >= 4
        # From the four directions of the crosshatch.
        yaw = np.array([shot.yaw_deg for shot in shots])[covered & ~nadir]
        assert len(set(np.round((yaw - yaw[0]) / 90) % 4)) == 4
    assert {shot.flight for shot in shots if shot.kind == "oblique"} == {1}
    tilt = np.array([90 + shot.pitch_deg for shot in shots if shot.kind == "oblique"])
    assert tilt.mean() == pytest.approx(settings.oblique_deg, abs=0.2)
    # Photos' middles do not gather at the plots.
    middle = np.array([s.xyz[:2] + s.xyz[2] * np.tan(np.radians(90 + s.pitch_deg)) * grid.axes(s.yaw_deg)[0]
                       for s in shots])  # fmt: skip
    gaps = np.min([np.hypot(*(middle - centre).T) for centre in centres], axis=0)
    assert np.median(gaps) > 8


def test_plots_lie_apart():
    centres = layout.plot_centres(np.random.default_rng(0), 7, 10.0)
    gaps = [np.hypot(*(a - b)) for k, a in enumerate(centres) for b in centres[:k]]
    assert len(centres) == 7 and min(gaps) > 20


def test_terrain_following_keeps_the_height_above_ground():
    _, _, _, _, shots = planned(plots=4)
    ground = terrain.make_ground(np.random.default_rng(3), 150, 30.0, 0.1, 0.5)
    followed = grid.follow_terrain(shots, ground)
    height, above = (
        np.array([s.xyz[2] for s in followed]),
        [s.xyz[2] - ground.height(s.xyz[None, :2])[0] for s in followed],
    )
    assert np.ptp(height) > 10
    assert np.abs(np.array(above) - 70).max() < 1.5


def test_what_does_not_go_together_is_refused():
    with pytest.raises(InputError, match="--photos"):
        resolve(SimulateSettings(output="x", flight="grid", photos=40))
    with pytest.raises(InputError, match="--grid: plots"):
        resolve(SimulateSettings(output="x", plots=2))
    with pytest.raises(InputError, match="--grid front_overlap_pct"):
        planned(plots=16, front_overlap_pct=95.0, side_overlap_pct=95.0)


@pytest.fixture(scope="module")
def surveyed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sim") / "two"
    simulate_plot(
        SimulateSettings(
            output=folder, preset="micro", seed=6, flight="grid", plots=2, height_m=60.0, gsd_cm=5.0, samples=1,
            image_width=400, image_height=300, front_overlap_pct=20.0, side_overlap_pct=0.0, slope_pct=20.0,
            leaf_area_m2=0.0, shrubs_per_m2=0.02, saplings_per_m2=0.0, lidar_density_m2=5.0, terrain_following=True,
        )
    )  # fmt: skip
    return folder


def read(path):
    with open(path, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_two_plots_share_the_photos_and_have_their_own_trees(surveyed):
    plots, trees, tally = (read(surveyed / n) for n in ("plots.csv", "truth/trees.csv", "field_trees.csv"))
    ids = [row["plot_id"] for row in plots]
    assert ids == ["two_1", "two_2"]
    truth = TruePlot.load(surveyed)
    config = json.loads((surveyed / "truth" / "config.json").read_text())
    assert np.allclose(truth.centres, config["plot_centres_local_m"]) and len(truth.centres) == 2
    views = {view.name: view for view in truth.views()}
    assert len(views) == len(list((surveyed / "images").iterdir())) > 10
    for plot_id, centre, row in zip(ids, truth.centres, plots, strict=True):
        own = [t for t in trees if t["plot_id"] == plot_id and t["in_plot"] == "True"]
        assert own and len([t for t in tally if t["plot_id"] == plot_id]) == len(own)
        away = [np.hypot(float(t["x_bh"]) - centre[0], float(t["y_bh"]) - centre[1]) for t in own]
        assert max(away) < float(row["radius_m"]) + 0.4
        place = np.array([float(row["easting"]), float(row["northing"])]) - truth.frame.origin[:2]
        assert np.hypot(*(place - centre)) < 1.2
        framed = {r["image"] for r in read(surveyed / "truth" / "visibility.csv")
                  if r["in_frame"] == "1" and r["tree_id"] in {t["tree_id"] for t in own}}  # fmt: skip
        assert len({views[name].flight for name in framed}) == 2
    # Both plots' trees are scored.
    assert truth.trees[truth.trees["near"]]["plot_id"].nunique() == 2


def test_a_grid_photo_shows_ground_everywhere(surveyed):
    import cv2

    for path in sorted((surveyed / "images").iterdir())[::5]:
        image = cv2.imread(str(path)).astype(float)
        # Open sky would be blue.
        assert (image[..., 0] > image[..., 2] + 20).mean() < 0.01
