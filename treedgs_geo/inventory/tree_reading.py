"""Reading tree layers that TreeDGS wrote."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

import geopandas as gpd
import numpy as np
import pandas as pd

from ..core.errors import InputError
from ..core.tables import read_table, refuse_other_formats

LAYER = "trees"
#: Names of columns that are longer than a shapefile can have, and what they are called there.
SHORT_NAMES = {"height_se_m": "ht_se_m"}
_NUMBERS = (
    *("tree_id", "x", "y", "z_ground", "dbh_cm", "dbh_se_cm", "dbh_lo_cm", "dbh_hi_cm", "bh_m", "height_m"),
    *("height_se_m", "ba_m2", "lean_deg", "arc_deg", "n_pts", "n_views", "n_slices", "rev_dbh_cm"),
)
#: A point and the ``x, y`` of its row are one place within this distance, in units of the CRS.
_SAME_M = 0.5
#: What people write into ``qc_flag``.
_FLAGS = {
    **dict.fromkeys(("ok", "good", "yes", "accept", "accepted", "measured", "gut", "bien"), "ok"),
    **dict.fromkeys(("check", "flagged", "doubtful", "?", "prüfen", "pruefen", "revisar"), "check"),
    **dict.fromkeys(("reject", "rejected", "refuse", "refused", "abgelehnt", "rechazado"), "reject"),
    **dict.fromkeys(("no tree", "no_tree", "notree", "not a tree", "none", "no", "false", "false tree"), "no tree"),
    **dict.fromkeys(("delete", "deleted", "remove", "removed", "kein baum", "sin árbol", "sin arbol"), "no tree"),
}

_Table = TypeVar("_Table", bound=pd.DataFrame)


def read_trees(path: Path, as_written: bool = False) -> gpd.GeoDataFrame:
    """Read a tree layer written by :func:`.tree_layer.write_trees`, also after a person or another program edited it:
    numbers as text, multi-points, trees without a point (their ``x, y`` count) and flags in other words are read.

    as_written: as it is in the file, to be written back.

    Raises:
        InputError: not readable, not a tree layer, a tree without a place, a number or flag that is none.

    Examples:
        >>> import treedgs_geo as tg
        >>> path = tg.write_trees(work / "one.gpkg", [tg.Tree(1, 500000.0, 5.2e6, dbh_cm=31.0)], "EPSG:32632")
        >>> tg.read_trees(path)[["tree_id", "dbh_cm", "qc_flag"]].values.tolist()
        [[1, 31.0, 'ok']]
    """
    path = Path(path)
    refuse_other_formats(path, layers=True)
    try:
        if path.suffix.lower() == ".csv":
            cells = read_table(path, as_written=True).reset_index(drop=True)
            if lacking := [name for name in "xy" if name not in cells]:
                raise InputError(f"{path}: has no column {lacking[0]}, found {', '.join(cells)}; give a tree layer.")
            points = gpd.points_from_xy(*(pd.to_numeric(cells[name]) for name in "xy"))
            table = gpd.GeoDataFrame(cells, geometry=points)
        else:
            layer = {"layer": LAYER} if path.suffix.lower() == ".gpkg" else {}
            table = gpd.read_file(path, engine="pyogrio", **layer)
    except InputError:
        raise
    except Exception as problem:
        raise InputError(f"{path}: cannot be read as a tree layer ({problem}).") from None
    # A shapefile of ours, or one that GDAL cut the names of.
    cut = {cut: name for name, short in SHORT_NAMES.items() for cut in (short, name[:10])}
    table = table.rename(columns=cut)
    missing = {"tree_id", "dbh_cm", "qc_flag"} - set(table.columns)
    if missing:
        raise InputError(f"{path}: lacks the columns {', '.join(sorted(missing))}; give a layer made by TreeDGS.")
    if "rev_at" in table and str(table["rev_at"].dtype).startswith("datetime"):
        # GDAL takes the text for a time where the format has no types of its own (GeoJSON).
        moments = pd.to_datetime(table["rev_at"], utc=True)
        table["rev_at"] = moments.dt.strftime("%Y-%m-%dT%H:%M:%SZ").astype(object).where(moments.notna(), None)
    return table if as_written else plain_flags(path, typed(path, table))


def typed(path: Path, table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """The layer with numbers as numbers and one point a tree; of a tree without one its ``x, y``, where those of the
    others are their points.

    Raises:
        InputError: a number that is none; other shapes, several points, no place.
    """
    for name in _NUMBERS:
        if name in table and table[name].dtype.kind not in "iuf":
            table[name] = _numbers(path, table, name)
    shapes = table.geometry
    if not len(table) or (shapes.geom_type == "Point").all() and not shapes.is_empty.any():
        return table
    bare = shapes.isna() | shapes.is_empty
    odd = ~bare & ~shapes.geom_type.isin(["Point", "MultiPoint"])
    if odd.any():
        raise InputError(f"{path}: holds {shapes[odd].geom_type.iloc[0]} shapes, expected one point a tree.")
    several = ~bare & (shapes.count_geometries() > 1)
    if several.any():
        tree = table["tree_id"][several].iloc[0]
        raise InputError(
            f"{path}: tree {tree} has several points; give each tree one (QGIS: Multipart to singleparts)."
        )
    found = shapes.copy()
    found[~bare] = shapes[~bare].centroid.where(shapes[~bare].geom_type == "MultiPoint", shapes[~bare])
    if bare.any():
        xy = table[["x", "y"]].apply(pd.to_numeric, errors="coerce") if {"x", "y"} <= set(table) else None
        there = found[~bare]
        if (
            xy is None
            or xy[bare].isna().any(axis=None)
            or not len(there)
            or np.nanmedian(np.hypot(there.x - xy["x"][~bare], there.y - xy["y"][~bare])) > _SAME_M
        ):
            named = ", ".join(map(str, table["tree_id"][bare].head(5)))
            raise InputError(
                f"{path}: {int(bare.sum())} of {len(table)} trees have no point (tree {named}), so that no plot would "
                "count them; set their points, or delete the rows."
            )
        found[bare] = gpd.points_from_xy(xy["x"][bare], xy["y"][bare], crs=table.crs)
    return table.set_geometry(found)


def plain_flags(path: Path, table: _Table) -> _Table:
    """``qc_flag`` as ``ok``, ``check`` or ``reject``, however a person wrote it; who wrote that no tree stands there
    has rejected the tree (``rev_flag``). A layer without any flag stays.

    Raises:
        InputError: a flag that means nothing, or none for a tree with a DBH where others have one.
    """
    said = table["qc_flag"].map(lambda value: "" if pd.isna(value) else " ".join(str(value).lower().split()))
    if (said == "").all():
        return table
    flag = said.map(_FLAGS)
    odd = flag.isna() & ((said != "") | table["dbh_cm"].notna())
    if odd.any():
        named = ", ".join(map(str, table["tree_id"][odd].head(5)))
        word = repr(said[odd].iloc[0]) if said[odd].iloc[0] else "no word"
        raise InputError(
            f"{path}: {int(odd.sum())} of {len(table)} trees (tree {named}) have {word} as qc_flag, expected ok, "
            "check, reject (a stem without a DBH) or no tree; correct it."
        )
    table = table.assign(qc_flag=flag.replace("no tree", "reject").fillna("reject"))
    gone = (flag == "no tree").to_numpy()
    if gone.any():
        nothing = pd.Series([None] * len(table), index=table.index, dtype=object)
        decided = table.get("rev_flag", nothing).astype(object)
        table["rev_flag"] = decided.mask(gone & (decided.isna() | (decided == "")), "reject")
    return table


def _numbers(path: Path, table: gpd.GeoDataFrame, name: str) -> pd.Series:
    """A column of text as numbers, with decimal points or commas."""
    text = table[name].map(lambda cell: text_of(cell).replace(",", "."))
    values = pd.to_numeric(text.where(text != "", None), errors="coerce").astype(float)
    odd = values.isna() & (text != "")
    if odd.any():
        raise InputError(
            f"{path}: tree {table['tree_id'][odd].iloc[0]} has {name} {table[name][odd].iloc[0]!r}, expected a number; "
            "correct it."
        )
    return values


def text_of(cell: object) -> str:
    """What stands in a cell, without blanks around it; empty where nothing does."""
    return "" if pd.isna(cell) else str(cell).strip()


def texts_of(cells: pd.Series) -> pd.Series:
    """The same of a column; ``None`` where nothing stands."""
    texts = cells.map(text_of).astype(object)
    return texts.where(texts != "", None)
