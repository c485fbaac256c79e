"""Folders of data may hold anything: no file in the folder where a child starts is executed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from small_campaign import ROOT, Ended, make_cloud, write_manifest

from treedgs_geo.core.children import import_path, python_command

#: Names that Python or the engine import early; each file notes that it was executed.
NAMES = (
    "json",
    "signal",
    "typing",
    "dataclasses",
    "multiprocessing",
    "socket",
    "ssl",
    "numpy",
    "psutil",
    "distributed",
    "sitecustomize",
    "usercustomize",
    "argparse",
    "warnings",
    "pickle",
    "selectors",
    "queue",
)
TRAP = "open(__file__ + '.executed', 'w').close()\nraise ImportError('a file of the data folder was imported')\n"


@pytest.fixture
def hostile(tmp_path: Path) -> Path:
    """A folder whose files must not be imported."""
    folder = tmp_path / "from a stranger é"
    folder.mkdir()
    for name in (*NAMES, "runpy", "treedgs_geo"):
        (folder / f"{name}.py").write_text(TRAP)
    return folder


def executed(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*.executed"))


def plain() -> dict[str, str]:
    """The environment without Python's own switches: what a user's terminal has."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    return {**kept, "PYTHONPATH": os.pathsep.join(import_path())}


@pytest.mark.parametrize(
    "module",
    [
        "treedgs_geo",
        "treedgs_geo.campaign.plot",
        "treedgs_geo.reconstruction.colmap_process",
        "treedgs_lab.benchmarks.speed.jobs",
    ],
)
def test_children_import_nothing_from_their_folder(hostile, module):
    done = subprocess.run(
        python_command(module, "describe"),
        cwd=hostile,
        env=plain(),
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
    )
    assert executed(hostile) == [] and "data folder" not in done.stderr, done.stderr
    if module == "treedgs_geo":
        assert json.loads(done.stdout)["commands"]


def test_the_trap_works(hostile):
    """Without it the tests above could not fail."""
    subprocess.run([sys.executable, "-c", "import json"], cwd=hostile, env=plain(), capture_output=True)
    assert executed(hostile)  # json.py, or what this Python imports before it


def test_a_child_of_a_console_script_is_isolated_and_sees_what_its_parent_sees(hostile, tmp_path):
    """A child of a child, too: the path goes down the line, in isolated mode."""
    (tmp_path / "extra").mkdir()
    (tmp_path / "extra" / "only_here.py").write_text("")
    code = (
        "import sys; sys.path.append(sys.argv[1])\nfrom treedgs_geo.core.children import python_command\n"
        "import subprocess\nline = python_command('only_here')\n"
        "print(subprocess.run(line).returncode, '-I' in line)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "extra")], cwd=tmp_path, env=plain(), capture_output=True, text=True
    )
    assert done.stdout.split() == ["0", "True"], done.stderr


def test_programs_are_not_taken_from_the_current_folder(tmp_path, monkeypatch):
    """An empty entry of the PATH means the current folder."""
    from treedgs_geo.core.children import find_program

    (tmp_path / "exiftool").write_text("#!/bin/sh\n")
    (tmp_path / "exiftool").chmod(0o755)
    monkeypatch.chdir(tmp_path)
    for path in (os.pathsep, f".{os.pathsep}", "", os.pathsep.join(["", "/nowhere"])):
        monkeypatch.setenv("PATH", path)
        assert find_program("exiftool") is None, path
    monkeypatch.setenv("PATH", os.pathsep.join(["", str(tmp_path)]))
    assert find_program("exiftool") == str(tmp_path / "exiftool"), "named by the user"


def test_typed_with_m(hostile):
    """``python -m treedgs_geo`` there: only what Python itself needs for -m comes too early to be kept out."""
    for name in ("runpy", "treedgs_geo"):
        (hostile / f"{name}.py").unlink()
    done = subprocess.run(
        [sys.executable, "-m", "treedgs_geo", "describe"], cwd=hostile, env=plain(), capture_output=True, text=True
    )
    assert done.returncode == 0 and executed(hostile) == [], done.stderr
    # From the source folder it still runs without being installed.
    done = subprocess.run(
        [sys.executable, "-m", "treedgs_geo", "--version"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        env={name: value for name, value in plain().items() if name != "PYTHONPATH"},
    )
    assert done.returncode == 0, done.stderr


def test_mapping_processes(hostile, tmp_path, monkeypatch):
    from treedgs_geo.core.errors import ReconstructionError
    from treedgs_geo.reconstruction.colmap_process import run_task

    monkeypatch.chdir(hostile)
    with pytest.raises(ReconstructionError, match="no-such-task"):
        run_task("no-such-task", {}, tmp_path)
    assert executed(hostile) == [] and "KeyError" in (tmp_path / "no-such-task.log").read_text()


def test_a_campaigns_engines(hostile, tmp_path):
    """They start in the plot's folder, which is where its files are."""
    make_cloud(tmp_path / "cloud.laz", 1)
    manifest, workspace = write_manifest(tmp_path / "m.csv", [{"plot_id": "a", "cloud": "cloud.laz"}]), tmp_path / "w"
    (workspace / "plots" / "a").mkdir(parents=True)
    for name in NAMES:
        (workspace / "plots" / "a" / f"{name}.py").write_text(TRAP)
    # As the installed command does: Python is not isolated.
    script = tmp_path / "bin" / "treedgs"
    script.parent.mkdir()
    script.write_text(
        "import sys\nfrom treedgs_geo.cli import main\nif __name__ == '__main__':\n    sys.exit(main())\n"
    )
    ended = Ended(
        subprocess.Popen(
            [
                sys.executable,
                script,
                "campaign",
                "--manifest",
                manifest,
                "--workspace",
                workspace,
                "--json",
            ],
            cwd=hostile,
            env=plain(),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
    )
    assert ended.code == 0 and ended.result["n_done"] == 1, f"{ended.messages[-1]} {ended.log} {executed(tmp_path)}"
    assert executed(tmp_path) == []
