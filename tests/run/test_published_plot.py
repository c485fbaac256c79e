"""The published route over a whole plot, from photos with cameras to trees, and what it says when it cannot run."""

from __future__ import annotations

import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest
from painted_stem import FRAME, GROUND, RADIUS, STEM, scene
from rasterio.transform import from_origin

from treedgs_geo.core.errors import InputError, MissingComponentError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.run import published_plot
from treedgs_geo.run.context import Site
from treedgs_geo.run.published_plot import Published, check_published, published_route
from treedgs_geo.run.settings import PhotosToDbhSettings
from treedgs_geo.terrain.dtm import Dtm


class Said(Reporter):
    """What a run told."""

    def __init__(self):
        super().__init__()
        self.lines = []

    def _emit(self, kind, body):
        if kind in ("warn", "info"):
            self.lines.append((kind, body["message"]))


def settings(folder, **more):
    return PhotosToDbhSettings(
        photos=folder, crs="EPSG:6344", workspace=folder / "work", output=folder / "trees.gpkg", preset="paper", **more
    )


def site_of(folder) -> Site:
    """The painted stem on disk: twelve photos, flat ground."""
    views = []
    for view in scene()[0]:
        path = folder / view.name
        cv2.imwrite(str(path), scene()[1][view.name][..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 95])
        views.append(replace(view, path=path))
    corner = FRAME.to_project(np.array([[-20.0, 20.0, 0.0]]))[0]
    level = FRAME.to_project(np.array([[0.0, 0.0, GROUND]]))[0, 2]
    dtm = Dtm(np.full((40, 40), level), from_origin(corner[0], corner[1], 1, 1), FRAME.crs)
    return Site(FRAME, views, dtm, Area.circle(*STEM, 2.0))


def points_of_the_stem(n=1500):
    rng = np.random.default_rng(0)
    turn = rng.uniform(0, 2 * np.pi, n)
    stem = STEM + RADIUS * np.column_stack([np.cos(turn), np.sin(turn)])
    flat = np.column_stack([STEM + rng.uniform(-4, 4, (n, 2)), np.full(n, GROUND)])
    return np.concatenate([np.column_stack([stem, GROUND + rng.uniform(0, 5, n)]), flat])


def write_ply(path, points, shade):
    head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue")) + "end_header\n"
    rows = [f"{x:.4f} {y:.4f} {z:.4f} {c} {c} {c}" for (x, y, z), c in zip(points, shade, strict=True)]
    path.write_text(head + "\n".join(rows) + "\n")


def test_a_painted_plot_runs_to_the_end_with_nothing_true_given(tmp_path, monkeypatch):
    pytest.importorskip("torch")
    # So short a fit would take the photos at a quarter, where the stem is three pixels wide.
    monkeypatch.setattr("treedgs_geo.stems.splats.on_torch.scene_fit.FACTORS", (1.0,))
    site, points = site_of(tmp_path), points_of_the_stem()
    shade = np.repeat([45, 150], len(points) // 2)
    write_ply(tmp_path / "scene_dense.ply", points, shade)
    asked = settings(tmp_path, dense=tmp_path / "scene_dense.ply", time_limit=0.15)
    check_published(asked)
    said = Said()
    asked.workspace.mkdir()
    trees, facts = published_route(site, np.empty((0, 3)), Published.of(asked), asked.workspace.joinpath, said)
    fit = facts["published_fit"]
    assert fit["cpu_s"] < 11 and fit["steps"] < 30_000 and facts["prior"]["source"] == "scene_dense.ply"
    assert any(kind == "warn" and "cut short by the time limit of 0.15 minutes" in text for kind, text in said.lines)
    for name in ("field.ply", "surface.laz"):
        assert (asked.workspace / name).stat().st_size > 1000
    surface = read_cloud(asked.workspace / "surface.laz")
    assert {"opacity", "n_views", "tree_id"} <= set(surface.attributes)  # whole: what was called no stem is there, too
    own = surface.attributes["tree_id"]
    assert 0 < (own > 0).sum() == len(read_cloud(asked.workspace / "stems.laz")) < len(own)
    place = site.frame.to_project(np.array([[*STEM, GROUND]]))[0, :2]
    near = [tree for tree in trees if np.hypot(tree.x - place[0], tree.y - place[1]) < 0.3]
    assert len(near) == 1 and near[0].method == "points-paper-opacity"
    assert 25 < near[0].dbh_cm < 50  # 30 cm; seconds of a fit leave it thick


def test_our_own_stereo_is_the_prior_where_none_is_given(tmp_path, monkeypatch):
    site, points = site_of(tmp_path), points_of_the_stem(50)
    sparse = np.array([[*STEM, GROUND + 1], [500.0, 0, 0]])
    monkeypatch.setattr("treedgs_geo.stems.splats.scene_start.dense_prior", lambda *_: (points, points * 0 + 0.3))
    from treedgs_geo.stems.splats.scene_start import Box

    box = Box.of(site.area, site.ground)
    found, colours, source = published_plot.dense_start(site, sparse, None, box, Reporter())
    assert source == "multi-view stereo" and len(found) == len(colours) == 101
    assert np.array_equal(found[-1], sparse[0])  # sparse points stand in where stereo saw nothing, within the box


def test_what_the_published_route_cannot_use_is_said_before_any_work(tmp_path):
    pytest.importorskip("torch")
    with pytest.raises(InputError, match="--field-stems: the published method looks for no stem"):
        check_published(settings(tmp_path, field_stems=tmp_path / "stems.csv"))
    with pytest.raises(InputError, match="--dense: only the published method"):
        check_published(replace(settings(tmp_path, dense=tmp_path / "a.ply"), preset="balanced"))


def test_a_gpu_is_asked_for_where_it_is_used_and_there(tmp_path, monkeypatch):
    pytest.importorskip("torch")
    warp_raster = pytest.importorskip("treedgs_geo.stems.splats.on_torch.warp_raster")
    monkeypatch.setattr(warp_raster, "available", lambda device: False)
    with pytest.raises(InputError, match="'cuda': no such GPU was found here, .* use device cpu"):
        check_published(settings(tmp_path, device="cuda"))
    with pytest.raises(InputError, match="--fit photos: the published method"):
        check_published(settings(tmp_path, fit="photos"))
    with pytest.raises(InputError, match="--device: only the published method"):
        check_published(replace(settings(tmp_path, device="cuda"), preset="balanced"))
    with pytest.raises(InputError, match="'cuda': no such GPU was found here"):
        check_published(replace(settings(tmp_path, device="cuda"), preset="best", fit="gaussians"))
    # A card alone is not enough for the fit of a whole plot: torch has to be able to use it.
    monkeypatch.setattr(warp_raster, "available", lambda device: True)
    monkeypatch.setattr("torch.cuda.is_available", lambda: False)
    with pytest.raises(MissingComponentError, match="finds no CUDA, which the fit of a whole plot needs"):
        check_published(settings(tmp_path, device="cuda"))
    monkeypatch.setattr("torch.cuda.is_available", lambda: True)
    check_published(settings(tmp_path, device="cuda"))
    asked = published_plot.Published.of(settings(tmp_path, device="cuda", max_dbh_cm=150.0))
    assert (asked.scene.device, asked.max_dbh_cm) == ("cuda", 150.0)


def test_without_warp_a_gpu_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.delitem(sys.modules, "treedgs_geo.stems.splats.on_torch.warp_raster", raising=False)
    monkeypatch.delattr("treedgs_geo.stems.splats.on_torch.warp_raster", raising=False)
    monkeypatch.setitem(sys.modules, "warp", None)
    with pytest.raises(MissingComponentError, match="pip install warp-lang"):
        check_published(settings(tmp_path, device="cuda"))


def test_without_torch_the_chain_says_how_to_get_it(tmp_path, monkeypatch):
    for name in [name for name in sys.modules if name.startswith("treedgs_geo.stems.splats.on_torch")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delattr("treedgs_geo.stems.splats.on_torch", raising=False)
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(MissingComponentError, match="pip install torch"):
        check_published(settings(tmp_path))
    check_published(replace(settings(tmp_path), preset="balanced"))
