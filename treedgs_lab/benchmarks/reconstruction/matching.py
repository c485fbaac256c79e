"""Matching photos with threads that share COLMAP's indices against processes of one thread each: same matches, seconds?

    python -m treedgs_lab.benchmarks.reconstruction.matching --plot ../shared/data/plot_a --output matching.json

Features are extracted once; each photo is paired with the next ones by name. ``threads``: COLMAP's own matcher, on as
many threads as there are cores, ``--repeats`` times. ``processes``: TreeDGS's (``reconstruction/matching.py``) with 1,
2 and 8 processes. Runs are compared in all rows of COLMAP's tables of matches and verified geometries.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pycolmap

from treedgs_geo.core.machine import cores
from treedgs_geo.core.progress import Reporter
from treedgs_geo.reconstruction.features import run_task
from treedgs_geo.reconstruction.matching import match_pairs
from treedgs_lab.benchmarking.plot import TruePlot
from treedgs_lab.benchmarks.records import write_record

SEED = 1
PROCESSES = (1, 2, 8)


def extract(plot: Path, names: list[str], most: int, work: Path) -> Path:
    """A database with the features of the photos."""
    lens = TruePlot.load(plot).views()[0].camera
    job = {
        "database": str(work / "features.db"),
        "photos": str(plot / "images"),
        "names": names,
        "threads": cores(),
        "camera_params": f"{lens.fx},{lens.fy},{lens.cx},{lens.cy},0,0,0,0",
        "max_image_size": max(lens.width, lens.height),
        "max_features": most,
        "first_octave": -1,
        "peak_threshold": 0.0067,
    }
    run_task("extract", job, work, Reporter())
    return work / "features.db"


def match_with_threads(database: Path, listing: Path, threads: int) -> None:
    """COLMAP's matcher as it comes, in this process."""
    options = pycolmap.FeatureMatchingOptions()
    options.num_threads, options.use_gpu = threads, False
    pairing = pycolmap.ImportedPairingOptions()
    pairing.match_list_path = str(listing)
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = SEED
    pycolmap.logging.minloglevel = pycolmap.logging.Level.ERROR.value
    pycolmap.match_image_pairs(str(database), options, pairing, verification, device=pycolmap.Device.cpu)


def tables(database: Path) -> list[list[tuple]]:
    """Every row that matching wrote."""
    with closing(sqlite3.connect(database)) as file:
        return [list(file.execute(f"SELECT * FROM {table} ORDER BY 1")) for table in ("matches", "two_view_geometries")]


def differing_pairs(one: list[list[tuple]], other: list[list[tuple]]) -> int:
    """Pairs of photos whose matches or geometries differ."""
    pairs: set = set()
    for ours, theirs in zip(one, other, strict=True):
        mine, yours = ({row[0]: row for row in rows} for rows in (ours, theirs))
        pairs |= {pair for pair in mine.keys() | yours.keys() if mine.get(pair) != yours.get(pair)}
    return len(pairs)


def main() -> None:
    """Extract, match in both ways, compare, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=Path, help="a rendered plot")
    parser.add_argument("--features", type=int, default=4000, help="most features a photo")
    parser.add_argument("--neighbours", type=int, default=7, help="each photo is matched with so many next ones")
    parser.add_argument("--repeats", type=int, default=6, help="of the matching with threads")
    parser.add_argument("--output", type=Path)
    parser.add_argument("--threads-on", nargs=2, type=Path, metavar=("DATABASE", "LIST"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.threads_on:
        database, listing = options.threads_on
        match_with_threads(database, listing, cores())
        return
    names = sorted(path.name for path in (options.plot / "images").iterdir())
    reach = options.neighbours
    pairs = np.array([(i, j) for i in range(len(names)) for j in range(i + 1, min(i + reach + 1, len(names)))])
    found, seconds, labels = [], [], []
    with tempfile.TemporaryDirectory() as scratch:
        work = Path(scratch)
        source, database = extract(options.plot, names, options.features, work), work / "run.db"
        listing = work / "pairs.txt"
        listing.write_text("".join(f"{names[i]} {names[j]}\n" for i, j in pairs), encoding="utf-8")
        for label in ["threads"] * options.repeats + [f"processes_{count}" for count in PROCESSES]:
            shutil.copy(source, database)
            began = time.perf_counter()
            if label == "threads":
                words = [sys.executable, "-m", __spec__.name, "--threads-on", database, listing]
                subprocess.run(list(map(str, words)), check=True)
            else:
                match_pairs(database, work, names, pairs, int(label.split("_")[1]), SEED, Reporter())
            seconds.append(round(time.perf_counter() - began, 1))
            found.append(tables(database))
            labels.append(label)
            print(label, seconds[-1], flush=True)
    first = {name: found[labels.index(name)] for name in ("threads", f"processes_{PROCESSES[0]}")}
    figures = {
        "plot": options.plot.name,
        "photos": len(names),
        "pairs": len(pairs),
        "features": options.features,
        "runs": [
            {
                "how": label,
                "seconds": spent,
                "pairs_unlike_the_first": differing_pairs(first[label if label == "threads" else "processes_1"], rows),
            }
            for label, spent, rows in zip(labels, seconds, found, strict=True)
        ],
    }
    print(json.dumps(figures, indent=1))
    write_record(options.output, figures, seeds=[SEED])


if __name__ == "__main__":
    main()
