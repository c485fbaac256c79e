"""Positions by photo name: CSV tables (ours, Emlid's, Pix4D-like with a header) and ODM's ``geo.txt``."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyproj

from ..core.crs import lonlat_to_project
from ..core.errors import CRSError, GeotagError
from ..core.frames import transform
from ..core.map_scale import check_place

#: Names of columns, lower case: photo, longitude and latitude, height, easting and northing.
NAME = ("name", "photo", "filename", "file", "image", "image_name", "imagename", "label", "sourcefile", "#label")
LAT = ("lat", "latitude", "lat_deg", "latitude_deg", "gpslatitude")
LON = ("lon", "long", "longitude", "lon_deg", "longitude_deg", "gpslongitude")
HEIGHT = ("h", "height", "alt", "altitude", "ellh", "z", "elevation", "height_m", "ellipsoidal_height", "gpsaltitude")
EAST, NORTH = ("x", "e", "east", "easting"), ("y", "n", "north", "northing")
SD = (
    ("sd_e", "sde", "sde_m", "std_e", "sd_h_m", "acch", "h_acc"),
    ("sd_n", "sdn", "sdn_m", "std_n", "sd_h_m", "acch", "h_acc"),
    ("sd_u", "sdu", "sdu_m", "std_u", "sd_v_m", "accv", "v_acc"),
)


@dataclass(frozen=True)
class NamedPositions:
    """Camera positions by file name (without folders), K of them: xyz (K, 3) project metres, sd (K, 3) E, N, U metres
    or NaN.
    """

    path: Path
    names: list[str]
    xyz: np.ndarray
    sd: np.ndarray


def is_position_table(path: Path) -> bool:
    """True when the file's header has a photo name and a position, or it is ODM's ``geo.txt``."""
    if path.name.lower() == "geo.txt":
        return True
    try:
        with open(path, newline="", encoding="utf-8-sig", errors="replace") as stream:
            columns = {cell.strip().lower() for cell in split_row(stream.readline())}
    except (OSError, csv.Error):
        return False
    return bool(columns & set(NAME)) and bool(columns & set(LAT + NORTH)) and bool(columns & set(LON + EAST))


def read_position_table(path: Path, crs: pyproj.CRS, frame: pyproj.CRS | None = None) -> NamedPositions:
    """Read positions by photo name into the project CRS.

    Longitude and latitude are taken on ``frame`` (default: the project CRS's datum) with ellipsoidal heights, x and y
    columns as project coordinates (in ``geo.txt``: in the CRS of its first line).

    Raises:
        GeotagError: missing columns, a bad number, a doubled name. CRSError: an unknown CRS line.
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as problem:
        raise GeotagError(
            f"{path}: cannot be read ({problem.strerror}); give a table of photo names and positions."
        ) from None
    read = _read_geo_txt if path.name.lower() == "geo.txt" else _read_csv
    try:
        rows = read(path, lines, crs, frame)
    except csv.Error as problem:
        raise GeotagError(f"{path}: is not CSV ({problem}); save the table again.") from None
    names = [row[0] for row in rows]
    doubled = {name for name in names if names.count(name) > 1} if len(set(names)) < len(names) else set()
    if doubled:
        raise GeotagError(f"{path}: photo {sorted(doubled)[0]!r} appears twice; keep one row a photo.")
    if not rows:
        raise GeotagError(f"{path}: holds no position, expected one row a photo.")
    values = np.array([row[1] for row in rows], float)
    return NamedPositions(path, names, values[:, :3], values[:, 3:6])


def split_row(line: str) -> list[str]:
    """Cells of one line, whichever of ; tab , or blanks parts them."""
    for separator in (";", "\t", ","):
        if separator in line:
            return next(csv.reader([line.strip()], delimiter=separator))
    return line.split()


def find_column(columns: list[str], options: tuple[str, ...]) -> int:
    """Number of the first of ``options`` among the columns (lower case), -1 without any."""
    return next((columns.index(option) for option in options if option in columns), -1)


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


def _read_csv(path: Path, lines: list[str], crs: pyproj.CRS, frame: pyproj.CRS | None) -> list[tuple[str, list[float]]]:
    columns = [cell.strip().lower() for cell in split_row(lines[0])] if lines else []

    name, lat, lon, height = (find_column(columns, options) for options in (NAME, LAT, LON, HEIGHT))
    east, north = find_column(columns, EAST), find_column(columns, NORTH)
    geographic = lat >= 0 and lon >= 0
    if name < 0 or height < 0 or not (geographic or (east >= 0 and north >= 0)):
        raise GeotagError(
            f"{path}: found columns {', '.join(columns)}; expected name, lat, lon, h (ellipsoidal metres) "
            "or name, x, y, z in the project CRS."
        )
    sd_places = [find_column(columns, options) for options in SD]
    rows = []
    for number, line in enumerate(lines[1:], start=2):
        if not line.strip():
            continue
        cells = split_row(line)
        try:
            first, second = float(cells[lon if geographic else east]), float(cells[lat if geographic else north])
            h = float(cells[height])
            sd = [float(cells[i]) if i >= 0 and cells[i].strip() else float("nan") for i in sd_places]
            if not np.isfinite([first, second, h]).all() or geographic and (abs(first) > 180 or abs(second) > 90):
                raise ValueError
        except (ValueError, IndexError):
            raise GeotagError(
                f"{path}, line {number}: found {line.strip()[:60]!r}, expected a position in the columns of "
                "line 1; correct the row."
            ) from None
        xyz = (
            lonlat_to_project(crs, np.array([first]), np.array([second]), np.array([h]), frame)[0]
            if geographic
            else np.array([first, second, h])
        )
        rows.append((Path(cells[name].strip().replace("\\", "/")).name, [*xyz, *sd]))
    return rows


def _read_geo_txt(
    path: Path, lines: list[str], crs: pyproj.CRS, frame: pyproj.CRS | None
) -> list[tuple[str, list[float]]]:
    """ODM: CRS line, then ``name x y [z] [yaw pitch roll] [h_acc v_acc]``."""
    filled = [(number, line) for number, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    if not filled:
        return []
    source = crs_of_line(filled[0][1], f"{path}, line {filled[0][0]}")
    rows = []
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
        rows.append((cells[0], [*xyz, *sd]))
    return rows
