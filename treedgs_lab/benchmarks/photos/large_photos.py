"""What many megapixels cost: a plot's photos enlarged, then the whole chain on them.

    python -m treedgs_lab.benchmarks.photos.large_photos ../shared/data/plot_a --width 4096 --work WORK \
        --output large_photos.json

Nothing is added to the photos, so how accurate they are says little. EXIF and XMP stay, with the pixel dimensions and
the calibrated focal length scaled; geotag files, plots.csv and truth/ are linked: WORK/PLOT_WIDTH is then an ordinary
input of ``photos-to-dbh``. The chain gets photos, geotags and plots.csv, never ``truth/``.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from treedgs_geo.core.files import read_json
from treedgs_lab.benchmarking.enlarge import enlarge
from treedgs_lab.benchmarks.photos.photos_to_dbh import SEED, run
from treedgs_lab.benchmarks.records import write_record


def enlarged(plot: Path, folder: Path, width: int) -> float:
    """Make ``folder`` of ``plot`` with photos so wide; returns megapixels."""
    (folder / "images").mkdir(parents=True, exist_ok=True)
    for item in plot.iterdir():
        link = folder / item.name
        if item.name != "images" and not link.exists():
            link.symlink_to(item.resolve())
    photos = sorted((plot / "images").glob("*.JPG"))
    return sum(enlarge(photo, folder / "images" / photo.name, width) for photo in photos)


def main() -> int:
    """Enlarge, run, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plot", type=Path)
    parser.add_argument("--width", type=int, default=8192, help="of the enlarged photos, pixels")
    parser.add_argument("--work", type=Path, required=True, help="for the enlarged photos and the workspace")
    parser.add_argument("--preset", default="balanced")
    parser.add_argument("--output", type=Path)
    options = parser.parse_args()
    folder = options.work.resolve() / f"{options.plot.name}_{options.width}"
    megapixels = enlarged(options.plot, folder, options.width)
    print(f"{folder}: {megapixels:.0f} megapixels", flush=True)
    workspace = folder.with_name(f"{folder.name}_workspace")
    figures = {
        "width_px": options.width,
        "megapixels": round(megapixels),
        **run(folder, "auto", options.preset, workspace),
    }
    if figures["exit_code"] == 0:
        figures["reconstruction_s"] = read_json(workspace / "sfm" / "report.json")["stage_seconds"]
    print(json.dumps(figures, indent=1))
    write_record(options.output, figures, seeds=[SEED])
    return figures["exit_code"]


if __name__ == "__main__":
    raise SystemExit(main())
