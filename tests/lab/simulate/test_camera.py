"""The simulated camera: rolling shutter, motion blur, lens and drift do what the projections say."""

from __future__ import annotations

import dataclasses
import json
import shutil

import numpy as np
import pandas as pd
import pytest
from bare_stem import CAMERA, side_view, stem_columns, stem_world

from treedgs_geo.core.errors import InputError
from treedgs_geo.reconstruction.cameras import Camera
from treedgs_lab.benchmarks.plot import TruePlot
from treedgs_lab.simulate.camera import STILL, camera_of_flight, make_camera, motions
from treedgs_lab.simulate.render import radiance
from treedgs_lab.simulate.settings import SIZES, SimulateSettings

WIDE = Camera(640, 400, 900.0, 900.0, 325.0, 196.0, k1=-0.02, k2=0.01)


@pytest.fixture(scope="module")
def scene():
    return stem_world()


def seen(scene, view, motion=STILL):
    world, light, _ = scene
    return radiance(world, light, view, 8, 1, haze=0.0, motion=motion)


def projected_columns(axis, view):
    """(H,) where the stem's axis lies in each row by the view's projection."""
    pixels, _ = view.project(axis)
    order = np.argsort(pixels[:, 1])
    rows = np.arange(view.camera.height) + 0.5
    return np.interp(rows, pixels[order, 1], pixels[order, 0], left=np.nan, right=np.nan)


def check_shear(scene, view, motion, least_px):
    """The stem moves in the image as the projection moves it, row by row (mean of eleven)."""
    plain = dataclasses.replace(view.camera, k1=-0.02, k2=0.01, k3=0.0, p1=0.0, p2=0.0)
    still = dataclasses.replace(view, camera=plain, readout_travel_m=np.zeros(3))
    moved = stem_columns(seen(scene, view, motion)) - stem_columns(seen(scene, still))
    expected = projected_columns(scene[2], view) - projected_columns(scene[2], still)
    moved, expected = (np.convolve(part, np.ones(11) / 11, "valid") for part in (moved, expected))
    good = np.isfinite(moved) & np.isfinite(expected)
    assert good.sum() > 150
    assert np.abs(expected[good]).max() > least_px
    assert np.abs(moved[good] - expected[good]).max() < 0.2


def test_a_stem_is_sheared_by_the_readout_as_the_view_says(scene):
    travel = np.array([0.24, 0.10, 0.0])  # 12 m/s for 20 ms
    check_shear(scene, side_view(travel_m=travel), STILL._replace(readout_travel_m=travel), 5.0)


@pytest.mark.parametrize("lens", [dict(p1=0.02), dict(p2=-0.02), dict(k1=-0.11, k2=0.12, k3=-1.5, p1=0.001)])
def test_the_lens_draws_as_it_projects(scene, lens):
    check_shear(scene, side_view(dataclasses.replace(WIDE, **lens), yaw_deg=14.0), STILL, 0.4)


def test_a_turning_camera_shears_too(scene):
    turn = STILL._replace(readout_turn_rad=np.array([0.0, 0.004, 0.0]))
    moved = stem_columns(seen(scene, side_view(), turn)) - stem_columns(seen(scene, side_view()))
    good = np.flatnonzero(np.isfinite(moved))
    expected = -0.004 * CAMERA.fx * (good + 0.5) / CAMERA.height
    assert np.polyfit(expected, moved[good], 1)[0] == pytest.approx(1.0, abs=0.05)


def edge_width(image):
    """Pixels between 20 and 80 % of the step at the stem's left edge, mean over rows near breast height."""
    rows = image[200:260, :, 1]
    step = np.sort(rows[:, :160].mean(axis=0))[::-1] / rows.max()
    return int(((step > 0.2) & (step < 0.8)).sum())


def test_exposure_blurs_edges_across_the_flight(scene):
    across = STILL._replace(exposure_travel_m=np.array([0.16, 0.0, 0.0]))
    along = STILL._replace(exposure_travel_m=np.array([0.0, 0.0, 0.16]))
    sharp, wide, lengthwise = (edge_width(seen(scene, side_view(), m)) for m in (STILL, across, along))
    expected_px = 0.6 * 0.16 * CAMERA.fx / 37
    assert wide - sharp == pytest.approx(expected_px, abs=1.5)
    assert lengthwise <= sharp + 1


def test_motion_comes_from_the_flight():
    settings = SimulateSettings(output="x", readout_ms=20.0, exposure_ms=2.0, gimbal_rate_deg_s=0.5)
    velocity = np.tile([3.0, -4.0, 0.0], (400, 1))
    found = motions(settings, velocity, np.random.default_rng(0))
    assert np.allclose(found[0].readout_travel_m, [0.06, -0.08, 0]) and np.allclose(
        found[0].exposure_travel_m, [0.006, -0.008, 0]
    )
    turns = np.degrees([move.readout_turn_rad for move in found])
    assert turns.std() == pytest.approx(0.5 * 0.020, rel=0.1)


def test_focal_drift_and_folded_lenses():
    camera = make_camera(SimulateSettings(output="x"), SIZES["micro"])
    assert camera_of_flight(camera, 0.001, 0) == camera
    assert camera_of_flight(camera, 0.001, 2).fx == pytest.approx(1.002 * camera.fx)
    wide = dataclasses.replace(SIZES["micro"], image_width=6000, image_height=4000)
    with pytest.raises(InputError, match="--camera k1"):
        make_camera(SimulateSettings(output="x", k1=-0.5), wide)


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A small plot from a drone that does not stop, without leaves."""
    from treedgs_lab.simulate.simulate import simulate_plot

    folder = tmp_path_factory.mktemp("sim") / "flown"
    simulate_plot(
        SimulateSettings(
            output=folder, preset="micro", seed=4, photos=10, image_width=320, image_height=280, samples=1,
            leaf_area_m2=0.0, shrubs_per_m2=0.0, lidar_density_m2=0.0, float_epochs=0, readout_ms=20.0,
            exposure_ms=2.0, flight_speed_m_s=6.0, p1=0.0009, p2=-0.0007, k3=-0.3, focal_drift=0.001,
        )
    )  # fmt: skip
    return folder


def test_truth_has_lens_drift_and_travel(flown):
    plot = TruePlot.load(flown)
    views = plot.views()
    assert {(v.camera.p1, v.camera.p2, v.camera.k3) for v in views} == {(0.0009, -0.0007, -0.3)}
    focal = {v.flight: v.camera.fx for v in views}
    assert focal[1] / focal[0] == pytest.approx(1.001, abs=1e-7)
    length = np.array([np.linalg.norm(v.readout_travel_m) for v in views])
    assert np.allclose(length, 6.0 * 0.020, atol=1e-5)


def test_another_renderers_plot_gets_lens_and_travel_from_config_and_track(flown, tmp_path):
    """The same plot without the columns that another renderer does not write: velocity from the .pos at the photos."""
    folder = tmp_path / "other"
    shutil.copytree(flown, folder, ignore=shutil.ignore_patterns("images"))
    cameras = pd.read_csv(folder / "truth" / "cameras.csv")
    gone = ["p1", "p2", "k3", "travel_e_m", "travel_n_m", "travel_u_m"]
    cameras.drop(columns=gone).to_csv(folder / "truth" / "cameras.csv", index=False)
    config = json.loads((folder / "truth" / "config.json").read_text())
    config["config"]["readout_s"] = 0.020
    (folder / "truth" / "config.json").write_text(json.dumps(config))
    stated, derived = TruePlot.load(flown).views(), TruePlot.load(folder).views()
    assert [v.camera for v in derived] == [v.camera for v in stated]
    off = np.array([b.readout_travel_m - a.readout_travel_m for a, b in zip(stated, derived, strict=True)])
    # 1.5 cm of noise that changes within seconds is some centimetres a second: millimetres in 20 ms.
    assert np.abs(off[1:-1]).max() < 0.006 and np.sqrt(np.mean(off[1:-1] ** 2)) < 0.0025
    del config["config"]["readout_s"]
    (folder / "truth" / "config.json").write_text(json.dumps(config))
    assert not any(v.readout_travel_m.any() for v in TruePlot.load(folder).views())


def test_a_hovering_drone_does_not_travel():
    found = motions(SimulateSettings(output="x", readout_ms=20.0), np.zeros((3, 3)), np.random.default_rng(0))
    assert all(not move.readout_travel_m.any() and not move.readout_turn_rad.any() for move in found)
