"""``compare`` on simulated stands measured at two dates: is true growth inside the 90 % intervals?

    python -m treedgs_lab.benchmarks.inventory.two_dates --output docs/results/two_dates.json

The stand of ``benchmarks.inventory.stand_table`` (16 ha), five years later: each tree grows 0.1 to 0.6 cm a year (thick
ones more), 4 % die, and trees below the smallest DBH of 10 cm grow over it. A survey measures plots of 12 m radius at
both dates: each tree with its own error of 0.5 cm at each date, each date with a bias of its DBHs (0.2 cm standard
error, half of its variance alike at both dates) and a relative error of its block's lengths (0.2 %); the second map is
shifted by some 0.5 m and turned a little, positions are off by 0.1 m. ``--missed`` of the trees are lacking in a date's
layer, by chance, date by date; 3 % have no DBH at a date. Nothing was tuned on these seeds.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from shapely.geometry import Point

from treedgs_geo.inventory.change.growth import SharedErrors, stand_change, tree_growth
from treedgs_geo.inventory.change.joining import Limits, join_dates
from treedgs_geo.inventory.pairing import PairingOptions, move
from treedgs_geo.inventory.stand.estimate import Design
from treedgs_geo.inventory.stand.sample import SamplePlot
from treedgs_geo.inventory.stand.treelist import COLUMNS, TreeList
from treedgs_geo.inventory.stand.values import BA
from treedgs_lab.benchmarks.inventory.stand_table import CRS, RADIUS_M, SIDE_M, make_population
from treedgs_lab.benchmarks.records import write_record

YEARS, MIN_CM, LEVEL, FIRST_SEED = 5.0, 10.0, 0.9, 500
OWN_CM, COMMON_CM, ALIKE, BLOCK = 0.5, 0.2, 0.5, 0.002


def grown(population: pd.DataFrame, seed: int = 1) -> pd.DataFrame:
    """The stand five years later: ``x, y, dbh1, dbh2, alive``; half of its thin trees thinner still, so that some cross
    the limit."""
    rng = np.random.default_rng(seed)
    made = population[["x", "y"]].copy()
    dbh = population["dbh"].to_numpy()
    made["dbh1"] = np.where((dbh < 16) & (rng.random(len(dbh)) < 0.5), rng.uniform(8, 12, len(dbh)), dbh)
    rate = np.clip(0.1 + 0.01 * made["dbh1"] + rng.normal(0, 0.08, len(dbh)), 0.05, 0.8)
    made["dbh2"] = made["dbh1"] + YEARS * rate
    made["alive"] = rng.random(len(dbh)) >= 0.04
    return made


def truth_of(stand: pd.DataFrame) -> dict[str, float]:
    """Per hectare, from the true diameters."""
    d1, d2, alive, area = stand["dbh1"], stand["dbh2"], stand["alive"], SIDE_M**2 / 1e4
    was, is_ = d1 >= MIN_CM, (d2 >= MIN_CM) & alive
    grew = was & alive
    ba = {
        "ba_growth": float((BA * (d2**2 - d1**2))[grew].sum() / area),
        "ba_ingrowth": float((BA * d2**2)[is_ & ~was].sum() / area),
        "ba_mortality": float((BA * d1**2)[was & ~alive].sum() / area),
    }
    return {
        "growth_cm_a": float(((d2 - d1)[grew] / YEARS).mean()),
        **ba,
        "ba_change": ba["ba_growth"] + ba["ba_ingrowth"] - ba["ba_mortality"],
        "trees_mortality": float((was & ~alive).sum() / area),
        "trees_ingrowth": float((is_ & ~was).sum() / area),
    }


def _layer(
    seen: pd.DataFrame, place: np.ndarray, true: np.ndarray, bias: float, scale: float, missed: float, rng
) -> TreeList:
    """One date's tree list; ``tree_id`` is the row of the stand."""
    measured = true * (1 + scale) + bias + rng.normal(0, OWN_CM, len(true))
    measured[rng.random(len(true)) < 0.03] = np.nan
    table = pd.DataFrame(
        {
            **dict.fromkeys(COLUMNS),
            "tree_id": seen.index.to_numpy(),
            "x": place[:, 0],
            "y": place[:, 1],
            "dbh_cm": np.where(measured > 1, measured, np.nan),
            # As the chain states it: with the block's error.
            "dbh_se_cm": np.where(np.isnan(measured), np.nan, np.hypot(OWN_CM, BLOCK * true)),
            "dead": False,
            "qc_flag": np.where(np.isnan(measured), "reject", "ok"),
        }
    )[list(COLUMNS)]
    return TreeList(table[rng.random(len(true)) >= missed].reset_index(drop=True), CRS, False)


def one_survey(stand: pd.DataFrame, n_plots: int, missed: float, seed: int) -> tuple[pd.DataFrame, dict]:
    """Trees with their growth and truth, and the figures per hectare."""
    rng = np.random.default_rng(seed)
    # Plots keep off the edge here: slopover is the business of stand-table.
    centres = rng.uniform(RADIUS_M, SIDE_M - RADIUS_M, (n_plots, 2))
    area = np.pi * RADIUS_M**2 / 1e4
    plots = [
        SamplePlot(str(k), "circle", area, x, y, RADIUS_M, Point(x, y).buffer(RADIUS_M, 64), 0.0, 1.0, area)
        for k, (x, y) in enumerate(centres)
    ]
    place = stand[["x", "y"]].to_numpy()
    near = (np.hypot(*(place[:, None] - centres[None]).transpose(2, 0, 1)) <= RADIUS_M + 8).any(axis=1)
    seen = stand[near]
    xy = seen[["x", "y"]].to_numpy()
    alike = rng.normal(0, COMMON_CM * np.sqrt(ALIKE))
    bias = alike + rng.normal(0, COMMON_CM * np.sqrt(1 - ALIKE), 2)
    scale = rng.normal(0, BLOCK, 2)
    middle = xy.mean(axis=0)
    moved = move(xy - middle, rng.normal(0, 0.5, 2), rng.normal(0, 0.3) * 30 / SIDE_M) + middle
    before = _layer(seen, xy + rng.normal(0, 0.1, xy.shape), seen["dbh1"].to_numpy(), bias[0], scale[0], missed, rng)
    alive = seen["alive"].to_numpy()
    there = (moved + rng.normal(0, 0.1, xy.shape))[alive]
    after = _layer(seen[alive], there, seen["dbh2"].to_numpy()[alive], bias[1], scale[1], missed, rng)
    options = PairingOptions(centre_error_m=1.0, rotation_deg=2.0, gate_m=1.0)
    joined = join_dates(before, after, plots, options, Limits(MIN_CM, 3.0 * YEARS))
    shared = SharedErrors(COMMON_CM, ALIKE, BLOCK, BLOCK)
    trees = joined.trees.join(tree_growth(joined.trees, shared, YEARS, LEVEL))
    figures = stand_change(trees, Design(np.full(n_plots, area), False, LEVEL), shared, YEARS)
    survivors = trees[trees["fate"] == "survivor"]
    own = stand.loc[survivors["before_id"].astype(int)]
    survivors = survivors.assign(
        right=(survivors["before_id"] == survivors["after_id"]).to_numpy(),
        true_cm=(own["dbh2"] - own["dbh1"]).to_numpy(),
    )
    return survivors, figures


def main() -> None:
    """Run all cases and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--surveys", type=int, default=200)
    parser.add_argument("--plots", type=int, nargs="+", default=(6, 12))
    parser.add_argument("--missed", type=float, nargs="+", default=(0.0, 0.03), help="share of trees not in a layer")
    parser.add_argument("--output", type=Path, required=True)
    chosen = parser.parse_args()
    stand, began = grown(make_population()), time.perf_counter()
    truth = truth_of(stand)
    rows: list[dict[str, Any]] = []
    for missed in chosen.missed:
        for n_plots in chosen.plots:
            made = [one_survey(stand, n_plots, missed, FIRST_SEED + k) for k in range(chosen.surveys)]
            trees = pd.concat([survivors for survivors, _ in made])
            inside = (trees["true_cm"] >= trees["grow_lo"]) & (trees["true_cm"] <= trees["grow_hi"])
            row: dict[str, Any] = {
                "missed": missed,
                "plots": n_plots,
                "surveys": chosen.surveys,
                "trees": len(trees),
                "wrong_pairs_pct": round(100 * float(1 - np.mean(trees["right"].to_numpy(float))), 3),
                "tree_inside_90_pct": round(100 * float(np.mean(inside.to_numpy(bool))), 1),
            }
            for name, true in truth.items():
                found = [figures[name] for _, figures in made]
                means = np.array([f.mean for f in found])
                row[name] = {
                    "true": round(true, 4),
                    "bias_pct": round(100 * float(means.mean() / true - 1), 1),
                    "bias_se_pct": round(100 * float(means.std(ddof=1) / np.sqrt(len(means)) / true), 1),
                    "inside_90_pct": round(100 * float(np.mean([f.low <= true <= f.high for f in found])), 1),
                    "se_plots": round(float(np.mean([f.se_plots for f in found])), 4),
                    "se_shared": round(float(np.mean([f.se_shared for f in found])), 4),
                }
            rows.append(row)
            print(json.dumps(row), flush=True)
    record: dict[str, Any] = {"what": "growth between two dates of a simulated stand", "rows": rows}
    record["seconds"] = round(time.perf_counter() - began)
    write_record(chosen.output, record, seeds=[FIRST_SEED + k for k in range(chosen.surveys)])


if __name__ == "__main__":
    main()
