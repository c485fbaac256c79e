"""Positions by photo name: CSV tables (ours, Emlid's, Pix4D-like with a header) and ODM's ``geo.txt``."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyproj

from ..core.columns import columns, line_of, numbers, require
from ..core.crs import lonlat_to_project
from ..core.errors import CRSError, GeotagError, InputError
from ..core.frames import transform
from ..core.map_scale import check_place
from ..core.tables import numbered_lines, read_heading, read_table

#: What a table of positions may hold.
_COLUMNS = ("photo", "lat", "lon", "altitude", "easting", "northing", "sd_e", "sd_n", "sd_u")


@dataclass(frozen=True)
class NamedPositions:
    """Camera positions by file name (without folders), K of them: xyz (K, 3) project metres, sd (K, 3) E, N, U metres
    or NaN."""

    path: Path
    names: list[str]
    xyz: np.ndarray
    sd: np.ndarray


def is_position_table(path: Path) -> bool:
    """True when the file's header has a photo name and a position, or it is ODM's ``geo.txt``."""
    if path.name.lower() == "geo.txt":
        return True
    found = columns(read_heading(path), *_COLUMNS)
    return "photo" in found and ({"lat", "lon"} <= set(found) or {"easting", "northing"} <= set(found))


def read_position_table(path: Path, crs: pyproj.CRS, frame: pyproj.CRS | None = None) -> NamedPositions:
    """Read positions by photo name into the project CRS.

    Longitude and latitude are taken on ``frame`` (default: the project CRS's datum) with ellipsoidal heights, x and y
    columns as project coordinates (in ``geo.txt``: in the CRS of its first line).

    Raises:
        GeotagError: missing columns, a bad number, a doubled name. CRSError: an unknown CRS line.
    """
    path = Path(path)
    try:
        read = _read_geo_txt if path.name.lower() == "geo.txt" else _read_csv
        names, values = read(path, crs, frame)
    except CRSError:
        raise
    except InputError as problem:
        raise GeotagError(str(problem)) from None
    if doubled := [name for name, count in Counter(names).items() if count > 1]:
        raise GeotagError(f"{path}: photo {min(doubled)!r} appears twice; keep one row a photo.")
    if not names:
        raise GeotagError(f"{path}: holds no position, expected one row a photo.")
    return NamedPositions(path, names, values[:, :3], values[:, 3:])


def crs_of_line(text: str, where: str) -> pyproj.CRS:
    """The CRS that the first line of ODM's files names: ``EPSG:32616``, a PROJ string, or ``WGS84 UTM 16N``.

    Raises:
        CRSError: it is none.
    """
    utm = re.fullmatch(r"WGS84\s+UTM\s+(\d{1,2})\s*([NS])", text.strip(), re.IGNORECASE)
    if utm:
        text = f"EPSG:{(32600 if utm[2].upper() == 'N' else 32700) + int(utm[1])}"
    try:
        return pyproj.CRS.from_user_input(text.strip())
    except pyproj.exceptions.CRSError:
        raise CRSError(f"{where}: {text.strip()!r} is not a CRS; expected for example EPSG:4326.") from None


def _read_csv(path: Path, crs: pyproj.CRS, frame: pyproj.CRS | None) -> tuple[list[str], np.ndarray]:
    """Names and (K, 6) positions and standard deviations."""
    table = read_table(path, comments=True)
    has = columns(table, *_COLUMNS)
    require(path, table, has, ("photo", "altitude", ("lat", "northing"), ("lon", "easting")))
    geographic = {"lat", "lon"} <= set(has)
    place = ("lon", "lat") if geographic else ("easting", "northing")
    xyz = np.column_stack([numbers(path, table, has[key].name, required=True) for key in (*place, "altitude")])
    beyond = (np.abs(xyz[:, :2]) > [180, 90]).any(axis=1)
    if geographic and beyond.any():
        raise GeotagError(
            f"{path}, {line_of(beyond, table)}: {place} {xyz[beyond][0, :2]} are no degrees; name the columns x and y "
            "where they are project coordinates, or correct the row."
        )
    if geographic:
        xyz = lonlat_to_project(crs, xyz[:, 0], xyz[:, 1], xyz[:, 2], frame)
    unknown = np.full(len(table), np.nan)
    sd = [numbers(path, table, has[key].name) if key in has else unknown for key in ("sd_e", "sd_n", "sd_u")]
    bare = table[has["photo"].name].isna()
    if bare.any():
        raise GeotagError(f"{path}, {line_of(bare)}: has no photo; complete or delete the row.")
    return [Path(name.replace("\\", "/")).name for name in table[has["photo"].name]], np.column_stack([xyz, *sd])


def _read_geo_txt(path: Path, crs: pyproj.CRS, frame: pyproj.CRS | None) -> tuple[list[str], np.ndarray]:
    """ODM: CRS line, then ``name x y [z] [yaw pitch roll] [h_acc v_acc]``."""
    filled = [row for row in numbered_lines(path, "give ODM's geo.txt", GeotagError) if not row[1].startswith("#")]
    names: list[str] = []
    rows: list[list[float]] = []
    if not filled:
        return names, np.zeros((0, 6))
    source = crs_of_line(filled[0][1], f"{path}, line {filled[0][0]}")
    for number, line in filled[1:]:
        cells = line.split()
        try:
            x, y, z = (float(cell) for cell in cells[1:4])
            sd = [float(cells[7]), float(cells[7]), float(cells[8])] if len(cells) >= 9 else [float("nan")] * 3
        except (ValueError, IndexError):
            raise GeotagError(
                f"{path}, line {number}: found {line.strip()[:60]!r}, expected name x y z; correct the row."
            ) from None
        if source.is_geographic:
            xyz = lonlat_to_project(crs, np.array([x]), np.array([y]), np.array([z]), frame)[0]
        else:
            check_place(source, np.array([[x, y, z]]), f"{path}, line {number}", measured=False)
            xyz = transform(source, crs, np.array([[x, y, z]]), str(path))[0]
        names.append(cells[0])
        rows.append([*xyz, *sd])
    return names, np.array(rows).reshape(-1, 6)
