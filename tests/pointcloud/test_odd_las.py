"""LAS files as old and odd software writes them, and E57: read, kept and written, or one right sentence."""

from __future__ import annotations

import struct
import sys

import laspy
import numpy as np
import pytest
from pointcloud.test_layouts import made

from treedgs_geo.core.errors import InputError, MissingComponentError
from treedgs_geo.pointcloud.files import describe_cloud, read_cloud, write_cloud
from treedgs_geo.pointcloud.stream import copy_cloud


def _renamed(path, old: bytes, new: bytes) -> None:
    data = path.read_bytes()
    at = data.index(old.ljust(32, b"\0"))
    path.write_bytes(data[:at] + new.ljust(32, b"\0") + data[at + 32 :])


@pytest.mark.parametrize("suffix", [".las", ".laz"])
@pytest.mark.parametrize(
    "name, read_as",
    [
        (b"tree", "tree_2"),
        (b"intensity", "intensity_2"),
        (b"X", "X_2"),
        (b"x", "x_2"),
        (b"bit_fields", "bit_fields_2"),
        (b"", "extra"),
        (b"H\xf6he", "Höhe"),
    ],
)
def test_extra_dimensions_of_any_name(tmp_path, name, read_as, suffix):
    """Two of one name (a FARO chain), a standard dimension's, none, not UTF-8: read, and written with a name that is
    their own, values and all others unharmed."""
    source = tmp_path / f"a{suffix}"
    made(6).write(str(source))
    before = laspy.read(source)
    _renamed(source, b"wave", name)
    cloud = read_cloud(source)
    np.testing.assert_array_equal(cloud.attributes[read_as], before["wave"])
    np.testing.assert_array_equal(cloud.attributes["tree"], before["tree"])
    np.testing.assert_array_equal(cloud.attributes["intensity"], before["intensity"])
    write_cloud(tmp_path / f"b{suffix}", cloud)
    copy_cloud(source, tmp_path / f"c{suffix}", lambda xyz, read: (None, {"tree_id": xyz[:, 0]}), {"tree_id": "f8"})
    for written in ("b", "c"):
        after = laspy.read(tmp_path / f"{written}{suffix}")
        np.testing.assert_array_equal(after[read_as], before["wave"])
        np.testing.assert_array_equal(after.X, before.X)


def test_texts_that_are_not_utf_8(tmp_path):
    """A CRS record with a letter of Latin-1 is read."""
    made(6).write(str(tmp_path / "a.las"))
    data = (tmp_path / "a.las").read_bytes()
    (tmp_path / "a.las").write_bytes(data.replace(b"WGS 84 / UTM", b"WGS 84 \xb7 UTM"))
    assert read_cloud(tmp_path / "a.las").horizontal_crs.is_projected


@pytest.mark.parametrize("suffix", [".las", ".laz"])
@pytest.mark.parametrize("minor, written", [(0, "1.2"), (1, "1.1"), (2, "1.2")])
def test_old_versions(tmp_path, minor, written, suffix):
    source = tmp_path / f"a{suffix}"
    made(1).write(str(source))
    data = bytearray(source.read_bytes())
    data[25] = minor
    source.write_bytes(bytes(data))
    cloud = read_cloud(source)
    write_cloud(tmp_path / f"b{suffix}", cloud)
    copy_cloud(source, tmp_path / f"c{suffix}", lambda xyz, read: (None, {"tree_id": xyz[:, 0]}), {"tree_id": "f8"})
    for name in "bc":
        after = laspy.read(tmp_path / f"{name}{suffix}")
        assert str(after.header.version) == written
        np.testing.assert_array_equal(after.xyz, cloud.xyz)


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_las_1_5(tmp_path, suffix):
    """Its header is 18 bytes longer (first and last GPS time, time offset)."""
    source = tmp_path / f"a{suffix}"
    made(6).write(str(source))
    before = laspy.read(source)
    data = bytearray(source.read_bytes())
    header_size, to_points = struct.unpack_from("<HI", data, 94)
    if suffix == ".laz":
        struct.pack_into("<q", data, to_points, struct.unpack_from("<q", data, to_points)[0] + 18)
    data[25] = 5
    struct.pack_into("<HI", data, 94, header_size + 18, to_points + 18)
    data[375:375] = struct.pack("<ddH", 1.0, 2.0, 1000)
    source.write_bytes(bytes(data))
    cloud = read_cloud(source)
    np.testing.assert_array_equal(cloud.xyz, before.xyz)
    copy_cloud(source, tmp_path / "c.las", lambda xyz, read: (None, {}), {})
    np.testing.assert_array_equal(laspy.read(tmp_path / "c.las").xyz, before.xyz)


def test_a_damaged_file_is_not_called_cut_and_a_cut_one_is(tmp_path):
    made(6, 200_000).write(str(tmp_path / "a.laz"))
    data = (tmp_path / "a.laz").read_bytes()
    to_points = struct.unpack_from("<I", data, 96)[0]
    broken = bytearray(data)
    broken[to_points + 60 : to_points + 100] = b"\xff" * 40  # sizes of the first chunk's layers
    (tmp_path / "b.laz").write_bytes(bytes(broken))
    with pytest.raises(InputError, match="whole length"):
        read_cloud(tmp_path / "b.laz")
    (tmp_path / "c.laz").write_bytes(data[: len(data) // 2])
    with pytest.raises(InputError, match="breaks off|truncated"):
        read_cloud(tmp_path / "c.laz")


def _e57(path, scans) -> None:
    pye57 = pytest.importorskip("pye57")
    file = pye57.E57(str(path), mode="w")
    for points, turn, place, more in scans:
        columns = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), points.T.copy(), strict=True))
        file.write_scan_raw(
            {**columns, **more},
            rotation=np.array([np.cos(turn / 2), 0, 0, np.sin(turn / 2)]),
            translation=np.array(place),
        )
    file.close()


def test_e57_scans_stand_where_their_poses_say(tmp_path):
    rng = np.random.default_rng(1)
    world = rng.uniform(0, 10, (4000, 3)) + [500000, 4000000, 100]
    scans = []
    for turn, place, more in ((0.3, [500001.0, 4000002.0, 101.0], True), (2.0, [499990.0, 4000000.0, 100.0], False)):
        back = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        extra = (
            {"intensity": rng.random(4000)} if more else {"cartesianInvalidState": np.repeat([0, 1], 2000).astype("i1")}
        )
        scans.append(((world - place) @ back.T, turn, place, extra))
    _e57(tmp_path / "a.e57", scans)
    cloud = read_cloud(tmp_path / "a.e57", crs="EPSG:32615")
    assert len(cloud) == 6000 and describe_cloud(tmp_path / "a.e57").n_points == 8000
    np.testing.assert_allclose(cloud.xyz, np.vstack([world, world[:2000]]), atol=1e-4)
    assert np.bincount(cloud.attributes["point_source_id"]).tolist() == [0, 4000, 2000]
    copy_cloud(tmp_path / "a.e57", tmp_path / "a.laz", lambda xyz, read: (None, {}), {}, cloud.crs)
    np.testing.assert_allclose(laspy.read(tmp_path / "a.laz").xyz, cloud.xyz, atol=1e-4)


def test_e57_that_is_none(tmp_path):
    pytest.importorskip("pye57")
    (tmp_path / "a.e57").write_bytes(b"no such thing")
    with pytest.raises(InputError, match="LAS or LAZ"):
        read_cloud(tmp_path / "a.e57", crs="local")


def test_e57_without_its_library(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pye57", None)
    (tmp_path / "a.e57").write_bytes(b"ASTM-E57")
    with pytest.raises(MissingComponentError, match="e57.*CloudCompare"):
        read_cloud(tmp_path / "a.e57", crs="local")
