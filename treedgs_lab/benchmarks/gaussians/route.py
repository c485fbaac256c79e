"""Gaussians on a rendered plot: stem primitives in the loop, and the published route beside them.

    python -m treedgs_lab.benchmarks.gaussians.route --plot DIR (true poses, true positions + 10 cm noise)
    python -m treedgs_lab.benchmarks.gaussians.route --plot DIR --workspace WS
        (poses of a workspace, the same positions)
    python -m treedgs_lab.benchmarks.gaussians.route --plot DIR --workspace WS --find
        (nothing true: stems found in the photos)

Truth is read for scoring, and for poses and positions where the command says so. Each ``--runs`` entry is fitted and
sampled once: ``primitive`` (stems and Gaussians in one loop), ``free`` (Gaussians only, our losses), ``paper-crops``
(Gaussians only, published losses and sampling). Read-outs: ``primitive`` (the fitted stem itself), ``paper`` (samples
of the Gaussians, published constants), ``default`` (the same samples, solid circles along the axis), ``volume``
(points spread evenly over the stem's surroundings, the cone at whose bark their opacity ends). Stems with at least
three clear views at breast height are the reference, as everywhere.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.progress import Reporter, make_reporter
from treedgs_geo.core.workspace import peak_memory_mb
from treedgs_geo.inventory.accuracy.scores import pair_by_position, score
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.stems.cloud.estimate.cloud import measure_stems
from treedgs_geo.stems.cloud.estimate.options import MeasureOptions
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import stems_from_photos
from treedgs_geo.stems.splats.field import GaussianField
from treedgs_geo.stems.splats.opacity_samples import sample_volume
from treedgs_geo.stems.splats.options import PAPER_SAMPLING, GaussianOptions, SampleOptions
from treedgs_geo.stems.splats.sample import SurfacePoints, sample_surface
from treedgs_geo.stems.splats.train import fit_with_report
from treedgs_geo.stems.splats.trees import trees_of_primitives
from treedgs_geo.terrain.dtm import Dtm
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import CLEAR_VIEWS, area_of, local_places, noisy_places, scene_of, truth_rows

RUNS: dict[str, dict] = {
    "primitive": {"preset": "balanced"},
    "free": {"preset": "balanced", "stems": "free"},
    "paper-crops": {"preset": "paper-crops"},
}


def read_out(points: SurfacePoints, frame: LocalFrame, dtm: Dtm, how: str) -> dict[int, float]:
    """DBH in cm by seed number; how: ``paper``, ``default``, or ``volume`` for points of ``sample_volume``."""
    cloud = PointCloud(frame.to_project(points.xyz), frame.crs, {"opacity": points.opacity})
    if how == "volume":
        cloud = cloud.with_attribute("even", np.ones(len(points), np.uint8))
    options = MeasureOptions(weights="opacity", method="paper" if how == "paper" else "default", source="splat")
    trees = measure_stems(cloud, points.groups + 1, dtm, options)
    return {tree.tree_id - 1: tree.dbh_cm for tree in trees if tree.dbh_cm is not None}


def stem_positions(
    arguments: argparse.Namespace, frame: LocalFrame, views: list[View], dtm: Dtm, truth: list[dict]
) -> tuple[np.ndarray, np.ndarray]:
    """(K, 2) local positions to fit at, and (T,) the position that belongs to each true stem (-1: none)."""
    if not arguments.find:
        return noisy_places(truth, frame, arguments.seed, arguments.noise), np.arange(len(truth))
    area = area_of(arguments.plot, frame)
    fits = stems_from_photos(views, dtm.local(frame).height, area, PhotoStemOptions())
    found = np.array([fit.axis.p for fit in fits]).reshape(-1, 2)
    owner = np.full(len(truth), -1)
    for i, j in pair_by_position(local_places(truth, frame), found):
        owner[i] = j
    return found, owner


def read_outs(
    run: str,
    field: GaussianField,
    views: list[View],
    frame: LocalFrame,
    dtm: Dtm,
    arguments: argparse.Namespace,
    reporter: Reporter,
) -> tuple[dict[str, dict[int, float]], int]:
    """DBH in cm by position number of every reading of a field, and how many points were sampled."""
    sampling = SampleOptions(seed=arguments.seed, threads=arguments.threads, samples=arguments.samples)
    own = replace(sampling, **PAPER_SAMPLING) if run == "paper-crops" else sampling
    points = sample_surface(field, views, own, reporter)
    columns = {how: read_out(points, frame, dtm, how) for how in ("paper", "default")}
    columns["volume"] = read_out(sample_volume(field, views, sampling, reporter), frame, dtm, "volume")
    return columns, len(points)


def judged(run: str, columns: dict[str, dict[int, float]], truth: list[dict], owner: np.ndarray) -> dict:
    """Scores of every reading, printed stem by stem and pooled."""
    dbh_cm = np.array([float(row["dbh_cm"]) for row in truth])
    print(f"{'tree':8}{'clear':>6}{'true':>7}" + "".join(f"{how:>10.10}" for how in columns))
    for row, dbh, seed in zip(truth, dbh_cm, owner, strict=True):
        line = "".join(f"{got[seed] - dbh:+10.1f}" if seed in got else f"{'-':>10}" for got in columns.values())
        print(f"{row['tree_id']:8}{row['n_unoccluded_bh_views']:>6}{dbh:7.1f}{line}")
    scores = {}
    for how, found in columns.items():
        got = np.array([seed in found for seed in owner])
        errors = np.array([found[seed] for seed in owner[got]]) - dbh_cm[got]
        accuracy = score(errors, dbh_cm[got], len(truth))
        names = [row["tree_id"] for row, ok in zip(truth, got, strict=True) if ok]
        scores[how] = {**accuracy.as_dict(), "errors_cm": dict(zip(names, errors.round(2).tolist(), strict=True))}
        if accuracy.rmse_cm is not None:
            print(
                f"{run} / {how}: {accuracy.n_measured} of {len(truth)}, RMSE {accuracy.rmse_cm:.2f} cm, bias "
                f"{accuracy.me_cm:+.2f}, median {np.median(np.abs(errors)):.2f}, worst {accuracy.max_abs_cm:.1f}"
            )
    return scores


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, required=True, help="a rendered plot with truth/")
    parser.add_argument("--workspace", type=Path, help="poses (sfm/) and, if there, dtm.tif of this workspace")
    parser.add_argument("--find", action="store_true", help="find the stems in the photos, take no true position")
    parser.add_argument("--runs", nargs="+", default=["primitive", "free", "paper-crops"], choices=list(RUNS))
    parser.add_argument("--samples", type=int, default=100, help="candidates per Gaussian (M)")
    parser.add_argument("--stems", type=int, nargs="+", help="only these rows of the reference (0-based)")
    parser.add_argument("--noise", type=float, default=0.1, help="error of the true positions per axis, metres")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--output", type=Path, help="JSON file")
    return parser.parse_args()


def main() -> None:
    """Fit, read out, score, print and write."""
    arguments = parse()
    frame, views, dtm = scene_of(arguments.plot, arguments.workspace)
    truth = truth_rows(arguments.plot, CLEAR_VIEWS)
    if arguments.stems:
        truth = [truth[i] for i in arguments.stems]
    positions, owner = stem_positions(arguments, frame, views, dtm, truth)
    record: dict = {
        "plot": arguments.plot.name,
        "poses": "workspace" if arguments.workspace else "true",
        "positions": "found in the photos" if arguments.find else f"true + {100 * arguments.noise:g} cm",
        "threads": arguments.threads,
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
        }
        columns: dict[str, dict[int, float]] = {}
        if report.primitives:
            trees = trees_of_primitives(report.primitives, frame, 1.37)
            columns["primitive"] = {tree.tree_id - 1: tree.dbh_cm for tree in trees if tree.dbh_cm is not None}
        found, entry["points"] = read_outs(run, field, views, frame, dtm, arguments, reporter)
        entry["sample_s"] = round(time.perf_counter() - fitted, 1)
        entry["peak_memory_mb"] = peak_memory_mb()
        print(
            f"\n{run}: {len(field)} Gaussians, fit {entry['fit_s']} s, sampling {entry['sample_s']} s, held out "
            f"{entry['held_out']}"
        )
        entry["read_outs"] = judged(run, columns | found, truth, owner)
        record["runs"][run] = entry
    write_record(arguments.output, record, seeds=[arguments.seed])


if __name__ == "__main__":
    main()
