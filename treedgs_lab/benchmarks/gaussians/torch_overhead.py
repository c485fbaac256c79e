"""What torch costs: a forward and backward pass through ``on_torch.rasterize`` beside the kernels alone.

    python -m treedgs_lab.benchmarks.gaussians.torch_overhead --output docs/results/gaussian_torch.json

12,000 Gaussians over one megapixel, one thread of both, alternating, CPU seconds; the ratio of the medians counts.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
import torch

from treedgs_geo.stems.splats.on_torch.rasterize import rasterize, tensors_of
from treedgs_geo.stems.splats.project import CropCamera
from treedgs_geo.stems.splats.raster import Rasteriser
from treedgs_lab.benchmarks.gaussians.throughput import stem_cloud
from treedgs_lab.benchmarks.records import write_record


def alternated(works: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Median CPU seconds of each, run in turns."""
    taken: dict[str, list[float]] = {name: [] for name in works}
    for work in works.values():
        work()
    for _ in range(rounds):
        for name, work in works.items():
            start = time.process_time()
            work()
            taken[name].append(time.process_time() - start)
    return {name: float(np.median(seconds)) for name, seconds in taken.items()}


def main() -> None:
    """Time both with and without depth and normals, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gaussians", type=int, default=12_000)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--output", type=Path, help="JSON file")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    p = stem_cloud(arguments.gaussians)
    # The stem fills the picture: 1.2 x 3 m, 3.6 mm a pixel.
    camera = CropCamera(800, 1250, 9000.0, 9000.0, 400.0, 625.0, np.eye(3), np.array([0, 0, 22.0]))
    tensors, rasteriser = tensors_of(p), Rasteriser(1)
    means, quats, log_scales, logits, colours = tensors
    record: dict = {"gaussians": len(p), "picture_px": [camera.width, camera.height]}
    for geometry in (False, True):
        given = np.random.default_rng(0).normal(size=(8 if geometry else 4, camera.height, camera.width))
        plain_given = given.astype(np.float32)
        torch_given = torch.from_numpy(plain_given)

        def plain(full: bool = geometry, given: np.ndarray = plain_given) -> object:
            return rasteriser.backward(p, rasteriser.forward(p, camera, full), given)

        def through_torch(full: bool = geometry, given: torch.Tensor = torch_given) -> object:
            for tensor in tensors:
                tensor.grad = None
            return rasterize(
                means, quats, log_scales, logits, colours, camera, geometry=full, rasteriser=rasteriser
            ).planes.backward(given)  # fmt: skip

        seconds = alternated({"kernels": plain, "torch": through_torch}, arguments.rounds)
        record["with depth and normals" if geometry else "colour"] = {
            **{f"{name}_cpu_s": round(value, 4) for name, value in seconds.items()},
            "ratio": round(seconds["torch"] / seconds["kernels"], 3),
        }
    for name, value in record.items():
        print(f"{name:24} {value}")
    write_record(arguments.output, {"numba": numba.__version__, "torch": torch.__version__, **record}, seeds=[0])


if __name__ == "__main__":
    main()
