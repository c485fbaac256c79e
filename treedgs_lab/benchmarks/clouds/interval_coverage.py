"""Are the 90 % intervals of the point-cloud route right? Simulated drone LiDAR with known diameters.

    python -m treedgs_lab.benchmarks.clouds.interval_coverage --scratch DIR \
        --rendered ../shared/data/plot_a ../shared/data/plot_e --output docs/results/interval_coverage.json

Plots with an even seed set the constants of the error (``stems/cloud/estimate/stem.py``), those with an odd seed and
the rendered ones report. In-plot stems with a DBH count. Plots that are in DIR already are kept.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo.core.progress import make_reporter
from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.stems.cloud.estimate.cloud import measure_cloud
from treedgs_geo.terrain.ground import dtm_from_cloud
from treedgs_lab.benchmarks.plot import DENSITIES, FEW_PHOTOS, TruePlot
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.simulate.settings import SimulateSettings
from treedgs_lab.simulate.simulate import simulate_plot

MATCH_M = 0.3
SEEDS = range(1000, 1039)


def simulated(folder: Path, **settings: Any) -> Path:
    """The plot of ``simulate-plot`` in a folder, made where it is missing; its cloud is used, not its photos."""
    if not (folder / "truth" / "config.json").exists():
        simulate_plot(SimulateSettings(output=folder, **(FEW_PHOTOS | settings)), make_reporter("quiet"))
    return folder


def measure(plot: Path) -> tuple[list[dict], int]:
    """One row a matched in-plot stem with a DBH, and how many in-plot stems there are."""
    cloud = read_cloud(next((plot / "lidar").glob("*.laz")))
    trees, _ = measure_cloud(cloud, dtm_from_cloud(cloud.xyz, crs=cloud.horizontal_crs))
    truth = TruePlot.load(plot).trees.to_dict("records")
    places = np.array([[float(row["E_bh"]), float(row["N_bh"])] for row in truth])
    rows = []
    for tree in trees:
        gap = np.hypot(*(places - (tree.x, tree.y)).T)
        true = truth[int(gap.argmin())]
        if tree.dbh_cm is not None and gap.min() < MATCH_M and true["in_plot"]:
            rows.append(
                {
                    "plot": plot.name,
                    "tree": true["tree_id"],
                    "flag": tree.qc_flag,
                    "error_cm": tree.dbh_cm - float(true["dbh_cm"]),
                    "se_cm": tree.dbh_se_cm,
                    "inside": (tree.dbh_lo_cm or 0) <= float(true["dbh_cm"]) <= (tree.dbh_hi_cm or 0),
                }
            )
    return rows, sum(row["in_plot"] for row in truth)


def figures(rows: list[dict], stems: int) -> dict:
    """Coverage, errors and the share of ``ok`` trees that are grossly off."""
    e, se = np.array([row["error_cm"] for row in rows]), np.array([row["se_cm"] for row in rows])
    ok = np.array([row["flag"] == "ok" for row in rows])
    return {
        "stems": stems,
        "measured": len(rows),
        "in_90pct_interval": round(float(np.mean([row["inside"] for row in rows])), 3),
        "rms_of_error_over_se": round(float(np.sqrt(np.mean((e / se) ** 2))), 2),
        "median_se_cm": round(float(np.median(se)), 2),
        "rmse_cm": round(float(np.sqrt(np.mean(e**2))), 2),
        "me_cm": round(float(e.mean()), 2),
        "worst_cm": round(float(np.abs(e).max()), 2),
        "ok": int(ok.sum()),
        "ok_off_by_5_cm": int((np.abs(e[ok]) > 5).sum()),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scratch", type=Path, required=True, help="where the plots are kept")
    parser.add_argument("--rendered", nargs="*", type=Path, default=[])
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    groups: dict[str, list] = {"calibration (even seeds)": [], "report (odd seeds)": []}
    for seed in SEEDS:
        density = DENSITIES[seed % len(DENSITIES)]
        plot = simulated(args.scratch / f"cloud_{seed}", preset="test", seed=seed, lidar_density_m2=density)
        groups["report (odd seeds)" if seed % 2 else "calibration (even seeds)"].append(measure(plot))
    for plot in args.rendered:
        groups[plot.name] = [measure(plot)]
    record: dict = {"plots": [f"cloud_{seed}" for seed in SEEDS] + [plot.name for plot in args.rendered], "groups": {}}
    for name, parts in groups.items():
        record["groups"][name] = figures([row for rows, _ in parts for row in rows], sum(n for _, n in parts))
        print(name, json.dumps(record["groups"][name]))
    write_record(args.output, record, seeds=list(SEEDS))


if __name__ == "__main__":
    main()
