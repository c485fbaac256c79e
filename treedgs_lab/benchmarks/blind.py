"""The blind test: plots that nobody can tune to, because their seeds are drawn from the commit's own hash.

    python -m treedgs_lab.benchmarks.blind --work WORK (a clean checkout; once a commit; appends to the history)
    python -m treedgs_lab.benchmarks.blind --work WORK --trial FILE
        (small plots, any checkout; the history is not touched)

Four kinds of stand, each with photos that have a real camera's faults and a drone LiDAR cloud, both simulated.
``photos-to-dbh`` and ``pointcloud-to-dbh`` run as processes and are given nothing true. Every in-plot stem counts, also
where the chain refuses a plot; those that three photos show whole at breast height (``clear``) are counted apart.
Intervals: 95 %, plots drawn with replacement.
"""

from __future__ import annotations

import argparse
import hashlib
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from treedgs_geo.core.files import read_json, write_json
from treedgs_geo.inventory.accuracy.scores import score_against_truth
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_lab.benchmarks.plot import CLEAR_VIEWS
from treedgs_lab.benchmarks.processes import CRS, photo_inputs, simulate, words
from treedgs_lab.benchmarks.records import RESULTS, commit, made_by

HISTORY = RESULTS / "blind.json"
#: A real camera's faults, in every plot.
FAULTS = (
    "--camera flight_speed_m_s=4,gimbal_rate_deg_s=0.4,readout_ms=10,exposure_ms=1,sensor=drone,k1=-0.11,k2=0.02 "
    "--weather sun_shift_min=15,wind_sway_cm=5"
)
KINDS = {
    "open": "--stems-per-ha 450 --dbh-mean-cm 30",
    "dense": "--stems-per-ha 1000 --stand spacing=natural,shrubs_per_m2=0.3,bark_variety,hardwood_pct=30",
    "leaning": (
        "--stems-per-ha 700 --stand lean_max_deg=12,strong_leans=2,forks_above_bh=1,forks_below_bh=1,"
        "touching_saplings=2,ellipticity_pct=10"
    ),
    "few photos": "--stems-per-ha 700 --photos 18",
}
#: Plots of each kind.
PLOTS = 3
SIZE = "--preset demo --radius-m 7.5 --photos 62 --camera samples=2"
TRIAL_SIZE = "--preset test --camera samples=1"
DRAWS = 2000


def seed_of(version: str, kind: str, number: int) -> int:
    """The seed of a plot: not known before the code is committed."""
    return int(hashlib.sha256(f"{version} {kind} {number}".encode()).hexdigest()[:7], 16)


def measured(folder: Path, work: Path, source: str) -> dict[str, Any]:
    """One chain on one plot: ``stems`` (a row a stem of the truth), ``false``, ``refused`` (exit status, 0: none).

    Raises:
        SystemExit: the run was stopped, lacked memory or a part.
    """
    layer = work / f"{folder.name}_{source}.gpkg"
    if source == "photos":
        inputs = ["photos-to-dbh", *photo_inputs(folder), "--workspace", work / f"{folder.name}_ws"]
    else:
        cloud = next((folder / "lidar").glob("*.laz"))
        inputs = ["pointcloud-to-dbh", "--input", cloud, "--crs", CRS, "--plots", folder / "plots.csv"]
    code = subprocess.run(words(*inputs, "--output", layer, "--log-format", "quiet")).returncode
    truth = folder / "truth" / "trees.csv"
    if code not in (0, 1, 2):  # stopped, no memory, a part is missing: that says nothing of the method
        raise SystemExit(f"{folder.name}, {source}: ended with {code}; run again, finished plots are kept")
    if code:
        whole = pd.read_csv(truth)
        stems = whole[whole["in_plot"].astype(str).str.lower() == "true"].assign(error_cm=np.nan, qc_flag="refused")
        stems["clear_views"] = stems["n_unoccluded_bh_views"]
        return {"stems": stems, "false": 0, "refused": code}
    accuracy, stems = score_against_truth(read_trees(layer), truth)
    return {"stems": stems, "false": accuracy.n_false, "refused": 0}


def figures(plots: list[pd.DataFrame], flag: str | None = None) -> dict[str, Any]:
    """Counts and errors over plots, with intervals over plots where there are several. flag: of such trees alone."""
    errors = [_errors(stems, flag) for stems in plots]
    seen = [stems[stems["clear_views"] >= CLEAR_VIEWS] for stems in plots]
    found = {
        "stems": sum(map(len, plots)),
        "measured": sum(len(one) for one in errors),
        "clear": sum(map(len, seen)),
        "clear_measured": sum(len(_errors(stems, flag)) for stems in seen),
        **_figures(errors),
    }
    if len(plots) > 1 and found["measured"]:
        random = np.random.default_rng(0)
        drawn = pd.DataFrame(
            [_figures([errors[k] for k in random.integers(0, len(errors), len(errors))]) for _ in range(DRAWS)]
        )
        for name in ("rmse_cm", "bias_cm", "inside"):
            low, high = drawn[name].dropna().quantile([0.025, 0.975])
            found |= {f"{name}_lo": round(float(low), 3), f"{name}_hi": round(float(high), 3)}
    return found


def _errors(stems: pd.DataFrame, flag: str | None) -> np.ndarray:
    """(K, 3) error in cm, and whether the interval and 0.67 standard errors (half of the stems, if normal) hold it."""
    kept = stems[stems["error_cm"].notna() & ((stems["qc_flag"] == flag) if flag else True)]
    kept = kept.reindex(columns=["error_cm", "inside_90", "dbh_se_cm"]).astype(float)
    half = kept["error_cm"].abs() <= 0.67 * kept["dbh_se_cm"]
    return np.column_stack([kept[["error_cm", "inside_90"]], half])


def _figures(errors: list[np.ndarray]) -> dict[str, Any]:
    whole = np.concatenate(errors)
    if not len(whole):
        return dict.fromkeys(("rmse_cm", "bias_cm", "worst_cm", "inside", "inside_half"))
    error, inside, half = whole.T
    return {
        "rmse_cm": round(float(np.sqrt((error**2).mean())), 3),
        "bias_cm": round(float(error.mean()), 3),
        "worst_cm": round(float(np.abs(error).max()), 2),
        "inside": round(float(inside.mean()), 3),
        "inside_half": round(float(half.mean()), 3),
    }


def run(version: str, work: Path, size: str, plots: int) -> dict[str, Any]:
    """All plots through both chains: a row of the history."""
    found: dict[str, list[pd.DataFrame]] = {"photos": [], "clouds": []}
    false = dict.fromkeys(found, 0)
    rows = []
    for kind in KINDS:
        for number in range(plots):
            seed = seed_of(version, kind, number)
            folder = work / f"{kind.replace(' ', '_')}_{seed}"
            simulate(folder, [*shlex.split(f"{size} {FAULTS} {KINDS[kind]}"), "--seed", seed])
            row: dict[str, Any] = {"kind": kind, "seed": seed}
            for source in found:
                one = measured(folder, work, source)
                found[source].append(one["stems"])
                false[source] += one["false"]
                row[source] = {**figures([one["stems"]]), "false": one["false"], "refused": one["refused"]}
            print(row, flush=True)
            rows.append(row)
    pooled = {
        source: {"all": {**figures(stems), "false": false[source]}, "ok": figures(stems, "ok")}
        for source, stems in found.items()
    }
    return {**made_by([row["seed"] for row in rows]), "commit": version, "plots": rows, **pooled}


def main() -> int:
    """Run, and append to the history."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, required=True, help="folder of plots and workspaces; a run goes on there")
    parser.add_argument("--trial", type=Path, help="small plots, one of each kind; the row goes to this file")
    options = parser.parse_args()
    version = commit()
    if options.trial:
        row = run(version, options.work, TRIAL_SIZE, 1)
        write_json(options.trial, {"rows": [row]})
        return 0
    history = read_json(HISTORY)
    if not version or version.endswith("-changed"):
        raise SystemExit("the code differs from its commit; commit first: seeds are drawn from the commit's hash")
    if version in {row["commit"] for row in history["rows"]}:
        raise SystemExit(f"commit {version} has its row; a blind test is run once")
    row = run(version, options.work, SIZE, PLOTS)
    write_json(HISTORY, {"made_by": made_by(row["seeds"]), "rows": [*history["rows"], row]})
    return 0


if __name__ == "__main__":
    sys.exit(main())
