"""Field trees whose row does not say where they stand: left out one by one, and named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from ..core.errors import InputError

#: Of a table's trees this share may lack a bearing or a distance; with more it is the table that is wrong.
_MAX_UNPLACED = 0.5


def drop_unplaced(trees: pd.DataFrame, path: Path) -> tuple[pd.DataFrame, list[str]]:
    """The trees that have a place, and a sentence about those that have none."""
    lacking = trees[trees["lacks"] != ""]
    if not len(lacking):
        return trees, []
    named = [f"line {row.line} (tree {row.field_id}: {row.lacks})" for row in lacking.head(10).itertuples()]
    text = (
        f"{path}: {len(lacking)} of {len(trees)} field trees left out of the pairing, as nothing says where they "
        f"stand: {', '.join(named)}{', …' if len(lacking) > 10 else ''}; correct the table and run again."
    )
    return trees[trees["lacks"] == ""].reset_index(drop=True), [text]


def where_said(table: pd.DataFrame, name: str, found: pd.DataFrame) -> pd.Series:
    """A column as float64; rows where it is empty or no number are noted in ``lacks``."""
    cells = table[name]
    values = pd.to_numeric(cells, errors="coerce").astype(float)
    values = values.where(np.isfinite(values))
    for row in np.flatnonzero(values.isna() & (found["lacks"] == "")):
        text = cells.iloc[row]
        found.loc[found.index[row], "lacks"] = f"{name} is empty" if pd.isna(text) else f"{name} is {text!r}"
    return values


def clear_unplaced(path: Path, found: pd.DataFrame, columns: list[str]) -> None:
    """Half a place is none; a table in which most trees lack theirs is refused."""
    lacking = (found["lacks"] != "").to_numpy()
    if lacking.mean() > _MAX_UNPLACED or lacking.all():
        first = found[lacking].iloc[0]
        raise InputError(
            f"{path}, line {first['line']}: {first['lacks']}, expected a number; {int(lacking.sum())} of {len(found)} "
            "rows are like this: correct them."
        )
    found.loc[lacking, columns] = np.nan
