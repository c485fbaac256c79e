"""CSV tables: files that are none, and cells that a spreadsheet would run as a formula."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from .errors import InputError

#: First bytes (at an offset) of files that people give instead of a CSV, and what they are.
_OTHERS = (
    (4, b"Standard ACE DB", "an Access database"),
    (4, b"Standard Jet DB", "an Access database"),
    (0, b"PK\x03\x04", "a spreadsheet or an archive"),
    (0, b"\xd0\xcf\x11\xe0", "an old Excel workbook"),
    (0, b"SQLite format 3", "a database (GeoPackage or SQLite)"),
)
_ENDINGS = {
    ".accdb": "an Access database",
    ".mdb": "an Access database",
    ".xlsx": "an Excel workbook",
    ".xls": "an Excel workbook",
    ".ods": "a spreadsheet",
    ".gpkg": "a GeoPackage",
}
#: Of a spreadsheet's numbers: with a decimal comma, and with a decimal point.
_COMMA, _POINT = re.compile(r"[+-]?\d+,\d+"), re.compile(r"[+-]?\d+\.\d+")
#: A text that starts like this is run as a formula by spreadsheet programs.
_RUN = ("=", "+", "-", "@", "\t", "\r", "\n")


def refuse_other_formats(path: Path, layers: bool = False) -> None:
    """Refuse what is no CSV by its ending or its first bytes; a file that cannot be read is left to the reader.

    layers: a map layer would do as well; only Access databases are refused.

    Raises:
        InputError: what it is, and what to do.
    """
    path = Path(path)
    kind = _ENDINGS.get(path.suffix.lower(), "")
    try:
        with open(path, "rb") as stream:
            head = stream.read(64)
    except OSError:
        return
    for offset, mark, what in _OTHERS:
        if head[offset : offset + len(mark)] == mark:
            kind = kind or what
    if kind and (not layers or "Access" in kind):
        wanted = "a CSV table or a map layer" if layers else "a CSV table"
        raise InputError(
            f"{path}: is {kind}, expected {wanted}; export its table of trees or plots as CSV (comma-separated, UTF-8) "
            "and give that file."
        )


def csv_text(path: Path) -> str:
    """A table as comma-separated text with decimal points, whatever program wrote it: UTF-8 or UTF-16 with their marks,
    or else Windows' western code page; any line ends; separated by commas, semicolons or tabs (Excel's choice depends
    on the country), where the latter two may come with decimal commas.

    Raises:
        InputError: numbers with decimal commas and others with points in one table. OSError, ValueError: cannot be
            read, is not text.
    """
    data = Path(path).read_bytes()
    text = decoded(data).replace("\r\n", "\n").replace("\r", "\n")
    first, _, rest = text.partition("\n")
    if hint := re.fullmatch(r'"?sep=(.)"?', first.strip(" ")):  # Excel's own line
        separator, text = hint[1], rest
    else:
        header = re.sub(r'"[^"]*"', "", first)
        separator = max(",;\t", key=header.count)
    if separator == ",":
        return text
    rows = list(csv.reader(io.StringIO(text), delimiter=separator))
    cells = [cell.strip() for row in rows[1:] for cell in row]
    commas = [cell for cell in cells if _COMMA.fullmatch(cell)]
    points = [cell for cell in cells if _POINT.fullmatch(cell)]
    if commas and points:
        raise InputError(
            f"{path}: found {commas[0]} and {points[0]}, numbers with a decimal comma and with a decimal point; write "
            "all of them the same way."
        )
    made = io.StringIO()
    csv.writer(made, lineterminator="\n").writerows(
        [cell.replace(",", ".") if _COMMA.fullmatch(cell.strip()) else cell for cell in row] for row in rows
    )
    return made.getvalue()


def csv_rows(path: Path, give: str) -> list[dict[str, str]]:
    """Rows of a CSV table by column, cells as :func:`plain_cell` reads them. give: what to give instead, for the
    sentence.

    Raises:
        InputError: another format, or cannot be read.
    """
    path = Path(path)
    refuse_other_formats(path)
    try:
        rows = csv.DictReader(io.StringIO(csv_text(path)))
        return [{name: plain_cell(cell) for name, cell in row.items()} for row in rows]
    except (OSError, ValueError, csv.Error) as problem:
        raise InputError(f"{path}: cannot be read as a CSV table ({problem}); give {give}.") from None


def decoded(data: bytes) -> str:
    """The text of a table: UTF-8 or UTF-16 with their marks, or else Windows' western code page.

    Raises:
        ValueError: no text in any of these.
    """
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", errors="replace")
    for encoding in ("utf-8-sig", "cp1252"):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise ValueError("it is not text")


def safe_cell(value: Any) -> Any:
    """A cell that no spreadsheet runs: a text that would be a formula gets an apostrophe in front; numbers, also as
    text, stay.

    A text that starts with an apostrophe gets one more, so that :func:`plain_cell` gives every text back.
    """
    if not isinstance(value, str) or not value or _is_number(value):
        return value
    return "'" + value if value[0] in _RUN or value[0] == "'" else value


def plain_cell(value: Any) -> Any:
    """What :func:`safe_cell` was given."""
    if isinstance(value, str) and len(value) > 1 and value[0] == "'" and value[1] in (*_RUN, "'"):
        return value[1:]
    return value


def safe_frame(table: Any) -> Any:
    """A data frame with :func:`safe_cell` applied to every text cell and column name."""
    made = table.copy()
    for name in made:
        if made[name].dtype.kind == "O" or str(made[name].dtype).startswith("str"):
            made[name] = made[name].map(safe_cell)
    return made.rename(columns=safe_cell)


class SafeWriter:
    """``csv.writer`` (rows of cells) and ``csv.DictWriter`` (dicts of ``columns``) with every cell made safe."""

    def __init__(self, stream: Any, columns: Iterable[str] = ()) -> None:
        self._writer = csv.writer(stream, lineterminator="\n")
        self._columns = list(columns)

    def header(self) -> None:
        """The columns' names."""
        self.row(self._columns)

    def row(self, cells: Iterable[Any]) -> None:
        """One row."""
        self._writer.writerow([safe_cell(cell) for cell in cells])

    def record(self, values: dict[str, Any]) -> None:
        """One row from a dict; other keys are left out, missing ones are empty."""
        self.row([values.get(name, "") for name in self._columns])


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text)) and text.strip() == text
    except ValueError:
        return False
