"""The circle-fit stage alone: 45 stems x 60 slices x 2000 hypotheses, as the published plots need it.

    python -m treedgs_lab.benchmarks.clouds.circle_stage --output docs/results/circle_stage.json

Slices are filled discs with a halo and clutter, 20 to 800 points, drawn from ``--seed``; weights are random. Prints the
seconds of each repeat (the first one loads the compiled kernel), of one thread, and how far the circles are off.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numba
import numpy as np

from treedgs_geo.stems.geometry.circles import SolidCircle, fit_solid_circles
from treedgs_lab.benchmarks.records import write_record


def slices(rng: np.random.Generator, count: int, most: int) -> tuple[list[np.ndarray], list[np.ndarray], np.ndarray]:
    """``count`` slices, their weights and true radii (m)."""
    points, weights = [], []
    radii = rng.uniform(0.06, 0.30, count)
    for radius in radii:
        n = int(rng.integers(20, most + 1))
        angle, share = rng.uniform(0, 2 * np.pi, n), np.sqrt(rng.uniform(0, 1, n))
        stem = np.column_stack([np.cos(angle), np.sin(angle)]) * (radius * share)[:, None]
        stem += rng.normal(0, 0.01, stem.shape)
        clutter = rng.uniform(-2 * radius, 2 * radius, (n // 10, 2))
        points.append(np.vstack([stem, clutter]) + rng.uniform(-10, 10, 2))
        weights.append(np.r_[rng.uniform(0.5, 1.0, n), rng.uniform(0.02, 0.4, n // 10)])
    return points, weights, radii


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stems", type=int, default=45)
    parser.add_argument("--slices", type=int, default=60)
    parser.add_argument("--hypotheses", type=int, default=2000)
    parser.add_argument("--most-points", type=int, default=800, help="points of the fullest slice")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    points, weights, radii = slices(rng, args.stems * args.slices, args.most_points)
    solid = SolidCircle(hypotheses=args.hypotheses)
    fit_solid_circles(points[:2], weights[:2], solid)  # compiled or loaded here
    threads = numba.get_num_threads()
    seconds = []
    for _ in range(args.repeat):
        began = time.perf_counter()
        circles = fit_solid_circles(points, weights, solid, args.seed)
        seconds.append(time.perf_counter() - began)
    numba.set_num_threads(1)
    began = time.perf_counter()
    alone = fit_solid_circles(points, weights, solid, args.seed)
    single = time.perf_counter() - began
    error = 200 * (circles[:, 2] - radii)
    record = {
        "stems": args.stems,
        "slices_each": args.slices,
        "hypotheses": args.hypotheses,
        "points": int(sum(map(len, points))),
        "threads": threads,
        "seconds": [round(value, 2) for value in seconds],
        "seconds_one_thread": round(single, 2),
        "same_with_one_thread": bool(np.array_equal(circles, alone, equal_nan=True)),
        "fitted_share": round(float(np.isfinite(error).mean()), 4),
        "median_error_cm": round(float(np.nanmedian(error)), 2),
    }
    print(json.dumps(record, indent=1))
    write_record(args.output, record, seeds=[args.seed])


if __name__ == "__main__":
    main()
