"""Large clouds: tile by tile the same ground, stems and labels as at once; and the two verbs on such a file."""

from __future__ import annotations

import laspy
import numpy as np
import pyproj
import pytest
from shared_data import needs_shared
from synthetic_cloud import plot_cloud

import treedgs_geo.pointcloud.tiles as tiles
from treedgs_geo.cli import main
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud, write_cloud
from treedgs_geo.stems.cloud.propose.labelling import Labeller
from treedgs_geo.stems.cloud.propose.segment import find_stems, label_points
from treedgs_geo.stems.cloud.propose.tiled import find_stems_tiled
from treedgs_geo.terrain.dtm import read_dtm
from treedgs_geo.terrain.ground import dtm_from_cloud
from treedgs_geo.terrain.streamed import dtm_from_tiles
from treedgs_geo.verbs.segment_stems import SegmentStemsSettings
from treedgs_geo.verbs.segment_stems import run as segment
from treedgs_geo.verbs.terrain import TerrainSettings
from treedgs_geo.verbs.terrain import run as terrain

UTM = pyproj.CRS.from_epsg(32615)


def test_tiles_lose_no_point_and_no_digit(tmp_path):
    rng = np.random.default_rng(0)
    xyz = rng.uniform([611300, 3718400, 30], [611391, 3718437, 60], (30000, 3))
    write_cloud(tmp_path / "a.laz", PointCloud(xyz, UTM, {"opacity": rng.uniform(0, 1, 30000).astype(np.float32)}))
    cloud = read_cloud(tmp_path / "a.laz")
    (tmp_path / "t").mkdir()
    store = tiles.sort_into_tiles(tmp_path / "a.laz", tmp_path / "t", None, ("opacity",), side_m=10.0)
    assert len(store.tiles) == 40 and store.n_points == 30000
    parts = [store.read(tile) for tile in store.tiles]
    key = np.lexsort(np.concatenate([p[0] for p in parts]).T)
    want = np.lexsort(cloud.xyz.T)
    np.testing.assert_array_equal(np.concatenate([p[0] for p in parts])[key], cloud.xyz[want])
    np.testing.assert_array_equal(
        np.concatenate([p[1]["opacity"] for p in parts])[key], cloud.attributes["opacity"][want]
    )
    low, high = np.array([611325.5, 3718407.25]), np.array([611352.0, 3718431.0])
    box, _ = store.read_box(low, high)
    inside = ((cloud.xyz[:, :2] >= low) & (cloud.xyz[:, :2] < high)).all(axis=1)
    assert len(box) == inside.sum() and ((box[:, :2] >= low) & (box[:, :2] < high)).all()


@pytest.fixture(scope="module")
def plot(tmp_path_factory):
    """The rendered plot's LiDAR in tiles of 9 m (their borders cut through stems), and at once."""
    path = next((needs_shared("plot_a") / "lidar").glob("*.laz"))
    folder = tmp_path_factory.mktemp("tiles")
    store = tiles.sort_into_tiles(path, folder, None, (), side_m=9.0)
    cloud = read_cloud(path, attributes=())
    return store, folder, cloud


def test_ground_stems_and_labels_are_those_of_the_whole_cloud(plot):
    store, folder, cloud = plot
    whole = dtm_from_cloud(cloud.xyz, crs=cloud.crs)
    streamed = dtm_from_tiles(store, folder, crs=cloud.crs)
    x, y = whole.centres()
    difference = streamed.height(x, y) - whole.heights
    assert np.isfinite(difference).all() and difference.std() < 0.005 and np.abs(difference).max() < 0.05
    expected = find_stems(cloud, streamed)
    found = find_stems_tiled(store, streamed)
    assert found.sensor == expected.sensor and len(found.stems) == len(expected.stems) > 30
    for one, other in zip(found.stems, expected.stems, strict=True):
        np.testing.assert_allclose(one.cone.vector, other.cone.vector, atol=1e-3)
    height = cloud.xyz[:, 2] - streamed.height(cloud.xyz[:, 0], cloud.xyz[:, 1])
    labels = label_points(cloud.xyz, height, expected)
    np.testing.assert_array_equal(Labeller(expected)(cloud.xyz, height), labels)
    assert (labels > 0).sum() > 10000


def test_verbs_on_a_large_file(tmp_path, monkeypatch):
    """The same result files by the tiled and by the whole road; noise is left out; fields of the input are kept."""
    rng = np.random.default_rng(5)
    xyz = plot_cloud(rng, [(3, 3, 20.0), (8, 5, 30.0)]) + (611300.0, 3718400.0, 0.0)
    noise = np.array([[611305.0, 3718404.0, 60.0]]) + rng.normal(0, 0.02, (40, 3))
    xyz = np.vstack([xyz, noise])
    classes = np.r_[np.ones(len(xyz) - 40, np.uint8), np.full(40, 7, np.uint8)]
    write_cloud(tmp_path / "in.laz", PointCloud(xyz, UTM, {"classification": classes, "mark": np.arange(len(xyz))}))
    for name in ("whole", "tiled"):
        (tmp_path / name).mkdir()
        if name == "tiled":
            monkeypatch.setattr(tiles, "WHOLE_CLOUD_POINTS", 1000)
        ground = terrain(
            TerrainSettings(
                input=tmp_path / "in.laz",
                output=tmp_path / name / "dtm.tif",
                ground_points=tmp_path / name / "ground.laz",
            ),
            Reporter(),
        )
        assert ground["n_points"] == len(xyz)
        stems = segment(
            SegmentStemsSettings(input=tmp_path / "in.laz", output=tmp_path / name / "stems.laz", keep_all=True),
            Reporter(),
        )
        assert stems["n_stems"] == 2
    one, other = (read_dtm(tmp_path / name / "dtm.tif") for name in ("whole", "tiled"))
    np.testing.assert_allclose(one.heights, other.heights, atol=0.03)
    assert one.crs.to_epsg() == other.crs.to_epsg() == 32615 and np.nanmin(one.heights) > 95
    a, b = (laspy.read(tmp_path / name / "stems.laz") for name in ("whole", "tiled"))
    np.testing.assert_array_equal(a["mark"], b["mark"])
    assert (np.asarray(a["tree_id"]) != np.asarray(b["tree_id"])).mean() < 0.01
    c, d = (laspy.read(tmp_path / name / "ground.laz") for name in ("whole", "tiled"))
    assert (np.asarray(c.classification) != np.asarray(d.classification)).mean() < 0.01
    assert (np.asarray(d.classification)[-40:] == 7).all()
    assert not list(tmp_path.glob("*/.tiles*")), "nothing is left behind"
    whole = (tmp_path / "in.laz").read_bytes()
    assert main(["segment-stems", "--input", str(tmp_path / "in.laz"), "--output", str(tmp_path / "in.laz")]) == 2
    assert (tmp_path / "in.laz").read_bytes() == whole


def test_a_large_text_cloud(tmp_path, monkeypatch):
    monkeypatch.setattr(tiles, "WHOLE_CLOUD_POINTS", 1000)
    xyz = plot_cloud(np.random.default_rng(6), [(3, 3, 20.0)])
    np.savetxt(tmp_path / "in.txt", xyz, fmt="%.4f")
    stems = segment(SegmentStemsSettings(input=tmp_path / "in.txt", output=tmp_path / "s.laz", crs="local"), Reporter())
    assert stems["n_stems"] == 1 and stems["n_stem_points"] == len(laspy.read(tmp_path / "s.laz"))


def test_a_foreign_dtm_is_refused_for_tiles_too(tmp_path, monkeypatch):
    from treedgs_geo.terrain.dtm import write_dtm

    monkeypatch.setattr(tiles, "WHOLE_CLOUD_POINTS", 1000)
    xyz = plot_cloud(np.random.default_rng(6), [(3, 3, 20.0)]) + (611300.0, 3718400.0, 0.0)
    write_cloud(tmp_path / "in.laz", PointCloud(xyz, UTM))
    write_dtm(tmp_path / "dtm.tif", dtm_from_cloud(xyz + (0, 0, 27.0), crs=UTM))
    with pytest.raises(InputError, match="vertical datum"):
        segment(
            SegmentStemsSettings(input=tmp_path / "in.laz", dtm=tmp_path / "dtm.tif", output=tmp_path / "s.laz"),
            Reporter(),
        )
    write_dtm(tmp_path / "far.tif", dtm_from_cloud(xyz + (500, 0, 0), crs=UTM))
    with pytest.raises(InputError, match="covers the plot"):
        segment(
            SegmentStemsSettings(input=tmp_path / "in.laz", dtm=tmp_path / "far.tif", output=tmp_path / "s.laz"),
            Reporter(),
        )
