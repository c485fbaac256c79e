"""Measured trees as other verbs count them: a tree layer, or a CSV table of another program."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj

from ..core.columns import columns, numbers, places, require
from ..core.errors import InputError
from ..core.plausible import odd_diameters
from ..core.tables import is_table, read_table
from ..core.wrong_units import wrong_unit
from .field_trees import dbh_in_cm
from .reviewed import COLUMNS as DECIDED
from .tree_reading import plain_flags, read_trees


def read_measured(path: Path, crs: pyproj.CRS | None, dbh_unit: str = "auto") -> gpd.GeoDataFrame:
    """A tree layer, or a CSV with ``tree_id, x, y, dbh_cm`` (``crs`` is then the CRS of x and y).

    Raises:
        InputError: not readable, columns missing, doubled ids, positions that are no numbers, an unclear DBH unit.
    """
    path = Path(path)
    if is_table(path):
        table = read_table(path)
        found = columns(table, "field_id", "easting", "northing", "dbh", "dbh1", "girth")
        require(path, table, found, ("field_id", "easting", "northing", ("dbh", "dbh1", "girth")))
        trees = pd.DataFrame({"tree_id": numbers(path, table, found["field_id"].name, required=True)})
        trees[["x", "y"]] = places(path, table, crs)
        trees["dbh_cm"] = dbh_in_cm(path, table, dbh_unit, "--trees-dbh-unit")
        for name in ("dbh_se_cm", "dbh_lo_cm", "dbh_hi_cm"):
            if name in table:
                trees[name] = numbers(path, table, name)
        for name in ("qc_flag", *DECIDED):
            if name in table:
                trees[name] = table[name]
        trees = plain_flags(path, trees) if "qc_flag" in trees else trees
        trees = gpd.GeoDataFrame(trees, geometry=gpd.points_from_xy(trees["x"], trees["y"]), crs=crs)
    else:
        trees = read_trees(path)
        trees["x"], trees["y"] = trees.geometry.x, trees.geometry.y
    if trees["tree_id"].duplicated().any() or trees["tree_id"].isna().any():
        raise InputError(f"{path}: a tree_id is missing or appears twice; give every measured tree its own tree_id.")
    trees["tree_id"] = trees["tree_id"].astype(int)
    _refuse_edited(path, trees)
    for name in ("qc_flag", "dbh_lo_cm", "dbh_hi_cm"):
        if name not in trees:
            trees[name] = None
    return trees.reset_index(drop=True)


def _refuse_edited(path: Path, trees: pd.DataFrame) -> None:
    """Refuse DBHs that somebody typed in another unit: against the tree's basal area, which
    was measured, else against the others. What a person decided on stays.

    Raises:
        InputError: the first tree.
    """
    dbh = pd.to_numeric(trees["dbh_cm"]).to_numpy(float)
    own = np.full(len(trees), np.nan)
    if "ba_m2" in trees:
        own = np.sqrt(pd.to_numeric(trees["ba_m2"]).to_numpy(float) * 4e4 / np.pi)
    # What nobody edited is the same but for digits.
    slip = wrong_unit(dbh, np.where(np.abs(dbh - own) > 0.02 * own, own, np.nan))
    if slip is not None:
        odd = trees["tree_id"][slip.rows]
        raise InputError(
            f"{path}: DBHs that somebody edited (tree {', '.join(map(str, odd.head(5)))}): "
            f"{slip.text('those of their basal areas')}; correct them, or give taped DBHs by the verb review."
        )
    decided = trees["rev_flag"].notna().to_numpy() if "rev_flag" in trees else np.zeros(len(trees), bool)
    odd, why = odd_diameters(dbh)
    odd &= ~decided & ~np.isfinite(own)
    if odd.any():
        raise InputError(
            f"{path}: tree {trees['tree_id'][odd].iloc[0]} has a DBH of {dbh[odd][0]:g} cm: {why}; correct it, or "
            "accept the tree by the verb review if it is right."
        )
