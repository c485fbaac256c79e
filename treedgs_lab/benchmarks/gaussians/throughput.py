"""Pixel-Gaussian pairs per second of the rasteriser and the point query, beside a plain torch rasteriser.

    python -m treedgs_lab.benchmarks.gaussians.throughput --seconds 0.6 --output docs/results/gaussian_throughput.json

All figures come from one run on one machine; read the ratios, the absolute figures are only an indication.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numba
import numpy as np

from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.stems.splats.field import GaussianField
from treedgs_geo.stems.splats.project import CropCamera
from treedgs_geo.stems.splats.raster import Rasteriser
from treedgs_geo.stems.splats.sample import draw_candidates, view_opacity
from treedgs_lab.benchmarks.records import write_record


def stem_cloud(count: int, seed: int = 0) -> np.ndarray:
    """(count, 14) Gaussians like those of a stem fit at its start: a cylinder 3 m high, sigma 3.7 cm."""
    rng = np.random.default_rng(seed)
    p = np.zeros((count, 14))
    radius, angle = 0.45 * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    p[:, :3] = np.column_stack([radius * np.cos(angle), rng.uniform(-1.5, 1.5, count), radius * np.sin(angle)])
    p[:, 3], p[:, 7:10], p[:, 10] = 1, np.log(0.037), -1.5
    p[:, 11:] = rng.random((count, 3))
    return p


def best_of(work: Callable[[], object], seconds: float) -> float:
    """Seconds of the fastest call of those that fit into ``seconds`` (other work on the machine only slows them)."""
    work()
    best, end = np.inf, time.perf_counter() + seconds
    while time.perf_counter() < end:
        start = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - start)
    return best


def drawing(p: np.ndarray, camera: CropCamera, given: np.ndarray, seconds: float) -> dict:
    """Pairs and million pairs a second of forward and backward, with one and two threads."""
    found: dict = {}
    for threads in (1, 2):
        rasteriser = Rasteriser(threads)
        done = rasteriser.forward(p, camera)
        pairs = found["pairs"] = done.pairs
        for full in (False, True):
            forward = best_of(partial(rasteriser.forward, p, camera, full), seconds)
            name = f"forward{'_full' if full else ''}_{threads}_threads"
            found[f"{name}_mpairs_s"] = round(pairs / forward / 1e6, 1)
        backward = best_of(partial(rasteriser.backward, p, done, given), seconds)
        found[f"backward_{threads}_threads_mpairs_s"] = round(pairs / backward / 1e6, 1)
        rasteriser.close()
    return found


def two_side_by_side(p: np.ndarray, camera: CropCamera, seconds: float) -> float:
    """How many times as much two threads draw as one, each its own crop, as in a fit."""

    def one(_: int = 0) -> object:
        return Rasteriser(1).forward(p, camera)

    with ThreadPoolExecutor(2) as pool:
        alone, both_busy = [], []
        for _ in range(5):
            alone.append(best_of(one, seconds / 5))
            both_busy.append(best_of(lambda: list(pool.map(one, range(2))), seconds / 5))
    return round(2 * min(alone) / min(both_busy), 2)


def point_query(p: np.ndarray, camera: CropCamera, seconds: float) -> float:
    """Million pairs a second of the opacity at points, one thread."""
    points, _ = draw_candidates(GaussianField.from_packed(p), 100, 0)
    lens = Camera(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
    view = View("", Path(), lens, np.eye(3), camera.translation)
    pairs = view_opacity(p, view, points)[2]
    return round(pairs / best_of(lambda: view_opacity(p, view, points), seconds) / 1e6, 1)


def beside_torch(p: np.ndarray, camera: CropCamera, given: np.ndarray, seconds: float, ours: dict) -> dict:
    """The same of plain torch, and how many times as quick ours is."""
    try:
        from treedgs_lab.benchmarks.gaussians.torch_raster import torch_rasteriser
    except ImportError:
        return {"torch": "not installed"}
    torch_forward, torch_both = torch_rasteriser(p, camera, given)
    only, whole = best_of(torch_forward, seconds), best_of(torch_both, seconds)
    found = {
        "torch_forward_mpairs_s": round(ours["pairs"] / only / 1e6, 2),
        "torch_backward_mpairs_s": round(ours["pairs"] / max(whole - only, 1e-9) / 1e6, 2),
    }
    return found | {
        f"{part}_times_torch": round(ours[f"{part}_1_threads_mpairs_s"] / found[f"torch_{part}_mpairs_s"], 1)
        for part in ("forward", "backward")
    }


def main() -> None:
    """Time all, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gaussians", type=int, default=3000)
    parser.add_argument("--seconds", type=float, default=2.0, help="spent on each figure")
    parser.add_argument("--output", type=Path, help="JSON file")
    arguments = parser.parse_args()
    p, seconds = stem_cloud(arguments.gaussians), arguments.seconds
    camera = CropCamera(86, 146, 3804.0, 3804.0, 43.0, 73.0, np.eye(3), np.array([0, 0, 70.0]))
    given = np.random.default_rng(0).normal(size=(4, camera.height, camera.width)).astype(np.float32)
    record: dict = {
        "numba": numba.__version__,
        "numpy": np.__version__,
        "gaussians": len(p),
        "crop_px": [camera.width, camera.height],
        **drawing(p, camera, given, seconds),
        "scaling_two_crops_side_by_side": two_side_by_side(p, camera, seconds),
        "point_query_1_thread_mpairs_s": point_query(p, camera, seconds),
    }
    record |= beside_torch(p, camera, given, seconds, record)
    for name, value in record.items():
        print(f"{name:34} {value}")
    write_record(arguments.output, record, seeds=[0])


if __name__ == "__main__":
    main()
