"""``stand-table`` with plots larger than what was searched, and with values that cannot be: is it noticed, is it right?

    python -m treedgs_lab.benchmarks.inventory.wrong_tables --output docs/results/wrong_tables.json

Stands are drawn as stem maps: 4 plots of 10 m, 500 to 1,300 stems a hectare, mean DBH 15 to 38 cm, in every second
stand a third of the stems as understorey, in every third two veterans of twice the diameter; heights by a curve of the
stand with 8 % of scatter. Plots: a tree layer that says where stems were searched for, and a table of plots that asks
for other ground. Values: a crew's tally with one fault, as tables have them. A fault is *refused*, *said* (a warning
that the clean table does not give), or *silent*; how far basal area or volume is off where it was not refused. The
clean tables say how often a right one is refused or blamed.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyproj
import shapely

from treedgs_geo.core.errors import TreeDGSError
from treedgs_geo.core.plots import Plot
from treedgs_geo.core.progress import Reporter
from treedgs_geo.inventory.searched import searched_table
from treedgs_geo.inventory.stand.run import read_stand
from treedgs_geo.inventory.stand.survey import Stand
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.verbs.stand_table import StandTableSettings
from treedgs_lab.benchmarks.records import write_record

CRS = pyproj.CRS.from_epsg(26915)
EAST, NORTH, RADIUS, APART, PLOTS, FIRST_SEED = 500000.0, 5200000.0, 10.0, 60.0, 4, 9000


def crew_table(seed: int) -> pd.DataFrame:
    """The trees of four plots as a crew writes them down."""
    rng = np.random.default_rng(seed)
    mean, per_ha = rng.uniform(15, 38), rng.uniform(500, 1300)
    bend, top, parts = rng.uniform(1.2, 2.2), rng.uniform(0.17, 0.22), []
    for k in range(PLOTS):
        n = max(rng.poisson(per_ha * np.pi * RADIUS**2 / 1e4), 3)
        d = np.clip(rng.normal(mean, 0.25 * mean, n), 7, 90)
        d = np.where((rng.random(n) < 1 / 3) & bool(seed % 2), rng.uniform(7, 0.6 * mean + 3, n), d)
        if seed % 3 == 0 and k < 2:
            d[0] = 2 * mean
        h = (1.3 + (d / (bend + top * d)) ** 2) * (1 + rng.normal(0, 0.08, n))
        parts.append(
            pd.DataFrame(
                {
                    "plot_id": f"p{k + 1}",
                    "tree_id": np.arange(1, n + 1),
                    "azimuth_deg": rng.uniform(0, 360, n).round(1),
                    "distance_m": (0.98 * RADIUS * np.sqrt(rng.uniform(0.01, 1, n))).round(2),
                    "dbh_cm": d.round(1),
                    "height_m": h.round(1),
                }
            )
        )
    return pd.concat(parts, ignore_index=True)


def plots_table(radius: float = RADIUS, east: float = 0.0, unit: str = "m") -> pd.DataFrame:
    """Where the plots are, and how large."""
    x = EAST + east + APART * np.arange(PLOTS)
    names = [f"p{k + 1}" for k in range(PLOTS)]
    return pd.DataFrame({"plot_id": names, "easting": x, "northing": NORTH, f"radius_{unit}": radius})


#: What a table of plots asks for beside the 10 m that were searched.
SIZES: dict[str, pd.DataFrame] = {
    "as searched": plots_table(),
    "12.62 m (500 m²)": plots_table(12.62),
    "feet in the metre column": plots_table(32.81),
    "half beyond what was searched": plots_table(east=8.0),
    "diameter as radius": plots_table(20.0),
    "radius 1,000 m": plots_table(1000.0),
}


def _some(table: pd.DataFrame, name: str, times: float, rows: slice = slice(0, 3)) -> pd.DataFrame:
    made = table.astype({name: float})
    made.loc[made.index[rows], name] = (made[name].iloc[rows] * times).round(1)
    return made


#: What goes wrong with a tally.
FAULTS: dict[str, Callable[[pd.DataFrame], pd.DataFrame]] = {
    "clean": lambda t: t,
    "DBHs in inches": lambda t: t.assign(dbh_cm=(t.dbh_cm / 2.54).round(1)),
    "DBHs in millimetres": lambda t: t.assign(dbh_cm=(t.dbh_cm * 10).round(0)),
    "girths as DBHs": lambda t: t.assign(dbh_cm=(t.dbh_cm * np.pi).round(1)),
    "three DBHs in millimetres": lambda t: _some(t, "dbh_cm", 10),
    "9999 for not measured": lambda t: t.assign(dbh_cm=t.dbh_cm.where(t.index > 0, 9999)),
    "all heights in feet": lambda t: t.assign(height_m=(t.height_m / 0.3048).round(1)),
    "a fifth of the heights in feet": lambda t: _some(t, "height_m", 1 / 0.3048, slice(0, None, 5)),
    "two rows copied under new numbers": lambda t: pd.concat([t, t[:2].assign(tree_id=[901, 902])]),
    "a row of means at the end": lambda t: pd.concat(
        [t, pd.DataFrame([{"plot_id": "p4", "tree_id": "Mean", "dbh_cm": t.dbh_cm.mean().round(1)}])]
    ),
}


class _Heard(Reporter):
    """Keeps the warnings."""

    def __init__(self) -> None:
        super().__init__()
        self.warnings: list[str] = []

    def warn(self, message: str) -> None:
        self.warnings.append(message)


def outcome(settings: StandTableSettings) -> tuple[Stand | None, list[str]]:
    """``(the stand, None where it was refused; warnings)``."""
    heard = _Heard()
    try:
        return read_stand(settings, heard), heard.warnings
    except TreeDGSError:
        return None, heard.warnings


def _figures(stand: Stand) -> np.ndarray:
    return np.array([stand.estimates[name].mean for name in ("ba", "volume")])


def with_sizes(folder: Path, seed: int) -> list[dict[str, Any]]:
    """One row a plot size."""
    crew, plots = crew_table(seed), plots_table()
    centre = crew["plot_id"].map(dict(zip(plots["plot_id"], plots["easting"], strict=True)))
    turn = np.radians(crew["azimuth_deg"])
    trees = [
        Tree(k + 1, x, y, dbh_cm=d, dbh_se_cm=0.5, height_m=h, method="photos")
        for k, (x, y, d, h) in enumerate(
            zip(
                centre + crew["distance_m"] * np.sin(turn),
                NORTH + crew["distance_m"] * np.cos(turn),
                crew["dbh_cm"],
                crew["height_m"],
                strict=True,
            )
        )
    ]
    circles = [Plot(row.plot_id, row.easting, row.northing, RADIUS) for row in plots.itertuples()]
    seen = shapely.union_all([shapely.Point(plot.x, plot.y).buffer(RADIUS, 128) for plot in circles])
    write_trees(folder / "trees.gpkg", trees, CRS, searched=searched_table(seen, circles, CRS))
    true, rows = float((np.pi / 4e4 * crew["dbh_cm"] ** 2).sum() / (PLOTS * np.pi * RADIUS**2 / 1e4)), []
    for name, table in SIZES.items():
        table.to_csv(folder / "plots.csv", index=False)
        stand, warnings = outcome(
            StandTableSettings(
                trees=folder / "trees.gpkg", plots=folder / "plots.csv", species="PITA", output=folder / "out"
            )
        )
        off = np.nan if stand is None else abs(100 * (stand.estimates["ba"].mean / true - 1))
        said = any("than stems were searched for on" in text for text in warnings)
        rows.append({"case": name, "refused": stand is None, "said": said, "off_pct": off})
    return rows


def with_faults(folder: Path, seed: int) -> list[dict[str, Any]]:
    """One row a fault."""
    crew, rows, clean, blamed = crew_table(seed), [], None, 0
    plots_table().to_csv(folder / "plots.csv", index=False)
    for name, change in FAULTS.items():
        change(crew.astype({"tree_id": object})).to_csv(folder / "tally.csv", index=False)
        stand, warnings = outcome(
            StandTableSettings(
                field=folder / "tally.csv", plots=folder / "plots.csv", species="PITA", crs="EPSG:32632",
                north="grid", output=folder / "out",
            )
        )  # fmt: skip
        looks = sum("look whether" in text for text in warnings)
        if name == "clean":
            clean, blamed = (None if stand is None else _figures(stand)), looks
        off = np.nan if stand is None or clean is None else float(np.abs(100 * (_figures(stand) / clean - 1)).max())
        said = looks > (0 if name == "clean" else blamed)
        rows.append({"case": name, "refused": stand is None, "said": said, "off_pct": off})
    return rows


def shares(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Of all stands together, case by case."""
    made = []
    for case, mine in pd.DataFrame(rows).groupby("case", sort=False):
        silent = mine[~mine["refused"] & ~mine["said"]]
        made.append(
            {
                "case": case,
                "tables": len(mine),
                "refused": int(mine["refused"].sum()),
                "said": int((mine["said"] & ~mine["refused"]).sum()),
                "silent": len(silent),
                "worst_off_pct": round(float(mine["off_pct"].max()), 1) if mine["off_pct"].notna().any() else None,
                "worst_off_silent_pct": round(float(silent["off_pct"].max()), 1) if len(silent) else None,
            }
        )
    return made


def main() -> None:
    """Every stand with every size and fault."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stands", type=int, default=40)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--output", type=Path)
    chosen = parser.parse_args()
    seeds, began = range(chosen.first_seed, chosen.first_seed + chosen.stands), time.perf_counter()
    record: dict[str, Any] = {"what": "stand tables of plots of other sizes than searched, and of tallies with a fault"}
    with tempfile.TemporaryDirectory() as name:
        for key, made in (("sizes", with_sizes), ("faults", with_faults)):
            record[key] = shares([row for seed in seeds for row in made(Path(name), seed)])
            print(pd.DataFrame(record[key]).to_string(index=False), flush=True)
    record["seconds"] = round(time.perf_counter() - began, 1)
    write_record(chosen.output, record, seeds=seeds)


if __name__ == "__main__":
    main()
