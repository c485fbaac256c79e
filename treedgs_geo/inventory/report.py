"""One self-contained page about a run: the map of stems, each DBH, what was modelled and what it cost."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote

import geopandas as gpd
import numpy as np
import pandas as pd

from ..core.calibration import CALIBRATION, NETWORK, TAPE
from ..core.plots import Plot
from ..core.shown import half_up, shown_cm
from ..report.blocks import (
    Block,
    Column,
    Document,
    Fragment,
    Heading,
    Paragraph,
    Picture,
    Sentences,
    Table,
    facts_table,
    known,
)
from ..report.charts import FLAGS, chart_png
from ..report.html import write_html
from ..stems.quality.reasons import explain
from .charts import draw_diameters

#: Heading of each column of the table of trees, and how the script sorts it: by number or by text.
COLUMNS = (
    ("tree", "number"), ("plot", "text"), ("DBH cm", "number"), ("standard error cm", "number"),
    ("90 % interval cm", "number"), ("height m", "number"), ("flag", "number"), ("easting m", "number"),
    ("northing m", "number"), ("photos", "number"), ("points", "number"), ("reason and what to do", "text"),
)  # fmt: skip
#: Drawing units of the map's longer side, and what is left free around the stems.
_SIDE, _FREE = 760.0, 44.0
#: A stem without a DBH is drawn as one of this many centimetres; drawing units a centimetre, and the smallest disc.
_UNKNOWN_CM, _UNITS_CM, _MIN_UNITS = 12.0, 0.2, 2.5
#: Beyond this many stems numbers are shown for the marked one only.
_MAX_LABELS = 160
#: Where the stand in 3D is.
_LINK = "<p><a href='{{ to }}'><b>The stand in 3D</b></a>: stems, ground, points and crowns, to turn and to click.</p>"


def write_report(
    path: Path,
    trees: gpd.GeoDataFrame,
    plots: list[Plot],
    facts: dict[str, Any],
    warnings: list[str],
    stages: dict[str, dict[str, Any]],
    sheets: Mapping[int, Path] | None = None,
    view: Path | None = None,
) -> Path:
    """Write the page. facts: label -> value rows of the run card; stages: name -> ``seconds``, ``peak_memory_mb``.
    sheets: ``tree_id`` -> evidence sheet, and view, the stand in 3D: to be linked from where the page lies."""
    summary = "No stem was found; the reason is below."
    found: list[Block] = []
    if len(trees):
        n_measured, n_check = int(trees["dbh_cm"].notna().sum()), int((trees["qc_flag"] == "check").sum())
        summary = (
            f"{n_measured} stems have a DBH ({n_check} of them to check); {len(trees) - n_measured} more were found "
            "and refused, with the reason below. Stems that were not found are in no list: how many there are, only "
            "trees counted in the field can show (Pair field and measured trees)."
        )
        addresses = {number: address(sheet, path) for number, sheet in (sheets or {}).items()}
        template = (files(__package__) / "templates" / "report_trees.html").read_text(encoding="utf-8")
        found = [
            Heading("Trees"),
            Fragment(template, {**_table_values(trees, addresses), "map": _map_values(trees, plots)}),
            Heading("Diameters"),
            Picture("number of stems by diameter class", chart_png(draw_diameters(trees), 110)),
        ]
    network = NETWORK if trees["method"].str.startswith("photos").any() else ""
    cost = [{"stage": name, **stage} for name, stage in stages.items() if "seconds" in stage]
    columns = [
        Column("stage", "Stage"),
        Column("seconds", "Seconds", 1),
        Column("peak_memory_mb", "Peak memory so far, MB", 0),
    ]
    links: list[Block] = [Fragment(_LINK, {"to": address(view, path)})] if view else []
    blocks: list[Block] = [
        *links,
        Paragraph(f"{CALIBRATION} {network} {TAPE}"),
        Sentences(warnings, "Warnings"),
        *found,
        facts_table("run", "This run", facts),
        Table("cost", "Cost", columns, cost),
    ]
    return write_html(path, Document("Tree diameters", summary, blocks, wide=True))


def extent(trees: pd.DataFrame, plots: Sequence[Plot]) -> tuple[np.ndarray, np.ndarray]:
    """(2,) lower left and upper right corner of stems and plots."""
    centres, radii = np.array([(p.x, p.y) for p in plots]).reshape(-1, 2), np.array([[p.radius_m] for p in plots])
    every = np.vstack([trees[["x", "y"]].to_numpy(float), *([centres - radii, centres + radii] if len(plots) else [])])
    return every.min(axis=0), every.max(axis=0)


def _map_values(trees: gpd.GeoDataFrame, plots: list[Plot]) -> dict[str, Any]:
    """Of the map: discs grow with DBH, stems without a DBH are hollow, small ones lie on top, so that none is hidden;
    plots are dashed, north is up. In drawing units, y down."""
    low, high = extent(trees, plots)
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), 1.0)
    low, size = middle - half, 2 * half
    scale = (_SIDE - 2 * _FREE) / float(size.max())
    width, height = (scale * size + 2 * _FREE).tolist()

    def place(x: float, y: float) -> dict[str, float]:
        return {"x": round(_FREE + scale * (x - low[0]), 1), "y": round(height - _FREE - scale * (y - low[1]), 1)}

    stems = []
    for tree in trees.sort_values("dbh_cm", ascending=False, kind="stable").itertuples():
        flag = _flag(tree.qc_flag)
        dbh = known(tree.dbh_cm)
        said = f"tree {tree.tree_id}: " + ("" if dbh is None else f"{shown_cm(dbh)} cm, ") + FLAGS[flag][1]
        radius = round(max(_UNITS_CM * (dbh or _UNKNOWN_CM), _MIN_UNITS), 1)
        stems.append({**place(tree.x, tree.y), "number": tree.tree_id, "flag": flag, "r": radius, "said": said})
    circles = []
    for plot in plots:
        at, radius = place(plot.x, plot.y), round(plot.radius_m * scale, 1)
        circles.append({**at, "r": radius, "top": round(max(at["y"] - radius - 5, 12), 1), "name": plot.plot_id})
    bar_m = next(m for m in (1000, 500, 200, 100, 50, 20, 10, 5, 2, 1) if m * scale <= 0.3 * _SIDE or m == 1)
    return {
        "width": round(width),
        "height": round(height),
        "plots": circles,
        "stems": stems,
        "quiet": len(trees) > _MAX_LABELS,
        "bar_m": bar_m,
        "bar_end": round(12 + bar_m * scale, 1),
        "foot": round(height - 12),
        "north": round(width - 16),
    }


def _table_values(trees: gpd.GeoDataFrame, sheets: Mapping[int, str]) -> dict[str, Any]:
    """Of the table of trees and its filters. sheets: address of each tree's sheet, relative to the page, quoted."""
    return {
        "flags": FLAGS,
        "counts": {flag: int((trees["qc_flag"] == flag).sum()) for flag in FLAGS},
        "plot_names": sorted({str(name) for name in trees["plot_id"] if pd.notna(name) and str(name)}),
        "columns": COLUMNS,
        # Classes that hide columns in which nothing stands.
        "empty": " ".join(
            name
            for name, column in (("noheights", "height_m"), ("nophotos", "n_views"), ("nopoints", "n_pts"))
            if trees[column].isna().all()
        ),
        "rows": [_row(tree, sheets.get(tree["tree_id"], "")) for _, tree in trees.sort_values("tree_id").iterrows()],
    }


def _row(tree: pd.Series, sheet: str) -> dict[str, Any]:
    """A tree's row: its cells are texts with what they are sorted by ('': the text itself)."""
    dbh, low, high = known(tree["dbh_cm"]), known(tree["dbh_lo_cm"]), known(tree["dbh_hi_cm"])
    flag = _flag(tree["qc_flag"])
    plot = str(tree["plot_id"]) if pd.notna(tree["plot_id"]) else ""
    interval: tuple[str, Any] = ("", "")
    if dbh is not None and low is not None and high is not None:
        interval = f"{shown_cm(low)} – {shown_cm(high)}", high - low
    return {
        "number": tree["tree_id"],
        "flag": flag,
        "plot": plot,
        "dbh": "" if dbh is None else f"{dbh:.2f}",
        "sheet": sheet,
        "cells": [
            (tree["tree_id"], tree["tree_id"]),
            (plot, plot),
            _number(dbh, 1),
            _number(None if dbh is None else tree["dbh_se_cm"], 1),
            interval,
            _number(tree["height_m"], 1),
            (FLAGS[flag][1], list(FLAGS).index(flag)),
            _number(tree["x"], 2),
            _number(tree["y"], 2),
            _number(tree["n_views"], 0),
            _number(tree["n_pts"], 0),
            (explain(tree["qc_reason"] or ""), ""),
        ],
    }


def _flag(flag: str) -> str:
    return flag if flag in FLAGS else "check"


def _number(value: Any, decimals: int) -> tuple[str, Any]:
    return ("", "") if pd.isna(value) else (f"{half_up(float(value), decimals):.{decimals}f}", float(value))


def address(file: Path, page: Path) -> str:
    """A file as a page links to it: relative, so that both can be moved together."""
    try:
        return quote(Path(os.path.relpath(file, Path(page).absolute().parent)).as_posix())
    except ValueError:  # another drive
        return Path(file).absolute().as_uri()
