"""Tables of an Experiments section: blocks of a page, CSV, LaTeX."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from treedgs_geo.core.files import atomic_path
from treedgs_geo.core.tables import write_csv
from treedgs_geo.report.blocks import Column, Table, booktabs

#: The paper's short names: of the source (LiDAR, TreeDGS) and of the fit.
SOURCES = {"lidar": "L", "splats": "T"}
FITTED = {"cylinder": "Cyl", "circle": "CN", "weighted circle": "CW"}
#: Columns of the LaTeX tables of the ablation and of the stages' cost.
ABLATION_COLUMNS = ("setting", "value", "n", "mae_cm", "rmse_cm", "me_cm")
RUNTIME_COLUMNS = ("plot", "stage", "seconds", "peak_memory_mb")
#: Column -> its words on a page.
HEADS = {
    "mean_cm": "mean, cm",
    "sd_cm": "sd, cm",
    "low_cm": "smallest, cm",
    "high_cm": "largest, cm",
    "rmse_cm": "RMSE, cm",
    "rrmse_pct": "RRMSE, %",
    "mae_cm": "MAE, cm",
    "me_cm": "ME, cm",
    "paper_rmse_cm": "RMSE in the paper, cm",
    "paper_me_cm": "ME in the paper, cm",
    "f1": "F1",
    "iou": "IoU",
    "same_stem": "same stem",
    "peak_memory_mb": "peak memory, MB",
}


def methods_latex(rows: list[dict]) -> str:
    """The table in the paper's shape: plot, method, RMSE, RRMSE, MAE, ME, SR."""
    own = sorted((r for r in rows if r["subset"] == "own"), key=lambda r: (r["plot"] != "All", r["plot"]))
    shown = [{**r, "method": f"{SOURCES[r['source']]}-{FITTED[r['fit']]}", "sr": f"{r['n']}/{r['of']}"} for r in own]
    figures = [("rmse_cm", "RMSE"), ("rrmse_pct", "RRMSE"), ("mae_cm", "MAE"), ("me_cm", "ME"), ("sr", "SR")]
    columns = [Column("plot", "Plot"), Column("method", "Method"), *(Column(key, head, 2) for key, head in figures)]
    return booktabs(Table("methods", "", columns, shown), "plot")


def plain_latex(rows: list[dict], columns: tuple[str, ...]) -> str:
    """A LaTeX table of some columns: the first as text, the others as numbers of two decimals."""
    shown = [{key: str(v) if isinstance(v := row[key], int) else v for key in columns} for row in rows]
    heads = [Column(name, name, 2 if number else None) for number, name in enumerate(columns)]
    return booktabs(Table("plain", "", heads, shown))


def table_of(rows: list[dict], title: str = "") -> Table:
    """The rows as a block; figures with two decimals, small ones with two digits."""
    columns = [
        Column(name, HEADS.get(name, name), 2 if any(_is_number(row[name]) for row in rows) else None)
        for name in (rows[0] if rows else ())
    ]
    shown = [{name: _cell(value) for name, value in row.items()} for row in rows]
    return Table("", title, columns, shown, note="" if rows else "Nothing.")


def write_table(path: Path, rows: list[dict] | dict) -> None:
    """Rows, or columns, as CSV that no spreadsheet takes for formulas."""
    write_csv(path, pd.DataFrame(rows), float_format="%.4f")


def write_text(path: Path, text: str) -> None:
    """Whole or not at all, UTF-8."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool | np.bool_)


def _cell(value: Any) -> str | None:
    if value is None or (isinstance(value, float) and not np.isfinite(value)):
        return None
    if isinstance(value, bool | np.bool_):
        return "yes" if value else ""
    if isinstance(value, float):
        return f"{value:.2f}" if abs(value) >= 0.01 or value == 0 else f"{value:.2g}"
    return str(value)
