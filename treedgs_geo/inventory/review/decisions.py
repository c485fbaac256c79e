"""The table of decisions: one row a tree, what a person decided about it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from ...core.columns import columns, numbers
from ...core.errors import InputError
from ...core.tables import read_table
from ...report.blocks import known
from ..field_trees import dbh_in_cm
from ..reviewed import DECISIONS, MAX_TAPED_CM, MIN_TAPED_CM
from ..tree_reading import text_of

#: Takes a decision back.
UNDO = "undo"
#: Other words for the decisions.
_WORDS = {"ok": "accept", "yes": "accept", "no": "reject", "tape": "dbh", "taped": "dbh", "clear": UNDO}


@dataclass(frozen=True)
class Decision:
    """One row. tree: its number, ``None`` for a stem at ``x, y`` (project CRS) that the layer does not have.

    word: a key of ``reviewed.DECISIONS``, or :data:`UNDO`. dbh_cm: of ``dbh`` (and of a stem whose DBH is known).
    same_as: of ``merge``. by, at: who and when (ISO 8601), empty where the table does not say. line: in the file.
    """

    line: int
    word: str
    tree: int | None = None
    dbh_cm: float | None = None
    same_as: int | None = None
    x: float | None = None
    y: float | None = None
    note: str = ""
    by: str = ""
    at: str = ""


def read_decisions(path: Path, dbh_unit: str = "auto") -> list[Decision]:
    """Read a CSV with ``tree_id, decision`` and, where needed, ``dbh_cm`` (``dbh_in`` ...), ``same_as``, ``x, y``,
    ``note, by, at``.

    Raises:
        InputError: line, what was found, what was expected.
    """
    path = Path(path)
    table = read_table(path)
    has = columns(table, "field_id", "easting", "northing", "dbh", "girth")
    if "decision" not in table or not ("field_id" in has or {"easting", "northing"} <= set(has)):
        raise InputError(
            f"{path}: found columns {', '.join(table.columns)}; expected tree_id (or x and y) and decision "
            f"({', '.join(DECISIONS)} or {UNDO})."
        )
    values = {"dbh": dbh_in_cm(path, table, dbh_unit).to_numpy(float)}
    names = {
        key: has[own].name for key, own in (("tree", "field_id"), ("x", "easting"), ("y", "northing")) if own in has
    }
    for key in ("tree", "x", "y", "same_as"):
        name = names.get(key, key)
        values[key] = numbers(path, table, name).to_numpy() if name in table else np.full(len(table), np.nan)
    found = [_decision(path, table, values, row) for row in range(len(table))]
    seen: dict[int, int] = {}
    for decision in found:
        if decision.tree is None:
            continue
        if decision.tree in seen:
            raise InputError(
                f"{path}, line {decision.line}: tree {decision.tree} is decided on line {seen[decision.tree]} already; "
                "give each tree one row."
            )
        seen[decision.tree] = decision.line
    return found


def _decision(path: Path, table: pd.DataFrame, values: dict[str, np.ndarray], row: int) -> Decision:
    line, cells = int(table.index[row]), table.iloc[row]
    where = f"{path}, line {line}"
    text = {name: text_of(cells.get(name)) for name in ("decision", "note", "by", "at")}
    dbh, x, y = (known(values[key][row]) for key in ("dbh", "x", "y"))
    tree, same_as = (_whole(where, name, values[key][row]) for name, key in (("tree_id", "tree"), ("same_as",) * 2))
    word = text["decision"].lower() or ("dbh" if dbh is not None else "")
    word = _WORDS.get(word, word)
    if word not in DECISIONS and word != UNDO:
        raise InputError(f"{where}: the decision is {text['decision']!r}, expected {', '.join(DECISIONS)} or {UNDO}.")
    if tree is None and (word not in ("stem", "dbh") or x is None or y is None):
        raise InputError(
            f"{where}: has no tree_id; give it (a stem that the layer does not have: decision stem or dbh, with x "
            "and y)."
        )
    if word == "merge" and (same_as is None or same_as == tree):
        raise InputError(f"{where}: 'merge' needs same_as, the number of the other tree that this one is.")
    if word == "dbh" and dbh is None:
        raise InputError(f"{where}: 'dbh' needs the taped diameter in dbh_cm (or dbh_in, dbh_mm).")
    if dbh is not None and word not in ("dbh", "stem"):
        raise InputError(f"{where}: has a DBH but the decision {word!r}; write 'dbh', or empty the cell.")
    if dbh is not None and not MIN_TAPED_CM <= dbh <= MAX_TAPED_CM:
        raise InputError(f"{where}: a DBH of {dbh:g} cm, expected {MIN_TAPED_CM:g} to {MAX_TAPED_CM:g} cm.")
    word = "dbh" if word == "stem" and dbh is not None else word
    placed = (x, y) if tree is None else (None, None)
    return Decision(line, word, tree, dbh, same_as, *placed, text["note"], text["by"], text["at"])


def _whole(where: str, name: str, value: float) -> int | None:
    if not np.isfinite(value):
        return None
    if value != int(value):
        raise InputError(f"{where}: {name} is {value:g}, expected a whole number as in the tree layer.")
    return int(value)
