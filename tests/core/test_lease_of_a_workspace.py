"""Two runs never work in one workspace: the second is refused, a dead one's place is taken over."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from treedgs_geo.cli import main
from treedgs_geo.core import folder_lock as leases
from treedgs_geo.core.errors import InputError, OutputError
from treedgs_geo.core.workspace import STALE_S, Workspace, in_use

ROOT = Path(__file__).resolve().parents[2]
HOLD = """
import sys
from pathlib import Path
from treedgs_geo.core.workspace import Workspace
with Workspace.held(Path(sys.argv[1])) as space:
    space.save()
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def holder(tmp_path):
    """Another process that works in ``tmp_path / "work"``."""
    (tmp_path / "work").mkdir()
    running = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path / "work")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    assert running.stdout.readline() == "held\n"
    yield running
    running.kill()
    running.communicate()


@pytest.fixture
def photos(tmp_path):
    folder = tmp_path / "photos"
    folder.mkdir()
    Image.fromarray(np.random.default_rng(1).integers(0, 255, (60, 80, 3), np.uint8)).save(folder / "DJI_0001.JPG")
    return folder


@pytest.mark.parametrize(
    "verb", ["photos-to-dbh", "photos-to-dbh --dry-run", "reconstruct", "fit-gaussians", "sample-surface"]
)
def test_the_second_run_is_refused_and_says_who_works_there(holder, photos, tmp_path, capsys, verb):
    work = tmp_path / "work"
    (work / "sfm").mkdir()
    before = sorted(os.listdir(work))
    words = [*verb.split(), "--workspace", str(work)]
    if verb.split()[0] in ("photos-to-dbh", "reconstruct"):
        words += ["--photos", str(photos), "--crs", "EPSG:6344"]
    if verb.startswith("photos-to-dbh"):
        words += ["--output", str(tmp_path / "trees.gpkg")]
    assert main([*words, "--log-format", "plain"]) == 2
    reported = "".join(capsys.readouterr())
    assert "another run works in this workspace" in reported and f"process {holder.pid}" in reported, reported
    assert "Traceback" not in reported and sorted(os.listdir(work)) == before and not (tmp_path / "trees.gpkg").exists()


def test_a_killed_run_gives_way_and_an_ended_one_too(holder, tmp_path):
    with pytest.raises(InputError, match="another run works"), Workspace.held(tmp_path / "work"):
        pass
    holder.kill()
    holder.wait()
    assert in_use(tmp_path / "work") == ""
    for _ in range(2):
        with Workspace.held(tmp_path / "work") as space:
            assert str(os.getpid()) in in_use(tmp_path / "work")
            space.save()
    assert in_use(tmp_path / "work") == ""


def test_another_computers_run_counts_until_it_is_silent_for_long(tmp_path):
    with Workspace.held(tmp_path) as space:
        space.save()
        file = next(tmp_path.glob("lease.0*"))
        file.write_text(json.dumps({**json.loads(file.read_text()), "host": "elsewhere"}))
        minutes_ago = time.time() - leases.STALE_S - 30
        os.utime(file, (minutes_ago, minutes_ago))
        with pytest.raises(InputError, match=r"elsewhere.*if that computer is off"), Workspace.held(tmp_path):
            pass
        long_ago = time.time() - STALE_S - 5
        os.utime(file, (long_ago, long_ago))
        with Workspace.held(tmp_path) as other:
            other.save()
            # The sleeper wakes up: it must not write over the other's record.
            with pytest.raises(OutputError, match="taken this workspace over"):
                space.save()


def test_the_parent_may_hold_it_for_its_child(tmp_path, monkeypatch):
    """A campaign's supervisor holds a plot's lease for the engine that it starts."""
    lease = leases.Lease.take(tmp_path)
    monkeypatch.setenv(leases.HANDED, lease.key)
    with Workspace.held(tmp_path) as space:
        space.save()
    lease.check()  # not freed by the child
    monkeypatch.setenv(leases.HANDED, "another key")
    with pytest.raises(InputError, match="another run works"), Workspace.held(tmp_path):
        pass


def test_a_changed_clock_does_not_make_a_living_run_look_dead(holder, tmp_path, monkeypatch):
    import psutil

    monkeypatch.setattr(psutil.Process, "create_time", lambda self: 1.0)
    assert f"process {holder.pid}" in in_use(tmp_path / "work")


def test_a_run_that_made_nothing_leaves_nothing(tmp_path):
    with pytest.raises(RuntimeError), Workspace.held(tmp_path / "new"):
        raise RuntimeError
    assert list((tmp_path / "new").iterdir()) == []
