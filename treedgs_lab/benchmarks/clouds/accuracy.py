"""DBH from LiDAR clouds against truth, and terrestrial clouds against reference circles.

    python -m treedgs_lab.benchmarks.clouds.accuracy --data ../shared/data --output build/pointcloud_accuracy.json

Rendered plots (``lidar/*.laz`` with ``truth/``): success and errors over the in-plot stems, interval coverage and false
trees, for the default (unweighted, weighted by intensity as it is and brought to one range), the published circle (the
same three) and the cylinder (published, taper-corrected). Terrestrial clouds: agreement with ``derived_circles*.csv``
(our own circles in a thin slab: a cross-check, not truth).
"""

from __future__ import annotations

import argparse
import csv
import json
import time
from pathlib import Path

import numpy as np

from treedgs_geo.core.workspace import peak_memory_mb
from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.stems.cloud.estimate.cloud import MeasureOptions, measure_stems
from treedgs_geo.stems.cloud.propose.segment import find_stems, label_points
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.terrain.ground import dtm_from_cloud, flat_ground
from treedgs_lab.benchmarks.clouds.runners import MATCH_M, REAL, circles_of
from treedgs_lab.benchmarks.records import write_record

METHODS = {
    "default": MeasureOptions(),
    "default, intensity": MeasureOptions(weights="intensity"),
    "default, range intensity": MeasureOptions(weights="range_intensity"),
    "circle paper, unweighted": MeasureOptions(method="paper"),
    "circle paper, intensity": MeasureOptions(method="paper", weights="intensity"),
    "circle paper, range int.": MeasureOptions(method="paper", weights="range_intensity"),
    "cylinder paper": MeasureOptions(method="paper", fit="cylinder"),
    "cylinder, taper-corrected": MeasureOptions(fit="cylinder"),
}


def truth_of(plot: Path) -> tuple[list[dict], np.ndarray]:
    """Truth stems (dicts with place, dbh_cm, in_plot, name) and (S, 3) saplings (x, y, dbh_cm)."""
    with open(plot / "truth" / "trees.csv", encoding="utf-8") as stream:
        rows = [
            {
                "place": (float(row["E_bh"]), float(row["N_bh"])),
                "dbh_cm": float(row["dbh_cm"]),
                "in_plot": row["in_plot"] == "True",
                "name": f"{row['tree_id']} {row['kind']}",
            }
            for row in csv.DictReader(stream)
        ]
    record = json.loads((plot / "truth" / "stems.json").read_text(encoding="utf-8"))
    saplings = np.array(record.get("saplings_xy_dbhcm") or np.empty((0, 3)), float).reshape(-1, 3)
    return rows, saplings + [*record["origin"][:2], 0.0]


def score(trees: list[Tree], rows: list[dict], saplings: np.ndarray) -> dict:
    """Success, errors, coverage and false trees of one method on one plot."""
    measured = [tree for tree in trees if tree.dbh_cm is not None]
    places = np.array([[tree.x, tree.y] for tree in measured]).reshape(-1, 2)
    errors, inside, used, worst = [], [], set(), ("", 0.0)
    wanted = [row for row in rows if row["in_plot"]]
    for row in rows:
        gap = np.hypot(*(places - row["place"]).T) if len(places) else np.array([np.inf])
        if gap.min() > MATCH_M:
            continue
        best = int(gap.argmin())
        used.add(best)
        if row["in_plot"]:
            tree = measured[best]
            errors.append(tree.dbh_cm - row["dbh_cm"])
            if tree.dbh_lo_cm is not None:
                inside.append(tree.dbh_lo_cm <= row["dbh_cm"] <= tree.dbh_hi_cm)
            worst = max(worst, (row["name"], abs(errors[-1])), key=lambda pair: pair[1])
    centre = np.mean([row["place"] for row in wanted], axis=0)
    false, on_saplings = [], 0
    for number, tree in enumerate(measured):
        if number in used or np.hypot(*(places[number] - centre)) > 10.5:
            continue
        if len(saplings) and np.hypot(*(saplings[:, :2] - places[number]).T).min() < MATCH_M:
            on_saplings += 1
        else:
            false.append(tree.tree_id)
    e = np.array(errors)
    return {
        "n": len(wanted),
        "success_pct": round(100 * len(e) / len(wanted), 1),
        "rmse_cm": round(float(np.sqrt(np.mean(e**2))), 2),
        "me_cm": round(float(e.mean()), 2),
        "mae_cm": round(float(np.abs(e).mean()), 2),
        "worst": f"{worst[0]} {worst[1]:.1f}",
        "in_90pct_interval": round(float(np.mean(inside)), 2) if inside else "none",
        "false_trees": len(false),
        "on_saplings": on_saplings,
    }


def run_plot(plot: Path) -> dict:
    """All methods on one rendered plot's LiDAR."""
    began = time.perf_counter()
    cloud = read_cloud(next((plot / "lidar").glob("*.laz")), attributes=("intensity", "gps_time"))
    dtm = dtm_from_cloud(cloud.xyz, crs=cloud.horizontal_crs)
    ground_s = time.perf_counter() - began
    began = time.perf_counter()
    stems = find_stems(cloud, dtm)
    label = label_points(cloud.xyz, cloud.xyz[:, 2] - dtm.height(cloud.xyz[:, 0], cloud.xyz[:, 1]), stems)
    stems_s = time.perf_counter() - began
    rows, saplings = truth_of(plot)
    result: dict = {"points": len(cloud), "read_and_ground_s": round(ground_s, 1), "find_stems_s": round(stems_s, 1)}
    for name, options in METHODS.items():
        began = time.perf_counter()
        trees = measure_stems(cloud, label, dtm, options, stems=stems)
        result[name] = {**score(trees, rows, saplings), "measure_s": round(time.perf_counter() - began, 1)}
    return result


def run_scan(data: Path, name: str) -> dict:
    """The default on one terrestrial cloud against reference circles, where there are some."""
    began = time.perf_counter()
    cloud = read_cloud(data / name, crs="local", need_crs=False, attributes=())
    try:
        dtm = dtm_from_cloud(cloud.xyz)
    except Exception:  # a cut-out tree: its lowest points stand in for the ground
        dtm = flat_ground(cloud.xyz)
    stems = find_stems(cloud, dtm)
    label = label_points(cloud.xyz, cloud.xyz[:, 2] - dtm.height(cloud.xyz[:, 0], cloud.xyz[:, 1]), stems)
    trees = measure_stems(cloud, label, dtm, stems=stems)
    flags = {flag: sum(tree.qc_flag == flag for tree in trees) for flag in ("ok", "check", "reject")}
    result = {
        "points": len(cloud),
        "seconds": round(time.perf_counter() - began, 1),
        "trees": len(trees),
        **flags,
        "dbh_cm": [round(tree.dbh_cm, 1) if tree.dbh_cm else tree.qc_reason for tree in trees],
    }
    circles = circles_of(data, name)
    if circles is not None:
        differences = []
        for x, y, d_cm in circles:
            near = [tree for tree in trees if tree.dbh_cm is not None and np.hypot(tree.x - x, tree.y - y) < MATCH_M]
            if near:
                differences.append(near[0].dbh_cm - d_cm)
        result.update(
            reference_circles=len(circles),
            matched=len(differences),
            median_difference_cm=round(float(np.median(differences)), 2),
            median_abs_difference_cm=round(float(np.median(np.abs(differences))), 2),
            differences_cm=[round(float(value), 1) for value in differences],
        )
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder with plot_* and lidar_* folders")
    parser.add_argument("--plots", type=Path, nargs="*", help="default: every plot_* of --data with truth")
    parser.add_argument("--output", type=Path, required=True, help="JSON to write")
    options = parser.parse_args()
    record: dict = {
        "plots": {},
        "scans": {},
    }
    there = sorted(plot for plot in options.data.glob("plot_*") if (plot / "truth" / "trees.csv").exists())
    plots = options.plots or there
    columns = (
        "success_pct",
        "rmse_cm",
        "me_cm",
        "mae_cm",
        "in_90pct_interval",
        "false_trees",
        "on_saplings",
        "measure_s",
    )
    for plot in plots:
        result = record["plots"][plot.name] = run_plot(plot)
        print(
            f"\n{plot.name}: {result['points']:,} points; read and ground {result['read_and_ground_s']} s, "
            f"stems {result['find_stems_s']} s"
        )
        print(f"{'method':28}" + "".join(f"{column:>18}" for column in columns) + "   worst")
        for method in METHODS:
            print(
                f"{method:28}"
                + "".join(f"{result[method][column]:>18}" for column in columns)
                + f"   {result[method]['worst']}"
            )
    print()
    for name in REAL:
        if (options.data / name).exists():
            result = record["scans"][name] = run_scan(options.data, name)
            print(f"{name}: {json.dumps(result)}")
    record["peak_memory_mb"] = peak_memory_mb()
    write_record(options.output, record, seeds=[0])


if __name__ == "__main__":
    main()
