"""Label images: what every pixel of a simulated photo shows."""

from __future__ import annotations

import numpy as np
import pytest

from treedgs_lab.benchmarks.plot import TruePlot
from treedgs_lab.simulate.labels import FOLIAGE, STEM, WOOD, read_labels, write_labels
from treedgs_lab.simulate.settings import SimulateSettings
from treedgs_lab.simulate.simulate import simulate_plot

BARE = {
    "preset": "micro",
    "photos": 9,
    "lidar_density_m2": 0.0,
    "image_width": 400,
    "image_height": 320,
    "leaf_area_m2": 2.0,
    "seed": 5,
}


@pytest.fixture(scope="module")
def labelled(tmp_path_factory):
    folder = tmp_path_factory.mktemp("labels") / "plot"
    simulate_plot(SimulateSettings(output=folder, labels=True, **BARE))
    return folder


def test_each_photo_has_its_labels_and_stems_stand_where_the_truth_says(labelled):
    plot = TruePlot.load(labelled)
    views = plot.views()
    assert sorted(path.stem for path in (labelled / "truth" / "labels").iterdir()) == sorted(
        view.path.stem for view in views
    )
    trees = plot.trees[plot.trees["in_plot"].astype(str) == "True"]
    axis, beside = [], []
    for view in views:
        shares = read_labels(labelled / "truth" / "labels" / f"{view.path.stem}.png")
        assert shares.shape == (view.camera.height, view.camera.width, 4)
        assert shares.astype(int).sum(axis=2).max() <= 257  # shares of 255, rounded one by one
        points = plot.frame.to_local(trees[["E_bh", "N_bh", "h_bh"]].to_numpy(float))
        pixels, _ = view.project(points)
        inside = view.contains(pixels)
        for u, v in pixels[inside]:
            axis.append(shares[int(v), int(u), STEM])
            beside.append(shares[int(v), (int(u) + 40) % view.camera.width, STEM])
    # A stem hides its own axis; what else hides it is little in a nearly bare stand.
    assert len(axis) > 20 and np.mean(axis) > 130 and np.mean(beside) < 60


def test_ground_foliage_and_wood_all_show(labelled):
    shares = np.concatenate(
        [read_labels(path).reshape(-1, 4) for path in (labelled / "truth" / "labels").iterdir()]
    ).astype(float)
    mean = shares.mean(axis=0) / 255
    ground = 1 - mean.sum()
    assert ground > 0.3
    assert mean[STEM] > 0.01 and mean[FOLIAGE] > 0.01 and mean[WOOD] > 0.001


def test_labels_change_nothing_else_and_are_off_unless_asked_for(labelled, tmp_path):
    simulate_plot(SimulateSettings(output=tmp_path / "plot", name="plot", **BARE))
    assert not (tmp_path / "plot" / "truth" / "labels").exists()
    for photo in sorted((labelled / "images").iterdir()):
        assert photo.read_bytes() == (tmp_path / "plot" / "images" / photo.name).read_bytes()


def test_written_labels_are_read_back(tmp_path):
    shares = np.random.default_rng(0).integers(0, 256, (20, 30, 4), dtype=np.uint8)
    write_labels(tmp_path / "labels" / "a.png", shares)
    assert (read_labels(tmp_path / "labels" / "a.png") == shares).all()
    with pytest.raises(FileNotFoundError, match="no label image"):
        read_labels(tmp_path / "labels" / "b.png")
