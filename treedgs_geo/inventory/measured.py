"""Measured trees as other verbs count them: a tree layer, or a CSV table of another program."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj

from ..core.columns import columns, measured, numbers, places, require
from ..core.errors import InputError
from ..core.frames import suggest_utm
from ..core.plausible import odd_diameters, refuse_odd_heights
from ..core.tables import is_table, read_table
from ..core.wrong_units import wrong_unit
from .field_trees import dbh_in_cm, tree_counts
from .reviewed import COLUMNS as DECIDED
from .statuses import said_elsewhere, statuses
from .tree_reading import plain_flags, read_trees

#: A layer was moved as a whole where its points lie this far from their rows' x, y, m: more than datums differ, less
#: than CRSs do; all alike within so much.
_MOVED_M, _ALIKE_M = (2.5, 1000.0), 0.3
#: A DBH and that of its basal area differ by rounding only, up to this share and this, cm.
_SAME_SHARE, _SAME_CM = 0.02, 0.3


def read_measured(path: Path, crs: pyproj.CRS | None, dbh_unit: str = "auto") -> gpd.GeoDataFrame:
    """A tree layer, or a CSV with ``tree_id, x, y, dbh_cm`` (``crs`` is then the CRS of x and y) and where it has them
    interval, flag, decisions, species, status, note, height (m or ft), height_se_m, n_pts, plot_id.

    Raises:
        InputError: not readable, columns missing, doubled ids, positions that are no numbers, an unclear DBH unit.
    """
    path = Path(path)
    if is_table(path):
        table = read_table(path)
        found = columns(table, "field_id", "easting", "northing", "dbh", "dbh1", "girth", "species", "height")
        tree_counts(path, table, found)  # refuses classes
        require(path, table, found, ("field_id", "easting", "northing", ("dbh", "dbh1", "girth")))
        trees = pd.DataFrame({"tree_id": numbers(path, table, found["field_id"].name, required=True)})
        trees[["x", "y"]] = places(path, table, crs)
        trees["dbh_cm"] = dbh_in_cm(path, table, dbh_unit, "--trees-dbh-unit")
        for name in ("dbh_se_cm", "dbh_lo_cm", "dbh_hi_cm", "height_se_m", "n_pts"):
            if name in table:
                trees[name] = numbers(path, table, name)
        if "height" in found:
            trees["height_m"] = measured(path, table, "height", found["height"]).where(lambda height: height > 0)
        if (said := statuses(path, table)) is not None:
            trees["status"] = said
        trees.attrs["said"] = said_elsewhere(path, table, said)
        for name in ("qc_flag", "qc_reason", "plot_id", "species", "note", *DECIDED):
            if (written := found[name].name if name in found else name) in table:
                trees[name] = table[written]
        trees = plain_flags(path, trees) if "qc_flag" in trees else trees
        trees = gpd.GeoDataFrame(trees, geometry=gpd.points_from_xy(trees["x"], trees["y"]), crs=crs)
    else:
        trees = read_trees(path)
        if trees.crs is not None and trees.crs.is_geographic and len(trees):
            # As GeoJSON has it: distances need metres.
            trees = trees.to_crs(suggest_utm(float(trees.geometry.x.mean()), float(trees.geometry.y.mean())))
        moved = _moved_m(trees)
        trees["x"], trees["y"] = trees.geometry.x, trees.geometry.y
        trees.attrs["moved_m"] = moved
    if trees["tree_id"].duplicated().any() or trees["tree_id"].isna().any():
        raise InputError(f"{path}: a tree_id is missing or appears twice; give every measured tree its own tree_id.")
    trees["tree_id"] = trees["tree_id"].astype(int)
    _refuse_edited(path, trees)
    if "height_m" in trees:
        refuse_odd_heights(
            pd.to_numeric(trees["height_m"]).to_numpy(float),
            pd.to_numeric(trees["dbh_cm"]).to_numpy(float),
            lambda odd: f"{path}: tree {trees['tree_id'][odd].iloc[0]}",
            "give them in metres",
            trees.get("plot_id"),
            units_only=True,
        )
    for name in ("qc_flag", "dbh_lo_cm", "dbh_hi_cm"):
        if name not in trees:
            trees[name] = None
    return trees.reset_index(drop=True)


def _moved_m(trees: gpd.GeoDataFrame) -> float:
    """How far the points lie from where their rows' ``x, y`` say, all alike; 0 where they do not, or not alike."""
    if not {"x", "y"} <= set(trees) or len(trees) < 3:
        return 0.0
    away = np.column_stack([trees.geometry.x - pd.to_numeric(trees["x"]), trees.geometry.y - pd.to_numeric(trees["y"])])
    middle = np.nanmedian(away, axis=0)
    alike = np.nanmedian(np.hypot(*(away - middle).T)) < _ALIKE_M
    return float(np.hypot(*middle)) if alike and _MOVED_M[0] < np.hypot(*middle) < _MOVED_M[1] else 0.0


def edited(trees: pd.DataFrame) -> np.ndarray:
    """(N,) trees with a DBH that is not that of their basal area: somebody typed it over the measured one."""
    dbh, own = pd.to_numeric(trees["dbh_cm"]).to_numpy(float), _of_basal_area(trees)
    return np.abs(dbh - own) > np.maximum(_SAME_SHARE * own, _SAME_CM)


def _of_basal_area(trees: pd.DataFrame) -> np.ndarray:
    """(N,) diameters of the basal areas, cm; NaN where there is none."""
    if "ba_m2" not in trees:
        return np.full(len(trees), np.nan)
    return np.sqrt(pd.to_numeric(trees["ba_m2"]).to_numpy(float) * 4e4 / np.pi)


def _refuse_edited(path: Path, trees: pd.DataFrame) -> None:
    """Refuse DBHs that somebody typed in another unit: against the tree's basal area, which
    was measured, else against the others. What a person decided on stays."""
    dbh, own = pd.to_numeric(trees["dbh_cm"]).to_numpy(float), _of_basal_area(trees)
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
    odd &= ~decided & (~np.isfinite(own) | edited(trees))
    if odd.any():
        raise InputError(
            f"{path}: tree {trees['tree_id'][odd].iloc[0]} has a DBH of {dbh[odd][0]:g} cm: {why}; correct it, or "
            "accept the tree by the verb review if it is right."
        )
