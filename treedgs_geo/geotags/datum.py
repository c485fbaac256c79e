"""In which reference frame geotags are: what the user says, what the solution's header says, what that would cost."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pyproj

from ..core.crs import horizontal, lonlat_to_project
from ..core.errors import CRSError
from ..core.frames import frame_named, same_datum
from ..core.progress import Reporter
from .gpstime import gps_to_utc
from .mrk import read_mrk
from .ppk import read_rinex_header
from .rtklib import Trajectory, read_pos
from .sources import GeotagFiles
from .tables import read_position_table

_WGS84 = pyproj.CRS("EPSG:4326")


def geotags_frame(text: str | None) -> pyproj.CRS | None:
    """The geographic CRS that the user says the geotags are in.

    Raises:
        CRSError: unknown, or not geographic.
    """
    if not text:
        return None
    try:
        found = pyproj.CRS.from_user_input(text)
    except pyproj.exceptions.CRSError:
        raise CRSError(
            f"--geotags-crs: {text!r} is not a coordinate reference system; give one like EPSG:6319."
        ) from None
    if not found.is_geographic or found.is_compound:
        raise CRSError(
            f"--geotags-crs: {found.name} is not geographic, expected longitude, latitude and ellipsoidal "
            "height, for example EPSG:6319 (NAD83(2011)) or EPSG:7912 (ITRF2014)."
        )
    return found.to_3d()


def place_of(files: GeotagFiles) -> tuple[tuple[float, float] | None, pyproj.CRS | None]:
    """Longitude and latitude at which the geotags lie, degrees, and the frame that a solution's header names; ``None``
    where they do not say it."""
    frame, places = None, np.zeros((0, 2))
    for path in (files.pos or files.events)[:1]:
        track = read_pos(path)
        frame, places = frame_named(track.datum), np.column_stack([track.lon_deg, track.lat_deg])
    for path in files.mrk if not len(places) else []:
        marks = read_mrk(path)
        places = np.vstack([places, np.column_stack([marks.lon_deg, marks.lat_deg])[marks.is_placed]])
    for path in files.tables:
        with suppress(CRSError):
            places = read_position_table(path, _WGS84).xyz[:, :2]
    for path in files.rinex if not len(places) else []:
        header = read_rinex_header(path)
        if header is not None and np.isfinite(header.approx_ecef).all() and header.approx_ecef.any():
            places = np.array([pyproj.Transformer.from_crs(4978, 4326, always_xy=True).transform(*header.approx_ecef)])
            places = places[:, :2]
    if not len(places):
        return None, frame
    lon, lat = (float(value) for value in np.nanmedian(places, axis=0))
    # Project coordinates of a table say no place.
    return ((lon, lat) if abs(lon) <= 180 and abs(lat) <= 90 else None), frame


def check_frame(track: Trajectory, crs: pyproj.CRS, source: pyproj.CRS | None, reporter: Reporter) -> None:
    """The solution's own word about its frame against the project's datum.

    Raises:
        CRSError: the header names a frame other than the one the positions would be read in.
    """
    named = frame_named(track.datum)
    assumed = source or crs.geodetic_crs
    if assumed is None:
        return
    if named is not None and not same_datum(named, assumed):
        raise CRSError(
            f"{track.path}: its header names {named.name} ({track.datum!r}), the positions would be read in "
            f"{assumed.name}; give --geotags-crs {named.to_string()} (they are then transformed), or another project "
            "CRS."
        )
    if named is None and source is None:
        shift = _shift_from_itrf(track, crs)
        name = f"EPSG:{assumed.to_epsg()}" if assumed.to_epsg() else repr(assumed.name)
        if shift > 0.05:
            reporter.warn(
                f"{track.path.name}: its header says {track.datum or 'nothing'!r}, which names no frame; the positions "
                f"are taken to be in the project's ({assumed.name}), as when the base station's coordinates were. If "
                f"they were in ITRF (a PPP base), every photo is {shift:.1f} m off: give --geotags-crs EPSG:7912 then, "
                f"else --geotags-crs {name} to say so."
            )


def _shift_from_itrf(track: Trajectory, crs: pyproj.CRS) -> float:
    """How far ITRF2014 coordinates are off when they are read on the project's datum, metres; 0 when unknown."""
    lon, lat, height = (np.array([np.median(v)]) for v in (track.lon_deg, track.lat_deg, track.height_m))
    flat = horizontal(crs)
    try:
        there = lonlat_to_project(flat, lon, lat, height, pyproj.CRS("EPSG:7912"), decimal_year(track.gps_s))
    except CRSError:
        return 0.0
    return float(np.linalg.norm((there - lonlat_to_project(flat, lon, lat, height))[0]))


def decimal_year(gps_s: np.ndarray) -> float:
    """Decimal year."""
    return 1970 + float(gps_to_utc(np.median(gps_s))) / (365.25 * 86400)
