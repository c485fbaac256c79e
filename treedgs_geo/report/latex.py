"""A table as LaTeX (booktabs)."""

from __future__ import annotations

from .blocks import NOTHING, Table

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
