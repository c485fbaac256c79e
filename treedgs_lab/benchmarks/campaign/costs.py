"""What plots cost: fit the campaign's cost model to finished runs, check it on runs it has not seen, 10,000 plots.

    python -m treedgs_lab.benchmarks.campaign.costs --thin ../shared/data/plot_a --scratch build/campaign_costs
    python -m treedgs_lab.benchmarks.campaign.costs --runs build/campaign/same build/campaign_costs/work

The first makes photo plots of different sizes out of one (every second, every third … photo) and runs them as a
campaign. The second reads the tables (``plots.csv``) of finished campaigns and writes
``docs/results/campaign_costs.json`` (routes without new runs stay as they are there) and, with --ship, the figures that
TreeDGS comes with. Seconds are processor seconds of single-threaded plots, which other programs change little; on an
idle machine they are the seconds on the clock.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from treedgs_geo.core.costs import FEATURES, MEASURES, CostModel, fit
from treedgs_lab.benchmarks.records import RESULTS, ROOT, write_record
from treedgs_lab.benchmarks.verbs import CRS, words

#: Plots of an inventory, for the arithmetic: the plots of the README's table.
TYPICAL = {"photos": {"photos": 62, "megapixels": 76.2}, "cloud": {"points_m": 1.0}}


def thin(plot: Path, scratch: Path, steps: list[int]) -> int:
    """Photo plots with every k-th photo of ``plot``, as one campaign."""
    photos = sorted((plot / "images").iterdir())
    rows = []
    for step in steps:
        folder = scratch / f"every{step}"
        folder.mkdir(parents=True, exist_ok=True)
        for photo in photos[::step]:
            if not (folder / photo.name).exists():
                os.symlink(photo.resolve(), folder / photo.name)
        name = f"{plot.name}_{len(photos[::step])}"
        circle = (plot / "plots.csv").read_text(encoding="utf-8").replace(plot.name, name)
        (scratch / f"{name}.csv").write_text(circle, encoding="utf-8")
        rows.append(
            {
                "plot_id": name,
                "photos": folder,
                "geotags": plot.resolve(),
                "plots": scratch / f"{name}.csv",
                "crs": CRS,
            }
        )
    with open(scratch / "plots.csv", "w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    places = ["--manifest", scratch / "plots.csv", "--workspace", scratch / "work"]
    return subprocess.run(words("campaign", *places, "--workers", 2), cwd=ROOT).returncode


def runs_of(folders: list[Path]) -> list[dict]:
    """Finished plots, from the tables and records of campaigns; one that resumed costs what all its attempts took."""
    found = []
    for folder in folders:
        with open(folder / "plots.csv", newline="", encoding="utf-8-sig") as stream:
            for row in csv.DictReader(stream):
                if row["state"] != "done":
                    continue
                attempts = json.loads((folder / "plots" / row["plot_id"] / "plot.json").read_text())["attempts"]
                if not all(attempt.get("cpu_s") for attempt in attempts):
                    continue
                sizes = ("photos", "megapixels", "points_m", "n_trees", "disk_gb")
                numbers = {name: float(row[name]) for name in sizes}
                found.append(
                    {
                        "plot_id": row["plot_id"],
                        "route": row["route"],
                        "attempts": len(attempts),
                        "seconds": round(sum(attempt["cpu_s"] for attempt in attempts), 2),
                        "memory_gb": max(attempt["peak_gb"] for attempt in attempts),
                        **numbers,
                    }
                )
    return found


def check(runs: list[dict], features: tuple[str, ...]) -> dict:
    """Each run predicted from the others: factors between prediction and run, and the error of the sum."""
    errors: dict[str, list[float]] = {name: [] for name in MEASURES}
    sums = {name: [0.0, 0.0] for name in MEASURES}
    for left in range(len(runs)):
        entry = fit(runs[:left] + runs[left + 1 :], features)
        x = np.array([1.0, *(runs[left][name] for name in features)])
        for name in MEASURES:
            predicted = max(float(x @ np.array(entry[name])), 1e-6)
            errors[name].append(predicted / runs[left][name])
            sums[name][0] += predicted
            sums[name][1] += runs[left][name]
    return {
        name: {
            "median_factor": round(float(np.exp(np.median(np.abs(np.log(values))))), 2),
            "worst_factor": round(float(np.exp(np.max(np.abs(np.log(values))))), 2),
            "sum_error_pct": round(100 * (sums[name][0] / sums[name][1] - 1), 1),
        }
        for name, values in errors.items()
    }


def with_kept(found: dict, path: Path) -> None:
    """Add the routes that have no new runs as the record at ``path`` has them, and say since when."""
    if not path.exists():
        return
    former = json.loads(path.read_text(encoding="utf-8"))
    for route, figures in former["routes"].items():
        if route not in found["routes"]:
            since = {name: former["made_by"][name] for name in ("version", "date")}
            found["routes"][route] = {"kept_from": since, **figures}
            found["runs"] += [run for run in former["runs"] if run["route"] == route]


def main() -> int:
    """Make runs, or fit and check them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--thin", type=Path)
    parser.add_argument("--steps", type=int, nargs="+", default=[1, 2, 3], help="every how many-th photo")
    parser.add_argument("--scratch", type=Path, default=ROOT / "build" / "campaign_costs")
    parser.add_argument("--runs", type=Path, nargs="*", default=[])
    parser.add_argument("--ship", action="store_true", help="write treedgs_geo/core/costs.json")
    given = parser.parse_args()
    given.scratch = given.scratch.resolve()
    if given.thin:
        return thin(given.thin, given.scratch, given.steps)
    runs = runs_of(given.runs)
    found: dict = {"routes": {}}
    routes = CostModel.load().routes
    for route, features in FEATURES.items():
        mine = [run for run in runs if run["route"] == route]
        if len(mine) <= len(features):
            continue
        routes[route] = fit(mine, features)
        found["routes"][route] = {"model": routes[route]}
        if len(mine) > len(features) + 1:
            found["routes"][route]["left_one_out"] = check(mine, features)
        if len(mine) > len(features) + 3:
            # Trees are known only afterwards: what they would have added to the sizes.
            found["routes"][route]["left_one_out_with_trees"] = check(mine, (*features, "n_trees"))
    model = CostModel(routes)
    for route in found["routes"]:
        need = model.predict(route, TYPICAL[route])
        hours = 10_000 * need.seconds / 3600
        found["routes"][route]["ten_thousand_plots"] = {
            "plot": TYPICAL[route],
            "seconds_a_plot": round(need.seconds),
            "core_hours": round(hours),
            "days_on_8_cores": round(hours / 8 / 24, 1),
            "hours_on_500_cores": round(hours / 500, 1),
            "declared_gb_a_plot": round(need.memory_gb, 2),
            "disk_gb": round(10_000 * need.disk_gb),
        }
    found["runs"] = runs
    with_kept(found, RESULTS / "campaign_costs.json")
    print(json.dumps({name: value for name, value in found.items() if name != "runs"}, indent=1))
    write_record(RESULTS / "campaign_costs.json", found)
    if given.ship:
        model.save(ROOT / "treedgs_geo" / "core" / "costs.json")
    return 0


if __name__ == "__main__":
    sys.exit(main())
