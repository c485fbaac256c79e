"""Do stems lie in the photos where the truth projects them, with and without the travel of the camera in the readout?

    python -m treedgs_lab.benchmarks.photos.stem_edges ../shared/data/plot_h

For every stem and photo with a free breast height: the place across the stem where two steps of brightness, as far
apart as the stem is wide, are steepest (mean over 1.0-1.8 m), against the true axis. Slope 1 of what is measured on
what the travel says means that ``View.project`` and the photos agree about the rolling shutter.
"""

from __future__ import annotations

import argparse
import csv
import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.reconstruction.images import load_image
from treedgs_lab.benchmarking.plot import TruePlot
from treedgs_lab.benchmarks.records import write_record

#: Only stems that are seen so free, from the side, and so wide.
LEAST_SEEN, LEAST_FORESHORTENING, LEAST_WIDTH_PX = 0.9, 0.4, 8.0
#: How far from the axis the stem is looked for, px.
REACH_PX = 4.0


def offset_px(grey: np.ndarray, pixels: np.ndarray, half_px: float) -> float | None:
    """How far across the line of ``pixels`` (N, 2) the stem lies; None where no pair of edges stands out."""
    along = (pixels[-1] - pixels[0]) / np.linalg.norm(pixels[-1] - pixels[0])
    across = np.arange(-26, 26.01, 0.25)
    where = (pixels[:, None] + across[None, :, None] * [-along[1], along[0]] - 0.5).astype(np.float32)
    slope = np.gradient(cv2.remap(grey, where[..., 0], where[..., 1], cv2.INTER_LINEAR).mean(axis=0))
    places = np.arange(-REACH_PX, REACH_PX + 0.01, 0.1)
    left, right = (np.interp(places + side * half_px, across, slope) for side in (-1, 1))
    score = np.where(np.sign(left) != np.sign(right), np.abs(left - right), 0)
    best = int(score.argmax())
    clear = score[best] > 4 * np.median(np.abs(slope)) and abs(places[best]) < REACH_PX - 0.1
    return float(places[best]) if clear else None


def offsets(plot: Path) -> np.ndarray:
    """(N, 2) px: measured offset across the stem from where a standing camera would show it, and what travel adds."""
    truth = TruePlot.load(plot)
    views = {view.name: view for view in truth.views()}
    stems = json.loads((plot / "truth" / "stems.json").read_text(encoding="utf-8"))["stems"]
    dbh_m = dict(zip(truth.trees["tree_id"], truth.trees["dbh_cm"] / 100, strict=True))
    with open(plot / "truth" / "visibility.csv", encoding="utf-8") as stream:
        records = sorted(csv.DictReader(stream), key=lambda row: row["image"])
    found, image, grey = [], "", np.zeros((1, 1), np.float32)
    for row in records:
        free = float(row["visible_fraction"]) >= LEAST_SEEN and row["in_frame"] == "1"
        if not free or float(row["foreshortening"]) < LEAST_FORESHORTENING or float(row["width_px"]) < LEAST_WIDTH_PX:
            continue
        view: View = views[row["image"]]
        if row["image"] != image:
            image = row["image"]
            read = cv2.cvtColor(load_image(view.path), cv2.COLOR_RGB2GRAY)
            grey = np.asarray(cv2.GaussianBlur(read.astype(np.float32), (0, 0), 0.6), np.float32)
        profile = np.array(stems[row["tree_id"]])
        height = np.linspace(1.0, 1.8, 41)
        axis = np.column_stack([np.interp(height, profile[:, 0], profile[:, k]) for k in (2, 3, 4)])
        standing, depth = replace(view, readout_travel_m=np.zeros(3)).project(axis)
        along = standing[-1] - standing[0]
        expected = (view.project(axis)[0] - standing).mean(axis=0) @ [-along[1], along[0]] / np.linalg.norm(along)
        measured = offset_px(grey, standing, 0.5 * view.camera.fx * dbh_m[row["tree_id"]] / depth.mean())
        if measured is not None:
            found.append((measured, expected))
    return np.array(found)


def spread(values: np.ndarray) -> float:
    """Robust standard deviation."""
    return float(1.4826 * np.median(np.abs(values - np.median(values))))


def main() -> int:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", type=Path, nargs="+")
    parser.add_argument("--output", type=Path)
    options = parser.parse_args()
    figures = {}
    for plot in options.plots:
        measured, expected = offsets(plot).T
        fits = np.abs(measured - expected) < 2
        figures[plot.name] = {
            "stems_in_photos": len(measured),
            "expected_rms_px": round(float(np.sqrt(np.mean(expected**2))), 3),
            "slope": round(float(np.polyfit(expected[fits], measured[fits], 1)[0]), 3) if expected.any() else None,
            "spread_standing_px": round(spread(measured), 3),
            "spread_travelling_px": round(spread(measured - expected), 3),
        }
    print(json.dumps(figures, indent=1))
    write_record(options.output, figures)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
