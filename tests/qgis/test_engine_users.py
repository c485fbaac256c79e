"""Several QGIS profiles on one desk, with plugins of different versions: nobody removes an engine that another uses."""

from __future__ import annotations

import importlib
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from qgis_driver import ROOT, load


@pytest.fixture
def profile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Make the plugin in a profile of its own, with a locked list of its own, and its engine in the common folder."""
    monkeypatch.setenv("TREEDGS_HOME", str(tmp_path / "données"))
    monkeypatch.delenv("TREEDGS_PYTHON", raising=False)

    def make(name: str, locked: str) -> SimpleNamespace:
        folder = tmp_path / name / "plugins" / "treedgs"
        shutil.copytree(ROOT / "treedgs_qgis", folder / "treedgs_qgis")
        (folder / "metadata.txt").write_text("[general]\n")
        (folder / "treedgs_qgis" / "requirements-locked.txt").write_text(locked)
        package = f"treedgs_shell_{tmp_path.name}_{name}"
        load(package, folder / "treedgs_qgis" / "__init__.py", folder / "treedgs_qgis")
        engine, leftovers = (importlib.import_module(f"{package}.{module}") for module in ("engine", "leftovers"))
        return SimpleNamespace(folder=folder, engine=engine, leftovers=leftovers)

    return make


def build(plugin: SimpleNamespace) -> Path:
    """Its engine, without libraries; found once, as each job does."""
    environment = plugin.engine.managed_environment()
    if not environment.exists():
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", environment], check=True)
    assert plugin.engine.find_engine().source == "the managed environment"
    return environment


def test_the_engine_of_another_profile_stays(profile):
    older, newer = profile("qgis322", "numpy==1\n"), profile("qgis344", "numpy==2\n")
    engines = [build(older), build(newer)]
    assert engines[0] != engines[1]
    for plugin in (older, newer, older):
        assert plugin.leftovers.remove_former() == (0, [])
    assert all(engine.exists() for engine in engines)
    assert older.leftovers.used_elsewhere() == {engines[1].name: str(newer.folder)}


def test_the_former_engine_of_an_upgraded_plugin_goes(profile):
    older, newer = profile("qgis322", "numpy==1\n"), profile("qgis344", "numpy==2\n")
    engines = [build(older), build(newer)]
    (newer.folder / "treedgs_qgis" / "requirements-locked.txt").write_text("numpy==3\n")
    fresh = build(newer)
    # Also by the other profile's set-up: nobody uses it any more.
    assert older.leftovers.remove_former()[0] > 0
    assert not engines[1].exists() and engines[0].exists() and fresh.exists()


def test_an_engine_that_two_share_goes_with_the_second(profile):
    one, other = profile("one", "numpy==1\n"), profile("other", "numpy==1\n")
    engine = build(one)
    assert build(other) == engine
    assert one.leftovers.remove_all() == (0, []) and engine.exists()
    assert other.leftovers.remove_all()[0] > 0 and not engine.exists()


def test_an_engine_whose_plugin_was_uninstalled_goes(profile):
    older, newer = profile("qgis322", "numpy==1\n"), profile("qgis344", "numpy==2\n")
    engine = build(older)
    build(newer)
    shutil.rmtree(older.folder)
    assert newer.leftovers.remove_former()[0] > 0 and not engine.exists()


def test_a_damaged_note_and_a_folder_that_cannot_be_written_stop_nothing(profile):
    plugin = profile("one", "numpy==1\n")
    engine = build(plugin)
    users = plugin.engine.data_dir() / "users"
    next(users.iterdir()).write_text("{")
    assert plugin.engine.find_engine().python.parents[1] == engine
    shutil.rmtree(users)
    users.write_text("no folder")
    assert plugin.engine.find_engine().python.parents[1] == engine
    assert plugin.leftovers.remove_former() == (0, []) and engine.exists()
