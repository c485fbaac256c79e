"""What refused stems were read as: the table ``readings`` of a tree file, for whoever has to count stems without a DBH.

A reading that was refused is no DBH: it may be off by far more than its error says. It tells a thin stem from a thick
one all the same.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from ..core.layer_files import add_layer, read_if_there

#: Name of the table, and its columns.
READINGS = "readings"
COLUMNS = ("tree_id", "read_cm", "read_se_cm")


def readings_table(rows: list[tuple[int, float, float]]) -> pd.DataFrame:
    """rows: number, diameter and its standard error, cm."""
    return pd.DataFrame(rows, columns=list(COLUMNS)).round(2).astype({"tree_id": "int64"})


def add_readings(geopackage: Path, table: pd.DataFrame | None) -> None:
    """Append the table to a tree layer's GeoPackage."""
    if table is not None and len(table):
        add_layer(geopackage, READINGS, table)


def read_readings(path: Path) -> pd.DataFrame | None:
    """The table of a tree file; ``None`` where it has none."""
    table = read_if_there(path, READINGS, COLUMNS)
    return None if table is None else table[list(COLUMNS)]


def with_readings(trees: pd.DataFrame, path: Path) -> pd.DataFrame:
    """A tree list with ``read_cm`` and ``read_se_cm`` (NaN: not read)."""
    table = read_readings(path)
    if table is None:
        return trees.assign(read_cm=np.nan, read_se_cm=np.nan)
    found = table.drop_duplicates("tree_id").set_index("tree_id").reindex(pd.to_numeric(trees["tree_id"]))
    return trees.assign(**{name: found[name].to_numpy(float) for name in COLUMNS[1:]})
