"""Reference frames: the project CRS outside, a local metric frame inside.

Inside, coordinates are ground metres from a local origin (whole metres, so that nothing is lost): float32 is safe
there. Outside, full projected coordinates with their CRS. Heights keep the datum they came in
(``docs/technician/frames.md``).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyproj

from .errors import CRSError, InputError
from .files import read_json, write_json
from .frames import horizontal, moved, same_datum, satellite_frame, transform, vertical_of, zone_named
from .map_scale import ground_scale


def project_crs(crs: str | pyproj.CRS, lon_lat: tuple[float, float] | None = None) -> pyproj.CRS:
    """The user's project CRS, checked: projected, axes in metres.

    Raises:
        CRSError: unknown, geographic (the UTM zone to use is suggested when a position is known) or not in metres.
    """
    try:
        found = pyproj.CRS.from_user_input(crs)
    except pyproj.exceptions.CRSError:
        hint = _zone(lon_lat) or "EPSG:CODE"
        raise CRSError(f"--crs: {crs!r} is not a coordinate reference system; give one like {hint}.") from None
    return check_projected(found, "--crs", lon_lat)


def check_projected(crs: pyproj.CRS, where: str, lon_lat: tuple[float, float] | None = None) -> pyproj.CRS:
    """Refuse a CRS that distances cannot be measured in."""
    if crs.is_geographic or crs.is_geocentric:
        hint = ", ".join(filter(None, ("use the UTM zone of your plot", _zone(lon_lat))))
        raise CRSError(f"{where}: {crs.name} is geographic (degrees), expected a projected CRS in metres; {hint}.")
    vertical = vertical_of(crs)
    heights = [*crs.axis_info[2:], *(vertical.axis_info if vertical else [])]
    for axes, what, remedy in (
        (crs.axis_info[:2], f"{crs.name} is", "this CRS or the UTM zone"),
        (heights, f"the heights of {crs.name} are", "this vertical datum"),
    ):
        units = {axis.unit_name for axis in axes}
        if units - {"metre", "meter"}:
            raise CRSError(
                f"{where}: {what} in {', '.join(sorted(units))}, expected metres; choose the metric version of "
                f"{remedy}."
            )
    return crs


def _zone(lon_lat: tuple[float, float] | None) -> str:
    """The UTM zone of a place; '' where none is known, or it cannot be one."""
    if lon_lat is None or not (abs(lon_lat[0]) <= 180 and abs(lon_lat[1]) <= 90):
        return ""
    return zone_named(*lon_lat)


@dataclass(frozen=True)
class LocalFrame:
    """A local metric frame: ``local = (project - origin) / (scale, scale, 1)``.

    crs: the project CRS (projected, metres). origin: (3,) float64, whole metres in the project CRS. scale: map metres
    for one metre on the ground: what is measured in the frame is ground, upwards as across.
    """

    crs: pyproj.CRS
    origin: np.ndarray
    scale: float = 1.0

    @classmethod
    def around(cls, crs: pyproj.CRS, points: np.ndarray) -> LocalFrame:
        """Frame with its origin near the mean of ``points`` (N, 3), rounded to whole metres, and the scale there.

        Raises:
            CRSError: the map stretches too much to be measured in, see :func:`.map_scale.ground_scale`.
        """
        centre = np.nanmean(np.asarray(points, float).reshape(-1, 3), axis=0)
        return cls(crs, np.asarray(np.round(centre), float), ground_scale(crs, *centre))

    def to_local(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) project coordinates -> (N, 3) local, float64."""
        return (np.asarray(points, float) - self.origin) / (self.scale, self.scale, 1.0)

    def to_project(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) local coordinates -> (N, 3) project, float64."""
        return np.asarray(points, float) * (self.scale, self.scale, 1.0) + self.origin

    def save(self, path: Path) -> None:
        """Write as JSON (WKT, origin and scale)."""
        named = {"crs_wkt": self.crs.to_wkt(), "crs": self.crs.to_string()}
        write_json(path, named | {"origin": self.origin.tolist(), "scale": self.scale})

    @classmethod
    def load(cls, path: Path) -> LocalFrame:
        """Read what :meth:`save` wrote.

        Raises:
            InputError: missing, or without a CRS and an origin.
        """
        record = read_json(path)
        try:
            crs, origin = pyproj.CRS.from_wkt(record["crs_wkt"]), np.asarray(record["origin"], float)
            scale = float(record.get("scale", 1.0))
            if origin.shape != (3,) or not np.isfinite([*origin, scale]).all() or scale <= 0:
                raise ValueError("origin and scale are not four numbers")
        except (AttributeError, KeyError, TypeError, ValueError, pyproj.exceptions.CRSError) as problem:
            raise InputError(
                f"{path}: does not say where the reconstruction lies ({problem}), expected crs_wkt and origin; run "
                "'treedgs reconstruct' again."
            ) from None
        return cls(crs, origin, scale)


def lonlat_to_project(
    crs: pyproj.CRS,
    lon_deg: np.ndarray,
    lat_deg: np.ndarray,
    h_m: np.ndarray,
    source: pyproj.CRS | None = None,
    year: float | None = None,
) -> np.ndarray:
    """Longitude, latitude and ellipsoidal height -> (N, 3) project coordinates.

    source: geographic CRS of the positions (default: the project CRS's own datum, or WGS 84, see
    :func:`.frames.satellite_frame`). year: decimal year of the positions, for frames that drift apart. In a project CRS
    without heights the ellipsoidal heights stay ellipsoidal; one with a vertical datum (``EPSG:6344+5703``) gets its
    heights through the geoid grid.

    Raises:
        CRSError: no datum; no transformation of survey quality; the geoid's grid is not installed.
    """
    if crs.geodetic_crs is None:
        raise CRSError(
            f"--crs: {crs.name} is not tied to a datum, expected a projected CRS; choose the UTM zone of the plot."
        )
    points = np.column_stack([np.asarray(part, float) for part in (lon_deg, lat_deg, h_m)])
    receiver = satellite_frame(crs)
    source = source or receiver
    if crs.is_compound or source is not None and not same_datum(source, crs):
        there = transform(source or crs.geodetic_crs.to_3d(), crs, points, "--crs", year)
        if receiver is not None and not crs.is_compound:
            there[:, 2] = points[:, 2]  # a datum surveyed on the ground has no heights above its ellipsoid
        return there
    return np.column_stack([moved(points[:, :2], crs.geodetic_crs.to_2d(), crs.to_2d()), points[:, 2]])


def grid_convergence_deg(crs: pyproj.CRS, lon_deg: float, lat_deg: float) -> float:
    """Meridian convergence: grid azimuth = true azimuth - convergence."""
    return pyproj.Proj(horizontal(crs)).get_factors(lon_deg, lat_deg).meridian_convergence
