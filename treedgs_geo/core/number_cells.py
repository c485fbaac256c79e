"""Cells of a table that hold numbers, as people and spreadsheets write them: units, thousands, decimal commas."""

from __future__ import annotations

import math
import re
import unicodedata

from .column_names import QUANTITIES, plain_name

#: Units as they stand in a row of their own below the heading, or behind each number.
_UNITS = {
    *("cm", "mm", "m", "in", "ft", "inch", "feet", "zoll", "deg", "°", "gon", "grad", "mil", "%", "pct"),
    *("m2", "m²", "ha", "ac"),
}
_WITH_UNIT = re.compile(r"([+-]?\d+(?:[.,]\d+)?)\s*([^\W\d_]+[2²]?|°|%)")
#: Beginnings of the names of sizes.
_SIZES = ("taped", *(name for known in QUANTITIES.values() if known.units for name in known.names.split() if name[1:]))
#: What parts thousands and is never a decimal sign.
_SPACES = re.compile(r"(?<=\d)[\u00a0\u2009\u202f'’](?=\d{3}(?!\d))")
#: Of a spreadsheet's numbers: with a decimal comma, and with a decimal point.
_COMMA, _POINT = re.compile(r"[+-]?\d+,\d+"), re.compile(r"[+-]?\d+\.\d+")


def as_number(value: object) -> float:
    """A finite number; NaN where it is none."""
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, ZeroDivisionError):
        return math.nan
    return number if math.isfinite(number) else math.nan


def column_name(text: str) -> str:
    """A heading in lower case with underscores for whatever parts its words: ``DBH [cm]`` is ``dbh_cm``."""
    plain = unicodedata.normalize("NFC", text).strip().lower()
    return re.sub(r"[^\w%°]+", "_", plain).strip("_") or plain


def are_units(cells: list[str]) -> bool:
    """Whether a row names the units of its columns."""
    said = [_unit_of(cell) for cell in cells if cell]
    return bool(said) and all(unit in _UNITS for unit in said)


def _unit_of(cell: str) -> str:
    return cell.strip("[]() .").lower()


def with_unit(head: str, unit: str) -> str:
    """The column's name with the unit that a cell says, where it does not say it itself."""
    name = _unit_of(unit)
    return head if not name or column_name(head).endswith(f"_{name}") else f"{head}_{name}"


def without_units(rows: list[list[str]], k: int, head: str) -> str:
    """Column k without the unit behind its numbers, in place, and its name with it: all of them have it, or the name
    says it. Only of sizes: a plot may be called ``3m``."""
    if not plain_name(column_name(head)).startswith(_SIZES):
        return head
    found = [_WITH_UNIT.fullmatch(row[k]) for row in rows]
    units = {match[2].lower() for match in found if match}
    if len(units) != 1 or not units <= _UNITS:
        return head
    name = with_unit(head, *units)
    if name != head and not all(found[n] or not row[k] for n, row in enumerate(rows)):
        return head
    for row, match in zip(rows, found, strict=True):
        row[k] = match[1] if match else row[k]
    return name


def without_thousands(rows: list[list[str]]) -> None:
    """Numbers without what parts their thousands, in place, where the table leaves no doubt what does."""
    for row in rows:
        row[:] = [_SPACES.sub("", cell) for cell in row]
    cells = [cell for row in rows for cell in row]
    for mark, point in ((".", ","), (",", ".")):
        many = rf"[+-]?[1-9]\d{{0,2}}(?:[{mark}]\d{{3}})+"
        sure = re.compile(rf"{many}[{point}]\d+|[+-]?[1-9]\d{{0,2}}(?:[{mark}]\d{{3}}){{2,}}")
        decimal = re.compile(rf"[+-]?(?:\d+[{mark}](?:\d{{1,2}}|\d{{4,}})|0\d*[{mark}]\d+|\d{{4,}}[{mark}]\d+)")
        if any(map(sure.fullmatch, cells)) and not any(map(decimal.fullmatch, cells)):
            form = re.compile(rf"{many}(?:[{point}]\d+)?")
            for row in rows:
                row[:] = [cell.replace(mark, "") if form.fullmatch(cell) else cell for cell in row]
            return


def with_points(rows: list[list[str]], k: int, separator: str) -> None:
    """Decimal commas of column k as points, in place; commas that may be those of thousands stay, which makes the cell
    no number."""
    cells = [row[k] for row in rows]
    commas = [cell for cell in cells if _COMMA.fullmatch(cell)]
    if not commas:
        return
    points = [cell for cell in cells if _POINT.fullmatch(cell)]
    thousands = [cell for cell in (*commas, *points) if re.fullmatch(r"[+-]?[1-9]\d{0,2}[.,]\d{3}", cell)]
    if thousands and (points or (separator == "," and len(thousands) == len(commas))):
        return
    for row in rows:
        if _COMMA.fullmatch(row[k]):
            row[k] = row[k].replace(",", ".")
