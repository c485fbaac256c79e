"""Same input, same seed, same trees? The whole chain twice on all cores and once on one core, tree by tree.

    python benchmarks/determinism.py PLOT [PLOT ...] [--verbs photos-to-dbh pointcloud-to-dbh] [--output FILE]

A plot is a folder as ``simulate-plot`` writes it. Every run starts from nothing: own process, own workspace.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd

from treedgs_geo.core import workspace as names
from treedgs_geo.reconstruction.model import load_views

#: Goals: bitwise on one machine, this much across core counts.
ACROSS_CORES_MM = 0.1
#: Columns that hold when something was made, not what was measured.
MADE = ("run_id", "made", "created", "date")


def run(verb: str, preset: str, plot: Path, work: Path, cores: set[int]) -> Path:
    """One run on these cores; its tree layer."""
    output = work / "trees.gpkg"
    if output.exists():
        return output
    work.mkdir(parents=True)
    if verb == "photos-to-dbh":
        inputs = [
            "--photos",
            plot / "images",
            "--geotags",
            plot,
            "--crs",
            "EPSG:6344",
            "--plots",
            plot / "plots.csv",
            "--workspace",
            work / "ws",
            "--preset",
            preset,
        ]
    else:
        inputs = ["--input", *sorted((plot / "lidar").glob("*.la[sz]"))]
    words = [sys.executable, "-m", "treedgs_geo", verb, *inputs, "--output", output, "--log-format", "quiet"]
    subprocess.run(
        [str(word) for word in words],
        check=True,
        stdout=subprocess.DEVNULL,
        preexec_fn=lambda: os.sched_setaffinity(0, cores),
    )
    return output


def compare(one: Path, other: Path) -> dict:
    """Of two tree layers: whether every value is the same to the bit, and how far diameters and places are apart."""
    a, b = (gpd.read_file(path, layer="trees").drop(columns=list(MADE), errors="ignore") for path in (one, other))
    found = {
        "trees": [len(a), len(b)],
        "same_to_the_bit": False,
        "flags_differ": None,
        "most_dbh_mm": None,
        "most_place_mm": None,
        "most_error_mm": None,
    }
    if len(a) != len(b) or list(a.columns) != list(b.columns):
        return found
    a, b = (layer.sort_values("tree_id").reset_index(drop=True) for layer in (a, b))
    values = a.drop(columns="geometry").equals(b.drop(columns="geometry"))
    found["same_to_the_bit"] = bool(values and (a.geometry.to_wkb() == b.geometry.to_wkb()).all())
    found["flags_differ"] = int((a["qc_flag"] != b["qc_flag"]).sum())
    for name, column in (("most_dbh_mm", "dbh_cm"), ("most_error_mm", "dbh_se_cm")):
        apart = (pd.to_numeric(a[column]) - pd.to_numeric(b[column])).abs()
        found[name] = None if apart.isna().all() else float(10 * apart.max())
    found["most_place_mm"] = float(1000 * a.geometry.distance(b.geometry, align=False).max()) if len(a) else 0.0
    return found


def cameras_apart(photos: Path, one: Path, other: Path) -> dict:
    """Of two workspaces: how far the same photos' projection centres and axes are apart."""
    (_, first), (_, second) = (load_views(work / names.SFM, photos) for work in (one, other))
    there = {view.name: view for view in second}
    pairs = [(view, there[view.name]) for view in first if view.name in there]
    apart = [np.linalg.norm(a.centre - b.centre) for a, b in pairs]
    turned = [np.linalg.norm(a.rotation - b.rotation) / np.sqrt(2) for a, b in pairs]
    return {
        "photos": [len(first), len(second), len(pairs)],
        "most_apart_mm": float(1000 * max(apart)),
        "most_turned_deg": float(np.degrees(max(turned))),
    }


def judge(verb: str, preset: str, plot: Path, work: Path) -> dict:
    """Twice on all cores, once on one."""
    every = os.sched_getaffinity(0)
    first, second = (run(verb, preset, plot, work / name, every) for name in ("first", "second"))
    single = run(verb, preset, plot, work / "single", {min(every)})
    record = {"verb": verb, "preset": preset, "plot": plot.name, "cores": len(every)}
    for name, other in (("again", second), ("one_core", single)):
        record[name] = compare(first, other)
        if verb == "photos-to-dbh":
            record[name]["cameras"] = cameras_apart(plot / "images", first.parent / "ws", other.parent / "ws")
    print(json.dumps(record, indent=2), flush=True)
    return record


def main() -> int:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", nargs="+", type=Path)
    parser.add_argument("--verbs", nargs="+", default=["photos-to-dbh", "pointcloud-to-dbh"])
    parser.add_argument("--presets", nargs="+", default=["balanced"], help="of photos-to-dbh")
    parser.add_argument("--output", type=Path, default=Path("determinism.json"))
    parser.add_argument("--keep", type=Path, help="work here and leave it; what is there already is not run again")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        place = options.keep or Path(scratch)
        runs = [
            judge(verb, preset, plot, place / f"{plot.name}-{verb}-{preset}")
            for plot in options.plots
            for verb in options.verbs
            for preset in (options.presets if verb == "photos-to-dbh" else [""])
        ]
    good = all(
        record["again"]["same_to_the_bit"]
        and (record["one_core"]["most_dbh_mm"] or 0) <= ACROSS_CORES_MM
        and not record["one_core"]["flags_differ"]
        for record in runs
    )
    options.output.write_text(
        json.dumps(
            {"python": platform.python_version(), "across_cores_mm": ACROSS_CORES_MM, "goal_met": good, "runs": runs},
            indent=2,
        )
        + "\n",
        encoding="utf-8",
    )
    print("Goal met." if good else "Goal missed.")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
