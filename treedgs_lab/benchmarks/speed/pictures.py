"""The speed-accuracy chart: a static picture for print, and a page to point at."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

import numpy as np
import pandas as pd

from treedgs_geo.report.blocks import Block, Column, Document, Fragment, Heading, Paragraph, Sentences, Table, known
from treedgs_geo.report.charts import BLUE, GREEN, ORANGE, PURPLE, SKY, new_chart

# Okabe-Ito, each group with a mark of its own: the chart reads in grey too.
LOOKS = {
    "presets": ("#000000", "o"),
    "photos used": (BLUE, "s"),
    "pixels used": (SKY, "D"),
    "stem model": (GREEN, "v"),
    "reconstruction": (ORANGE, "P"),
    "LiDAR": (PURPLE, "^"),
    "published method": ("#7A3E00", "*"),
}
#: Half the size of a mark that names keep clear of, pixels.
MARK_PX = 6.0
#: Places of names beside their marks, the nearest first: points right and up, and which end is at the mark.
BESIDE = (
    *((7, 3, "left"), (7, -9, "left"), (-7, 3, "right"), (-7, -9, "right"), (0, 10, "center"), (0, -16, "center")),
    *((7, 14, "left"), (7, -20, "left"), (-7, 14, "right"), (-7, -20, "right"), (0, 22, "center"), (0, -28, "center")),
    *((9, 25, "left"), (9, -31, "left"), (-9, 25, "right"), (-9, -31, "right")),
)
#: Darker shades for words: light ones do not read in print.
WORDS = {"pixels used": "#1F6FA3", "reconstruction": "#8A6000", "LiDAR": "#96497A", "stem model": "#00694C"}


def draw_chart(table: pd.DataFrame, facts: dict[str, Any]) -> Any:
    """Seconds (log) against RMSE (log): a mark a configuration, hollow where it measures too few stems, the Pareto
    fronts (photos and LiDAR apart: other data) as steps, bars for the sampling error of the RMSE and the spread of the
    seconds."""
    figure, axes = new_panels(8.6, 5.6)
    draw_panel(axes, table, f"{facts['plots_text']}; {_cores(facts)}")
    finish(figure, axes)
    return figure


def new_panels(width: float, height: float, ncols: int = 1) -> tuple[Any, Any]:
    """A figure whose axes stay where they are: names are placed beside marks by the pixel."""
    figure, axes = new_chart(width, height, ncols=ncols)
    figure.set_layout_engine("none")
    figure.set_dpi(120)
    return figure, axes


def draw_panel(axes: Any, table: pd.DataFrame, title: str) -> None:
    """The marks of one chart of :func:`finish`. table: as :func:`.configurations.summarise` gives it."""
    from matplotlib.ticker import FuncFormatter, NullFormatter

    shown = table[table["rmse_cm"].notna()].copy()
    marks: list[tuple] = []
    for group, (colour, mark) in LOOKS.items():
        rows = shown[shown["group"] == group]
        if not len(rows):
            continue
        enough = rows["success"] >= 0.9 * shown["success"].max()
        spread = np.abs(rows[["seconds_lo", "seconds_hi"]].to_numpy(float).T - rows["seconds"].to_numpy(float))
        half = np.abs(rows[["rmse_lo", "rmse_hi"]].to_numpy(float).T - rows["rmse_cm"].to_numpy(float))
        axes.errorbar(
            rows["seconds"],
            rows["rmse_cm"],
            xerr=spread,
            yerr=half,
            fmt="none",
            ecolor=colour,
            alpha=0.35,
            elinewidth=1,
            zorder=2,
        )
        face = [colour if ok else "white" for ok in enough]
        axes.scatter([], [], marker=mark, s=58, c=colour, label=group)
        marks += [(row, mark, colour, fill) for (_, row), fill in zip(rows.iterrows(), face, strict=True)]
    for number, cloud in enumerate((False, True)):
        front = shown[shown["front"] & ((shown["group"] == "LiDAR") == cloud)].sort_values("seconds")
        if len(front):
            axes.step(
                front["seconds"],
                front["rmse_cm"],
                where="post",
                color="0.35",
                lw=1.4,
                ls="--",
                zorder=1,
                label="_" if number else "Pareto front",
            )
    axes.set_xscale("log")
    axes.set_yscale("log")
    low, high = shown["rmse_cm"].min() / 1.6, shown["rmse_cm"].max() * 1.5
    axes.set_ylim(low, high)
    axes.set_xlim(shown["seconds"].min() / 1.5, shown["seconds"].max() * 1.9)
    _place(axes, shown, marks)
    _label(axes, shown)
    ticks = [t for t in (0.1, 0.2, 0.3, 0.5, 0.7, 1, 2, 3, 5, 7, 10, 20, 30, 50) if low <= t <= high]
    axes.set_yticks(ticks, [f"{t:g}" for t in ticks])
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    times = [
        t for t in (1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600) if axes.get_xlim()[0] <= t <= axes.get_xlim()[1]
    ]
    axes.set_xticks(times, [_time(t) for t in times])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.tick_params(labelsize=8)
    axes.set_xlabel("time for one plot, reconstruction included")
    axes.set_ylabel("RMSE of DBH, cm")
    axes.set_title(title, fontsize=10, loc="left")


def finish(figure: Any, axes: Any) -> None:
    """Legend of one panel's marks, and what the marks say."""
    figure.legend(
        *axes.get_legend_handles_labels(),
        fontsize=8,
        loc="lower center",
        bbox_to_anchor=(0.5, 0.035),
        ncols=9,
        columnspacing=1.2,
        handletextpad=0.3,
    )
    figure.text(
        0.01,
        0.005,
        "Figures beside the marks: stems measured of those that 3 or more photos show clearly. "
        "Hollow: fewer than 0.9 of the best, or other data. Bars: 90 % interval of the RMSE, least and most seconds.\n"
        "Marks that would hide one another are moved sideways.",
        fontsize=7,
        color="0.3",
    )
    figure.tight_layout(rect=(0, 0.08, 1, 1))


def _place(axes: Any, shown: pd.DataFrame, marks: list[tuple]) -> None:
    """Draw the marks, moved sideways where one would hide another; ``shown`` learns where they stand."""
    taken: list[np.ndarray] = []
    for row, mark, colour, fill in sorted(marks, key=lambda item: item[0]["seconds"]):
        at = axes.transData.transform((row["seconds"], row["rmse_cm"]))
        while any(np.hypot(*(at - other)) < 2 * MARK_PX for other in taken):
            at = at + (2.0, 0.0)
        taken.append(at)
        seconds = axes.transData.inverted().transform(at)[0]
        shown.loc[row.name, "seconds"] = seconds
        axes.scatter(
            [seconds], [row["rmse_cm"]], marker=mark, s=58, c=fill, edgecolors=colour, linewidths=1.5, zorder=3
        )


def _label(axes: Any, shown: pd.DataFrame) -> None:
    """Names beside the marks, moved up or down where they would cover one another or a mark; presets choose first."""
    from matplotlib.transforms import Bbox

    axes.figure.canvas.draw()
    marks = axes.transData.transform(shown[["seconds", "rmse_cm"]].to_numpy(float))
    taken: list[Bbox] = [Bbox.from_bounds(x - MARK_PX, y - MARK_PX, 2 * MARK_PX, 2 * MARK_PX) for x, y in marks]
    renderer = axes.figure.canvas.get_renderer()
    order = shown.assign(later=shown["group"] != "presets").sort_values(["later", "group", "seconds"])
    for _, row in order.iterrows():
        count = "" if pd.isna(row["success"]) else f" {round(row['success'] * row['stems'])}/{row['stems']:.0f}"
        text = row["title"] + count
        bold = "bold" if row["group"] == "presets" else "normal"
        colour = WORDS.get(row["group"], LOOKS[row["group"]][0])
        note = axes.annotate(
            text,
            (row["seconds"], row["rmse_cm"]),
            xytext=(0, 0),
            textcoords="offset points",
            fontsize=7.2,
            color=colour,
            weight=bold,
        )
        # Where no place is free, the last one counts: beside the mark.
        for *note.xyann, align in (*BESIDE, BESIDE[0]):
            note.set_ha(align)
            box = note.get_window_extent(renderer)
            free = not any(box.overlaps(other) for other in taken)
            if free and axes.bbox.containsx(box.x0) and axes.bbox.containsx(box.x1):
                break
        taken.append(box)


def _time(seconds: float) -> str:
    return f"{seconds:g} s" if seconds < 60 else f"{seconds / 60:g} min"


COLUMNS = (
    Column("title", "configuration"),
    Column("group", "level"),
    Column("seconds", "s", 1),
    Column("sfm_s", "of it SfM s", 1),
    Column("peak_memory_mb", "MB", 0),
    Column("rmse_cm", "RMSE cm", 2),
    Column("me_cm", "mean cm", 2),
    Column("worst_cm", "worst cm", 2),
    Column("success", "success, %", 0, 100),
    Column("of_all", "of all stems, %", 0, 100),
    Column("ok_off_5cm", "ok but > 5 cm off", 0),
    Column("coverage", "in 90 %, %", 0, 100),
    Column("false", "false", 1),
    Column("megapixels", "megapixels", 1),
    Column("gaussians", "Gaussians", 0),
)


def report_blocks(
    table: pd.DataFrame, facts: dict[str, Any], knees: dict[str, str], each: dict[str, pd.DataFrame]
) -> list[Block]:
    """The tables for the docs, with what they were measured on. each: the table of each plot alone."""
    titles = dict(zip(table["key"], table["title"], strict=True))
    advice = "; ".join(f"`{preset}`: {titles[key]}" for preset, key in knees.items())
    notes = "" if not facts["left_out"] else f" Left out for lack of time: {', '.join(facts['left_out'])}."
    said = (
        f"{facts['plots_text']}; {_cores(facts)} of {facts['machine']['processor']}, "
        f"TreeDGS {facts['machine']['version']}; seed 0. "
        f"Recommended by the rule of the page: {advice or 'nothing'}.{notes}"
    )
    return [Paragraph(said), configurations(table), *_levels(table), *_by_plot(each)]


def configurations(table: pd.DataFrame) -> Table:
    """A row a configuration, quickest first; the front is marked."""
    rows = [
        {**row, "title": row["title"] + (" *" if row["front"] else "")}
        for row in table.sort_values("seconds").to_dict("records")
    ]
    note = (
        "* on the Pareto front. Success: stems with a DBH of those that three or more photos show clearly. s: median "
        "over the plots, reconstruction included."
    )
    return Table("configurations", "", list(COLUMNS), rows, note)


def _levels(table: pd.DataFrame) -> list[Table]:
    """What each configuration from photos gains and costs against ``balanced``, and whether it is more than chance."""
    if "balanced" not in set(table["key"]):
        return []
    base = table[table["key"] == "balanced"].iloc[0]
    rows = []
    for _, row in table[(table["group"] != "LiDAR") & (table["key"] != "balanced")].sort_values("group").iterrows():
        stems = round((row["success"] - base["success"]) * base["stems"])
        if not np.isfinite(row["rmse_cm"]):
            says = "measures nothing"
        elif row["rmse_lo"] > base["rmse_hi"]:
            says = "worse"
        elif row["rmse_hi"] < base["rmse_lo"]:
            says = "better"
        else:
            says = "no difference that this many stems can show"
        if stems:
            says += f", {abs(stems)} {'more' if stems > 0 else 'fewer'} stems measured"
        gained = {"seconds": row["seconds"] - base["seconds"], "rmse": known(row["rmse_cm"] - base["rmse_cm"])}
        rows.append({"group": row["group"], "title": row["title"], **gained, "stems": stems, "says": says})
    columns = [
        Column("group", "level"),
        Column("title", "configuration"),
        Column("seconds", "seconds", 0, signed=True),
        Column("rmse", "RMSE cm", 2, signed=True),
        Column("stems", "stems", 0, signed=True),
        Column("says", "says"),
    ]
    title = "Against `balanced` (a difference counts when the 90 % intervals of the two RMSEs do not meet)"
    return [Table("levels", title, columns, rows)]


def _by_plot(tables: dict[str, pd.DataFrame]) -> list[Table]:
    """The same configurations plot by plot, side by side: does a simulated plot say what a rendered one says?"""
    if len(tables) < 2:
        return []
    titles = {key: title for table in tables.values() for key, title in zip(table["key"], table["title"], strict=True)}
    rows = []
    for key, title in titles.items():
        cells: dict[str, Any] = {"title": title}
        for name, table in tables.items():
            for _, row in table[(table["key"] == key) & np.isfinite(table["rmse_cm"])].iterrows():
                stems = f"{round(row['success'] * row['stems'])} of {row['stems']}"
                cells[name] = f"{row['rmse_cm']:.2f} ({row['me_cm']:+.2f}), {stems}"
        rows.append(cells)
    columns = [Column("title", "configuration"), *(Column(name, name) for name in tables)]
    return [Table("plots", "RMSE cm (mean error), stems measured of those visible, plot by plot", columns, rows)]


def document(table: pd.DataFrame, facts: dict[str, Any], knees: dict[str, str]) -> Document:
    """A self-contained page: groups can be hidden, points show their figures."""
    data = json.loads(table.to_json(orient="records"))
    largest = max((row["success"] for row in data if row["rmse_cm"] is not None), default=0)
    for row in data:
        row["enough"] = row["success"] >= 0.9 * largest
    titles = dict(zip(table["key"], table["title"], strict=True))
    chart = files(__package__).joinpath("chart_page.html").read_text(encoding="utf-8")
    left = [f"Left out for lack of time: {', '.join(facts['left_out'])}."] if facts["left_out"] else []
    machine = ", ".join(f"{name} {value}" for name, value in facts["machine"].items())
    blocks: list[Block] = [
        Paragraph(
            "Filled: measures at least 0.9 of what the most successful one does. Dashed: Pareto fronts of photos and "
            "of LiDAR."
        ),
        Fragment(chart, {"data": data, "looks": {group: colour for group, (colour, _) in LOOKS.items()}}),
        Heading("Recommended"),
        Sentences([*(f"{preset}: {titles[key]}" for preset, key in knees.items()), *left]),
        configurations(table),
    ]
    subtitle = f"{facts['plots_text']}. {machine}"
    return Document("Speed against accuracy", subtitle, blocks)


def _cores(facts: dict[str, Any]) -> str:
    """``2 cores``."""
    count = facts["machine"]["cores"]
    return f"{count} core" if count == 1 else f"{count} cores"
