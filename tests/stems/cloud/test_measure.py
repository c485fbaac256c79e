"""Taper, cylinder, the published chain and whole clouds: numbers, errors, refusals."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from affine import Affine
from shared_data import needs_shared
from synthetic_cloud import plot_cloud, stem_points

from treedgs_geo.core.errors import InputError
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.stems.cloud.estimate.cloud import measure_cloud, measure_stems, point_weights
from treedgs_geo.stems.cloud.estimate.options import MeasureOptions
from treedgs_geo.stems.cloud.estimate.published import PublishedOptions, measure_published
from treedgs_geo.stems.cloud.estimate.stem import measure_points
from treedgs_geo.stems.cloud.propose.sensors import SENSORS
from treedgs_geo.stems.geometry.cylinder import fit_cylinder
from treedgs_geo.stems.geometry.slices import slice_heights, slice_index
from treedgs_geo.stems.geometry.taper import TaperRansac, taper_line, taper_ransac
from treedgs_geo.stems.quality.tree import Tree, with_block_errors
from treedgs_geo.terrain.dtm import Dtm
from treedgs_geo.terrain.ground import dtm_from_cloud, flat_ground


def test_slices_follow_the_equation():
    heights = np.array([0.0, 0.5, 0.51, 1.0, 1.5])
    centres = slice_heights(0.0, 1.0, 0.5)
    np.testing.assert_allclose(centres, [0.0, 0.5, 1.0])
    index = slice_index(heights, centres, 1.0)
    assert [list(i) for i in index] == [[0, 1], [0, 1, 2, 3], [1, 2, 3, 4]]


def test_published_taper_obeys_its_bounds():
    h = np.arange(0, 5, 0.1)
    d = 30 - 0.2 * (h - 1.37)
    d[::6] += 8
    taper = taper_ransac(h, d, 1.37)
    assert taper.at_bh_cm == pytest.approx(30, abs=0.05) and -0.3 <= taper.slope_cm_m < 0
    assert not taper.inliers[::6].any()
    assert taper_ransac(h, 30 + 2.0 * h, 1.37, TaperRansac(threshold_cm=0.3)) is None
    assert taper_ransac(h[:8], d[:8], 1.37) is None


def test_line_with_prior_chooses_its_model():
    rng = np.random.default_rng(0)
    h = np.arange(0.5, 4, 0.1)
    steep = taper_line(h, 30 - 2 * (h - 1.37) + rng.normal(0, 0.2, len(h)), np.full(len(h), 0.2), 1.37)
    assert steep.model == "linear" and steep.at_bh_cm == pytest.approx(30, abs=0.2)
    assert steep.slope_cm_m == pytest.approx(-2, abs=0.3)
    wild = 30 - (h - 1.37) + rng.normal(0, 0.3, len(h))
    wild[:5] += 12
    assert taper_line(h, wild, np.full(len(h), 0.3), 1.37).at_bh_cm == pytest.approx(30, abs=0.4)
    assert taper_line(h[:2], wild[:2], np.ones(2), 1.37) is None


def test_cylinder_reads_low_on_tapering_stems():
    """As published it has no taper and starts too thin: a baseline, biased as research/forest.md 2.4 measured it."""
    errors = []
    for seed in range(4):
        points = stem_points(np.random.default_rng(seed), 25.0, 600, 0.003)
        fitted = fit_cylinder(points)
        errors.append(200 * fitted.r - 25.0)
        assert 1.8 < fitted.height_m < 2.7 and fitted.axis[2] > 0.99
    assert -2.5 < np.mean(errors) < 0.3
    assert fit_cylinder(np.zeros((3, 3))) is None
    flat = np.column_stack([np.random.default_rng(0).uniform(0, 3, (200, 2)), np.full(200, 2.0)])
    assert fit_cylinder(flat) is None


@pytest.mark.parametrize("dbh", [10.0, 25.0, 45.0])
@pytest.mark.parametrize("arc", [360, 200])
def test_default_measure_of_sparse_stems(dbh, arc):
    errors, z = [], []
    for seed in range(10):
        points = stem_points(np.random.default_rng(seed), dbh, 200, 0.012, arc_deg=arc, low=0.3, high=4.5)
        found = measure_points(points, None, SENSORS["uls"]).assessment
        assert found.measured, found.reasons
        errors.append(found.dbh_cm - dbh)
        z.append(errors[-1] / found.se_cm)
    assert abs(np.mean(errors)) < (0.3 if arc == 360 else 0.6) and np.max(np.abs(errors)) < 2.0
    assert np.max(np.abs(z)) < 3.0


def test_default_measure_of_dense_stems_and_breast_height():
    points = stem_points(np.random.default_rng(1), 30.0, 20_000, 0.004, taper_cm_m=2.0)
    dense = measure_points(points, None, SENSORS["tls"], 1.37)
    at_137 = dense.assessment
    at_130 = measure_points(points, None, SENSORS["tls"], 1.30).assessment
    assert at_137.dbh_cm == pytest.approx(30.0, abs=0.15) and at_137.flag == "ok"
    assert at_130.dbh_cm - at_137.dbh_cm == pytest.approx(0.14, abs=0.08)
    assert dense.taper_cm_m == pytest.approx(-2.0, abs=0.4)


@pytest.mark.parametrize("rise", [1.0, -1.0, 0.0])
def test_breast_height_is_above_the_uphill_foot(rise):
    """On 45 degrees it is as much higher as the radius; of a leaning stem it is along the axis, from its own foot."""
    stems, lean = [(3.0, 3.0, 20.0), (3.0, 9.0, 44.0)], np.tan(np.radians(10.0))
    rng = np.random.default_rng(5)
    xyz = plot_cloud(rng, stems, relief=lambda xy: rise * xy[:, 0], bark=4000, noise_m=0.004)
    leaning = stem_points(rng, 30.0, 4000, 0.004, lean=(lean, 0.0), taper_cm_m=0.8, low=-1.0, high=8.0, xy=(9.0, 6.0))
    leaning[:, 2] += 100 + rise * 9.0 + 0.1 * np.sin(2.0)
    xyz = np.concatenate([xyz, leaning])
    trees, _ = measure_cloud(PointCloud(xyz), dtm_from_cloud(xyz))
    assert len(trees) == 3
    for x, y, dbh, slope in [(3.0, 3.0, 20.0, 0.0), (3.0, 9.0, 44.0, 0.0), (9.0, 6.0, 30.0, lean)]:
        tree = min(trees, key=lambda tree: np.hypot(tree.x - x, tree.y - y))
        # The axis meets the ground where both are as high: h metres above the ground at (x, y).
        h = -1.37 * rise * slope / (1 - rise * slope)
        up = h + abs(rise) * dbh / 200 + 1.37 / np.hypot(1.0, slope) - 1.37
        assert tree.dbh_cm == pytest.approx(dbh - 0.8 * up, abs=0.12), (x, y)
        assert tree.z_ground == pytest.approx(
            100 + rise * x + 0.1 * np.sin(y / 3) + h + abs(rise) * dbh / 200, abs=0.05
        )


def test_refusals_have_reasons():
    rng = np.random.default_rng(2)
    few = measure_points(stem_points(rng, 25.0, 12), None, SENSORS["uls"]).assessment
    assert not few.measured and few.reasons == ("few_points",)
    short = measure_points(stem_points(rng, 30.0, 300, 0.01, arc_deg=70), None, SENSORS["uls"]).assessment
    assert short.flag != "ok" or short.se_cm > 1
    cloud = rng.uniform(-0.5, 0.5, (3000, 3)) + (0, 0, 2)
    assert not measure_points(cloud * (1, 1, 3), None, SENSORS["tls"]).assessment.measured
    lobed = measure_points(stem_points(rng, 40.0, 8000, 0.004, lobes=0.35), None, SENSORS["tls"]).assessment
    assert not lobed.measured and "not_round" in lobed.reasons


def test_published_chain_on_filled_stems():
    rng = np.random.default_rng(3)
    stems = []
    for dbh in (20.0, 35.0):
        points = stem_points(rng, dbh, 3000, 0.01, filled=True, taper_cm_m=0.2, low=0.0, high=4.0)
        stems.append((points, np.ones(len(points))))
    results = measure_published(stems, 1.37, PublishedOptions())
    for (_, _), result, dbh in zip(stems, results, (20.0, 35.0), strict=True):
        assert result.taper is not None and result.taper.at_bh_cm == pytest.approx(dbh, abs=3.0)
        assert result.taper.inliers.sum() >= 10
    assert measure_published([(np.empty((0, 3)), np.empty(0))], 1.37)[0].taper is None


def test_whole_cloud_default_and_repeatable():
    truth = [(2.0, 2.5, 14.0), (6.0, 3.0, 30.0), (9.5, 8.0, 22.0)]
    xyz = plot_cloud(np.random.default_rng(4), truth) + (500000.0, 4000000.0, 0.0)
    dtm = dtm_from_cloud(xyz)
    trees, label = measure_cloud(PointCloud(xyz), dtm)
    again, _ = measure_cloud(PointCloud(xyz), dtm)
    assert [vars(tree) for tree in trees] == [vars(tree) for tree in again]
    assert len(trees) == 3 and label.max() == 3
    for x, y, dbh in truth:
        tree = min(trees, key=lambda t: np.hypot(t.x - 500000 - x, t.y - 4000000 - y))
        assert tree.qc_flag == "ok" and tree.dbh_cm == pytest.approx(dbh, abs=0.8)
        assert tree.dbh_lo_cm < tree.dbh_cm < tree.dbh_hi_cm
        assert tree.z_ground == pytest.approx(100 + 0.05 * (tree.x - 500000), abs=0.25)
        assert tree.height_m == pytest.approx(14, abs=0.6)


def test_one_bad_tree_does_not_end_the_run():
    xyz = plot_cloud(np.random.default_rng(5), [(3.0, 3.0, 25.0)])
    dtm = dtm_from_cloud(xyz)
    _, label = measure_cloud(PointCloud(xyz), dtm)
    label = label.astype(int)
    strange = np.flatnonzero(label == 0)[:3]
    label[strange] = 77
    outside = PointCloud(np.vstack([xyz, xyz[:2] + 900]))
    label = np.r_[label, 99, 99]
    trees = {tree.tree_id: tree for tree in measure_stems(outside, label, dtm)}
    assert trees[1].dbh_cm is not None
    assert trees[77].qc_flag == "reject" and trees[77].dbh_cm is None and trees[77].qc_reason
    assert trees[99].qc_reason == "no_ground" and trees[99].z_ground is None
    assert measure_stems(outside, np.zeros(len(outside)), dtm) == []


def test_weights_are_checked():
    cloud = PointCloud(np.zeros((10, 3)), None, {"intensity": np.arange(10, dtype=np.uint16)})
    assert point_weights(cloud, "none") is None
    weights = point_weights(cloud, "intensity")
    assert weights.min() > 0 and weights.max() <= 1
    with pytest.raises(InputError, match="opacity"):
        point_weights(cloud, "opacity")
    with pytest.raises(InputError, match="same intensity"):
        point_weights(PointCloud(np.zeros((3, 3)), None, {"intensity": np.ones(3)}), "intensity")


@pytest.mark.parametrize("method, fit", [("paper", "circle"), ("default", "cylinder"), ("paper", "cylinder")])
def test_other_methods_run_on_a_cloud(method, fit):
    xyz = plot_cloud(np.random.default_rng(6), [(3.0, 3.0, 25.0), (8.0, 8.0, 35.0)], bark=1500)
    trees, _ = measure_cloud(PointCloud(xyz), dtm_from_cloud(xyz), MeasureOptions(method=method, fit=fit))
    assert len(trees) == 2
    for tree, dbh in zip(sorted(trees, key=lambda t: t.x), (25.0, 35.0), strict=True):
        assert tree.dbh_cm is None or abs(tree.dbh_cm - dbh) < 8.0


@pytest.mark.parametrize("plot, rmse", [("plot_a", 0.8), ("plot_e", 1.0)])
def test_rendered_lidar_against_truth(plot, rmse):
    folder = needs_shared(plot)
    cloud = read_cloud(next((folder / "lidar").glob("*.laz")), attributes=("intensity",))
    trees, _ = measure_cloud(cloud, dtm_from_cloud(cloud.xyz, crs=cloud.crs))
    with open(folder / "truth" / "trees.csv", encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if row["in_plot"] == "True"]
    places = np.array([[tree.x, tree.y] for tree in trees])
    errors, inside = [], 0
    for row in rows:
        near = np.hypot(*(places - (float(row["E_bh"]), float(row["N_bh"]))).T)
        tree = trees[int(near.argmin())]
        if near.min() < 0.3 and tree.dbh_cm is not None:
            errors.append(tree.dbh_cm - float(row["dbh_cm"]))
            inside += tree.dbh_lo_cm <= float(row["dbh_cm"]) <= tree.dbh_hi_cm
    assert len(errors) >= 0.95 * len(rows)
    assert np.sqrt(np.mean(np.square(errors))) < rmse and inside >= 0.8 * len(errors)


def test_buttressed_trees_are_refused_and_round_ones_measured():
    folder = needs_shared("lidar_itsme")
    for name, dbh in (
        ("tree_1_pc.txt", 15.1),
        ("tree_2_pc.txt", 31.5),
        ("buttressed_tree_1_pc.txt", None),
        ("buttressed_tree_2_pc.txt", None),
    ):
        cloud = read_cloud(folder / name, crs="local")
        trees, _ = measure_cloud(cloud, flat_ground(cloud.xyz))
        assert len(trees) == 1, name
        if dbh is None:
            assert trees[0].qc_flag == "reject" and "not_round" in trees[0].qc_reason
        else:
            assert trees[0].dbh_cm == pytest.approx(dbh, abs=1.2)


def test_errors_that_a_plot_shares_widen_the_interval():
    tree = Tree(1, 0.0, 0.0, dbh_cm=40.0, dbh_se_cm=0.3, taper_cm_m=-1.2, qc_flag="ok").finish()
    wider = with_block_errors(tree, 0.01, 0.5)
    assert wider.dbh_se_cm == pytest.approx(np.sqrt(0.3**2 + 0.4**2 + 0.6**2))
    assert wider.dbh_hi_cm - wider.dbh_lo_cm == pytest.approx(2 * 1.645 * wider.dbh_se_cm) and wider.dbh_cm == 40.0
    assert with_block_errors(tree, 0.0, 0.0).dbh_lo_cm == pytest.approx(tree.dbh_lo_cm)
    refused = Tree(2, 0.0, 0.0, qc_flag="reject", qc_reason="few_views").finish()
    assert with_block_errors(refused, 0.01, 0.5) is refused


def _cloud_of(stems, order):
    """A cloud of stem points alone and its ids, the stems written in ``order`` (numbers into ``stems``)."""
    xyz = np.concatenate([stems[k] for k in order])
    ids = np.concatenate([np.full(len(stems[k]), place) for place, k in enumerate(order, start=1)])
    return PointCloud(xyz, None, {"opacity": np.full(len(xyz), 0.6, np.float32)}), ids


@pytest.mark.parametrize(
    "case",
    [
        {"method": "paper"},
        {"method": "paper", "weights": "opacity"},
        {"method": "paper", "fit": "cylinder"},
        {"source": "splat", "weights": "opacity"},
        {"fit": "cylinder"},
    ],
)
def test_a_tree_reads_the_same_alone_in_a_batch_reversed_and_in_another_order_of_points(case):
    """Random draws belong to the tree: neighbours, ids and the file's order change nothing, to the last bit."""
    rng = np.random.default_rng(8)
    stems = []
    for k, dbh in enumerate((18.0, 24.0, 31.0)):
        points = stem_points(rng, dbh, 8500, 0.015, filled=True, taper_cm_m=0.2, low=0.0, high=4.5)
        stems.append(points + (500000.0 + 3 * k, 4000000.0 + 0.37 * k, 0.0))
    level = Dtm(np.zeros((40, 60)), Affine(1, 0, 499980, 0, -1, 4000020))
    options = MeasureOptions(**case)

    def read(order):
        cloud, ids = _cloud_of(stems, order)
        return dict(zip(order, (tree.dbh_cm for tree in measure_stems(cloud, ids, level, options)), strict=True))

    batch = read([0, 1, 2])
    assert all(value is not None for value in batch.values())
    assert read([2, 1, 0]) == batch
    assert read([1]) == {1: batch[1]}
    stems = [points[::-1] for points in stems]
    assert read([2]) == {2: batch[2]}
    other = measure_stems(*_cloud_of(stems, [2]), level, MeasureOptions(**case, seed=5))
    assert other[0].dbh_cm != batch[2]
