"""The campaign's report: ``plots.csv`` (one row a plot) and ``campaign.html``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from ..core.files import atomic_path
from ..core.tables import SafeWriter
from ..report.blocks import Block, Column, Document, Sentences, Table, facts_table
from ..report.html import write_html
from .places import REPORT, TABLE, plot_folder
from .record import Record
from .state import Campaign, Plan

COLUMNS = (
    "plot_id", "state", "route", "n_trees", "n_measured", "n_rejected", "reasons", "mean_dbh_cm", "seconds", "cpu_s",
    "memory_gb", "disk_gb", "photos", "megapixels", "points_m", "predicted_s", "attempts", "host", "n_field",
    "n_field_measured", "rmse_cm", "me_cm", "coverage_90", "n_false", "remark", "folder",
)  # fmt: skip
#: Problems repeated above the table.
_MAX_REPORTED = 30


def rows_of(plan: Plan, campaign: Campaign) -> Iterator[dict[str, Any]]:
    """What is known of each plot of the plan, in the manifest's order, one at a time."""
    for entry in plan.entries:
        row = entry["row"]
        folder = plot_folder(campaign.workspace, row["plot_id"])
        record = Record.read(folder)
        fits = record.key.split(":")[0] == entry["settings"] and record.stamp == entry["inputs"]["stamp"]
        state = (
            "done"
            if record.is_unchanged(entry["inputs"]["stamp"], entry["settings"])
            else (
                "failed" if record.status == "failed" or any(a.get("outcome") for a in record.attempts) else "not run"
            )
        )
        result = record.result if state == "done" else {}
        accuracy = result.get("accuracy") or {}
        attempts = [a for a in record.attempts if a.get("key") == record.key] if fits else record.attempts
        remark = accuracy.get("note") or "" if state == "done" else (record.last_problem() if state == "failed" else "")
        yield {
            "plot_id": row["plot_id"],
            "state": state,
            "route": row["route"],
            "number": campaign.number(row["plot_id"]),
            "n_trees": result.get("n_trees"),
            "n_measured": result.get("n_measured"),
            "n_rejected": result.get("n_rejected"),
            "reasons": ", ".join(f"{n} {name}" for name, n in sorted((result.get("reasons") or {}).items())),
            "mean_dbh_cm": result.get("mean_dbh_cm"),
            "seconds": result.get("seconds"),
            "cpu_s": result.get("cpu_s"),
            "memory_gb": result.get("peak_gb"),
            "disk_gb": round(_size(folder), 4) if state == "done" else None,
            "photos": entry["inputs"]["photos"],
            "megapixels": round(entry["inputs"]["megapixels"], 2),
            "points_m": round(entry["inputs"]["points_m"], 4),
            "predicted_s": round(entry["seconds"], 1),
            "attempts": len(attempts),
            "host": result.get("host", ""),
            "n_field": accuracy.get("n_reference"),
            "n_field_measured": accuracy.get("n"),
            "rmse_cm": _round(accuracy.get("rmse_cm")),
            "me_cm": _round(accuracy.get("me_cm")),
            "coverage_90": _round(accuracy.get("coverage_90")),
            "n_false": accuracy.get("n_false"),
            "remark": remark,
            "folder": str(folder),
            "bounds": result.get("bounds"),
            "crs": entry["inputs"]["crs"],
            "table": bool(row["plots"]),
            "runs": len(attempts),
            "warnings": result.get("warnings") or [],
        }


def write_report(
    campaign: Campaign, rows: Iterable[dict[str, Any]], facts: dict[str, Any], warnings: list[str]
) -> Path:
    """Write both files. rows: of :func:`rows_of`; facts: label -> value, the first one is the headline."""
    folder = campaign.workspace
    plots = []
    with atomic_path(folder / TABLE) as table, open(table, "w", newline="", encoding="utf-8-sig") as cells:
        writer = SafeWriter(cells, COLUMNS)
        writer.header()
        for row in rows:
            writer.record(row)
            plots.append(_shown(row))
    notes = warnings[:_MAX_REPORTED]
    if len(warnings) > _MAX_REPORTED:
        notes.append(f"and {len(warnings) - _MAX_REPORTED} more, in {TABLE}")
    blocks: list[Block] = [
        Sentences(notes, "Look at these"),
        Table("plots", "Plots", list(_SHOWN), plots),
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


def _round(value: float | None) -> float | None:
    return None if value is None else round(float(value), 3)


def _size(folder: Path) -> float:
    """Gigabytes in a plot's folder."""
    return sum(path.lstat().st_size for path in folder.rglob("*") if path.is_file()) / 1e9
