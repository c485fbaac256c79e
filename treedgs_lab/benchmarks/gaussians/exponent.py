"""The exponent p of the published weighted circle, chosen by held-out stems: on splits of each plot, and across plots.

    python -m treedgs_lab.benchmarks.gaussians.exponent plot_a plot_e --output docs/results/gaussian_exponent.json

Free Gaussians (nothing but Gaussians, our losses) at the true places + 10 cm, true poses; their samples with opacity,
the published slices, circles and taper. Every exponent is read on every stem once (``errors_cm``: a stem's errors, in
the order of the sweep); then, as published, 10 % of the stems choose p and the others say what it is worth, in many
seeded splits. The reference are the stems with three clear photos of breast height and more. ``--lidar``: the same for
the plot's LiDAR cloud, weighted by intensity.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from treedgs_geo.core.progress import Reporter, make_reporter
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.stems.cloud.estimate.published import PublishedOptions
from treedgs_geo.stems.cloud.propose.segment import find_stems, label_points
from treedgs_geo.stems.geometry.circles import SolidCircle
from treedgs_geo.stems.splats.options import GaussianOptions, SampleOptions
from treedgs_geo.stems.splats.sample import sample_surface
from treedgs_geo.stems.splats.train import fit_with_report
from treedgs_geo.terrain.dtm import Dtm
from treedgs_geo.terrain.ground import dtm_from_cloud
from treedgs_lab.benchmarks.gaussians.route import RUNS
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import CLEAR_VIEWS, noisy_places, scene_of, truth_rows
from treedgs_lab.published.methods import (
    POWERS,
    Reference,
    StemPoints,
    best_power,
    hold_out,
    measure,
    power_row,
    stem_points,
)

#: What the paper chose for each source on its own stems.
PUBLISHED = {"splats": 0.6, "lidar": 0.85}


def reference_of(rows: list[dict[str, str]], plot: str) -> Reference:
    """The stems of ``truth/trees.csv``."""
    return Reference(
        np.full(len(rows), plot),
        np.array([row["tree_id"] for row in rows]),
        np.array([[float(row["E_bh"]), float(row["N_bh"])] for row in rows]),
        np.array([float(row["dbh_cm"]) for row in rows]),
    )


def splat_points(
    plot: Path, rows: list[dict[str, str]], run: str, samples: int, seed: int, reporter: Reporter
) -> StemPoints:
    """Samples of the Gaussians of each stem, as ``route`` makes them."""
    frame, views, dtm = scene_of(plot)
    options = GaussianOptions(seed=seed, threads=1, **RUNS[run])
    places = noisy_places(rows, frame, seed)
    field, _ = fit_with_report(views, frame, dtm.local(frame).height, places, None, options, reporter)
    points = sample_surface(field, views, SampleOptions(seed=seed, threads=1, samples=samples), reporter)
    cloud = PointCloud(frame.to_project(points.xyz), frame.crs, {"opacity": points.opacity})
    return stem_points(cloud, points.groups + 1, dtm, reference_of(rows, plot.name), "opacity")


def lidar_points(plot: Path, rows: list[dict[str, str]]) -> StemPoints:
    """The plot's LiDAR, segmented by ourselves."""
    cloud = read_cloud(next((plot / "lidar").glob("*.laz")))
    dtm: Dtm = dtm_from_cloud(cloud.xyz, crs=cloud.horizontal_crs)
    height = cloud.xyz[:, 2] - dtm.height(cloud.xyz[:, 0], cloud.xyz[:, 1])
    label = label_points(cloud.xyz, height, find_stems(cloud, dtm))
    return stem_points(cloud, label, dtm, reference_of(rows, plot.name), "intensity")


def errors_of(stems: StemPoints, reference: Reference, seed: int) -> np.ndarray:
    """(P, K) error in cm of each exponent at each stem, NaN = no diameter."""
    reads = [
        measure(stems, "weighted circle", PublishedOptions(circle=SolidCircle(power=power)), 1.37, seed)
        for power in POWERS
    ]
    return np.array(reads) - reference.dbh_cm


def figures(power: float, errors: np.ndarray) -> dict:
    """What an exponent gives on some stems. errors: (P, K)."""
    row = power_row(power, errors[POWERS.index(power)])
    return {"p": power, "measured": row["measured"], "of": row["held_out"], "rmse_cm": _rounded(row["rmse_cm"])}


def chosen_on(errors: np.ndarray) -> float:
    """The exponent that these stems choose. errors: (P, K)."""
    return best_power([power_row(power, own) for power, own in zip(POWERS, errors, strict=True)])


def splits_of(errors: np.ndarray, share: float, splits: int, published: float) -> dict:
    """p chosen on ``share`` of the stems and judged on the others, split by split, beside the published one."""
    powers: list[float] = []
    own: list[float] = []
    theirs: list[float] = []
    failures = [0, 0]
    for seed in range(splits):
        held = hold_out(errors.shape[1], share, seed)
        power = chosen_on(errors[:, held])
        powers.append(power)
        for number, (name, kept) in enumerate(((power, own), (published, theirs))):
            row = power_row(name, errors[POWERS.index(name), ~held])
            failures[number] += row["held_out"] - row["measured"]
            if row["rmse_cm"] is not None:
                kept.append(row["rmse_cm"])
    values, counts = np.unique(powers, return_counts=True)
    return {
        "splits": splits,
        "held_out": int(hold_out(errors.shape[1], share, 0).sum()),
        "chosen": {f"{value:g}": int(count) for value, count in zip(values, counts, strict=True)},
        "rmse_cm": {"chosen": _spread(own), "published": _spread(theirs)},
        "failures": {"chosen": failures[0], "published": failures[1]},
    }


def _spread(values: list[float]) -> dict:
    low, middle, high = np.percentile(values, (5, 50, 95))
    return {"median": round(float(middle), 2), "p05": round(float(low), 2), "p95": round(float(high), 2)}


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 2)


def across(errors: dict[str, np.ndarray], published: float) -> list[dict]:
    """p chosen on all stems of the other plots, judged on each plot, beside the published one."""
    rows = []
    for name, own in errors.items():
        others = [other for key, other in errors.items() if key != name]
        if others:
            power = chosen_on(np.concatenate(others, axis=1))
            rows.append({"plot": name, "chosen": figures(power, own), "published": figures(published, own)})
    return rows


def main() -> None:
    """Read, choose, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", type=Path, nargs="+")
    parser.add_argument("--run", choices=("free", "paper-crops"), default="free")
    parser.add_argument("--samples", type=int, default=40, help="candidates per Gaussian (M)")
    parser.add_argument("--lidar", action="store_true", help="the plots' LiDAR instead of Gaussians")
    parser.add_argument("--share", type=float, default=0.1, help="stems that choose p")
    parser.add_argument("--splits", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path, help="JSON file")
    arguments = parser.parse_args()
    source, reporter = "lidar" if arguments.lidar else "splats", make_reporter("plain")
    published = PUBLISHED[source]
    record: dict = {"source": source, "run": None if arguments.lidar else arguments.run, "published_p": published}
    record["plots"] = {}
    errors: dict[str, np.ndarray] = {}
    for plot in arguments.plots:
        rows, began = truth_rows(plot, CLEAR_VIEWS), time.process_time()
        stems = (
            lidar_points(plot, rows)
            if arguments.lidar
            else splat_points(plot, rows, arguments.run, arguments.samples, arguments.seed, reporter)
        )
        errors[plot.name] = own = errors_of(stems, reference_of(rows, plot.name), arguments.seed)
        record["plots"][plot.name] = {
            "stems": len(rows),
            "with_points": sum(points is not None for points in stems.points),
            "cpu_s": round(time.process_time() - began, 1),
            "sweep": [figures(power, own) for power in POWERS],
            "errors_cm": {
                row["tree_id"]: [None if np.isnan(error) else round(float(error), 2) for error in own[:, k]]
                for k, row in enumerate(rows)
            },
            "by_held_out": splits_of(own, arguments.share, arguments.splits, published),
        }
        print(plot.name, record["plots"][plot.name], flush=True)
        record["other_plot"] = across(errors, published)
        write_record(arguments.output, record, seeds=[arguments.seed, arguments.splits - 1])
    print(record["other_plot"], flush=True)


if __name__ == "__main__":
    main()
