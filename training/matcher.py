"""Trains the descriptor of ``examples/sun_matcher.py`` on simulated plots whose sun moves between the flights.

    treedgs simulate-plot --output WORK/200001 --preset test --seed 200001 --photos 16 --sun-shift-min 40 --labels true
    python -m training.matcher --plots WORK/200001 WORK/200002 --minutes 12 --output sun_matcher.pt

A place on the ground that two photos show, by the simulator's cameras, terrain and labels, must be described alike, and
unlike the other places of both patches (InfoNCE). ``--minutes`` are of the processor, one thread. Seeds from 200000 on
are used nowhere else.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch

from examples.sun_matcher import STRIDE, Descriptor, flattened
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.terrain.dtm import Dtm
from treedgs_lab.benchmarking.plot import TruePlot
from treedgs_lab.simulate.labels import read_labels

#: Side of a patch, places compared in it, patches of a step; share of pairs under one sun; most turn, degrees.
PATCH_PX, PLACES, BATCH, SAME_SUN, TURN_DEG = 256, 160, 6, 0.25, 30.0
#: Least places that a pair of patches must share; most angle between two views, degrees.
LEAST_SHARED, MOST_ANGLE_DEG = 24, 45.0
#: Patches stand where so much is ground within so many pixels.
OPEN_PX, OPEN_SHARE = 121, 0.6
RATE, SHARPNESS = 2e-3, 0.07


@dataclass(frozen=True)
class Photo:
    """view: its true camera. grey: (H, W) as the network takes it. ground: (H, W) bool. open: pixels (row by row) with
    ground all about."""

    view: View
    grey: np.ndarray
    ground: np.ndarray
    open: np.ndarray


def load_photos(folder: Path) -> tuple[list[Photo], Dtm]:
    """The photos of a simulated plot with labels, and its terrain."""
    plot = TruePlot.load(folder)
    photos = []
    for view in plot.views():
        grey = cv2.imread(str(view.path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
        if grey is None:
            raise SystemExit(f"{view.path}: cannot be decoded as a photo; simulate the plot again.")
        shares = read_labels(folder / "truth" / "labels" / f"{Path(view.name).stem}.png")
        ground = shares.astype(int).sum(axis=2) < 64
        share = cv2.blur(ground.astype(np.float32), (OPEN_PX, OPEN_PX), borderType=cv2.BORDER_CONSTANT)
        photos.append(Photo(view, flattened(grey), ground, np.flatnonzero(share > OPEN_SHARE)))
    return photos, plot.dtm.local(plot.frame)


def on_ground(view: View, pixels: np.ndarray, dtm: Dtm) -> np.ndarray:
    """(K, 3) where the rays of (K, 2) pixels meet the terrain, local; NaN beyond it."""
    rays, height = view.rays(pixels), np.full(len(pixels), np.nanmedian(dtm.heights) - dtm.origin[2])
    for _ in range(6):
        points = view.centre + rays * ((height - view.centre[2]) / rays[:, 2])[:, None]
        height = dtm.height(points[:, 0], points[:, 1])
    return points


def main() -> None:
    """Train and write the weights."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plots", type=Path, nargs="+", required=True)
    parser.add_argument("--minutes", type=float, default=12.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path, required=True)
    args = parser.parse_args()
    torch.set_num_threads(1)
    torch.manual_seed(args.seed)
    rng = np.random.default_rng(args.seed)
    plots = [load_photos(folder) for folder in args.plots]
    network = Descriptor().train()
    optimiser = torch.optim.Adam(network.parameters(), RATE)
    began, step, shown = time.process_time(), 0, []
    while (done := (time.process_time() - began) / (60 * args.minutes)) < 1:
        for group in optimiser.param_groups:
            group["lr"] = RATE * 0.5 * (1 + np.cos(np.pi * done)) + 1e-5
        batch = [patches(plots[rng.integers(len(plots))], rng) for _ in range(BATCH)]
        loss, right = step_of(network, batch)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        shown.append((float(loss.detach()), right))
        step += 1
        if step % 50 == 0:
            mean_loss, mean_right = np.mean(shown[-50:], axis=0)
            print(
                f"{step} steps, {100 * done:.0f} %: loss {mean_loss:.3f}, nearest is right {mean_right:.2f}", flush=True
            )
    torch.save(network.state_dict(), args.output)


def step_of(network: Descriptor, batch: list[tuple]) -> tuple[torch.Tensor, float]:
    """Loss of a batch, and the share of places whose nearest description is the right one."""
    images = np.stack([image for one, two, _, _ in batch for image in (one, two)])[:, None]
    maps = network(torch.from_numpy(images))
    losses, right = [], []
    for k, (_, _, here, there) in enumerate(batch):
        one, two = (_at(maps[2 * k + side], places) for side, places in enumerate((here, there)))
        alike = one @ two.T
        # Near places are neither the same nor wrong.
        near = [np.linalg.norm(each[:, None] - each[None], axis=2) < 1.5 * STRIDE for each in (here, there)]
        neither = torch.from_numpy((near[0] | near[1]) & ~np.eye(len(here), dtype=bool))
        scores = (alike / SHARPNESS).masked_fill(neither, -1e4)
        target = torch.arange(len(here))
        losses.append(
            0.5
            * (torch.nn.functional.cross_entropy(scores, target) + torch.nn.functional.cross_entropy(scores.T, target))
        )
        right.append(float((scores.argmax(1) == target).float().mean()))
    return torch.stack(losses).mean(), float(np.mean(right))


def _at(described: torch.Tensor, places: np.ndarray) -> torch.Tensor:
    """(K, WIDTH) descriptions at (K, 2) pixels of a patch."""
    height, width = described.shape[1:]
    grid = (torch.from_numpy(places).float() - 0.5) / STRIDE
    grid = 2 * grid / torch.tensor([width - 1, height - 1]) - 1
    found = torch.nn.functional.grid_sample(described[None], grid[None, None], align_corners=True)[0, :, 0].T
    return torch.nn.functional.normalize(found, dim=1)


def patches(plot: tuple[list[Photo], Dtm], rng: np.random.Generator) -> tuple:
    """Two patches (P, P) of one place and (K, 2), (K, 2) the pixels of the ground that both show."""
    photos, dtm = plot
    while True:
        a, b = (photos[k] for k in rng.choice(len(photos), 2, replace=False))
        angle = np.degrees(np.arccos(np.clip(a.view.rotation[2] @ b.view.rotation[2], -1, 1)))
        if not len(a.open) or angle > MOST_ANGLE_DEG or (a.view.flight == b.view.flight and rng.random() > SAME_SUN):
            continue
        row, column = np.divmod(rng.choice(a.open), a.grey.shape[1])
        pixel = np.array([[column + 0.5, row + 0.5]])
        middle = on_ground(a.view, pixel, dtm)[0]
        ends = [view.project(middle + np.array([[0, 0, 0], [0.3, 0, 0]]))[0] for view in (a.view, b.view)]
        if not np.isfinite(ends).all() or not b.view.contains(ends[1][:1])[0]:
            continue
        step = [each[1] - each[0] for each in ends]
        turn = np.degrees([np.arctan2(each[1], each[0]) for each in step])
        base = rng.uniform(-180, 180)
        turns = base - turn[0], base - turn[1] + rng.uniform(-TURN_DEG, TURN_DEG)
        size = np.exp(rng.uniform(-0.15, 0.15))
        moves = [
            _patch_of(each[0] + rng.uniform(-20, 20, 2) * side, angle, size if side else 1.0)
            for side, (each, angle) in enumerate(zip(ends, turns, strict=True))
        ]
        here = rng.uniform(8, PATCH_PX - 8, (4 * PLACES, 2))
        back = cv2.invertAffineTransform(moves[0])
        pixels = here @ back[:, :2].T + back[:, 2]
        usable = _shows_ground(a, pixels)
        here, pixels = here[usable], pixels[usable]
        if not len(here):
            continue
        others = b.view.project(on_ground(a.view, pixels, dtm))[0]
        there = others @ moves[1][:, :2].T + moves[1][:, 2]
        shared = _shows_ground(b, others) & (there > 8).all(axis=1) & (there < PATCH_PX - 8).all(axis=1)
        if shared.sum() < LEAST_SHARED:
            continue
        here, there = here[shared][:PLACES], there[shared][:PLACES]
        images = [
            cv2.warpAffine(photo.grey, move, (PATCH_PX, PATCH_PX)) for photo, move in ((a, moves[0]), (b, moves[1]))
        ]
        return *images, here, there


def _patch_of(pixel: np.ndarray, turn_deg: float, size: float) -> np.ndarray:
    """(2, 3) affine from a photo to a patch around a pixel, turned by ``turn_deg``."""
    move = np.asarray(cv2.getRotationMatrix2D((float(pixel[0]), float(pixel[1])), -turn_deg, size), float)
    move[:, 2] += PATCH_PX / 2 - pixel
    return move


def _shows_ground(photo: Photo, pixels: np.ndarray) -> np.ndarray:
    height, width = photo.ground.shape
    column, row = np.floor(np.nan_to_num(pixels, nan=-1)).astype(int).T
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    shows = np.zeros(len(pixels), bool)
    shows[inside] = photo.ground[row[inside], column[inside]]
    return shows


if __name__ == "__main__":
    main()
