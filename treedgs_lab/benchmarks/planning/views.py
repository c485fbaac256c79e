"""Predicted clear views of every stem against traced ones, and the fit of the view model.

    python -m treedgs_lab.benchmarks.planning.views [--plots DIR ...] [--output FILE] [--fit]

Stands of ``benchmarks.planning.stands``: the trees' places and diameters are given (a tree layer of an earlier visit),
heights, crown bases and leaves as numbers of the whole stand; the flight is that of ``simulate-plot --preset plot`` (62
photos). ``--plots``: rendered plots; their trees are known out to 15 m, beyond that they are drawn. The model is fitted
to :data:`~treedgs_lab.benchmarks.planning.stands.FITTED` only (``--fit`` writes
``treedgs_geo/planning/view_model.json``); everything else is kept back. Wanted: mean of the clear views within 20 %,
rank correlation a stem.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import NearestNDInterpolator
from scipy.optimize import minimize
from scipy.stats import spearmanr

from treedgs_geo.planning.stand import CELL_M, REACH_M, Scene, about_plot, dressed_trees, make_scene
from treedgs_geo.planning.views import ViewModel, framed_views, shown_share
from treedgs_lab.benchmarks.planning.stands import FITTED, KEPT_BACK, Stand, rendered, simulated
from treedgs_lab.benchmarks.records import write_record

ROOT = Path(__file__).resolve().parents[3]
SEED = 1


def scene_of(stand: Stand) -> Scene:
    """The planner's scene: mapped stems, the rest from numbers."""
    mapped = dressed_trees(stand.trees.xy, stand.trees.dbh_m, stand.numbers)
    dead = stand.trees.leaf_m2 == 0
    mapped = replace(mapped, leaf_m2=np.where(dead, 0.0, mapped.leaf_m2))
    trees = about_plot(np.random.default_rng(SEED), mapped, stand.numbers, np.zeros(2), stand.radius_m)
    # The plot's own stems come first, in their order.
    own = np.hypot(*mapped.xy.T) < stand.radius_m + REACH_M
    assert own[stand.scored].all()
    z = NearestNDInterpolator(stand.feet[:, :2], stand.feet[:, 2])
    half = stand.radius_m + REACH_M
    n = int(np.ceil(2 * half / CELL_M))
    axis = -half + CELL_M * (np.arange(n) + 0.5)
    grid = z(*np.meshgrid(axis, axis, indexing="ij"))
    return make_scene(trees, z(trees.xy), half, grid)


def rows_of(stand: Stand) -> np.ndarray:
    """(S,) rows of the scene's stems that are scored."""
    own = np.flatnonzero(np.hypot(*stand.trees.xy.T) < stand.radius_m + REACH_M)
    place = {int(k): n for n, k in enumerate(own)}
    return np.array([place[int(k)] for k in stand.scored])


def predicted(stand: Stand, scene: Scene, model: ViewModel) -> tuple[np.ndarray, np.ndarray]:
    """(S, P) chance that a view is clear, and whether it is framed."""
    rows = rows_of(stand)
    feet = np.column_stack([scene.stems[rows, :2], scene.stems[rows, 4]])
    framed, _ = framed_views(
        feet, scene.stems[rows, 2], stand.cameras, stand.rotations, np.full(len(stand.cameras), stand.focal), stand.size
    )
    shown = shown_share(scene, rows, stand.cameras, framed, model)
    return np.where(framed, model.clear_chance(shown), 0.0), framed


def fit(stands: list[tuple[Stand, Scene]]) -> ViewModel:
    """The most likely constants for what was clear, over all framed views."""

    def loss(x: np.ndarray) -> float:
        model = ViewModel(*map(float, np.exp(x)))
        total = 0.0
        for stand, scene in stands:
            chance, framed = predicted(stand, scene, model)
            chance = np.clip(chance, 1e-3, 1 - 1e-3)[framed]
            clear = stand.clear[framed]
            total -= float(np.sum(np.where(clear, np.log(chance), np.log(1 - chance))))
        return total

    found = minimize(
        loss, np.log([0.6, 0.8, 2.0, 0.1]), method="Nelder-Mead", options={"maxiter": 120, "xatol": 0.01, "fatol": 0.5}
    )
    return ViewModel(*(round(float(value), 4) for value in np.exp(found.x)))


def scored(stand: Stand, scene: Scene, model: ViewModel) -> dict[str, Any]:
    """Predicted and traced clear views a stem."""
    chance, _ = predicted(stand, scene, model)
    expected, seen = chance.sum(axis=1), stand.clear.sum(axis=1)
    return {
        "stand": stand.name,
        "stems": len(seen),
        "clear_views": round(float(seen.mean()), 2),
        "predicted": round(float(expected.mean()), 2),
        "ratio": round(float(expected.mean() / max(seen.mean(), 1e-9)), 3),
        "rank_correlation": round(float(spearmanr(expected, seen).statistic), 3),
    }


def main() -> None:
    """Grow, trace, fit if wanted, score, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plots", type=Path, nargs="*", default=[])
    parser.add_argument("--output", type=Path)
    parser.add_argument("--fit", action="store_true")
    args = parser.parse_args()
    grown = [simulated(made) for made in (*(FITTED if args.fit else ()), *KEPT_BACK)]
    stands = [(stand, scene_of(stand)) for stand in [*grown, *map(rendered, args.plots)]]
    count = len(FITTED) if args.fit else 0
    if args.fit:
        model = fit(stands[:count])
        text = json.dumps({"model": vars(model), "fitted_to": [f"seed {made['seed']}" for made in FITTED]}, indent=1)
        (ROOT / "treedgs_geo" / "planning" / "view_model.json").write_text(text + "\n", encoding="utf-8")
    model = ViewModel.load()
    fitted, kept = ([scored(*pair, model) for pair in part] for part in (stands[:count], stands[count:]))
    every = [abs(row["ratio"] - 1) for row in kept]
    figures: dict[str, Any] = {"model": vars(model), "fitted": fitted, "kept_back": kept}
    figures["kept_back_within_20_pct"] = sum(miss <= 0.2 for miss in every)
    figures["median_rank_correlation"] = round(float(np.median([row["rank_correlation"] for row in kept])), 3)
    print(json.dumps(figures, indent=1))
    write_record(args.output, figures, seeds=[int(str(made["seed"])) for made in (*FITTED, *KEPT_BACK)])


if __name__ == "__main__":
    main()
