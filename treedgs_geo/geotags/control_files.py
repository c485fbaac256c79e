"""Files of ground control points: ODM's ``gcp_list.txt`` and CSV, one row for each point marked in a photo."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj

from ..core.columns import FoundColumn, columns, epsg_crs, line_of, numbers, refuse_bounds, require
from ..core.errors import CRSError, InputError
from ..core.number_cells import as_number
from ..core.tables import numbered_lines, read_heading, read_table, refuse_other_formats
from .tables import crs_of_line

_PLACE = ("easting", "northing", "lon", "lat")
_KINDS = {"control": False, "gcp": False, "check": True, "checkpoint": True, "check point": True}
#: A label that ends so names a check point: ``P7_check``, ``P7-check``.
_CHECK_LABEL = re.compile(r"[\s_.-]check$", re.IGNORECASE)
_EXPECTED = (
    "expected ODM's gcp_list.txt (line 1 the CRS, then x y z px py photo [label]), or a CSV with the columns label, "
    "easting, northing, height (or lon, lat, height), photo, u, v"
)


#: Coordinates in the file's CRS, pixels, and standard errors E, N, U, metres.
PLACE, PIXEL, DEVIATIONS = ["x", "y", "z"], ["u", "v"], ["sd_e", "sd_n", "sd_u"]


def read_control_rows(path: Path) -> tuple[pyproj.CRS | None, pd.DataFrame]:
    """The CRS that the file names (``None``: that of the project) and its rows, one for each point marked in a photo:
    ``label`` (empty where the file gives none), :data:`PLACE`, ``photo`` (its name), :data:`PIXEL`, :data:`DEVIATIONS`
    (NaN) and ``is_check`` (``None`` where the file says nothing), by their lines.

    Raises:
        InputError: no such file, neither of the two formats, a row that cannot be read. CRSError: an unknown CRS.
    """
    refuse_other_formats(path)
    if {"photo", "u"} & set(columns(read_heading(path), "photo", "u")):
        crs, rows = _of_csv(path)
    else:
        crs, rows = _of_gcp_list(path)
    if rows.empty:
        raise InputError(f"{path}: holds no control point; {_EXPECTED}.")
    named = np.array([bool(_CHECK_LABEL.search(label)) for label in rows["label"]])
    rows.loc[named & rows["is_check"].isna(), "is_check"] = True
    return crs, rows


def _of_gcp_list(path: Path) -> tuple[pyproj.CRS | None, pd.DataFrame]:
    filled = [(n, line.rstrip()) for n, line in numbered_lines(path, _EXPECTED) if line.lstrip()[:1] != "#"]
    if not filled:
        return None, pd.DataFrame()
    try:
        crs = crs_of_line(filled[0][1], f"{path}, line {filled[0][0]}")
    except CRSError as problem:
        raise CRSError(f"{str(problem).rstrip('.')} in a gcp_list.txt; {_EXPECTED}.") from None
    rows = {}
    for number, line in filled[1:]:
        # Names of photos may hold blanks where tabs part the columns.
        cells = [cell.strip() for cell in line.split("\t")] if line.count("\t") >= 5 else line.split()
        numbers = [as_number(cell) for cell in cells[:5]]
        if len(cells) < 6 or not np.isfinite(numbers).all() or not cells[5]:
            raise InputError(
                f"{path}, line {number}: found {line.strip()[:70]!r}, expected x y z px py photo [label]; correct the "
                "row (a height that is not known makes no control point)."
            )
        said = True if {cell.lower() for cell in cells[7:]} & {"check", "checkpoint"} else None
        rows[number] = [*numbers, cells[5], cells[6] if len(cells) > 6 else "", said]
    found = pd.DataFrame.from_dict(rows, "index", columns=[*PLACE, *PIXEL, "photo", "label", "is_check"])
    return crs, found.assign(is_check=found["is_check"].astype(object), **dict.fromkeys(DEVIATIONS, np.nan))


def _of_csv(path: Path) -> tuple[pyproj.CRS | None, pd.DataFrame]:
    table = read_table(path, comments=True)
    has = columns(table, "point", "photo", "u", "v", "kind", *_PLACE, "altitude", "epsg", *DEVIATIONS)
    require(path, table, has, (("easting", "lon"), ("northing", "lat"), "altitude", "photo", "u", "v"))
    geographic = {"lon", "lat"} <= set(has)
    place = (*(("lon", "lat") if geographic else ("easting", "northing")), "altitude")
    rows = pd.DataFrame(index=table.index)
    for name, key in zip([*PLACE, *PIXEL], (*place, "u", "v"), strict=True):
        rows[name] = numbers(path, table, has[key].name, required=True)
    for key in DEVIATIONS:
        rows[key] = numbers(path, table, has[key].name) if key in has else np.nan
        if key in has:
            refuse_bounds(path, rows[key], f"standard deviation {has[key].name}", key)
    rows["photo"] = table[has["photo"].name]
    bare = rows["photo"].isna()
    if bare.any():
        raise InputError(f"{path}, {line_of(bare)}: has no photo; complete or delete the row.")
    rows["label"] = table[has["point"].name].fillna("") if "point" in has else ""
    kind = table[has["kind"].name] if "kind" in has else pd.Series(None, table.index, object)
    rows["is_check"] = kind.str.lower().map(_KINDS).astype(object)
    odd = kind.notna() & rows["is_check"].isna()
    if odd.any():
        raise InputError(f"{path}, {line_of(odd)}: kind {kind[odd.idxmax()]!r}, expected control or check.")
    return _csv_crs(path, table, has.get("epsg"), geographic), rows


def _csv_crs(path: Path, table: pd.DataFrame, column: FoundColumn | None, geographic: bool) -> pyproj.CRS | None:
    """The CRS of a table: column ``epsg`` (one for all rows), WGS 84 degrees, or the project's."""
    codes = table[column.name].fillna("") if column is not None else pd.Series([""], [2])
    other = codes != codes.iloc[0]
    if other.any():
        raise InputError(
            f"{path}, lines {codes.index[0]} and {codes.index[other][0]}: have different epsg; write all points in one "
            "CRS."
        )
    found = epsg_crs(codes.iloc[0], f"{path}, line {codes.index[0]}")
    return pyproj.CRS.from_epsg(4326) if found is None and geographic else found
