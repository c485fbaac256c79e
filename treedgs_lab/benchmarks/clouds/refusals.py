"""What each reason of clouds costs in stems, and how far off the stems that it refuses would have been.

    python -m treedgs_lab.benchmarks.clouds.refusals --data ../shared/data --output docs/results/refusals.json

Every cloud is measured as it is, and with every limit that refuses made one that flags. Stems that the second run
measures and the first refused are held against truth (rendered plots) or reference circles (terrestrial clouds, our own
circles in a thin slab: a cross-check). ``clouds``: flags, and how many stems each reason refuses, alone or with others.
``reasons``: all clouds together: refused, measured without the limit, of these with a reference, their error (RMSE and
worst, cm), and how many lie inside their 90 % interval. Candidates that the search itself lists have no diameter. The
real clouds come once more as normalised ones: without their ground, cut 0.3 m above it.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from treedgs_geo.core.progress import Reporter
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.run.cloud import find_and_measure
from treedgs_geo.stems.cloud.estimate.options import MeasureOptions
from treedgs_geo.stems.quality import findings
from treedgs_geo.stems.quality.limits import LIMITS
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.terrain.cloud_ground import found_ground
from treedgs_lab.benchmarks.clouds.runners import MATCH_M, known_stems
from treedgs_lab.benchmarks.records import write_record

CLOUDS = (
    "plot_a/lidar/plot_a_uls.laz",
    "plot_e/lidar/plot_e_uls.laz",
    "plot_h/lidar/plot_h_uls.laz",
    "lidar_treels/pine_plot.laz",
    "lidar_treels/pine.laz",
    "lidar_treels/spruce.laz",
    "lidar_treeiso/LPine1_demo.laz",
    "lidar_itsme/tree_1_pc.txt",
    "lidar_itsme/tree_2_pc.txt",
    "lidar_itsme/buttressed_tree_1_pc.txt",
    "lidar_itsme/buttressed_tree_2_pc.txt",
    "lidar_itsme/pc_tree_uav.txt",
    "lidar_spanner/UAS_Clip.laz",
)
#: Height above ground from which a normalised cloud is kept, m.
CUT_M = 0.3


def measured(cloud: PointCloud, lenient: bool) -> list[Tree]:
    """The stems of a cloud; lenient: no limit refuses."""
    limits, together = LIMITS["points"], findings.TOGETHER["points"]
    if lenient:
        LIMITS["points"] = tuple(replace(limit, check=limit.check or limit.reject, reject=None) for limit in limits)
        findings.TOGETHER["points"] = 99
    try:
        ground = found_ground(cloud.xyz, cloud.horizontal_crs, "cloud", Reporter())
        return find_and_measure(cloud, ground, [], MeasureOptions(), Reporter())[0]
    finally:
        LIMITS["points"], findings.TOGETHER["points"] = limits, together


def refused_stems(cloud: PointCloud, known: np.ndarray) -> tuple[dict, list[dict]]:
    """A cloud's counts, and a row a refused stem."""
    strict, lenient = measured(cloud, False), measured(cloud, True)
    places = np.array([[tree.x, tree.y] for tree in lenient]).reshape(-1, 2)
    rows = []
    for tree in strict:
        if tree.qc_flag != "reject":
            continue
        row: dict = {"reasons": tree.reasons, "dbh_cm": None, "error_cm": None, "inside": None}
        away = np.hypot(*(places - (tree.x, tree.y)).T)
        other = lenient[int(away.argmin())] if len(away) and away.min() < MATCH_M else None
        if other is not None and other.dbh_cm is not None:
            row["dbh_cm"] = round(other.dbh_cm, 2)
            off = np.hypot(*(known[:, :2] - (other.x, other.y)).T)
            if len(off) and off.min() < MATCH_M and other.dbh_lo_cm is not None and other.dbh_hi_cm is not None:
                right = float(known[int(off.argmin()), 2])
                row["error_cm"] = round(other.dbh_cm - right, 2)
                row["inside"] = bool(other.dbh_lo_cm <= right <= other.dbh_hi_cm)
        rows.append(row)
    counts = {flag: sum(tree.qc_flag == flag for tree in strict) for flag in ("ok", "check", "reject")}
    every = sorted({reason for row in rows for reason in row["reasons"]})
    return {**counts, "refused_for": {r: sum(r in row["reasons"] for row in rows) for r in every}}, rows


def of_reasons(rows: list[dict]) -> dict:
    """All clouds' refused stems, reason by reason."""
    found = {}
    for reason in sorted({reason for row in rows for reason in row["reasons"]}):
        these = [row for row in rows if reason in row["reasons"]]
        error = np.array([row["error_cm"] for row in these if row["error_cm"] is not None])
        found[reason] = {
            "refused": len(these),
            "alone": sum(len(row["reasons"]) == 1 for row in these),
            "measured_without": sum(row["dbh_cm"] is not None for row in these),
            "with_reference": len(error),
            "rmse_cm": round(float(np.sqrt(np.mean(error**2))), 2) if len(error) else None,
            "worst_cm": round(float(error[np.abs(error).argmax()]), 2) if len(error) else None,
            "inside_interval": sum(bool(row["inside"]) for row in these),
        }
    return found


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    clouds, rows = {}, []
    for name in CLOUDS:
        path = args.data / name
        cloud = read_cloud(path, crs=None if name.startswith(("plot", "lidar_spanner")) else "local")
        known = known_stems(args.data, name)
        kinds = {"": cloud}
        if not name.startswith("plot"):
            ground = found_ground(cloud.xyz, None, name, Reporter()).dtm
            height = cloud.xyz[:, 2] - ground.height(cloud.xyz[:, 0], cloud.xyz[:, 1])
            flat = replace(cloud, xyz=np.column_stack([cloud.xyz[:, :2], height]))
            kinds[f", heights above {CUT_M:g} m"] = flat.select(height > CUT_M)
        for kind, points in kinds.items():
            clouds[name + kind], found = refused_stems(points, known)
            rows += found
            print(name + kind, json.dumps(clouds[name + kind]), flush=True)
    write_record(args.output, {"clouds": clouds, "reasons": of_reasons(rows)})
    print(json.dumps(of_reasons(rows), indent=1))


if __name__ == "__main__":
    main()
