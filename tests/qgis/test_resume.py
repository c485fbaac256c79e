"""A whole chain that is stopped by the user, killed by the system, and then ends: no orphan, nothing done twice."""

from __future__ import annotations

import json
import signal
import time
from pathlib import Path

import psutil
import pytest
from child_processes import words_of
from qgis_driver import PATIENCE_S, outlived
from qgis_helpers import wait_for


@pytest.fixture(scope="module")
def chain(simulated_plot, tmp_path_factory):
    """The arguments of one job, in a folder whose name is hard; the second test goes on where the first ended."""
    folder = tmp_path_factory.mktemp("relevé d'été (2)")
    values = {
        "PHOTOS": simulated_plot / "images",
        "GEOTAGS": simulated_plot,
        "CRS": "EPSG:6344",
        "PLOTS": simulated_plot / "plots.csv",
        "WORKSPACE": folder / "work",
        "OUTPUT": folder / "trees.gpkg",
        "PRESET": "fast",
    }
    return folder, [f"{name}={value}" for name, value in values.items()]


def stages(record: Path) -> dict:
    """``run.json`` while another process writes it (atomically)."""
    return json.loads(record.read_text(encoding="utf-8"))["stages"] if record.exists() else {}


def until_stage(running, record: Path, name: str) -> None:
    """Wait until a stage has begun."""
    until = time.monotonic() + PATIENCE_S
    while name not in stages(record):
        assert running.poll() is None, running.communicate()[0]
        assert time.monotonic() < until, f"{name} did not begin"
        time.sleep(0.05)


def test_a_chain_resumes_after_ctrl_c_and_after_a_kill(qgis, chain, simulated_plot):
    """The real engine with its own child processes: stopped in the reconstruction, killed while measuring, ended."""
    from treedgs_geo.inventory.accuracy.scores import score_against_truth
    from treedgs_geo.inventory.tree_reading import read_trees

    folder, arguments = chain
    record = folder / "work" / "run.json"
    running = qgis.start("run", "treedgs:photostodbh", "--", *arguments)
    wait_for(record)
    until_stage(running, record, "reconstruct")
    children = psutil.Process(running.pid).children(recursive=True)
    assert children
    running.send_signal(signal.SIGINT)
    output, _ = running.communicate(timeout=PATIENCE_S)
    assert not outlived([child.pid for child in children]), output
    assert running.returncode == 1 and "run again to resume" in output, output
    assert not (folder / "trees.gpkg").exists() and stages(record)["geotag"]["status"] == "done"
    heard = qgis("run", "treedgs:photostodbh", "--", *arguments, "DRY_RUN=true")
    assert heard.returncode == 0 and "Kept from an earlier run" in heard.stdout and "geotag" in heard.stdout, (
        heard.stdout
    )
    located = stages(record)["geotag"]

    running = qgis.start("run", "treedgs:photostodbh", "--", *arguments)
    until_stage(running, record, "measure")
    (engine,) = [child for child in psutil.Process(running.pid).children() if "--job" in words_of(child)]
    family = [engine, *engine.children(recursive=True)]
    engine.send_signal(signal.SIGKILL)
    output, _ = running.communicate(timeout=PATIENCE_S)
    assert not outlived([child.pid for child in family]), output
    assert running.returncode == 1 and "memory ran out" in output and "resume" in output, output
    assert not (folder / "trees.gpkg").exists()
    reconstructed = stages(record)["reconstruct"]
    assert reconstructed["status"] == "done" and stages(record)["geotag"] == located

    done = qgis("run", "treedgs:photostodbh", "--", *arguments)
    assert done.returncode == 0, done.stdout
    found = stages(record)
    assert found["geotag"] == located and found["reconstruct"] == reconstructed, "a finished stage was done again"
    assert all(stage["status"] == "done" for stage in found.values()), found
    accuracy, _ = score_against_truth(read_trees(folder / "trees.gpkg"), simulated_plot / "truth" / "trees.csv")
    assert accuracy.n_measured >= 1 and accuracy.n_false == 0 and accuracy.max_abs_cm < 5
    assert not [path.name for path in folder.iterdir() if path.name.startswith(".")], "something half-written is left"


def test_the_photo_models_run(qgis, chain, simulated_plot):
    """Photos to stand table, and photos to accuracy: the measured trees are the workspace's, kept."""
    folder, arguments = chain
    shared = [item for item in arguments if not item.startswith("OUTPUT=")]
    table = [f"measure:Trees={folder / 'a.gpkg'}", f"table:Tables={folder / 'stand'}", "SPECIES=PITA"]
    done = qgis("run", "treedgs:photostostandtable", "--", *shared, *table)
    assert done.returncode == 0, done.stdout
    figures = json.loads((folder / "stand" / "summary.json").read_text(encoding="utf-8"))
    assert (folder / "stand" / "report.pdf").stat().st_size > 5000 and figures
    pairs = [
        f"measure:Trees={folder / 'b.gpkg'}",
        f"pair:Pairs={folder / 'pairs.gpkg'}",
        f"score:Accuracy={folder / 'acc'}",
    ]
    done = qgis("run", "treedgs:photostoaccuracy", "--", *shared, *pairs, f"FIELD={simulated_plot / 'field_trees.csv'}")
    assert done.returncode == 0, done.stdout
    metrics = json.loads((folder / "acc" / "metrics.json").read_text(encoding="utf-8"))
    assert metrics["n_reference"] >= 3 and metrics["n_false"] == 0 and (metrics["rmse_cm"] or 0) < 5
