"""The CRS of a cloud: what its file says, what the user says, and whether the two agree."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyproj

from ..core.crs import check_projected, project_crs
from ..core.errors import CRSError
from ..core.frames import horizontal
from ..core.map_scale import LOCAL_REACH_M, check_place, is_local
from ..core.progress import Reporter

#: What ``--crs`` takes for a cloud in local metres without a place on the map (a terrestrial scan).
LOCAL = "local"
#: What layers made from such a cloud are written in.
LOCAL_CRS = pyproj.CRS.from_wkt('LOCAL_CS["local metres",UNIT["metre",1]]')

#: GeoTIFF keys for the unit of x and y, the unit of heights and the vertical CRS, and codes of units that are not
#: metres (EPSG). laspy reads none of them.
_XY_UNIT, _Z_UNIT, _Z_CRS = 3076, 4099, 4096
_UNITS = {9002: "feet", 9003: "US survey feet", 9005: "Clarke's feet", 1025: "millimetres", 1033: "centimetres"}


def file_crs(header: Any, path: Path, given: str | None = None) -> pyproj.CRS | None:
    """The CRS that a LAS header names, ``None`` without one; not looked at where the user says ``local``.

    Raises:
        CRSError: there is a record, but it cannot be read, or it says that lengths are in another unit than metres.
    """
    if given and given.lower() == LOCAL:
        return None
    try:
        crs = header.parse_crs()
        keys = _geo_keys(header)
    except Exception as problem:
        raise CRSError(f"{path}: its CRS record is unreadable ({short(problem)}); export the cloud again.") from None
    units = {key: _UNITS.get(keys.get(key, 0), "") for key in (_Z_UNIT, _XY_UNIT)}
    with suppress(pyproj.exceptions.CRSError):
        units[_Z_CRS] = odd_height_unit(pyproj.CRS.from_epsg(keys.get(_Z_CRS, 0)))
    for key, unit in units.items():
        if unit:
            what = "x and y" if key == _XY_UNIT else "heights"
            raise CRSError(
                f"{path}: {what} are in {unit} (GeoTIFF key {key}), expected metres; convert the cloud to metres."
            )
    return crs


def _geo_keys(header: Any) -> dict[int, int]:
    """The plain GeoTIFF keys of a header; none where a WKT record stands beside them, which is what counts."""
    from laspy.vlrs.known import GeoKeyDirectoryVlr, WktCoordinateSystemVlr

    records = list(header.vlrs) + list(header.evlrs or [])
    if any(isinstance(record, WktCoordinateSystemVlr) and record.parse_crs() is not None for record in records):
        return {}
    return {
        key.id: key.value_offset
        for record in records
        if isinstance(record, GeoKeyDirectoryVlr)
        for key in record.geo_keys
        if key.tiff_tag_location == 0
    }


def odd_height_unit(crs: pyproj.CRS) -> str:
    """The unit of the heights of a vertical or compound CRS where it is not metres, else empty."""
    parts = [part for part in crs.sub_crs_list or [crs] if part.is_vertical and part.axis_info]
    unit = parts[0].axis_info[0].unit_name if parts else "metre"
    return "" if unit in ("metre", "meter") else unit


def agreed_crs(
    own: pyproj.CRS | None, given: str | None, path: Path, need_crs: bool, middle: tuple[float, float] | None = None
) -> pyproj.CRS | None:
    """The CRS to work in, from the file's and the user's word; ``local`` wins over any header. middle: of the points,
    where it is known: with it advice is given for a file in degrees.

    Raises:
        CRSError: neither names a CRS, or they contradict each other.
    """
    if given and given.lower() == LOCAL:
        return None
    if own is not None and not own.is_geographic and not own.is_projected and given:
        own = None  # an engineering CRS says nothing about the place: the user's word fills it in
    if own is not None:
        base = horizontal(own)
        check_projected(base, str(path), middle)
        if unit := odd_height_unit(own):
            raise CRSError(f"{path}: heights are in {unit}, expected metres; convert the cloud to metres.")
        if given and not same_place(base, project_crs(given)):
            raise CRSError(f"{path}: is in {base.name}, but --crs says {given}; leave --crs out or reproject it.")
        return own
    if need_crs and not given:
        raise _no_crs(path)
    return project_crs(given) if given else None


def _no_crs(path: Path) -> CRSError:
    return CRSError(
        f"{path}: holds no CRS, expected a projected one in metres; give it with --crs EPSG:CODE "
        f"(or --crs {LOCAL} for a scan in local metres)."
    )


def placed(
    crs: pyproj.CRS | None,
    xyz: np.ndarray,
    path: Path,
    reporter: Reporter,
    given: str | None = None,
    dtm: Path | None = None,
    need_crs: bool = True,
) -> pyproj.CRS | None:
    """The CRS that (N, 3) points of a file are really in: a header's is set aside, with a warning, where they are
    plainly local metres; a file without one is in that of its terrain model ``dtm``, or, where they are plainly local,
    in local metres. given: what the user says. need_crs: refuse other points whose CRS nobody knows.

    Raises:
        CRSError: nobody knows it; see :func:`treedgs_geo.core.map_scale.check_place`.
    """
    x, y = np.median(xyz[:: max(len(xyz) // 100_000, 1), :2], axis=0) if len(xyz) else (0.0, 0.0)
    if given is None and crs is not None and is_local(crs, xyz):
        reporter.warn(
            f"{path}: its header says {horizontal(crs).name}, but its coordinates (x {x:.6g}, y {y:.6g}) are local "
            f"metres: the header's CRS is set aside; give --crs {LOCAL} to say so, or export the cloud with its place "
            "on the map."
        )
        return None
    if given is None and crs is None and dtm is not None:
        crs = _dtm_crs(dtm)
        if crs is None or is_local(crs, xyz):
            return None
        reporter.info(f"{path}: holds no CRS; that of {dtm} is taken, {crs.name}.")
    elif given is None and crs is None and need_crs:
        if max(abs(x), abs(y)) > LOCAL_REACH_M:
            raise _no_crs(path)
        reporter.info(
            f"{path}: holds no CRS, and its coordinates (x {x:.6g}, y {y:.6g}) are taken as local metres; give --crs "
            "EPSG:CODE if they are a map's."
        )
    check_place(crs, xyz, str(path), reporter)
    return crs


def _dtm_crs(path: Path) -> pyproj.CRS | None:
    """The horizontal CRS that a raster names; a file that is none is refused where it is read."""
    import rasterio

    try:
        with rasterio.open(path) as source:
            found = horizontal(pyproj.CRS.from_wkt(source.crs.to_wkt())) if source.crs else None
    except (rasterio.errors.RasterioError, pyproj.exceptions.CRSError):
        return None
    return check_projected(found, str(path)) if found is not None else None


def same_place(one: pyproj.CRS, other: pyproj.CRS) -> bool:
    """True when two horizontal CRS are the same, apart from metadata and axis order."""
    first, second = horizontal(one), horizontal(other)
    if first.equals(second, ignore_axis_order=True):
        return True
    code = first.to_epsg(min_confidence=70)
    return code is not None and code == second.to_epsg(min_confidence=70)


def short(problem: BaseException) -> str:
    """What another library's exception says, on one line."""
    return (" ".join(str(problem).split()) or type(problem).__name__)[:120]
