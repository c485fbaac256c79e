"""Reference frames: the project CRS outside, a local metric frame inside.

Inside, coordinates are metres from a local origin (whole metres, so that nothing is lost): float32 is safe there.
Outside, full projected coordinates with their CRS. Heights keep the datum they came in; see ``docs/frames.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyproj

from .errors import CRSError


def project_crs(text: str) -> pyproj.CRS:
    """The user's project CRS, checked: projected, axes in metres.

    Raises:
        CRSError: unknown, geographic (the UTM zone to use is suggested when a position is known, see
            :func:`suggest_utm`) or not in metres.
    """
    try:
        crs = pyproj.CRS.from_user_input(text)
    except pyproj.exceptions.CRSError:
        raise CRSError(f"--crs: {text!r} is not a coordinate reference system; give one like EPSG:32615.") from None
    return check_projected(crs, "--crs")


def check_projected(crs: pyproj.CRS, where: str, lon_lat: tuple[float, float] | None = None) -> pyproj.CRS:
    """Refuse a CRS that distances cannot be measured in."""
    if crs.is_geographic or crs.is_geocentric:
        zone = suggest_utm(*lon_lat) if lon_lat else None
        hint = (
            f"use the UTM zone of your plot, EPSG:{zone.to_epsg()} ({zone.name})"
            if zone
            else ("use the UTM zone of your plot (for example EPSG:32615 for 93 W, north)")
        )
        raise CRSError(f"{where}: {crs.name} is geographic (degrees), expected a projected CRS in metres; {hint}.")
    units = {axis.unit_name for axis in crs.axis_info[:2]}
    if units - {"metre", "meter"}:
        raise CRSError(
            f"{where}: {crs.name} is in {', '.join(sorted(units))}, expected metres; "
            "choose the metric version of this CRS or the UTM zone."
        )
    return crs


def suggest_utm(lon_deg: float, lat_deg: float) -> pyproj.CRS:
    """WGS 84 / UTM zone of a position."""
    zone = int((lon_deg + 180) // 6) % 60 + 1
    return pyproj.CRS.from_epsg((32600 if lat_deg >= 0 else 32700) + zone)


@dataclass(frozen=True)
class LocalFrame:
    """A local metric frame: ``local = project - origin``.

    crs: the project CRS (projected, metres). origin: (3,) float64, whole metres in the project CRS.
    """

    crs: pyproj.CRS
    origin: np.ndarray

    @classmethod
    def around(cls, crs: pyproj.CRS, points: np.ndarray) -> LocalFrame:
        """Frame with its origin near the mean of ``points`` (N, 3), rounded to whole metres."""
        centre = np.nanmean(np.asarray(points, float).reshape(-1, 3), axis=0)
        return cls(crs, np.asarray(np.round(centre), float))

    def to_local(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) project coordinates -> (N, 3) local, float64."""
        return np.asarray(points, float) - self.origin

    def to_project(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) local coordinates -> (N, 3) project, float64."""
        return np.asarray(points, float) + self.origin

    def save(self, path: Path) -> None:
        """Write as JSON (WKT and origin)."""
        from .files import write_json

        write_json(path, {"crs_wkt": self.crs.to_wkt(), "crs": self.crs.to_string(), "origin": self.origin.tolist()})

    @classmethod
    def load(cls, path: Path) -> LocalFrame:
        """Read what :meth:`save` wrote."""
        from .files import read_json

        record = read_json(path)
        return cls(pyproj.CRS.from_wkt(record["crs_wkt"]), np.asarray(record["origin"], float))


def lonlat_to_project(crs: pyproj.CRS, lon_deg: np.ndarray, lat_deg: np.ndarray, h_m: np.ndarray) -> np.ndarray:
    """Geodetic coordinates on the project CRS's own datum -> (N, 3) project; heights pass through unchanged."""
    if crs.geodetic_crs is None:
        raise CRSError(
            f"--crs: {crs.name} is not tied to a datum, expected a projected CRS; choose the UTM zone of the plot."
        )
    transformer = pyproj.Transformer.from_crs(crs.geodetic_crs.to_2d(), crs, always_xy=True)
    east, north = transformer.transform(np.asarray(lon_deg, float), np.asarray(lat_deg, float))
    return np.column_stack([east, north, np.asarray(h_m, float)])


def grid_convergence_deg(crs: pyproj.CRS, lon_deg: float, lat_deg: float) -> float:
    """Meridian convergence: grid azimuth = true azimuth - convergence."""
    return pyproj.Proj(crs).get_factors(lon_deg, lat_deg).meridian_convergence
