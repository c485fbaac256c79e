"""Photos that say nothing of where they look (a phone's), with their own GPS: levelled as they were held, and scaled by
known lengths or by the GPS alone.

    python -m treedgs_lab.benchmarks.photos.plain_photos PLOT [PLOT ...] --work WORK [--output FILE]

PLOT: of ``simulate-plot --flight low`` or ``walk`` with ``--control-points 8``. The photos are copied without their
XMP; of the plates two pairs are the ends of known lengths (2 mm, a tape), whose marks are those of the list. The block
lies as far off as the GPS is: trees are moved back by what its cameras are off together before they are compared.
"""

from __future__ import annotations

import argparse
import itertools
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from PIL import Image

from treedgs_geo.core.files import read_json
from treedgs_geo.inventory.accuracy.scores import score_against_truth
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.reconstruction.model import load_views
from treedgs_geo.reconstruction.poses import fit_similarity
from treedgs_lab.benchmarks.plot import TruePlot
from treedgs_lab.benchmarks.processes import CONTROL, CRS, run_verb
from treedgs_lab.benchmarks.reconstruction.accuracy import camera_errors
from treedgs_lab.benchmarks.records import write_record

#: EXIF's camera maker and model; lengths, the marks that an end has at least, and the error of a tape, metres.
MAKER, MODEL, LENGTHS, MARKS, TAPE_SD_M = 271, 272, 2, 3, 0.002


def copy_plain(plot: Path, folder: Path) -> None:
    """The plot's photos with their EXIF alone, of a camera that nobody knows."""
    folder.mkdir(parents=True, exist_ok=True)
    for path in sorted((plot / "images").iterdir()):
        with Image.open(path) as image:
            exif = image.getexif()
            exif[MAKER], exif[MODEL] = "Maker", "Phone"
            image.save(folder / path.name, quality="keep", exif=exif)


def write_lengths(plot: Path, path: Path) -> None:
    """Lengths between plates, the nearest pairs of those that enough photos show, as ``--gcp`` takes them."""
    names = ["x", "y", "z", "u", "v", "photo", "label"]
    marks = pd.read_csv(plot / CONTROL, sep=r"\s+", skiprows=1, names=names)
    marks = marks[marks.groupby("label")["photo"].transform("size") >= MARKS]
    true = pd.read_csv(plot / "truth" / "control_points.csv", index_col="label")[["x", "y", "z"]]
    apart = {
        pair: float(np.linalg.norm(true.loc[pair[0]] - true.loc[pair[1]]))
        for pair in itertools.combinations(marks["label"].unique(), 2)
    }
    rng, rows, used = np.random.default_rng(1), [], set[str]()
    for pair in sorted(apart, key=lambda each: apart[each]):
        if not used & set(pair) and len(used) < 2 * LENGTHS:
            used |= set(pair)
            own = marks[marks["label"].isin(pair)][["label", "photo", "u", "v"]]
            rows.append(own.assign(bar="-".join(pair), length_m=round(apart[pair] + rng.normal(0, TAPE_SD_M), 3)))
    pd.concat(rows).to_csv(path, index=False)


def measure(plot: Path, work: Path, *more: Any) -> dict[str, Any]:
    """One run of the chain, and how far off its block and trees are. more: options of ``photos-to-dbh``."""
    trees, inputs = work / "trees.gpkg", ["--photos", work.parent / "images", "--plots", plot / "plots.csv"]
    run_verb("photos-to-dbh", *inputs, "--crs", CRS, "--workspace", work, "--output", trees, "--overwrite", *more)
    _, views = load_views(work / "sfm", plot / "images")
    truth, report = TruePlot.load(plot), read_json(work / "sfm" / "report.json")
    true = {view.name: view.centre for view in truth.views()}
    ours, theirs = np.array([view.centre for view in views]), np.array([true[view.name] for view in views])
    fitted = fit_similarity(ours, theirs, np.ones(len(ours)))
    shift_m = np.array(camera_errors(truth, work / "sfm")["common_shift_cm"]) / 100
    found = read_trees(trees)
    found[["x", "y"]] -= shift_m[:2]
    return {
        "photos": report["photos"],
        "registered": report["registered"],
        "scale_error": round(1 / fitted.scale - 1, 5),
        "scale_sd": report["scale_sd"],
        "tilt_deg": round(float(np.degrees(np.arccos(min(fitted.rotation[2, 2], 1.0)))), 3),
        "shift_m": shift_m.tolist(),
        "all in-plot stems": asdict(score_against_truth(found, plot / "truth" / "trees.csv")[0]),
    }


def main() -> None:
    """Copy, run, score, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", nargs="+", type=Path)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--output", type=Path)
    known = parser.parse_args()
    runs = []
    for plot in known.plots:
        folder = known.work / plot.name
        copy_plain(plot, folder / "images")
        write_lengths(plot, folder / "lengths.csv")
        for name, more in (("gps", ()), ("lengths", ("--gcp", folder / "lengths.csv"))):
            plainly = ("--heights", "none", "--sheets", "none", "--orthophoto", "false")
            runs.append({"plot": plot.name, "scale": name, **measure(plot, folder / name, *more, *plainly)})
            print(runs[-1])
    write_record(known.output, {"runs": runs}, seeds=[1])


if __name__ == "__main__":
    main()
