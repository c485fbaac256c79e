"""The drawn trees in the order of a walk; the form to print: of each plot a map, the trees to tape with room for what
is read, and those that are missing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj

from ...core.frames import moved
from ...core.plots import Plot, short_way
from ...report.blocks import Block, Column, Document, Heading, Paragraph, Picture, Sentences, Table
from ...report.charts import chart_png, draw_outline, new_chart
from ..double_sampling.designs import Draw
from ..field_trees import bearing_to_grid_deg
from ..options import Bearings
from ..stand.treelist import TreeList

#: Trees of a page where there are no plots.
PER_PAGE = 14
#: The size that the form shows is rounded to this, so that nobody reads the tape towards it.
ABOUT_CM = 5.0


@dataclass(frozen=True)
class Sheet:
    """One page: the drawn trees of a plot (``trees``: rows of :func:`walk`), or of a piece of the walk."""

    title: str
    plot_id: str | None
    x: float
    y: float
    reach_m: float
    trees: pd.DataFrame


def walk(frame: TreeList, draw: Draw, protocol: Bearings, day: str, path: Path) -> pd.DataFrame:
    """The drawn trees: ``walk`` (1 is first), ``tree_id, plot_id, about_cm`` (NaN: no DBH), ``qc_flag, azim_deg,
    dist_m`` (from the plot's centre; NaN without plots), ``x, y, lon, lat`` (WGS 84), ``stratum, prob, dbh_cm``.

    Plot after plot, in each clockwise from north; without plots from tree to nearest tree.

    Raises:
        InputError: magnetic bearings without a date or declination.
    """
    assert frame.crs is not None
    trees = frame.trees.iloc[draw.index].reset_index(drop=True)
    made = trees[["tree_id", "plot_id", "qc_flag", "x", "y", "dbh_cm"]].copy()
    made["stratum"], made["prob"] = draw.stratum, draw.prob
    # Whole numbers: a point in them would stand beside the commas that a crew may type.
    made["about_cm"] = (np.round(made["dbh_cm"] / ABOUT_CM) * ABOUT_CM).astype("Int64")
    made["azim_deg"] = made["dist_m"] = np.nan
    for plot in frame.plots:
        mine = (made["plot_id"] == plot.plot_id).to_numpy()
        if not mine.any():
            continue
        east, north = made.loc[mine, "x"] - plot.x, made.loc[mine, "y"] - plot.y
        turn = bearing_to_grid_deg(Plot(plot.plot_id, plot.x, plot.y, 1.0), frame.crs, protocol, day, path)
        made.loc[mine, "azim_deg"] = (np.degrees(np.arctan2(east, north)) + turn) % 360
        made.loc[mine, "dist_m"] = np.hypot(east, north)
    place = made[["x", "y"]].to_numpy(float)
    # NaN where the CRS is not tied to the earth.
    degrees = (
        np.full_like(place, np.nan) if frame.crs.geodetic_crs is None else moved(place, frame.crs, pyproj.CRS(4326))
    )
    made[["lon", "lat"]] = np.where(np.isfinite(degrees).all(axis=1, keepdims=True), degrees, np.nan)
    made = made.iloc[_order(made, frame)].reset_index(drop=True)
    made.insert(0, "walk", np.arange(1, len(made) + 1))
    return made


def sheets(frame: TreeList, trees: pd.DataFrame) -> list[Sheet]:
    """The form's pages, in the order of the walk."""
    made: list[Sheet] = []
    if trees["plot_id"].notna().all():
        centres = {plot.plot_id: plot for plot in frame.plots}
        for name, mine in trees.groupby("plot_id", sort=False):
            known = centres.get(name)
            around = frame.trees[frame.trees["plot_id"] == name]
            x, y = (known.x, known.y) if known else (float(around["x"].mean()), float(around["y"].mean()))
            reach = float(np.hypot(around["x"] - x, around["y"] - y).max()) + 1.0
            if known is not None and np.isfinite(known.radius_m):
                reach = max(reach, known.radius_m)
            made.append(Sheet(f"Plot {name}", str(name), x, y, reach, mine))
        return made
    for first in range(0, len(trees), PER_PAGE):
        mine = trees.iloc[first : first + PER_PAGE]
        x, y = (float((mine[axis].min() + mine[axis].max()) / 2) for axis in "xy")
        reach = max(float(np.abs(mine["x"] - x).max()), float(np.abs(mine["y"] - y).max())) + 8.0
        title = f"Trees {mine['walk'].iloc[0]} to {mine['walk'].iloc[-1]} of the walk"
        made.append(Sheet(title, None, x, y, reach, mine))
    return made


def _order(trees: pd.DataFrame, frame: TreeList) -> np.ndarray:
    if trees["plot_id"].notna().all():
        names = [plot.plot_id for plot in frame.plots] or sorted(trees["plot_id"].unique())
        rank = trees["plot_id"].map({name: k for k, name in enumerate(names)}).to_numpy(float)
        middle = frame.trees.groupby("plot_id")[["x", "y"]].mean().reindex(trees["plot_id"]).to_numpy()
        turn = np.degrees(np.arctan2(*(trees[["x", "y"]].to_numpy(float) - middle).T)) % 360
        bearing = np.where(trees["azim_deg"].notna(), trees["azim_deg"], turn)
        return np.lexsort([bearing, rank])
    place = trees[["x", "y"]].to_numpy(float)
    return np.array(short_way(place, int(place.sum(axis=1).argmin())))


#: Empty rows for trees that are not on the map.
EXTRA_ROWS = 4
_DRAWN, _OTHER = "#17753c", "#9aa39d"


def make_form(
    title: str, subtitle: str, frame: TreeList, pages: list[Sheet], breast_height_m: float, north: str
) -> Document:
    """The form; printed, each of its pages begins a sheet of paper. north: what bearings are against."""
    sizes = any(page.trees["about_cm"].notna().any() for page in pages)
    rules = _rules(breast_height_m, north, all(page.plot_id is not None for page in pages), sizes)
    blocks: list[Block] = [Sentences(rules)]
    for number, page in enumerate(pages):
        blocks += [
            Heading(page.title, new_page=number > 0),
            Paragraph("Date ______________ Crew ______________________________"),
            # The rules take room from the first sheet.
            Picture("map of the trees", _draw(frame, page), 0.68 if number else 0.55),
            _to_tape(page, sizes),
            _missing(page.plot_id is not None),
        ]
    return Document(title, subtitle, blocks)


def _to_tape(page: Sheet, sizes: bool) -> Table:
    """The trees of a page; empty cells are for the crew, ``□`` for ticks. sizes: whether to show them;
    without, there is room for a second tape."""
    where = [("x", "East", 0.1), ("y", "North", 0.11)]
    if page.plot_id is not None:
        where = [("azim", "Bearing °", 0.1), ("dist", "Distance m", 0.1)]
    columns = [
        ("tree", "Tree", 0.09), *where, *([("about", "About cm", 0.08)] if sizes else []),
        ("taped", "Taped DBH, cm", 0.17 if sizes else 0.13), *([] if sizes else [("second", "Second tape, cm", 0.12)]),
        ("none", "none", 0.065), ("dead", "dead", 0.065), ("not_reached", "not reached", 0.09),
        ("note", "Note", 0.23),
    ]  # fmt: skip
    rows = [
        {
            "tree": str(tree.tree_id),
            "azim": "–" if pd.isna(tree.azim_deg) else f"{tree.azim_deg % 360:.0f}",
            "dist": "–" if pd.isna(tree.azim_deg) else f"{tree.dist_m:.1f}",
            "x": f"{tree.x:.1f}",
            "y": f"{tree.y:.1f}",
            "about": "no DBH" if pd.isna(tree.about_cm) else f"{tree.about_cm:.0f}",
            **dict.fromkeys(("none", "dead", "not_reached"), "□"),
            **dict.fromkeys(("taped", "second", "note"), ""),
        }
        for tree in page.trees.itertuples()
    ]
    shares = tuple(share for *_, share in columns)
    return Table("", "", [Column(key, heading) for key, heading, _ in columns], rows, widths=shares)


def _missing(with_plots: bool) -> Table:
    search, where = "searched around every tree □", "Beside which tree of the list (near_id)"
    if with_plots:
        search, where = "the whole plot was searched □", "Where (bearing, distance)"
    columns = [Column("where", where), Column("taped", "Taped DBH, cm"), Column("note", "Note")]
    title, empty = f"Trees that are not on the map ({search})", [dict.fromkeys(("where", "taped", "note"), "")]
    return Table("", title, columns, empty * EXTRA_ROWS, widths=(0.4, 0.2, 0.4))


def _rules(breast_height_m: float, north: str, with_plots: bool, sizes: bool) -> list[str]:
    """What a crew has to know. sizes: whether the form shows any."""
    where, search = "the plot's number", "Look through the whole plot for trees that the map lacks"
    if not with_plots:
        where = "the number of the nearest tree of the list (near_id)"
        search = "Look around each tree of the list for trees that the map lacks and that stand nearer to it than to "
        search += "any other tree of the map"
    bearing = {"true": "true north", "grid": "grid north", "magnetic": "magnetic north (as the compass shows)"}[north]
    return [
        f"Tape every tree of the list at {breast_height_m:g} m above the ground, on the uphill side, to the millimetre "
        "(31.4 cm). No other tree instead of one that is hard to reach: the choice is what makes the result fair.",
        "No tree there: tick “none”. Dead: tick “dead”, and tape it. Not reached: tick that; nothing is assumed of it.",
        f"{search}, tape them and write them below with {where}. None found is a result too: tick “searched”.",
        *([f"Bearings are from the plot's centre, against {bearing}; distances are horizontal."] if with_plots else []),
        *(["“About” is what was measured, rounded to 5 cm, to tell neighbours apart."] if sizes else []),
    ]


def _draw(frame: TreeList, sheet: Sheet) -> bytes:
    """PNG: the map of one page; trees to tape in colour with their numbers, the others grey."""
    from matplotlib import patheffects

    figure, axis = new_chart(6.4, 6.0)
    origin = np.array([sheet.x, sheet.y])
    half = 1.06 * sheet.reach_m
    place = frame.trees[["x", "y"]].to_numpy(float) - origin
    near = (np.abs(place) <= half).all(axis=1)
    drawn = frame.trees["tree_id"].isin(sheet.trees["tree_id"]).to_numpy()
    across = frame.trees["dbh_cm"].fillna(12.0).to_numpy(float)
    # Discs at 2.5 times their true size: a stem is small on a map of a plot.
    points = (across / 100 * 2.5 / (2 * half) * 6.0 * 72) ** 2
    for mine, colour in ((near & ~drawn, _OTHER), (near & drawn, _DRAWN)):
        hollow = frame.trees["dbh_cm"].isna().to_numpy()
        axis.scatter(*place[mine & ~hollow].T, s=points[mine & ~hollow], color=colour, lw=0, zorder=3)
        axis.scatter(*place[mine & hollow].T, s=60, facecolors="none", edgecolors=colour, lw=1.6, zorder=3)
    white = [patheffects.withStroke(linewidth=2.5, foreground="white")]
    n_labels = int((near & ~drawn).sum())
    for k in np.flatnonzero(near):
        if not drawn[k] and n_labels > 90:
            continue
        gap = (2 + np.sqrt(points[k]) / 2, 2)
        axis.annotate(
            str(frame.trees["tree_id"].iloc[k]), place[k], xytext=gap, textcoords="offset points", path_effects=white,
            fontsize=11 if drawn[k] else 6.5, fontweight="bold" if drawn[k] else "normal",
            color="black" if drawn[k] else "0.45", zorder=5 if drawn[k] else 4,
        )  # fmt: skip
    for plot in frame.plots:
        if plot.outline is not None:
            draw_outline(axis, plot.outline, origin, color="0.3", lw=1.1)
    if sheet.plot_id is not None:
        axis.plot(0, 0, "+", color="black", ms=11, mew=1.4, zorder=6)
    axis.set(xlim=(-half, half), ylim=(-half, half), aspect="equal")
    axis.annotate(
        "N", (0.96, 0.985), (0.96, 0.90), xycoords="axes fraction", ha="center", fontsize=11,
        arrowprops={"arrowstyle": "-|>", "color": "black"},
    )  # fmt: skip
    axis.set_xlabel("m east of the centre" if sheet.plot_id else f"m east of {sheet.x:.0f}", fontsize=8)
    axis.set_ylabel("m north of the centre" if sheet.plot_id else f"m north of {sheet.y:.0f}", fontsize=8)
    axis.tick_params(labelsize=8)
    axis.spines[["top", "right"]].set_visible(True)
    return chart_png(figure)
