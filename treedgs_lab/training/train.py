"""Train the network on the maps of :mod:`treedgs_lab.training.scenes` and write its weights.

    python -m treedgs_lab.training.train --work WORK --minutes 60 --output FILE.json [--resume]

Scenes whose seed is a multiple of 15 are held out; the cross entropy there and the intersection over union of stems
are printed.
"""

from __future__ import annotations

import argparse
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
import torch

from treedgs_geo.stems.photos.network.inference import STEM, normalised

from .network import StemNet, export

#: Patches a batch, and their rows and columns.
BATCH, PATCH = 12, 192
#: Shares of the patches that have ivy or a stem in them, where the map has any.
AT_IVY, AT_STEM = 0.25, 0.4
#: Seeds that are a multiple of this are held out.
HELD_OUT = 15
RATE, DECAY = 3e-3, 1e-4


@dataclass
class Scenes:
    """Maps of the scenes in a folder: (colour, label) by photo. Scenes that are made meanwhile join in."""

    folder: Path
    kept: list = field(default_factory=list)
    held_out: list = field(default_factory=list)
    seen: set = field(default_factory=set)

    def read(self) -> None:
        """Take what is new."""
        for path in sorted(set(self.folder.glob("*.npz")) - self.seen):
            with np.load(path) as data:
                maps = [(data[f"colour_{k}"], data[f"label_{k}"]) for k in range(len(data.files) // 2)]
            (self.kept if int(path.stem) % HELD_OUT else self.held_out).append(maps)
            self.seen.add(path)


def patch(rng: np.random.Generator, colour: np.ndarray, label: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A random piece of a map at a random scale, often one with a stem or ivy in it."""
    size = int(PATCH / np.exp(rng.uniform(np.log(0.7), np.log(1.5))))
    size = min(size, *colour.shape[:2])
    drawn = rng.random()
    wanted = label[..., 3] > 127 if drawn < AT_IVY else label[..., 0] > 127
    if drawn < AT_IVY + AT_STEM and wanted.any():
        at = np.argwhere(wanted)
        row, column = (int(v) for v in at[rng.integers(len(at))] - rng.integers(0, size, 2))
    else:
        row, column = (int(rng.integers(0, n - size + 1)) for n in colour.shape[:2])
    row, column = (int(np.clip(v, 0, n - size)) for v, n in zip((row, column), colour.shape[:2], strict=True))
    piece = slice(row, row + size), slice(column, column + size)
    how = cv2.INTER_AREA if size > PATCH else cv2.INTER_CUBIC
    colour = cv2.resize(colour[piece], (PATCH, PATCH), interpolation=how)
    # OpenCV resizes up to four channels at once.
    parts = [label[piece][..., :4], label[piece][..., 4]]
    label = np.dstack([cv2.resize(part, (PATCH, PATCH), interpolation=cv2.INTER_AREA) for part in parts])
    if rng.random() < 0.5:
        colour, label = colour[:, ::-1], label[:, ::-1]
    return disturbed(rng, np.ascontiguousarray(colour)), label


def disturbed(rng: np.random.Generator, colour: np.ndarray) -> np.ndarray:
    """Other tones, colours, sharpness and noise."""
    image = colour.astype(np.float32) / 255
    if rng.random() < 0.7:
        grey = image.mean(axis=2, keepdims=True)
        image = grey + (image - grey) * rng.uniform(0.3, 1.6)
        toned = np.clip(image, 0, 1) ** np.exp(rng.normal(0, 0.25)) * np.exp(rng.normal(0, [0.12, 0.06, 0.12]))
        image = toned.astype(np.float32)
    if rng.random() < 0.4:
        image = np.asarray(cv2.GaussianBlur(image, (0, 0), rng.uniform(0.3, 1.1)))
    if rng.random() < 0.4:
        image = image + rng.uniform(0.2, 1.0) * (image - cv2.GaussianBlur(image, (0, 0), 1.0))
    image = image + rng.normal(0, rng.uniform(0, 0.03), image.shape).astype(np.float32)
    out = np.clip(255 * image, 0, 255).astype(np.uint8)
    if rng.random() < 0.3:
        _, code = cv2.imencode(".jpg", out, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(60, 95))])
        out = np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR))
    return out


def shares(label: np.ndarray) -> np.ndarray:
    """(rows, columns, 5) uint8 of a label map -> (5, rows, columns) float32 shares of the classes; 0 outside."""
    found = label[..., :4].astype(np.float32) / 255
    ground = np.clip(1 - found.sum(axis=2), 0, 1)
    every = np.stack([ground, *found.transpose(2, 0, 1)])
    return every / np.maximum(every.sum(axis=0), 1e-6) * (label[..., 4] > 0)


def batch(rng: np.random.Generator, scenes: list, count: int = BATCH) -> tuple[torch.Tensor, torch.Tensor]:
    """Random patches and their classes."""
    images, targets = [], []
    for _ in range(count):
        scene = scenes[rng.integers(len(scenes))]
        colour, label = patch(rng, *scene[rng.integers(len(scene))])
        images.append(normalised(colour, label[..., 4] > 0))
        targets.append(shares(label))
    return torch.from_numpy(np.stack(images)), torch.from_numpy(np.stack(targets))


def loss_of(scores: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
    """Cross entropy with shares, per pixel inside the photos."""
    return -(target * torch.log_softmax(scores, 1)).sum() / target.sum().clamp(min=1)


def held_out(network: StemNet, scenes: list) -> tuple[float, float]:
    """Cross entropy and intersection over union of stems on whole maps."""
    network.eval()
    losses, both, either = [], 0.0, 0.0
    with torch.no_grad():
        for scene in scenes:
            for colour, label in scene[::4]:
                scores = network(torch.from_numpy(normalised(colour, label[..., 4] > 0))[None])
                target = torch.from_numpy(shares(label))[None]
                losses.append(float(loss_of(scores, target)))
                found, true = scores[0].argmax(0) == STEM, target[0, STEM] > 0.5
                inside = target[0].sum(0) > 0
                both += float((found & true & inside).sum())
                either += float(((found | true) & inside).sum())
    network.train()
    return float(np.mean(losses)), both / max(either, 1.0)


def main() -> None:
    """Train for some minutes; write weights and the ONNX file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--resume", action="store_true", help="go on from the checkpoint in WORK")
    args = parser.parse_args()
    torch.manual_seed(args.seed)
    torch.set_num_threads(args.threads)
    rng = np.random.default_rng(args.seed)
    network = StemNet().to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    checkpoint = args.work / "stem_net.pt"
    if args.resume:
        network.load_state_dict(torch.load(checkpoint, weights_only=True))
    scenes = Scenes(args.work / "maps")
    scenes.read()
    optimiser = torch.optim.AdamW(network.parameters(), RATE, weight_decay=DECAY)
    began, step, mean = time.monotonic(), 0, 0.0
    loader = ThreadPoolExecutor(1)
    coming = loader.submit(batch, rng, scenes.kept)
    while (part := (time.monotonic() - began) / (60 * args.minutes)) < 1:
        for group in optimiser.param_groups:
            group["lr"] = RATE * min(1.0, (step + 1) / 50) * 0.5 * (1 + np.cos(np.pi * part)) + 1e-5
        images, target = coming.result()
        coming = loader.submit(batch, rng, scenes.kept)
        with torch.autocast("cpu", torch.bfloat16):
            scores = network(images.contiguous(memory_format=torch.channels_last))
        loss = loss_of(scores.float(), target)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        step, mean = step + 1, 0.98 * mean + 0.02 * float(loss.detach())
        if step % 500 == 0:
            out_loss, union = held_out(network, scenes.held_out)
            print(
                f"{step} {part:.2f} {mean / (1 - 0.98**step):.4f} held out {out_loss:.4f} iou {union:.3f}", flush=True
            )
            torch.save(network.state_dict(), checkpoint)
            scenes.read()
    torch.save(network.state_dict(), checkpoint)
    cross_entropy, union = held_out(network, scenes.held_out)
    card = {
        "trained_on": "simulated photos only: treedgs_lab/training/scenes.py",
        "seeds": sorted(int(path.stem) for path in scenes.seen),
        "steps": step,
        "minutes": args.minutes,
        "resumed": args.resume,
        "held_out": {"cross_entropy": round(cross_entropy, 3), "stem_intersection_over_union": round(union, 3)},
    }
    export(network, args.output, card)


if __name__ == "__main__":
    main()
