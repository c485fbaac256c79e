"""The method comparison on stems of known size, segmentation scores by hand, visibility on painted photos."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pyproj
import pytest
from rasterio.transform import from_origin

from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.terrain.dtm import Dtm
from treedgs_lab.published import methods
from treedgs_lab.published.experiment_charts import robust_trend
from treedgs_lab.published.sections import methods_latex
from treedgs_lab.published.segmentation import score_segmentation, true_labels
from treedgs_lab.published.visibility import SeenStem, agreement, classify, per_stem
from treedgs_lab.simulate.flight import rotation_from_angles

CRS = pyproj.CRS.from_epsg(6344)
DTM = Dtm(np.zeros((40, 40)), from_origin(-10, 30, 1, 1), CRS)
DBH = np.array([18.0, 22.0, 26.0, 30.0, 34.0, 40.0])


@pytest.fixture(scope="module")
def stand():
    """Six stems 5 m apart, 1 cm/m taper below the published slope bound, bark points and a few twigs of low weight."""
    rng = np.random.default_rng(0)
    xyz, label, opacity = [], [], []
    for k, dbh in enumerate(DBH):
        z = rng.uniform(0.2, 5.0, 1500)
        turn, r = rng.uniform(0, 2 * np.pi, 1500), (dbh - 0.2 * (z - 1.37)) / 200 + rng.normal(0, 0.003, 1500)
        xyz.append(np.column_stack([5 * (k % 3) + r * np.cos(turn), 5 * (k // 3) + r * np.sin(turn), z]))
        twigs = rng.uniform(-0.5, 0.5, (60, 3)) + [5 * (k % 3), 5 * (k // 3), 2.0]
        xyz.append(twigs)
        label += [k + 1] * 1560
        opacity += [0.9] * 1500 + [0.05] * 60
    cloud = PointCloud(np.concatenate(xyz), CRS, {"opacity": np.array(opacity, np.float32)})
    place = np.array([[5.0 * (k % 3), 5.0 * (k // 3)] for k in range(6)])
    reference = methods.Reference(np.array(["p"] * 6), np.array([f"t{k}" for k in range(6)]), place, DBH)
    return cloud, np.array(label), reference


def test_every_method_is_judged_on_the_same_stems(stand):
    cloud, label, reference = stand
    own = methods.stem_points(cloud, label, DTM, reference, "opacity")
    lost = methods.stem_points(cloud, np.where(label == 3, 0, label), DTM, reference, "opacity")
    found = methods.compare_methods({"splats": own, "lidar": lost}, reference, share=0.2, seed=3)
    held = found["split"]["held_out"]
    assert len(held) == 1 and found["split"]["test"] == 5
    again = methods.compare_methods({"splats": own}, reference, share=0.2, seed=3)
    assert again["split"]["held_out"] == held and again["powers"]["splats"] == found["powers"]["splats"]
    rows = {(r["source"], r["fit"], r["subset"]): r for r in found["rows"] if r["plot"] == "All"}
    missing = 0 if held == ["p/t2"] else 1
    for fit in methods.FITS:
        assert rows["lidar", fit, "own"]["of"] == 5 and rows["lidar", fit, "own"]["n"] == 5 - missing
        assert rows["splats", fit, "common"]["n"] == rows["lidar", fit, "common"]["n"] <= 5 - missing
    weighted, plain = rows["splats", "weighted circle", "own"], rows["splats", "circle", "own"]
    assert weighted["rmse_cm"] < 4 and weighted["rmse_cm"] <= plain["rmse_cm"] + 0.3
    assert weighted["paper_rmse_cm"] == 4.79 and rows["splats", "circle", "common"]["paper_rmse_cm"] is None
    assert "T-CW" in methods_latex(found["rows"]) and found["estimates"]["splats, cylinder"].shape == (6,)


def test_the_exponent_is_chosen_on_held_out_stems_alone(stand):
    cloud, label, reference = stand
    held = methods.hold_out(6, 0.3, 1)
    spoiled = methods.Reference(reference.plot, reference.tree, reference.xy, np.where(held, DBH, 99.0))
    own = methods.stem_points(cloud, label, DTM, reference, "opacity")
    a = methods.choose_power(own, reference, held)
    b = methods.choose_power(own, spoiled, held)
    assert a == b and {row["held_out"] for row in a[1]} == {2}


def test_a_circle_that_never_fails_and_is_never_right_is_not_chosen():
    errors = {0.6: [3.0] * 9 + [np.nan], 0.7: [4.0] * 9 + [np.nan], 1.5: [16.0] * 10}
    sweep = [methods.power_row(power, np.array(own)) for power, own in errors.items()]
    assert [row["measured"] for row in sweep] == [9, 9, 10] and methods.best_power(sweep) == 0.6
    # A failure is worse than a small error, and stems that all fail choose nothing better than the first.
    assert (
        methods.best_power([methods.power_row(0.6, np.array([1.0, np.nan])), methods.power_row(1, np.full(2, 5.0))])
        == 1
    )
    assert methods.best_power([methods.power_row(p, np.full(3, np.nan)) for p in (0.4, 0.6)]) == 0.4


def test_hold_out_keeps_one_on_each_side():
    assert methods.hold_out(3, 0.01, 0).sum() == 1 and methods.hold_out(3, 0.99, 0).sum() == 2
    assert (methods.hold_out(50, 0.1, 7) == methods.hold_out(50, 0.1, 7)).all()
    assert methods.hold_out(50, 0.1, 7).sum() == 5


def test_ablation_has_a_default_row_a_setting(stand):
    cloud, label, reference = stand
    own = methods.stem_points(cloud, label, DTM, reference, "opacity")
    rows = methods.ablate(own, reference, methods.hold_out(6, 0.2, 0), 0.6)
    default = [row for row in rows if row["default"]]
    assert len(default) == len(methods.ABLATION) and len({row["rmse_cm"] for row in default}) == 1
    assert {row["value"] for row in rows if row["setting"] == "kappa, cm/m"} >= {"unbounded", 0.3}


def test_segmentation_scores_by_hand():
    found = score_segmentation(np.array([1, 1, 1, 0, 0, 2, 2]), np.array([5, 5, 0, 5, 0, 6, 5]))
    assert (found["tp"], found["fp"], found["fn"], found["tn"]) == (4, 1, 1, 1)
    assert found["precision"] == 0.8 and found["recall"] == 0.8 and found["iou"] == pytest.approx(4 / 6, abs=1e-4)
    assert found["f1"] == 0.8 and found["accuracy"] == pytest.approx(5 / 7, abs=1e-4) and found["same_stem"] == 0.75
    empty = score_segmentation(np.zeros(3), np.zeros(3))
    assert empty["precision"] is None and empty["recall"] is None and empty["accuracy"] == 1


def test_true_labels_follow_a_leaning_stem(tmp_path):
    profile = [[s, 30 - s, 1 + 0.2 * s, 2.0, s] for s in np.arange(0, 8.01, 0.5)]
    path = tmp_path / "stems.json"
    path.write_text(json.dumps({"origin": [100.0, 200.0, 50.0], "stems": {"T1": profile}}))
    local = np.array([[1.0, 2.0, 0.1], [1.8 + 0.13, 2, 4.0], [1.0, 2, 4.0], [1.8, 2 + 0.2, 4.0], [2.4, 2, 9.0]])
    assert true_labels(local + [100, 200, 50], path).tolist() == [1, 1, 0, 0, 0]


def test_trend_bins_are_medians_and_skip_the_lonely():
    dbh = np.array([11.0, 12, 13, 21, 32, 33])
    error = np.array([1.0, 2, 90, 5, np.nan, 3])
    assert robust_trend(dbh, error).tolist() == [[12.5, 2.0, 3.0]]


def painted(folder: Path, name: str, yaw: float, covered: float) -> View:
    """A photo of a brown stem at the origin on yellowish ground; green over this share of its band."""
    camera = Camera(300, 240, 1900.0, 1900.0, 150.0, 120.0)
    turn = np.radians(yaw)
    centre = np.array([-30 * np.sin(turn), -30 * np.cos(turn), 46.0])
    rotation = rotation_from_angles(yaw, -56.9, 0.0)
    view = View(name, folder / name, camera, rotation, -rotation @ centre)
    rng = np.random.default_rng(int(yaw))
    image = np.clip(rng.normal((90, 120, 130), 12, (240, 300, 3)), 0, 255).astype(np.uint8)
    side = np.array([np.cos(turn), -np.sin(turn), 0]) * 0.15
    z = np.array([0, 0, 1.0])

    def quad(low: float, high: float) -> np.ndarray:
        corners = np.array([-side + low * z, side + low * z, side + high * z, -side + high * z])
        return np.round(view.project(corners)[0]).astype(np.int32)

    cv2.fillPoly(image, [quad(0, 6)], (70, 85, 105))
    if covered:
        cv2.fillPoly(image, [quad(1.0 - 0.1, 1.0 + 0.8 * covered)], (40, 120, 60))
    cv2.imwrite(str(view.path), image)
    return view


def test_covered_bands_are_called_so(tmp_path):
    covers = [0, 0, 0, 0.5, 1.0, 0.1, 0, 1.2]
    views = [painted(tmp_path, f"{k}.png", 45.0 * k, cover) for k, cover in enumerate(covers)]
    table = classify(views, [SeenStem(0.0, 0.0, 0.0, 0.3)])
    free = table.set_index("image")["free"]
    assert len(table) == 8 and [bool(free[f"{k}.png"]) for k in range(8)] == [c < 0.3 for c in covers]
    summary = per_stem(table, 2)
    assert summary["free_views"].tolist() == [5, 0]
    assert summary["width_px"][0] == pytest.approx(1900 * 0.3 / 54, rel=0.05)
    truth = pd.DataFrame(
        {
            "tree_id": "a",
            "image": [f"{k}.png" for k in range(8)],
            "in_frame": 1,
            "foreshortening": 0.6,
            "visible_fraction": [1 - min(c, 1.0) for c in covers],
        }
    )
    reported = agreement(table, ["a"], truth)
    assert reported["precision"] == 1 and reported["recall"] == 1 and reported["views"] == 8


def test_a_stem_out_of_every_photo_is_seen_by_none(tmp_path):
    table = classify([painted(tmp_path, "0.png", 0.0, 0)], [SeenStem(500.0, 0.0, 0.0, 0.3)])
    assert len(table) == 0 and per_stem(table, 1)["free_views"].tolist() == [0]
