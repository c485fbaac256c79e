"""CSV tables: the one reader, files that are none, and cells that a spreadsheet would run as a formula."""

from __future__ import annotations

import csv
import io
import math
import re
import unicodedata
from collections.abc import Iterable
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .column_names import plain_name, spellings
from .errors import InputError
from .files import atomic_path
from .number_cells import are_units, as_number, column_name, with_points, with_unit, without_thousands, without_units

if TYPE_CHECKING:
    import pandas as pd

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
    ".xls": "an old Excel workbook",
    ".ods": "a spreadsheet",
    ".gpkg": "a GeoPackage",
}
#: What stands for an empty cell: as R, Python and spreadsheets write it, and people.
_EMPTY = {
    *("NA", "N/A", "n/a", "#N/A", "#NA", "<NA>", "NaN", "nan", "-nan", "-NaN", "NULL", "null"),
    *("-", "\N{EN DASH}", "\N{EM DASH}", "k.A.", "k. A.", "n.a.", "s/d", "#NV"),
}
#: Endings of tables: text, and workbooks.
_TEXT = {".csv", ".txt", ".tsv", ".tab"}
_WORKBOOKS = {".xlsx", ".ods"}
#: Words of a row that sums up the others.
_TOTALS = {
    *("total", "totals", "sum", "mean", "average", "avg", "count", "summe", "gesamt", "mittel", "mittelwert"),
    *("durchschnitt", "anzahl", "suma", "media", "promedio", "subtotal", "subtotals", "zwischensumme", "median"),
    *("ergebnis", "gesamtergebnis", "somme", "moyenne", "razem", "średnia", "yhteensä", "keskiarvo", "σ", "ø"),
}
#: Columns that name a row.
_NAMES = {name for key in ("plot_id", "field_id") for name, _ in spellings(key)}
#: Columns that a row may lack at its end: programs and people leave off what is empty, and nothing can slip into them.
_NOTES = {
    *("note", "notes", "remark", "remarks", "comment", "comments", "tape_note", "by", "at"),
    *("bemerkung", "bemerkungen", "notiz", "anmerkung", "nota", "notas", "observaciones", "comentario", "comentarios"),
}
#: A text that starts like this is run as a formula by spreadsheet programs.
_RUN = ("=", "+", "-", "@", "\t", "\r", "\n")


def is_table(path: Path) -> bool:
    """Whether :func:`read_table` reads it, by its ending; else it is a map layer."""
    return Path(path).suffix.lower() in _TEXT | _WORKBOOKS


def refuse_other_formats(path: Path, layers: bool = False) -> None:
    """Refuse what is no CSV by its ending or its first bytes; a file that cannot be read is left to the reader.

    layers: a map layer would do as well.

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
    if kind and (not layers or kind not in ("a GeoPackage", _OTHERS[-1][2])):
        wanted = "a CSV table or a map layer" if layers else "a CSV table"
        raise InputError(
            f"{path}: is {kind}, expected {wanted}; export its table of trees or plots as CSV (comma-separated, UTF-8) "
            "and give that file."
        )


def read_rows(
    path: Path, comments: bool = False, as_written: bool = False
) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Names of the columns (:func:`.number_cells.column_name`), and ``(line, cells)`` of each row that is not empty,
    one cell a column: the one reader of every table that a user gives, whatever program wrote it; also of a workbook's
    one sheet, or the one that names plots or trees.

    UTF-8 or UTF-16 with their marks, or else Windows' western code page; any line ends; commas, semicolons, tabs, bars;
    decimal commas become points, and thousands lose their marks, where that is certain. Titles above the heading are
    left out; units below it, or behind every number, go to the columns' names. What stands for nothing (``NA``, ``-``)
    is empty. A row may lack cells at its end only where the columns hold notes. comments: rows that begin with ``#``
    are left out, but the last one where the heading should be. as_written: names of columns as they stand there.

    Raises:
        InputError: another format, not readable, no heading, a column twice, a cell too many or too few in a row, a row
            that sums up the others.
    """
    path = Path(path)
    if path.suffix.lower() in _WORKBOOKS:
        return _cells_of(path, _workbook_lines(path), ";", comments, as_written)
    refuse_other_formats(path)
    try:
        text = decoded(path.read_bytes())
    except FileNotFoundError:
        raise InputError(f"{path}: not found; give a table that is there.") from None
    except (OSError, ValueError) as problem:
        raise InputError(f"{path}: cannot be read as a CSV table ({problem}); save it as CSV UTF-8.") from None
    text, skipped, separator = _separator(text.replace("\r\n", "\n").replace("\r", "\n"))
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator, skipinitialspace=True)
    lines = ((reader.line_num + skipped, raw) for raw in reader)
    try:
        return _cells_of(path, lines, separator, comments, as_written)
    except csv.Error as problem:
        line = reader.line_num + skipped
        raise InputError(f"{path}, line {line}: is not CSV ({problem}); save the table again.") from None


def _workbook_lines(path: Path) -> list[tuple[int, list[str]]]:
    """``(row, cells)`` of a workbook's one sheet."""
    import pyogrio

    try:
        sheets = [str(name) for name, _ in pyogrio.list_layers(path)]
        read = [pyogrio.raw.read(path, layer=name, HEADERS="DISABLE", FIELD_TYPES="STRING") for name in sheets]
    except Exception as problem:
        raise InputError(f"{path}: cannot be read as a workbook ({problem}); save its sheet as CSV UTF-8.") from None
    filled = [
        # In all sheets but the first GDAL takes a heading for the columns' names.
        (name, [*[of["fields"]] * ("Field1" not in of["fields"]), *zip(*columns, strict=True)])
        for name, (of, _, _, columns) in zip(sheets, read, strict=True)
        if len(columns)
    ]
    # Lists of codes stand beside the table.
    known = [
        sheet for sheet in filled if {plain_name(column_name(str(cell))) for row in sheet[1] for cell in row} & _NAMES
    ]
    if len(filled := known or filled) != 1:
        named = ", ".join(name for name, _ in filled) or "none"
        raise InputError(
            f"{path}: has {len(filled)} sheets ({named}), expected one; save the table's sheet as CSV UTF-8."
        )
    return [(k + 1, ["" if cell is None else str(cell) for cell in row]) for k, row in enumerate(filled[0][1])]


def _cells_of(
    path: Path, lines: Iterable[tuple[int, list[str]]], separator: str, comments: bool, as_written: bool
) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """See :func:`read_rows`; of ``(line, cells)`` as they stand there."""
    heads: list[str] = []
    rows: list[tuple[int, list[str]]] = []
    for line, raw in lines:
        cells = [unicodedata.normalize("NFC", plain_cell(cell.strip())) for cell in raw]
        if not any(cells):
            continue
        if heads and not rows and not any(heads[1:]) and any(cells[1:]):
            heads = []  # what stands alone above the heading is a title
        if comments and not rows and heads and heads[0][:1] == cells[0][:1] == "#":
            heads = []  # of several lines behind a mark the last one is the heading
        if not heads:
            heads = cells
        elif not (comments and cells[0].startswith("#")):
            rows.append((line, ["" if cell in _EMPTY else cell for cell in cells]))
    if not heads:
        raise InputError(f"{path}: is empty, expected a heading and one row for each thing.")
    if rows and not as_written and are_units(rows[0][1]):
        heads = [with_unit(head, unit) for head, unit in zip(heads, [*rows[0][1], *[""] * len(heads)], strict=False)]
        rows = rows[1:]
    heads = heads if as_written else [column_name(head) for head in heads]
    if twice := sorted({head for head in heads if head and heads.count(head) > 1}):
        raise InputError(f"{path}: a column appears twice ({', '.join(twice)}); keep one of them.")
    rows = [(line, _whole(path, line, cells, heads, separator)) for line, cells in rows]
    table = [cells for _, cells in rows]
    if not as_written:
        without_thousands(table)
        heads = [without_units(table, k, head) for k, head in enumerate(heads)]
    for k in range(len(heads)):
        with_points(table, k, separator)
    if not as_written:
        _refuse_totals(path, heads, rows)
    return heads, rows


def read_table(path: Path, comments: bool = False, as_written: bool = False) -> pd.DataFrame:
    """A table of text cells, ``None`` where empty, by the columns' names; its index is the line in the file.

    Raises:
        InputError: see :func:`read_rows`; no row.
    """
    import pandas as pd

    heads, rows = read_rows(path, comments, as_written)
    if not rows:
        raise InputError(f"{path}: holds no row, expected one row for each thing below the heading.")
    lines = pd.Index([line for line, _ in rows], name="line")
    named = {head: [cells[k] or None for _, cells in rows] for k, head in enumerate(heads) if head}
    return pd.DataFrame(named, index=lines, dtype=object)


def read_heading(path: Path) -> list[str]:
    """Names of the columns, to know a table by; none where it is no text."""
    try:
        text = decoded(Path(path).read_bytes()[:65536].rpartition(b"\n")[0] or Path(path).read_bytes()[:65536])
    except (OSError, ValueError):
        return []
    text, _, separator = _separator(text.replace("\r\n", "\n").replace("\r", "\n"))
    lines = [line for line in text.split("\n") if line.strip()]
    heading = ([*takewhile(lambda line: line.startswith("#"), lines)][-1:] or lines[:1] or [""])[0]
    try:
        return [column_name(cell) for cell in next(csv.reader([heading], delimiter=separator), [])]
    except csv.Error:
        return []


def _separator(text: str) -> tuple[str, int, str]:
    """The text without Excel's own first line, the number of lines taken off, and what parts the cells."""
    first, _, rest = text.partition("\n")
    if hint := re.fullmatch(r'"?sep=(.)"?', first.strip(" ")):
        return rest, 1, hint[1]
    lines = [re.sub(r'"[^"]*"', "", line) for line in text.split("\n", 20)[:20] if line.strip()]
    heading, below = (*lines[:2], "", "")[:2]
    if (
        not re.search("[,;\t]", heading)
        and re.search("[;\t]|,.*,", below)
        and len(heading.split()) != len(below.split())
    ):
        heading = below  # the first line is a title
    separator = max(",;\t|", key=heading.count)
    if separator not in heading and " " in heading.strip():
        return re.sub(r"^ +| +$", "", text, flags=re.MULTILINE), 0, " "
    return text, 0, separator


def _whole(path: Path, line: int, cells: list[str], heads: list[str], separator: str) -> list[str]:
    """The row with one cell a column; one with others is refused: its values would stand in the columns beside."""
    short = heads[len(cells) :]
    if len(cells) > len(heads) or not set(short) <= {"", *_NOTES}:
        name = {",": "comma", ";": "semicolon", "\t": "tab"}.get(separator, repr(separator))
        remedy = (
            f"delete the {name} at its end, put a value that holds one (a decimal comma, a note) in quotes, or name "
            "the column"
            if len(cells) > len(heads)
            else f"write a {name} for each empty cell too ({', '.join(head for head in short if head)})"
        )
        much = "more" if len(cells) > len(heads) else "fewer"
        raise InputError(
            f"{path}, line {line}: has {much} cells ({len(cells)}) than the heading has columns ({len(heads)}): "
            f"its values cannot be told apart; {remedy}."
        )
    for k, (head, cell) in enumerate(zip(heads, cells, strict=False)):
        if cell and not head and k:  # the first may hold the numbers of rows
            raise InputError(f"{path}, line {line}: holds {cell[:40]!r} in column {k + 1}, which has no name; name it.")
    return [*cells, *[""] * len(short)]


def _refuse_totals(path: Path, heads: list[str], rows: list[tuple[int, list[str]]]) -> None:
    """Refuse a row of sums or means: it would count as one more."""
    for k, head in enumerate(heads):
        first = k == 0 or head in _NAMES
        found = [line for line, cells in rows if head not in _NOTES and _sums_up(cells[k], first)]
        # What stands in most rows is what these are: a table of means.
        if 0 < len(found) < len(rows) / 2:
            cell = dict(rows)[found[0]][k]
            raise InputError(
                f"{path}, line {found[0]}: {cell!r} sums up the rows above, expected one thing a row; delete it."
            )


def _sums_up(cell: str, first: bool) -> bool:
    """Whether a cell says that its row is a sum or a mean. first: it names the row, then also by ``Mean P1``."""
    words = cell.lower().replace(":", " ").split()
    return bool(words) and (words[0] in _TOTALS or words[-1] in _TOTALS) and (first or len(words) == 1)


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


def numbered_lines(path: Path, remedy: str, error: type[InputError] = InputError) -> list[tuple[int, str]]:
    """``(number, line)`` of a text file, without empty ones.

    Raises:
        InputError: (``error``) cannot be read, and the remedy.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as problem:
        raise error(f"{path}: cannot be read ({problem.strerror}); {remedy}.") from None
    return [(number, line) for number, line in enumerate(lines, start=1) if line.strip()]


def safe_cell(value: Any) -> Any:
    """A cell that no spreadsheet runs: a text that would be a formula gets an apostrophe in front; numbers, also as
    text, stay.

    A text that starts with an apostrophe gets one more, so that :func:`plain_cell` gives every text back.
    """
    if not isinstance(value, str) or value[:1] not in (*_RUN, "'"):
        return value
    is_number = value.strip() == value and math.isfinite(as_number(value))
    return value if is_number else "'" + value


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
            # Whole numbers beside empty cells would become fractions.
            made[name] = type(made[name])([safe_cell(cell) for cell in made[name]], made.index, dtype=object)
    return made.rename(columns=safe_cell)


def write_csv(path: Path, table: Any, **more: Any) -> None:
    """A data frame, less its geometries, as a CSV of safe cells, whole or not at all."""
    with atomic_path(path) as temporary:
        safe_frame(table.drop(columns="geometry", errors="ignore")).to_csv(temporary, index=False, **more)
