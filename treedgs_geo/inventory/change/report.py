"""The page and the layer about two dates: one point a tree of either date, with what became of it."""

from __future__ import annotations

from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj

from ... import __version__
from ...report.blocks import Cards, Column, Document, Heading, Picture, Sentences, Table
from ...report.charts import BLUE, GREEN, LIGHT_GREY, PURPLE, SKY, VERMILION, chart_png, new_chart
from ..stand.estimate import Estimate
from .joining import FATES

LAYER = "change"
OWN_LAYERS = {LAYER: frozenset({"before_id", "after_id", "fate", "growth_cm"})}
_COLUMNS = (
    "plot_id", "before_id", "after_id", "fate", "dbh1_cm", "dbh2_cm", "growth_cm", "growth_se", "grow_lo", "grow_hi",
    "grow_cm_a", "ba_growth", "dist_m", "x", "y",
)  # fmt: skip
_DECIMALS = {"ba_growth": 5, **dict.fromkeys(("grow_cm_a", "x", "y", "dist_m"), 3)}
_DECIMALS |= dict.fromkeys(("dbh1_cm", "dbh2_cm", "growth_cm", "growth_se", "grow_lo", "grow_hi"), 2)
_LABELS = {
    "growth_cm_a": ("Growth of DBH, survivors", "cm a year"),
    "ba_growth": ("Basal area: growth of survivors", "m²/ha"),
    "ba_ingrowth": ("Basal area: ingrowth", "m²/ha"),
    "ba_mortality": ("Basal area: mortality", "m²/ha"),
    "ba_change": ("Basal area: net change", "m²/ha"),
    "trees_ingrowth": ("Trees: ingrowth", "per ha"),
    "trees_mortality": ("Trees: mortality", "per ha"),
    "trees_change": ("Trees: net change", "per ha"),
}
_COLOURS = {
    "survivor": BLUE,
    "ingrowth": GREEN,
    "mortality": VERMILION,
    "missed before": SKY,
    "no growth": LIGHT_GREY,
    "unsure": PURPLE,
    "small": "#cccccc",
    "dead": "#666666",
}


def change_table(trees: pd.DataFrame, plots: list[str], crs: pyproj.CRS | None) -> gpd.GeoDataFrame:
    """Columns of at most 10 characters, missing NULL."""
    ids = {name: pd.array(trees[name], dtype="Int64") for name in ("before_id", "after_id")}
    made = trees.assign(plot_id=np.array(plots, object)[trees["plot"].to_numpy(int)], **ids)
    made = made.rename(columns={"growth_cm_a": "grow_cm_a", "ba_growth_m2": "ba_growth"})[list(_COLUMNS)]
    made = made.round(_DECIMALS)
    return gpd.GeoDataFrame(made, geometry=gpd.points_from_xy(made["x"], made["y"]), crs=crs)


def make_change_document(
    table: gpd.GeoDataFrame,
    changes: dict[str, Estimate],
    counts: dict[str, int],
    warnings: list[str],
    notes: list[str],
    settings: Any,
) -> Document:
    """Compose the page; also the PDF's."""
    cards = []
    for name in ("growth_cm_a", "ba_growth", "ba_mortality", "ba_change"):
        if name in changes and np.isfinite(changes[name].mean):
            c, (label, unit) = changes[name], _LABELS[name]
            spread = f"{c.low:+.2f} to {c.high:+.2f}" if np.isfinite(c.low) else ""
            cards.append((label, f"{c.mean:+.2f} {unit}", spread))
    grown = table[table["fate"] == "survivor"]
    if not cards and len(grown):
        cards = [("Growth of DBH, survivors", f"{grown['grow_cm_a'].mean():+.2f} cm a year", f"{len(grown)} trees")]
    cards += [
        (fate.capitalize(), str(counts[fate]), "trees")
        for fate in ("survivor", "ingrowth", "mortality")
        if fate in counts
    ]
    level = f"{settings.confidence_pct:g} %"
    figures = Table(
        "changes",
        f"Change over {settings.years:g} years",
        [
            Column("what", "Figure"),
            Column("mean", "Change", 3),
            Column("year", "a year", 3),
            Column("se_plots", "s.e. between plots", 3),
            Column("se_trees", "s.e. of tree DBHs", 3),
            Column("se_common", "s.e. of shared errors", 3),
            Column("se", "s.e. in all", 3),
            Column("low", f"{level} from", 3),
            Column("high", f"{level} to", 3),
        ],
        [
            {
                **vars(found),
                "what": f"{_LABELS[name][0]}, {_LABELS[name][1]}",
                "year": None if name == "growth_cm_a" else found.mean / settings.years,
            }
            for name, found in changes.items()
        ],
        "Components of change (Beers 1962): growth of survivors + ingrowth − mortality = net change. A tree that grew "
        "over the smallest DBH brings its whole basal area. What the DBHs' own errors add to squared diameters is "
        "taken off. How many of the lost trees were only missed is part of the shared errors.",
    )
    fates = Table(
        "fates",
        "What became of the trees",
        [Column("fate", "Fate"), Column("n", "Trees", 0), Column("means", "Means")],
        [{"fate": fate, "n": counts[fate], "means": FATES[fate]} for fate in FATES if fate in counts],
    )
    ids = {name: table[name].astype("string").fillna("") for name in ("before_id", "after_id")}
    trees = Table(
        "change_trees",
        "",
        [
            Column("plot_id", "Plot"),
            Column("before_id", "Number, first"),
            Column("after_id", "second"),
            Column("fate", "Fate"),
            Column("dbh1_cm", "DBH first, cm", 1),
            Column("dbh2_cm", "second", 1),
            Column("growth_cm", "Growth, cm", 1),
            Column("grow_lo", "from", 1),
            Column("grow_hi", "to", 1),
        ],
        table.assign(**ids)[table["fate"] != "small"].to_dict("records"),
    )
    facts = [
        f"Shared errors: a bias of {settings.common_se_cm:g} cm (standard error) of each date's DBHs; relative error "
        f"of each block's lengths {settings.block_before_pct:g} % and {settings.block_after_pct:g} %. They do not "
        "average out over trees.",
        "A new tree that is thicker than any can have grown (1.5 times the survivors' 95 % quantile, at most "
        f"{settings.max_yearly_growth_cm:g} cm a year, over the smallest DBH) was missed at the first date. Their "
        "share among the thick trees says how many of the lost and of the thin new ones were only missed; each counts "
        "by that chance.",
        "Trees are paired by position alone, as field plots are (docs/technician/pairing.md).",
    ]
    return Document(
        f"Two dates: {settings.before.stem} and {settings.after.stem}",
        f"{settings.years:g} years; intervals are {level}; TreeDGS {__version__}",
        [
            Cards(cards),
            Sentences(warnings, "Read this first"),
            *([figures] if changes else []),
            fates,
            Picture("growth over DBH, and a map of what became of each tree", _draw(table)),
            Heading("How the figures were made"),
            Sentences([*notes, *facts]),
            Heading("Trees"),
            trees,
        ],
    )


def _draw(table: gpd.GeoDataFrame) -> bytes:
    """PNG: growth over the first DBH with intervals; the map of fates."""
    figure, axes = new_chart(9.2, 4.2, ncols=2)
    grown = table[table["fate"] == "survivor"]
    axes[0].axhline(0, color="0.6", lw=1)
    half = np.nan_to_num((grown["grow_hi"] - grown["grow_lo"]).to_numpy(float) / 2)
    axes[0].errorbar(
        grown["dbh1_cm"], grown["growth_cm"], yerr=half, fmt="o", ms=3.5, elinewidth=0.8, color=BLUE, alpha=0.8
    )
    axes[0].set(xlabel="DBH at the first date, cm", ylabel="Growth, cm")
    origin = table[["x", "y"]].mean().round(0).to_numpy(float) if len(table) else np.zeros(2)
    for fate, colour in _COLOURS.items():
        mine = table[table["fate"] == fate]
        if not len(mine):
            continue
        across = mine["dbh2_cm"].fillna(mine["dbh1_cm"]).fillna(12.0).to_numpy(float)
        marker = "x" if fate in ("mortality", "dead") else "o"
        axes[1].scatter(
            mine["x"] - origin[0],
            mine["y"] - origin[1],
            s=(across / 3.2) ** 2 + 6,
            color=colour,
            marker=marker,
            alpha=0.85,
            lw=1.2 if marker == "x" else 0,
            label=f"{fate} ({len(mine)})",
        )
    axes[1].set_aspect("equal", adjustable="datalim")
    axes[1].set(xlabel=f"Easting − {origin[0]:.0f} m", ylabel=f"Northing − {origin[1]:.0f} m")
    if len(table):
        figure.legend(*axes[1].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8)
    return chart_png(figure)
