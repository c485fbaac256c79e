"""Stems at given places (``photos-to-dbh --at``): how quick, and the same diameters?

    python -m treedgs_lab.benchmarks.chain.given_stems PLOT --workspace WS --trees trees.gpkg [--output FILE]

WS and trees.gpkg: what ``photos-to-dbh`` left of PLOT. Both are copied, nothing in them changes. Three questions:

- *removed*: five measured stems are taken out of the layer and their places, off by 0.2 m in any direction, are given
  to the verb, in a process of its own as a user starts it. Do they come back, and with the same diameters?
- *anew*: every measured stem is forgotten, one at a time, and measured at its place, off by 0.2 m, with all others
  known: how far are its diameters from the run's, and from the truth?
- *nothing there*: places at least 1 m from every stem: is anything measured?
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np

from treedgs_geo.core.files import read_json
from treedgs_geo.core.progress import Reporter
from treedgs_geo.inventory.review.apply import read_whole
from treedgs_geo.inventory.tree_layer import write_table
from treedgs_geo.run.routes import CHAIN_PRESETS
from treedgs_geo.stems.photos.fit_records import KeptFits, read_fits
from treedgs_geo.stems.photos.resumed_search import fits_again
from treedgs_geo.stems.photos.targeted_fit import GivenStems
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import local_places, plot_inputs, truth_rows
from treedgs_lab.benchmarks.verbs import photo_inputs, words

SEED, OFF_M, REACH_M, REMOVED, EMPTY = 19, 0.2, 0.5, 5, 20
#: Places with nothing are this far from every stem, m.
AWAY_M = 1.0


def off(rng: np.random.Generator) -> np.ndarray:
    """(2,) metres in any direction."""
    angle = rng.uniform(0, 2 * np.pi)
    return OFF_M * np.array([np.cos(angle), np.sin(angle)])


def removed(plot: Path, workspace: Path, trees: Path, rng: np.random.Generator) -> dict[str, Any]:
    """The verb on a layer without five of its stems. Runs twice: the first compiles what a new machine has not yet."""
    with tempfile.TemporaryDirectory() as folder:
        work, layer, points = Path(folder, "work"), Path(folder, "trees.gpkg"), Path(folder, "points.gpkg")
        shutil.copytree(workspace, work)
        table = read_whole(trees)
        measured = np.flatnonzero(table["dbh_cm"].notna() & table["plot_id"].notna())
        chosen = sorted(rng.choice(measured, REMOVED, replace=False))
        gone = table.iloc[chosen]
        places = [
            (row.x + dx, row.y + dy)
            for row, (dx, dy) in zip(gone.itertuples(), (off(rng) for _ in chosen), strict=True)
        ]
        gpd.GeoDataFrame(geometry=gpd.points_from_xy(*zip(*places, strict=True)), crs=table.crs).to_file(points)
        given = ["--workspace", work, "--output", layer, "--at", points, "--log-format", "quiet"]
        seconds = []
        for _ in range(2):
            write_table(layer, table.drop(index=table.index[chosen]))
            began = time.monotonic()
            subprocess.run(words("photos-to-dbh", *photo_inputs(plot), *given), check=True, capture_output=True)
            seconds.append(time.monotonic() - began)
        after = read_whole(layer).set_index("tree_id")
        rows = [
            {
                "tree_id": int(row.tree_id),
                "run_cm": row.dbh_cm,
                "at_cm": float(after["dbh_cm"].get(row.tree_id, np.nan)),
            }
            for row in gone.itertuples()
        ]
    apart = [abs(row["at_cm"] - row["run_cm"]) for row in rows]
    back = int(np.isfinite(apart).sum())
    return {
        "stems": REMOVED,
        "back": back,
        "largest_difference_cm": round(float(np.max(apart)), 3),
        "rows_before": len(table),
        "rows_after": len(after),
        "seconds": round(seconds[1], 2),
        "trees": rows,
    }


def anew(
    plot: Path, workspace: Path, kept: KeptFits, inputs: tuple, options: Any, rng: np.random.Generator
) -> dict[str, Any]:
    """Every measured stem of the plot at its place, as if the run had not found it."""
    views, frame, ground, area = inputs
    truth = truth_rows(plot, in_plot=False)
    true_xy = local_places(truth, frame)
    places = np.array([fit.axis.p for fit in kept.fits])
    own = [k for k in np.flatnonzero(area.contains(places, 0.0)) if kept.fits[k].measured]
    rows: list[dict[str, Any]] = []
    began = time.monotonic()
    for k in own:
        fit = kept.fits[k]
        given = GivenStems((places[k] + off(rng))[None], REACH_M)
        known = [other for j, other in enumerate(kept.fits) if j != k]
        (again,) = fits_again(views, ground, area, options, kept.looks, given, known, Reporter())
        assert again is not None
        away = np.linalg.norm(true_xy - fit.axis.p, axis=1)
        tree = truth[int(np.argmin(away))]
        measured = again.measured and np.hypot(*(again.axis.p - fit.axis.p)) < 0.1
        rows.append(
            {
                "true_cm": float(tree["dbh_cm"]) if away.min() < 0.3 else None,
                "run_cm": round(fit.dbh_cm, 2),
                "run_flag": fit.flag,
                "at_cm": round(again.dbh_cm, 2) if measured else None,
                "at_flag": again.flag,
            }
        )
    seconds = (time.monotonic() - began) / max(len(own), 1)
    both = [row for row in rows if row["at_cm"] is not None]
    apart = np.array([row["at_cm"] - row["run_cm"] for row in both])
    error = {
        name: [row[f"{name}_cm"] - row["true_cm"] for row in both if row["true_cm"] is not None]
        for name in ("run", "at")
    }
    return {
        "stems": len(rows),
        "measured": len(both),
        "median_difference_cm": round(float(np.median(np.abs(apart))), 3),
        "largest_difference_cm": round(float(np.abs(apart).max()), 3),
        "rmse_run_cm": round(float(np.sqrt(np.mean(np.square(error["run"])))), 3),
        "rmse_at_cm": round(float(np.sqrt(np.mean(np.square(error["at"])))), 3),
        "seconds_a_stem_alone": round(seconds, 2),
        "trees": rows,
    }


def nothing_there(plot: Path, kept: KeptFits, inputs: tuple, options: Any, rng: np.random.Generator) -> dict[str, Any]:
    """Random places of the plot away from every stem, true or found."""
    views, frame, ground, area = inputs
    stems = np.vstack([local_places(truth_rows(plot, in_plot=False), frame), [fit.axis.p for fit in kept.fits]])
    places: list[np.ndarray] = []
    while len(places) < EMPTY:
        angle, far = rng.uniform(0, 2 * np.pi), area.radii_m[0] * np.sqrt(rng.uniform())
        place = area.centres[0] + far * np.array([np.cos(angle), np.sin(angle)])
        if np.hypot(*(stems - place).T).min() > AWAY_M:
            places.append(place)
    began = time.monotonic()
    given = GivenStems(np.array(places), REACH_M)
    fits = fits_again(views, ground, area, options, kept.looks, given, kept.fits, Reporter())
    seconds = (time.monotonic() - began) / EMPTY
    measured = sum(fit is not None and fit.measured for fit in fits)
    return {"places": EMPTY, "measured": measured, "seconds_a_place": round(seconds, 2)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plot", type=Path)
    parser.add_argument("--workspace", type=Path, required=True)
    parser.add_argument("--trees", type=Path, required=True)
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    rng = np.random.default_rng(SEED)
    settings = read_json(args.workspace / "run.json")["parameters"]
    preset = CHAIN_PRESETS[settings["preset"]]
    options = replace(preset.stems, bh_m=settings["bh_m"], stem_network=settings["stem_network"])
    kept = read_fits(args.workspace / "fits.json")
    inputs = plot_inputs(args.plot, args.workspace)
    result = {
        "plot": args.plot.name,
        "removed": removed(args.plot, args.workspace, args.trees, rng),
        "anew": anew(args.plot, args.workspace, kept, inputs, options, rng),
        "nothing_there": nothing_there(args.plot, kept, inputs, options, rng),
    }
    for name in ("removed", "anew", "nothing_there"):
        print(name, {key: value for key, value in result[name].items() if key != "trees"}, flush=True)
    write_record(args.output, result, seeds=[SEED])


if __name__ == "__main__":
    main()
