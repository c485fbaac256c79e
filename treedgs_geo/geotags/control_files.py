"""Files of ground control points: ODM's ``gcp_list.txt`` and CSV, one row for each point marked in a photo."""

from __future__ import annotations

import re
from dataclasses import dataclass
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


@dataclass(frozen=True)
class ControlRow:
    """One point marked in one photo, as the file has it.

    label: empty where the file gives none. place: x, y, z in the file's CRS. photo: its name. pixel: u, v. sd_m: E, N,
    U, NaN where the file says nothing. is_check: ``None`` where the file says nothing.
    """

    line: int
    label: str
    place: tuple[float, float, float]
    photo: str
    pixel: tuple[float, float]
    sd_m: tuple[float, float, float]
    is_check: bool | None


def read_control_rows(path: Path) -> tuple[pyproj.CRS | None, list[ControlRow]]:
    """The CRS that the file names (``None``: that of the project) and its rows.

    Raises:
        InputError: no such file, neither of the two formats, a row that cannot be read. CRSError: an unknown CRS.
    """
    refuse_other_formats(path)
    if {"photo", "u"} & set(columns(read_heading(path), "photo", "u")):
        return _of_csv(path)
    filled = [(n, line.rstrip()) for n, line in numbered_lines(path, _EXPECTED) if line.lstrip()[:1] != "#"]
    crs, rows = _of_gcp_list(path, filled)
    if not rows:
        raise InputError(f"{path}: holds no control point; {_EXPECTED}.")
    return crs, rows


def _of_gcp_list(path: Path, filled: list[tuple[int, str]]) -> tuple[pyproj.CRS | None, list[ControlRow]]:
    if not filled:
        return None, []
    try:
        crs = crs_of_line(filled[0][1], f"{path}, line {filled[0][0]}")
    except CRSError as problem:
        raise CRSError(f"{str(problem).rstrip('.')} in a gcp_list.txt; {_EXPECTED}.") from None
    rows = []
    for number, line in filled[1:]:
        # Names of photos may hold blanks where tabs part the columns.
        cells = [cell.strip() for cell in line.split("\t")] if line.count("\t") >= 5 else line.split()
        numbers = [as_number(cell) for cell in cells[:5]]
        if len(cells) < 6 or not np.isfinite(numbers).all() or not cells[5]:
            raise InputError(
                f"{path}, line {number}: found {line.strip()[:70]!r}, expected x y z px py photo [label]; correct the "
                "row (a height that is not known makes no control point)."
            )
        x, y, z, u, v = numbers
        label, more = cells[6] if len(cells) > 6 else "", {cell.lower() for cell in cells[7:]}
        check = True if more & {"check", "checkpoint"} else None
        rows.append(ControlRow(number, label, (x, y, z), cells[5], (u, v), (np.nan,) * 3, _says_check(label, check)))
    return crs, rows


def _of_csv(path: Path) -> tuple[pyproj.CRS | None, list[ControlRow]]:
    table = read_table(path, comments=True)
    deviations = ("sd_e", "sd_n", "sd_u")
    has = columns(table, "point", "photo", "u", "v", "kind", *_PLACE, "altitude", "epsg", *deviations)
    require(path, table, has, (("easting", "lon"), ("northing", "lat"), "altitude", "photo", "u", "v"))
    geographic = {"lon", "lat"} <= set(has)
    place = (*(("lon", "lat") if geographic else ("easting", "northing")), "altitude")
    xyz = np.column_stack([numbers(path, table, has[key].name, required=True) for key in place])
    pixels = np.column_stack([numbers(path, table, has[key].name, required=True) for key in "uv"])
    sd = np.full((len(table), 3), np.nan)
    for k, key in enumerate(deviations):
        if key in has:
            values = numbers(path, table, has[key].name)
            refuse_bounds(path, values, f"standard deviation {has[key].name}", key)
            sd[:, k] = values
    bare = table[has["photo"].name].isna()
    if bare.any():
        raise InputError(f"{path}, {line_of(bare)}: has no photo; complete or delete the row.")
    rows = []
    for k, line in enumerate(table.index):
        cell = {key: table[column.name].iloc[k] or "" for key, column in has.items()}
        check = _kind(path, line, cell.get("kind", ""))
        label, (x, y, z), (u, v), (e, n, up) = (
            cell.get("point", ""),
            xyz[k].tolist(),
            pixels[k].tolist(),
            sd[k].tolist(),
        )
        rows.append(ControlRow(line, label, (x, y, z), cell["photo"], (u, v), (e, n, up), _says_check(label, check)))
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


def _kind(path: Path, number: int, text: str) -> bool | None:
    if not text:
        return None
    if text.lower() not in _KINDS:
        raise InputError(f"{path}, line {number}: kind {text!r}, expected control or check.")
    return _KINDS[text.lower()]


def _says_check(label: str, said: bool | None) -> bool | None:
    return True if said is None and _CHECK_LABEL.search(label) else said
