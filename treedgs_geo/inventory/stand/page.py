"""The report as one HTML page without outside files."""

from __future__ import annotations

import base64
import html
from importlib.resources import files
from pathlib import Path
from string import Template

from ...core.files import atomic_path
from .document import Document, ReportBlock

#: A longer list of trees makes the page slow to open.
_LONGEST = 2000


def write_page(path: Path, document: Document) -> Path:
    """Write the page atomically."""
    template = Template((files(__package__) / "templates" / "stand.html").read_text(encoding="utf-8"))
    page = template.substitute(
        title=html.escape(document.title),
        subtitle=html.escape(document.subtitle),
        body="\n".join(_block(block) for block in document.blocks),
    )
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return Path(path)


def _block(block: ReportBlock) -> str:
    if block.kind == "cards":
        return f"<div class='cards'>{''.join(_card(*item) for item in block.items)}</div>"
    if block.kind == "heading":
        return f"<h2>{html.escape(block.text)}</h2>"
    if block.kind in ("warnings", "list"):
        items = "".join(f"<li>{html.escape(item)}</li>" for item in block.items)
        if block.kind == "warnings":
            return f"<div class='warn'><b>Read this first</b><ul>{items}</ul></div>"
        return f"<ul>{items}</ul>" if items else ""
    if block.kind == "picture":
        data = base64.b64encode(block.picture).decode()
        return f"<img alt='{html.escape(block.text, quote=True)}' src='data:image/png;base64,{data}'>"
    if block.kind == "folded":
        assert block.table is not None
        n = len(block.table.rows)
        return f"<details><summary>{html.escape(block.table.title)} ({n})</summary>{_table(block)}</details>"
    return _table(block)


def _card(label: str, value: str, interval: str) -> str:
    spread = f"<div class='range'>{html.escape(interval)}</div>" if interval else ""
    return (
        f"<div class='card'><div class='label'>{html.escape(label)}</div>"
        f"<div class='value'>{html.escape(value)}</div>{spread}</div>"
    )


def _table(block: ReportBlock) -> str:
    table, columns = block.table, block.shown
    assert table is not None
    kinds = ["" if column.decimals is None else " class='n'" for column in columns]
    heads = "".join(f"<th{k}>{html.escape(c.heading)}</th>" for c, k in zip(columns, kinds, strict=True))
    rows, left_out = block.rows(_LONGEST)
    body = []
    for number, row in enumerate(rows):
        total = " class='total'" if number >= len(table.rows) - table.n_totals else ""
        cells = "".join(f"<td{k}>{html.escape(table.text(row, c))}</td>" for c, k in zip(columns, kinds, strict=True))
        body.append(f"<tr{total}>{cells}</tr>")
    notes = " ".join(filter(None, (table.note, left_out)))
    note = f"<p class='note'>{html.escape(notes)}</p>" if notes else ""
    return (
        f"<div class='scroll'><table id='{table.name}'><caption>{html.escape(table.title)}</caption>"
        f"<thead><tr>{heads}</tr></thead><tbody>{''.join(body)}</tbody></table></div>{note}"
    )
