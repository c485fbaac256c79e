"""Files of ground control points: ODM's ``gcp_list.txt`` and CSV, one row for each point marked in a photo."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyproj

from ..core.errors import CRSError, InputError
from ..core.tables import plain_cell, refuse_other_formats
from .tables import EAST, HEIGHT, LAT, LON, NORTH, SD, crs_of_line, find_column, split_row

_LABEL = ("label", "#label", "gcp", "gcp_name", "point", "point_id", "marker", "id", "name")
_PHOTO = ("photo", "image", "image_name", "imagename", "filename", "file", "sourcefile")
_U, _V = ("u", "u_px", "px", "pixel_x", "im_x"), ("v", "v_px", "py", "pixel_y", "im_y")
_KIND = ("kind", "type", "role")
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
    try:
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as problem:
        raise InputError(f"{path}: cannot be read ({problem.strerror}); {_EXPECTED}.") from None
    filled = [(n, line.rstrip()) for n, line in enumerate(lines, 1) if line.strip()]
    columns = [cell.strip().lower() for cell in split_row(filled[0][1])] if filled else []
    try:
        if find_column(columns, _PHOTO) >= 0:
            crs, rows = _of_csv(path, columns, filled[1:])
        else:
            crs, rows = _of_gcp_list(path, [(n, line) for n, line in filled if not line.lstrip().startswith("#")])
    except csv.Error as problem:
        raise InputError(f"{path}: is not CSV ({problem}); save the table again.") from None
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
        numbers = [_number(cell) for cell in cells[:5]]
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


def _of_csv(
    path: Path, columns: list[str], filled: list[tuple[int, str]]
) -> tuple[pyproj.CRS | None, list[ControlRow]]:
    label, photo, u, v, kind = (find_column(columns, names) for names in (_LABEL, _PHOTO, _U, _V, _KIND))
    lon, lat, height = (find_column(columns, names) for names in (LON, LAT, HEIGHT))
    east, north = find_column(columns, EAST), find_column(columns, NORTH)
    geographic = lon >= 0 and lat >= 0
    place = (lon, lat, height) if geographic else (east, north, height)
    if min(*place, photo, u, v) < 0:
        raise InputError(f"{path}: found columns {', '.join(columns)}; {_EXPECTED}.")
    deviations = [find_column(columns, names) for names in SD]
    rows: list[ControlRow] = []
    codes: dict[str, int] = {}
    for number, line in filled:
        if line.lstrip().startswith("#"):
            continue
        cells = [str(plain_cell(cell)).strip() for cell in split_row(line)]
        cells += [""] * (len(columns) - len(cells))
        numbers = [_number(cells[i]) for i in (*place, u, v)]
        if not np.isfinite(numbers).all() or not cells[photo]:
            raise InputError(
                f"{path}, line {number}: found {line.strip()[:70]!r}, expected a place, a photo and pixels in the "
                "columns of line 1; correct the row."
            )
        x, y, z, px, py = numbers
        sd = tuple(_deviation(path, number, cells[i] if i >= 0 else "") for i in deviations)
        check = _kind(path, number, cells[kind]) if kind >= 0 else None
        name = cells[label] if label >= 0 else ""
        rows.append(
            ControlRow(number, name, (x, y, z), cells[photo], (px, py), (sd[0], sd[1], sd[2]), _says_check(name, check))
        )
        if "epsg" in columns:
            codes.setdefault(cells[columns.index("epsg")], number)
    return _csv_crs(path, codes, geographic), rows


def _csv_crs(path: Path, codes: dict[str, int], geographic: bool) -> pyproj.CRS | None:
    """The CRS of a table: column ``epsg`` (one for all rows), WGS 84 degrees, or the project's."""
    if len(codes) > 1:
        first, second = list(codes.values())[:2]
        raise InputError(f"{path}, lines {first} and {second}: have different epsg; write all points in one CRS.")
    code = next(iter(codes), "")
    if not code:
        return pyproj.CRS.from_epsg(4326) if geographic else None
    try:
        return pyproj.CRS.from_epsg(int(float(code)))
    except (ValueError, OverflowError, pyproj.exceptions.CRSError):
        raise CRSError(f"{path}, line {codes[code]}: epsg {code!r} is unknown; give the EPSG code.") from None


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _deviation(path: Path, number: int, text: str) -> float:
    value = _number(text) if text else float("nan")
    if text and not 0 < value <= 100:
        raise InputError(
            f"{path}, line {number}: standard deviation {text!r}, expected metres above 0 and up to 100; leave the "
            "cell empty for the usual one."
        )
    return value


def _kind(path: Path, number: int, text: str) -> bool | None:
    if not text:
        return None
    if text.lower() not in _KINDS:
        raise InputError(f"{path}, line {number}: kind {text!r}, expected control or check.")
    return _KINDS[text.lower()]


def _says_check(label: str, said: bool | None) -> bool | None:
    return True if said is None and _CHECK_LABEL.search(label) else said
