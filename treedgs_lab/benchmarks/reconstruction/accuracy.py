"""How true a reconstruction is: against the rendered plots' cameras, or against the photos' own positions.

    python -m treedgs_lab.benchmarks.reconstruction.accuracy --plots ../shared/data/plot_a ../shared/data/plot_e \
        --photos ../shared/data/drone_brighton_beach --work WORK --output docs/results/reconstruction.json

``--plots``: camera centres against ``truth/cameras.csv`` (E, N, U and 3-D RMS), and the breast-height points of the
in-plot stems, projected with the estimated and with the true cameras: the difference per axis, raw and after taking out
each view's mean (a shift of a whole view moves all stems alike), and how far each view's mean is from those of the
others (``bh_views_px``: median, 90 % and worst). Truth is used for scoring alone.
``--exif``: with the photos' own geotags alone. ``--photos``: folders without truth; camera centres against their EXIF
positions. Each is reconstructed in WORK/NAME, unless it has been.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from treedgs_geo.core.files import read_json
from treedgs_geo.reconstruction.model import load_views

from ..plot import TruePlot
from ..processes import CRS, photo_inputs, run_verb
from ..records import write_record


def reconstructed(place: Path, work: Path, inputs: list) -> dict:
    """Reconstruct a folder's photos in its own workspace unless that is done; the report."""
    workspace = work / place.name
    if not (workspace / "sfm" / "report.json").exists():
        run_verb("reconstruct", *inputs, "--dense", "false", "--workspace", workspace)
    return read_json(workspace / "sfm" / "report.json")


def own_geotags(folder: Path) -> list:
    """Inputs of ``reconstruct`` from the photos of a folder alone."""
    return ["--photos", folder / "images", "--crs", CRS]


def of_report(report: dict) -> dict:
    """What a report says, with or without truth."""
    names = ("photos", "registered", "confirmed", "points", "track_length", "reprojection_rms_px", "focal_px")
    errors = (
        "focal_free",
        "poses_px_median",
        "focal_sd_px",
        "readout_s",
        "readout_sd_s",
        "scale_sd",
        "geotag_rms_e_n_u_m",
    )
    return {name: report[name] for name in (*names, *errors, "principal_point_px", "seconds", "stage_seconds")}


def score(plot: Path, workspace: Path) -> dict:
    """Errors of ``workspace/sfm`` against ``plot/truth``."""
    frame, views = load_views(workspace / "sfm", plot / "images")
    truth = TruePlot.load(plot)
    table = pd.read_csv(plot / "truth" / "cameras.csv")
    places = dict(zip(table["image"], frame.to_local(table[["E", "N", "h"]].to_numpy(float)), strict=True))
    true_views = {view.name: view for view in truth.views()}
    inside = truth.trees[truth.trees["in_plot"]]
    stems = frame.to_local(inside[["E_bh", "N_bh", "h_bh"]].to_numpy(float))
    differences, scatter, toward = [], [], []
    for view in views:
        true = true_views[view.name]
        true = replace(true, translation=-true.rotation @ places[view.name])
        ours, reference = view.project(stems)[0], true.project(stems)[0]
        seen = true.contains(reference)
        if seen.sum() < 3:
            continue
        delta = (ours - reference)[seen]
        differences.append(delta)
        scatter.append(delta - delta.mean(axis=0))
        moved = [(view.project(stems + 0.01 * axis)[0] - ours)[seen].mean(axis=0) / 0.01 for axis in np.eye(3)]
        toward.append(np.column_stack([*moved, delta.mean(axis=0)]))
    raw, spread = np.concatenate(differences), np.concatenate(scatter)
    return camera_errors(truth, workspace / "sfm") | {
        "bh_raw_px_x_y": _round(np.sqrt(np.mean(raw**2, axis=0)), 3),
        "bh_scatter_px_x_y": _round(np.sqrt(np.mean(spread**2, axis=0)), 3),
        "bh_scatter_worst_view_px": _round(max(np.sqrt(np.mean(s**2, axis=0)).max() for s in scatter), 3),
        "bh_views_px": _round(np.quantile(_off_together(np.array(toward)), [0.5, 0.9, 1.0]), 3),
    }


def _off_together(views: np.ndarray) -> np.ndarray:
    """(V,) pixels that each view is off when the block is moved as a whole to where most views are right (Cauchy's
    weights). views: (V, 2, 4) derivatives of a view's pixels by a move in metres, and how far it is off."""
    move = np.zeros(4)
    move[3] = 1.0
    for _ in range(20):
        off = np.linalg.norm(views @ move, axis=1)
        weight = (1 / (1 + (off / 0.7) ** 2))[:, None]
        rows, right = ((weight[..., None] * views[..., :3]).reshape(-1, 3), (weight * views[..., 3]).ravel())
        move[:3] = -np.linalg.lstsq(rows, right, rcond=None)[0]
    return np.linalg.norm(views @ move, axis=1)


def _round(value: Any, digits: int = 2) -> Any:
    return np.round(value, digits).tolist()


def main() -> None:
    """Reconstruct, score, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plots", type=Path, nargs="*", default=[], help="rendered plots: images/, MRK, .pos, truth/")
    parser.add_argument("--photos", type=Path, nargs="*", default=[], help="folders with images/ and no truth")
    parser.add_argument("--exif", action="store_true", help="plots without their PPK files: geotags of EXIF alone")
    parser.add_argument("--work", type=Path, required=True, help="for the workspaces; what is there is scored as it is")
    parser.add_argument("--output", type=Path, help="write the figures as JSON")
    known = parser.parse_args()
    figures = {}
    for plot in known.plots:
        report = reconstructed(plot, known.work, own_geotags(plot) if known.exif else photo_inputs(plot))
        figures[plot.name] = of_report(report) | score(plot, known.work / plot.name)
    for folder in known.photos:
        figures[folder.name] = of_report(reconstructed(folder, known.work, own_geotags(folder)))
    print(json.dumps(figures, indent=1))
    write_record(known.output, figures, seeds=[0])


#: A photo whose axis is this far off its true one is placed wrong, wherever it stands.
TURNED_DEG = 2.0


def camera_errors(plot: TruePlot, sfm: Path) -> dict[str, Any]:
    """Camera centres, focal length (of each flight) and principal point of a block against ``truth/``.

    Returns:
        ``centre_rms_e_n_u_cm, centre_rms_3d_cm, centre_max_cm, common_shift_cm, focal_error_pct`` (a list, by flight),
        ``turned_photos`` (looking more than :data:`TURNED_DEG` elsewhere), ``true_focal_px``,
        ``true_principal_point_px``.
    """
    frame, views = load_views(sfm, plot.folder / "images")
    ours = np.array([view.centre for view in views])
    true = {view.name: view for view in plot.views()}
    errors = plot.frame.to_local(frame.to_project(ours)) - np.array([true[view.name].centre for view in views])
    flights = sorted({view.flight for view in views})
    firsts = [next(view for view in views if view.flight == flight) for flight in flights]
    lens = true[firsts[0].name].camera
    towards = np.array([view.rotation[2] @ true[view.name].rotation[2] for view in views])
    return {
        "centre_rms_e_n_u_cm": _round(100 * np.sqrt(np.mean(errors**2, axis=0))),
        "centre_rms_3d_cm": _round(100 * np.sqrt(np.mean(np.sum(errors**2, axis=1)))),
        "centre_max_cm": _round(100 * np.linalg.norm(errors, axis=1).max()),
        "common_shift_cm": _round(100 * errors.mean(axis=0)),
        "focal_error_pct": [_round(100 * (view.camera.fx / true[view.name].camera.fx - 1), 4) for view in firsts],
        "turned_photos": int((towards < np.cos(np.radians(TURNED_DEG))).sum()),
        "true_focal_px": lens.fx,
        "true_principal_point_px": [lens.cx, lens.cy],
    }


if __name__ == "__main__":
    main()
