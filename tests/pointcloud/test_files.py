"""LAS/LAZ and text clouds: round trips, clips, CRS rules and broken files."""

from __future__ import annotations

import laspy
import numpy as np
import pyproj
import pytest
from shared_data import needs_shared

from treedgs_geo.core.errors import CRSError, InputError
from treedgs_geo.pointcloud.cloud import PointCloud, concatenate, thin
from treedgs_geo.pointcloud.files import iter_cloud, read_cloud, write_cloud

UTM = pyproj.CRS.from_epsg(32615)


def make_cloud(count=5000, crs=UTM):
    rng = np.random.default_rng(3)
    xyz = np.column_stack(
        [rng.uniform(611300, 611400, count), rng.uniform(3718400, 3718500, count), rng.uniform(30, 60, count)]
    )
    return PointCloud(
        xyz,
        crs,
        {
            "intensity": rng.integers(0, 65535, count).astype(np.uint16),
            "classification": np.full(count, 2, np.uint8),
            "opacity": rng.uniform(0, 1, count).astype(np.float32),
            "tree_id": rng.integers(0, 40, count).astype(np.int32),
            "return_number": np.ones(count, np.uint8),
            "number_of_returns": np.ones(count, np.uint8),
        },
    )


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_round_trip_keeps_everything(tmp_path, suffix):
    cloud = make_cloud()
    write_cloud(tmp_path / f"a{suffix}", cloud)
    back = read_cloud(tmp_path / f"a{suffix}")
    assert np.abs(back.xyz - cloud.xyz).max() <= 0.0005 + 1e-9
    assert back.crs.to_epsg() == 32615
    for name, values in cloud.attributes.items():
        np.testing.assert_array_equal(back.attributes[name], values)
    # Written again at the same scale and offsets, nothing moves any more.
    write_cloud(tmp_path / f"b{suffix}", back)
    np.testing.assert_array_equal(read_cloud(tmp_path / f"b{suffix}").xyz, back.xyz)


def test_compound_crs_and_colours_survive(tmp_path):
    cloud = make_cloud(100, pyproj.CRS.from_user_input("EPSG:6344+5703"))
    for number, name in enumerate(("red", "green", "blue")):
        cloud = cloud.with_attribute(name, np.full(100, 1000 * number, np.uint16))
    write_cloud(tmp_path / "a.laz", cloud)
    back = read_cloud(tmp_path / "a.laz")
    assert back.crs.is_compound and back.horizontal_crs.to_epsg() == 6344
    assert (back.attributes["green"] == 1000).all()


def test_chunks_bounds_and_choice_of_attributes(tmp_path):
    cloud = make_cloud()
    write_cloud(tmp_path / "a.laz", cloud)
    box = (611320.0, 3718420.0, 611350.0, 3718460.0)
    pieces = list(iter_cloud(tmp_path / "a.laz", bounds=box, attributes=("opacity",), chunk_points=700))
    assert len(pieces) == 8
    joined = concatenate(pieces)
    inside = (
        (cloud.xyz[:, 0] >= box[0])
        & (cloud.xyz[:, 0] <= box[2])
        & (cloud.xyz[:, 1] >= box[1])
        & (cloud.xyz[:, 1] <= box[3])
    )
    assert abs(len(joined) - inside.sum()) <= 2 and list(joined.attributes) == ["opacity"]
    with pytest.raises(InputError, match="no point within"):
        read_cloud(tmp_path / "a.laz", bounds=(0, 0, 1, 1))


def test_crs_rules(tmp_path):
    write_cloud(tmp_path / "none.laz", make_cloud(50, None))
    with pytest.raises(CRSError, match="--crs"):
        read_cloud(tmp_path / "none.laz")
    assert read_cloud(tmp_path / "none.laz", crs="EPSG:32615").crs.to_epsg() == 32615
    assert read_cloud(tmp_path / "none.laz", crs="local").crs is None
    with pytest.raises(CRSError, match="geographic"):
        read_cloud(tmp_path / "none.laz", crs="EPSG:4326")
    write_cloud(tmp_path / "deg.laz", make_cloud(50, pyproj.CRS.from_epsg(4326)))
    with pytest.raises(CRSError, match="geographic"):
        read_cloud(tmp_path / "deg.laz")
    write_cloud(tmp_path / "feet.laz", make_cloud(50, pyproj.CRS.from_epsg(2277)))
    with pytest.raises(CRSError, match="metres"):
        read_cloud(tmp_path / "feet.laz")
    write_cloud(tmp_path / "utm.laz", make_cloud(50))
    with pytest.raises(CRSError, match="but --crs says"):
        read_cloud(tmp_path / "utm.laz", crs="EPSG:32616")


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_truncated_files_are_refused(tmp_path, suffix):
    whole = tmp_path / f"whole{suffix}"
    write_cloud(whole, make_cloud(20000))
    data = whole.read_bytes()
    for share in (0.001, 0.02, 0.5, 0.95):
        broken = tmp_path / f"broken{suffix}"
        broken.write_bytes(data[: int(len(data) * share)])
        with pytest.raises(InputError, match=r"broken\.la"):
            read_cloud(broken)


def test_a_compressed_cloud_under_the_other_ending_is_read(tmp_path):
    write_cloud(tmp_path / "a.laz", make_cloud(1000))
    (tmp_path / "a.laz").rename(tmp_path / "a.las")
    assert len(read_cloud(tmp_path / "a.las")) == 1000


def test_a_header_that_promises_too_much(tmp_path):
    write_cloud(tmp_path / "a.las", make_cloud(1000))
    data = bytearray((tmp_path / "a.las").read_bytes())
    data[247:255] = (5000).to_bytes(8, "little")  # LAS 1.4 point count
    (tmp_path / "b.las").write_bytes(bytes(data))
    with pytest.raises(InputError, match="promises 5000"):
        read_cloud(tmp_path / "b.las")


def test_not_a_cloud(tmp_path):
    (tmp_path / "photo.laz").write_bytes(b"JFIF" * 500)
    with pytest.raises(InputError, match=r"photo\.laz"):
        read_cloud(tmp_path / "photo.laz")
    with pytest.raises(InputError, match="not found"):
        read_cloud(tmp_path / "absent.laz")
    laspy.LasData(laspy.LasHeader(version="1.4", point_format=6)).write(str(tmp_path / "empty.las"))
    with pytest.raises(InputError, match="no point"):
        read_cloud(tmp_path / "empty.las", crs="local")
    with pytest.raises(InputError, match="ending"):
        write_cloud(tmp_path / "a.pcd", make_cloud(3))


def test_random_header_bytes_never_crash(tmp_path):
    """A fuzzed header gives points or an InputError, nothing else."""
    write_cloud(tmp_path / "a.las", make_cloud(200))
    data = (tmp_path / "a.las").read_bytes()
    rng = np.random.default_rng(5)
    for number in range(60):
        broken = bytearray(data)
        # The offset and record-length fields are spared: absurd ones only make laspy ask for absurd memory.
        for _ in range(3):
            broken[int(rng.choice(np.r_[0:94, 104:247]))] = int(rng.integers(0, 256))
        path = tmp_path / f"f{number}.las"
        path.write_bytes(bytes(broken))
        try:
            assert np.isfinite(read_cloud(path).xyz).all()
        except InputError as problem:
            assert str(path) in str(problem)


def test_text_clouds(tmp_path):
    (tmp_path / "plain.txt").write_text("1.5 2.5 3.5\n4 5 6\n")
    assert read_cloud(tmp_path / "plain.txt", crs="local").xyz.tolist() == [[1.5, 2.5, 3.5], [4, 5, 6]]
    (tmp_path / "head.csv").write_text("id,x,y,z\n7,1,2,3\n8,4,5,6\n")
    cloud = read_cloud(tmp_path / "head.csv", crs="local")
    assert cloud.xyz.tolist() == [[1, 2, 3], [4, 5, 6]] and cloud.attributes["id"].tolist() == [7, 8]
    (tmp_path / "bad.txt").write_text("1 2 3\n4 five 6\n")
    with pytest.raises(InputError, match="table of numbers"):
        read_cloud(tmp_path / "bad.txt", crs="local")
    (tmp_path / "two.txt").write_text("1 2\n3 4\n")
    with pytest.raises(InputError, match="columns"):
        read_cloud(tmp_path / "two.txt", crs="local")


def test_real_files_read():
    folder = needs_shared("lidar_spanner")
    cloud = read_cloud(folder / "UAS_Clip.laz")
    assert len(cloud) == 390877 and cloud.horizontal_crs.is_projected
    single = read_cloud(needs_shared("lidar_itsme") / "tree_1_pc.txt", crs="local")
    assert single.xyz.shape == (30826, 3)


def test_thinning_keeps_one_point_a_voxel():
    xyz = np.random.default_rng(0).uniform(0, 1, (20000, 3))
    kept = thin(xyz, 0.1)
    assert len(kept) == 1000 and (np.diff(kept) > 0).all()
