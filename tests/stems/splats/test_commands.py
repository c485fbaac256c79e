"""fit-gaussians and sample-surface on a small workspace, and the sentences they refuse with."""

from __future__ import annotations

import cv2
import geopandas as gpd
import laspy
import numpy as np
import pyproj
import pytest

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.files import read_json, write_json
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.settings import build
from treedgs_geo.reconstruction.cameras import Camera
from treedgs_geo.stems.splats.scene_start import read_dense
from treedgs_geo.stems.splats.train import read_seeds
from treedgs_geo.verbs.fit_gaussians import COMMAND as FIT
from treedgs_geo.verbs.sample_surface import COMMAND as SAMPLE

CRS = pyproj.CRS.from_epsg(6344)
FRAME = LocalFrame(CRS, np.array([611337.0, 3718451.0, 38.0]))


def run(command, **values):
    return command.run(build(command.settings, values), Reporter())


@pytest.fixture
def workspace(tmp_path):
    """A COLMAP model of eight oblique views of a dark pole, its photos, a flat DTM and one stem position."""
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
    (tmp_path / "seeds.csv").write_text("x,y\n611337.05,3718450.95\n")
    return tmp_path


def test_the_two_commands_end_to_end(workspace):
    folder = workspace / "work"
    fitted = run(FIT, workspace=folder, photos=workspace / "photos", seeds=workspace / "seeds.csv")
    assert fitted["stems"] == 1 and 0 < fitted["gaussians"] <= 3000
    table = (folder / "stem_primitives.csv").read_text().splitlines()
    assert table[0].startswith("tree_id,x,y") and len(table) == 2 and fitted["stem_table"].endswith(".csv")
    sampled = run(SAMPLE, workspace=folder)  # the photo folder is remembered
    cloud = laspy.read(folder / "surface.laz")
    names = {dimension.name: dimension.dtype for dimension in cloud.point_format.extra_dimensions}
    assert names["opacity"] == np.float32 and names["n_views"] == np.uint16 and len(cloud.points) == sampled["points"]
    assert abs(np.median(cloud.x) - 611337) < 0.4 and abs(np.median(cloud.y) - 3718451) < 0.4
    assert cloud.header.parse_crs().to_epsg() == 6344
    record = read_json(folder / "run.json")["stages"]
    assert record["fit-gaussians"]["status"] == record["sample-surface"]["status"] == "done"
    assert record["fit-gaussians"]["result"]["per_stem"][0]["crops"] == 8


def test_sentences(workspace):
    folder, photos = workspace / "work", workspace / "photos"
    with pytest.raises(InputError, match="run reconstruct first"):
        run(FIT, workspace=workspace)
    with pytest.raises(InputError, match="give --photos"):
        run(FIT, workspace=folder)
    with pytest.raises(InputError, match="give --seeds"):
        run(FIT, workspace=folder, photos=photos)
    with pytest.raises(InputError, match="run fit-gaussians first"):
        run(SAMPLE, workspace=folder, photos=photos)
    with pytest.raises(InputError, match="is not a folder"):
        run(SAMPLE, workspace=folder, photos=workspace / "none")
    (folder / "dtm.tif").unlink()
    with pytest.raises(InputError, match="run the terrain step first"):
        run(FIT, workspace=folder, photos=photos, seeds=workspace / "seeds.csv")
    assert not list(folder.glob("field*")) and not list(folder.glob("surface*"))


def test_a_field_of_another_frame_is_refused(workspace):
    folder, photos = workspace / "work", workspace / "photos"
    run(FIT, workspace=folder, photos=photos, seeds=workspace / "seeds.csv")
    record = read_json(folder / "field.frame.json")
    write_json(folder / "field.frame.json", {**record, "origin": [0, 0, 0]})
    with pytest.raises(InputError, match="another local frame"):
        run(SAMPLE, workspace=folder, photos=photos)


def test_an_openmvs_cloud_is_read(workspace):
    """Binary PLY with lists of views per point, as OpenMVS writes it."""
    rng, path = np.random.default_rng(0), workspace / "scene_dense.ply"
    header = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 300\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        "property list uint8 uint32 view_indices\nproperty list uint8 float view_weights\nend_header\n"
    )
    points = rng.normal([0, 0, 1.5], [0.1, 0.1, 0.8], (300, 3)).astype(np.float32)
    with open(path, "wb") as stream:
        stream.write(header.encode())
        for point in points:
            stream.write(
                point.tobytes()
                + bytes([60, 50, 40, 2])
                + np.array([0, 3], np.uint32).tobytes()
                + bytes([2])
                + np.array([1, 0.5], np.float32).tobytes()
            )
    xyz, colours = read_dense(path, FRAME)
    np.testing.assert_allclose(xyz, points)
    assert colours.max() < 0.3
    path.write_text("ply\n")
    with pytest.raises(InputError, match="no readable points"):
        read_dense(path, FRAME)
    with pytest.raises(InputError, match="not found"):
        read_dense(workspace / "none.ply", FRAME)


def test_seed_tables(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("tree,Easting,Northing\n1,611338,3718450\n")
    np.testing.assert_allclose(read_seeds(path, FRAME), [[1, -1]])
    layer = gpd.GeoDataFrame(geometry=gpd.points_from_xy([611338.0], [3718450.0]), crs=CRS).to_crs(4326)
    layer.to_file(tmp_path / "a.gpkg")
    np.testing.assert_allclose(read_seeds(tmp_path / "a.gpkg", FRAME), [[1, -1]], atol=1e-3)
    for text, message in (
        ("x,z\n1,2\n", "lacks the northing"),
        ("x,y\n1,b\n", "expected a number"),
        ("x,y\n", "holds no row"),
        ("x,y\n1,2\n", "km from the photos"),
        ("x,y\nnan,2\n", "only one of|expected a number"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=message):
            read_seeds(path, FRAME)
    with pytest.raises(InputError, match="No such file"):
        read_seeds(tmp_path / "none.csv", FRAME)
    # Without a CRS places are the project's; degrees are then too far away.
    layer.set_crs(None, allow_override=True).to_file(tmp_path / "b.shp")
    with pytest.raises(InputError, match="km from the photos"):
        read_seeds(tmp_path / "b.shp", FRAME)
