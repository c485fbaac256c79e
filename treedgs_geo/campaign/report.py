"""The campaign's report: ``plots.csv`` (one row a plot) and ``campaign.html``, written row by row."""

from __future__ import annotations

import html
from collections.abc import Iterable, Iterator
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

from ..core.files import atomic_path
from ..core.tables import SafeWriter
from .places import REPORT, TABLE, plot_folder
from .record import Record
from .state import Campaign, Plan

COLUMNS = (
    "plot_id",
    "state",
    "route",
    "n_trees",
    "n_measured",
    "n_rejected",
    "reasons",
    "mean_dbh_cm",
    "seconds",
    "cpu_s",
    "memory_gb",
    "disk_gb",
    "photos",
    "megapixels",
    "points_m",
    "predicted_s",
    "attempts",
    "host",
    "n_field",
    "n_field_measured",
    "rmse_cm",
    "me_cm",
    "coverage_90",
    "n_false",
    "remark",
    "folder",
)
#: Problems repeated above the table.
_MOST_REPORTED = 30


def rows_of(plan: Plan, campaign: Campaign) -> Iterator[dict[str, Any]]:
    """What is known of each plot of the plan, in the manifest's order, one at a time."""
    for entry in plan.entries():
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
    template = (files(__package__) / "templates" / "campaign.html").read_text(encoding="utf-8")
    headline = next(iter(facts.values()))
    notes = "".join(f"<li>{html.escape(text)}</li>" for text in warnings[:_MOST_REPORTED])
    if len(warnings) > _MOST_REPORTED:
        notes += f"<li>and {len(warnings) - _MOST_REPORTED} more, in {TABLE}</li>"
    head = Template(template).substitute(
        headline=html.escape(str(headline)),
        warnings=f"<div class='warn'><b>Look at these</b><ul>{notes}</ul></div>" if notes else "",
    )
    with atomic_path(folder / TABLE) as table, atomic_path(folder / REPORT) as page:  # noqa: SIM117 - too long for one
        with open(table, "w", newline="", encoding="utf-8-sig") as cells, open(page, "w", encoding="utf-8") as text:
            writer = SafeWriter(cells, COLUMNS)
            writer.header()
            text.write(head)
            for row in rows:
                writer.record(row)
                text.write(_line(row))
            text.write("</table><h2>This campaign</h2><table>")
            for name, value in facts.items():
                text.write(f"<tr><th>{html.escape(str(name))}</th><td>{html.escape(str(value))}</td></tr>")
            text.write("</table></body></html>\n")
    return folder / REPORT


def _line(row: dict[str, Any]) -> str:
    field = "" if row["n_field"] is None else f"{row['n_field_measured']} of {row['n_field']}"
    share = "" if row["coverage_90"] is None else f"{100 * row['coverage_90']:.0f} %"
    cells = [
        row["plot_id"],
        row["state"],
        row["n_trees"],
        row["n_measured"],
        row["n_rejected"],
        row["reasons"],
        row["mean_dbh_cm"],
        row["seconds"],
        row["memory_gb"],
        row["attempts"],
        field,
        row["rmse_cm"],
        row["me_cm"],
        share,
        row["remark"] or "; ".join(row["warnings"]),
    ]
    made = "".join(
        f"<td{' class=n' if isinstance(cell, (int, float)) else ''}>{html.escape('' if cell is None else str(cell))}"
        "</td>"
        for cell in cells
    )
    return f"<tr class='{'failed' if row['state'] != 'done' else 'done'}'>{made}</tr>\n"


def _round(value: float | None) -> float | None:
    return None if value is None else round(float(value), 3)


def _size(folder: Path) -> float:
    """Gigabytes in a plot's folder."""
    return sum(path.lstat().st_size for path in folder.rglob("*") if path.is_file()) / 1e9
