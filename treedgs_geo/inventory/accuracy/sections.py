"""Parts of an Experiments section: tables as CSV, LaTeX and HTML, charts as SVG and PNG."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ...core.files import atomic_path
from ...core.tables import safe_frame
from . import charts

LABELS = {
    ("lidar", "cylinder"): "L-Cyl",
    ("lidar", "circle"): "L-CN",
    ("lidar", "weighted circle"): "L-CW",
    ("splats", "cylinder"): "T-Cyl",
    ("splats", "circle"): "T-CN",
    ("splats", "weighted circle"): "T-CW",
}


def methods_latex(rows: list[dict]) -> str:
    """The table in the paper's shape: plot, method, RMSE, RRMSE, MAE, ME, SR."""
    lines = [r"\begin{tabular}{llrrrrr}", r"\toprule", r"Plot & Method & RMSE & RRMSE & MAE & ME & SR \\"]
    last = None
    for row in sorted((r for r in rows if r["subset"] == "own"), key=lambda r: (r["plot"] != "All", r["plot"])):
        if row["plot"] != last:
            lines.append(r"\midrule")
            last = row["plot"]
        figures = " & ".join(
            "--" if row[k] is None else f"{row[k]:.2f}" for k in ("rmse_cm", "rrmse_pct", "mae_cm", "me_cm")
        )
        plot = str(row["plot"]).replace("_", r"\_")
        lines.append(rf"{plot} & {LABELS[row['source'], row['fit']]} & {figures} & {row['n']}/{row['of']} \\")
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])


def plain_latex(rows: list[dict], columns: tuple[str, ...]) -> str:
    """A booktabs table of some columns."""
    lines = [
        rf"\begin{{tabular}}{{l{'r' * (len(columns) - 1)}}}",
        r"\toprule",
        " & ".join(name.replace("_", r"\_") for name in columns) + r" \\",
        r"\midrule",
    ]
    for row in rows:
        cells = [
            "--" if row[c] is None else f"{row[c]:.2f}" if isinstance(row[c], float) else str(row[c]) for c in columns
        ]
        lines.append(" & ".join(cell.replace("_", r"\_") for cell in cells) + r" \\")
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])


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


def html_table(rows: list[dict]) -> str:
    """The rows as a table, texts escaped; figures with two decimals, small ones with three digits."""
    if not rows:
        return "<p>Nothing.</p>"
    heads = "".join(f"<th>{html.escape(HEADS.get(name, name))}</th>" for name in rows[0])
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(_cell(value))}</td>" for value in row.values()) + "</tr>" for row in rows
    )
    return f"<table><tr>{heads}</tr>{body}</table>"


def _cell(value: Any) -> str:
    if value is None or (isinstance(value, float) and not np.isfinite(value)):
        return "–"
    if isinstance(value, bool | np.bool_):
        return "yes" if value else ""
    if isinstance(value, float):
        return f"{value:.2f}" if abs(value) >= 0.01 or value == 0 else f"{value:.2g}"
    return str(value)


def write_table(path: Path, rows: list[dict]) -> None:
    """The rows as CSV that no spreadsheet takes for formulas."""
    write_text(path, safe_frame(pd.DataFrame(rows)).to_csv(index=False, lineterminator="\n", float_format="%.4f"))


def drawn(folder: Path, name: str, figure: Any) -> str:
    """Write ``name.svg`` and ``name.png``; returns the SVG element for the page."""
    svg = charts.render(figure, "svg").decode("utf-8")
    write_text(folder / f"{name}.svg", svg)
    with atomic_path(folder / f"{name}.png") as temporary:
        temporary.write_bytes(charts.render(figure, "png"))
    charts.close(figure)
    return inline(svg)


def inline(svg: str) -> str:
    """The SVG element alone: XML headers do not belong inside a page."""
    return svg[svg.index("<svg") :]


def write_text(path: Path, text: str) -> None:
    """Whole or not at all, UTF-8."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
