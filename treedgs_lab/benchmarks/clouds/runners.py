"""TreeDGS (as it stands or a former version) and other programs on the same clouds, each in a process of its own."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from treedgs_lab.benchmarks.plot import TruePlot
from treedgs_lab.benchmarks.records import ROOT

HERE = Path(__file__).parent
#: A measured tree this close to a true stem or a reference circle is it, m.
MATCH_M = 0.3
#: Real terrestrial clouds of the shared data -> reference circles in a thin slab (a cross-check, not truth).
REAL: dict[str, str | None] = {
    "lidar_treels/pine_plot.laz": "lidar_treels/derived_circles_pine_plot.csv",
    "lidar_treeiso/LPine1_demo.laz": "lidar_treeiso/derived_circles.csv",
    "lidar_treels/pine.laz": None,
    "lidar_treels/spruce.laz": None,
    "lidar_itsme/tree_1_pc.txt": None,
    "lidar_itsme/tree_2_pc.txt": None,
    "lidar_itsme/buttressed_tree_1_pc.txt": None,
    "lidar_itsme/buttressed_tree_2_pc.txt": None,
    "lidar_spanner/UAS_Clip.laz": None,
}


def known_stems(data: Path, cloud: str) -> np.ndarray:
    """(K, 4) x, y, DBH cm of the stems that are known, and 1 for those of the plot: a rendered plot's truth, a real
    cloud's reference circles, or none."""
    plot, reference = data / cloud.split("/")[0], REAL.get(cloud)
    if (plot / "truth" / "trees.csv").exists():
        rows = TruePlot.load(plot).trees[["E_bh", "N_bh", "dbh_cm", "in_plot"]].to_numpy(float).tolist()
    elif reference is not None:
        with open(data / reference, encoding="utf-8") as stream:
            rows = [[*(float(row[key]) for key in ("x", "y", "d_cm")), True] for row in csv.DictReader(stream)]
    else:
        rows = []
    return np.array(rows, float).reshape(-1, 4)


def start_treedgs(folder: Path, out: Path, code: Path = ROOT, bh_m: float | None = None) -> subprocess.Popen:
    """``*.npy`` of ``folder`` measured by the TreeDGS of a checkout, NAME.json in ``out``: running."""
    words: list[Any] = [sys.executable, HERE / "run_treedgs.py", folder, out]
    words += [] if bh_m is None else ["--bh", str(bh_m)]
    return subprocess.Popen(words, env={**os.environ, "PYTHONPATH": str(code)}, stdout=subprocess.DEVNULL)


def run_program(script: str, python: Path, cloud: Path, out: Path, options: Iterable, max_cpu_s: int) -> dict | None:
    """What a program makes of one ``.npy``; None where it failed or took more of the processor than ``max_cpu_s``."""
    words: list[Any] = [python, HERE / script, cloud, out, *map(str, options)]
    try:
        subprocess.run(
            ["/bin/sh", "-c", f'ulimit -t {max_cpu_s}; exec "$@"', "sh", *words], check=True, capture_output=True
        )
    except subprocess.SubprocessError:
        return None
    return json.loads(out.read_text())


def nearest(trees: list[dict], place: tuple[float, float]) -> int | None:
    """Index of the tree next to a place, within ``MATCH_M``."""
    away = [float(np.hypot(tree["x"] - place[0], tree["y"] - place[1])) for tree in trees]
    best = int(np.argmin(away)) if away else None
    return best if best is not None and away[best] <= MATCH_M else None
