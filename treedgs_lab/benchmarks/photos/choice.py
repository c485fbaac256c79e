"""How the explanations of a place are weighed (``stems/photos/fit/selection.py``) and how large the error is said to
be.

    python -m treedgs_lab.benchmarks.photos.choice PLOT [PLOT ...] --output docs/results/photo_choice.json

Every stem of the plots (rendered, with truth; the renderer's cameras) is searched and fitted; all explanations tried
for it are kept with their witnesses. A conditional logit (log odds linear in the witnesses, one choice among the
explanations of a place, small ridge) is fitted on all plots but one and tested on that one: how often the chosen
explanation is wrong (more than 1.6 cm or 5 % off, or 6 cm beside the stem). The last fit, on all plots, is what
``choice.py`` holds. Then the parts of the standard error are scaled by maximum likelihood on the chosen diameters.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from unittest import mock

import numpy as np
from scipy.optimize import minimize
from scipy.special import stdtrit

from treedgs_geo.stems.photos import stem_fit as photo_fit
from treedgs_geo.stems.photos.fit.photo_fit import seen_probability
from treedgs_geo.stems.photos.fit.selection import witnesses
from treedgs_geo.stems.photos.measurement import CLEAR_Z, px_cm
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import stems_from_photos
from treedgs_lab.benchmarks.photos.stems_from_photos import score
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import local_places, plot_inputs, truth_rows

WITNESSES = ("contrast", "evidence_300", "taper", "ragged_0.1px", "edges_30")
SETS = {"chosen": (0, 1, 2, 3), "with edge score": (0, 1, 2, 3, 4), "edge score and silhouette": (0, 4)}
RIDGE = 0.3


def gather(plot: Path, network: bool) -> tuple[list[dict], dict]:
    """One entry a stem (witnesses (N, 5), which explanations are right (N,), the parts of the error); the figures."""
    calls: list[dict] = []
    choose, judge = photo_fit.choose, photo_fit.judged

    def listen(tried, trust, chance, sun, network):
        choice = choose(tried, trust, chance, sun, network)
        calls.append({"tried": tried, "trust": trust if trust > 0.5 else 0.0, "chance": chance})
        return choice

    def judged(shared, seed, found):
        fit = judge(shared, seed, found)
        best, fine = found.best, found.fine
        if calls and found.outline is not None:
            clear = best.z > CLEAR_Z
            weight = fine.view_weight * seen_probability(best.z)
            parts = scatter(fine, weight), 200 * fine.fit_sd_m, px_cm(shared, fine.axis, clear) / max(clear.sum(), 1)
            calls[-1] |= {"fit": fit, "pair": best.mate is not None, "parts": parts}
        return fit

    views, frame, ground, area = plot_inputs(plot)
    with mock.patch.object(photo_fit, "choose", listen), mock.patch.object(photo_fit, "judged", judged):
        fits = stems_from_photos(views, ground, area, PhotoStemOptions(stem_network="full" if network else "off"))
    stems = []
    truth = truth_rows(plot, in_plot=False)
    for tree, true in zip(truth, local_places(truth, frame), strict=True):
        dbh = float(tree["dbh_cm"])
        near = [c for c in calls if "fit" in c and np.hypot(*(c["fit"].axis.p - true)) < 0.15]
        if not near:
            continue
        call = max(near, key=lambda c: c["fit"].llr)
        items = call["tried"]
        edges = np.array([item.edges / 30 for item in items])
        rows = np.column_stack([witnesses(items, call["trust"], call["chance"]), edges])
        right = [
            abs(200 * item.fine.r0 - dbh) < max(1.6, 0.05 * dbh) and np.hypot(*(item.fine.axis.p - true)) < 0.06
            for item in items
        ]
        stems.append(
            {
                "tree": tree["tree_id"],
                "kind": tree["kind"],
                "rows": rows,
                "right": np.array(right),
                "dbh": np.array([200 * item.fine.r0 for item in items]),
                "pair": call["pair"],
                "error": call["fit"].dbh_cm - dbh,
                "parts": call["parts"],
                "gain": call["fit"].gain,
            }
        )
    return stems, {key: value for key, value in score(fits, plot, frame).items() if key != "trees"}


def scatter(fine, weight: np.ndarray) -> float:
    """The first part of :func:`treedgs_geo.stems.photos.evidence.error_budget.standard_error_cm`, unscaled."""
    good = (weight > 0) & np.isfinite(fine.view_r)
    if good.sum() < 2:
        return np.nan
    w, d = weight[good], 200 * fine.view_r[good]
    n = max(w.sum() ** 2 / (w**2).sum(), 1.0)
    return float(stdtrit(max(n - 1.0, 1.0), 0.95) / 1.645 * np.sqrt((w * d**2).sum() / w.sum() / n))


def fit_logit(stems: list[dict], columns: tuple[int, ...]) -> np.ndarray:
    """Weights of the witnesses."""
    useful = [s for s in stems if s["right"].any() and not s["right"].all()]

    def loss(w: np.ndarray) -> float:
        total = 0.5 * RIDGE * float((w**2).sum())
        for s in useful:
            odds = s["rows"][:, columns] @ w
            odds -= odds.max()
            total -= np.log(np.exp(odds[s["right"]]).sum()) - np.log(np.exp(odds).sum())
        return total

    return minimize(loss, np.zeros(len(columns)), method="BFGS").x


def tested(stems: list[dict], columns: tuple[int, ...], w: np.ndarray) -> list[dict]:
    """The choice for each stem that has a right explanation, and its probability."""
    out = []
    for s in stems:
        if not s["right"].any():
            continue
        odds = s["rows"][:, columns] @ w
        share = np.exp(odds - odds.max())
        k = int(np.argmax(odds))
        sure = float(share[abs(s["dbh"] - s["dbh"][k]) < 2.0].sum() / share.sum())
        out.append({"tree": s["tree"], "kind": s["kind"], "right": bool(s["right"][k]), "probability": round(sure, 3)})
    return out


def scale_errors(stems: list[dict]) -> list[float]:
    """Weights of the parts of the standard error: maximum likelihood on errors below 2.5 cm of unpaired stems."""
    good = [s for s in stems if not s["pair"] and abs(s["error"]) < 2.5 and np.isfinite(s["parts"]).all()]
    parts, error = np.array([s["parts"] for s in good]) ** 2, np.array([s["error"] for s in good])

    def loss(p: np.ndarray) -> float:
        variance = parts @ np.exp(p)
        return float((0.5 * np.log(variance) + 0.5 * error**2 / variance).sum())

    best = minimize(loss, np.array([1.5, 1.5, 0.0]), method="Nelder-Mead", options={"maxiter": 4000})
    return np.exp(best.x / 2).round(2).tolist()


def main() -> None:
    """Gather, fit, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", nargs="+", type=Path)
    parser.add_argument("--network", action="store_true", help="with the network that tells stems")
    parser.add_argument("--output", type=Path)
    options = parser.parse_args()
    gathered = {plot.name: gather(plot, options.network) for plot in options.plots}
    stems = {name: group for name, (group, _) in gathered.items()}
    every = [s for group in stems.values() for s in group]
    figures: dict = {
        "plots": list(stems),
        "stems": len(every),
        "se_parts": scale_errors(every),
        "as fitted": {name: measured for name, (_, measured) in gathered.items()},
    }
    figures["without a right explanation"] = [
        f"{n} {s['tree']}" for n, g in stems.items() for s in g if not s["right"].any()
    ]
    figures["companion gain"] = {
        kind: sorted(round(s["gain"]) for s in every if (s["kind"] == "touch") == touch)[::-1]
        for kind, touch in (("touched", True), ("not touched", False))
    }
    for label, columns in SETS.items():
        held = []
        for name, group in stems.items():
            others = [s for other, g in stems.items() if other != name for s in g]
            if others:
                held += [{"plot": name} | row for row in tested(group, columns, fit_logit(others, columns))]
        weights = dict(zip([WITNESSES[c] for c in columns], fit_logit(every, columns).round(2).tolist(), strict=True))
        figures[label] = {
            "weights": weights,
            "tested": len(held),
            "wrong": [h for h in held if not h["right"]],
            "unsure": [h for h in held if h["probability"] < 0.9],
        }
        print(label, json.dumps(figures[label]))
    print(json.dumps({k: figures[k] for k in ("stems", "se_parts", "without a right explanation", "companion gain")}))
    write_record(options.output, figures, seeds=[PhotoStemOptions().seed])


if __name__ == "__main__":
    main()
