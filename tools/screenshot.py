"""The pictures of the docs, drawn by QGIS under Xvfb from the demo's results: ``make demo && make screenshot``.

    python tools/screenshot.py [--demo FOLDER] [--pictures FOLDER] [--windows FOLDER]

Those of every other window, opened by keys in the toolbox, and of what follows the trees (tapes, stand table) go into
``build/windows``: to be looked at before a release.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import qgis_run

from treedgs_geo.cli import main as treedgs

NAMES = ("toolbox", "map", "flight", "maptip", "review", "dialog", "log", "pairs", "report")


def main() -> int:
    """Draw; 1 when a picture did not come about."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--demo", type=Path, default=qgis_run.ROOT / "demo")
    parser.add_argument("--pictures", type=Path, default=qgis_run.ROOT / "docs" / "images")
    parser.add_argument("--windows", type=Path, default=qgis_run.ROOT / "build" / "windows")
    parser.add_argument("--run-s", type=float, default=45, help="the job is photographed after this many seconds")
    chosen = parser.parse_args()
    demo, pictures = chosen.demo.resolve(), chosen.pictures.resolve()
    if not (demo / "trees.gpkg").exists():
        print(f"error: {demo / 'trees.gpkg'} does not exist; run make demo first", file=sys.stderr)
        return 1
    command = qgis_run.with_windows(Path(__file__).with_name("screenshot_inside.py"), "1280x1200x24")
    if command is None:
        print("error: QGIS or xvfb-run was not found; run make setup", file=sys.stderr)
        return 1
    pictures.mkdir(parents=True, exist_ok=True)
    # Not in the system's folder for temporary files: QGIS marks layers there.
    with tempfile.TemporaryDirectory(prefix=".shots-", dir=demo) as folder:
        extra = Path(folder)
        plot = demo / "plot"
        common = ["--trees", str(demo / "trees.gpkg"), "--plots", str(plot / "plots.csv"), "--log-format", "plain"]
        field = ["--field", str(plot / "field_trees.csv")]
        treedgs(["match-plots", *common, *field, "--output", str(extra / "pairs.gpkg")])
        stand = ["--species", "PITA", "--stand-id", "Demo", "--output", str(extra / "stand")]
        treedgs(["stand-table", *common, *stand])
        job = {
            "pictures": str(extra),
            "trees": str(demo / "trees.gpkg"),
            "dtm": str(demo / "work" / "dtm.tif"),
            "stations": str(demo / "work" / "geotags.gpkg"),
            "photos": str(plot / "images"),
            "geotags": str(plot),
            "plots": str(plot / "plots.csv"),
            "fresh": str(demo / "new-work"),
            "pairs": str(extra / "pairs.gpkg"),
            "stand": str(extra / "stand" / "stand.gpkg"),
            "report": str(extra / "stand" / "report.html"),
            "run_s": chosen.run_s,
        }
        take_up_again(demo / "work", demo / "new-work")
        variables = qgis_run.environment(TREEDGS_SHOTS=json.dumps(job))
        variables.pop("QT_QPA_PLATFORM")
        subprocess.run(command, env=variables, timeout=500 + chosen.run_s)
        shutil.rmtree(chosen.windows, ignore_errors=True)
        chosen.windows.mkdir(parents=True)
        for found in sorted(extra.glob("window-*.png")):
            _shrink(found, chosen.windows / found.name)
        print(f"{chosen.windows}: {len(list(chosen.windows.iterdir()))} windows")
        missing = [name for name in NAMES if not (extra / f"{name}.png").exists()]
        for name in NAMES:
            if name not in missing:
                _shrink(extra / f"{name}.png", pictures / f"{name}.png")
                print(pictures / f"{name}.png")
    if missing:
        print(f"error: QGIS drew no {', '.join(missing)}", file=sys.stderr)
    return 1 if missing else 0


def take_up_again(finished: Path, fresh: Path) -> None:
    """A workspace whose cameras are there and whose stems are not: the job that is photographed goes on from it."""
    shutil.rmtree(fresh, ignore_errors=True)
    shutil.copytree(finished, fresh)
    record = json.loads((fresh / "run.json").read_text(encoding="utf-8"))
    for stage in ("ground", "measure", "write"):
        record["stages"].pop(stage, None)
    (fresh / "run.json").write_text(json.dumps(record), encoding="utf-8")


def _shrink(source: Path, target: Path) -> None:
    """Without transparency, packed well."""
    from PIL import Image

    Image.open(source).convert("RGB").save(target, optimize=True)


if __name__ == "__main__":
    sys.exit(main())
