"""What evidence sheets cost: their share of a photo run and of a cloud run, and how large they are.

    python -m treedgs_lab.benchmarks.chain.sheets_cost --workspace WS [--cloud CLOUD.laz --plots plots.csv]
        [--output FILE]

A workspace that ``photos-to-dbh`` finished in one go says how long each of its stages took. The cloud is measured here,
in a process of its own; its share is that of the stage in the verb's own log.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from treedgs_geo.core.files import read_json
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.verbs import words


def sizes(folder: Path) -> dict:
    """Number and largest size of the sheets under a folder."""
    found = [file.stat().st_size for file in folder.rglob("*.jpg")]
    return {"sheets": len(found), "largest_bytes": max(found, default=0)}


def of_workspace(work: Path) -> dict:
    """Seconds of every stage, and the share of the sheets."""
    seconds = {name: entry["seconds"] for name, entry in read_json(work / "run.json")["stages"].items()}
    share = seconds["sheets"] / sum(seconds.values())
    return {"kind": "photos", "seconds": seconds, "share": round(share, 4), **sizes(work / "sheets")}


def of_cloud(cloud: Path, plots: Path | None, wanted: str) -> dict:
    """One run of ``pointcloud-to-dbh`` with ``--sheets`` ``wanted``."""
    plain = ("--log-format", "plain")
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "trees.gpkg"
        where = ["--plots", plots] if plots else []
        began = time.monotonic()
        done = subprocess.run(
            words("pointcloud-to-dbh", "--input", cloud, *where, "--output", output, "--sheets", wanted, *plain),
            capture_output=True,
            text=True,
            check=True,
        )
        whole = time.monotonic() - began
        taken = re.search(r"^\s*sheets: ([0-9.]+) s$", done.stderr + done.stdout, re.MULTILINE)
        seconds = float(taken[1]) if taken else 0.0
        return {
            "kind": f"cloud, {wanted}",
            "seconds": {"sheets": seconds, "in all": round(whole, 1)},
            "share": round(seconds / whole, 4),
            **sizes(Path(folder)),
        }


def main() -> int:
    """Run, print and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workspace", type=Path, nargs="*", default=[], help="finished workspaces of photos-to-dbh")
    parser.add_argument("--cloud", type=Path, help="a cloud for pointcloud-to-dbh")
    parser.add_argument("--plots", type=Path, help="its plots")
    parser.add_argument("--output", type=Path, help="JSON file for the figures")
    options = parser.parse_args()
    runs = [of_workspace(work) for work in options.workspace]
    runs += [of_cloud(options.cloud, options.plots, wanted) for wanted in ("auto", "all") if options.cloud]
    for run in runs:
        cost = f"{run['seconds']['sheets']:.1f} s, {100 * run['share']:.1f} % of the run"
        print(f"{run['kind']}: {run['sheets']} sheets, {cost}, largest {run['largest_bytes'] / 1000:.0f} kB")
    write_record(options.output, {"runs": runs}, seeds=[0])
    return 0


if __name__ == "__main__":
    sys.exit(main())
