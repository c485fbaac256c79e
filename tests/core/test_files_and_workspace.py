"""Files appear whole or not at all; a workspace remembers what is done."""

from __future__ import annotations

import pytest

from treedgs_geo.core.errors import InputError, OutputError
from treedgs_geo.core.files import atomic_folder, atomic_path, ensure_writable, fingerprint, write_json
from treedgs_geo.core.workspace import Workspace


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


def test_fingerprint_follows_content(tmp_path):
    one = tmp_path / "one"
    one.write_bytes(b"a" * 300_000)
    before = fingerprint([one])
    assert before == fingerprint([one])
    one.write_bytes(b"a" * 299_999 + b"b")
    assert before != fingerprint([one])


def test_stages_resume_only_when_nothing_changed(tmp_path):
    space = Workspace(tmp_path / "plot é 1")
    output = space.path("dtm.tif")
    with space.running("terrain", "k1", {"resolution_m": 0.25}) as result:
        output.write_text("x")
        result["cells"] = 5
    again = Workspace(tmp_path / "plot é 1")
    assert again.is_done("terrain", "k1", [output]) and again.result("terrain") == {"cells": 5}
    assert not again.is_done("terrain", "k2", [output])
    output.unlink()
    assert not again.is_done("terrain", "k1", [output])


def test_a_failed_stage_is_recorded_and_not_reused(tmp_path):
    space = Workspace(tmp_path)
    with pytest.raises(ValueError), space.running("fit", "k", {}):
        raise ValueError("broke")
    entry = Workspace(tmp_path).record["stages"]["fit"]
    assert entry["status"] == "failed" and entry["error"] == "broke"
    assert not space.is_done("fit", "k", [])


def test_a_foreign_run_json_is_refused(tmp_path):
    write_json(tmp_path / "run.json", ["something", "else"])
    with pytest.raises(InputError, match="choose an empty folder"):
        Workspace(tmp_path)
