"""Files appear whole or not at all; a workspace remembers what is done."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyproj
import pytest
from affine import Affine

from treedgs_geo.core.errors import InputError, OutputError
from treedgs_geo.core.files import (
    atomic_folder,
    atomic_path,
    ensure_writable,
    fingerprint,
    remove_leftovers,
    write_json,
)
from treedgs_geo.core.workspace import Workspace, read_record
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import write_cloud
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.terrain.dtm import Dtm, write_dtm

ROOT = Path(__file__).resolve().parents[2]


def _is_done(space: Workspace, stage: str, key: str, outputs: list[Path]) -> bool:
    return space.ran(stage, key) and not space.damage(stage, outputs)


def test_a_failed_write_leaves_the_old_file_and_no_leftovers(tmp_path):
    target = tmp_path / "trees.gpkg"
    target.write_text("old")
    with pytest.raises(RuntimeError), atomic_path(target) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert target.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["trees.gpkg"]


def test_a_failed_folder_leaves_the_old_one(tmp_path):
    folder = tmp_path / "sfm"
    with atomic_folder(folder) as temporary:
        (temporary / "a").write_text("1")
    with pytest.raises(RuntimeError), atomic_folder(folder) as temporary:
        (temporary / "b").write_text("2")
        raise RuntimeError
    assert [p.name for p in folder.iterdir()] == ["a"] and [p.name for p in tmp_path.iterdir()] == ["sfm"]


def test_an_unwritable_output_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="choose another output folder"):
        ensure_writable(tmp_path / "file" / "trees.gpkg")
    with pytest.raises(OutputError, match="choose another output folder"):
        ensure_writable(tmp_path.__class__("/proc/trees.gpkg"))


@pytest.mark.parametrize("size", [1, 70_000, 131_072, 300_000, 3_000_000])
def test_fingerprint_follows_every_byte(tmp_path, size):
    one = tmp_path / "one"
    content = bytearray(b"a" * size)
    one.write_bytes(content)
    before = fingerprint([one])
    os.utime(one, (1, 1))
    assert before == fingerprint([one])
    for place in {0, size // 3, size // 2, size - 1}:
        content[place] = ord("b")
        one.write_bytes(content)
        assert before != fingerprint([one]), place
        content[place] = ord("a")


def test_what_cannot_be_fingerprinted_is_named(tmp_path):
    with pytest.raises(InputError, match=r"gone\.pos: cannot be read"):
        fingerprint([tmp_path / "gone.pos"])


def test_stages_resume_only_when_nothing_changed(tmp_path):
    space = Workspace(tmp_path / "plot é 1")
    output = space.path("dtm.tif")
    with space.running("terrain", "k1", {"resolution_m": 0.25}) as result:
        output.write_text("x")
        result["cells"] = 5
    again = Workspace(tmp_path / "plot é 1")
    assert _is_done(again, "terrain", "k1", [output]) and again.result("terrain") == {"cells": 5}
    assert not _is_done(again, "terrain", "k2", [output])
    output.unlink()
    assert not _is_done(again, "terrain", "k1", [output])


def test_a_failed_stage_is_recorded_and_not_reused(tmp_path):
    space = Workspace(tmp_path)
    with pytest.raises(ValueError), space.running("fit", "k", {}):
        raise ValueError("broke")
    entry = Workspace(tmp_path).record["stages"]["fit"]
    assert entry["status"] == "failed" and entry["error"] == "broke"
    assert not _is_done(space, "fit", "k", [])


@pytest.mark.parametrize("harm", ["gone", "cut", "changed", "a folder"])
def test_an_output_that_was_harmed_is_named(tmp_path, harm):
    space = Workspace(tmp_path)
    output, layer = tmp_path / "sfm" / "images.bin", tmp_path / "geotags.gpkg"
    output.parent.mkdir()
    with space.running("fit", "k", {}, [output, layer], edited=[layer]):
        output.write_bytes(b"x" * 1000)
        layer.write_bytes(b"y")
    again = Workspace(tmp_path)
    assert _is_done(again, "fit", "k", [output, layer])
    layer.write_bytes(b"moved by hand")
    assert _is_done(again, "fit", "k", [output, layer])
    if harm in ("gone", "a folder"):
        output.unlink()
    if harm == "a folder":
        output.mkdir()
    if harm == "cut":
        output.write_bytes(b"x" * 900)
    if harm == "changed":
        output.write_bytes(b"x" * 999 + b"z")
    assert not _is_done(again, "fit", "k", [output, layer]) and again.ran("fit", "k")
    assert again.damage("fit", [output, layer]).startswith(str(output))


def test_a_record_that_was_edited_by_hand_counts_as_not_done(tmp_path):
    for entry in ({}, {"status": "done"}, {"status": "done", "key": "k"}, {"status": "done", "key": "k", "result": []}):
        write_json(tmp_path / "run.json", {"stages": {"fit": entry}})
        assert not _is_done(Workspace(tmp_path), "fit", "k", [])


def test_what_a_killed_process_left_goes_and_what_a_living_one_writes_stays(tmp_path):
    script = """
import sys, time
from pathlib import Path
from treedgs_geo.core.files import temporary_beside
with temporary_beside(Path(sys.argv[1])) as temporary:
    temporary.write_text("half")
    Path(str(temporary) + "-journal").write_text("")
    print(temporary.name, flush=True)
    sys.stdin.read()
"""
    target, other = tmp_path / "trees[1].gpkg", tmp_path / "trees[1]x.gpkg"
    left = []
    for place in (target, target, other):
        writer = subprocess.Popen(
            [sys.executable, "-c", script, str(place)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        )
        left.append((writer, writer.stdout.readline().strip()))
    (tmp_path / ".trees[1].mine.gpkg").write_text("a user's own hidden file")
    try:
        left[0][0].kill()
        left[0][0].wait()
        left[2][0].kill()
        left[2][0].wait()
        with atomic_path(target) as temporary:
            temporary.write_text("new")
        mine = {".trees[1].mine.gpkg", target.name}
        there = {path.name for path in tmp_path.iterdir()}
        assert there == {left[1][1], left[1][1] + "-journal", left[2][1], left[2][1] + "-journal", *mine}
    finally:
        left[1][0].communicate("")
    remove_leftovers(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == mine


@pytest.fixture
def small_disk(tmp_path):
    """A disk of one megabyte."""
    disk = tmp_path / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(disk)], capture_output=True).returncode:
        pytest.skip("mounting a small disk is not permitted here")
    yield disk
    subprocess.run(["umount", "-l", str(disk)], check=False)


def fill(disk: Path, left: int) -> None:
    (disk / "ballast").write_bytes(b"x" * (shutil.disk_usage(disk).free - left))


def many_trees(count: int) -> list[Tree]:
    return [
        Tree(n + 1, 611337.0 + n, 3718451.0, 38.0, dbh_cm=30.0, dbh_se_cm=0.4, n_views=7, method="photos")
        for n in range(count)
    ]


def dtm_of(side: int) -> Dtm:
    heights = np.random.default_rng(0).uniform(0, 1, (side, side))
    return Dtm(heights, Affine(0.5, 0, 5e5, 0, -0.5, 4e6), pyproj.CRS("EPSG:6344"))


def cloud_of(count: int) -> PointCloud:
    return PointCloud(np.random.default_rng(0).uniform(0, 99, (count, 3)) + [5e5, 4e6, 0], pyproj.CRS("EPSG:6344"), {})


WRITERS = {
    "trees.gpkg": lambda path: write_trees(path, many_trees(3000), pyproj.CRS("EPSG:6344")),
    "trees.shp": lambda path: write_trees(path, many_trees(3000), pyproj.CRS("EPSG:6344")),
    "trees.geojson": lambda path: write_trees(path, many_trees(3000), pyproj.CRS("EPSG:6344")),
    "trees.csv": lambda path: write_trees(path, many_trees(9000), pyproj.CRS("EPSG:6344")),
    "dtm.tif": lambda path: write_dtm(path, dtm_of(700)),
    "cloud.laz": lambda path: write_cloud(path, cloud_of(200_000)),
    "run.json": lambda path: write_json(path, ["a" * 999] * 2000),
}


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("left", [0, 40_000, 300_000])
def test_a_full_disk_is_one_sentence_and_leaves_nothing(small_disk, name, left):
    fill(small_disk, left)
    with pytest.raises(OutputError, match="disk is full|No space left") as reported:
        WRITERS[name](small_disk / name)
    assert str(small_disk) in str(reported.value)
    assert [path.name for path in small_disk.iterdir()] == ["ballast"]


def test_a_full_disk_keeps_the_old_layer_and_the_users(small_disk):
    path = write_trees(small_disk / "trees.gpkg", many_trees(5), pyproj.CRS("EPSG:6344"))
    fill(small_disk, 150_000)
    before = path.read_bytes()
    with pytest.raises(OutputError, match="disk is full"):
        write_trees(path, many_trees(3000), pyproj.CRS("EPSG:6344"))
    assert path.read_bytes() == before and sorted(p.name for p in small_disk.iterdir()) == ["ballast", "trees.gpkg"]


def test_a_record_on_a_full_disk(small_disk):
    space = Workspace(small_disk / "work")
    space.save()
    fill(small_disk, 0)
    with (
        pytest.raises(OutputError, match=r"run\.json: cannot be written, the disk is full"),
        space.running("fit", "k", {"text": "x" * 9000}),
    ):
        pass
    assert read_record(small_disk / "work")["stages"] == {}


def test_a_limit_on_file_sizes_is_reported_like_a_full_disk(tmp_path):
    """As cluster queues set it; needs no mount."""
    script = f"""
import resource, sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
from pathlib import Path
from test_files_and_workspace import WRITERS
resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
from treedgs_geo.core.errors import OutputError
for name in ("trees.gpkg", "trees.csv", "cloud.laz", "run.json", "dtm.tif"):
    try:
        WRITERS[name](Path(sys.argv[1]) / name)
    except OutputError as problem:
        print(name, "refused", problem)
"""
    (tmp_path / "out").mkdir()
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path / "out")], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert done.stdout.count("refused") == 5, done.stdout + done.stderr
    assert os.listdir(tmp_path / "out") == []


def test_a_foreign_run_json_is_refused(tmp_path):
    write_json(tmp_path / "run.json", ["something", "else"])
    with pytest.raises(InputError, match="choose an empty folder"):
        Workspace(tmp_path)
