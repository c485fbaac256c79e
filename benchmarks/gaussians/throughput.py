"""Pixel-Gaussian pairs per second of the rasteriser and the point query, beside a plain torch rasteriser.

    python -m benchmarks.gaussians.throughput --seconds 0.6 --output docs/results/gaussian_throughput.json

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

from benchmarks.records import write_record
from treedgs_geo.gaussians.field import GaussianField
from treedgs_geo.gaussians.project import CropCamera
from treedgs_geo.gaussians.raster import Rasteriser
from treedgs_geo.gaussians.sample import draw_candidates, view_opacity
from treedgs_geo.reconstruction.cameras import Camera, View


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


def torch_rasteriser(parameters: np.ndarray, camera: CropCamera, given: np.ndarray) -> tuple[Callable, Callable]:
    """(forward, forward + backward) of plain torch: 16 x 16 tiles, culled by tile, autograd."""
    import torch

    torch.set_num_threads(1)
    rotation = torch.tensor(camera.rotation, dtype=torch.float32)
    translation = torch.tensor(camera.translation, dtype=torch.float32)
    weight = torch.tensor(given, dtype=torch.float32)

    def picture(t):
        q = t[:, 3:7] / t[:, 3:7].norm(dim=1, keepdim=True)
        w, x, y, z = q.unbind(1)
        turn = torch.stack(
            [
                1 - 2 * (y * y + z * z),
                2 * (x * y - w * z),
                2 * (x * z + w * y),
                2 * (x * y + w * z),
                1 - 2 * (x * x + z * z),
                2 * (y * z - w * x),
                2 * (x * z - w * y),
                2 * (y * z + w * x),
                1 - 2 * (x * x + y * y),
            ],
            1,
        ).reshape(-1, 3, 3)
        centre = t[:, :3] @ rotation.T + translation
        order = torch.argsort(centre.norm(dim=1))
        t, turn, centre = t[order], turn[order], centre[order]
        axes = rotation @ turn * torch.exp(t[:, None, 7:10])
        depth, zero = centre[:, 2], torch.zeros(len(t))
        jac = torch.stack(
            [
                camera.fx / depth,
                zero,
                -camera.fx * centre[:, 0] / depth**2,
                zero,
                camera.fy / depth,
                -camera.fy * centre[:, 1] / depth**2,
            ],
            1,
        ).reshape(-1, 2, 3)
        cov = jac @ axes @ axes.transpose(1, 2) @ jac.transpose(1, 2)
        conic, opacity = torch.linalg.inv(cov), torch.sigmoid(t[:, 10])
        middle = torch.stack([camera.fx * centre[:, 0] / depth, camera.fy * centre[:, 1] / depth], 1)
        middle = middle + torch.tensor([camera.cx, camera.cy])
        cut = 2 * torch.log(255 * opacity).clamp(min=0)
        reach = torch.sqrt(cut[:, None] * torch.diagonal(cov, dim1=1, dim2=2)).detach()
        colour, trans = torch.zeros(camera.height, camera.width, 3), torch.ones(camera.height, camera.width)
        for top in range(0, camera.height, 16):
            for left in range(0, camera.width, 16):
                bottom, right = min(top + 16, camera.height), min(left + 16, camera.width)
                u, v = middle.detach().unbind(1)
                near = (
                    (u + reach[:, 0] > left)
                    & (u - reach[:, 0] < right)
                    & (v + reach[:, 1] > top)
                    & (v - reach[:, 1] < bottom)
                )
                grid = torch.stack(
                    torch.meshgrid(torch.arange(left, right) + 0.5, torch.arange(top, bottom) + 0.5, indexing="xy"), -1
                ).reshape(-1, 2)
                d, k = grid[None] - middle[near, None], conic[near]
                power = (
                    -0.5 * (k[:, 0, 0, None] * d[..., 0] ** 2 + k[:, 1, 1, None] * d[..., 1] ** 2)
                    - k[:, 0, 1, None] * d[..., 0] * d[..., 1]
                )
                alpha = opacity[near, None] * torch.exp(power)
                alpha = torch.where(alpha >= 1 / 255, alpha.clamp(max=0.99), torch.zeros(()))
                passed = torch.cumprod(torch.cat([torch.ones(1, alpha.shape[1]), 1 - alpha]), 0)
                shape = bottom - top, right - left
                colour[top:bottom, left:right] = ((alpha * passed[:-1]).T @ t[near, 11:]).reshape(*shape, 3)
                trans[top:bottom, left:right] = passed[-1].reshape(shape)
        return colour, trans

    def forward():
        with torch.no_grad():
            return picture(torch.tensor(parameters, dtype=torch.float32))

    def both():
        t = torch.tensor(parameters, dtype=torch.float32, requires_grad=True)
        colour, trans = picture(t)
        ((weight[:3] * colour.permute(2, 0, 1)).sum() + (weight[3] * (1 - trans)).sum()).backward()
        return t.grad

    ours = np.moveaxis(Rasteriser().forward(parameters, camera).planes[:3], 0, -1)
    if np.abs(forward()[0].numpy() - ours).max() > 1e-2:
        raise SystemExit("the torch twin draws another picture; the comparison would be meaningless")
    return forward, both


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gaussians", type=int, default=3000)
    parser.add_argument("--seconds", type=float, default=2.0, help="spent on each figure")
    parser.add_argument("--output", type=Path, help="JSON file")
    arguments = parser.parse_args()
    p = stem_cloud(arguments.gaussians)
    camera = CropCamera(86, 146, 3804.0, 3804.0, 43.0, 73.0, np.eye(3), np.array([0, 0, 70.0]))
    given = np.random.default_rng(0).normal(size=(4, camera.height, camera.width)).astype(np.float32)
    record: dict = {
        "numba": numba.__version__,
        "numpy": np.__version__,
        "gaussians": len(p),
        "crop_px": [camera.width, camera.height],
    }
    for threads in (1, 2):
        rasteriser = Rasteriser(threads)
        done = rasteriser.forward(p, camera)
        pairs = record["pairs"] = done.pairs
        for full in (False, True):
            forward = best_of(partial(rasteriser.forward, p, camera, full), arguments.seconds)
            name = f"forward{'_full' if full else ''}_{threads}_threads"
            record[f"{name}_mpairs_s"] = round(pairs / forward / 1e6, 1)
        backward = best_of(partial(rasteriser.backward, p, done, given), arguments.seconds)
        record[f"backward_{threads}_threads_mpairs_s"] = round(pairs / backward / 1e6, 1)
        rasteriser.close()
    # As in a fit: each thread draws crops of its own.
    with ThreadPoolExecutor(2) as pool:
        alone, both_busy = [], []
        for _ in range(5):
            alone.append(best_of(lambda: Rasteriser(1).forward(p, camera), arguments.seconds / 5))
            both_busy.append(
                best_of(
                    lambda: list(pool.map(lambda _: Rasteriser(1).forward(p, camera), range(2))), arguments.seconds / 5
                )
            )
    record["scaling_two_crops_side_by_side"] = round(2 * min(alone) / min(both_busy), 2)
    field = GaussianField.from_packed(p)
    points, _ = draw_candidates(field, 100, 0)
    view = View(
        "",
        Path(),
        Camera(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy),
        np.eye(3),
        camera.translation,
    )
    asked = view_opacity(p, view, points)[2]
    record["point_query_1_thread_mpairs_s"] = round(
        asked / best_of(lambda: view_opacity(p, view, points), arguments.seconds) / 1e6, 1
    )
    try:
        torch_forward, torch_both = torch_rasteriser(p, camera, given)
        only, whole = best_of(torch_forward, arguments.seconds), best_of(torch_both, arguments.seconds)
        record["torch_forward_mpairs_s"] = round(pairs / only / 1e6, 2)
        record["torch_backward_mpairs_s"] = round(pairs / max(whole - only, 1e-9) / 1e6, 2)
        for part in ("forward", "backward"):
            ratio = record[f"{part}_1_threads_mpairs_s"] / record[f"torch_{part}_mpairs_s"]
            record[f"{part}_times_torch"] = round(ratio, 1)
    except ImportError:
        record["torch"] = "not installed"
    for name, value in record.items():
        print(f"{name:34} {value}")
    write_record(arguments.output, record, seeds=[0])


if __name__ == "__main__":
    main()
