"""Damaged LAS and LAZ files: points as the header says them, or one clear sentence; never a crash or endless memory."""

from __future__ import annotations

import numpy as np
import pytest
from pointcloud.test_layouts import made

from treedgs_geo.core.errors import InputError
from treedgs_geo.pointcloud.files import describe_cloud, iter_cloud, read_cloud


@pytest.mark.parametrize("point_format", [1, 3, 6])
@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_any_byte_of_the_header(tmp_path, point_format, suffix):
    """Every field of the header and of the records behind it is hit, the sizes and offsets among them."""
    made(point_format, 300).write(str(tmp_path / f"a{suffix}"))
    data = (tmp_path / f"a{suffix}").read_bytes()
    whole = read_cloud(tmp_path / f"a{suffix}")
    start = int.from_bytes(data[96:100], "little")
    rng = np.random.default_rng(point_format)
    path, read = tmp_path / f"f{suffix}", 0
    for _ in range(250):
        broken = bytearray(data)
        for _ in range(int(rng.integers(1, 4))):
            # Half of the hits go to the public header, where the sizes stand.
            place = int(rng.integers(0, min(375, start))) if rng.random() < 0.5 else int(rng.integers(0, start))
            broken[place] = int(rng.choice([0, 1, 127, 128, 255, int(rng.integers(0, 256))]))
        path.write_bytes(bytes(broken))
        try:
            cloud = read_cloud(path, need_crs=False)
        except InputError as problem:
            assert str(path) in str(problem) or "--crs" in str(problem)
            continue
        read += 1
        assert np.isfinite(cloud.xyz).all() and 0 < len(cloud) <= len(whole)
    assert 20 < read < 250


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_damaged_points_and_cut_files(tmp_path, suffix):
    made(6, 3000).write(str(tmp_path / f"a{suffix}"))
    data = (tmp_path / f"a{suffix}").read_bytes()
    rng = np.random.default_rng(7)
    path = tmp_path / f"f{suffix}"
    for number in range(80):
        broken = bytearray(data[: int(rng.integers(1, len(data)))] if number % 2 else data)
        if number % 2 == 0:
            for place in rng.integers(400, len(data), 3):
                broken[int(place)] ^= 0xFF
        path.write_bytes(bytes(broken))
        try:
            count = sum(len(piece) for piece in iter_cloud(path, need_crs=False, chunk_points=1000))
        except InputError as problem:
            assert str(path) in str(problem)
            continue
        whole = number % 2 == 0 or len(broken) > 0.98 * len(data)
        assert count <= 3000 and whole, "a cut file must not pass as whole"


def test_a_promise_of_a_billion_points_costs_nothing(tmp_path):
    made(6, 100).write(str(tmp_path / "a.laz"))
    data = bytearray((tmp_path / "a.laz").read_bytes())
    data[247:255] = (10**9).to_bytes(8, "little")
    (tmp_path / "b.laz").write_bytes(bytes(data))
    assert describe_cloud(tmp_path / "b.laz").n_points == 10**9
    with pytest.raises(InputError, match=r"b\.laz"):
        read_cloud(tmp_path / "b.laz")
