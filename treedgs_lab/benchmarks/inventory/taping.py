"""Tapes on simulated tree layers: are corrected totals unbiased, and do their 90 % intervals hold 90 %?

    python -m treedgs_lab.benchmarks.inventory.taping --output docs/results/taping.json

Part one, the draw and the estimators: tree layers of 200 trees in 8 plots whose true diameters are known; each is drawn
from again and again, with every design, number of tapes and estimator. Part two, ``stand-table --taped`` as a whole:
surveys of the stand of ``benchmarks.inventory.stand_table``, its plots anywhere in it, heights for half of the trees.

The layers are bad on purpose: diameters biased by 0.4 cm + 1.5 %, with errors of Student's t with 3 degrees of
freedom, one tree in 25 wrong by some 4 cm more, trees marked ``check`` with another 1.5 cm, 6 % of the stems without a
DBH, 3 % of the trees not in the layer at all (the crew finds them where it tapes), 1 % of its trees no trees.
``mild``: biased by 0.2 cm, errors of 0.6 cm, 3 % without a DBH, 1 % missing. Nothing was tuned on these seeds; 0 to 19
were looked at while the designs were made, so that the layers begin with seed 100.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from shapely.geometry import Point, box

from treedgs_geo.inventory.double_sampling.designs import DESIGNS, draw_trees
from treedgs_geo.inventory.double_sampling.estimators import ESTIMATORS, Tapes, correct_total, share_out
from treedgs_geo.inventory.double_sampling.tapes import Taped
from treedgs_geo.inventory.stand.equations import Equation, read_equations
from treedgs_geo.inventory.stand.expansion import expand
from treedgs_geo.inventory.stand.sample import SamplePlot, weights
from treedgs_geo.inventory.stand.survey import make_stand
from treedgs_geo.inventory.stand.taped import TapeInput
from treedgs_geo.inventory.stand.treelist import COLUMNS, TreeList
from treedgs_geo.inventory.stand.values import BA, ValueOptions
from treedgs_lab.benchmarks.inventory.stand_table import CRS, RADIUS_M, SIDE_M, make_population, truth_of
from treedgs_lab.benchmarks.records import write_record

TAPES, FIRST_SEED, CONFIDENCE = (10, 20, 30), 100, 0.9


@dataclass(frozen=True)
class Errors:
    """bias_cm + bias_share * d; sd_cm times Student's t (3 degrees of freedom where heavy); share wild by wild_cm;
    trees marked check, without a DBH, not in the layer, and false, as shares."""

    bias_cm: float = 0.4
    bias_share: float = 0.015
    sd_cm: float = 0.6
    heavy: bool = True
    wild: float = 0.04
    wild_cm: float = 4.0
    check: float = 0.15
    refused: float = 0.06
    missed: float = 0.03
    false: float = 0.01


LAYERS = {
    "bad": Errors(),
    "mild": Errors(0.2, 0.0, 0.6, False, 0.0, 0.0, 0.1, 0.03, 0.01, 0.0),
}


def measure(true_cm: np.ndarray, errors: Errors, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Measured diameters (NaN: none), flags, and which trees the layer lacks."""
    n = len(true_cm)
    draw = rng.standard_t(3, n) if errors.heavy else rng.normal(size=n)
    off = errors.bias_cm + errors.bias_share * true_cm + errors.sd_cm * draw
    off += (rng.random(n) < errors.wild) * rng.normal(0, errors.wild_cm, n)
    flag = np.where(rng.random(n) < errors.check, "check", "ok").astype(object)
    off += (flag == "check") * rng.normal(0, 1.5 if errors.heavy else 0.5, n)
    flag[rng.random(n) < errors.refused] = "reject"
    measured = np.where(flag == "reject", np.nan, np.maximum(true_cm + off, 2.0))
    return measured, flag, rng.random(n) < errors.missed


def _basal_area(dbh_cm: np.ndarray) -> np.ndarray:
    return BA * dbh_cm**2


def _volume(equation: Equation, height_m: np.ndarray, dbh_cm: np.ndarray) -> np.ndarray:
    return equation.value(dbh_cm, height_m)


def layers_study(
    errors: Errors, n_tapes: int, design: str, layers: int, draws: int, book: list
) -> list[dict[str, Any]]:
    """One row an estimator and quantity: bias and coverage over tree layers, each drawn from ``draws`` times."""
    equation = next(e for e in book if e.id == "nsvb-vob-pita-natural")
    kept: dict[tuple[str, str], list[tuple[float, ...]]] = {}
    for layer in range(layers):
        rng = np.random.default_rng(FIRST_SEED + layer)
        true = np.clip(rng.weibull(2.6, 200) * 24 + 6, 6, 60)
        height = 1.37 + (true / (1.5 + 0.19 * true)) ** 2 + rng.normal(0, 1.0, 200)
        plot = rng.integers(0, 8, 200)
        measured, flag, missed = measure(true, errors, rng)
        real = rng.random(200) >= errors.false
        middle = np.nanmedian(measured)
        frame = np.flatnonzero(~missed)
        members = {int(k): int((plot[frame] == k).sum()) for k in range(8)}
        size = BA * np.where(np.isfinite(measured), measured, middle) ** 2
        rules: dict[str, Callable[[np.ndarray], np.ndarray]] = {
            "ba": _basal_area,
            "volume": partial(_volume, equation, height),
        }
        for draw_number in range(draws):
            draw = draw_trees(design, size[frame], flag[frame], n_tapes, 1000 * (FIRST_SEED + layer) + draw_number)
            tree = frame[draw.index]
            tapes = Tapes(draw.prob, draw.stratum)
            visited = set(plot[tree])
            for name, rule in rules.items():
                x, y = rule(np.where(np.isfinite(measured), measured, middle)), rule(true) * real
                extra = [(plot[k], None, y[k]) for k in np.flatnonzero(missed) if plot[k] in visited]
                found = y[tree] + share_out(tree.astype(object), plot[tree].astype(object), members, extra)
                for estimator in ESTIMATORS:
                    made = correct_total(tapes, float(x[frame].sum()), x[tree], found, estimator)
                    low, high = made.interval(CONFIDENCE)
                    truth = float(y.sum())
                    kept.setdefault((name, estimator), []).append(
                        (made.total / truth - 1, low <= truth <= high, made.se / truth, made.measured / truth - 1)
                    )
    rows = []
    for (name, estimator), samples in kept.items():
        table = np.array(samples, float)
        # Draws of one layer are alike in their layer: the error of the mean is that over the layers.
        by_layer = table[:, 0].reshape(layers, draws).mean(axis=1)
        rows.append(
            {
                "quantity": name,
                "estimator": estimator,
                "samples": len(table),
                "bias_measured_pct": round(100 * table[:, 3].mean(), 2),
                "bias_pct": round(100 * table[:, 0].mean(), 2),
                "bias_se_pct": round(100 * float(np.std(by_layer, ddof=1) / np.sqrt(layers)), 2),
                "inside_90_pct": round(100 * table[:, 1].mean(), 1),
                "se_stated_pct": round(100 * table[:, 2].mean(), 2),
                "sd_true_pct": round(100 * table[:, 0].std(), 2),
            }
        )
    return rows


def one_survey(
    population: pd.DataFrame, errors: Errors, n_plots: int, n_tapes: int, design: str, seed: int, book: list
):
    """``stand-table --taped`` on one survey of the stand."""
    rng = np.random.default_rng(seed)
    area = np.pi * RADIUS_M**2 / 1e4
    plots = [
        SamplePlot(str(k), "circle", area, x, y, RADIUS_M, Point(x, y).buffer(RADIUS_M, 64), 0.0, 1.0, area)
        for k, (x, y) in enumerate(rng.uniform(0, SIDE_M, (n_plots, 2)))
    ]
    place = population[["x", "y"]].to_numpy()
    home = np.full(len(place), -1)
    for k in reversed(range(n_plots)):
        home[np.hypot(*(place - [plots[k].x, plots[k].y]).T) <= RADIUS_M] = k
    seen, home = population[home >= 0].reset_index(drop=True), home[home >= 0]
    true, n = seen["dbh"].to_numpy(), len(seen)
    measured, flag, missed = measure(true, errors, rng)
    real = rng.random(n) >= errors.false
    table = pd.DataFrame(
        {
            **dict.fromkeys(COLUMNS),
            "tree_id": np.arange(n),
            "x": seen["x"],
            "y": seen["y"],
            "dbh_cm": measured,
            "dbh_se_cm": np.where(flag == "reject", np.nan, errors.sd_cm),
            "height_m": np.where(rng.random(n) < 0.5, seen["height"], np.nan),
            "species": "PITA",
            "dead": False,
            "qc_flag": flag,
            "qc_reason": np.where(flag == "reject", "few_views", ""),
        }
    )[list(COLUMNS)]
    mapped = np.flatnonzero(~missed)
    trees = table.iloc[mapped].reset_index(drop=True)
    size = BA * trees["dbh_cm"].fillna(trees["dbh_cm"].median()).to_numpy(float) ** 2
    draw = draw_trees(design, size, trees["qc_flag"].to_numpy(object), n_tapes, seed)
    tree = mapped[draw.index]
    taped = pd.DataFrame(
        {
            "tree_id": tree,
            "plot_id": home[tree].astype(str),
            "taped_cm": np.where(real[tree], true[tree], np.nan),
            "state": np.where(real[tree], "taped", "none"),
            "note": None,
            "stratum": draw.stratum,
            "prob": draw.prob,
        }
    )
    found = np.flatnonzero(missed & np.isin(home, home[tree]))
    extra = pd.DataFrame({"plot_id": home[found].astype(str), "near_id": np.nan, "taped_cm": true[found], "note": None})
    given = TapeInput(Taped(taped, extra, len(trees), "", Path("tapes.csv")), draw.index, "difference", 0.0, "PITA")
    # What perfect tapes on every tree of these plots would give.
    outline = box(0, 0, SIDE_M, SIDE_M)
    inside = [plot.contains(seen["x"].to_numpy(), seen["y"].to_numpy()) for plot in plots]
    worth = {"trees": real.astype(float), "ba": BA * true**2 * real}
    perfect = {
        name: sum(
            float((weights(plot, seen["x"][mine], seen["y"][mine], outline, "zone") * value[mine]).sum())
            for plot, mine in zip(plots, inside, strict=True)
        )
        / (n_plots * area)
        for name, value in worth.items()
    }
    listed = TreeList(trees, CRS, False)
    expanded = expand(listed, plots, outline, "zone", 0.0)
    return make_stand(listed, expanded, book, ValueOptions(), confidence=CONFIDENCE, tapes=given), perfect


def surveys_study(
    errors: Errors, n_plots: int, n_tapes: int, design: str, surveys: int, book: list
) -> list[dict[str, Any]]:
    """One row a quantity: bias and coverage of the stand's figures over ``surveys`` surveys."""
    population = make_population()
    truth = truth_of(population, book)
    truth["ba"] *= 1 - errors.false
    truth["volume"] *= 1 - errors.false
    truth["trees"] *= 1 - errors.false
    made = [
        one_survey(population, errors, n_plots, n_tapes, design, 10_000 * n_plots + FIRST_SEED + k, book)
        for k in range(surveys)
    ]
    rows = []
    for name in ("trees", "ba", "volume", "qmd"):
        found = [stand.estimates[name] for stand, _ in made]
        before = np.array([stand.taped.before[name].mean for stand, _ in made if stand.taped])
        own = np.array([stand.estimates[name].mean / perfect[name] - 1 for stand, perfect in made if name in perfect])
        means = np.array([estimate.mean for estimate in found])
        rows.append(
            {
                "quantity": name,
                "surveys": surveys,
                "bias_untaped_pct": round(100 * float(before.mean() / truth[name] - 1), 2),
                "bias_pct": round(100 * float(means.mean() / truth[name] - 1), 2),
                "bias_se_pct": round(100 * float(means.std(ddof=1) / np.sqrt(surveys) / truth[name]), 2),
                "bias_in_plots_pct": round(100 * float(own.mean()), 2) if len(own) else None,
                "bias_in_plots_se_pct": round(100 * float(own.std(ddof=1) / np.sqrt(surveys)), 2) if len(own) else None,
                "inside_90_pct": round(100 * float(np.mean([e.low <= truth[name] <= e.high for e in found])), 1),
                "se_plots_pct": round(100 * float(np.mean([e.se_plots for e in found])) / truth[name], 2),
                "se_taped_pct": round(100 * float(np.mean([e.se_taped for e in found])) / truth[name], 2),
            }
        )
    return rows


def main() -> None:
    """Run both parts and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--layers", type=int, default=40)
    parser.add_argument("--draws", type=int, default=25, help="draws from each layer")
    parser.add_argument("--surveys", type=int, default=200, help="surveys of part two; 0: leave it out")
    parser.add_argument("--tapes", type=int, nargs="+", default=TAPES)
    parser.add_argument("--survey-tapes", type=int, nargs="+", default=(20,), help="tapes of part two")
    parser.add_argument("--plots", type=int, nargs="+", default=(6, 12))
    parser.add_argument("--output", type=Path, required=True)
    chosen = parser.parse_args()
    book, began = read_equations(), time.perf_counter()
    record: dict[str, Any] = {"what": "totals corrected by tapes, on simulated tree layers", "draws": [], "surveys": []}
    for key, errors in LAYERS.items():
        for n_tapes in chosen.tapes:
            for design in DESIGNS:
                for row in layers_study(errors, n_tapes, design, chosen.layers, chosen.draws, book):
                    record["draws"].append({"layers": key, "tapes": n_tapes, "design": design, **row})
                    print(json.dumps(record["draws"][-1]), flush=True)
    if chosen.surveys:
        for n_plots in chosen.plots:
            for n_tapes in chosen.survey_tapes:
                for row in surveys_study(LAYERS["bad"], n_plots, n_tapes, "stratified", chosen.surveys, book):
                    record["surveys"].append({"plots": n_plots, "tapes": n_tapes, "design": "stratified", **row})
                    print(json.dumps(record["surveys"][-1]), flush=True)
    record["seconds"] = round(time.perf_counter() - began)
    write_record(chosen.output, record, seeds=[FIRST_SEED + k for k in range(chosen.layers)])


if __name__ == "__main__":
    main()
