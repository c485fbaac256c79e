"""Stem segmentation against the labels of simulated plots: precision, recall, F1 and IoU per tree.

    python -m treedgs_lab.benchmarks.clouds.segmentation PLOT [PLOT ...] --output docs/results/segmentation.json

A plot is a folder as ``simulate-plot`` writes it. True labels come from ``truth/stems.json``: a LiDAR point is of a
stem when it lies within 3 cm of its bark (mean radius along the true axis) between 0.3 and 5 m above the foot. A true
stem is found when one segment shares half of their union (IoU >= 0.5); a segment that is no stem's is false. In-plot
stems count; segments on saplings are counted apart. ``--segmenter`` and ``--command`` score an external one.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
import pandas as pd

from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.stems.cloud.propose.external_programs import segment_external
from treedgs_geo.stems.cloud.propose.labelling import Labeller
from treedgs_geo.stems.cloud.propose.segment import find_stems
from treedgs_geo.terrain.ground import dtm_from_cloud
from treedgs_lab.benchmarks.plot import TruePlot
from treedgs_lab.benchmarks.records import write_record

LOW_M, HIGH_M, BARK_M, SAME_IOU = 0.3, 5.0, 0.03, 0.5


def true_labels(plot: Path, xyz: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """(N,) index into the names, -1 = no stem; the nearest bark wins."""
    record = json.loads((plot / "truth" / "stems.json").read_text(encoding="utf-8"))
    local = xyz - np.array(record["origin"])
    label, nearest = np.full(len(xyz), -1), np.full(len(xyz), BARK_M)
    names = sorted(record["stems"])
    for number, name in enumerate(names):
        _, width, x, y, z = np.array(record["stems"][name], float).T
        near = np.flatnonzero(
            (np.abs(local[:, 0] - x.mean()) < 4)
            & (np.abs(local[:, 1] - y.mean()) < 4)
            & (local[:, 2] > z[0] + LOW_M)
            & (local[:, 2] < z[0] + HIGH_M)
        )
        h = local[near, 2]
        away = np.hypot(local[near, 0] - np.interp(h, z, x), local[near, 1] - np.interp(h, z, y))
        # The horizontal section of a leaning stem is stretched along the lean: within the 3 cm up to 25 degrees.
        residual = away - np.interp(h, z, width) / 200
        mine = np.abs(residual) < nearest[near]
        label[near[mine]] = number
        nearest[near[mine]] = np.abs(residual[mine])
    return label, names


def shared_points(true: np.ndarray, label: np.ndarray, band: np.ndarray, stems: int) -> np.ndarray:
    """(stems, L) intersection over union of true stems and labels, of the points in the band."""
    labels = int(label[band].max(initial=0)) + 1
    overlap = np.zeros((stems, labels))
    both = band & (label > 0) & (true >= 0)
    np.add.at(overlap, (true[both], label[both]), 1)
    size_true = np.bincount(true[band & (true >= 0)], minlength=stems)
    size_mine = np.bincount(label[band & (label > 0)], minlength=labels)
    return overlap / np.maximum(size_true[:, None] + size_mine[None] - overlap, 1)


def one_to_one(iou: np.ndarray) -> dict[int, int]:
    """True stem -> label, best first."""
    pairs: dict[int, int] = {}
    for i, j in sorted(np.argwhere(iou >= SAME_IOU).tolist(), key=lambda ij: -iou[ij[0], ij[1]]):
        if i not in pairs and j not in pairs.values():
            pairs[i] = j
    return pairs


def stems_inside(plot: Path) -> pd.DataFrame:
    """The true stems of the plot's own circle."""
    trees = TruePlot.load(plot).trees
    return trees[trees["in_plot"]]


def false_segments(plot: Path, feet: np.ndarray) -> tuple[int, int]:
    """Of segments without a stem, (F, 2) feet: how many within 10 m of the plot's centre are false, and on saplings."""
    record = json.loads((plot / "truth" / "stems.json").read_text(encoding="utf-8"))
    saplings = np.array(record["saplings_xy_dbhcm"], float).reshape(-1, 3)[:, :2] + np.array(record["origin"])[:2]
    centre = stems_inside(plot)[["E_bh", "N_bh"]].to_numpy(float).mean(axis=0)
    near = [foot for foot in feet if np.hypot(*(foot - centre)) <= 10.0]
    on_saplings = sum(bool(len(saplings)) and np.hypot(*(saplings - foot).T).min() < 0.3 for foot in near)
    return len(near) - on_saplings, on_saplings


def score(plot: Path, segmenter: str, command: str) -> dict:
    """One plot's figures."""
    cloud = read_cloud(next((plot / "lidar").glob("*.laz")))
    dtm = dtm_from_cloud(cloud.xyz, crs=cloud.horizontal_crs)
    height = cloud.xyz[:, 2] - dtm.height(cloud.xyz[:, 0], cloud.xyz[:, 1])
    began = time.perf_counter()
    if segmenter == "own":
        label = Labeller(find_stems(cloud, dtm))(cloud.xyz, height)
    else:
        label = segment_external(cloud, segmenter, command)
    seconds = time.perf_counter() - began
    true, names = true_labels(plot, cloud.xyz)
    rows = {row["tree_id"]: row for row in stems_inside(plot).to_dict("records")}
    band = (height > LOW_M) & (height < HIGH_M)
    iou = shared_points(true, label, band, len(names))
    pairs = one_to_one(iou)
    extra = [j for j in np.unique(label[band & (label > 0)]) if j not in pairs.values()]
    feet = np.array([np.median(cloud.xyz[band & (label == j), :2], axis=0) for j in extra]).reshape(-1, 2)
    false, on_saplings = false_segments(plot, feet)
    inside = [i for i, name in enumerate(names) if name in rows]
    each = {names[i]: round(float(iou[i, pairs[i]]), 3) for i in inside if i in pairs}
    missed = [rows[names[i]] for i in inside if i not in pairs]
    recall, precision = len(each) / len(inside), len(each) / max(len(each) + false, 1)
    points_mine = band & np.isin(label, sorted(pairs.values()))
    return {
        "plot": plot.name,
        "points": len(cloud),
        "stems": len(inside),
        "found": len(each),
        "false": false,
        "on_saplings": on_saplings,
        "precision": round(precision, 3),
        "recall": round(recall, 3),
        "f1": round(2 * precision * recall / max(precision + recall, 1e-9), 3),
        "mean_iou": round(float(np.mean(list(each.values()))), 3) if each else None,
        "worst_iou": min(each.values(), default=None),
        "point_precision": round(float((true[points_mine] >= 0).mean()), 3) if points_mine.any() else None,
        "missed": [f"{row['tree_id']} {row['kind']} {row['dbh_cm']:.0f} cm" for row in missed],
        "seconds": round(seconds, 1),
        "iou": each,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", nargs="+", type=Path)
    parser.add_argument("--segmenter", default="own")
    parser.add_argument("--command", default="")
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    runs = [score(plot, args.segmenter, args.command) for plot in args.plots]
    for run in runs:
        print({key: value for key, value in run.items() if key != "iou"})
    write_record(args.output, {"segmenter": args.segmenter, "runs": runs})


if __name__ == "__main__":
    main()
