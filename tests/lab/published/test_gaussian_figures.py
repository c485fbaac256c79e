"""The paper's pictures of Gaussians on a painted stem whose surface is known, and the gallery's choice of stems."""

from __future__ import annotations

import json
from dataclasses import replace

import cv2
import numpy as np
import pandas as pd
import pytest
from painted_stem import FRAME, GROUND, RADIUS, STEM, scene
from rasterio.transform import from_origin

from treedgs_geo.inventory.accuracy.plot_files import PlotFiles
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import write_cloud
from treedgs_geo.stems.splats.field import GaussianField
from treedgs_geo.stems.splats.options import SampleOptions
from treedgs_geo.terrain.dtm import Dtm
from treedgs_lab.published import gallery, paper_document, point_sets
from treedgs_lab.published.point_sets import fuse_depth
from treedgs_lab.published.reference import Reference
from treedgs_lab.published.segmentation import LabelledPoints, draw_labels, score_segmentation

PLACE = FRAME.to_project(np.array([[*STEM, GROUND]]))[0]
REFERENCE = Reference(np.array(["p"]), np.array(["T1"]), PLACE[None, :2], np.array([200 * RADIUS]))


def bark(n: int = 1500) -> GaussianField:
    """Opaque little Gaussians on the painted stem, from the ground to 5 m."""
    rng = np.random.default_rng(1)
    turn, p = rng.uniform(0, 2 * np.pi, n), np.zeros((n, 14))
    p[:, :2] = STEM + (RADIUS - 0.02) * np.column_stack([np.cos(turn), np.sin(turn)])
    p[:, 2], p[:, 3] = GROUND + rng.uniform(0, 5, n), 1
    p[:, 7:10], p[:, 10], p[:, 11:] = np.log(0.02), 4, 0.2
    return GaussianField.from_packed(p)


@pytest.fixture
def plot(tmp_path, monkeypatch) -> PlotFiles:
    """A workspace with those Gaussians, their samples and the true stem; twelve photos."""
    pytest.importorskip("torch")
    from treedgs_geo.stems.splats.on_torch.sample import sample_surface

    work, truth = tmp_path / "work", tmp_path / "p" / "truth"
    work.mkdir()
    truth.mkdir(parents=True)
    views = []
    for view in scene()[0]:
        cv2.imwrite(str(tmp_path / view.name), scene()[1][view.name][..., ::-1])
        views.append(replace(view, path=tmp_path / view.name))
    corner = PLACE + [-20.0, 20.0, 0.0]
    dtm = Dtm(np.full((40, 40), PLACE[2]), from_origin(corner[0], corner[1], 1, 1), FRAME.crs)
    field = bark()
    samples = sample_surface(field, views, SampleOptions(samples=20))
    cloud = PointCloud(FRAME.to_project(samples.xyz), FRAME.crs, samples.attributes)
    cloud = cloud.with_attribute("tree_id", np.ones(len(cloud), np.int32))
    for name in ("surface.laz", "stems.laz"):
        write_cloud(work / name, cloud)
    (work / "field.ply").touch()
    (work / "run.json").write_text(json.dumps({"parameters": {"preset": "paper"}}))
    rows = [[h, 200 * RADIUS, *PLACE[:2], PLACE[2] + h] for h in np.arange(0, 8.1, 0.5)]
    (truth / "stems.json").write_text(json.dumps({"origin": [0, 0, 0], "stems": {"T1": rows}}))
    monkeypatch.setattr(point_sets, "open_field", lambda _: (FRAME, views, field, dtm))
    return PlotFiles(plot_id="p", trees=truth, truth=truth / "trees.csv", workspace_in=work)


def test_three_ways_to_points_lie_on_the_stem_that_was_painted(plot):
    sets = point_sets.point_sets(plot, REFERENCE)
    rows = {row["points"]: row for row in point_sets.table([sets])}
    assert list(rows) == [point_sets.MEANS, point_sets.DEPTH, point_sets.SAMPLES] and sets.stems == ["T1"]
    assert 0.8 * 1500 < rows[point_sets.MEANS]["median a stem"] < 1500  # those from 0.3 m up
    for name in (point_sets.DEPTH, point_sets.SAMPLES):
        away = np.linalg.norm(sets.points[name][0][:, :2], axis=1)
        assert abs(np.median(away) - RADIUS) < 0.03 and rows[name]["in a true stem %"] > 85
        assert rows[name]["covered height %"] > 95 and rows[name]["median a stem"] > 3000
    for other in (point_sets.MEANS, point_sets.DEPTH):
        figure = point_sets.draw_pair([sets], other)
        assert figure is not None and len(figure.axes) == 2
    empty = replace(sets, points={name: [np.empty((0, 3))] for name in sets.points})
    assert (
        point_sets.draw_pair([empty], point_sets.MEANS) is None and point_sets.draw_pair([], point_sets.MEANS) is None
    )
    assert point_sets.table([empty])[0]["in a true stem %"] is None
    # Of several plots the picture shows the stem with most samples, the table all.
    figure = point_sets.draw_pair([replace(empty, plot="q"), sets], point_sets.MEANS)
    assert figure is not None and "about p T1" in figure.axes[0].get_title()
    assert [row["plot"] for row in point_sets.table([sets, replace(empty, plot="q")])] == ["p"] * 3 + ["q"] * 3


def test_fused_depth_about_a_place_sees_what_stands_before_it():
    views, own = list(scene()[0]), bark()
    about = np.concatenate([own.means + side for side in (-0.3, 0.3)]).astype(float)
    alone = fuse_depth(own, views, about)
    assert len(alone) > 3000
    # A screen of opaque Gaussians under the cameras hides the stem; a fit of the stem's own group would not know it.
    p = own.packed
    screen = p[:900].copy()
    grid = np.linspace(-9, 9, 30)
    screen[:, 0], screen[:, 1] = (STEM[k] + value.ravel() for k, value in enumerate(np.meshgrid(grid, grid)))
    screen[:, 2], screen[:, 7:10] = GROUND + 5.8, np.log((0.5, 0.5, 0.02))
    both = GaussianField.from_packed(np.concatenate([p, screen]))
    hidden = fuse_depth(both, views, about)
    near = np.linalg.norm(hidden[:, :2] - STEM, axis=1) < 0.3
    assert (near & (hidden[:, 2] < GROUND + 5.5)).sum() < 0.05 * len(alone)


def test_overview_and_pipeline_are_drawn_from_the_run(plot):
    shown = point_sets.draw_overview(plot)
    assert shown is not None and "1,500 Gaussians" in shown.axes[1].get_title()
    drawn, photo = (np.asarray(axes.get_images()[0].get_array(), float) for axes in (shown.axes[1], shown.axes[0]))
    middle = slice(110, 150)
    assert drawn[middle, 130].mean() < 0.4 and photo[middle, 130].mean() / 255 < 0.4  # the dark stem stands there
    assert drawn[middle, 20].mean() > 0.9  # and nothing beside it
    strip = point_sets.draw_pipeline(plot, REFERENCE)
    assert strip is not None and "segmented as stem" in strip.axes[2].get_title()
    far = replace(REFERENCE, xy=REFERENCE.xy + 12.0)
    assert point_sets.draw_pipeline(plot, far) is None


def test_a_cloud_of_stem_points_alone_has_no_recall():
    label, true = np.array([1, 1, 2]), np.array([1, 0, 2])
    found = score_segmentation(label, true, whole=False)
    assert found["precision"] == pytest.approx(2 / 3, abs=1e-3)
    assert [found[name] for name in ("recall", "f1", "iou", "accuracy", "fn", "tn")] == [None] * 6
    assert score_segmentation(label, true)["recall"] == 1.0


def test_labels_are_drawn_with_and_without_truth(plot):
    rng = np.random.default_rng(0)
    xyz, label = rng.uniform(0, 5, (90_000, 3)), rng.integers(0, 3, 90_000)
    cloud = LabelledPoints.thinned("splats", "p", xyz, label, label, True)
    assert len(cloud.xyz) == 30_000 and cloud.of == 90_000 and abs(cloud.xyz[:, 0].mean()) < 0.1
    figure = draw_labels([cloud, replace(cloud, true=None)])
    assert [axes.get_visible() for axes in figure.axes] == [True] * 4 + [False, True]
    assert "stem, wrongly (0 %)" in [text.get_text() for text in figure.axes[2].get_legend().get_texts()]
    assert draw_labels([]) is None
    assert "by our own segmenter" in paper_document._labeller(cloud, [plot])
    assert "recall and what needs it are not known" in paper_document._labeller(replace(cloud, whole=False), [plot])
    assert "tree_id of the file" in paper_document._labeller(cloud, [replace(plot, workspace_in=None)])


def ring(dbh_cm: float, n: int = 3000) -> np.ndarray:
    rng = np.random.default_rng(int(dbh_cm))
    turn, r = rng.uniform(0, 2 * np.pi, n), dbh_cm / 200 * np.sqrt(rng.uniform(0, 1, n))
    return np.column_stack([r * np.cos(turn), r * np.sin(turn), rng.uniform(0.1, 5, n)])


def test_the_gallery_shows_failures_large_and_small_errors():
    true = np.array([20.0, 26.0, 30.0, 34.0])
    reference = Reference(
        np.array(["p"] * 4), np.array(list("abcd")), np.array([[0, 0], [1, 0], [9, 0], [20, 0.0]]), true
    )
    # The second reads 4 cm thick, the third has no points.
    points = [ring(20.0), ring(30.0), None, ring(34.0)]
    fits = gallery.fitted_stems([None if p is None else (p, np.ones(len(p))) for p in points], 0.6)
    assert not np.isfinite(fits[2].dbh_cm) and fits[2].circle is None and fits[0].circle is not None
    picks = [(kind, reference.tree[fit.number]) for kind, fit in gallery.chosen(fits, reference)]
    assert picks[:2] == [("no diameter", "c"), ("largest error", "b")]
    assert {tree for kind, tree in picks[2:] if kind == "smallest error"} == {"a", "d"} and len(picks) == 4
    seen = pd.DataFrame({"plot": ["p"], "reference": ["b"], "free_views": [3]})
    assert gallery.circumstances(1, reference, seen) == "free in 3 photos; another stem 1.0 m away"
    assert gallery.circumstances(2, reference, None) == ""
    figure = gallery.draw_fits("splats", gallery.chosen(fits, reference), reference, seen)
    titles = [axes.get_title() for axes in figure.axes if axes.get_visible()]
    assert "no estimate, reference 30.0 cm; 0 points" in titles[0] and "free in 3 photos" in titles[1]
    assert gallery.draw_fits("splats", [], reference, None) is None
