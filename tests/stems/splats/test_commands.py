"""The published method by its verbs, one after the other, and the sentences that they refuse with."""

from __future__ import annotations

import sys

import cv2
import geopandas as gpd
import numpy as np
import pyproj
import pytest

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.errors import InputError, MissingComponentError
from treedgs_geo.core.files import read_json, write_json
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.settings import build
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud, write_cloud
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.reconstruction.cameras import Camera
from treedgs_geo.reconstruction.model import load_views
from treedgs_geo.run.context import Site
from treedgs_geo.run.published_plot import Published, published_route
from treedgs_geo.stems.splats.options import SceneOptions
from treedgs_geo.terrain.dtm import read_dtm
from treedgs_geo.verbs.fit_gaussians import COMMAND as FIT
from treedgs_geo.verbs.measure_dbh import COMMAND as MEASURE
from treedgs_geo.verbs.sample_surface import COMMAND as SAMPLE
from treedgs_geo.verbs.segment_stems import COMMAND as SEGMENT

CRS = pyproj.CRS.from_epsg(6344)
FRAME = LocalFrame(CRS, np.array([611337.0, 3718451.0, 38.0]))


def run(command, **values):
    return command.run(build(command.settings, values), Reporter())


def points(n: int = 1500) -> np.ndarray:
    """(2 n, 3) local points of the pole and of the ground about it."""
    rng = np.random.default_rng(0)
    turn = rng.uniform(0, 2 * np.pi, n)
    pole = np.column_stack([0.15 * np.cos(turn), 0.15 * np.sin(turn), rng.uniform(0, 5, n)])
    return np.concatenate([pole, np.column_stack([rng.uniform(-4, 4, (n, 2)), np.zeros(n)])])


@pytest.fixture
def workspace(tmp_path):
    """A COLMAP model of eight oblique views of a dark pole, its photos, a flat DTM, a plot and dense points."""
    import pycolmap
    import rasterio
    from rasterio.transform import from_origin

    photos, sfm = tmp_path / "photos", tmp_path / "work" / "sfm"
    photos.mkdir()
    sfm.mkdir(parents=True)
    lens = Camera(200, 200, 1500, 1500, 100, 100)
    model = pycolmap.Reconstruction()
    camera = pycolmap.Camera(
        camera_id=1, model="OPENCV", width=200, height=200, params=[1500, 1500, 100, 100, 0, 0, 0, 0]
    )
    model.add_camera_with_trivial_rig(camera)
    ground = np.random.default_rng(0).integers(140, 220, (200, 200, 3), dtype=np.uint8)
    for number in range(8):
        turn, tilt, target = number * np.pi / 4, np.radians(55), np.array([0, 0, 1.5])
        centre = target + 50 * np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
        forward = (target - centre) / 50
        right = np.cross(forward, [0, 0, 1.0]) / np.linalg.norm(np.cross(forward, [0, 0, 1.0]))
        rotation = np.stack([right, np.cross(forward, right), forward])
        pole = np.array([[0, 0, 0.0], [0, 0, 5.0]]) @ rotation.T - rotation @ centre
        ends = (lens.matrix @ (pole / pole[:, 2:]).T).T[:, :2].round().astype(int)
        picture = cv2.line(ground.copy(), tuple(map(int, ends[0])), tuple(map(int, ends[1])), (60, 50, 40), 9)
        cv2.imwrite(str(photos / f"{number}.png"), picture)
        pose = pycolmap.Rigid3d(np.column_stack([rotation, -rotation @ centre]))
        image = pycolmap.Image(name=f"{number}.png", camera_id=1, image_id=number + 1)
        model.add_image_with_trivial_frame(image, pose)
    model.write(str(sfm))
    FRAME.save(sfm / "frame.json")
    shape = {"driver": "GTiff", "width": 40, "height": 40, "count": 1, "dtype": "float32"}
    with rasterio.open(
        tmp_path / "work" / "dtm.tif", "w", crs=CRS.to_wkt(), transform=from_origin(611327, 3718461, 0.5, 0.5), **shape
    ) as raster:
        raster.write(np.full((40, 40), 38.0, np.float32), 1)
    (tmp_path / "plots.csv").write_text("plot_id,easting,northing,radius_m\na,611337,3718451,2\n")
    write_cloud(tmp_path / "dense.laz", PointCloud(FRAME.to_project(points()), CRS))
    return tmp_path


def test_gaussians_are_fitted_from_a_workspace(workspace):
    pytest.importorskip("torch")
    folder = workspace / "work"
    inputs = {"photos": workspace / "photos", "plots": workspace / "plots.csv", "dense": workspace / "dense.laz"}
    fitted = run(FIT, workspace=folder, time_limit=0.1, **inputs)
    assert fitted["gaussians"] > 100 and fitted["prior"]["source"] == "dense.laz"
    assert fitted["published_fit"]["photos"] == 8 and fitted["published_fit"]["cpu_s"] < 12
    entry = read_json(folder / "run.json")["stages"]["fit-gaussians"]
    assert entry["status"] == "done" and entry["result"]["gaussians"] == fitted["gaussians"]
    sampled = run(SAMPLE, workspace=folder)  # the photo folder is remembered
    assert sampled["points"] == len(read_cloud(folder / "surface.laz"))
    record = read_json(folder / "field.frame.json")
    write_json(folder / "field.frame.json", {**record, "origin": [0, 0, 0]})
    with pytest.raises(InputError, match="another local frame"):
        run(SAMPLE, workspace=folder)


def test_the_verbs_one_after_the_other_are_the_published_route(workspace):
    pytest.importorskip("torch")
    folder = workspace / "work"
    frame, views = load_views(folder / "sfm", workspace / "photos")
    site = Site(frame, views, read_dtm(folder / "dtm.tif", CRS), Area.circle(0, 0, 2.0))
    asked = Published(scene=SceneOptions(steps=160, tried_every=0))
    whole, _ = published_route(site, points(), asked, folder.joinpath, Reporter())
    surface, stems = read_cloud(folder / "surface.laz"), read_cloud(folder / "stems.laz")
    assert {"opacity", "n_views", "tree_id"} <= set(surface.attributes) and 0 < len(stems) < len(surface)
    run(SAMPLE, workspace=folder, photos=workspace / "photos")
    again = read_cloud(folder / "surface.laz")
    np.testing.assert_array_equal(again.xyz, surface.xyz)
    np.testing.assert_allclose(again.attributes["opacity"], surface.attributes["opacity"], atol=1e-5)
    ground = {"dtm": folder / "dtm.tif", "crs": "EPSG:6344"}
    found = run(SEGMENT, input=folder / "surface.laz", output=workspace / "stems.laz", **ground)
    published = {"weights": "opacity", "method": "paper", "source": "splat"}
    run(MEASURE, input=workspace / "stems.laz", output=workspace / "trees.gpkg", **published, **ground)
    layer = gpd.read_file(workspace / "trees.gpkg", layer="trees")
    assert found["n_stems"] == len(whole) == len(layer) == 1 and layer["method"][0] == "points-paper-opacity"
    # In a file places are rounded, the foot is found from the points alone, and circles are drawn by other numbers.
    assert layer["dbh_cm"][0] == pytest.approx(whole[0].dbh_cm, rel=0.1)


def test_sentences(workspace):
    pytest.importorskip("torch")
    folder, photos = workspace / "work", workspace / "photos"
    with pytest.raises(InputError, match="run reconstruct first"):
        run(FIT, workspace=workspace)
    with pytest.raises(InputError, match="give --photos"):
        run(FIT, workspace=folder)
    with pytest.raises(InputError, match="run fit-gaussians first"):
        run(SAMPLE, workspace=folder, photos=photos)
    with pytest.raises(InputError, match="is not a folder"):
        run(SAMPLE, workspace=folder, photos=workspace / "none")
    with pytest.raises(InputError, match="none.ply: cannot be read"):
        run(FIT, workspace=folder, photos=photos, plots=workspace / "plots.csv", dense=workspace / "none.ply")
    (folder / "dtm.tif").unlink()
    with pytest.raises(InputError, match="or copy a DTM there"):
        run(FIT, workspace=folder, photos=photos)
    assert not list(folder.glob("field*")) and not list(folder.glob("surface*"))


@pytest.mark.parametrize("command", [FIT, SAMPLE], ids=lambda command: command.name)
def test_without_torch_the_verbs_say_how_to_get_it(workspace, monkeypatch, command):
    for name in [name for name in sys.modules if name.startswith("treedgs_geo.stems.splats.on_torch")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delattr("treedgs_geo.stems.splats.on_torch", raising=False)
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(MissingComponentError, match="pip install torch"):
        run(command, workspace=workspace / "work", photos=workspace / "photos")
