"""TreeDGS, 3DFin, dendromatics (its engine), TreeX (pointtree) and PyTLidar on the same clouds, each in a process of
its own.

    python -m venv RIVALS && RIVALS/bin/pip install dendromatics 3DFin pointtree torch torch-scatter
    python -m venv PYTLIDAR && PYTLIDAR/bin/pip install pytlidar
    python -m treedgs_lab.benchmarks.clouds.side_by_side --data ../shared/data --their-python RIVALS/bin/python \
        --pytlidar-python PYTLIDAR/bin/python --output docs/results/side_by_side.json

Every program with its defaults (TreeX: its preset for the kind of cloud), dendromatics with settings for scans sparser
than it is made for, PyTLidar, which finds no trees itself, with each known stem of a dense scan cut out for it. Real
scans; rendered drone LiDAR, also thinned; and simulated terrestrial and mobile scans. Truth: the trees of the simulated
plots; for real scans circles in a thin slab at breast height (``derived_circles*.csv``; a cross-check, not truth). A
stem is found with a diameter within 0.3 m of one of these (simulated: of the plot, without the strip about it); one
near none is false. CPU seconds are of the measuring, reading left out (ours: compiling too), with OMP_NUM_THREADS=1
NUMBA_NUM_THREADS=1; peak memory is of the process.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from treedgs_geo.pointcloud.files import read_cloud
from treedgs_lab.benchmarks.clouds.mobile_clouds import BH_M as SIMULATED_BH_M
from treedgs_lab.benchmarks.clouds.mobile_clouds import MobileScan, mobile_cloud
from treedgs_lab.benchmarks.clouds.runners import known_stems, nearest, run_program, start_treedgs
from treedgs_lab.benchmarks.records import write_record

#: Cloud -> TreeX's preset for it, and the points a square metre that it is thinned to (0 = as it is).
CLOUDS: dict[str, tuple[str, int]] = {
    "lidar_treels/pine_plot.laz": ("tls", 0),
    "lidar_treeiso/LPine1_demo.laz": ("tls", 0),
    "plot_a/lidar/plot_a_uls.laz": ("uls", 0),
    "plot_e/lidar/plot_e_uls.laz": ("uls", 0),
    "plot_h/lidar/plot_h_uls.laz": ("uls", 0),
    "plot_a at 1000": ("uls", 1000),
    "plot_a at 200": ("uls", 200),
    "plot_a at 50": ("uls", 50),
}
#: Simulated scans of twelve stems, see :mod:`.mobile_clouds`.
_STAND = MobileScan(stems=12, size_m=12.0, saplings=6, shrubs=10)
SCANS = {
    "TLS, four scans": replace(_STAND, noise_m=0.004, drift_m=0.0),
    "TLS, one scan": replace(_STAND, noise_m=0.004, drift_m=0.0, walks=1),
    "MLS, drift of 1 cm": _STAND,
}
SEED = 5
BH_M = 1.3
#: Settings of dendromatics for sparse scans: of some twenty tried by hand on ``pine_plot`` those with most stems.
SPARSE = (
    "--stem-points 60 --section-points 10 --verticality 0.5 --height-range 0.5 --rounds 1 --voxel 0.03 --scale 0.4 "
    "--section-width 0.4 --least-sectors 5"
)
#: A program that needs more of the processor than this is stopped, s.
MAX_CPU_S = 200


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


def ours(work: Path) -> dict | None:
    """The same of TreeDGS."""
    if start_treedgs(work, work, bh_m=BH_M).wait():
        return None
    return json.loads((work / "cloud.json").read_text())


def figures(found: dict | None, truth: np.ndarray, whole: bool) -> dict:
    """Of one run; ``stopped`` where there is none."""
    if found is None:
        return {"stopped": f"no result after {MAX_CPU_S} s of the processor"}
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
    parser.add_argument("--pytlidar-python", type=Path, required=True)
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    record: dict = {"clouds": {}}
    with tempfile.TemporaryDirectory() as folder:
        work, given = Path(folder), Path(folder) / "given"
        given.mkdir()
        for name, preset, xyz, truth, whole in clouds(args.data):
            np.save(work / "cloud.npy", xyz)
            np.save(given / "places.npy", truth[truth[:, 3] > 0, :2])
            programs: dict[str, tuple[str, Path, list]] = {
                "3DFin": ("run_3dfin.py", args.their_python, []),
                "dendromatics, sparse": ("run_dendromatics.py", args.their_python, SPARSE.split()),
                "TreeX": ("run_treex.py", args.their_python, ["--preset", preset]),
            }
            if preset == "tls":
                places = ["--places", given / "places.npy"]
                programs["PyTLidar, stems cut out"] = ("run_pytlidar.py", args.pytlidar_python, places)
            runs: dict = {"points": len(xyz), "TreeDGS": figures(ours(work), truth, whole)}
            for program, (script, python, options) in programs.items():
                found = run_program(script, python, work / "cloud.npy", work / "theirs.json", options, MAX_CPU_S)
                runs[program] = figures(found, truth, whole)
            print(name, json.dumps(runs, indent=1), flush=True)
            record["clouds"][name] = runs
            if args.output:
                write_record(args.output, record)


def clouds(data: Path) -> Iterator[tuple[str, str, np.ndarray, np.ndarray, bool]]:
    """Name, TreeX's preset, (N, 3) points near zero, (C, 4) known stems and whether these are all, of each cloud."""
    for name, (preset, per_m2) in CLOUDS.items():
        file = name if not per_m2 else "plot_a/lidar/plot_a_uls.laz"
        xyz = read_cloud(data / file, crs=None if "plot_" in file[:5] else "local", attributes=()).xyz
        if per_m2:
            area = float(np.prod(np.ptp(xyz[:, :2], axis=0)))
            xyz = np.random.default_rng(SEED).permutation(xyz)[: int(per_m2 * area)]
        origin = np.floor(xyz.min(axis=0))
        truth, whole = known_stems(data, file), file.startswith("plot_")
        yield name, preset, xyz - origin, truth - (*origin[:2], 0.0, 0.0), whole
    for name, scan in SCANS.items():
        cloud = mobile_cloud(SEED, scan)
        taper = 0.9 * (SIMULATED_BH_M - BH_M)
        truth = np.column_stack([cloud.trees + (0.0, 0.0, taper), np.ones(len(cloud.trees))])
        yield name, "tls", cloud.xyz - (0.0, 0.0, 90.0), truth, True


if __name__ == "__main__":
    main()
