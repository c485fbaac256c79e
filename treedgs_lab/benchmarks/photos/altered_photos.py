"""What soft, edited and noisy photos do to diameters, and whether the stated errors say so.

    python -m treedgs_lab.benchmarks.photos.altered_photos PLOT [PLOT ...] [--kinds light:1.0 coded:1.0 larger:1.5]
        --output FILE

Photos of rendered plots are altered and written as JPEG again, and stems are found and fitted in them with the
renderer's cameras and ground. Kinds: ``light``, ``coded``: a Gaussian blur (sigma in pixels) of the light (a lens,
motion) or of coded values (noise reduction, resizing); ``larger``: by this factor, cubic; ``jpeg``: quality; ``noise``:
of coded values (standard deviation); ``curve``: an S of this steepness over the coded values (a vivid profile, an
editor); ``flat``: the opposite, a power; ``sharpen``: share of the detail below 1.5 px; ``fringe``: red and blue this
many pixels apart from green at the corners. ``in_90_without``: intervals without what softness adds to the errors
(``stems/photos/images/sharpness.py``), by the plot's median pixel.
"""

from __future__ import annotations

import argparse
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from treedgs_geo.core.progress import make_reporter
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.reconstruction.downsampling import GAMMA
from treedgs_geo.reconstruction.images import load_image
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import search_photos
from treedgs_lab.benchmarks.photos.stems_from_photos import score
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import plot_inputs

KINDS = ("coded:0.6", "coded:1.0", "coded:1.5", "light:1.0", "light:1.5", "larger:1.5")
#: JPEG quality that altered photos are written with, where that is not what is altered.
QUALITY = 95
#: Of the noise.
SEED = 3


def altered(view: View, kind: str, amount: float, folder: Path) -> View:
    """The view with its photo altered, written to ``folder``."""
    image, camera = load_image(view), view.camera
    if kind == "larger":
        camera = enlarged(camera, amount)
        image = cv2.resize(image, (camera.width, camera.height), interpolation=cv2.INTER_CUBIC)
    elif kind == "fringe":
        image = fringed(image, camera, amount)
    elif kind in ("curve", "flat"):
        image = cv2.LUT(image, tones(kind, amount))
    elif kind == "light":
        light = cv2.GaussianBlur((image / np.float32(255)) ** np.float32(GAMMA), (0, 0), amount)
        image = np.rint(255 * light ** (1 / GAMMA)).astype(np.uint8)
    elif kind == "coded":
        image = cv2.GaussianBlur(image, (0, 0), amount)
    elif kind == "sharpen":
        plain = image.astype(np.float32)
        image = np.clip(plain + amount * (plain - cv2.GaussianBlur(plain, (0, 0), 1.5)), 0, 255).astype(np.uint8)
    elif kind == "noise":
        rng = np.random.default_rng([SEED, *view.name.encode()])
        image = np.clip(np.rint(image + rng.normal(0, amount, image.shape)), 0, 255).astype(np.uint8)
    elif kind != "jpeg":
        raise SystemExit(f"--kinds: {kind} is none of light, coded, larger, jpeg, noise, curve, flat, sharpen, fringe")
    path = folder / view.path.name
    quality = int(amount) if kind == "jpeg" else QUALITY
    cv2.imwrite(str(path), cv2.cvtColor(image, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, quality])
    return replace(view, path=path, camera=camera)


def enlarged(camera: Camera, times: float) -> Camera:
    """The camera of a photo that was resized."""
    width, height = round(camera.width * times), round(camera.height * times)
    across, down = width / camera.width, height / camera.height
    return replace(
        camera,
        width=width,
        height=height,
        fx=camera.fx * across,
        fy=camera.fy * down,
        cx=camera.cx * across,
        cy=camera.cy * down,
    )


def fringed(image: np.ndarray, camera: Camera, apart_px: float) -> np.ndarray:
    """(H, W, 3) uint8 with red and blue drawn apart, ``apart_px`` each at the corners."""
    y, x = np.mgrid[0 : camera.height, 0 : camera.width].astype(np.float32)
    share = np.float32(apart_px / np.hypot(camera.width / 2, camera.height / 2))
    out = image.copy()
    for channel, sign in ((0, np.float32(1)), (2, np.float32(-1))):
        at = x + sign * share * (x - np.float32(camera.cx)), y + sign * share * (y - np.float32(camera.cy))
        out[..., channel] = cv2.remap(image[..., channel], *at, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
    return out


def tones(kind: str, amount: float) -> np.ndarray:
    """(256,) uint8 tone curve of coded values."""
    value = np.linspace(0, 1, 256)
    if kind == "flat":
        return np.rint(255 * (0.1 + 0.8 * value**amount)).astype(np.uint8)
    bent = 1 / (1 + np.exp(-amount * (value - 0.5)))
    return np.rint(255 * (bent - bent[0]) / (bent[-1] - bent[0])).astype(np.uint8)


def run(plot: Path, kind: str, amount: float) -> dict:
    """Figures of one plot's stems in altered photos."""
    views, frame, ground, area = plot_inputs(plot)
    with tempfile.TemporaryDirectory(prefix="treedgs-altered-") as folder:
        with ThreadPoolExecutor(2) as writers:
            views = list(writers.map(lambda view: altered(view, kind, amount, Path(folder)), views))
        found = search_photos(views, ground, area, PhotoStemOptions(), make_reporter("plain"))
    figures = score(found.fits, plot, frame)
    soft_px = float(np.median([look.soft_px for look in found.looks if look is not None]))
    middle = area.centres.mean(axis=0)
    place = np.array([*middle, ground(*middle[:, None])[0]])
    away_m = float(np.median([np.linalg.norm(view.centre - place) for view in views]))
    soft_cm = soft_px * 100 * away_m / views[0].camera.fx
    sure = [tree for tree in figures["trees"] if tree.get("flag") == "ok"]
    error, se = (np.array([tree[name] for tree in sure]) for name in ("error_cm", "se_cm"))
    without = np.sqrt(np.maximum(se**2 - soft_cm**2, 0.01))
    return {
        "stems": figures["clear3"],
        "measured": figures["clear3_measured"],
        "false": figures["false"],
        "soft_px": round(soft_px, 2),
        "soft_cm": round(soft_cm, 2),
        "ok": len(sure),
        "ok_rmse_cm": round(float(np.sqrt((error**2).mean())), 2) if sure else None,
        "ok_mean_cm": round(float(error.mean()), 2) if sure else None,
        "ok_worst_cm": round(float(np.abs(error).max()), 2) if sure else None,
        "ok_in_90": round(float((np.abs(error) <= 1.645 * se).mean()), 2) if sure else None,
        "ok_in_90_without": round(float((np.abs(error) <= 1.645 * without).mean()), 2) if sure else None,
        "trees": figures["trees"],
    }


def main() -> None:
    """Run all, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", nargs="+", type=Path)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), metavar="KIND:AMOUNT")
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    results: dict[str, dict] = {}
    for plot in args.plots:
        for kind, _, amount in (text.partition(":") for text in args.kinds):
            figures = run(plot, kind, float(amount))
            results.setdefault(plot.name, {})[f"{kind} {amount}"] = figures
            print(plot.name, kind, amount, {name: value for name, value in figures.items() if name != "trees"})
            write_record(args.output, results, seeds=[PhotoStemOptions().seed, SEED])


if __name__ == "__main__":
    main()
