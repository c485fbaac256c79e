"""TreeDGS, dendromatics (of 3DFin) and TreeX (pointtree) on the same clouds, in one run, each in a process of its own.

    python -m venv RIVALS && RIVALS/bin/pip install dendromatics pointtree torch torch-scatter
    python -m treedgs_lab.benchmarks.clouds.side_by_side --data ../shared/data --their-python RIVALS/bin/python \
        --output docs/results/side_by_side.json

Every program with its defaults (TreeX: its preset for the kind of cloud), dendromatics also with settings for scans as
sparse as these. Truth: the trees of simulated plots; for real scans circles in a thin slab at breast height
(``derived_circles*.csv``; a cross-check, not truth). A stem is found with a diameter within 0.3 m of one of these
(simulated: of the plot, without the strip about it); one near none is false. CPU seconds are of the measuring, reading
and compiling left out, with OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1; peak memory is of the process.
"""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from treedgs_geo.pointcloud.files import read_cloud
from treedgs_lab.benchmarks.clouds.runners import HERE, circles_of, nearest, start_treedgs
from treedgs_lab.benchmarks.records import write_record

#: Cloud -> TreeX's preset for it.
CLOUDS = {
    "lidar_treels/pine_plot.laz": "tls",
    "lidar_treeiso/LPine1_demo.laz": "tls",
    "plot_a/lidar/plot_a_uls.laz": "uls",
    "plot_e/lidar/plot_e_uls.laz": "uls",
}
BH_M = 1.3
#: dendromatics for scans sparse for it: the best of some twenty settings tried by hand. The one with most stems near
#: a reference (then the smallest error) is "best settings", chosen with the reference in hand, which favours it.
SETTINGS = tuple(
    f"--stem-points {points} --section-points {section} --verticality {vertical} --height-range {height} "
    f"--rounds {rounds} --voxel {voxel} --scale {scale} --section-width {width} --least-sectors {sectors}"
    for points, section, vertical, height, rounds, voxel, scale, width, sectors in (
        (200, 20, 0.7, 0.3, 2, 0.02, 0.1, 0.05, 9),
        (60, 20, 0.7, 0.3, 1, 0.03, 0.2, 0.1, 9),
        (100, 15, 0.6, 0.5, 2, 0.03, 0.3, 0.2, 7),
        (100, 10, 0.6, 0.5, 2, 0.035, 0.3, 0.3, 5),
        (60, 10, 0.5, 0.5, 1, 0.03, 0.4, 0.4, 5),
    )
)
#: A program that needs longer than this is stopped, s.
MAX_S = 300


def truth_of(data: Path, cloud: str) -> tuple[np.ndarray, bool]:
    """(C, 4) x, y, DBH cm of the stems that are known and 1 for those of the plot, and whether they are all."""
    circles = circles_of(data, cloud)
    if circles is not None:
        return np.column_stack([circles, np.ones(len(circles))]), False
    with open(data / cloud.split("/")[0] / "truth" / "trees.csv", encoding="utf-8") as stream:
        rows = [
            [*(float(row[key]) for key in ("E_bh", "N_bh", "dbh_cm")), float(row["in_plot"] == "True")]
            for row in csv.DictReader(stream)
        ]
    return np.array(rows), True


def compare(trees: list[dict], truth: np.ndarray, whole: bool) -> dict:
    """Stems of the plot found, stems near none that is known, and errors against (C, 4) ``truth``."""
    trees = [tree for tree in trees if tree["dbh_cm"] is not None]
    found = [(nearest(trees, (x, y)), d, counts) for x, y, d, counts in truth]
    e = np.array([trees[best]["dbh_cm"] - d for best, d, counts in found if best is not None and counts])
    matched = {best for best, _, _ in found}
    return {
        "stems": len(trees),
        "known": int(truth[:, 3].sum()),
        "found": len(e),
        "false": sum(k not in matched for k in range(len(trees))) if whole else None,
        "rmse_cm": round(float(np.sqrt((e**2).mean())), 2) if len(e) else None,
        "median_abs_cm": round(float(np.median(np.abs(e))), 2) if len(e) else None,
    }


def run(script: str, python: Path, options: str, work: Path) -> dict | None:
    """What a program makes of ``work/cloud.npy``; ``None`` where it failed or took too long."""
    words: list[str | Path] = [python, HERE / script, work / "cloud.npy", work / "theirs.json", *options.split()]
    try:
        subprocess.run(words, check=True, capture_output=True, timeout=MAX_S)
    except subprocess.SubprocessError:
        return None
    return json.loads((work / "theirs.json").read_text())


def ours(work: Path) -> dict | None:
    """The same of TreeDGS."""
    if start_treedgs(work, work, bh_m=BH_M).wait():
        return None
    return json.loads((work / "cloud.json").read_text())


def figures(found: dict | None, truth: np.ndarray, whole: bool) -> dict:
    """Of one run; ``stopped`` where there is none."""
    if found is None:
        return {"stopped": f"no result after {MAX_S} s"}
    return {
        **compare(found["trees"], truth, whole),
        "cpu_seconds": round(found["cpu_seconds"], 2),
        "peak_gb": round(found["peak_gb"], 2),
        **{key: found[key] for key in ("version", "note") if found.get(key)},
    }


def main() -> None:
    """Run all on every cloud, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--their-python", type=Path, required=True)
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    record: dict = {"clouds": {}}
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        for name, preset in CLOUDS.items():
            xyz = read_cloud(args.data / name, crs=None if "plot_" in name[:5] else "local", attributes=()).xyz
            origin = np.floor(xyz.min(axis=0))
            np.save(work / "cloud.npy", xyz - origin)
            truth, whole = truth_of(args.data, name)
            truth = truth - (*origin[:2], 0.0, 0.0)
            python = args.their_python
            runs: dict = {"points": len(xyz)}
            runs["TreeDGS"] = figures(ours(work), truth, whole)
            print(name, "TreeDGS", json.dumps(runs["TreeDGS"]), flush=True)
            runs["dendromatics"] = figures(run("run_dendromatics.py", python, "", work), truth, whole)
            print(name, "dendromatics", json.dumps(runs["dendromatics"]), flush=True)
            tuned = [
                figures(run("run_dendromatics.py", python, words, work), truth, whole) | {"settings": words}
                for words in (SETTINGS if not whole else SETTINGS[3:4])
            ]
            best = max(tuned, key=lambda one: (one.get("found", -1), -(one.get("rmse_cm") or 99.0)))
            runs["dendromatics, best settings"] = best
            print(name, "best settings", json.dumps(best), flush=True)
            runs["TreeX"] = figures(run("run_treex.py", python, f"--preset {preset}", work), truth, whole)
            print(name, "TreeX", json.dumps(runs["TreeX"]), flush=True)
            record["clouds"][name] = runs
            if args.output:
                write_record(args.output, record)


if __name__ == "__main__":
    main()
