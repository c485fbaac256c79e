"""The main job on a small simulated plot, through real QGIS: ``make demo``.

Simulates photos and PPK files (kept for the next time), runs ``qgis_process run treedgs:photostodbh`` on them, and
prints each tree of the layer (by its tree_id) beside the truth, which the job itself never sees.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import time
from pathlib import Path

import pandas as pd
from qgis_run import run_algorithm

from treedgs_geo.cli import main as treedgs
from treedgs_geo.inventory.accuracy.scores import score_against_truth
from treedgs_geo.inventory.tree_reading import read_trees

ROOT = Path(__file__).resolve().parents[1]


def main() -> int:
    """Simulate (once), measure through QGIS, print and score."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=ROOT / "demo", help="where plot and results go")
    parser.add_argument("--fresh", action="store_true", help="simulate and measure anew")
    options = parser.parse_args()
    plot, work, layer = options.folder / "plot", options.folder / "work", options.folder / "trees.gpkg"
    if options.fresh:
        shutil.rmtree(options.folder, ignore_errors=True)

    if not (plot / "truth" / "trees.csv").exists():
        print("Simulating a small pine plot: photos, PPK files, truth ...", flush=True)
        shutil.rmtree(plot, ignore_errors=True)
        code = treedgs(["simulate-plot", "--preset", "demo", "--output", str(plot), "--log-format", "plain"])
        if code:
            return code

    print("\nMeasuring it: qgis_process run treedgs:photostodbh ...", flush=True)
    began = time.monotonic()
    code = run_algorithm(
        "treedgs:photostodbh",
        {
            "PHOTOS": plot / "images",
            "GEOTAGS": plot,
            "CRS": "EPSG:6344",
            "PLOTS": plot / "plots.csv",
            "WORKSPACE": work,
            "OUTPUT": layer,
        },
        log=options.folder / "qgis_process.log",
    )
    if code:
        print("The job failed; its messages are above.", file=sys.stderr)
        return code
    seconds = time.monotonic() - began

    accuracy, table = score_against_truth(read_trees(layer), plot / "truth" / "trees.csv")
    print(f"\n{'tree':>4}  {'measured DBH':<26}{'true DBH':>10}{'error':>10}   true stem")
    for row in table.sort_values("layer_id").itertuples():
        tree = "–" if pd.isna(row.layer_id) else f"{row.layer_id:.0f}"
        measured, error = f"{row.qc_flag}{f': {row.qc_reason}' if row.qc_reason else ''}", ""
        if not pd.isna(row.dbh_cm):
            measured, error = f"{row.dbh_cm:.1f} ± {row.dbh_se_cm:.1f} cm, {row.qc_flag}", f"{row.error_cm:+.1f} cm"
        stem = f"{row.tree_id}, in the clear in {row.clear_views} photos"
        print(f"{tree:>4}  {measured:<26}{row.dbh_true_cm:>7.1f} cm{error:>10}   {stem}")
    if accuracy.rmse_cm is None:
        print("\nNo stem got a DBH.")
    else:
        print(
            f"\n{accuracy.n_measured} of {accuracy.n_reference} true stems measured, {accuracy.n_false} false; "
            f"RMSE {accuracy.rmse_cm:.2f} cm, mean error {accuracy.me_cm:+.2f} cm, worst {accuracy.max_abs_cm:.2f} cm"
        )
    stages = json.loads((work / "run.json").read_text(encoding="utf-8"))["stages"]
    print(
        "seconds: "
        + ", ".join(f"{name} {entry['seconds']:.0f}" for name, entry in stages.items())
        + f"; in all {seconds:.0f} s, peak memory {max(entry['peak_memory_mb'] for entry in stages.values())} MB"
    )
    print(f"layer:   {layer}\nreport:  {work / 'report.html'}\nlog:     {options.folder / 'qgis_process.log'}")
    # A demo that measures nothing, or lies, has failed.
    return 0 if accuracy.rmse_cm is not None and accuracy.n_false == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
