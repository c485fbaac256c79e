"""Real campaigns on small clouds: the trees of single runs, whatever is killed, full or broken meanwhile."""

from __future__ import annotations

import csv
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
from campaign_layers import differences
from child_processes import words_of
from PIL import Image
from small_campaign import ROOT, Ended, make_cloud, start, write_manifest

from treedgs_geo.campaign.engine_process import THREADS
from treedgs_geo.inventory.tree_reading import read_trees


def rows_for(clouds: Path, count: int = 6) -> list[dict]:
    return [{"plot_id": f"p{n}", "cloud": clouds / f"cloud_{n}.laz"} for n in range(count)]


def table(workspace: Path) -> dict[str, dict]:
    with open(workspace / "plots.csv", newline="", encoding="utf-8-sig") as stream:
        return {row["plot_id"]: row for row in csv.DictReader(stream)}


def engines(workspace: Path) -> list[psutil.Process]:
    """Plots' engines of this campaign."""
    found = psutil.process_iter(["cmdline"])
    words = {process: " ".join(process.info["cmdline"] or []) for process in found}
    return [
        process for process, line in words.items() if "treedgs_geo.campaign.plot" in line and str(workspace) in line
    ]


def wait_until(condition, seconds: float = 90.0) -> None:
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "it never happened"
        time.sleep(0.05)


def nobody_left(workspace: Path) -> bool:
    return not engines(workspace)


@pytest.fixture(scope="module")
def calm(clouds, tmp_path_factory) -> Path:
    """An undisturbed campaign of all six, in a place with blanks and accents, from an Excel manifest."""
    place = tmp_path_factory.mktemp("Säson 2026 ü")
    for n in range(6):
        shutil.copy2(clouds / f"cloud_{n}.laz", place / f"Wölke {n}.laz")
    lines = ["plot_id;cloud;bh_m", *(f"p{n};Wölke {n}.laz;1,37" for n in range(6))]
    (place / "plots.csv").write_bytes("\r\n".join(lines).encode("utf-8-sig"))
    ended = Ended(start(place / "plots.csv", place / "mein Ordner", "--workers", "2"))
    assert ended.code == 0, ended.said("error") + [ended.log]
    assert ended.result["n_run"] == 6 and ended.result["n_failed"] == 0
    for n in range(6):
        shutil.copy(place / "mein Ordner" / "plots" / f"p{n}" / "trees.gpkg", place / f"p{n}.gpkg")
    return place


def undisturbed(calm: Path, count: int) -> dict[str, Path]:
    """The first plots' layers of the undisturbed campaign."""
    return {f"p{n}": calm / f"p{n}.gpkg" for n in range(count)}


def test_the_trees_of_single_runs(calm, clouds, tmp_path):
    layers = {}
    for n in range(6):
        layers[f"p{n}"] = tmp_path / f"{n}.gpkg"
        subprocess.run(
            [
                sys.executable,
                "-m",
                "treedgs_geo",
                "pointcloud-to-dbh",
                "--input",
                clouds / f"cloud_{n}.laz",
                "--output",
                layers[f"p{n}"],
                "--log-format",
                "quiet",
            ],
            check=True,
            cwd=ROOT,
            env={**os.environ, **dict.fromkeys(THREADS, "1")},
            stdout=subprocess.DEVNULL,
        )
    assert differences(calm / "mein Ordner" / "trees.gpkg", layers) == []
    trees = read_trees(calm / "mein Ordner" / "trees.gpkg")
    assert len(trees) >= 15 and set(trees["plot_id"]) == set(layers) and (trees["tree_id"] // 100_000).nunique() == 6
    page = (calm / "mein Ordner" / "campaign.html").read_text(encoding="utf-8")
    assert page.count("<tr class='done'>") == 6


def test_a_second_start_does_only_what_is_missing(calm, campaign):
    """Nothing; then what changed: one cloud, one setting, one plot taken out, one new."""
    manifest, workspace = calm / "plots.csv", calm / "mein Ordner"
    before = read_trees(workspace / "trees.gpkg").set_index("tree_id")
    again = campaign(manifest, workspace)
    assert (again.result["n_run"], again.result["n_kept"]) == (0, 6)
    os.utime(calm / "Wölke 0.laz")  # touched, not changed
    make_cloud(calm / "Wölke 1.laz", 77, 500_020.0)
    make_cloud(calm / "neu.laz", 78, 500_200.0)
    lines = [
        "plot_id;cloud;bh_m",
        "p0;Wölke 0.laz;1,37",
        "neu;neu.laz;1,37",
        "p1;Wölke 1.laz;1,37",
        "p2;Wölke 2.laz;1,3",
        *(f"p{n};Wölke {n}.laz;1,37" for n in (4, 5)),
    ]
    (calm / "changed.csv").write_bytes("\r\n".join(lines).encode("utf-8-sig"))
    third = campaign(calm / "changed.csv", workspace)
    assert (third.result["n_run"], third.result["n_kept"]) == (3, 3), third.messages
    trees = read_trees(workspace / "trees.gpkg").set_index("tree_id")
    assert set(trees["plot_id"]) == {"p0", "neu", "p1", "p2", "p4", "p5"}
    for plot in ("p0", "p4", "p5"):
        assert trees[trees["plot_id"] == plot]["dbh_cm"].equals(before[before["plot_id"] == plot]["dbh_cm"])
    assert set(trees[trees["plot_id"] == "p2"]["bh_m"]) == {1.3}


def test_killed_coordinators_and_a_second_one(clouds, tmp_path):
    """SIGKILL the whole campaign twice at random moments; a second coordinator meanwhile is refused."""
    manifest, workspace = write_manifest(tmp_path / "m.csv", rows_for(clouds, 3)), tmp_path / "w"
    draw = random.Random(3)
    for turn in range(2):
        running = start(manifest, workspace, "--workers", "2")
        wait_until(lambda: engines(workspace) or running.poll() is not None)  # noqa: B023
        if turn == 0:
            other = Ended(start(manifest, workspace))
            assert other.code == 2 and "is being run by" in other.said("error")[0]
        time.sleep(draw.uniform(0, 2.5))
        running.kill()
        running.communicate()
    ended = Ended(start(manifest, workspace, "--workers", "2"))
    assert ended.code == 0 and ended.result["n_done"] == 3, ended.messages
    assert json.loads((workspace / "campaign.json").read_text())["series"] == 1
    trees = read_trees(workspace / "trees.gpkg")
    assert trees["tree_id"].is_unique and set(trees["plot_id"]) == {"p0", "p1", "p2"}
    wait_until(lambda: nobody_left(workspace), 20)


def test_a_broken_plot_and_one_that_crashes(clouds, tmp_path):
    """The others finish; the broken one says why at once, the crashing one after two more tries."""
    (tmp_path / "broken.laz").write_bytes((clouds / "cloud_0.laz").read_bytes()[:4000])
    rows = [
        *rows_for(clouds, 2),
        {"plot_id": "crash", "cloud": clouds / "cloud_2.laz"},
        {"plot_id": "broken", "cloud": "broken.laz"},
    ]
    manifest, workspace = write_manifest(tmp_path / "m.csv", rows), tmp_path / "w"
    running = start(manifest, workspace, "--workers", "2")
    folder, crashes = workspace / "plots" / "crash", 0
    while running.poll() is None:
        for engine in engines(workspace):
            if str(folder) in words_of(engine):
                engine.send_signal(signal.SIGSEGV)
                crashes += 1
                wait_until(lambda: not engine.is_running() or engine.status() == psutil.STATUS_ZOMBIE)  # noqa: B023
        time.sleep(0.05)
    ended = Ended(running)
    # A result that lacks plots is no success: layer and report are there, the exit code says so.
    assert ended.code == 5 and (ended.result["n_done"], ended.result["n_failed"]) == (2, 2), ended.messages
    assert "2 of 4 plots could not be measured" in ended.said("error")[0] and (workspace / "campaign.html").exists()
    record = json.loads((folder / "plot.json").read_text())
    assert [a["outcome"] for a in record["attempts"]] == ["crash"] * 3 and crashes == 3
    found = table(workspace)
    assert "SIGSEGV" in found["crash"]["remark"] and found["crash"]["attempts"] == "3"
    assert "breaks off" in found["broken"]["remark"] and found["broken"]["attempts"] == "1"
    assert set(read_trees(workspace / "trees.gpkg")["plot_id"]) == {"p0", "p1"}
    # The start ended in order: the next one is a new decision.
    again = Ended(start(manifest, workspace))
    assert again.code == 5
    assert (again.result["n_run"], again.result["n_kept"], again.result["n_failed"]) == (1, 2, 1)


def test_a_damaged_plot_is_measured_again(clouds, tmp_path):
    """Its layer cut off: said, set aside, made again; the others are kept."""
    manifest, workspace = write_manifest(tmp_path / "m.csv", rows_for(clouds, 2)), tmp_path / "w"
    assert Ended(start(manifest, workspace)).code == 0
    layer = workspace / "plots" / "p1" / "trees.gpkg"
    before, whole = read_trees(layer), layer.read_bytes()
    layer.write_bytes(whole[: len(whole) // 2])
    again = Ended(start(manifest, workspace))
    assert again.code == 0 and (again.result["n_run"], again.result["n_kept"]) == (1, 1), again.messages
    assert f"{layer}: is missing or damaged; p1 is measured again." in again.said("warn")
    assert read_trees(layer)["dbh_cm"].equals(before["dbh_cm"]) and (layer.parent / "trees.damaged1.gpkg").exists()


def test_a_photo_plot_runs_under_its_campaigns_lease(tmp_path):
    """The engine works in the folder that the campaign holds: what is wrong is said, not that somebody is there."""
    for n in range(4):
        pixels = np.random.default_rng(n).integers(0, 255, (60, 80, 3), np.uint8)
        (tmp_path / "photos").mkdir(exist_ok=True)
        Image.fromarray(pixels).save(tmp_path / "photos" / f"DJI_{n:04}.JPG")
    manifest = write_manifest(tmp_path / "m.csv", [{"plot_id": "a", "photos": tmp_path / "photos", "crs": "EPSG:6344"}])
    ended = Ended(start(manifest, tmp_path / "w"))
    heard = " ".join(ended.said("warn"))
    assert ended.code == 2 and "none of the 4 photos has a GPS position" in heard and "another run" not in heard, heard


def test_a_full_disk(clouds, tmp_path):
    """A workspace on a disk that fills up: said in words; once there is room, the same command finishes."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=6m", "tmpfs", str(disk)], capture_output=True)
    if mounted.returncode:
        pytest.skip("mounting a small disk is not permitted here")
    try:
        manifest = write_manifest(tmp_path / "m.csv", rows_for(clouds, 2))
        first = Ended(start(manifest, disk / "w", "--predict"))
        assert first.code == 0
        room = shutil.disk_usage(disk).free
        (disk / "ballast").write_bytes(b"x" * (room - 60_000))
        full = Ended(start(manifest, disk / "w"))
        heard = " ".join(full.said("error") + full.said("warn"))
        assert ("free" in heard or "full" in heard or "No space" in heard) and "Traceback" not in full.log, (
            full.messages
        )
        assert not (disk / "w" / "trees.gpkg").exists() or not len(read_trees(disk / "w" / "trees.gpkg"))
        (disk / "ballast").unlink()
        freed = Ended(start(manifest, disk / "w"))
        assert freed.code == 0 and freed.result["n_done"] == 2, freed.messages
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=False)


def test_two_computers_with_a_shared_folder(calm, clouds, tmp_path):
    """The same command with --join on both: one leads, both work, the trees are the same."""
    manifest, workspace = write_manifest(tmp_path / "m.csv", rows_for(clouds, 4)), tmp_path / "w"
    command = (manifest, workspace, "--workers", "1", "--join")
    both = [start(*command, env={**os.environ, "TREEDGS_HOST": name}) for name in ("one", "other")]
    ended = sorted(map(Ended, both), key=lambda run: "output" in run.result)
    assert [run.code for run in ended] == [0, 0], [run.messages for run in ended]
    assert "computer joined" in ended[0].result["status"] and ended[1].result["n_done"] == 4
    assert {row["host"] for row in table(workspace).values()} == {"one", "other"}
    assert differences(workspace / "trees.gpkg", undisturbed(calm, 4)) == []


def test_overlapping_plots_are_reported(clouds, tmp_path, campaign):
    make_cloud(tmp_path / "same.laz", 0, 500_000.0)
    manifest = write_manifest(
        tmp_path / "m.csv", [{"plot_id": "a", "cloud": clouds / "cloud_0.laz"}, {"plot_id": "b", "cloud": "same.laz"}]
    )
    ended = campaign(manifest, tmp_path / "w", "--output", str(tmp_path / "all.csv"))
    assert any("a and b overlap: 3 trees stand in both" in text for text in ended.said("warn")), ended.messages
    with open(tmp_path / "all.csv", encoding="utf-8") as stream:
        assert [row["camp_plot"] for row in csv.DictReader(stream)] == ["a"] * 3 + ["b"] * 3


def test_a_plot_that_needs_too_much_memory_is_not_tried(clouds, tmp_path, campaign):
    (tmp_path / "w").mkdir()
    (tmp_path / "w" / "costs.json").write_text(
        json.dumps(
            {
                "routes": {
                    "cloud": {
                        "seconds": [3, 0],
                        "memory_gb": [0.3, 900.0],
                        "disk_gb": [0.001, 0],
                        "n": 9,
                        "largest": [9],
                        "spread": {"seconds": 1, "memory_gb": 1, "disk_gb": 1},
                    }
                }
            }
        )
    )
    make_cloud(tmp_path / "small.laz", 3, 500_300.0, stems=1)
    manifest = write_manifest(tmp_path / "m.csv", [{"plot_id": "large", "cloud": clouds / "cloud_0.laz"}])
    ended = campaign(manifest, tmp_path / "w", "--memory-gb", "2")
    assert ended.code == 2 and "no plot could be measured" in ended.said("error")[0]
    assert "this computer has 2.0 GB" in table(tmp_path / "w")["large"]["remark"]
    assert not (tmp_path / "w" / "plots" / "large" / "engine.log").exists()


def test_cancelled(clouds, tmp_path):
    """What QGIS sends: everything ends, what was finished is kept."""
    manifest, workspace = write_manifest(tmp_path / "m.csv", rows_for(clouds, 2)), tmp_path / "w"
    running = start(manifest, workspace, "--workers", "2")
    wait_until(lambda: engines(workspace))
    running.terminate()
    ended = Ended(running)
    assert ended.code == 130 and "run again to resume" in ended.said("error")[0], ended.messages
    wait_until(lambda: nobody_left(workspace), 20)
    assert json.loads((workspace / "campaign.json").read_text())["open"] is True


def test_one_table_for_all_plots(clouds, tmp_path, campaign):
    """Centres and field trees of every plot in one table each: a row's edit redoes that plot alone."""
    rows = [
        {"plot_id": f"p{n}", "cloud": clouds / f"cloud_{n}.laz", "plots": "centres.csv", "field": "trees.csv"}
        for n in range(2)
    ]
    manifest = write_manifest(tmp_path / "m.csv", rows)
    centres = ["plot_id;easting;northing;radius_m", *(f"p{n};{500004 + 20 * n},5;3700004,5;9,0" for n in range(2))]
    (tmp_path / "centres.csv").write_text("\n".join(centres))
    tally = ["plot_id,tree_id,azimuth_deg,distance_m,dbh_cm", "p0,1,180,3,25", "p0,2,90,2,22", "p1,1,10,2,30"]
    (tmp_path / "trees.csv").write_text("\n".join(tally))
    first = campaign(manifest, tmp_path / "w")
    assert first.code == 0 and first.result["n_run"] == 2, first.messages
    found = table(tmp_path / "w")
    assert all(row["n_field"] or row["remark"] for row in found.values()), found
    (tmp_path / "trees.csv").write_text("\n".join([*tally, "p1,2,200,3,28"]))
    again = campaign(manifest, tmp_path / "w")
    assert (again.result["n_run"], again.result["n_kept"]) == (1, 1), again.messages
