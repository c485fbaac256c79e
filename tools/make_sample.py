"""The sample flight that the plugin's menu opens: ``sample/``, which goes into the plugin's zip.

    .venv/bin/python tools/make_sample.py [--plot FOLDER] [--output FOLDER]

The demo's plot (``make demo``; simulated anew where there is none) without its truth and without its LiDAR, which the
plugin repository would take for a binary: photos, MRK and .pos files, terrain, field tables.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: The truth is for scoring only.
LEFT_OUT = ("truth", "lidar")
ABOUT = """A simulated plot of TreeDGS, to try it with: photos rendered by ray casting, geotags as a DJI drone with PPK
writes them, terrain (dtm.tif) and a field table. EPSG:6344. No real place, no real trees.
"""


def write(plot: Path, target: Path) -> None:
    """A fresh copy of a plot, as the plugin brings it."""
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(plot, target, ignore=shutil.ignore_patterns(*LEFT_OUT))
    (target / "README.txt").write_text(ABOUT, encoding="utf-8")


def main() -> int:
    """Simulate where needed, copy."""
    from treedgs_geo.cli import main as treedgs

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, default=ROOT / "demo" / "plot")
    parser.add_argument("--output", type=Path, default=ROOT / "sample")
    chosen = parser.parse_args()
    if not (chosen.plot / "truth" / "trees.csv").exists():
        code = treedgs(["simulate-plot", "--preset", "demo", "--output", str(chosen.plot), "--log-format", "plain"])
        if code:
            return code
    write(chosen.plot, chosen.output)
    size = sum(path.stat().st_size for path in chosen.output.rglob("*") if path.is_file())
    print(f"{chosen.output}: {size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
