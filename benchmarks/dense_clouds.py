"""Stems and errors of the point-cloud route as clouds get denser: generated mobile scans with truth, and real clouds.

    git archive 7700791 | tar x -C OLD && python -m venv DENDRO && DENDRO/bin/pip install dendromatics
    python benchmarks/dense_clouds.py --data ../shared/data --before OLD --their-python DENDRO/bin/python \
        --output docs/results/dense_clouds.json

Each code (now; --before: a folder with a former version) runs in a process of its own on the same points, which are a
share of the cloud's, the smaller shares parts of the larger. Limits were set on even seeds of ``mobile_clouds.py``;
``--seeds`` (odd) report. A stem counts as found where a measured tree stands within 0.3 m of it; ``false``: measured
trees elsewhere. Real clouds: stems, flags, and differences from circles in a thin slab, where there are some (a
cross-check, not truth). Seconds are CPU of finding and measuring, once compiled.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
SHARES = (1.0, 0.25, 1 / 16, 1 / 64)
MATCH_M = 0.3
#: Places in ``SHARES`` of generated and real clouds that dendromatics, slow on dense ones, is run on.
THEIR_SHARES = {"g": (1, 2), "r": (0,)}
#: Noise and drift of the generated scans, m; walks past them and degrees that each sees: the last is a single scan.
SCANS = {
    "SLAM, usual": {},
    "SLAM, thick": {"noise_m": 0.022, "drift_m": 0.015, "dbh_cm": (13.0, 30.0)},
    "SLAM, no drift": {"drift_m": 0.0},
    "single scan": {"noise_m": 0.005, "drift_m": 0.0, "walks": 1, "seen_deg": 150.0, "ghosts": 0.005},
}
#: Stems, metres, points on a stem of 20 cm: half a million points in all.
SIZE = {"stems": 12, "size_m": 10.0, "bark": 20_000, "shrubs": 11, "saplings": 5}
#: How many of the shares real clouds are measured at.
REAL_SHARES = 2
REAL = {
    "lidar_treels/pine_plot.laz": "lidar_treels/derived_circles_pine_plot.csv",
    "lidar_treeiso/LPine1_demo.laz": "lidar_treeiso/derived_circles.csv",
    "lidar_treels/pine.laz": None,
    "lidar_treels/spruce.laz": None,
    "lidar_itsme/tree_1_pc.txt": None,
    "lidar_itsme/tree_2_pc.txt": None,
    "lidar_itsme/buttressed_tree_1_pc.txt": None,
    "lidar_itsme/buttressed_tree_2_pc.txt": None,
    "lidar_itsme/pc_tree_uav.txt": None,
    "lidar_spanner/UAS_Clip.laz": None,
    "plot_a": None,
    "plot_e": None,
    "plot_h": None,
}


def ours(folder: Path, out: Path, code: Path) -> None:
    """``*.npy`` of the folder measured by the code in ``code``: FILE.json in ``out``. The first is done twice."""
    sys.path.insert(0, str(code))
    from treedgs_geo.from_points.measuring.cloud import MeasureOptions, measure_cloud
    from treedgs_geo.pointcloud.cloud import PointCloud
    from treedgs_geo.terrain.ground import dtm_from_cloud, flat_ground

    files = sorted(folder.glob("*.npy"))
    for file in [files[0], *files]:
        xyz = np.load(file)
        try:
            dtm = dtm_from_cloud(xyz)
        except Exception:  # a cut-out tree: its lowest points stand in for the ground
            dtm = flat_ground(xyz)
        began = time.process_time()
        trees, _ = measure_cloud(PointCloud(xyz), dtm, MeasureOptions())
        record = {
            "cpu_seconds": time.process_time() - began,
            "trees": [
                {
                    "x": t.x,
                    "y": t.y,
                    "dbh_cm": t.dbh_cm,
                    "lo": t.dbh_lo_cm,
                    "hi": t.dbh_hi_cm,
                    "flag": t.qc_flag,
                    "reason": t.qc_reason,
                }
                for t in trees
            ],
        }
        (out / f"{file.stem}.json").write_text(json.dumps(record))


def theirs(folder: Path, out: Path, python: str) -> None:
    """The same by dendromatics with its defaults, of the shares in ``THEIR_SHARES``."""
    for file in sorted(folder.glob("*.npy")):
        if int(file.stem.rsplit("-", 1)[-1]) not in THEIR_SHARES[file.stem[0]]:
            continue
        record = out / f"{file.stem}.json"
        words = [python, str(ROOT / "benchmarks" / "run_dendromatics.py"), str(file), str(record)]
        try:
            subprocess.run(words, check=True, capture_output=True, timeout=120)
        except subprocess.SubprocessError:
            record.write_text(json.dumps({"cpu_seconds": None, "trees": [], "note": "gave up"}))


def compare(found: dict, truth: np.ndarray | None) -> dict:
    """Figures of one run. truth: (S, 3) x, y, dbh_cm."""
    trees = found["trees"]
    measured = [t for t in trees if t["dbh_cm"] is not None]
    flags = {flag: sum(t.get("flag") == flag for t in trees) for flag in ("ok", "check", "reject")}
    seconds = found["cpu_seconds"]
    result = {
        "measured": len(measured),
        **({k: v for k, v in flags.items()} if any(flags.values()) else {}),
        "cpu_s": None if seconds is None else round(seconds, 2),
    }
    if truth is None:
        return result
    places = np.array([[t["x"], t["y"]] for t in trees]).reshape(-1, 2)
    errors, inside, refused, used = [], [], 0, set()
    for x, y, dbh in truth:
        gap = np.hypot(places[:, 0] - x, places[:, 1] - y)
        if not len(gap) or gap.min() > MATCH_M:
            continue
        tree = trees[int(gap.argmin())]
        used.add(int(gap.argmin()))
        if tree["dbh_cm"] is None:
            refused += 1
            continue
        errors.append(tree["dbh_cm"] - dbh)
        if tree.get("lo") is not None:
            inside.append(tree["lo"] <= dbh <= tree["hi"])
    e = np.array(errors)
    elsewhere = [t for k, t in enumerate(trees) if k not in used]
    return {
        **result,
        "stems": len(truth),
        "found": len(e),
        "refused": refused,
        "neither": len(truth) - len(e) - refused,
        "rmse_cm": round(float(np.sqrt(np.mean(e**2))), 2) if len(e) else None,
        "me_cm": round(float(e.mean()), 2) if len(e) else None,
        "worst_cm": round(float(np.abs(e).max()), 2) if len(e) else None,
        "in_90pct_interval": round(float(np.mean(inside)), 2) if inside else None,
        "false": sum(t["dbh_cm"] is not None for t in elsewhere),
        "false_ok": sum(t.get("flag") == "ok" for t in elsewhere),
        "false_reject": sum(t["dbh_cm"] is None for t in elsewhere),
    }


def pooled(parts: list[dict]) -> dict:
    """Sums over seeds; errors and coverage weighted by the stems found."""

    def weighted(name: str, power: int = 1) -> float | None:
        known = [(p["found"], p[name]) for p in parts if p.get(name) is not None]
        total = sum(n for n, _ in known)
        return (sum(n * value**power for n, value in known) / total) ** (1 / power) if total else None

    sums = {
        name: sum(p[name] for p in parts)
        for name in ("stems", "found", "refused", "neither", "false", "false_ok", "false_reject")
    }
    means = {name: weighted(name, power) for name, power in (("rmse_cm", 2), ("me_cm", 1), ("in_90pct_interval", 1))}
    spent = [p["cpu_s"] for p in parts if p["cpu_s"] is not None]
    return {
        **sums,
        **{k: None if v is None else round(v, 2) for k, v in means.items()},
        "worst_cm": max((p["worst_cm"] for p in parts if p["worst_cm"] is not None), default=None),
        "cpu_s": round(sum(spent), 2) if spent else None,
    }


def generated(folder: Path, seeds: list[int]) -> dict[str, np.ndarray]:
    """Clouds of every scan, seed and share in the folder; their truths by the names of the files."""
    from mobile_clouds import MobileScan, mobile_cloud

    truths = {}
    for number, scan in enumerate(SCANS.values()):
        for seed in seeds:
            cloud = mobile_cloud(seed, MobileScan(**{**SIZE, **scan}))
            for k, share in enumerate(SHARES):
                name = f"g{number}-{seed}-{k}"
                np.save(folder / f"{name}.npy", cloud.thinned(share))
                truths[name] = cloud.trees
    return truths


def real(folder: Path, data: Path) -> dict[str, np.ndarray | None]:
    from treedgs_geo.pointcloud.files import read_cloud

    truths: dict[str, np.ndarray | None] = {}
    for number, (name, circles) in enumerate(REAL.items()):
        file = data / name if not name.startswith("plot") else next((data / name / "lidar").glob("*.laz"))
        xyz = read_cloud(file, crs=None if name.startswith("plot") else "local", need_crs=False, attributes=()).xyz
        truth = None
        if circles is not None:
            with open(data / circles, encoding="utf-8") as stream:
                truth = np.array([[float(r[k]) for k in ("x", "y", "d_cm")] for r in csv.DictReader(stream)])
        elif name.startswith("plot"):
            with open(data / name / "truth" / "trees.csv", encoding="utf-8") as stream:
                truth = np.array([[float(r[k]) for k in ("E_bh", "N_bh", "dbh_cm")] for r in csv.DictReader(stream)])
        order = np.random.default_rng(0).permutation(len(xyz))
        for k, share in enumerate(SHARES[:REAL_SHARES]):
            np.save(folder / f"r{number:02d}-{k}.npy", xyz[np.sort(order[: int(len(xyz) * share)])])
            truths[f"r{number:02d}-{k}"] = truth
    return truths


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, help="folder with lidar_* and plot_* folders; without it only generated")
    parser.add_argument("--before", type=Path, help="folder with a former version of this repository")
    parser.add_argument("--their-python", help="interpreter of an environment with dendromatics")
    parser.add_argument("--seeds", type=int, nargs="+", default=[31])
    parser.add_argument("--output", type=Path)
    parser.add_argument("--code", nargs=3, type=Path, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.code:
        ours(*args.code)
        return
    sys.path.insert(0, str(ROOT))
    codes = {"now": ROOT, **({"before": args.before} if args.before else {})}
    record: dict = {
        "machine": f"{platform.machine()}, {os.cpu_count()} cores",
        "python": platform.python_version(),
        "seeds": args.seeds,
        "tuned_on": "even seeds",
        "scans": SCANS,
        "size": SIZE,
        "shares": SHARES,
        "generated": {},
        "real": {},
    }
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truths: dict = generated(folder, args.seeds)
        if args.data:
            truths |= real(folder, args.data)
        # Side by side, so that a busy machine slows all of them alike.
        running = []
        for who, code in codes.items():
            (folder / who).mkdir()
            running.append(
                subprocess.Popen(
                    [sys.executable, __file__, "--code", str(folder), str(folder / who), str(code)],
                    env={**os.environ, "PYTHONPATH": str(code)},
                )
            )
        if args.their_python:
            (folder / "dendromatics").mkdir()
            theirs(folder, folder / "dendromatics", args.their_python)
        if any(process.wait() for process in running):
            raise SystemExit("a measuring process ended with an error")
        for who in [*codes, *(["dendromatics"] if args.their_python else [])]:
            figures = {
                name: compare(json.loads((folder / who / f"{name}.json").read_text()), truth)
                for name, truth in truths.items()
                if (folder / who / f"{name}.json").exists()
            }
            for number, scan in enumerate(SCANS):
                for k, share in enumerate(SHARES):
                    parts = [figures[name] for seed in args.seeds if (name := f"g{number}-{seed}-{k}") in figures]
                    if parts:
                        record["generated"].setdefault(scan, {}).setdefault(f"{share:.4g}", {})[who] = pooled(parts)
                        print(who, scan, f"{share:.4g}", json.dumps(pooled(parts)), flush=True)
            for number, cloud in enumerate(REAL if args.data else ()):
                for k, share in enumerate(SHARES):
                    if (name := f"r{number:02d}-{k}") in figures:
                        record["real"].setdefault(cloud, {}).setdefault(f"{share:.4g}", {})[who] = figures[name]
                        print(who, cloud, f"{share:.4g}", json.dumps(figures[name]), flush=True)
    if args.output:
        args.output.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
