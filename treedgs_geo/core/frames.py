"""Between reference frames and height datums: by a transformation that is as good as a survey, or not at all."""

from __future__ import annotations

import os
import re
import warnings
from functools import lru_cache
from typing import Any

import numpy as np
import pyproj
from pyproj.aoi import AreaOfInterest
from pyproj.database import query_crs_info
from pyproj.enums import PJType
from pyproj.transformer import TransformerGroup

from .errors import CRSError

#: A transformation worse than this (metres, as PROJ's database says) is no survey.
WORST_M = 1.0
#: Datums of satellite positions agree to this, metres.
_SATELLITE_M = 5.0
#: Frame names as files write them -> 3-D geographic CRS.
_NAMED = (
    ("NAD83(2011)", "EPSG:6319"), ("NAD83 (2011)", "EPSG:6319"), ("NAD83(CSRS)", "EPSG:4955"),
    ("ITRF2020", "EPSG:9989"), ("ITRF2014", "EPSG:7912"), ("ITRF2008", "EPSG:7911"), ("IGS20", "EPSG:9989"),
    ("IGS14", "EPSG:7912"), ("ETRS89", "EPSG:4937"), ("ETRF2000", "EPSG:7931"), ("GDA2020", "EPSG:7843"),
    ("GDA94", "EPSG:4939"), ("NZGD2000", "EPSG:4959"), ("SIRGAS 2000", "EPSG:4988"), ("JGD2011", "EPSG:6667"),
)  # fmt: skip


def frame_named(text: str) -> pyproj.CRS | None:
    """The reference frame that a file's header names, as a 3-D geographic CRS; ``None`` for WGS84 (a label that every
    program writes, whatever frame the base station was in) and for what is not known."""
    flat = text.upper().replace(" ", "")
    return next((pyproj.CRS(code) for name, code in _NAMED if name.upper().replace(" ", "") in flat), None)


def horizontal(crs: pyproj.CRS) -> pyproj.CRS:
    """The horizontal part of a compound CRS, or the CRS itself."""
    return crs.sub_crs_list[0] if crs.is_compound else crs


def suggest_utm(lon_deg: float, lat_deg: float) -> pyproj.CRS:
    """WGS 84 / UTM zone of a position."""
    return pyproj.CRS.from_epsg((32600 if lat_deg >= 0 else 32700) + _zone_number(lon_deg))


def zone_named(lon_deg: float, lat_deg: float) -> str:
    """``EPSG:32632 (WGS 84 / UTM zone 32N)``: the UTM zone of a position, for a sentence."""
    zone = suggest_utm(lon_deg, lat_deg)
    return f"EPSG:{zone.to_epsg()} ({zone.name})"


def _zone_number(lon_deg: float) -> int:
    return int((lon_deg + 180) // 6) % 60 + 1


#: Grids that forest inventories use: how the names of a country's areas in PROJ's database begin -> the CRS's name.
_USUAL = {
    "United States (USA) - Hawaii": r"NAD83\(PA11\) / UTM zone \d+N",
    "United States (USA)": r"NAD83\(2011\) / UTM zone \d+N",
    "Canada": r"NAD83\(CSRS\) / UTM zone \d+N",
    "Mexico": r"Mexico ITRF2008 / UTM zone \d+N",
    "Australia": r"GDA2020 / MGA zone \d+",
    "New Zealand": "NZGD2000 / New Zealand Transverse Mercator 2000",
    "United Kingdom (UK) - Northern Ireland": "IRENET95 / Irish Transverse Mercator",
    "United Kingdom (UK)": "OSGB36 / British National Grid",
    "Ireland": "IRENET95 / Irish Transverse Mercator",
    "Netherlands": "Amersfoort / RD New",
    "Liechtenstein; Switzerland": r"CH1903\+ / LV95",
    "Sweden": "SWEREF99 TM",
    "Finland": r"ETRS89 / TM35FIN\(E,N\)",
    "Estonia": "Estonian Coordinate System of 1997",
    "Latvia": "LKS-92 / Latvia TM",
    "Lithuania": "LKS94 / Lithuania TM",
    "Poland": "ETRF2000-PL / CS92",
}
#: The same where no country is named: UTM, on the first of these datums that has a zone there.
_UTM = {
    "Europe": r"ETRS89 / UTM zone \d+N",
    "Latin America": r"SIRGAS 2000 / UTM zone \d+[NS]",
    "UTM zone": r"WGS 84 / UTM zone \d+[NS]",
}
#: Names of areas that no country has for itself, and of the UTM zones of the USA, whose boxes reach far into Canada.
_SHARED = re.compile(r"[^-\d]*(, | and )|North America|United States \(USA\) - between")


_DIGITS = re.compile(r"\d+")


def usual_crs(lon_deg: float, lat_deg: float, frame: pyproj.CRS | None = None) -> tuple[pyproj.CRS, str]:
    """The CRS that is usual at a place, and why it is this one, in words: the country's, else UTM (in the frame of
    the positions, else in the region's datum); of these the first into which positions can be turned as well
    as a survey.

    PROJ's database knows boxes only: the country is that of the smallest one that holds the place.

    frame: geographic CRS of the positions (default: :func:`satellite_frame` of each).

    Raises:
        CRSError: none can be used (near the poles, or no way from ``frame``).
    """
    place = AreaOfInterest(lon_deg, lat_deg, lon_deg, lat_deg)
    found = query_crs_info("EPSG", PJType.PROJECTED_CRS, place, contains=True)
    areas = [info.area_of_use for info in found if info.area_of_use and not _SHARED.match(info.area_of_use.name or "")]
    areas.sort(key=lambda box: ((box.east - box.west) % 360 or 360) * (box.north - box.south))
    smallest = areas[0].name or "" if areas else ""
    country = next((key for key in _USUAL if smallest.startswith(key)), None)
    usual = {country: _USUAL[country]} if country else {}
    if frame is not None:
        usual["frame of the positions"] = rf"{re.escape(frame.name)} / (UTM|MGA) zone \d+[NS]?"
    refused = ""
    for where, pattern in {**usual, **_UTM}.items():
        codes = {info.name: int(info.code) for info in found if re.fullmatch(pattern, info.name)}
        if not codes:
            continue
        # At the rim of two zones both hold the place: the one of its longitude.
        zone = _zone_number(lon_deg)
        crs = pyproj.CRS.from_epsg(
            codes[min(codes, key=lambda name: abs(int((_DIGITS.findall(name) or [0])[-1]) - zone))]
        )
        source = frame or satellite_frame(crs)
        try:
            if source is not None and not same_datum(source, crs):
                transform(source, crs, np.array([[lon_deg, lat_deg, 0.0]]), "positions")
        except CRSError as problem:
            refused += f"; not EPSG:{crs.to_epsg()}, {crs.name}, as {str(problem).partition(': ')[2].rstrip('.')}"
            continue
        border = "; near a border it may be the neighbour's" if where == country else ""
        return crs, f"usual where the photos lie ({re.sub(r' [(][A-Z]+[)]', '', where)}{border}{refused})"
    raise CRSError(
        f"--crs: none is known for longitude {lon_deg:.3f}, latitude {lat_deg:.3f}{refused}; give one, projected and "
        "in metres."
    )


@lru_cache(maxsize=64)
def satellite_frame(crs: pyproj.CRS) -> pyproj.CRS | None:
    """The frame that positions by satellite are in, where it cannot be the CRS's own datum: WGS 84 for a datum that was
    surveyed on the ground (the British, Dutch or Swiss grid), which lies about 100 m away; else ``None``."""
    geodetic, area = horizontal(crs).geodetic_crs, crs.area_of_use
    if geodetic is None or area is None:
        return None
    lon, lat = area.west + ((area.east - area.west) % 360) / 2, (area.south + area.north) / 2
    moved = pyproj.Transformer.from_crs("EPSG:4326", geodetic.to_2d(), always_xy=True).transform(lon, lat)
    away_m = 111e3 * np.hypot((moved[0] - lon) * np.cos(np.radians(lat)), moved[1] - lat)
    return pyproj.CRS("EPSG:4979") if _SATELLITE_M < away_m < np.inf else None


def vertical_of(crs: pyproj.CRS | None) -> pyproj.CRS | None:
    """The vertical CRS of a compound CRS, or ``None``."""
    parts = crs.sub_crs_list if crs is not None and crs.is_compound else []
    return next((part for part in parts if part.is_vertical), None)


def heights_named(crs: pyproj.CRS | None) -> str:
    """What the heights of coordinates in ``crs`` refer to, in words; empty when the CRS does not say."""
    part = vertical_of(crs)
    if part is not None:
        return part.name
    if crs is not None and len(crs.axis_info) == 3:
        return "ellipsoid"
    return ""


def same_datum(one: pyproj.CRS, other: pyproj.CRS) -> bool:
    """True when both are tied to the same geodetic datum."""
    first, second = one.geodetic_crs, other.geodetic_crs
    if first is None or second is None or first.datum is None or second.datum is None:
        return False
    return bool(first.datum == second.datum or first.datum.name == second.datum.name)


def transform(
    source: pyproj.CRS, target: pyproj.CRS, points: np.ndarray, where: str, year: float | None = None
) -> np.ndarray:
    """(N, 3) coordinates (x or longitude, y or latitude, height) of ``source`` in ``target``, float64.

    A CRS without heights counts as ellipsoidal. year: decimal year of the coordinates, for frames that drift apart.

    Raises:
        CRSError: PROJ knows no transformation of survey quality, or its grid (a geoid) is not installed.
    """
    points = np.asarray(points, float).reshape(-1, 3)
    known = np.isfinite(points).all(axis=1)
    out = np.full_like(points, np.nan)
    if not known.any():
        return out
    source, target = _with_heights(source), _with_heights(target)
    if source.geodetic_crs is None or target.geodetic_crs is None:
        raise CRSError(
            f"{where}: {source.name} or {target.name} is not tied to a datum; choose the UTM zone of the plot."
        )
    datum = target.geodetic_crs.datum
    to_wgs84 = datum is not None and datum.name.startswith("World Geodetic System 1984")
    of_itrf = source.is_geographic and not source.is_compound and source.name.upper().startswith(("ITRF", "IGS"))
    if to_wgs84 and of_itrf:
        # Since 2001 WGS 84 follows the ITRF within two centimetres; PROJ's database has no link between them.
        source = pyproj.CRS("EPSG:4979")
    flat = pyproj.Transformer.from_crs(horizontal(source).to_2d(), "EPSG:4326", always_xy=True)
    lon, lat = flat.transform(*np.median(points[known, :2], axis=0))
    operation: Any = _operation(source.to_wkt(), target.to_wkt(), round(float(lon), 1), round(float(lat), 1), where)
    time = np.full(int(known.sum()), np.inf if year is None else float(year))
    moved = operation.transform(*points[known].T, time)
    if not np.isfinite(moved[:3]).all():
        raise CRSError(
            f"{where}: lies outside the area in which {source.name} can be turned into {target.name}; check both CRS."
        )
    out[known] = np.column_stack(moved[:3])
    return out


def moved(xy: np.ndarray, source: pyproj.CRS | None, target: pyproj.CRS | None) -> np.ndarray:
    """(N, 2) x and y (longitude and latitude) of ``source`` in ``target``; as they are where one of them is not known,
    or both are the same."""
    if source is None or target is None or source == target:
        return xy
    return np.column_stack(pyproj.Transformer.from_crs(source, target, always_xy=True).transform(*np.asarray(xy).T))


def own_degrees(crs: pyproj.CRS | None, x: float, y: float) -> tuple[float, float] | None:
    """Longitude and latitude of a place on the datum of ``crs``; ``None`` where none is tied to the earth."""
    datum = None if crs is None else crs.geodetic_crs
    return None if datum is None else tuple(moved(np.array([[x, y]]), crs, datum.to_2d())[0].tolist())


def _with_heights(crs: pyproj.CRS) -> pyproj.CRS:
    return crs if crs.is_compound or len(crs.axis_info) == 3 else crs.to_3d()


@lru_cache(maxsize=64)
def _operation(source: str, target: str, lon: float, lat: float, where: str) -> pyproj.Transformer:
    use_system_grids()
    one, other = pyproj.CRS(source), pyproj.CRS(target)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a missing grid is said below
        area: Any = AreaOfInterest(lon - 0.1, max(lat - 0.1, -90.0), lon + 0.1, min(lat + 0.1, 90.0))
        group = TransformerGroup(one, other, always_xy=True, area_of_interest=area)
    names = f"{_say(one)} to {_say(other)}"
    missing = [
        grid.short_name for operation in group.unavailable_operations for grid in operation.grids if not grid.available
    ]
    if group.transformers:
        best = group.transformers[0]
        # PROJ 9.8 (Python 3.12 and newer) gives a mere projection no accuracy, where older ones say 0.
        exact = best.accuracy < 0 and same_datum(one, other) and heights_named(one) == heights_named(other)
        if (exact or 0 <= best.accuracy <= WORST_M) and "ballpark" not in best.description.lower():
            return best
        of_receivers = satellite_frame(other) is None  # else the grid is what lacks
        if best.accuracy >= 0 and "ballpark" not in best.description.lower() and (of_receivers or not missing):
            raise CRSError(
                f"{where}: {names} is known to {best.accuracy:g} m only, expected {WORST_M:g} m or better; 'WGS 84' "
                "names no realisation: give the frame of the base station (for example EPSG:7912 for ITRF2014)."
            )
    if missing:
        another = "a CRS with the heights of the data" if satellite_frame(other) is None else "a UTM zone"
        raise CRSError(
            f"{where}: {names} needs the grid {missing[0]}, which is not installed; fetch it with 'projsync --file "
            f"{missing[0]}' (or put it into {pyproj.datadir.get_user_data_dir()}), or choose {another}."
        )
    raise CRSError(f"{where}: PROJ knows no way from {names} at this place; choose a CRS on the same datum.")


def _say(crs: pyproj.CRS) -> str:
    vertical = heights_named(crs)
    return crs.name if not vertical or vertical in crs.name else f"{crs.name} ({vertical} heights)"


@lru_cache(maxsize=1)
def use_system_grids() -> None:
    """Let PROJ look for grids in the system's and the user's folders too (the wheel of pyproj brings none)."""
    for folder in ("/usr/share/proj", "/usr/local/share/proj", pyproj.datadir.get_user_data_dir()):
        if os.path.isdir(folder) and folder not in pyproj.datadir.get_data_dir().split(os.pathsep):
            pyproj.datadir.append_data_dir(folder)
