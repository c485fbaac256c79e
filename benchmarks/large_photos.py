"""Enlarge a plot's photos to see what many megapixels cost (not how accurate they are: nothing is added to them).

    python benchmarks/large_photos.py PLOT OUTPUT --width 8192

EXIF and XMP stay, with the pixel dimensions and the calibrated focal length scaled; geotag files, plots.csv and truth/
are linked. The folder is then an ordinary input of ``photos-to-dbh``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from treedgs_geo.benchmarking.enlarge import enlarge


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plot", type=Path)
    parser.add_argument("output", type=Path)
    parser.add_argument("--width", type=int, default=8192)
    options = parser.parse_args()
    (options.output / "images").mkdir(parents=True, exist_ok=True)
    for item in options.plot.iterdir():
        link = options.output / item.name
        if item.name != "images" and not link.exists():
            link.symlink_to(item.resolve())
    total = sum(
        enlarge(photo, options.output / "images" / photo.name, options.width)
        for photo in sorted((options.plot / "images").glob("*.JPG"))
    )
    print(f"{options.output}: {total:.0f} megapixels")


if __name__ == "__main__":
    main()
