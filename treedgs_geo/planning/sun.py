"""When the sun stands well: the hours of a day with light on the stems and short shadows."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass

import numpy as np

#: Lower suns leave stems in deep shadow and let shadows move fast, degrees above the horizon.
LOWEST_SUN_DEG = 25.0


@dataclass(frozen=True)
class SunDay:
    """utc: (N,) times every 5 min; azimuth_deg: clockwise from grid north; elevation_deg. windows: begin and end,
    UTC."""

    utc: list[dt.datetime]
    azimuth_deg: np.ndarray
    elevation_deg: np.ndarray
    windows: list[tuple[dt.datetime, dt.datetime]]

    @property
    def noon(self) -> int:
        """Index of the highest sun."""
        return int(np.argmax(self.elevation_deg))


def sun_direction(utc: dt.datetime, lon_deg: float, lat_deg: float, convergence_deg: float) -> np.ndarray:
    """(3,) unit vector towards the sun in grid axes (x east, y north, z up).

    Low-precision solar position of the Astronomical Almanac (about 0.02 degrees).
    """
    days = (utc - dt.datetime(2000, 1, 1, 12)).total_seconds() / 86400
    anomaly = np.radians((357.528 + 0.9856003 * days) % 360)
    mean_lon = (280.460 + 0.9856474 * days) % 360
    ecliptic = np.radians(mean_lon + 1.915 * np.sin(anomaly) + 0.020 * np.sin(2 * anomaly))
    tilt = np.radians(23.439 - 4e-7 * days)
    ascension = np.arctan2(np.cos(tilt) * np.sin(ecliptic), np.cos(ecliptic))
    declination = np.arcsin(np.sin(tilt) * np.sin(ecliptic))
    sidereal = np.radians((280.46062 + 360.98564737 * days + lon_deg) % 360)
    hour, lat = sidereal - ascension, np.radians(lat_deg)
    up = np.sin(lat) * np.sin(declination) + np.cos(lat) * np.cos(declination) * np.cos(hour)
    north = np.cos(lat) * np.sin(declination) - np.sin(lat) * np.cos(declination) * np.cos(hour)
    east = -np.cos(declination) * np.sin(hour)
    azimuth = np.arctan2(east, north) - np.radians(convergence_deg)
    flat = np.hypot(east, north)
    return np.array([flat * np.sin(azimuth), flat * np.cos(azimuth), up])


def sun_day(day: dt.date, lon_deg: float, lat_deg: float, convergence_deg: float = 0.0) -> SunDay:
    """The sun over a local solar day (UTC from its midnight at this longitude)."""
    begin = dt.datetime.combine(day, dt.time()) - dt.timedelta(hours=lon_deg / 15)
    begin = begin.replace(second=0, microsecond=0)
    utc = [begin + dt.timedelta(minutes=5 * k) for k in range(289)]
    ways = np.array([sun_direction(moment, lon_deg, lat_deg, convergence_deg) for moment in utc])
    elevation = np.degrees(np.arcsin(np.clip(ways[:, 2], -1, 1)))
    azimuth = np.degrees(np.arctan2(ways[:, 0], ways[:, 1])) % 360
    up = np.concatenate([[False], elevation >= LOWEST_SUN_DEG, [False]])
    edges = np.flatnonzero(np.diff(up.astype(int)))
    windows = [(utc[a], utc[b - 1]) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return SunDay(utc, azimuth, elevation, windows)
