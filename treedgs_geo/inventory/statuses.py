"""Live or dead: the words and columns by which a table says it."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from ..core.columns import columns, line_of
from ..core.errors import InputError
from .tree_reading import text_of

LIVE = {
    *("", "live", "l", "alive", "living", "a", "1", "ok", "healthy", "good", "fair", "nan", "none", "vif", "vivant"),
    *("lebend", "lebendig", "vital", "gesund", "gut", "grün", "vivo", "viva", "sano", "sana", "bueno", "buena"),
}
DEAD = {
    *("dead", "d", "snag", "2", "standing dead", "mort", "ds", "tot", "abgestorben", "dürr", "duerr", "dürrständer"),
    *("stehend tot", "totholz", "muerto", "muerta", "seco", "seca", "muerto en pie"),
    *("morte", "mort sur pied", "sec", "martwe", "martwy", "martwa", "posusz", "kuollut", "pystykuollut", "kelo"),
}
#: No tree stands there any more.
GONE = {
    *("3", "removed", "cut", "harvested", "felled", "fallen", "down", "stump", "missing", "gone"),
    *("gefällt", "gefaellt", "entnommen", "geerntet", "fehlt", "stumpf", "stubben", "stock", "liegend", "umgestürzt"),
    *("talado", "talada", "cortado", "cortada", "caido", "caído", "tocon", "tocón", "falta", "stubbe"),
}
#: Of these, what other columns say of other things.
_OF_OTHERS = {
    *("d", "l", "2", "3", "ds", "seco", "seca", "sec", "cut", "removed", "down", "missing", "gone"),
    *("fehlt", "falta", "stock", "stumpf", "liegend"),
}
_YES = {"yes", "y", "true", "t", "1", "1.0", "x", "✓", "ja", "j", "wahr", "si", "sí", "verdadero"}
_NO = {"no", "n", "false", "f", "0", "0.0", "nein", "falsch", "falso"}


def said_elsewhere(path: Path, table: pd.DataFrame, said: pd.Series | None) -> list[str]:
    """Sentences on columns that are not read and say of trees that they are dead or gone. said: :func:`statuses`."""
    read = {column.name for column in columns(table, "status", "condition", "dead", "alive").values()}
    unsaid, found = True if said is None else said.isna(), []
    for name in [name for name in table if name not in read]:
        dead = unsaid & table[name].map(lambda cell: text_of(cell).lower()).isin((DEAD | GONE) - _OF_OTHERS)
        if dead.any():
            found.append(
                f"{path}: column {name!r} says {table[name][dead].iloc[0]!r} of {int(dead.sum())} of {len(table)} "
                "trees, but is not read for it: they count as live; say it in a column called status."
            )
    return found


def statuses(path: Path, table: pd.DataFrame) -> pd.Series | None:
    """The status of each row as a word, ``None`` where nothing is said: by a column of statuses, one of conditions (a
    number or grade there is none), one that is called ``dead`` or ``alive`` and says yes or no. ``None``: no such
    column.

    Raises:
        InputError: a number other than 0 and 1 in a column of yes and no.
    """
    has = columns(table, "status", "condition", "dead", "alive")
    if not has:
        return None
    words = {key: table[column.name].map(lambda cell: text_of(cell).lower()) for key, column in has.items()}
    for key, yes, no, bare in (("dead", "dead", "live", ""), ("alive", "live", "dead", "empty")):
        if key in has:
            name = has[key].name
            bad = pd.to_numeric(words[key], errors="coerce").notna() & ~words[key].isin(_YES | _NO)
            if bad.any():
                raise InputError(
                    f"{path}, {line_of(bad)}: {name} is {words[key][bad].iloc[0]}, expected yes or no of one tree; "
                    "name the column for what it is."
                )
            known = {**dict.fromkeys(_YES, yes), **dict.fromkeys(_NO, no), "": bare and f"{name} {bare}"}
            words[key] = words[key].replace(known)
    if "condition" in has:
        # Grades run from A to D, and classes from 1 to 3: none of them says that a tree is dead.
        short = words["condition"].str.len().eq(1) & ~words["condition"].isin(["l", "a", "d"]).all()
        short |= words["condition"].str.fullmatch(r"[\d.]+")
        words["condition"] = words["condition"].where(~short, has["condition"].name + " " + words["condition"])
    said = pd.Series("", table.index)
    for key in ("status", "dead", "condition", "alive"):
        if key in words:
            keep = (said != "") & ~(said.isin(LIVE) & words[key].isin(DEAD | GONE))
            said = said.where(keep, words[key])
    if "status" in has:
        said = said.where(said != words["status"], table[has["status"].name])
    return said.astype(object).where(said != "", None)
