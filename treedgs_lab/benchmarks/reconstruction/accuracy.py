"""How true a reconstruction is: against the rendered plots' cameras, or against the photos' own positions.

    python -m treedgs_lab.benchmarks.reconstruction.accuracy --plots ../shared/data/plot_a ../shared/data/plot_e \
        --photos ../shared/data/drone_brighton_beach --work WORK --output docs/results/reconstruction.json

``--plots``: camera centres against ``truth/cameras.csv`` (E, N, U and 3-D RMS), and the breast-height points of the
in-plot stems, projected with the estimated and with the true cameras: the difference per axis, raw and after taking out
each view's mean (a shift of a whole view moves all stems alike and costs no diameter). Truth is used for scoring alone.
``--stems``: the in-plot stems fitted with these cameras and with the true ones, on the true ground: what the block
costs in diameter. ``--photos``: folders without truth; camera centres against their EXIF positions. Each is
reconstructed in WORK/NAME, unless it has been.
"""

from __future__ import annotations

import argparse
import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from treedgs_geo.core.files import read_json
from treedgs_geo.reconstruction.model import load_views
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import stems_from_photos
from treedgs_lab.benchmarking.blocks import camera_errors
from treedgs_lab.benchmarking.plot import TruePlot
from treedgs_lab.benchmarks.photos.stems_from_photos import pair_up
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import local_places, plot_inputs, truth_rows
from treedgs_lab.benchmarks.verbs import CRS, photo_inputs, run_verb

SEED = 1


def reconstructed(place: Path, work: Path, inputs: list) -> dict:
    """Reconstruct a folder's photos in its own workspace unless that is done; the report."""
    workspace = work / place.name
    if not (workspace / "sfm" / "report.json").exists():
        run_verb("reconstruct", *inputs, "--dense", "false", "--workspace", workspace)
    return read_json(workspace / "sfm" / "report.json")


def of_report(report: dict) -> dict:
    """What a report says, with or without truth."""
    names = ("photos", "registered", "points", "track_length", "reprojection_rms_px", "focal_px", "focal_free")
    errors = ("focal_sd_px", "readout_s", "readout_sd_s", "scale_sd", "geotag_rms_e_n_u_m")
    return {name: report[name] for name in (*names, *errors, "principal_point_px", "seconds", "stage_seconds")}


def score(plot: Path, workspace: Path) -> dict:
    """Errors of ``workspace/sfm`` against ``plot/truth``."""
    frame, views = load_views(workspace / "sfm", plot / "images")
    truth = TruePlot.load(plot)
    places = {}
    with open(plot / "truth" / "cameras.csv", newline="", encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            places[row["image"]] = frame.to_local(np.array([[float(row[key]) for key in ("E", "N", "h")]]))[0]
    true_views = {view.name: view for view in truth.views()}
    inside = truth.trees[truth.trees["in_plot"]]
    stems = frame.to_local(inside[["E_bh", "N_bh", "h_bh"]].to_numpy(float))
    differences, scatter = [], []
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
    raw, spread = np.concatenate(differences), np.concatenate(scatter)
    return camera_errors(truth, workspace / "sfm") | {
        "bh_raw_px_x_y": _round(np.sqrt(np.mean(raw**2, axis=0)), 3),
        "bh_scatter_px_x_y": _round(np.sqrt(np.mean(spread**2, axis=0)), 3),
        "bh_scatter_worst_view_px": _round(max(np.sqrt(np.mean(s**2, axis=0)).max() for s in scatter), 3),
    }


def of_stems(plot: Path, workspace: Path) -> dict:
    """Diameters with the workspace's cameras minus those with the true ones, of the stems that both measure.

    A block that lies metres off as a whole (positions of a drone's own receiver) is moved back: the true ground lies
    where it lies.
    """
    rows, truth, found = truth_rows(plot), TruePlot.load(plot), []
    for source in (workspace, None):
        views, frame, _, area = plot_inputs(plot, source)
        if source:
            shift = np.array(camera_errors(truth, workspace / "sfm")["common_shift_cm"]) / 100
            views = [replace(view, translation=view.translation + view.rotation @ shift) for view in views]
        ground = truth.dtm.local(frame).height
        fits = stems_from_photos(views, ground, area, PhotoStemOptions(seed=SEED))
        pairs = pair_up(local_places(rows, frame), fits)
        found.append({k: fits[n].dbh_cm for k, n in pairs.items() if fits[n].measured})
    both = sorted(found[0].keys() & found[1].keys())
    difference = np.array([found[0][k] - found[1][k] for k in both])
    return {
        "stems_both": len(both),
        "stems_only_with_these_cameras": len(found[0]) - len(both),
        "stems_only_with_true_cameras": len(found[1]) - len(both),
        "dbh_minus_true_cameras_mean_cm": _round(difference.mean(), 3),
        "dbh_minus_true_cameras_median_cm": _round(np.median(difference), 3),
        "dbh_minus_true_cameras_rms_cm": _round(np.sqrt(np.mean(difference**2)), 3),
    }


def _round(value, digits: int = 2):
    return np.round(value, digits).tolist()


def main() -> None:
    """Reconstruct, score, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plots", type=Path, nargs="*", default=[], help="rendered plots: images/, MRK, .pos, truth/")
    parser.add_argument("--photos", type=Path, nargs="*", default=[], help="folders with images/ and no truth")
    parser.add_argument("--stems", action="store_true", help="fit the stems with these cameras and with the true ones")
    parser.add_argument("--work", type=Path, required=True, help="for the workspaces; what is there is scored as it is")
    parser.add_argument("--output", type=Path, help="write the figures as JSON")
    known = parser.parse_args()
    figures = {}
    for plot in known.plots:
        report = reconstructed(plot, known.work, photo_inputs(plot))
        figures[plot.name] = of_report(report) | score(plot, known.work / plot.name)
        if known.stems:
            figures[plot.name] |= of_stems(plot, known.work / plot.name)
    for folder in known.photos:
        figures[folder.name] = of_report(
            reconstructed(folder, known.work, ["--photos", folder / "images", "--crs", CRS])
        )
    print(json.dumps(figures, indent=1))
    write_record(known.output, figures, seeds=[SEED])


if __name__ == "__main__":
    main()
