"""The report's table of trees, with what its script sorts and filters by."""

from __future__ import annotations

import html
from collections.abc import Mapping
from typing import Any

import geopandas as gpd
import pandas as pd

from ..stems.quality.reasons import explain
from .report_map import FLAGS

#: Heading, and how the script sorts the column: by number or by text.
COLUMNS = (
    ("tree", "number"),
    ("plot", "text"),
    ("DBH cm", "number"),
    ("standard error cm", "number"),
    ("90 % interval cm", "number"),
    ("flag", "number"),
    ("easting m", "number"),
    ("northing m", "number"),
    ("photos", "number"),
    ("points", "number"),
    ("reason and what to do", "text"),
)


def tree_rows(trees: gpd.GeoDataFrame, sheets: Mapping[int, str]) -> str:
    """``<tr>`` of every tree by number. sheets: address of each tree's sheet, relative to the page, already quoted."""
    return "".join(_row(tree, sheets) for _, tree in trees.sort_values("tree_id").iterrows())


def heads() -> str:
    """``<th>`` of every column, which sorts by it. No ``<button>``: not printed in the heads of further pages."""
    return "".join(
        f"<th aria-sort='none' data-kind='{kind}'><span role='button' tabindex='0'>{html.escape(name)}</span></th>"
        for name, kind in COLUMNS
    )


def empty_columns(trees: gpd.GeoDataFrame) -> str:
    """Classes of the table that hide columns in which nothing stands."""
    hidden = [name for name, column in (("nophotos", "n_views"), ("nopoints", "n_pts")) if trees[column].isna().all()]
    return " ".join(hidden)


def plot_options(trees: gpd.GeoDataFrame) -> str:
    """``<option>`` of every plot."""
    known = sorted({str(name) for name in trees["plot_id"] if pd.notna(name) and str(name)})
    return "".join(f"<option value='{html.escape(name)}'>{html.escape(name)}</option>" for name in known)


def flag_boxes(trees: gpd.GeoDataFrame) -> str:
    """A check box for every flag, with how many trees have it: the map's legend too."""
    boxes = []
    for flag, (colour, words) in FLAGS.items():
        n = int((trees["qc_flag"] == flag).sum())
        fill = "transparent" if flag == "reject" else colour
        boxes.append(
            f"<label><input type='checkbox' name='flag' value='{flag}' checked> "
            f"<i class='dot' style='background:{fill};border-color:{colour}'></i> {words} ({n})</label>"
        )
    return " ".join(boxes)


def _row(tree: pd.Series, sheets: Mapping[int, str]) -> str:
    has = pd.notna(tree["dbh_cm"])
    flag = tree["qc_flag"] if tree["qc_flag"] in FLAGS else "check"
    number = html.escape(str(tree["tree_id"]))
    address = sheets.get(tree["tree_id"])
    shown = f"<a href='{html.escape(address)}'>{number}</a>" if address else number
    plot = str(tree["plot_id"]) if pd.notna(tree["plot_id"]) else ""
    low, high = tree["dbh_lo_cm"], tree["dbh_hi_cm"]
    interval = has and pd.notna(low) and pd.notna(high)
    cells: list[tuple[str, Any]] = [
        (shown, tree["tree_id"]),
        (html.escape(plot), plot),
        _number(tree["dbh_cm"], 1),
        _number(tree["dbh_se_cm"] if has else None, 1),
        (f"{low:.1f} – {high:.1f}", high - low) if interval else ("", ""),
        (FLAGS[flag][1], list(FLAGS).index(flag)),
        _number(tree["x"], 2),
        _number(tree["y"], 2),
        _number(tree["n_views"], 0),
        _number(tree["n_pts"], 0),
        (html.escape(explain(tree["qc_reason"] or "")), ""),
    ]
    made = "".join(f"<td{_key(key)}>{text}</td>" for text, key in cells)
    dbh = f"{tree['dbh_cm']:.2f}" if has else ""
    sheet = f" data-sheet='{html.escape(address)}'" if address else ""
    return (
        f"<tr id='tree-{number}' class='{flag}' data-tree='{number}' data-flag='{flag}' "
        f"data-plot='{html.escape(plot)}' data-dbh='{dbh}'{sheet}>{made}</tr>\n"
    )


def _key(key: Any) -> str:
    """What the script sorts by, where it is not the text itself."""
    return "" if key == "" else f" data-key='{html.escape(str(key))}'"


def _number(value: Any, decimals: int) -> tuple[str, Any]:
    return ("", "") if pd.isna(value) else (f"{float(value):.{decimals}f}", float(value))
