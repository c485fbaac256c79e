"""Where the inputs lie, read cheaply, so that a refused CRS comes with the UTM zone to use instead."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable
from pathlib import Path

from qgis.core import QgsExifTools

_MRK = re.compile(r"(-?\d+\.\d+),Lat\s+(-?\d+\.\d+),Lon")
_PHOTOS = {".jpg", ".jpeg", ".tif", ".tiff", ".dng"}


def utm_suggestion(paths: Iterable[str]) -> str:
    """``EPSG:32615 (WGS 84 / UTM zone 15N)`` from the first input that has a position, else ''."""
    for path in map(Path, paths):
        where = position(path)
        if where:
            lon, lat = where
            zone = int((lon + 180) // 6) % 60 + 1
            return f"EPSG:{(32600 if lat >= 0 else 32700) + zone} (WGS 84 / UTM zone {zone}{'N' if lat >= 0 else 'S'})"
    return ""


def position(path: Path) -> tuple[float, float] | None:
    """Longitude and latitude in degrees of a photo folder, a photo, an MRK file or a LAS file in degrees."""
    if path.is_dir():
        files = sorted(entry for entry in path.iterdir() if entry.is_file())
        photos = [entry for entry in files if entry.suffix.lower() in _PHOTOS][:3]
        marks = [entry for entry in files if entry.suffix.lower() == ".mrk"][:1]
        for entry in photos + marks:
            found = position(entry)
            if found:
                return found
        return None
    suffix = path.suffix.lower()
    if suffix in _PHOTOS:
        point, ok = QgsExifTools.getGeoTag(str(path))
        return (point.x(), point.y()) if ok and (point.x() or point.y()) else None
    if suffix == ".mrk":
        lines = _MRK.findall(path.read_text(encoding="utf-8", errors="replace")[:4000])
        # Before the receiver knows its place it writes zeros.
        return next(((float(lon), float(lat)) for lat, lon in lines if float(lat)), None)
    if suffix in (".las", ".laz"):
        return _las_degrees(path)
    return None


def _las_degrees(path: Path) -> tuple[float, float] | None:
    """Middle of a LAS header's extent, when it can only be degrees."""
    with open(path, "rb") as stream:
        header = stream.read(227)
    if len(header) < 227 or header[:4] != b"LASF":
        return None
    x_max, x_min, y_max, y_min = struct.unpack_from("<4d", header, 179)
    if -180 <= x_min <= x_max <= 180 and -90 <= y_min <= y_max <= 90 and x_max - x_min < 1 and y_max - y_min < 1:
        return (x_min + x_max) / 2, (y_min + y_max) / 2
    return None


def las_extent(path: Path) -> tuple[float, float, float, float, str] | None:
    """West, south, east, north and the WKT of the CRS ('' = none, or in the older GeoTIFF keys) of a LAS/LAZ header."""
    if path.suffix.lower() not in (".las", ".laz"):
        return None
    with open(path, "rb") as stream:
        header = stream.read(375)
        if len(header) < 227 or header[:4] != b"LASF":
            return None
        header_size, _, count = struct.unpack_from("<HII", header, 94)
        x_max, x_min, y_max, y_min = struct.unpack_from("<4d", header, 179)
        stream.seek(header_size)
        wkt = ""
        for _ in range(min(count, 100)):
            head = stream.read(54)
            if len(head) < 54:
                break
            record, length = struct.unpack_from("<HH", head, 18)
            body = stream.read(length)
            if record == 2112 and head[2:18].startswith(b"LASF_Projection"):
                wkt = body.split(b"\0")[0].decode("utf-8", "replace")
    return x_min, y_min, x_max, y_max, wkt
