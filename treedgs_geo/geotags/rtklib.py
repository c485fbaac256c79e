"""RTKLIB / Emlid ``.pos`` solutions: the antenna's trajectory.

Supported: latitude/longitude/height in decimal degrees or degrees-minutes-seconds, ECEF x/y/z, and baselines e/n/u
whose base position stands in the header; GPST, UTC or JST; dates or GPS week + seconds; blanks, commas, semicolons or
tabs between columns. Geodetic heights (RTKLIB's own coarse geoid) are refused.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyproj

from ..core.errors import GeotagError
from ..core.tables import numbered_lines
from .gpstime import GPS_EPOCH_UNIX, parse_datetime_unix, utc_to_gps, week_tow_to_gps

FIX, FLOAT = 1, 2
#: Positions of one epoch this near are the same, metres.
SAME_PLACE_M = 0.05
#: Columns of the velocity, E, N, U.
_VELOCITY = ("ve(m/s)", "vn(m/s)", "vu(m/s)")


@dataclass(frozen=True)
class Trajectory:
    """Antenna positions, T epochs in order of time.

    gps_s: (T,) GPS seconds. lon_deg, lat_deg, height_m: (T,), ellipsoidal. quality: (T,) int RTKLIB Q (1 fix, 2 float,
    3 sbas, 4 dgps, 5 single, 6 ppp). sd: (T, 3) E, N, U metres. datum: what the header says about the reference frame.
    velocity_enu: (T, 3) true east, north, up, m/s (columns vn, ve, vu); (0, 3) in a file without them. notes: what is
    odd about the file.
    """

    path: Path
    gps_s: np.ndarray
    lon_deg: np.ndarray
    lat_deg: np.ndarray
    height_m: np.ndarray
    quality: np.ndarray
    sd: np.ndarray
    datum: str = ""
    velocity_enu: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    notes: tuple[str, ...] = ()


def read_pos(path: Path) -> Trajectory:
    """Read a ``.pos`` file.

    Raises:
        GeotagError: no header line, an unsupported column layout (naming the header line), a broken row, times that
            run backwards, fewer than two epochs.
    """
    path = Path(path)
    header, header_number, datum = "", 0, ""
    base: np.ndarray | None = None
    rows: list[list[float]] = []
    body = numbered_lines(path, "give RTKLIB's solution file", GeotagError)
    for place, (number, line) in enumerate(body):
        if line.lstrip().startswith("%"):
            if re.match(r"\s*%\s*(GPST|UTC|JST)\b", line):
                header, header_number = line, number
            found = re.search(r"height=([^,/]+)/|ref frame\s*:\s*(.+)", line)
            datum = (found[1] or found[2]).strip() if found else datum
            if re.search(r"height=[^,/]+/geodetic", line):
                raise GeotagError(
                    f"{path}, line {number}: the heights are 'geodetic' (above RTKLIB's own coarse geoid), expected "
                    "ellipsoidal ones; write the solution again with the height output set to ellipsoidal."
                )
            if re.match(r"\s*%\s*ref pos\b", line):
                base = _base_ecef(line.partition(":")[2])
            continue
        if not header:
            raise GeotagError(
                f"{path}, line {number}: numbers without a column header line ('%  GPST latitude(deg) ...'); "
                "write the solution again with RTKLIB's output headers on."
            )
        try:
            rows.append(_parse_row(line, header, base))
        except _Unsupported as problem:
            raise GeotagError(
                f"{path}, line {header_number}: columns {' '.join(header.split())[:90]!r} {problem}; write the "
                "solution as latitude/longitude/height in decimal degrees."
            ) from None
        except (ValueError, IndexError):
            if place == len(body) - 1 and rows:
                continue  # cut short while writing
            raise GeotagError(
                f"{path}, line {number}: {line.strip()[:60]!r} does not fit the columns of line "
                f"{header_number}; write the solution again."
            ) from None
    if len(rows) < 2:
        raise GeotagError(
            f"{path}: holds {len(rows)} epochs, expected the solution of a whole flight; run the PPK again."
        )
    table = np.array(rows)
    if re.match(r"\s*%\s*JST\b", header):
        table[:, 0] -= 9 * 3600.0  # Japan standard time is UTC + 9 h
    table, notes = _in_order(path, table)
    gps_s, lon_deg, lat_deg, height_m, quality = table[:, :5].T
    velocity = table[:, 8:11] if np.isfinite(table[:, 8:11]).all() else np.zeros((0, 3))
    sd = table[:, 5:8]
    return Trajectory(path, gps_s, lon_deg, lat_deg, height_m, quality.astype(int), sd, datum, velocity, notes)


def _in_order(path: Path, table: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Rows by time, one each: of doubled epochs the better Q stays, and is float where the others lie elsewhere."""
    notes = []
    if backwards := int((np.diff(table[:, 0]) < -1e-4).sum()):
        notes.append(f"{path.name}: its times run backwards in {backwards} places; its epochs were put in order.")
    table = table[np.lexsort((table[:, 4], table[:, 0]))]
    first = np.concatenate([[True], np.diff(table[:, 0]) > 1e-4])
    kept, group = table[first], np.cumsum(first) - 1
    metres = 111200.0 * np.array([np.cos(np.radians(np.median(table[:, 2]))), 1.0, 1 / 111200.0])
    most = np.zeros(len(kept))
    np.maximum.at(most, group, np.linalg.norm((table - kept[group])[:, 1:4] * metres, axis=1))
    other = most > SAME_PLACE_M
    if other.any():
        notes.append(
            f"{path.name}: {int(other.sum())} of its epochs are there twice, up to {most.max():.2f} m apart, expected "
            "one solution; they are not fixed any more: give the file of one processing."
        )
        kept[other, 4] = np.maximum(kept[other, 4], FLOAT)
        kept[other, 5:8] = np.fmax(kept[other, 5:8], most[other, None])
    return kept, tuple(notes)


def _velocity(values: list[float], header: str) -> list[float]:
    """East, north, up (m/s) where the header has these columns; ``values`` begin with Q."""
    columns = header.replace("%", " ").split()
    if not all(name in columns for name in ("q", *_VELOCITY)):
        return [np.nan] * 3
    places = [columns.index(name) - columns.index("q") for name in _VELOCITY]
    return [values[place] if place < len(values) else np.nan for place in places]


class _Unsupported(Exception):
    pass


def _parse_row(line: str, header: str, base: np.ndarray | None) -> list[float]:
    """gps_s, lon, lat, h, Q, sd E, N, U, velocity E, N, U. base: (3,) ECEF of the reference station, for baselines."""
    parts = re.split(r"[\s,;]+", line.strip())
    if "/" in parts[0] or "-" in parts[0][1:]:
        unix = parse_datetime_unix(f"{parts[0]} {parts[1]}")
        if not np.isfinite(unix):
            raise ValueError
        gps = float(unix - GPS_EPOCH_UNIX) if "GPST" in header else float(utc_to_gps(unix))
    else:
        gps = float(week_tow_to_gps(float(parts[0]), float(parts[1])))
    rest = [float(part) for part in parts[2:]]
    lower = header.lower()
    sd = [np.nan] * 3
    if "x-ecef" in lower:
        lon, lat, height = FROM_ECEF.transform(rest[0], rest[1], rest[2])
        values = rest[3:]
        if len(values) >= 5:
            sd = _sd_enu(values[2:8], _enu_axes(lon, lat))
    elif "baseline" in lower:
        if base is None:
            raise _Unsupported("are a baseline, and no 'ref pos' line gives the base station's position")
        lon0, lat0, _ = FROM_ECEF.transform(*base)
        lon, lat, height = FROM_ECEF.transform(*(base + np.array(rest[:3]) @ _enu_axes(lon0, lat0)))
        values = rest[3:]
        sd = values[2:5] if len(values) >= 5 else sd
    elif "latitude(d" in lower:
        sexagesimal = "latitude(d'" in lower
        lat, lon, height = (_dms(parts[2:5]), _dms(parts[5:8]), rest[6]) if sexagesimal else rest[:3]
        values = rest[7:] if sexagesimal else rest[3:]
        sd = [values[3], values[2], values[4]] if len(values) >= 5 else sd
    else:
        raise _Unsupported("are not known")
    quality = values[0]
    if abs(lat) > 90 or abs(lon) > 180 or abs(height) > 2e4 or quality != int(quality) or not 0 <= quality <= 9:
        raise ValueError
    if not np.isfinite([gps, lat, lon, height]).all():
        raise ValueError
    return [gps, lon, lat, height, quality, *sd, *_velocity(values, lower)]


def _enu_axes(lon_deg: float, lat_deg: float) -> np.ndarray:
    """(3, 3): east, north and up as ECEF unit vectors, one a row."""
    lon, lat = np.radians(lon_deg), np.radians(lat_deg)
    east = [-np.sin(lon), np.cos(lon), 0.0]
    north = [-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)]
    return np.array([east, north, [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]])


def _sd_enu(columns: list[float], axes: np.ndarray) -> list[float]:
    """sdx, sdy, sdz (and sdxy, sdyz, sdzx: signed roots of the covariances) in ECEF -> E, N, U standard deviations."""
    x, y, z, xy, yz, zx = [*columns[:3], *(columns[3:6] if len(columns) >= 6 else [0.0] * 3)]
    root = [xy * abs(xy), yz * abs(yz), zx * abs(zx)]
    covariance = np.array([[x * x, root[0], root[2]], [root[0], y * y, root[1]], [root[2], root[1], z * z]])
    return np.sqrt(np.maximum(np.diag(axes @ covariance @ axes.T), 0.0)).tolist()


def _base_ecef(text: str) -> np.ndarray | None:
    """The header's reference position: decimal degrees and height, or ECEF metres; ``None`` when it is neither."""
    numbers = [float(part) for part in re.findall(r"[-+]?\d+\.\d+", text)]
    if len(numbers) != 3:
        return None
    if abs(numbers[0]) <= 90 and abs(numbers[1]) <= 180:
        return np.array(_TO_ECEF.transform(numbers[1], numbers[0], numbers[2]))
    return np.array(numbers) if 6.2e6 < float(np.linalg.norm(numbers)) < 6.5e6 else None


FROM_ECEF = pyproj.Transformer.from_crs("EPSG:4978", "EPSG:4979", always_xy=True)
_TO_ECEF = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)


def _dms(parts: list[str]) -> float:
    degrees, minutes, seconds = (float(part) for part in parts)
    if not (0 <= minutes < 60 and 0 <= seconds <= 60):
        raise ValueError
    return (-1 if parts[0].startswith("-") else 1) * (abs(degrees) + minutes / 60 + seconds / 3600)
