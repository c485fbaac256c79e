"""What a flight measures in scanned forests: photos rendered from terrestrial scans, beside the scans' own diameters.

    python -m treedgs_lab.benchmarks.photos.scanned_forests --data DIR --work DIR [--scans NAME ...] [--output FILE]

DIR holds the folders ``lidar_treels``, ``lidar_treeiso`` and ``lidar_itsme``. Four trees of ``lidar_itsme`` that were
scanned and cut out one by one are put on level ground, 6 m apart, with two of ``lidar_treels``. Diameters are compared
with the rings measured in the scan, and with what a tape would read of the patches that were photographed.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from treedgs_geo.inventory.accuracy.scores import score_against_truth
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud, write_cloud
from treedgs_lab.benchmarks.photos.photos_to_dbh import run
from treedgs_lab.benchmarks.processes import run_verb, simulate
from treedgs_lab.benchmarks.records import write_record

#: Of the flight and of the sensor's noise.
SEED = 1
PLOTS = {"treels": "lidar_treels/pine_plot.laz", "treeiso": "lidar_treeiso/LPine1_demo.laz"}
SINGLE = (
    *("lidar_itsme/tree_1_pc.txt", "lidar_itsme/tree_2_pc.txt", "lidar_itsme/buttressed_tree_1_pc.txt"),
    *("lidar_itsme/buttressed_tree_2_pc.txt", "lidar_treels/pine.laz", "lidar_treels/spruce.laz"),
)
APART_M, GROUND_STEP_M = 6.0, 0.05
FLIGHT = ["--preset", "demo", "--camera", "samples=3", "--lidar-density-m2", "0", "--seed", str(SEED)]


def gathered(data: Path, target: Path) -> Path:
    """Write one cloud of the single trees, in two rows on level ground."""
    rng, parts = np.random.default_rng(SEED), []
    for k, name in enumerate(SINGLE):
        xyz = read_cloud(data / name, crs="local", attributes=(), need_crs=False).xyz
        foot = xyz[xyz[:, 2] < xyz[:, 2].min() + 0.5]
        place = np.array([*np.median(foot[:, :2], axis=0), xyz[:, 2].min()])
        parts.append(xyz - place + [APART_M * (k // 2), APART_M * (k % 2), 0.0])
    axes = [np.arange(-3.0, APART_M * n + 3.0, GROUND_STEP_M) for n in (2, 1)]
    x, y = (part.ravel() for part in np.meshgrid(*axes))
    parts.append(np.column_stack([x, y, rng.normal(0, 0.01, len(x))]))
    write_cloud(target, PointCloud(np.concatenate(parts)))
    return target


def run_scan(name: str, cloud: Path, work: Path) -> dict:
    """Simulate, measure and compare one scan."""
    plot, trees = work / name, work / f"{name}-scan.csv"
    simulate(plot, ["--from-cloud", cloud, *FLIGHT])
    run_verb("pointcloud-to-dbh", "--input", cloud, "--crs", "local", "--output", trees, "--sheets", "none",
             "--overwrite", "--log-format", "quiet")  # fmt: skip
    switches = ("--heights", "none", "--sheets", "none", "--orthophoto", "false")
    found = run(plot, "balanced", work / f"{name}-photos", *switches)
    scan, truth = pd.read_csv(trees), pd.read_csv(plot / "truth" / "trees.csv")
    truth = truth[truth["in_plot"].astype(str) == "True"].set_index("tree_id")
    found |= {"scan": name, "found_in_scan": len(scan), "with_dbh_in_scan": int(scan["dbh_cm"].notna().sum())}
    found["rendered"] = _errors(truth["rendered_cm"] - truth["dbh_cm"])
    if found["exit_code"] == 0:
        table = score_against_truth(read_trees(work / f"{name}-photos" / "trees.gpkg"), plot / "truth" / "trees.csv")[1]
        table = table.set_index("tree_id").join(truth[["rendered_cm", "dbh_se_cm"]].add_suffix("_scan"))
        table["of_rendered_cm"] = table["dbh_cm"] - table["rendered_cm_scan"]
        found["against_rendered"] = _errors(table["of_rendered_cm"].dropna())
        columns = ["dbh_true_cm", "dbh_se_cm_scan", "rendered_cm_scan", "dbh_cm", "dbh_se_cm", "clear_views", "qc_flag"]
        rows = table[[*columns, "qc_reason"]].round(2).reset_index()
        found["trees"] = rows.astype(object).where(rows.notna(), None).to_dict("records")
    return found


def _errors(error: pd.Series) -> dict[str, float | int | None]:
    """Number, root mean square and mean of differences, cm."""
    if error.empty:
        return {"n": 0, "rmse_cm": None, "me_cm": None}
    return {"n": len(error), "rmse_cm": round(float((error**2).mean() ** 0.5), 3), "me_cm": round(error.mean(), 3)}


def main() -> None:
    """Run, print and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--work", type=Path, required=True, help="folder for plots and workspaces")
    parser.add_argument("--scans", nargs="+", default=[*PLOTS, "single"], choices=[*PLOTS, "single"])
    parser.add_argument("--output", type=Path, help="JSON file for the figures")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    rows = []
    for name in options.scans:
        single = name == "single"
        cloud = gathered(options.data, options.work / "single.laz") if single else options.data / PLOTS[name]
        rows.append(run_scan(name, cloud.resolve(), options.work))
        print(name, rows[-1]["rendered"], rows[-1].get("all in-plot stems"), rows[-1].get("against_rendered"))
        write_record(options.output, {"runs": rows}, seeds=[SEED])


if __name__ == "__main__":
    main()
