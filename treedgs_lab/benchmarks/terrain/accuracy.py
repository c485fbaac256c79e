"""Terrain models of a rendered plot, from its LiDAR and from its photos, against the true terrain.

``python -m treedgs_lab.benchmarks.terrain.accuracy --plot shared/data/plot_a --workspace WS --output
docs/results/terrain.json``

WS is a workspace of ``treedgs reconstruct`` (or ``photos-to-dbh``) of the plot's photos. Errors are heights of the
model minus true heights at the cells' centres: all, bare, and under understory. A cell of half a metre is under
understory when more than a fifth of the LiDAR returns below 2 m lie 0.15 m or more above the true ground, and bare when
fewer than 2 % do; cells within 0.6 m of a stem are neither. The truth is used for scoring alone.
"""

from __future__ import annotations

import argparse
import csv
import json
from pathlib import Path

import numpy as np

from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.reconstruction.model import load_points, load_views
from treedgs_geo.terrain.dtm import Dtm, read_dtm
from treedgs_geo.terrain.ground import dtm_from_cloud
from treedgs_geo.terrain.sparse_ground import dtm_from_sparse
from treedgs_lab.benchmarks.records import write_record

_CELL_M = 0.5


def cover_kinds(plot: Path, truth: Dtm, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(K, 2) cell centres of the LiDAR's extent, and which are bare and which lie under understory."""
    height = xyz[:, 2] - truth.height(xyz[:, 0], xyz[:, 1])
    low = xyz[height < 2.0]
    above = height[height < 2.0] > 0.15
    corner = np.floor(xyz[:, :2].min(axis=0))
    cell = np.floor((low[:, :2] - corner) / _CELL_M).astype(int)
    span = cell.max(axis=0) + 1
    key = cell[:, 0] * span[1] + cell[:, 1]
    count = np.bincount(key, minlength=span.prod()).astype(float)
    share = np.bincount(key, above, minlength=span.prod()) / np.maximum(count, 1)
    i, j = np.divmod(np.arange(span.prod()), span[1])
    centres = corner + (np.column_stack([i, j]) + 0.5) * _CELL_M
    with open(plot / "truth" / "trees.csv", newline="", encoding="utf-8") as stream:
        stems = np.array([[float(row["E_bh"]), float(row["N_bh"])] for row in csv.DictReader(stream)])
    clear = np.linalg.norm(centres[:, None] - stems[None], axis=2).min(axis=1) > 0.6
    good = clear & (count >= 20)
    return centres, good & (share < 0.02), good & (share > 0.2)


def score(dtm: Dtm, truth: Dtm, xy: np.ndarray) -> dict:
    """Errors at (K, 2) positions, centimetres."""
    error = 100 * (dtm.height(xy[:, 0], xy[:, 1]) - truth.height(xy[:, 0], xy[:, 1]))
    known = np.isfinite(error)
    error = error[known]
    return {
        "cells": int(known.size),
        "known_pct": round(100 * float(known.mean()), 1),
        "rmse_cm": round(float(np.sqrt(np.mean(error**2))), 2),
        "bias_cm": round(float(error.mean()), 2),
        "p95_abs_cm": round(float(np.percentile(np.abs(error), 95)), 2),
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True)
    parser.add_argument("--workspace", type=Path, help="of 'treedgs reconstruct'; without it only the LiDAR is scored")
    parser.add_argument("--output", type=Path)
    known = parser.parse_args()
    cloud = read_cloud(next((known.plot / "lidar").glob("*.laz")), attributes=())
    truth = read_dtm(known.plot / "dtm.tif", cloud.crs)
    cells, bare, under = cover_kinds(known.plot, truth, cloud.xyz)
    models = {"lidar": dtm_from_cloud(cloud.xyz, crs=cloud.crs)}
    report: dict = {"plot": known.plot.name}
    if known.workspace:
        frame, _ = load_views(known.workspace / "sfm", known.plot / "images")
        points = frame.to_project(load_points(known.workspace / "sfm").xyz)
        report["sparse_points"] = len(points)
        models["photos"] = dtm_from_sparse(points, crs=frame.crs)
    for name, dtm in models.items():
        everywhere = score(dtm, truth, cells)
        support = dtm.support_m(cells[:, 0], cells[:, 1])
        error = np.abs(dtm.height(cells[:, 0], cells[:, 1]) - truth.height(cells[:, 0], cells[:, 1]))
        near, far = support < np.nanmedian(support), support >= np.nanmedian(support)
        report[name] = {
            "all": everywhere,
            "bare": score(dtm, truth, cells[bare]),
            "understory": score(dtm, truth, cells[under]),
            "support_p50_p95_m": np.round(np.nanpercentile(support, [50, 95]), 2).tolist(),
            "mean_abs_error_cm_near_and_far_from_support": np.round(
                [100 * np.nanmean(error[near]), 100 * np.nanmean(error[far])], 2
            ).tolist(),
        }
    print(json.dumps(report, indent=1))
    write_record(known.output, report)


if __name__ == "__main__":
    main()
