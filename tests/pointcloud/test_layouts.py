"""Every point format, extra dimensions of every type, COPC: what is read is written back, bit by bit."""

from __future__ import annotations

import laspy
import numpy as np
import pyproj
import pytest
from pointcloud.copc_file import write_copc
from shared_data import SHARED, needs_shared

from treedgs_geo.core.errors import InputError
from treedgs_geo.pointcloud.cloud import usable
from treedgs_geo.pointcloud.files import iter_cloud, read_cloud, write_cloud
from treedgs_geo.pointcloud.stream import copy_cloud

UTM = pyproj.CRS.from_epsg(32615)
VERSION = {0: "1.2", 1: "1.2", 2: "1.2", 3: "1.2", 4: "1.3", 5: "1.3"}


def made(point_format: int, count: int = 500, crs: pyproj.CRS = UTM) -> laspy.LasData:
    """A cloud with random values in every field of the format and in extra dimensions of every kind."""
    rng = np.random.default_rng(point_format)
    header = laspy.LasHeader(version=VERSION.get(point_format, "1.4"), point_format=point_format)
    header.scales, header.offsets = [0.01, 0.001, 0.0001], [611000.0, 3718000.0, -5.0]
    header.add_crs(crs)
    header.add_extra_dims(
        [
            laspy.ExtraBytesParams(name="tree", type="int32", description="tree id"),
            laspy.ExtraBytesParams(name="wave", type="float64"),
            laspy.ExtraBytesParams(name="rough", type="uint16", scales=np.array([0.01]), offsets=np.array([5.0])),
            laspy.ExtraBytesParams(name="normal", type="3float32"),
        ]
    )
    las = laspy.LasData(header, laspy.ScaleAwarePointRecord.zeros(count, header=header))
    for name in las.points.array.dtype.names:
        column = las.points.array[name]
        if column.dtype.kind == "f":
            column[...] = rng.normal(0, 100, column.shape)
        else:
            info = np.iinfo(column.dtype)
            column[...] = rng.integers(info.min // 2, info.max // 2, column.shape, dtype=column.dtype)
    return las


def same(one: laspy.LasData, other: laspy.LasData, ignore: tuple[str, ...] = ()) -> None:
    names = [name for name in one.points.array.dtype.names if name not in ignore]
    for name in names:
        np.testing.assert_array_equal(one.points.array[name], other.points.array[name], err_msg=name)
    assert one.header.point_format.id == other.header.point_format.id
    np.testing.assert_array_equal(one.header.scales, other.header.scales)
    np.testing.assert_array_equal(one.header.offsets, other.header.offsets)
    for mine, theirs in zip(
        one.header.point_format.extra_dimensions, other.header.point_format.extra_dimensions, strict=False
    ):
        assert (mine.name, mine.dtype, mine.description) == (theirs.name, theirs.dtype, theirs.description)


@pytest.mark.parametrize("point_format", range(11))
@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_every_point_format_survives(tmp_path, point_format, suffix):
    if suffix == ".laz" and point_format in (9, 10):
        made(point_format).write(str(tmp_path / "a.las"))
        for write in (
            lambda path: write_cloud(path, read_cloud(tmp_path / "a.las")),
            lambda path: copy_cloud(tmp_path / "a.las", path, lambda xyz, read: (None, {}), {}, UTM),
        ):
            with pytest.raises(InputError, match="waveform"):
                write(tmp_path / "b.laz")
        return
    source = tmp_path / f"a{suffix}"
    made(point_format).write(str(source))
    before = laspy.read(source)
    cloud = read_cloud(source)
    assert cloud.crs.to_epsg() == 32615
    write_cloud(tmp_path / f"b{suffix}", cloud)
    same(before, laspy.read(tmp_path / f"b{suffix}"))
    copied = copy_cloud(
        source,
        tmp_path / f"c{suffix}",
        lambda xyz, read: (None, {"tree_id": np.arange(len(xyz)), "height_m": xyz[:, 2]}),
        {"tree_id": "int32", "height_m": "float32"},
        cloud.crs,
    )
    after = laspy.read(tmp_path / f"c{suffix}")
    assert copied == 500 and after.header.parse_crs().to_epsg() == 32615
    same(before, after)
    np.testing.assert_array_equal(after.tree_id, np.arange(500))
    np.testing.assert_allclose(after.height_m, before.z, rtol=1e-6)


@pytest.mark.parametrize("crs", ["EPSG:6344+5703", "EPSG:2154", "EPSG:32756", "EPSG:3067", "EPSG:25832+7837"])
def test_any_metric_crs_survives(tmp_path, crs):
    wanted = pyproj.CRS.from_user_input(crs)
    made(6, 20, wanted).write(str(tmp_path / "a.laz"))
    cloud = read_cloud(tmp_path / "a.laz")
    write_cloud(tmp_path / "b.laz", cloud)
    assert read_cloud(tmp_path / "b.laz").crs.equals(wanted, ignore_axis_order=True)


def test_geotiff_keys_are_read(tmp_path):
    """LAS 1.2 of older software holds no WKT."""
    las = made(3, 20)
    assert any(vlr.record_id == 34735 for vlr in las.header.vlrs)
    las.write(str(tmp_path / "a.las"))
    assert read_cloud(tmp_path / "a.las").crs.to_epsg() == 32615


def test_every_real_file_survives(tmp_path):
    """Real files with their own formats, scales and extra dimensions: copied and rewritten without a difference."""
    needs_shared("lidar_spanner")
    seen = 0
    for path in sorted(SHARED.glob("*/*.la[sz]")):
        if path.stat().st_size > 5e6:
            continue
        before = laspy.read(path)
        cloud = read_cloud(path, crs="local" if before.header.parse_crs() is None else None)
        write_cloud(tmp_path / f"w{path.suffix}", cloud)
        same(before, laspy.read(tmp_path / f"w{path.suffix}"))
        copy_cloud(
            path,
            tmp_path / f"c{path.suffix}",
            lambda xyz, read: (xyz[:, 0] > -1e12, {}),
            {},
            cloud.crs,
        )
        same(before, laspy.read(tmp_path / f"c{path.suffix}"))
        seen += 1
    assert seen >= 6


def test_copc_is_read_and_clipped_by_its_index(tmp_path):
    las = laspy.LasData(laspy.LasHeader(version="1.4", point_format=6))
    rng = np.random.default_rng(1)
    las.header.scales, las.header.offsets = [0.001] * 3, [611300, 3718400, 0]
    las.header.add_crs(UTM, keep_compatibility=False)
    xyz = rng.uniform([611300, 3718400, 30], [611400, 3718500, 60], (40000, 3))
    las.x, las.y, las.z = xyz.T
    las.intensity = np.arange(40000) % 60000
    write_copc(tmp_path / "a.copc.laz", las)
    whole = read_cloud(tmp_path / "a.copc.laz")
    assert len(whole) == 40000 and whole.crs.to_epsg() == 32615
    order, known = np.argsort(whole.attributes["intensity"]), np.argsort(np.asarray(las.intensity))
    np.testing.assert_allclose(whole.xyz[order], np.column_stack([las.x, las.y, las.z])[known])
    box = (611310.0, 3718410.0, 611320.0, 3718425.0)
    clip = read_cloud(tmp_path / "a.copc.laz", bounds=box)
    inside = ((xyz[:, :2] >= box[:2]) & (xyz[:, :2] <= box[2:])).all(axis=1)
    assert len(clip) == pytest.approx(inside.sum(), abs=2) and (clip.xyz[:, :2] >= box[:2]).all()
    # Its index would be a lie in a copy: written as plain LAZ, or refused under the name of COPC.
    copy_cloud(tmp_path / "a.copc.laz", tmp_path / "b.laz", lambda xyz, read: (None, {}), {}, UTM)
    assert not any(vlr.user_id == "copc" for vlr in laspy.read(tmp_path / "b.laz").header.vlrs)
    with pytest.raises(InputError, match="COPC"):
        write_cloud(tmp_path / "c.copc.laz", whole)


def test_noise_and_withheld_points_are_not_used(tmp_path):
    las = made(6, 100)
    las.classification, las.withheld = np.arange(100) % 20, np.arange(100) % 10 == 3
    las.write(str(tmp_path / "a.laz"))
    cloud = read_cloud(tmp_path / "a.laz")
    assert usable(cloud).sum() == 100 - 10 - 10  # classes 7 and 18; withheld: 3 and 13


def test_text_in_pieces(tmp_path):
    (tmp_path / "a.txt").write_text("x y z\n" + "".join(f"{k} {k / 2} {k / 4}\n" for k in range(1000)))
    pieces = list(iter_cloud(tmp_path / "a.txt", crs="local", chunk_points=300))
    assert [len(piece) for piece in pieces] == [300, 300, 300, 100] and pieces[3].xyz[-1, 1] == 499.5
    copy_cloud(
        tmp_path / "a.txt",
        tmp_path / "b.laz",
        lambda xyz, read: (xyz[:, 0] >= 990, {"tree_id": xyz[:, 0]}),
        {"tree_id": "int32"},
        None,
    )
    assert laspy.read(tmp_path / "b.laz").tree_id.tolist() == list(range(990, 1000))
