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
    zone = int((lon_deg + 180) // 6) % 60 + 1
    return pyproj.CRS.from_epsg((32600 if lat_deg >= 0 else 32700) + zone)


#: Grids that forest inventories use where they are at home, in this order; elsewhere WGS 84.
_USUAL = (
    r"NAD83\(2011\) / UTM zone \d+N",
    r"NAD83\(CSRS\) / UTM zone \d+N",
    r"GDA2020 / MGA zone \d+",
    r"ETRS89 / UTM zone \d+N",
    r"SIRGAS 2000 / UTM zone \d+[NS]",
)


def usual_crs(lon_deg: float, lat_deg: float) -> pyproj.CRS:
    """The UTM zone of a position in the datum that is usual there: of North America, Australia, Europe or South
    America, else WGS 84."""
    place = AreaOfInterest(lon_deg, lat_deg, lon_deg, lat_deg)
    found = query_crs_info("EPSG", PJType.PROJECTED_CRS, place, contains=True)
    for pattern in _USUAL:
        names = {info.name: info.code for info in found if re.fullmatch(pattern, info.name)}
        # At the rim of two zones both hold the place: the one of its longitude.
        zone = int((lon_deg + 180) // 6) % 60 + 1
        best = min(names, key=lambda name: abs(int(re.findall(r"\d+", name)[-1]) - zone), default=None)
        if best is not None:
            return pyproj.CRS.from_epsg(int(names[best]))
    return suggest_utm(lon_deg, lat_deg)


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
        if best.accuracy >= 0 and "ballpark" not in best.description.lower():
            raise CRSError(
                f"{where}: {names} is known to {best.accuracy:g} m only, expected {WORST_M:g} m or better; 'WGS 84' "
                "names no realisation: give the frame of the base station (for example EPSG:7912 for ITRF2014)."
            )
    if missing:
        raise CRSError(
            f"{where}: {names} needs the grid {missing[0]}, which is not installed; fetch it with 'projsync --file "
            f"{missing[0]}' (or put it into {pyproj.datadir.get_user_data_dir()}), or choose a CRS with the heights of "
            "the data."
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
