"""Flights with a real camera's faults, through the whole chain with nothing true: cameras, scale and diameters.

    python -m benchmarks.reconstruction.flights --work WORK --seeds 61 62 [--cases readout_20 sun …] [--output FILE]

Each case is a simulated plot (:data:`CASES`: options of ``simulate-plot``). ``photos-to-dbh`` gets its photos, geotags,
``plots.csv`` and, where there are any, control points; ``truth/`` is read for scoring alone. What counts: never a
wrong scale that is neither refused nor covered by the stated one.
"""

from __future__ import annotations

import argparse
import json
import shlex
import subprocess
from pathlib import Path

import numpy as np

from benchmarks.reconstruction.accuracy import camera_errors, of_stems
from benchmarks.records import write_record
from benchmarks.verbs import CRS, photo_inputs, run_verb, words
from treedgs_geo.core.files import read_json
from treedgs_geo.evaluation.accuracy import score_against_truth
from treedgs_geo.inventory.tree_reading import read_trees

_FLYING = "--flight-speed-m-s 4 --gimbal-rate-deg-s 0.4"
_WIND = "--wind-smooth true --wind-sway-cm 10 --wind-flutter-cm 1.5"
_LENS = "--k1 -0.11 --k2 0.12 --p1 0.0009 --p2 -0.0007 --k3 -0.3 --focal-drift 0.0006"
_GRID = "--flight grid --plots 4"
#: Options of ``simulate-plot`` by case.
CASES = {
    "readout_0": _FLYING,
    "readout_10": f"{_FLYING} --readout-ms 10",
    "readout_20": f"{_FLYING} --readout-ms 20",
    "readout_30": f"{_FLYING} --readout-ms 30",
    "sun": "--sun-shift-min 20",
    "wind": _WIND,
    "lens": _LENS,
    "all": f"{_FLYING} --readout-ms 20 --exposure-ms 1.5 --sun-shift-min 20 --sensor drone {_WIND} {_LENS}",
    "floats_0": "--float-epochs 0",
    "floats_12": "--float-epochs 12",
    "consumer": "--gnss consumer",
    "consumer_control_3": "--gnss consumer --control-points 3",
    "consumer_control_5": "--gnss consumer --control-points 5",
    "grid_70": f"{_GRID} --height-m 70",
    "grid_120": f"{_GRID} --height-m 120",
}


def run_case(name: str, seed: int, preset: str, work: Path) -> dict:
    """Simulate a case unless it is there, run the chain, and score it."""
    plot = work / f"{name}_{preset}_{seed}"
    if not (plot / "truth" / "config.json").exists():
        options = ["--preset", preset, "--seed", seed, "--lidar-density-m2", 0, *shlex.split(CASES[name])]
        run_verb("simulate-plot", "--output", plot, *options, "--log-format", "quiet")
    workspace = plot / "workspace"
    trees = workspace / "trees.gpkg"
    control = plot / "gcp_list.txt"
    inputs = photo_inputs(plot)
    if not list(plot.glob("*.MRK")) and not list(plot.glob("*.pos")):
        inputs = ["--photos", plot / "images", "--crs", CRS, "--plots", plot / "plots.csv"]
    if control.exists():
        inputs += ["--gcp", control]
    done = subprocess.run(
        words("photos-to-dbh", *inputs, "--workspace", workspace, "--output", trees, "--log-format", "plain"),
        capture_output=True,
        text=True,
    )
    found: dict = {"case": name, "seed": seed, "exit_code": done.returncode}
    if done.returncode:
        return found | {"refused": (done.stderr or done.stdout).strip().splitlines()[-1][:300]}
    report = read_json(workspace / "sfm" / "report.json")
    errors = camera_errors(plot, workspace)
    found |= errors | _of_report(report) | _of_trees(plot, trees, np.array(errors["common_shift_cm"]) / 100)
    return found | of_stems(plot, workspace)


def _of_report(report: dict) -> dict:
    names = ("photos", "registered", "focal_sd_px", "readout_s", "readout_sd_s", "scale_sd", "lens_free", "seconds")
    return {name: report[name] for name in names} | {"warnings": report["warnings"]}


def _of_trees(plot: Path, layer: Path, shift_m: np.ndarray) -> dict:
    """Error of the diameters, all and ``ok`` ones, against the scale that is stated.

    shift_m: E, N, U by which the whole block is off (metres, with consumer GNSS): it is no error of a diameter, but
    would pair trees with their neighbours.
    """
    trees, truth = read_trees(layer), plot / "truth" / "trees.csv"
    trees = trees.set_geometry(trees.geometry.translate(-shift_m[0], -shift_m[1]))
    trees["x"], trees["y"] = trees.geometry.x, trees.geometry.y
    outcome = {}
    for label, chosen in (("measured", trees), ("ok", trees[trees["qc_flag"] == "ok"])):
        accuracy, table = score_against_truth(chosen, truth, 3 if label == "measured" else 0)
        kept = accuracy.as_dict()
        names = ("n_reference", "n_measured", "rmse_cm", "me_cm", "max_abs_cm", "n_false", "coverage_90")
        outcome[label] = {key: round(kept[key], 3) if isinstance(kept[key], float) else kept[key] for key in names}
        if label == "ok" and len(table):
            error = table["error_cm"].to_numpy(float) / table["dbh_true_cm"].to_numpy(float)
            error = error[np.isfinite(error)]
            outcome[label]["median_relative_error"] = round(float(np.median(error)), 5) if len(error) else None
    return outcome


def main() -> int:
    """Run the cases, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--seeds", type=int, nargs="+", default=[61])
    parser.add_argument("--preset", default="demo")
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    rows = []
    for seed in args.seeds:
        for name in args.cases:
            rows.append(run_case(name, seed, args.preset, args.work))
            print(json.dumps(rows[-1]), flush=True)
            write_record(args.output, {"cases": CASES, "preset": args.preset, "rows": rows}, args.seeds)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
