"""Stems and errors of the point-cloud route as clouds get denser: generated mobile scans with truth, and real clouds.

    git worktree add OLD 7700791 && python -m venv DENDRO && DENDRO/bin/pip install dendromatics
    python -m treedgs_lab.benchmarks.clouds.dense_clouds --data ../shared/data --before OLD
        --their-python DENDRO/bin/python \
        --output docs/results/dense_clouds.json

Each code (now; --before: a folder with a former version) runs in a process of its own on the same points, which are a
share of the cloud's, the smaller shares parts of the larger. Limits were set on even seeds of ``mobile_clouds.py``;
``--seeds`` (odd) report. A stem counts as found where a measured tree stands within 0.3 m of it; ``false``: measured
trees elsewhere. Real clouds: stems, flags, and differences from circles in a thin slab, where there are some (a
cross-check, not truth). Seconds are CPU of finding and measuring, once compiled.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np

from treedgs_geo.pointcloud.files import read_cloud
from treedgs_lab.benchmarks.clouds.mobile_clouds import MobileScan, mobile_cloud
from treedgs_lab.benchmarks.clouds.runners import REAL, known_stems, nearest, run_program, start_treedgs
from treedgs_lab.benchmarks.records import ROOT, write_record

SHARES = (1.0, 0.25, 1 / 16, 1 / 64)
#: Places in ``SHARES`` of generated and real clouds that dendromatics, slow on dense ones, is run on.
THEIR_SHARES = {"g": (1, 2), "r": (0,)}
#: It is stopped when it needs more of the processor, s.
MAX_CPU_S = 120
#: Noise and drift of the generated scans, m; walks past them and degrees that each sees: the last is a single scan.
SCANS: dict[str, dict] = {
    "SLAM, usual": {},
    "SLAM, thick": {"noise_m": 0.022, "drift_m": 0.015, "dbh_cm": (13.0, 30.0)},
    "SLAM, no drift": {"drift_m": 0.0},
    "single scan": {"noise_m": 0.005, "drift_m": 0.0, "walks": 1, "seen_deg": 150.0, "ghosts": 0.005},
}
#: Stems, metres, points on a stem of 20 cm: half a million points in all.
SIZE: dict = {"stems": 12, "size_m": 10.0, "bark": 20_000, "shrubs": 11, "saplings": 5}
#: How many of the shares real clouds are measured at.
REAL_SHARES = 2
#: Measured beside the real clouds, against the truth of rendered drone LiDAR.
RENDERED = ("plot_a", "plot_e", "plot_h")


def theirs(folder: Path, out: Path, python: Path) -> None:
    """``*.npy`` of the folder by dendromatics with its defaults, of the shares in ``THEIR_SHARES``."""
    for file in sorted(folder.glob("*.npy")):
        if int(file.stem.rsplit("-", 1)[-1]) not in THEIR_SHARES[file.stem[0]]:
            continue
        record = out / f"{file.stem}.json"
        if run_program("run_dendromatics.py", python, file, record, (), MAX_CPU_S) is None:
            record.write_text(json.dumps({"cpu_seconds": None, "trees": [], "note": "gave up"}))


def compare(found: dict, truth: np.ndarray | None) -> dict:
    """Figures of one run. truth: (S, 3) x, y, dbh_cm."""
    trees = found["trees"]
    flags = {flag: sum(t.get("flag") == flag for t in trees) for flag in ("ok", "check", "reject")}
    seconds = found["cpu_seconds"]
    result = {
        "measured": sum(t["dbh_cm"] is not None for t in trees),
        **(flags if any(flags.values()) else {}),
        "cpu_s": None if seconds is None else round(seconds, 2),
    }
    if truth is None:
        return result
    errors, inside, refused, used = [], [], 0, set()
    for x, y, dbh in truth:
        best = nearest(trees, (x, y))
        if best is None:
            continue
        tree = trees[best]
        used.add(best)
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
    """The same of real and rendered clouds."""
    truths: dict[str, np.ndarray | None] = {}
    for number, name in enumerate((*REAL, *RENDERED)):
        file = f"{name}/lidar/{name}_uls.laz" if name in RENDERED else name
        cloud = read_cloud(data / file, crs=None if name in RENDERED else "local", need_crs=False, attributes=())
        known = known_stems(data, file)[:, :3]
        truth = known if len(known) else None
        xyz = cloud.xyz
        order = np.random.default_rng(0).permutation(len(xyz))
        for k, share in enumerate(SHARES[:REAL_SHARES]):
            np.save(folder / f"r{number:02d}-{k}.npy", xyz[np.sort(order[: int(len(xyz) * share)])])
            truths[f"r{number:02d}-{k}"] = truth
    return truths


def measured(folder: Path, codes: dict[str, Path], their_python: Path | None) -> list[str]:
    """Every cloud of the folder by every code, NAME.json in a folder of the code's name; the names of the codes."""
    names = [*codes, *(["dendromatics"] if their_python else [])]
    for who in names:
        (folder / who).mkdir()
    # Side by side, so that a busy machine slows all of them alike.
    running = [start_treedgs(folder, folder / who, code) for who, code in codes.items()]
    if their_python:
        theirs(folder, folder / "dendromatics", their_python)
    if any(code != 0 for code in [process.wait() for process in running]):
        raise SystemExit("a measuring process ended with an error")
    return names


def figures_of(folder: Path, truths: dict) -> dict[str, dict]:
    """Figures of what one code found, by the name of the cloud's file."""
    found = {name: folder / f"{name}.json" for name in truths}
    return {name: compare(json.loads(file.read_text()), truths[name]) for name, file in found.items() if file.exists()}


def main() -> None:
    """Make the clouds, measure, compare, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, help="folder with lidar_* and plot_* folders; without it only generated")
    parser.add_argument("--before", type=Path, help="folder with a former version of this repository")
    parser.add_argument("--their-python", type=Path, help="interpreter of an environment with dendromatics")
    parser.add_argument("--seeds", type=int, nargs="+", default=[31])
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    codes = {"now": ROOT, **({"before": args.before.resolve()} if args.before else {})}
    record: dict = {
        "tuned_on": "even seeds",
        "scans": SCANS,
        "size": SIZE,
        "shares": SHARES,
        "generated": {},
        "real": {},
    }
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truths: dict = generated(folder, args.seeds) | (real(folder, args.data) if args.data else {})
        for who in measured(folder, codes, args.their_python):
            figures = figures_of(folder / who, truths)
            for number, scan in enumerate(SCANS):
                for k, share in enumerate(SHARES):
                    parts = [figures[key] for seed in args.seeds if (key := f"g{number}-{seed}-{k}") in figures]
                    if parts:
                        record["generated"].setdefault(scan, {}).setdefault(f"{share:.4g}", {})[who] = pooled(parts)
                        print(who, scan, f"{share:.4g}", json.dumps(pooled(parts)), flush=True)
            for number, cloud in enumerate((*REAL, *RENDERED) if args.data else ()):
                for k, share in enumerate(SHARES):
                    if (key := f"r{number:02d}-{k}") in figures:
                        record["real"].setdefault(cloud, {}).setdefault(f"{share:.4g}", {})[who] = figures[key]
                        print(who, cloud, f"{share:.4g}", json.dumps(figures[key]), flush=True)
    write_record(args.output, record, seeds=args.seeds)


if __name__ == "__main__":
    main()
