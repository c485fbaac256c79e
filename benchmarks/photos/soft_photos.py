"""What soft photos do to diameters, and whether the stated errors say so.

    python -m benchmarks.photos.soft_photos PLOT [PLOT ...] [--kinds light:1.0 coded:1.0 larger:1.5] --output FILE

Photos of rendered plots are blurred by a Gaussian (sigma in pixels), of the light (``light``: a lens, motion) or of
their coded values (``coded``: noise reduction, resizing), or made larger by a factor (``larger``: cubic, as programs
resize), and stems are found and fitted in them with the renderer's cameras and ground. ``in_90_without``: intervals
without what softness adds to the errors (``from_photos/softness.py``), by the plot's median pixel.
"""

from __future__ import annotations

import argparse
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from benchmarks.photos.stems_from_photos import score
from benchmarks.records import write_record
from benchmarks.rendered import plot_inputs
from treedgs_geo.core.progress import make_reporter
from treedgs_geo.from_photos.find import search_photos
from treedgs_geo.from_photos.options import PhotoStemOptions
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.reconstruction.shrinking import GAMMA

KINDS = ("coded:0.6", "coded:1.0", "coded:1.5", "light:1.0", "light:1.5", "larger:1.5")
#: JPEG quality that the photos are stored with again.
QUALITY = 95


def softened(view: View, kind: str, amount: float, folder: Path) -> View:
    """The view with its photo blurred or made larger, written to ``folder``."""
    image, camera = cv2.imread(str(view.path)), view.camera
    if kind == "light":
        light = cv2.GaussianBlur((image / np.float32(255)) ** np.float32(GAMMA), (0, 0), amount)
        image = np.rint(255 * light ** (1 / GAMMA)).astype(np.uint8)
    elif kind == "coded":
        image = cv2.GaussianBlur(image, (0, 0), amount)
    else:
        width, height = round(camera.width * amount), round(camera.height * amount)
        image = cv2.resize(image, (width, height), interpolation=cv2.INTER_CUBIC)
        across, down = width / camera.width, height / camera.height
        camera = replace(
            camera,
            width=width,
            height=height,
            fx=camera.fx * across,
            fy=camera.fy * down,
            cx=camera.cx * across,
            cy=camera.cy * down,
        )
    path = folder / view.path.name
    cv2.imwrite(str(path), image, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    return replace(view, path=path, camera=camera)


def run(plot: Path, kind: str, amount: float) -> dict:
    """Figures of one plot's stems in such photos."""
    views, frame, ground, area = plot_inputs(plot)
    with tempfile.TemporaryDirectory(prefix="treedgs-soft-") as folder:
        if amount:
            with ThreadPoolExecutor(2) as writers:
                views = list(writers.map(lambda view: softened(view, kind, amount, Path(folder)), views))
        found = search_photos(views, ground, area, PhotoStemOptions(), make_reporter("plain"))
    figures = score(found.fits, plot, frame)
    soft_px = float(np.median([look.soft_px for look in found.looks if look is not None]))
    away = [np.linalg.norm(view.centre - [*area.centres.mean(axis=0), ground(*area.centres.mean(axis=0)[:, None])[0]])
            for view in views]  # fmt: skip
    soft_cm = soft_px * 100 * float(np.median(away)) / views[0].camera.fx
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
            write_record(args.output, results, seeds=[PhotoStemOptions().seed])


if __name__ == "__main__":
    main()
