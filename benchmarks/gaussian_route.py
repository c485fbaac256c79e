"""Gaussians on a rendered plot: stem primitives in the loop, and the published route beside them.

    python benchmarks/gaussian_route.py --plot DIR                          (true poses, true positions + 10 cm noise)
    python benchmarks/gaussian_route.py --plot DIR --workspace WS           (poses of a workspace, the same positions)
    python benchmarks/gaussian_route.py --plot DIR --workspace WS --find    (nothing true: stems found in the photos)

Truth is read for scoring, and for poses and positions where the command says so. Each ``--runs`` entry is fitted and
sampled once: ``primitive`` (stems and Gaussians in one loop), ``free`` (Gaussians only, our losses), ``paper``
(Gaussians only, published losses and sampling). Read-outs: ``primitive`` (the fitted stem itself), ``paper`` (samples
of the Gaussians, published constants), ``default`` (the same samples, solid circles along the axis), ``volume``
(points spread evenly over the stem's surroundings, the cone at whose bark their opacity ends). Stems with at least
three clear views at breast height are the reference, as everywhere.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import platform
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from treedgs_geo import __version__
from treedgs_geo.core.crs import LocalFrame, project_crs
from treedgs_geo.core.files import write_json
from treedgs_geo.core.progress import make_reporter
from treedgs_geo.core.workspace import peak_memory_mb
from treedgs_geo.evaluation.accuracy import pair_by_position, score
from treedgs_geo.from_points.measuring.cloud import measure_stems
from treedgs_geo.from_points.measuring.options import MeasureOptions
from treedgs_geo.gaussians.options import PAPER_SAMPLING, GaussianOptions, SampleOptions
from treedgs_geo.gaussians.sample import SurfacePoints, sample_surface
from treedgs_geo.gaussians.train import fit_with_report
from treedgs_geo.gaussians.trees import trees_of_primitives
from treedgs_geo.gaussians.volume import sample_volume
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.terrain.dtm import Dtm, read_dtm

RUNS = {
    "primitive": {"preset": "balanced"},
    "free": {"preset": "balanced", "stems": "free"},
    "paper": {"preset": "paper"},
}


def true_views(plot: Path, frame: LocalFrame) -> list[View]:
    """The renderer's own cameras, in the local frame of its origin."""
    views = []
    for row in csv.DictReader(open(plot / "truth" / "cameras.csv")):
        number = {key: float(row[key]) for key in row if key not in ("image", "kind", "utc")}
        rotation = np.array([[number[f"r{i}{j}"] for j in range(3)] for i in range(3)])
        lens = (number[k] for k in ("fx", "fy", "cx", "cy", "k1", "k2"))
        camera = Camera(int(row["width"]), int(row["height"]), *lens)
        views.append(
            View(
                row["image"],
                plot / "images" / row["image"],
                camera,
                rotation,
                np.array([number[k] for k in ("tx", "ty", "tz")]),
                int(number["flight"]),
            )
        )
    return views


def read_out(points: SurfacePoints, frame: LocalFrame, dtm: Dtm, how: str) -> dict[int, float]:
    """DBH in cm by seed number; how: ``paper``, ``default``, or ``volume`` for points of ``sample_volume``."""
    cloud = PointCloud(frame.to_project(points.xyz), frame.crs, {"opacity": points.opacity})
    if how == "volume":
        cloud = cloud.with_attribute("even", np.ones(len(points), np.uint8))
    options = MeasureOptions(weights="opacity", method="paper" if how == "paper" else "default", source="splat")
    trees = measure_stems(cloud, points.groups + 1, dtm, options)
    return {tree.tree_id - 1: tree.dbh_cm for tree in trees if tree.dbh_cm is not None}


def reference_rows(plot: Path) -> list[dict]:
    """Rows of ``truth/trees.csv``: stems of the plot with at least three clear views at breast height."""
    with open(plot / "truth" / "trees.csv", encoding="utf-8") as stream:
        return [
            row for row in csv.DictReader(stream) if row["in_plot"] == "True" and int(row["n_unoccluded_bh_views"]) >= 3
        ]


def true_positions(truth: list[dict], frame: LocalFrame, seed: int, noise_m: float = 0.1) -> np.ndarray:
    """(T, 2) local positions of true stems at breast height, with noise of 10 cm on each axis."""
    xy = np.array([[float(row["E_bh"]), float(row["N_bh"])] for row in truth]) - frame.origin[:2]
    return xy + np.random.default_rng(seed).normal(0, noise_m, xy.shape)


def stem_positions(
    arguments: argparse.Namespace,
    frame: LocalFrame,
    views: list[View],
    dtm: Dtm,
    truth: list[dict],
    true_xy: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """(K, 2) local positions to fit at, and (T,) the position that belongs to each true stem (-1: none)."""
    if not arguments.find:
        return true_positions(truth, frame, arguments.seed, arguments.noise), np.arange(len(truth))
    from treedgs_geo.stems.photos import PhotoStemOptions, stems_from_photos

    from treedgs_geo.core.plots import read_plots
    from treedgs_geo.reconstruction.area import Area

    plot = read_plots(arguments.plot / "plots.csv", frame.crs)[0]
    centre = frame.to_local(np.array([[plot.x, plot.y, 0]]))[0]
    area = Area.circle(float(centre[0]), float(centre[1]), plot.radius_m + 1)
    fits = stems_from_photos(views, frame, dtm.local(frame).height, area, PhotoStemOptions())
    found = np.array([fit.axis.p for fit in fits]).reshape(-1, 2)
    owner = np.full(len(truth), -1)
    for i, j in pair_by_position(true_xy, found):
        owner[i] = j
    return found, owner


def scene_of(plot: Path, workspace: Path | None) -> tuple:
    """Frame, photos and ground of a rendered plot: true ones, or those of a workspace of the chain."""
    config = json.loads((plot / "truth" / "config.json").read_text())
    frame = LocalFrame(project_crs(f"EPSG:{config['epsg']}"), np.array(config["origin_E_N_h"], float))
    dtm_file = plot / "dtm.tif"
    if workspace:
        from treedgs_geo.reconstruction.model import load_views

        frame, views = load_views(workspace / "sfm", plot / "images")
        own = workspace / "dtm.tif"
        dtm_file = own if own.exists() else dtm_file
    else:
        views = true_views(plot, frame)
    return frame, views, read_dtm(dtm_file, frame.crs)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True, help="a rendered plot with truth/")
    parser.add_argument("--workspace", type=Path, help="poses (sfm/) and, if there, dtm.tif of this workspace")
    parser.add_argument("--find", action="store_true", help="find the stems in the photos, take no true position")
    parser.add_argument("--runs", nargs="+", default=["primitive", "free", "paper"], choices=list(RUNS))
    parser.add_argument("--samples", type=int, default=100, help="candidates per Gaussian (M)")
    parser.add_argument("--stems", type=int, nargs="+", help="only these rows of the reference (0-based)")
    parser.add_argument("--noise", type=float, default=0.1, help="error of the true positions per axis, metres")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--output", type=Path, help="JSON file")
    arguments = parser.parse_args()
    plot = arguments.plot
    frame, views, dtm = scene_of(plot, arguments.workspace)
    truth = reference_rows(plot)
    if arguments.stems:
        truth = [truth[i] for i in arguments.stems]
    true_xy = np.array([[float(row["E_bh"]), float(row["N_bh"])] for row in truth]) - frame.origin[:2]
    true_dbh = np.array([float(row["dbh_cm"]) for row in truth])
    positions, owner = stem_positions(arguments, frame, views, dtm, truth, true_xy)
    record: dict = {
        "plot": plot.name,
        "poses": "workspace" if arguments.workspace else "true",
        "positions": "found in the photos" if arguments.find else f"true + {100 * arguments.noise:g} cm",
        "seed": arguments.seed,
        "threads": arguments.threads,
        "cores": os.cpu_count(),
        "machine": platform.machine(),
        "version": __version__,
        "reference_stems": len(truth),
        "runs": {},
    }
    reporter = make_reporter("plain")
    for run in arguments.runs:
        began, busy = time.perf_counter(), time.process_time()
        options = GaussianOptions(seed=arguments.seed, threads=arguments.threads, **RUNS[run])
        field, report = fit_with_report(views, frame, dtm.local(frame).height, positions, None, options, reporter)
        fitted = time.perf_counter()
        held = [stem["held_out"] for stem in report.stems if stem["held_out"]]
        entry = {
            "fit_s": round(fitted - began, 1),
            "fit_cpu_s": round(time.process_time() - busy, 1),
            "gaussians": len(field),
            "megapixels": report.megapixels,
            "million_pairs": round(report.pairs / 1e6),
            "stems": len(report.stems),
            "held_out": {key: round(float(np.mean([one[key] for one in held])), 3) for key in held[0]}
            if held
            else None,
            "read_outs": {},
        }
        columns: dict[str, dict[int, float]] = {}
        if report.primitives:
            trees = trees_of_primitives(report.primitives, frame, 1.37)
            columns["primitive"] = {tree.tree_id - 1: tree.dbh_cm for tree in trees if tree.dbh_cm is not None}
        sampling = SampleOptions(seed=arguments.seed, threads=arguments.threads, samples=arguments.samples)
        variants = {"": replace(sampling, **PAPER_SAMPLING) if run == "paper" else sampling}
        for name, chosen in variants.items():
            points = sample_surface(field, views, chosen, reporter)
            entry.setdefault("points", len(points))
            for how in ("paper", "default"):
                columns[how + name] = read_out(points, frame, dtm, how)
        columns["volume"] = read_out(sample_volume(field, views, sampling, reporter), frame, dtm, "volume")
        entry["sample_s"] = round(time.perf_counter() - fitted, 1)
        entry["peak_memory_mb"] = peak_memory_mb()
        print(
            f"\n{run}: {len(field)} Gaussians, fit {entry['fit_s']} s, sampling {entry['sample_s']} s, held out "
            f"{entry['held_out']}"
        )
        print(f"{'tree':8}{'clear':>6}{'true':>7}" + "".join(f"{how:>10.10}" for how in columns))
        for row, dbh, seed in zip(truth, true_dbh, owner, strict=True):
            line = "".join(f"{got[seed] - dbh:+10.1f}" if seed in got else f"{'-':>10}" for got in columns.values())
            print(f"{row['tree_id']:8}{row['n_unoccluded_bh_views']:>6}{dbh:7.1f}{line}")
        for how, found in columns.items():
            got = np.array([seed in found for seed in owner])
            errors = np.array([found[seed] for seed in owner[got]]) - true_dbh[got]
            accuracy = score(errors, true_dbh[got], len(truth))
            names = [row["tree_id"] for row, ok in zip(truth, got, strict=True) if ok]
            each = dict(zip(names, errors.round(2).tolist(), strict=True))
            entry["read_outs"][how] = {**accuracy.as_dict(), "errors_cm": each}
            if accuracy.rmse_cm is not None:
                print(
                    f"{run} / {how}: {accuracy.n_measured} of {len(truth)}, RMSE {accuracy.rmse_cm:.2f} cm, bias "
                    f"{accuracy.me_cm:+.2f}, median {np.median(np.abs(errors)):.2f}, worst {accuracy.max_abs_cm:.1f}"
                )
        record["runs"][run] = entry
    if arguments.output:
        write_json(arguments.output, record)


if __name__ == "__main__":
    main()
