"""Simulated stands for the training: everything drawn at random, photos and what they show, as plumb maps.

    python -m treedgs_lab.training.scenes --work WORK --seeds 100000 100060 --photographs FOLDER

Each seed is a plot of ``simulate-plot`` (:func:`random_options`); its oblique photos and label images become plumb maps
(``WORK/maps/SEED.npz``), and the plot is deleted. Seeds from 100000 on are used nowhere else. FOLDER has the folders
``bark`` and ``leaves`` with photographs, which half of the stands wear.
"""

from __future__ import annotations

import argparse
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from treedgs_geo.reconstruction.area import Area
from treedgs_geo.stems.photos.images.crops import GroundGrid, PhotoStack, load_stack
from treedgs_geo.stems.photos.images.vertical_rectification import plumb_grid
from treedgs_geo.stems.photos.network.inference import plumb_colours
from treedgs_lab.benchmarks.plot import site_of
from treedgs_lab.benchmarks.processes import run_verb
from treedgs_lab.simulate.labels import FOLIAGE, IVY, STEM, WOOD, read_labels
from treedgs_lab.simulate.settings import command_words

#: Photos of a stand, and the radius of the ground that its maps show, metres.
PHOTOS, RADIUS_M = 13, 6.0
#: Settings of the simulator that take photographs, and their folders.
PHOTOGRAPHS = (("bark", "bark"), ("leaf", "leaves"))


def random_options(seed: int, photographs: Path | None = None) -> list[str]:
    """Options of ``simulate-plot``: stand, understory, light, flight and camera at random."""
    rng = np.random.default_rng(seed)

    def between(low: float, high: float) -> str:
        return f"{rng.uniform(low, high):.4g}"

    def sometimes(chance: float, low: float, high: float) -> str:
        return between(low, high) if rng.random() < chance else "0"

    mean_cm = rng.uniform(13, 42)
    options = {
        "preset": "test",
        "photos": PHOTOS,
        "samples": 3,
        "image_width": 640,
        "image_height": 480,
        "lidar_density_m2": 0,
        "float_epochs": 0,
        "labels": "true",
        "gsd_cm": between(1.3, 2.6),
        "stems_per_ha": f"{np.clip(1000 * (20 / mean_cm) ** 1.2 * rng.uniform(0.5, 1.5), 250, 1500):.0f}",
        "dbh_mean_cm": f"{mean_cm:.4g}",
        "dbh_sd_cm": f"{mean_cm * rng.uniform(0.15, 0.45):.4g}",
        "lean_max_deg": between(3, 20),
        "leaf_area_m2": between(4, 60),
        "shrubs_per_m2": sometimes(0.8, 0.05, 1.2),
        "saplings_per_m2": sometimes(0.8, 0.01, 0.2),
        "logs": int(rng.integers(0, 15)),
        "slope_pct": between(0, 30),
        "strong_leans": int(rng.integers(0, 2)),
        "forks_above_bh": int(rng.integers(0, 2)),
        "touching_saplings": int(rng.integers(0, 2)),
        "sensor": str(rng.choice(["clean", "drone"])),
        "jpeg_quality": int(rng.integers(75, 96)),
        "contrast": sometimes(0.7, 0.05, 0.4),
        "sharpening": sometimes(0.7, 0.1, 0.6),
        "denoise_pct": sometimes(0.5, 0.5, 2.0),
        "exposure_drift_stops": sometimes(0.5, 0.05, 0.4),
        "white_drift_pct": sometimes(0.5, 1, 6),
    }
    options |= {
        "bark_variety": "true",
        "moss_pct": sometimes(0.5, 2, 40),
        "lichen_pct": sometimes(0.5, 2, 40),
        "ivy_stems": int(rng.integers(0, 9)),
        "wrapped_stems": int(rng.integers(0, 3)),
        "flute_pct": sometimes(0.3, 1, 8),
        "buttress_m": sometimes(0.3, 0.2, 0.8),
        "snags": int(rng.integers(0, 2)),
        "hardwood_pct": sometimes(0.5, 10, 100),
        "leaf_off": str(rng.random() < 0.5).lower(),
        "spacing": str(rng.choice(["rows", "natural"])),
        "shrub_height_m": between(0.5, 3),
        "shrub_variety": "true",
        "undergrowth_per_m2": sometimes(0.4, 0.02, 0.4),
    }
    options |= {"forks_below_bh": int(rng.integers(0, 2)), "twins": int(rng.integers(0, 3))}
    options |= {"twin_gap_m": sometimes(0.8, 0.01, 0.4), "sweep_cm": sometimes(0.3, 2, 30)}
    if photographs:
        options |= {f"{part}_photos": photographs / folder for part, folder in PHOTOGRAPHS if rng.random() < 0.5}
    options |= {"sky": "overcast"} if rng.random() < 0.25 else {}
    options |= {"sun_elevation_deg": between(15, 70)} if rng.random() < 0.5 else {}
    return command_words(options)


def maps_of(plot: Path) -> list[tuple[np.ndarray, np.ndarray]]:
    """Per oblique photo: (rows, columns, 3) uint8 RGB, and (rows, columns, 5) uint8: shares of stem, foliage, other
    wood and ivy (of 255), and 1 inside the photo."""
    site = site_of(plot)
    wide = Area.circles(site.area.centres, np.full(len(site.area.radii_m), RADIUS_M))
    grid = GroundGrid.sample(site.ground, wide, 3.0)
    stack = load_stack(site.views, wide, grid, 99, 1.0)
    shares = _label_crops(stack, plot / "truth" / "labels")
    marked, grown = (
        replace(stack, pixels=_as_pixels(shares, wanted)) for wanted in ((STEM, FOLIAGE, WOOD), (IVY,) * 3)
    )
    outline = np.vstack([wide.outline(1.0), wide.centres])
    z = grid.at(outline[:, 0], outline[:, 1])
    points = np.vstack([np.column_stack([outline, z]), np.column_stack([outline, z + 5.2])])
    out = []
    for index in range(len(stack)):
        plumb = plumb_grid(stack, index, points)
        colour, good = plumb_colours(stack.arrays, index, plumb)
        label, _ = plumb_colours(marked.arrays, index, plumb)
        ivy, _ = plumb_colours(grown.arrays, index, plumb)
        out.append((colour, np.dstack([label, ivy[..., 0], good.astype(np.uint8)])))
    return out


def _label_crops(stack: PhotoStack, folder: Path) -> list[np.ndarray]:
    """(rows, columns, 4) uint8 of each crop of the stack: the label images there."""
    crops = []
    for view, (top, left), (rows, columns) in zip(stack.views, stack.corner, stack.shape, strict=True):
        label = read_labels(folder / Path(view.path).with_suffix(".png").name)
        if label.shape[:2] != (view.camera.height, view.camera.width):
            label = cv2.resize(label, (view.camera.width, view.camera.height), interpolation=cv2.INTER_AREA)
        crops.append(label[top : top + rows, left : left + columns])
    return crops


def _as_pixels(crops: list[np.ndarray], channels: tuple[int, ...]) -> np.ndarray:
    """Three channels of label crops, as the ``pixels`` of a stack: blue, green, red."""
    return np.concatenate([crop[..., channels[::-1]].ravel() for crop in crops])


def make_scene(seed: int, work: Path, photographs: Path | None = None) -> Path:
    """Simulate a stand, keep its maps."""
    target = work / "maps" / f"{seed}.npz"
    if target.exists():
        return target
    plot = work / f"plot_{seed}"
    run_verb(
        "simulate-plot", "--output", plot, f"--seed={seed}", *random_options(seed, photographs), "--log-format", "quiet"
    )
    arrays: dict[str, np.ndarray] = {}
    for number, (colour, label) in enumerate(maps_of(plot)):
        arrays |= {f"colour_{number}": colour, f"label_{number}": label}
    target.parent.mkdir(parents=True, exist_ok=True)
    np.savez(target, **arrays)  # type: ignore[arg-type]
    shutil.rmtree(plot)
    return target


def main() -> None:
    """Make the scenes of a range of seeds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--seeds", type=int, nargs=2, required=True, metavar=("FIRST", "LAST"))
    parser.add_argument("--photographs", type=Path)
    args = parser.parse_args()
    for seed in range(args.seeds[0], args.seeds[1] + 1):
        print(make_scene(seed, args.work, args.photographs), flush=True)


if __name__ == "__main__":
    main()
