"""What the report says, in order: one list of blocks that the page and the PDF are both made from; its
pictures."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from shapely.geometry import MultiPoint

from ...report.blocks import Block, Cards, Document, Heading, Picture, Sentences, Table, facts_table
from ...report.charts import COLOURS, LIGHT_GREY, VERMILION, chart_png, draw_outline, new_chart, polygons_of
from .survey import Stand
from .tables import (
    correction_table,
    cross_table,
    equations_table,
    plots_table,
    species_class_table,
    stock_table,
    summary_table,
    trees_table,
)
from .units import UNITS


def make_document(stand: Stand, units: str, class_width: float | None, facts: dict[str, str]) -> Document:
    """Compose the report. facts: label -> value rows about inputs and settings."""
    long, equations = species_class_table(stand, units, class_width), equations_table(stand)
    by_unit = (make(stand, units) for make in (summary_table, plots_table, correction_table, trees_table))
    about = facts_table("about", "Inputs and settings", facts)
    tables = {table.name: table for table in (*by_unit, long, equations, about)}
    blocks: list[Block] = [
        Cards(_cards(stand, units)),
        Sentences(stand.warnings, "Read this first"),
        tables["summary"],
        Heading("Diameter distribution"),
        Picture("trees and basal area by DBH class and species", draw_classes(long, units)),
        stock_table(long),
    ]
    if len({row["species"] for row in long.rows} - {"all"}) > 1:
        shown = [name for name in ("trees", "ba", "volume") if np.isfinite(stand.estimates[name].mean)]
        blocks += [cross_table(long, units, name) for name in shown]
    pictures = {
        "map of the plots, coloured by basal area": draw_overview(stand),
        "trees of the plots; discs grow with DBH, numbers are DBH in cm": draw_plots(stand),
    }
    blocks += [Heading("Plots"), *(Picture(text, picture) for text, picture in pictures.items() if picture)]
    q, said = UNITS[units], [*stand.notes, *stand.values.curves]
    if len(stand.dead):
        said.append(
            f"Dead trees are no part of any figure above: {stand.dead_per_ha['trees'] * q['trees'].factor:.1f} "
            f"{q['trees'].unit}, {stand.dead_per_ha['ba'] * q['ba'].factor:.2f} {q['ba'].unit} (uncorrected)."
        )
    plot_columns = ["plot_id", "edge", "n_trees", "n_missing", q["area"].key, "expansion"]
    plot_columns += [q[name].key for name in ("trees", "ba", "qmd", "dominant", "volume", "biomass")]
    blocks += [
        tables["plots"].only(*plot_columns),
        Heading("How the figures were made"),
        tables["corrections"],
        Sentences(said),
    ]
    if equations.rows:
        blocks.append(equations.only("id", "n", "beyond", "range", "source"))
    blocks += [about, replace(tables["trees"], folded=True, more="stand_trees.csv and stand_table.xlsx")]
    kind = "census" if stand.design.census else f"{stand.design.n} plot{'s' if stand.design.n != 1 else ''}"
    area = f"{stand.design.areas.sum() * q['area'].factor:.3g} {q['area'].unit}"
    source = "field tally" if stand.from_field else "measured trees"
    return Document(
        f"Stand table: {stand.stand_id}",
        f"{kind}, {area} in all, from {source}",
        blocks,
        tables,
        letter=units == "us",
    )


def _cards(stand: Stand, units: str) -> list[tuple[str, str, str]]:
    """(label, value with unit, interval) of the figures that are known."""
    cards = []
    for name in ("trees", "ba", "qmd", "dominant", "volume", "biomass"):
        found, q = stand.estimates[name], UNITS[units][name]
        if not np.isfinite(found.mean):
            continue
        value, low, high = (
            f"{x * q.factor:,.{q.decimals}f}".replace(",", "\u202f") for x in (found.mean, found.low, found.high)
        )
        interval = ""
        # From one plot the interval is of measuring it; beside the stand's figure it would be taken for the stand's.
        one = stand.design.n == 1 and not stand.design.census
        if (not one or found.se_missing > 0) and np.isfinite(found.low) and np.isfinite(found.high):
            interval = f"{low} to {high}" + (" in this plot" if one else "")
        cards.append(("QMD" if name == "qmd" else q.label, f"{value} {q.unit}", interval))
    return cards


#: More plots than this are shown on the overview only.
_MAPS = 12


def draw_classes(long: Table, units: str) -> bytes:
    """PNG: trees and basal area by DBH class, stacked by species."""
    figure, axes = new_chart(9.2, 3.4, ncols=2)
    for axis, name in zip(axes, ("trees", "ba"), strict=True):
        table = cross_table(long, units, name)
        rows = table.rows[:-1]
        labels = [row["class"] for row in rows]
        base = np.zeros(len(rows))
        columns = [column for column in table.columns if column.key not in ("class", "all")]
        for k, column in enumerate(columns):
            heights = np.array([row.get(column.key, 0.0) for row in rows], float)
            colour = LIGHT_GREY if column.key == "other" else COLOURS[k % len(COLOURS)]
            axis.bar(labels, heights, 0.88, bottom=base, color=colour, label=column.heading)
            base += heights
        axis.set_xlabel(table.columns[0].heading)
        axis.set_ylabel(UNITS[units][name].heading)
        axis.grid(visible=False, axis="x")
        if len(labels) > 12:
            axis.set_xticks(range(0, len(labels), len(labels) // 10 + 1))
        if max(map(len, labels)) * len(labels) > 32:
            axis.tick_params(axis="x", labelrotation=45)
        if name == "trees":
            axis.legend(fontsize=9)
    return chart_png(figure)


def draw_overview(stand: Stand) -> bytes | None:
    """PNG: where the plots are, with the stand's boundary; None when nothing is on the map."""
    placed = [plot for plot in stand.plots if np.isfinite(plot.x)]
    if not placed or (len(placed) == 1 and stand.boundary is None):
        return None
    figure, axis = new_chart(6.4, 4.6)
    origin = np.array([[plot.x, plot.y] for plot in placed]).mean(axis=0).round()
    if stand.boundary is not None:
        draw_outline(axis, stand.boundary, origin, color="0.35", lw=1.6)
    density = dict(zip(stand.plot_rows["plot_id"], stand.plot_rows["ba_m2_ha"], strict=True))
    values = np.array([density[plot.plot_id] for plot in placed])
    from matplotlib import cm, colors, patheffects

    shade = cm.ScalarMappable(colors.Normalize(0, max(values.max(), 1e-9)), "viridis_r")
    for plot, value in zip(placed, values, strict=True):
        if plot.edge == "census":
            continue
        for part in polygons_of(plot.outline):
            xy = np.asarray(part.exterior.coords) - origin
            axis.fill(*xy.T, facecolor=shade.to_rgba(value), edgecolor="0.2", lw=0.8)
        # A small plot in a wide survey would be invisible at true size.
        axis.plot(plot.x - origin[0], plot.y - origin[1], "o", ms=5, color=shade.to_rgba(value), mec="0.2", mew=0.6)
        if len(placed) <= 40:
            white = [patheffects.withStroke(linewidth=2.5, foreground="white")]
            place = (plot.x - origin[0], plot.y - origin[1])
            axis.annotate(plot.plot_id, place, (6, 6), textcoords="offset points", fontsize=9, path_effects=white)
    if stand.design.census:
        _trees(axis, stand, 0, origin, 0.25)
    elif len(placed) > 1:
        figure.colorbar(shade, ax=axis, label="Basal area, m²/ha", shrink=0.7)
    axis.set_aspect("equal", adjustable="datalim")
    axis.margins(0.08)
    axis.set(xlabel=f"Easting − {origin[0]:.0f} m", ylabel=f"Northing − {origin[1]:.0f} m")
    return chart_png(figure)


def draw_plots(stand: Stand) -> bytes | None:
    """PNG: the trees of each plot, discs growing with DBH; None without positions or for a census."""
    placed = [(k, plot) for k, plot in enumerate(stand.plots) if np.isfinite(plot.x)]
    known = np.isfinite(stand.trees["x"].to_numpy(float))[stand.rows["tree"].to_numpy(int)]
    if stand.design.census or not placed or not (known & (stand.rows["kind"] == "measured")).any():
        return None
    placed = placed[:_MAPS]
    across = min(len(placed), 2 if len(placed) in (2, 4) else 3)
    down = -(-len(placed) // across)
    size = 5.8 if len(placed) == 1 else 9.2 / across
    figure, axes = new_chart(size * across, size * down + 0.5, nrows=down, ncols=across, squeeze=False)
    for axis in axes.ravel()[len(placed) :]:
        axis.set_visible(False)
    handles: dict[str, Any] = {}
    for axis, (k, plot) in zip(axes.ravel(), placed, strict=False):
        origin = np.array([plot.x, plot.y])
        draw_outline(axis, plot.outline, origin, color="0.35", lw=1.2)
        if stand.boundary is not None and plot.inside < 1:
            draw_outline(axis, stand.boundary, origin, color=VERMILION, lw=1.2, ls="--")
            handles.setdefault("stand's boundary", axis.plot([], [], color=VERMILION, ls="--")[0])
        handles.update(_trees(axis, stand, k, origin, 1.0 if len(placed) == 1 else 2.2 / across, len(placed) <= 4))
        axis.plot(0, 0, "+", color="0.5", ms=7)
        # Of a plot that is an area alone nothing but the trees says how far it reaches.
        mine = stand.trees[["x", "y"]].iloc[stand.rows["tree"][stand.rows["plot"] == k]].dropna()
        seen = plot.outline or MultiPoint([*mine.to_numpy(float), origin]).buffer(1.0)
        low_x, low_y, high_x, high_y = seen.bounds
        half = 0.55 * max(high_x - low_x, high_y - low_y)
        middle = np.array([low_x + high_x, low_y + high_y]) / 2 - origin
        axis.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half), aspect="equal")
        axis.set_title(f"{plot.plot_id}: {stand.plot_rows['n_trees'].iloc[k]} trees", fontsize=10)
        axis.tick_params(labelsize=8)
    axes[-1, 0].set_xlabel("m east of the centre", fontsize=9)
    axes[-1, 0].set_ylabel("m north of the centre", fontsize=9)
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize=9)
    return chart_png(figure)


def _trees(
    axis: Any, stand: Stand, plot: int, origin: np.ndarray, scale: float, labels: bool = False
) -> dict[str, Any]:
    """Draw one plot's trees; returns the legend's entries."""
    place = stand.trees[["x", "y"]].to_numpy(float) - origin
    species = stand.trees["species"].to_numpy(object)
    order = stand.rows["tree"].map(lambda k: species[int(k)]).value_counts().index.tolist()
    handles: dict[str, Any] = {}
    from .species import species_of

    counted = stand.rows[(stand.rows["plot"] == plot) & (stand.rows["kind"] == "measured")]["tree"].to_numpy(int)
    for k, name in enumerate(order):
        mine = counted[species[counted] == name]
        colour = COLOURS[k] if k < len(COLOURS) else LIGHT_GREY
        drawn = axis.scatter(
            *place[mine].T, s=scale * (stand.values.dbh[mine] / 2.2) ** 2, color=colour, alpha=0.85, lw=0, zorder=3
        )
        if len(mine):
            handles[species_of(name).label if k < len(COLOURS) else "other species"] = drawn
    if labels:
        for k in counted:
            # Beside the disc, whatever its size.
            gap = (2 + np.sqrt(scale) * stand.values.dbh[k] / 4.4, 3)
            axis.annotate(f"{stand.values.dbh[k]:.0f}", place[k], xytext=gap, textcoords="offset points", fontsize=7.5)
    for frame, label, mark, colour in (
        (stand.missing, "seen, without a DBH", "o", VERMILION),
        (stand.dead, "dead", "x", "#666666"),
    ):
        mine = frame.loc[frame["plot"] == plot, "tree"].to_numpy(int)
        if len(mine):
            face = {"facecolors": "none", "edgecolors": colour} if mark == "o" else {"color": colour}
            handles[label] = axis.scatter(*place[mine].T, s=40 * scale + 15, marker=mark, lw=1.4, zorder=4, **face)
    return handles
