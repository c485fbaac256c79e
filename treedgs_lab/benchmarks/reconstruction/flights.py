"""Flights with a real camera's faults, through the whole chain with nothing true: cameras, scale and diameters.

    python -m treedgs_lab.benchmarks.reconstruction.flights --work WORK --seeds 61 62 [--cases readout_20 sun …]
        [--output FILE]

Each case is a simulated plot (:data:`CASES`: options of ``simulate-plot``). ``photos-to-dbh`` gets its photos, geotags,
``plots.csv`` and, where there are any, control points; ``truth/`` is read for scoring alone. What counts: never a
wrong scale that is neither refused nor covered by the stated one (``wrong_scale``). A few stems' mean error says little
of a block: ``dbh_minus_true_cameras`` compares each with the same fit in the true cameras.
"""

from __future__ import annotations

import argparse
import json
import shlex
from pathlib import Path

from treedgs_geo.core import workspace as names
from treedgs_geo.core.files import read_json
from treedgs_geo.inventory.accuracy.scores import score_against_truth
from treedgs_geo.reconstruction.model import REPORT
from treedgs_lab.benchmarking.blocks import wrong_scale
from treedgs_lab.benchmarking.plot import TruePlot
from treedgs_lab.benchmarking.whole_chain import ChainCrash, block_figures, placed_trees, run_photo_chain
from treedgs_lab.benchmarks.reconstruction.accuracy import of_stems
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.verbs import CRS, run_verb

_FLYING = "--flight-speed-m-s 4 --gimbal-rate-deg-s 0.4"
_WIND = "--wind-smooth true --wind-sway-cm 10 --wind-flutter-cm 1.5"
_LENS = "--k1 -0.11 --k2 0.12 --p1 0.0009 --p2 -0.0007 --k3 -0.3 --focal-drift 0.0006"
_GRID = "--flight grid --plots 4 --image-width 2560 --image-height 1920"
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
    folder = work / f"{name}_{preset}_{seed}"
    if not (folder / "truth" / "config.json").exists():
        options = ["--preset", preset, "--seed", seed, "--lidar-density-m2", 0, *shlex.split(CASES[name])]
        run_verb("simulate-plot", "--output", folder, *options, "--log-format", "quiet")
    plot, workspace = TruePlot.load(folder), folder / "workspace"
    found: dict = {"case": name, "seed": seed}
    try:
        refused = run_photo_chain(folder, CRS, workspace)
    except ChainCrash as problem:
        return found | {"crashed": str(problem)}
    if refused:
        return found | {"refused": refused}
    report = read_json(workspace / names.SFM / REPORT)
    more = ("focal_sd_px", "readout_s", "readout_sd_s", "lens_free", "seconds")
    figures = block_figures(plot, workspace / names.SFM) | {name: report[name] for name in more}
    figures["wrong_scale"] = wrong_scale(figures["scale_error"], report["scale_sd"])
    return found | figures | _of_trees(plot, workspace) | of_stems(folder, workspace)


def _of_trees(plot: TruePlot, workspace: Path) -> dict:
    """Error of the diameters, of all and of the ``ok`` ones."""
    trees, outcome = placed_trees(plot, workspace), {}
    for label, chosen in (("measured", trees), ("ok", trees[trees["qc_flag"] == "ok"])):
        accuracy, _ = score_against_truth(chosen, plot.folder / "truth" / "trees.csv")
        kept = accuracy.as_dict()
        wanted = ("n_reference", "n_measured", "rmse_cm", "me_cm", "max_abs_cm", "n_false", "coverage_90")
        outcome[label] = {key: round(kept[key], 3) if isinstance(kept[key], float) else kept[key] for key in wanted}
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
