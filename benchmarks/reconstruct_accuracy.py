"""How true a reconstruction is, against the rendered plots' truth.

``python benchmarks/reconstruct_accuracy.py --plot shared/data/plot_a --workspace WS [--run] [--output FILE.json]``

Camera centres against ``truth/cameras.csv`` (E, N, U and 3-D RMS), and the breast-height points of the in-plot stems,
projected with the
estimated and with the true cameras: the difference per axis, raw and after taking out each view's mean (a shift of a
whole view moves all
stems alike and costs no diameter). ``--run`` reconstructs first (photos and geotags only); the truth is used for
scoring alone.
"""

from __future__ import annotations

import argparse
import csv
import json
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np

from treedgs_geo.core.files import read_json, write_json
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.reconstruction.model import load_views


def score(plot: Path, workspace: Path) -> dict:
    """Errors of ``workspace/sfm`` against ``plot/truth``."""
    frame, views = load_views(workspace / "sfm", plot / "images")
    truth = {row["image"]: row for row in _rows(plot / "truth" / "cameras.csv")}
    trees = [row for row in _rows(plot / "truth" / "trees.csv") if row["in_plot"] == "True"]
    stems = frame.to_local(np.array([[float(row[k]) for k in ("E_bh", "N_bh", "h_bh")] for row in trees]))
    errors, differences, scatter = [], [], []
    for view in views:
        true = _true_view(truth[view.name], frame)
        errors.append(view.centre - true.centre)
        ours, reference = view.project(stems)[0], true.project(stems)[0]
        inside = true.contains(reference)
        if inside.sum() < 3:
            continue
        delta = (ours - reference)[inside]
        differences.append(delta)
        scatter.append(delta - delta.mean(axis=0))
    errors = np.array(errors)
    raw, spread = np.concatenate(differences), np.concatenate(scatter)
    shift = errors.mean(axis=0)
    report = read_json(workspace / "sfm" / "report.json")
    return {
        "plot": plot.name,
        "photos": len(truth),
        "registered": len(views),
        "centre_rms_e_n_u_cm": _round(100 * np.sqrt(np.mean(errors**2, axis=0))),
        "centre_rms_3d_cm": _round(100 * np.sqrt(np.mean(np.sum(errors**2, axis=1)))),
        "centre_max_cm": _round(100 * np.linalg.norm(errors, axis=1).max()),
        "common_shift_cm": _round(100 * shift),
        "bh_raw_px_x_y": _round(np.sqrt(np.mean(raw**2, axis=0)), 3),
        "bh_scatter_px_x_y": _round(np.sqrt(np.mean(spread**2, axis=0)), 3),
        "bh_scatter_worst_view_px": _round(max(np.sqrt(np.mean(s**2, axis=0)).max() for s in scatter), 3),
        "focal_px": report["focal_px"],
        "true_focal_px": float(next(iter(truth.values()))["fx"]),
        "principal_point_px": report["principal_point_px"],
        "true_principal_point_px": [float(next(iter(truth.values()))[k]) for k in ("cx", "cy")],
        "reprojection_rms_px": report["reprojection_rms_px"],
        "track_length": report["track_length"],
        "points": report["points"],
        "seconds": report["seconds"],
        "stage_seconds": report["stage_seconds"],
    }


def _true_view(row: dict, frame) -> View:  # noqa: ANN001
    value = {key: float(text) for key, text in row.items() if key not in ("image", "kind", "utc")}
    rotation = np.array([[value[f"r{i}{j}"] for j in range(3)] for i in range(3)])
    centre = frame.to_local(np.array([[value["E"], value["N"], value["h"]]]))[0]
    camera = Camera(
        int(value["width"]),
        int(value["height"]),
        value["fx"],
        value["fy"],
        value["cx"],
        value["cy"],
        value["k1"],
        value["k2"],
    )
    return View(row["image"], Path(row["image"]), camera, rotation, -rotation @ centre)


def _rows(path: Path) -> list[dict]:
    with open(path, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def _round(value, digits: int = 2):  # noqa: ANN001, ANN202
    return np.round(value, digits).tolist()


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True, help="rendered plot with images/, MRK, .pos and truth/")
    parser.add_argument("--workspace", type=Path, required=True)
    parser.add_argument("--run", action="store_true", help="reconstruct first")
    parser.add_argument("--crs", default="EPSG:6344")
    parser.add_argument("--output", type=Path, help="write the figures as JSON")
    known = parser.parse_args()
    if known.run:
        subprocess.run(
            [
                sys.executable,
                "-m",
                "treedgs_geo",
                "reconstruct",
                "--photos",
                str(known.plot / "images"),
                "--geotags",
                str(known.plot),
                "--crs",
                known.crs,
                "--workspace",
                str(known.workspace),
            ],
            check=True,
        )
    figures = score(known.plot, known.workspace) | {
        "machine": f"{platform.machine()}, Python {platform.python_version()}"
    }
    print(json.dumps(figures, indent=1))
    if known.output:
        write_json(known.output, figures)


if __name__ == "__main__":
    main()
