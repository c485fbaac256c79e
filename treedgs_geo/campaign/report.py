"""The campaign's report: ``plots.csv`` (one row a plot) and ``campaign.html``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from ..core.tables import write_csv
from ..report.blocks import Block, Column, Document, Sentences, Table, facts_table
from ..report.html import write_html
from .places import REPORT, TABLE, plot_folder
from .state import Campaign, Plan
from .supervise import Record

COLUMNS = (
    "plot_id", "state", "route", "n_trees", "n_measured", "n_rejected", "reasons", "mean_dbh_cm", "seconds", "cpu_s",
    "memory_gb", "disk_gb", "photos", "megapixels", "points_m", "predicted_s", "attempts", "host", "n_field",
    "n_field_measured", "rmse_cm", "me_cm", "coverage_90", "n_false", "remark", "folder",
)  # fmt: skip
#: Columns that are so in a plot's result, and in its accuracy.
_OF_RESULT = ("n_trees", "n_measured", "n_rejected", "mean_dbh_cm", "seconds", "cpu_s", "host", "bounds")
_OF_ACCURACY = ("rmse_cm", "me_cm", "coverage_90", "n_false")
#: Problems repeated above the table.
_MAX_REPORTED = 30


def rows_of(plan: Plan, campaign: Campaign) -> Iterator[dict[str, Any]]:
    """What is known of each plot of the plan, in the manifest's order, one at a time."""
    for entry in plan.entries:
        row, inputs = entry["row"], entry["inputs"]
        folder = plot_folder(campaign.workspace, row["plot_id"])
        record = Record.read(folder)
        fits = record.key.split(":")[0] == entry["settings"] and record.stamp == inputs["stamp"]
        if record.is_unchanged(inputs["stamp"], entry["settings"]):
            state = "done"
        else:
            tried = record.status == "failed" or any(a.get("outcome") for a in record.attempts)
            state = "failed" if tried else "not run"
        result = record.result if state == "done" else {}
        accuracy = result.get("accuracy") or {}
        size = (path.lstat().st_size for path in folder.rglob("*") if path.is_file())
        attempts = [a for a in record.attempts if a.get("key") == record.key] if fits else record.attempts
        yield {
            **{name: result.get(name) for name in _OF_RESULT},
            **{name: None if accuracy.get(name) is None else round(accuracy[name], 3) for name in _OF_ACCURACY},
            "plot_id": row["plot_id"],
            "state": state,
            "route": row["route"],
            "number": campaign.number(row["plot_id"]),
            "reasons": ", ".join(f"{n} {name}" for name, n in sorted((result.get("reasons") or {}).items())),
            "memory_gb": result.get("peak_gb"),
            "disk_gb": round(sum(size) / 1e9, 4) if state == "done" else None,
            "photos": inputs["photos"],
            "megapixels": round(inputs["megapixels"], 2),
            "points_m": round(inputs["points_m"], 4),
            "predicted_s": round(entry["seconds"], 1),
            "attempts": len(attempts),
            "n_field": accuracy.get("n_reference"),
            "n_field_measured": accuracy.get("n"),
            "remark": {"done": accuracy.get("note") or "", "failed": record.last_problem()}.get(state, ""),
            "folder": str(folder),
            "crs": inputs["crs"],
            "table": bool(row["plots"]),
            "warnings": result.get("warnings") or [],
        }


def write_report(campaign: Campaign, rows: list[dict[str, Any]], facts: dict[str, Any], warnings: list[str]) -> Path:
    """Write both files. rows: of :func:`rows_of`; facts: label -> value, the first one is the headline."""
    folder = campaign.workspace
    cells = pd.DataFrame(rows, columns=list(COLUMNS), dtype=object)
    write_csv(folder / TABLE, cells, encoding="utf-8-sig", lineterminator="\n")
    notes = warnings[:_MAX_REPORTED]
    if len(warnings) > _MAX_REPORTED:
        notes.append(f"and {len(warnings) - _MAX_REPORTED} more, in {TABLE}")
    blocks: list[Block] = [
        Sentences(notes, "Look at these"),
        Table("plots", "Plots", list(_SHOWN), [_shown(row) for row in rows]),
        facts_table("campaign", "This campaign", facts),
    ]
    return write_html(folder / REPORT, Document("Campaign", str(next(iter(facts.values()))), blocks, wide=True))


_SHOWN = (
    Column("plot_id", "Plot"),
    Column("state", "State"),
    Column("n_trees", "Stems", 0),
    Column("n_measured", "With DBH", 0),
    Column("n_rejected", "Refused", 0),
    Column("reasons", "Why refused"),
    Column("mean_dbh_cm", "Mean DBH cm", 1),
    Column("seconds", "Seconds", 0),
    Column("memory_gb", "Memory GB", 2),
    Column("attempts", "Attempts", 0),
    Column("field", "Field trees measured"),
    Column("rmse_cm", "RMSE cm", 2),
    Column("me_cm", "Bias cm", 2, signed=True),
    Column("coverage_90", "In 90 % interval, %", 0, 100),
    Column("remark", "Remarks"),
)


def _shown(row: dict[str, Any]) -> dict[str, Any]:
    """What the page shows of a plot."""
    return {
        **{column.key: row.get(column.key) for column in _SHOWN},
        "field": "" if row["n_field"] is None else f"{row['n_field_measured']} of {row['n_field']}",
        "remark": row["remark"] or "; ".join(row["warnings"]),
        "mark": "done" if row["state"] == "done" else "failed",
    }
