"""The block beside COLMAP's, and the features beside OpenCV's: seconds on the clock and of processors, in one run.

    python -m treedgs_lab.benchmarks.reconstruction.beside PLOT [PLOT ...] --output FILE

A plot is a folder as ``simulate-plot`` writes it. TreeDGS gets photos and geotags and runs as a process, COLMAP
(pycolmap) gets the photos and runs with its defaults: features of one camera, every photo matched with every other,
incremental mapping. OpenCV's SIFT finds as many features as TreeDGS' guided level. Look at ``load``: seconds of a busy
machine say little.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import cv2
import pycolmap

from treedgs_geo.core.machine import available_threads, in_threads
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.workspace import SFM
from treedgs_geo.reconstruction.images import load_image
from treedgs_geo.reconstruction.matching_strategy import GUIDED_FEATURES
from treedgs_geo.reconstruction.model import REPORT
from treedgs_geo.reconstruction.options import ReconstructOptions
from treedgs_geo.reconstruction.sift import extract
from treedgs_lab.benchmarks.processes import Stopwatch, photo_inputs, run_verb
from treedgs_lab.benchmarks.records import write_record


def beside(plot: Path, work: Path) -> dict[str, Any]:
    """Seconds of TreeDGS' and COLMAP's block of a plot, their photos, and seconds of both programs' features."""
    photos = plot / "images"
    paths = sorted(photos.iterdir())
    found: dict[str, Any] = {"plot": plot.name, "photos": len(paths)}

    watch = Stopwatch()
    run_verb("reconstruct", *photo_inputs(plot), "--dense", "false", "--workspace", work / "ours")
    report = json.loads((work / "ours" / SFM / REPORT).read_text())
    found["TreeDGS"] = watch.seconds() | {"models": [report["registered"]]}

    watch = Stopwatch()
    pycolmap.extract_features(work / "photos.db", photos, camera_mode=pycolmap.CameraMode.SINGLE)
    pycolmap.match_exhaustive(work / "photos.db")
    models = pycolmap.incremental_mapping(work / "photos.db", photos, work)
    sizes = sorted((model.num_reg_images() for model in models.values()), reverse=True)
    found["COLMAP"] = watch.seconds() | {"models": sizes}

    watch = Stopwatch()
    largest = ReconstructOptions().max_image_size
    own = extract(paths, GUIDED_FEATURES, largest, available_threads(), work / "features", Reporter())
    found["features"] = watch.seconds() | {"features": sum(len(each.keypoints) for each in own) // len(own)}

    def sift(path: Path) -> int:
        grey = cv2.cvtColor(load_image(path), cv2.COLOR_RGB2GRAY)
        return len(cv2.SIFT.create(GUIDED_FEATURES).detectAndCompute(grey, None)[0])

    watch = Stopwatch()
    counts = list(in_threads(sift, paths))
    found["OpenCV features"] = watch.seconds() | {"features": sum(counts) // len(counts)}
    return found


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", nargs="+", type=Path)
    parser.add_argument("--output", type=Path)
    options = parser.parse_args()
    runs = []
    for plot in options.plots:
        with tempfile.TemporaryDirectory() as work:
            runs.append(beside(plot.resolve(), Path(work)))
        print(json.dumps(runs[-1], indent=1), flush=True)
    write_record(options.output, {"runs": runs}, seeds=[0])


if __name__ == "__main__":
    main()
