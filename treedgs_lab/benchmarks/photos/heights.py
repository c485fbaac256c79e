"""Tree heights from photos and from drone LiDAR against the truth of rendered and simulated plots.

    python -m treedgs_lab.benchmarks.photos.heights PLOT=WORKSPACE … [--output FILE]

PLOT: a folder with ``truth/`` (and ``lidar/``). WORKSPACE: of ``photos-to-dbh`` on its photos; seconds and memory are
those of its stages. A cloud is measured here, by ``pointcloud-to-dbh``.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd

from treedgs_geo.core.files import read_json
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_lab.benchmarks.processes import run_verb
from treedgs_lab.benchmarks.records import write_record

#: A stem of the layer is the true one within this distance, metres.
_SAME_M = 0.6
#: A height counts as good within this error, metres (plus, where it states one, 1.645 standard errors).
_GOOD_M = 0.6


def figures(layer: gpd.GeoDataFrame, truth: pd.DataFrame) -> dict:
    """Of the in-plot stems: how many have a height, its errors, and why the others have none."""
    inside = truth[truth["in_plot"].astype(str) == "True"]
    errors, within, worst = [], [], []
    why: dict[str, int] = {}
    for _, tree in inside.iterrows():
        away = np.hypot(layer["x"] - tree["E_bh"], layer["y"] - tree["N_bh"])
        row = layer.loc[away.idxmin()] if len(away) and away.min() <= _SAME_M else None
        if row is None or pd.isna(row["height_m"]):
            said = "not in the layer" if row is None else str(row.get("height_why") or "no reason")
            why[said] = why.get(said, 0) + 1
            continue
        error = float(row["height_m"] - tree["height_m"])
        errors.append(error)
        worst.append((abs(error), f"{tree['tree_id']} {error:+.2f}"))
        if pd.notna(row.get("height_se_m")):
            within.append(abs(error) <= 1.645 * row["height_se_m"])
    e = np.array(errors)
    return {
        "stems": len(inside),
        "with_height": len(e),
        "rmse_m": round(float(np.sqrt((e**2).mean())), 2) if len(e) else None,
        "bias_m": round(float(e.mean()), 2) if len(e) else None,
        "within_0.6_m": int((np.abs(e) <= _GOOD_M).sum()),
        "in_90": round(float(np.mean(within)), 2) if within else None,
        "worst": [text for _, text in sorted(worst, reverse=True)[:3]],
        "without": why,
    }


def from_photos(plot: Path, workspace: Path) -> dict:
    """Figures of a finished run, and what its stage of heights cost."""
    stages = read_json(workspace / "run.json")["stages"]
    seconds = {name: entry["seconds"] for name, entry in stages.items()}
    return figures(read_trees(workspace / "trees.gpkg"), pd.read_csv(plot / "truth" / "trees.csv")) | {
        "seconds": round(seconds["heights"], 1),
        "share_of_the_run": round(seconds["heights"] / sum(seconds.values()), 3),
        "peak_memory_mb": stages["heights"]["peak_memory_mb"],
    }


def from_cloud(plot: Path) -> dict | None:
    """Figures of the plot's drone LiDAR; nothing where it has none."""
    clouds = sorted((plot / "lidar").glob("*.la[sz]"))
    if not clouds:
        return None
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "trees.gpkg"
        run_verb("pointcloud-to-dbh", "--input", clouds[0], "--plots", plot / "plots.csv", "--output", output)
        return figures(read_trees(output), pd.read_csv(plot / "truth" / "trees.csv"))


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", help="PLOT=WORKSPACE")
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    results = {}
    for pair in args.runs:
        plot, _, workspace = (Path(part) for part in pair.partition("="))
        found = {"photos": from_photos(plot, workspace), "lidar": from_cloud(plot)}
        name = plot.name if plot.name != "plot" else plot.parent.name
        results[name] = {route: value for route, value in found.items() if value is not None}
        for route, value in results[name].items():
            print(name, route, json.dumps(value), flush=True)
    write_record(args.output, results, seeds=[0])


if __name__ == "__main__":
    main()
