"""The parts of a page in order, whatever it is written as: text, figures, lists, tables (as LaTeX too), pictures."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from ..core.shown import half_up

#: Shown where nothing is known.
NOTHING = "–"


@dataclass(frozen=True)
class Heading:
    """A heading. level: 2 or 3 (1 is the title). new_page: printed, it begins a sheet of paper."""

    text: str
    level: int = 2
    new_page: bool = False


@dataclass(frozen=True)
class Paragraph:
    """Some sentences. strong: in bold."""

    text: str
    strong: bool = False


@dataclass(frozen=True)
class Cards:
    """The figures that matter most: (label, value with unit, interval or '')."""

    items: Sequence[tuple[str, str, str]]


@dataclass(frozen=True)
class Sentences:
    """A list. title: of the box in which warnings stand; '' for a plain list. Nothing is shown of an empty list.

    An option has no dashes here: who reads a page may have set it in a window.
    """

    items: Sequence[str]
    title: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "items", [re.sub(r"(?<![\w-])--(?=[a-z])", "", text) for text in self.items])


@dataclass(frozen=True)
class Picture:
    """data: PNG, JPEG or SVG. text: what it shows, for those who cannot see it. width: share of the page's width;
    0: as large as it was drawn, at most the whole."""

    text: str
    data: bytes
    width: float = 0.0


@dataclass(frozen=True)
class Fragment:
    """A part of an HTML page that is worked with (it has a script): a Jinja template, and its values.

    Values are escaped by the template; other kinds of documents leave it out.
    """

    template: str
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes:
        key: of the rows.
        heading: above it.
        decimals: ``None`` for text.
        factor: what values are multiplied by.
        signed: always shown with a sign.
    """

    key: str
    heading: str
    decimals: int | None = None
    factor: float = 1.0
    signed: bool = False


@dataclass(frozen=True)
class Table:
    """A table, on pages and as a file.

    Attributes:
        name: of the file, the sheet and the HTML element.
        title: above it.
        columns: in order.
        rows: dicts by column key; ``None``, NaN, infinite: not known; texts are shown as they are. ``mark``: the row's
            CSS class on a page.
        note: below it.
        n_totals: rows of sums at the end.
        classes: labels of all DBH classes from the thinnest to the thickest, empty ones too.
        folded: a long table: opened by a click, cut where paper ends (``more`` says where the rest is).
        more: file that has all rows.
        widths: shares of the page's width; given, the table is a grid with tall rows to be filled in by hand.
    """

    name: str
    title: str
    columns: list[Column]
    rows: list[dict[str, Any]]
    note: str = ""
    n_totals: int = 0
    classes: tuple[str, ...] = ()
    folded: bool = False
    more: str = ""
    widths: tuple[float, ...] = ()

    def text(self, row: Mapping[str, Any], column: Column, empty: str = NOTHING) -> str:
        """A cell as it is shown."""
        value = row.get(column.key)
        if value is None or not _holds(value):
            return empty
        if column.decimals is None or isinstance(value, str):
            return str(value)
        # Adding 0.0 turns a rounded -0.0 into 0.0.
        number = half_up(value * column.factor, column.decimals) + 0.0
        return f"{number:{'+' if column.signed else ''},.{column.decimals}f}".replace(",", "\u202f")

    @property
    def shown(self) -> list[Column]:
        """The columns that hold anything; texts always."""
        return [
            column
            for column in self.columns
            if column.decimals is None or not self.rows or any(_holds(row.get(column.key)) for row in self.rows)
        ]

    def only(self, *keys: str) -> Table:
        """The same with some of its columns."""
        return replace(self, columns=[column for column in self.columns if column.key in keys])

    def cut(self, limit: int) -> tuple[list[dict[str, Any]], str]:
        """The rows to show of a folded table, and the sentences below the table."""
        left = len(self.rows) - limit if self.folded else 0
        if left <= 0:
            return self.rows, self.note
        return self.rows[:limit], " ".join(filter(None, (self.note, f"{left} more in {self.more}.")))


Block = Heading | Paragraph | Cards | Sentences | Picture | Fragment | Table


@dataclass(frozen=True)
class Document:
    """A page.

    Attributes:
        title: of the page and of the window.
        subtitle: below it.
        blocks: in order.
        tables: every table by name, for spreadsheets and CSV files.
        letter: US letter paper rather than A4.
        wide: for a page that has a broad table or map.
    """

    title: str
    subtitle: str
    blocks: Sequence[Block]
    tables: Mapping[str, Table] = field(default_factory=dict)
    letter: bool = False
    wide: bool = False


def facts_table(name: str, title: str, facts: Mapping[str, Any] | Iterable[tuple[str, Any]]) -> Table:
    """A table of two columns: what, and its value."""
    pairs = facts.items() if isinstance(facts, Mapping) else facts
    return Table(
        name,
        title,
        [Column("what", "What"), Column("value", "Value")],
        [{"what": str(what), "value": str(value)} for what, value in pairs],
    )


def known(value: Any, factor: float = 1.0) -> float | None:
    """A number, times a factor, or ``None`` for what is not known (``None``, NaN, infinite, ``pd.NA``)."""
    return None if pd.isna(value) or not np.isfinite(value) else float(value) * factor


def _holds(value: Any) -> bool:
    return not pd.isna(value) and (not isinstance(value, float) or bool(np.isfinite(value)))


_ESCAPED = {"\\": r"\textbackslash{}", **{mark: "\\" + mark for mark in "&%$#_{}"}, "±": r"$\pm$", NOTHING: "--"}


def booktabs(table: Table, ruled_by: str = "") -> str:
    """A ``tabular``: texts to the left, numbers to the right, a rule before the sums and wherever the value of the
    column ``ruled_by`` changes."""
    columns = table.columns
    kinds = "".join("l" if column.decimals is None else "r" for column in columns)
    lines = [rf"\begin{{tabular}}{{{kinds}}}", r"\toprule", _line([column.heading for column in columns]), r"\midrule"]
    for number, row in enumerate(table.rows):
        changes = ruled_by and number and row[ruled_by] != table.rows[number - 1][ruled_by]
        if changes or number and number == len(table.rows) - table.n_totals:
            lines.append(r"\midrule")
        lines.append(_line([table.text(row, column) for column in columns]))
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])


def _line(cells: list[str]) -> str:
    return " & ".join("".join(_ESCAPED.get(mark, mark) for mark in cell) for cell in cells) + r" \\"
