"""What the second measurement of stems of low confidence changed in finished runs: their layer with and without it.

    python -m treedgs_lab.benchmarks.photos.second_measurement PLOT [PLOT ...] --workspaces WORKSPACE [...]
        --output FILE

Nothing is measured: a workspace (its name begins with its plot's) has the diameters of both measurements. ``without``
are the trees as the photo fit alone left them. In-plot stems of the truth, pooled over the plots.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from treedgs_geo.core import workspace as names
from treedgs_geo.core.files import read_json
from treedgs_geo.inventory.accuracy.scores import score_against_truth
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_lab.benchmarks.records import write_record


@dataclass(frozen=True)
class Scores:
    """stems: of the truth. measured: with a DBH. worst_ok_cm: of those flagged ``ok``."""

    stems: int
    measured: int
    rmse_cm: float | None
    worst_cm: float | None
    ok: int
    ok_rmse_cm: float | None
    worst_ok_cm: float | None


def tables(plot: Path, workspace: Path) -> dict[str, pd.DataFrame]:
    """A row a stem of the truth: the layer as written, and as it is without the second measurement."""
    layer, kept = read_trees(workspace / names.TREES), read_json(workspace / names.FITS)
    without = layer.copy()
    for number in kept["second_cm"]:
        fit = kept["fits"][int(number)]
        stated = fit.get("assessment", fit)  # earlier versions kept it in the fit itself
        row = without.index[without["tree_id"] == int(number) + 1]
        without.loc[row, "dbh_cm"] = np.nan if stated["flag"] == "reject" else stated["dbh_cm"]
        without.loc[row, "qc_flag"] = stated["flag"]
    truth = plot / "truth" / "trees.csv"
    return {name: score_against_truth(trees, truth)[1] for name, trees in (("with", layer), ("without", without))}


def scores(stems: pd.DataFrame) -> Scores:
    """Counts and errors of some stems."""
    error = stems["error_cm"].to_numpy(float)
    ok = error[np.isfinite(error) & (stems["qc_flag"] == "ok").to_numpy()]
    error = error[np.isfinite(error)]
    return Scores(len(stems), len(error), *_errors(error), len(ok), *_errors(ok))


def _errors(error: np.ndarray) -> tuple[float | None, float | None]:
    if not len(error):
        return None, None
    return round(float(np.sqrt((error**2).mean())), 3), round(float(np.abs(error).max()), 2)


def main() -> None:
    """Compare, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", type=Path, nargs="+")
    parser.add_argument("--workspaces", type=Path, nargs="+", required=True)
    parser.add_argument("--output", type=Path, required=True, help="JSON file")
    arguments = parser.parse_args()
    rows: list[dict[str, Any]] = []
    both: dict[str, list[pd.DataFrame]] = {"with": [], "without": []}
    for plot in arguments.plots:
        workspace = next(folder for folder in arguments.workspaces if folder.name.startswith(plot.name))
        changed = read_json(workspace / "run.json")["stages"]["measure"]["result"].get("second_measurement")
        row: dict[str, Any] = {"plot": plot.name, **(changed or dict.fromkeys(("measured", "gained", "flagged"), 0))}
        for name, stems in tables(plot, workspace).items():
            both[name].append(stems)
            row[name] = asdict(scores(stems))
        print(row)
        rows.append(row)
    pooled = {name: asdict(scores(pd.concat(stems))) for name, stems in both.items()}
    for name in ("measured", "gained", "flagged"):
        pooled[name] = sum(row[name] for row in rows)
    print(pooled)
    write_record(arguments.output, {"pooled": pooled, "plots": rows})


if __name__ == "__main__":
    main()
