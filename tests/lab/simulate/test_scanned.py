"""Plots rendered from a scan: patches close surfaces without making them thicker, and truth is what the scan says."""

from __future__ import annotations

import json

import numpy as np
import pytest

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import make_reporter
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import write_cloud
from treedgs_lab.benchmarks.plot import TruePlot
from treedgs_lab.simulate.casting import cast, make_scene
from treedgs_lab.simulate.scanned import read_scan, scanned_settings
from treedgs_lab.simulate.settings import SimulateSettings
from treedgs_lab.simulate.simulate import simulate_plot
from treedgs_lab.simulate.surfels import surfels

#: x, y and radius of the stems, m; the ground rises by this along x.
STEMS, SLOPE = ((-1.2, 0.8, 0.10), (1.5, -1.0, 0.16)), 0.08


def tube(rng: np.random.Generator, radius_m: float, height_m: float, spacing_m: float, noise_m: float) -> np.ndarray:
    count = int(2 * np.pi * radius_m * height_m / spacing_m**2)
    turn, far = rng.uniform(0, 2 * np.pi, count), radius_m + rng.normal(0, noise_m, count)
    return np.column_stack([far * np.cos(turn), far * np.sin(turn), rng.uniform(0, height_m, count)])


@pytest.fixture(scope="module")
def cloud(tmp_path_factory):
    rng = np.random.default_rng(3)
    xy = rng.uniform(-3.5, 3.5, (60_000, 2))
    parts = [np.column_stack([xy, SLOPE * xy[:, 0] + rng.normal(0, 0.008, len(xy))])]
    for x, y, radius in STEMS:
        parts.append(tube(rng, radius, 5.5, 0.014, 0.003) + [x, y, SLOPE * x])
    path = tmp_path_factory.mktemp("scan") / "two.laz"
    write_cloud(path, PointCloud(np.concatenate(parts) + [500.0, 900.0, 80.0]))
    return path


@pytest.mark.parametrize(
    "spacing_m, noise_m, most_cm", [(0.012, 0.0, 0.15), (0.012, 0.005, 0.2), (0.02, 0.003, 0.2), (0.038, 0.005, 0.8)]
)
def test_patches_close_a_stem_and_keep_its_width(spacing_m, noise_m, most_cm):
    rng, radius = np.random.default_rng(1), 0.1
    corners = surfels(tube(rng, radius, 3.0, spacing_m, noise_m), rng, 0.016).corners
    scene = make_scene(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    across = np.linspace(-0.16, 0.16, 641)
    widths, open_ = [], []
    for turn in np.linspace(0, np.pi, 12, endpoint=False):
        ahead, side = np.array([np.cos(turn), np.sin(turn), 0]), np.array([-np.sin(turn), np.cos(turn), 0])
        for z in np.linspace(1.2, 1.6, 9):
            start = across[:, None] * side - 0.5 * ahead + [0, 0, z]
            met = np.isfinite(cast(scene, np.column_stack([start, np.tile(ahead, (len(start), 1))]))[0])
            widths.append(np.ptp(across[met]))
            open_.append(1 - met[np.abs(across) < 0.9 * radius].mean())
    assert abs(100 * np.mean(widths) - 20) < most_cm
    assert np.mean(open_) < 0.005


def test_the_ground_goes_on_beyond_the_scan_without_a_step(cloud):
    scan = read_scan(cloud, make_reporter("quiet"))
    assert np.allclose(scan.slope, [SLOPE, 0], atol=0.01)
    edge = scan.half_m[0]
    inner, outer = scan.height(np.array([[edge - 0.01, 0.5], [edge + 0.01, 0.5]]))
    assert abs(outer - inner) < 0.01
    far = np.array([[20.0, -7.0]])
    assert abs(scan.height(far)[0] - SLOPE * 20) < 0.1


def test_a_plot_from_a_scan(cloud, tmp_path):
    folder = tmp_path / "plot"
    small = {"image_width": 480, "image_height": 360, "samples": 2, "lidar_density_m2": 0.0, "photos": 10, "seed": 2}
    found = simulate_plot(SimulateSettings(output=folder, preset="micro", from_cloud=cloud, **small))
    assert found["n_photos"] == 10 and found["n_stems"] == 2
    record = json.loads((folder / "truth" / "config.json").read_text())
    assert record["config"]["from_cloud"] == "two.laz"
    plot = TruePlot.load(folder)
    stems = plot.trees[plot.trees["in_plot"]]
    wanted = np.array([(x, y, 200 * radius) for x, y, radius in STEMS])
    # Where they stand in the scan's own coordinates.
    place = stems[["x_bh", "y_bh"]].to_numpy() + record["scan_origin"][:2] - [500.0, 900.0]
    order = np.argsort(place[:, 0])
    assert np.allclose(place[order], wanted[:, :2], atol=0.02)
    assert np.allclose(stems["dbh_cm"].to_numpy()[order], wanted[:, 2], atol=0.3)
    assert np.allclose(stems["rendered_cm"], stems["dbh_cm"], atol=0.4)
    # Nothing stands before them but their own mirrored neighbours.
    assert stems["n_unoccluded_bh_views"].min() >= 4
    assert (plot.trees.loc[~plot.trees["in_plot"], "kind"] == "copy").all()


def test_what_a_scan_cannot_say_is_refused(cloud, tmp_path):
    scan = read_scan(cloud, make_reporter("quiet"))
    with pytest.raises(InputError, match="leave labels"):
        scanned_settings(SimulateSettings(output=tmp_path, labels=True), scan)
    bare = tmp_path / "bare.laz"
    xy = np.random.default_rng(1).uniform(-3, 3, (20_000, 2))
    write_cloud(bare, PointCloud(np.column_stack([xy, np.zeros(len(xy))])))
    with pytest.raises(InputError):
        read_scan(bare, make_reporter("quiet"))
