"""Outputs that another program holds open, as Windows refuses them: nothing is lost, and it is said."""

from __future__ import annotations

import os
import re
import sys

import pytest

from treedgs_geo.core import files
from treedgs_geo.core.errors import OutputError
from treedgs_geo.core.files import atomic_folder, atomic_path, write_json


@pytest.fixture
def hold(monkeypatch):
    """Held names cannot be renamed, nor be renamed onto: ``hold(path, times)``; the platform is Windows."""
    held: dict[str, int] = {}
    real = os.replace

    def replace(source, target):
        for name in (os.fspath(source), os.fspath(target)):
            if held.get(name, 0) > 0:
                held[name] -= 1
                raise PermissionError(13, "The process cannot access the file", name)
        return real(source, target)

    monkeypatch.setattr(os, "replace", replace)
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(files, "HELD_S", 0.3)
    monkeypatch.setattr(files, "longest_path", lambda: 0)  # asked of a registry that is not here
    return lambda path, times=10**6: held.__setitem__(os.fspath(path), times)


def test_a_table_open_in_excel_stays_and_the_new_one_is_kept_beside(hold, tmp_path):
    table = tmp_path / "trees.csv"
    table.write_text("old")
    hold(table)
    for kept in ("trees.new.csv", "trees.new2.csv"):
        with pytest.raises(OutputError, match="close it there and run again") as caught:
            with atomic_path(table) as temporary:
                temporary.write_text("new")
        assert kept in str(caught.value) and "\n" not in str(caught.value)
        assert (tmp_path / kept).read_text() == "new"
    assert table.read_text() == "old"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["trees.csv", "trees.new.csv", "trees.new2.csv"]


def test_a_moments_hold_is_waited_for(hold, tmp_path):
    """A virus scanner, or QGIS reading the state of a run."""
    (tmp_path / "run.json").write_text("{}")
    hold(tmp_path / "run.json", 1)
    write_json(tmp_path / "run.json", {"stage": "measure"})
    assert "measure" in (tmp_path / "run.json").read_text() and len(list(tmp_path.iterdir())) == 1


def test_a_folder_with_an_open_file_is_not_half_removed(hold, tmp_path):
    folder = tmp_path / "report"
    folder.mkdir()
    (folder / "a.csv").write_text("old a")
    (folder / "b.csv").write_text("old b")
    hold(folder)
    with pytest.raises(OutputError, match="holds a file in it open") as caught, atomic_folder(folder) as temporary:
        (temporary / "a.csv").write_text("new a")
    kept = re.search(r"kept as (\S+)\.$", str(caught.value))[1]
    assert {p.name: p.read_text() for p in folder.iterdir()} == {"a.csv": "old a", "b.csv": "old b"}
    assert open(os.path.join(kept, "a.csv")).read() == "new a"
    assert len(list(tmp_path.iterdir())) == 2


def test_a_folder_is_replaced_whole(tmp_path):
    folder = tmp_path / "report"
    for text in ("first", "second"):
        with atomic_folder(folder) as temporary:
            (temporary / f"{text}.csv").write_text(text)
    assert [p.name for p in folder.iterdir()] == ["second.csv"] and len(list(tmp_path.iterdir())) == 1
