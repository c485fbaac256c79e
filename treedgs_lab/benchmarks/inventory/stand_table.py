"""Stand tables from simulated surveys of a known stand: bias, and whether the intervals hold the truth.

    python -m treedgs_lab.benchmarks.inventory.stand_table --surveys 100 --plots 3 12 --sigmas 0.5 4.79 \
        --output docs/results/stand_table.json

The stand: 16 ha of loblolly pine, 400 stems a hectare on average, denser and thinner in patches of some 40 m. A survey
drops plots of 12 m radius anywhere in it and measures every stem in them with a random error, a bias that the survey's
DBHs share (0.2 cm standard error, as ``stand-table`` assumes), a height for half of them, and no DBH for one in
sixteen. The estimate never sees what is true of the whole stand. Nothing was tuned on these surveys.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj
from shapely.geometry import Point, box

from treedgs_geo.inventory.stand.equations import read_equations
from treedgs_geo.inventory.stand.expansion import expand
from treedgs_geo.inventory.stand.sample import SamplePlot
from treedgs_geo.inventory.stand.survey import make_stand
from treedgs_geo.inventory.stand.treelist import COLUMNS, TreeList
from treedgs_geo.inventory.stand.values import BA, ValueOptions
from treedgs_lab.benchmarks.records import write_record

SIDE_M, RADIUS_M, COMMON_CM = 400.0, 12.0, 0.2
PLOTS, SIGMAS_CM = (3, 6, 12, 24), (0.5, 2.0, 4.79)
CRS = pyproj.CRS.from_epsg(26915)


def make_population(seed: int = 0) -> pd.DataFrame:
    """The stand: ``x, y, dbh, height``."""
    rng = np.random.default_rng(seed)
    waves = rng.normal(size=(12, 2)) / 40.0
    phases = rng.uniform(0, 2 * np.pi, 12)
    xy = rng.uniform(0, SIDE_M, (40000, 2))
    field = np.cos(xy @ waves.T * 2 * np.pi + phases).mean(axis=1)
    xy = xy[rng.random(len(xy)) < np.clip(0.16 * np.exp(1.6 * field), 0, 1)]
    field = np.cos(xy @ waves.T * 2 * np.pi + phases).mean(axis=1)
    dbh = np.clip(rng.normal(26 - 5 * field, 6), 8, 60)
    height = 1.37 + (dbh / (1.5 + 0.19 * dbh)) ** 2 + rng.normal(0, 1.0, len(dbh))
    return pd.DataFrame({"x": xy[:, 0], "y": xy[:, 1], "dbh": dbh, "height": height})


def truth_of(population: pd.DataFrame, book: list) -> dict[str, float]:
    """Per hectare, from the true DBHs."""
    volume = next(e for e in book if e.id == "nsvb-vob-pita-natural")
    area = SIDE_M**2 / 1e4
    ba = BA * population["dbh"] ** 2
    return {
        "trees": len(population) / area,
        "ba": float(ba.sum() / area),
        "volume": float(volume.value(population["dbh"].to_numpy(), population["height"].to_numpy()).sum() / area),
        "qmd": float(np.sqrt((population["dbh"] ** 2).mean())),
        "lorey": float(np.average(population["height"], weights=ba)),
    }


def survey(population: pd.DataFrame, n_plots: int, sigma: float, seed: int, book: list):
    """One survey, estimated."""
    rng = np.random.default_rng(seed)
    outline = box(0, 0, SIDE_M, SIDE_M)
    plots = []
    for k, (x, y) in enumerate(rng.uniform(0, SIDE_M, (n_plots, 2))):
        area = np.pi * RADIUS_M**2 / 1e4
        plots.append(
            SamplePlot(str(k), "circle", area, x, y, RADIUS_M, Point(x, y).buffer(RADIUS_M, 64), 0.0, 1.0, area)
        )
    near = np.zeros(len(population), bool)
    place = population[["x", "y"]].to_numpy()
    for plot in plots:
        near |= np.hypot(*(place - [plot.x, plot.y]).T) <= RADIUS_M + 1
    seen = population[near]
    n = len(seen)
    blind = rng.random(n) < 1 / 16
    measured = np.maximum(seen["dbh"] + rng.normal(0, sigma, n) + rng.normal(0, COMMON_CM), 1.0)
    table = pd.DataFrame(
        {
            **dict.fromkeys(COLUMNS),
            "tree_id": np.arange(n),
            "x": seen["x"].to_numpy(),
            "y": seen["y"].to_numpy(),
            "dbh_cm": np.where(blind, np.nan, measured),
            "dbh_se_cm": np.where(blind, np.nan, sigma),
            "height_m": np.where(rng.random(n) < 0.5, seen["height"], np.nan),
            "species": "PITA",
            "dead": False,
            "qc_flag": np.where(blind, "reject", "ok"),
            "qc_reason": np.where(blind, "few_views", ""),
        }
    )[list(COLUMNS)]
    trees = TreeList(table, CRS, False)
    return make_stand(trees, expand(trees, plots, outline, "zone", 0.0), book, ValueOptions(common_se_cm=COMMON_CM))


def main() -> None:
    """Run all cases and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--surveys", type=int, default=300)
    parser.add_argument("--plots", type=int, nargs="+", default=PLOTS, help="plots a survey")
    parser.add_argument("--sigmas", type=float, nargs="+", default=SIGMAS_CM, help="random errors of DBH, cm")
    parser.add_argument("--output", type=Path, required=True)
    chosen = parser.parse_args()
    book, population = read_equations(), make_population()
    truth = truth_of(population, book)
    rows, began = [], time.perf_counter()
    for sigma in chosen.sigmas:
        for n_plots in chosen.plots:
            made = [survey(population, n_plots, sigma, 1000 * n_plots + s, book) for s in range(chosen.surveys)]
            row: dict = {"plots": n_plots, "sigma_cm": sigma, "surveys": len(made)}
            for name, true in truth.items():
                found = [m.estimates[name] for m in made if np.isfinite(m.estimates[name].low)]
                if not found:
                    continue
                means = np.array([e.mean for e in found])
                row[name] = {
                    "bias_pct": round(100 * (means.mean() - true) / true, 2),
                    "bias_se_pct": round(100 * means.std() / np.sqrt(len(means)) / true, 2),
                    "inside_95_pct": round(100 * np.mean([e.low <= true <= e.high for e in found]), 1),
                    "half_interval_pct": round(float(np.median([e.half_pct for e in found])), 1),
                }
            raw = np.array([m.uncorrected["ba"] for m in made])
            row["ba"]["bias_uncorrected_pct"] = round(100 * (raw.mean() - truth["ba"]) / truth["ba"], 2)
            row["ba"]["inflation_pct"] = round(
                float(np.mean([100 * (m.uncorrected["ba"] / m.estimates["ba"].mean - 1) for m in made])), 2
            )
            without = np.array([m.other["ba"].mean for m in made])
            row["ba"]["bias_excluded_pct"] = round(100 * (without.mean() - truth["ba"]) / truth["ba"], 2)
            rows.append(row)
            print(json.dumps(row), flush=True)
    record = {
        "what": "stand-table on simulated surveys of a stand that is known",
        "truth_per_ha": {key: round(value, 3) for key, value in truth.items()},
        "rows": rows,
        "seconds": round(time.perf_counter() - began),
    }
    write_record(chosen.output, record, seeds=[1000 * n for n in chosen.plots])


if __name__ == "__main__":
    main()
