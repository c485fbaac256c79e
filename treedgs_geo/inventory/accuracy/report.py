"""The files of an evaluation: JSON, CSV, LaTeX, charts, and one self-contained page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ...core.files import atomic_path, write_json
from ...core.tables import write_csv
from ...report.blocks import Block, Column, Document, Heading, Paragraph, Sentences, Table, booktabs, facts_table
from ...report.charts import BLUE, VERMILION, new_chart, write_chart
from ...report.html import write_html
from ..charts import draw_scatter
from .tables import COMPARED, INTERVALS, PairsEvidence

#: Figures of metrics.json as columns.
COLUMNS = (
    Column("n_reference", "Reference trees", 0),
    Column("n", "Measured", 0),
    Column("success_rate", "Success %", 1, 100),
    Column("rmse_cm", "RMSE cm", 2),
    Column("rrmse_pct", "RRMSE %", 1),
    Column("mae_cm", "MAE cm", 2),
    Column("me_cm", "ME cm", 2),
    Column("max_abs_cm", "Largest cm", 2),
    Column("n_false", "False", 0),
    Column("coverage_90", "In 90 % interval %", 1, 100),
)
_COLUMN = {column.key: column for column in COLUMNS}


def write_evaluation(
    folder: Path,
    evidence: PairsEvidence,
    metrics: dict,
    facts: dict[str, str] | None = None,
    more: Sequence[Block] = (),
    first: Sequence[Block] = (),
) -> dict[str, str]:
    """Write everything into ``folder``; ``metrics.json`` comes last, so that its presence means the rest is there.

    more: further blocks of the page (``treedgs_lab/published/experiments.py``). first: what stands above all.

    Returns:
        name -> path of ``metrics, per_plot, trees, table, page``.
    """
    folder = Path(folder)
    rows = {**metrics["per_plot"], "pooled": metrics["pooled"]}
    tables = {
        "per_plot": pd.DataFrame([{"plot_id": name, **row} for name, row in rows.items()]),
        "trees": evidence.trees.round(3),
    }
    paths = {
        **{name: folder / f"{name}.csv" for name in tables},
        "table": folder / "table.tex",
        "page": folder / "evaluation.html",
        "metrics": folder / "metrics.json",
    }
    for name, table in tables.items():
        write_csv(paths[name], table, lineterminator="\n")
    with atomic_path(paths["table"]) as temporary:
        temporary.write_text(booktabs(_accuracy_table(metrics)), encoding="utf-8")
    counted = evidence.trees.assign(dbh_cm=evidence.trees["dbh_cm"].where(evidence.trees["error_cm"].notna()))
    scatter = draw_scatter(counted, "reference_cm")
    scatter.axes[0].set_xlabel(f"{evidence.reference}, cm")
    pictures = [
        write_chart(folder, "errors", draw_errors(evidence.trees, metrics), "signed errors"),
        write_chart(folder, "scatter", scatter, "measured, reference"),
        write_chart(folder, "plots", draw_plots(metrics), "errors by plot"),
    ]
    blocks = [
        *first,
        *_accuracy(metrics, evidence.reference, pictures),
        *more,
        Heading("Trees"),
        _trees(counted),
        facts_table("facts", "This evaluation", facts or {}),
    ]
    write_html(paths["page"], Document("Accuracy of measured DBH", f"against {evidence.reference}", blocks))
    write_json(paths["metrics"], metrics)
    return {name: str(path) for name, path in paths.items()}


def _accuracy(metrics: dict, reference: str, pictures: Sequence[Block]) -> list[Block]:
    pooled, spread = metrics["pooled"], metrics["bootstrap"]
    headline = f"None of the {pooled['n_reference']} reference trees was measured."
    if pooled["n"]:
        headline = (
            f"{pooled['n']} of {pooled['n_reference']} trees have a DBH; over these, RMSE is {pooled['rmse_cm']:.2f} "
            f"cm and the mean error {pooled['me_cm']:+.2f} cm (measured − {reference})."
        )
    notes = list(metrics["notes"]) + ([spread["note"][0].upper() + spread["note"][1:] + "."] if spread["note"] else [])
    return [
        Paragraph(headline, strong=True),
        _accuracy_table(metrics, with_parts=True),
        Heading("What was left out, and how to read this"),
        Sentences(notes or ["Nothing was left out."]),
        *pictures,
        Heading("Intervals"),
        Paragraph(
            f"{100 * spread['level']:.0f} % bootstrap intervals of the pooled figures; {spread['repeats']} resamples "
            f"by {spread['by']}, seed {spread['seed']}."
        ),
        _intervals(pooled, spread),
        *(_against(metrics["against"]) if "against" in metrics else ()),
    ]


def _accuracy_table(metrics: dict, with_parts: bool = False) -> Table:
    """One row a plot, the plots' spread, and all together. with_parts: the ``ok`` trees, and what was measured before
    a person's changes, too."""
    rows: list[dict[str, Any]] = [{"plot": name, **row} for name, row in metrics["per_plot"].items()]
    n_totals = 1
    if "over_plots" in metrics:
        spread = {column.key: over_plots(metrics, column) for column in COLUMNS}
        rows.append({"plot": "mean ± sd of plots (range)", **spread})
        n_totals = 2
    rows.append({"plot": "pooled", **metrics["pooled"]})
    if with_parts:
        parts = {"pooled, qc_flag = ok only": "ok_only", "pooled, as measured": "as_measured"}
        rows += [{"plot": words, **metrics[name]} for words, name in parts.items() if name in metrics]
        n_totals = len(rows) - len(metrics["per_plot"])
    return Table(
        "accuracy",
        "",
        [Column("plot", "Plot"), *COLUMNS],
        rows,
        "Error figures are over the measured trees only; read them together with the success rate. False: measured "
        "trees with a DBH inside the plot that are no reference tree (trees below the tally's limit count here too).",
        n_totals,
    )


def over_plots(metrics: dict, column: Column) -> str | None:
    """``mean ± sd (lowest–highest)`` over plots; nothing for what is not averaged."""
    found = metrics["over_plots"].get(column.key)
    if found is None:
        return None
    mean, low, high = (f"{column.factor * found[key]:.{column.decimals}f}" for key in ("mean", "low", "high"))
    sd = "" if found["sd"] is None else f" ± {column.factor * found['sd']:.{column.decimals}f}"
    return f"{mean}{sd} ({low}–{high})"


def _intervals(pooled: dict, spread: dict) -> Table:
    rows = [
        {
            "figure": column.heading,
            "value": Table("", "", [], []).text(pooled, column),
            "interval": " to ".join(f"{end * column.factor:.2f}" for end in spread[column.key]),
        }
        for column in (_COLUMN[name] for name in INTERVALS)
        if spread[column.key] is not None and pooled[column.key] is not None
    ]
    columns = [Column("figure", "Figure"), Column("value", "Value", 2), Column("interval", "Interval", 2)]
    return Table("intervals", "", columns, rows)


def _trees(trees: pd.DataFrame) -> Table:
    shown = trees.astype({"plot_id": str, "tree_id": str}).assign(qc_flag=trees["qc_flag"].fillna(""))
    columns = [
        Column("plot_id", "Plot"),
        Column("tree_id", "Tree"),
        Column("reference_cm", "Reference cm", 1),
        Column("dbh_cm", "Measured cm", 1),
        Column("error_cm", "Error cm", 2, signed=True),
        Column("qc_flag", "Flag"),
    ]
    return Table("trees", "", columns, shown.to_dict("records"))


def _against(found: dict) -> list[Block]:
    """The comparison with another method."""
    gain = "No tree was measured by both."
    if found["rmse_gain_cm"] is not None:
        low, high = found["rmse_gain_interval_cm"]
        gain = (
            f"RMSE of this one minus the other: {found['rmse_gain_cm']:+.2f} cm "
            f"({low:+.2f} to {high:+.2f}; resampled by {found['by']})."
        )
    columns = [Column("which", "Method"), *(_COLUMN[name] for name in COMPARED)]
    rows = [{"which": "this one", **found["this"]}, {"which": "the other", **found["other"]}]
    return [
        Heading(f"Against {found['file']}"),
        Paragraph(
            f"{found['n_common']} trees were measured by both, {found['n_only_this']} only here, "
            f"{found['n_only_other']} only there. On the common trees:"
        ),
        Table("against", "", columns, rows, gain),
    ]


def draw_errors(trees: pd.DataFrame, metrics: dict[str, Any]) -> Any:
    """Histogram of the signed errors (measured - reference, cm) with its mean."""
    figure, axes = new_chart()
    error = trees["error_cm"].dropna().to_numpy(float)
    if len(error):
        # Round steps with an edge at zero: the sign stays readable.
        reach = max(np.abs(error).max(), 0.5)
        most = max(2 * np.sqrt(len(error)), 8)
        step = next((s for s in (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0) if 2 * reach / s <= most), 25.0)
        edge = np.ceil(reach / step) * step
        axes.hist(
            error, bins=np.arange(-edge, edge + step / 2, step), color=BLUE, alpha=0.75, edgecolor="white", lw=0.5
        )
        words = f"mean {metrics['me_cm']:+.2f} cm (RMSE {metrics['rmse_cm']:.2f} cm)"
        axes.axvline(metrics["me_cm"], color=VERMILION, ls="--", lw=1.8, label=words)
        axes.set_ylim(0, axes.get_ylim()[1] * 1.2)
        axes.yaxis.get_major_locator().set_params(integer=True)
        axes.legend(loc="upper left")
    else:
        axes.text(0.5, 0.5, "no tree was measured", transform=axes.transAxes, ha="center")
    axes.axvline(0, color="black", lw=1)
    axes.set_xlabel("measured − reference DBH, cm")
    axes.set_ylabel("trees")
    axes.set_title(f"Signed error of {len(error)} of {len(trees)} trees")
    return figure


def draw_plots(metrics: dict[str, Any]) -> Any:
    """Mean error and RMSE of each plot."""
    plots = [(name, row) for name, row in metrics["per_plot"].items() if row["n"]]
    figure, axes = new_chart(6.2, max(1.6 + 0.32 * len(plots), 2.2))
    for k, (_, row) in enumerate(reversed(plots)):
        axes.plot(
            [0, row["rmse_cm"]], [k, k], color=BLUE, lw=3, solid_capstyle="butt", label="RMSE" if k == 0 else None
        )
        axes.plot(row["me_cm"], k, "D", color=VERMILION, ms=6, label="mean error" if k == 0 else None)
    axes.set_yticks(range(len(plots)), [f"{name} ({row['n']}/{row['n_reference']})" for name, row in reversed(plots)])
    axes.axvline(0, color="black", lw=1)
    axes.set_ylim(-0.7, max(len(plots) - 0.3, 0.5))
    axes.set_xlabel("cm")
    axes.set_title("By plot (trees measured / reference trees)")
    if plots:
        axes.legend()
    return figure
