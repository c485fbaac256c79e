"""Which tree of the first date is which of the second: the pairing of field plots, and what became of each tree."""

from __future__ import annotations

from dataclasses import dataclass, field

import geopandas as gpd
import numpy as np
import pandas as pd

from ...core.errors import InputError
from ...core.intervals import HALF_WIDTH_SE
from ...core.plots import Plot
from ..match import match_plots
from ..options import PairingOptions
from ..pairing import move
from ..stand.sample import SamplePlot, first_plot
from ..stand.treelist import TreeList

#: Trees this far outside a plot's circle are paired too, so that one that seems to have moved over the line is found.
AROUND_M = 2.0
#: Without plots the trees are one plot: pairing takes time with the cube of their number.
MOST_ALONE = 800
#: Survivors whose growth says what a tree can have grown.
ENOUGH = 20
#: A lost tree is dead with at least this chance, however many trees flights miss.
LEAST_CHANCE = 0.02
#: What became of a tree.
FATES = {
    "survivor": "measured at both dates",
    "ingrowth": "grew over the smallest DBH that counts, or is new",
    "mortality": "not found again, or dead at the second date",
    "missed before": "too thick to be new: it was there, and not found at the first date",
    "no growth": "alive at both dates, without a DBH at one of them",
    "unsure": "which tree is which is left to a person",
    "small": "below the smallest DBH that counts at both dates",
    "dead": "dead at both dates",
}


@dataclass
class Joined:
    """trees: one row a tree of either date: ``plot`` (its number), ``before_id, after_id`` (NaN: none), ``x, y`` in the
    second date's map, ``dbh1_cm, se1_cm, dbh2_cm, se2_cm`` (NaN: none), ``fate``, the ``chance`` that it is right (lost
    trees may only have been missed, new ones too) and its standard error ``chance_sd``, ``dist_m, margin``. offsets:
    plot_id -> what the first map was moved by (m east, m north, degrees). unpaired: numbers of the plots in which the
    trees of both dates could not be laid over each other, so that nothing is known of their fates. miss: share of the
    trees that a flight misses, as ``n_missed`` thick new ones say. warnings: sentences."""

    trees: pd.DataFrame
    offsets: dict[str, tuple[float, float, float]]
    miss: float = 0.0
    n_missed: int = 0
    unpaired: list[int] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


def join_dates(
    before: TreeList,
    after: TreeList,
    plots: list[SamplePlot],
    options: PairingOptions,
    min_dbh_cm: float,
    max_growth_cm: float,
) -> Joined:
    """Pair the trees of both dates plot by plot (without plots: all together).

    min_dbh_cm: smallest DBH that counts. max_growth_cm: what no tree grows between the dates; less where the survivors
    say so (1.5 times their 95 % quantile, from :data:`ENOUGH` on). A thicker new tree was there before.

    Raises:
        InputError: too many trees without plots; no tree of either date in the plots.
    """
    first, second = before.trees, after.trees
    circles = _circles(first, second, plots)
    place = first[["x", "y"]].to_numpy(float)
    home = first_plot(plots, place) if plots else np.zeros(len(place), int)
    near = np.full(len(first), None, dtype=object)
    for circle in reversed(circles):
        inside = np.hypot(*(place - [circle.x, circle.y]).T) <= circle.radius_m + AROUND_M
        near[inside] = circle.plot_id
    for k, plot in enumerate(plots):
        near[home == k] = plot.plot_id
    crew = first[["x", "y", "dbh_cm"]].assign(plot_id=near, field_id=first["tree_id"].astype(str))
    crew = crew[crew["plot_id"].notna()].reset_index(drop=True)
    if not len(crew) or not len(second):
        raise InputError(
            "No tree of the first date stands in the plots, or the second layer is empty: nothing to compare."
        )
    measured = gpd.GeoDataFrame(
        second[["tree_id", "x", "y", "dbh_cm", "qc_flag"]].assign(dbh_lo_cm=None, dbh_hi_cm=None),
        geometry=gpd.points_from_xy(second["x"], second["y"]),
        crs=after.crs,
    )
    found = match_plots(crew, measured, circles, options)
    offsets = {row["plot_id"]: (row["offset_e_m"], row["offset_n_m"], row["rot_deg"]) for row in found.plots}
    made = Joined(_table(first, second, found, plots, home, circles, offsets), offsets)
    open_ = {row["plot_id"] for row in found.plots if row["status"] == "check"}
    made.unpaired = [k for k, circle in enumerate(circles) if circle.plot_id in open_]
    made.trees.loc[made.trees["plot"].isin(made.unpaired), "kind"] = "unsure"
    if len(made.unpaired) == len(circles):
        why = "; ".join(dict.fromkeys(str(row["reason"]) for row in found.plots))
        raise InputError(
            f"The trees of both dates fit each other in no plot ({_in_these_words(why)}): check that both layers are "
            "of the same ground, their CRS and positions."
        )
    made.warnings += [_in_these_words(text) for text in found.warnings if "has no field tree" not in text]
    _judge(made.trees, min_dbh_cm, np.inf)
    grown = (made.trees["dbh2_cm"] - made.trees["dbh1_cm"])[made.trees["fate"] == "survivor"].to_numpy(float)
    if len(grown) >= ENOUGH:
        max_growth_cm = min(max_growth_cm, 1.5 * max(float(np.quantile(grown, 0.95)), 0.0))
    _judge(made.trees, min_dbh_cm, min_dbh_cm + max_growth_cm)
    _chances(made, min_dbh_cm + max_growth_cm)
    return made


def _chances(made: Joined, thickest_new_cm: float) -> None:
    """How many trees a flight misses, by the thick ones that are new; and what that makes of the others' fates.

    Both flights are taken to miss alike, thin and thick trees alike.
    """
    trees, fate = made.trees, made.trees["fate"]
    alive, thick = fate.isin(["survivor", "no growth"]), trees["dbh2_cm"] > thickest_new_cm
    made.n_missed = int((fate == "missed before").sum())
    seen = int((alive & thick).sum())
    made.miss = made.n_missed / (made.n_missed + seen) if made.n_missed + seen else 0.0
    # A Poisson number of missed trees; one more, so that none found is no proof that none was missed.
    error = float(np.sqrt(made.n_missed + 1)) / (made.n_missed + seen + 1)
    trees["chance"], trees["chance_sd"] = 1.0, 0.0
    lost = (fate == "mortality") & trees["after_id"].isna()
    new = (fate == "ingrowth") & trees["before_id"].isna()
    for mine, among in ((lost, alive), (new, alive & ~thick)):
        if mine.any():
            share = int(among.sum()) / int(mine.sum())
            trees.loc[mine, "chance"] = float(np.clip(1 - made.miss * share, LEAST_CHANCE, 1.0))
            trees.loc[mine, "chance_sd"] = min(error * share, 1.0)


def _in_these_words(text: str) -> str:
    """A remark of the pairing, which speaks of a field tally."""
    for old, new in (
        ("field trees", "trees of the first date"),
        ("field tree", "tree of the first date"),
        ("measured tree", "tree of the second date"),
        ("; look at the layer 'suggested', set the plot's status to ok (or draw two or more pairs) and run again", ""),
        ("check --north and the declination", "check both layers' CRS and positions"),
    ):
        text = text.replace(old, new)
    return text


def _circles(first: pd.DataFrame, second: pd.DataFrame, plots: list[SamplePlot]) -> list[Plot]:
    if plots:
        return [Plot(plot.plot_id, plot.x, plot.y, plot.reach_m) for plot in plots]
    if max(len(first), len(second)) > MOST_ALONE:
        raise InputError(
            f"The layers hold {len(first)} and {len(second)} trees, expected at most {MOST_ALONE} without plots; give "
            "--plots, to pair them plot by plot."
        )
    both = pd.concat([first[["x", "y"]], second[["x", "y"]]])
    if not len(both):
        raise InputError("Both tree layers are empty: there is nothing to compare.")
    x, y = (float((both[axis].min() + both[axis].max()) / 2) for axis in "xy")
    return [Plot("all", x, y, float(np.hypot(both["x"] - x, both["y"] - y).max()) + 1.0)]


def _table(first, second, found, plots, home, circles, offsets) -> pd.DataFrame:
    """One row a tree, fates still open."""
    by_first = {str(tree): k for k, tree in enumerate(first["tree_id"])}
    by_second = {int(tree): k for k, tree in enumerate(second["tree_id"])}
    rows: list[dict] = []
    done1, done2 = set[int](), set[int]()
    for kind, pairs in (("pair", found.pairs), ("unsure", found.suggested)):
        for pair in pairs:
            i, j = by_first[pair["field_id"]], by_second[int(pair["tree_id"])]
            if i not in done1 and j not in done2:
                done1.add(i)
                done2.add(j)
                rows.append({"i": i, "j": j, "kind": kind, "dist_m": pair["dist_m"], "margin": pair["margin"]})
    listed = {by_first[key] for key in found.field_trees["field_id"]}
    rows += [{"i": i, "j": -1, "kind": "lost"} for i in sorted(listed - done1)]
    rows += [{"i": -1, "j": j, "kind": "new"} for j in range(len(second)) if j not in done2]
    table = pd.DataFrame(rows, columns=["i", "j", "kind", "dist_m", "margin"])
    i, j = table["i"].to_numpy(int), table["j"].to_numpy(int)
    for name, trees, at in (("1", first, i), ("2", second, j)):
        for column, source in ((f"dbh{name}_cm", "dbh_cm"), (f"se{name}_cm", "dbh_se_cm")):
            table[column] = np.where(at >= 0, trees[source].to_numpy(float)[at], np.nan)
        table[f"dead{name}"] = np.where(at >= 0, trees["dead"].to_numpy(bool)[at], False).astype(bool)
    table["before_id"] = np.where(i >= 0, first["tree_id"].to_numpy(float)[i], np.nan)
    table["after_id"] = np.where(j >= 0, second["tree_id"].to_numpy(float)[j], np.nan)
    here = second[["x", "y"]].to_numpy(float)
    drawn = found.field_trees.set_index("field_id")[["x", "y"]]
    moved = drawn.reindex([str(tree) for tree in first["tree_id"]]).to_numpy(float)
    table[["x", "y"]] = np.where((j >= 0)[:, None], here[j], moved[i])
    # Plots are where they are on the first date's map: a tree that is new is taken back to it.
    plot = np.where(i >= 0, home[i], -1)
    for k in np.flatnonzero(i < 0):
        plot[k] = _home_of_new(here[j[k]], plots, circles, offsets)
    table["plot"] = plot
    return table[table["plot"] >= 0].reset_index(drop=True)


def _home_of_new(place: np.ndarray, plots: list[SamplePlot], circles: list[Plot], offsets: dict) -> int:
    if not plots:
        return 0
    for k, (plot, circle) in enumerate(zip(plots, circles, strict=True)):
        east, north, turn = offsets.get(plot.plot_id, (0.0, 0.0, 0.0))
        back = move((place - [circle.x + east, circle.y + north])[None], np.zeros(2), -turn)[0]
        if plot.contains(np.array([circle.x + back[0]]), np.array([circle.y + back[1]]))[0]:
            return k
    return -1


def _judge(table: pd.DataFrame, min_dbh_cm: float, thickest_new_cm: float) -> None:
    """Fill ``fate``. thickest_new_cm: a new tree above it was there before."""
    d1, d2 = table["dbh1_cm"].to_numpy(float), table["dbh2_cm"].to_numpy(float)
    kind, least = table["kind"].to_numpy(object), min_dbh_cm - 1e-9
    dead1, dead2 = table["dead1"].to_numpy(bool), table["dead2"].to_numpy(bool)
    low2 = d2 - HALF_WIDTH_SE * np.nan_to_num(table["se2_cm"].to_numpy(float))
    pair = kind == "pair"
    both = np.isfinite(d1) & np.isfinite(d2)
    conditions = {
        "unsure": kind == "unsure",
        "dead": dead1,
        "small": (pair & both & (d1 < least) & (d2 < least))
        | ((kind == "lost") & (d1 < least))
        | ((kind == "new") & (d2 < least)),
        "mortality": ((kind == "lost") & np.isfinite(d1)) | (pair & dead2 & ~(d1 < least)),
        "ingrowth": (pair & both & (d1 < least) & (d2 >= least))
        | ((kind == "new") & np.isfinite(d2) & ~dead2 & ~(low2 > thickest_new_cm)),
        "missed before": (kind == "new") & np.isfinite(d2) & ~dead2,
        "survivor": pair & both,
        "no growth": np.ones(len(table), bool),
    }
    table["fate"] = np.select(list(conditions.values()), list(conditions), "no growth")
