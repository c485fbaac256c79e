"""The tables as an Excel workbook and as CSV files, with every digit."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ...core import tables
from ...core.files import atomic_path
from ...report.blocks import Document, Table

#: Tables that get a file of their own.
CSV_TABLES = ("summary", "stand_table", "plots", "corrections", "equations", "trees")
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")


def csv_name(table: str) -> str:
    """File of a table; all begin alike, so that they cannot be taken for a survey's own plots.csv or trees.csv."""
    return f"{table if table.startswith('stand_') else f'stand_{table}'}.csv"


def write_workbook(path: Path, document: Document) -> Path:
    """One sheet a table; numbers as numbers, shown with their decimals."""
    from openpyxl import Workbook
    from openpyxl.styles import Alignment, Font, PatternFill
    from openpyxl.utils import get_column_letter

    book = Workbook()
    book.remove(book.active)
    for name in ("summary", "stand_table", "plots", "corrections", "trees", "equations", "about"):
        table = document.tables[name]
        sheet = book.create_sheet(name)
        sheet.append([column.heading for column in table.columns])
        for number, row in enumerate(table.rows):
            for k, column in enumerate(table.columns, start=1):
                value = _plain(row.get(column.key))
                if value is None:
                    continue
                cell = sheet.cell(number + 2, k)
                cell.value = _CONTROL.sub(" ", value) if isinstance(value, str) else value
                if isinstance(value, str):
                    # Never a formula, whatever a plot is called.
                    cell.data_type = "s"
                if column.decimals is not None:
                    cell.number_format = "#,##0" + ("." + "0" * column.decimals if column.decimals else "")
                if number >= len(table.rows) - table.n_totals:
                    cell.font = Font(bold=True)
        for k, column in enumerate(table.columns, start=1):
            head = sheet.cell(1, k)
            head.font, head.fill = Font(bold=True, color="FFFFFF"), PatternFill("solid", fgColor="1F6B45")
            head.alignment = Alignment(wrap_text=True, vertical="top")
            longest = max([len(table.text(row, column)) for row in table.rows], default=0)
            sheet.column_dimensions[get_column_letter(k)].width = min(max(longest + 2, 11), 60)
        sheet.freeze_panes = "A2"
        if table.note:
            sheet.cell(len(table.rows) + 3, 1).value = table.note
    book.properties.title = document.title
    book.properties.creator = "TreeDGS"
    with atomic_path(path) as temporary:
        book.save(temporary)
    return Path(path)


def write_csv(path: Path, table: Table) -> Path:
    """One table; column names are keys with units, missing is empty."""
    keys = [column.key for column in table.columns]
    if any("key" in row for row in table.rows):
        keys.insert(1, "key")
    tables.write_csv(path, pd.DataFrame(table.rows, columns=keys, dtype=object), lineterminator="\n")
    return Path(path)


def _plain(value: Any) -> Any:
    """Something that files know; unknown numbers become nothing."""
    if isinstance(value, (np.integer, np.floating)):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
