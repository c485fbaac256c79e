"""What clear views of a stem give: the chance that it is measured, and its standard error.

    python -m treedgs_lab.benchmarks.planning.curves [--output FILE] [--ship]

Chance: logistic in the logarithms of the clear views and of the stem's width in pixels, fitted to the stems of
``docs/results/stability-trees.csv`` (method ``photos``; factors ``views, hiding, gsd, sector``: nothing else is wrong
there) and of ``docs/results/height_and_photos.json``. Standard error: the law ``c gsd^a / n^b`` of the latter. --ship
writes ``treedgs_geo/planning/curves.json``, which plan-flight reads.
"""

from __future__ import annotations

import argparse
import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize

from treedgs_lab.benchmarks.records import write_record

ROOT = Path(__file__).resolve().parents[3]
TREES, HEIGHTS = ROOT / "docs/results/stability-trees.csv", ROOT / "docs/results/height_and_photos.json"
FACTORS = ("views", "hiding", "gsd", "sector")
#: Ground sample distance at the stem over that straight down from 70 m, in the flights of preset ``micro``.
SLANT = 1.25


def stems() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N,) clear views, width in pixels, whether the stem was measured."""
    found = []
    with open(TREES, newline="", encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            if row["method"] != "photos" or row["factor"] not in FACTORS or not row["clear"] or row["false"] == "True":
                continue
            gsd = SLANT * (float(row["level"]) if row["factor"] == "gsd" else 1.84)
            measured = row["flag"] in ("ok", "check") and row["read_cm"] != ""
            found.append((float(row["clear"]), float(row["true_cm"]) / gsd, measured))
    for stem in json.loads(HEIGHTS.read_text(encoding="utf-8"))["stems"]:
        found.append((stem["free_photos"], stem["dbh_cm"] / stem["gsd_cm"], "se_cm" in stem))
    return tuple(np.array(column, float) for column in zip(*found, strict=True))  # type: ignore[return-value]


def fit(views: np.ndarray, width_px: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """(3,) intercept, slope of log(views + 0.5) and of log(width / 10 px): most likely, no slope below zero."""
    design = np.column_stack([np.ones(len(views)), np.log(views + 0.5), np.log(width_px / 10)])

    def loss(weights: np.ndarray) -> float:
        return float(np.sum(np.logaddexp(0, -(2 * measured - 1) * (design @ weights))))

    return minimize(loss, np.array([-2.0, 2.0, 0.5]), bounds=[(None, None), (0, None), (0, None)]).x


def main() -> None:
    """Fit, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--ship", action="store_true")
    args = parser.parse_args()
    views, width, measured = stems()
    weights = fit(views, width, measured)
    law = json.loads(HEIGHTS.read_text(encoding="utf-8"))["law"]
    chance = 1 / (
        1 + np.exp(-np.column_stack([np.ones(len(views)), np.log(views + 0.5), np.log(width / 10)]) @ weights)
    )
    table: list[dict[str, Any]] = []
    for low, high in ((0, 1), (1, 2), (2, 3), (3, 4), (4, 6), (6, 9), (9, 13), (13, 99)):
        own = (views >= low) & (views < high)
        if own.any():
            row = {"clear_views": f"{low} to {high - 1}", "stems": int(own.sum())}
            table.append(
                row | {"measured": round(float(measured[own].mean()), 3), "curve": round(float(chance[own].mean()), 3)}
            )
    curves = {
        "measured": {
            name: round(float(w), 4) for name, w in zip(("intercept", "views", "width"), weights, strict=True)
        },
        "error": {name: law[name] for name in ("c", "a", "b", "coarsest_flown_gsd_cm")},
        "sources": ["docs/results/stability-trees.csv", "docs/results/height_and_photos.json"],
    }
    print(json.dumps({"curves": curves, "by_views": table}, indent=1))
    write_record(args.output, {"stems": len(views), "curves": curves, "by_views": table})
    if args.ship:
        text = json.dumps(curves, indent=1) + "\n"
        (ROOT / "treedgs_geo" / "planning" / "curves.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
