"""The whole chain on plots with known truth: success, error, interval coverage, false trees, seconds, memory.

    python -m treedgs_lab.benchmarks.photos.photos_to_dbh PLOT [PLOT ...] [--preset balanced] [--output FILE]

A plot is a folder as ``simulate-plot`` writes it. The chain gets photos, geotags and plots.csv, never ``truth/``; it
runs in a process of its own, so that seconds and peak memory are its own.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from treedgs_geo.inventory.accuracy.scores import score_against_truth
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_lab.benchmarks.processes import photo_inputs, words
from treedgs_lab.benchmarks.records import write_record

#: Of every random choice: the verb's own.
SEED = 0
#: Stages after which every diameter is known; heights and evidence sheets follow.
DIAMETERS = ("geotag", "reconstruct", "ground", "measure")


def run(plot: Path, preset: str, work: Path, *more: str) -> dict:
    """One chain run. more: options of ``photos-to-dbh``."""
    output = work / "trees.gpkg"
    chosen = ["--preset", preset, "--workspace", work, "--output", output, "--log-format", "plain"]
    code = subprocess.run(words("photos-to-dbh", *photo_inputs(plot), *chosen, *more)).returncode
    if code:
        return {"plot": plot.name, "exit_code": code}
    stages = json.loads((work / "run.json").read_text())["stages"]
    seconds = {name: stage["seconds"] for name, stage in stages.items()}
    first = sum(seconds.get(name, 0.0) for name in DIAMETERS)
    outcome = {
        "plot": plot.name,
        "preset": preset,
        "exit_code": 0,
        "seconds": seconds,
        "diameters_s": round(first, 1),
        "extras_s": round(sum(seconds.values()) - first, 1),
        "peak_memory_mb": max(stage["peak_memory_mb"] for stage in stages.values()),
    }
    trees = read_trees(output)
    for label, least in (("all in-plot stems", 0), ("3 or more clear views", 3)):
        accuracy, table = score_against_truth(trees, plot / "truth" / "trees.csv", least)
        outcome[label] = asdict(accuracy)
    for flag in ("ok", "check"):
        accuracy, _ = score_against_truth(trees[trees["qc_flag"] == flag], plot / "truth" / "trees.csv")
        outcome[f"qc_flag {flag}"] = asdict(accuracy)
    table = score_against_truth(trees, plot / "truth" / "trees.csv")[1]
    print(f"\n{plot.name}\n{table.round(2).to_string(index=False)}")
    return outcome


def main() -> int:
    """Run, print and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", nargs="+", type=Path)
    parser.add_argument("--preset", default="balanced")
    parser.add_argument("--work", type=Path, help="folder for the workspaces (default: a temporary one)")
    parser.add_argument("--output", type=Path, help="JSON file for the figures")
    options = parser.parse_args()
    base = options.work or Path(tempfile.mkdtemp(prefix="treedgs-benchmark-"))
    rows = []
    try:
        for plot in options.plots:
            rows.append(run(plot.resolve(), options.preset, base / f"{plot.resolve().name}-{options.preset}"))
    finally:
        if options.work is None:
            shutil.rmtree(base, ignore_errors=True)
    shown = ("n_reference", "n_measured", "n_false", "rmse_cm", "me_cm", "max_abs_cm", "coverage_90")
    print(
        pd.DataFrame(
            [
                {name: row.get(name) for name in ("plot", "exit_code", "diameters_s", "peak_memory_mb")}
                | {name: row.get("3 or more clear views", {}).get(name) for name in shown}
                for row in rows
            ]
        ).to_string(index=False, float_format="%.2f")
    )
    write_record(options.output, {"runs": rows}, seeds=[SEED])
    return 0 if all(row["exit_code"] == 0 for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
