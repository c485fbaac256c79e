"""GPS time and UTC. Inside, times are GPS seconds since 1980-01-06 (float64, 0.1 microsecond)."""

from __future__ import annotations

import calendar
from datetime import datetime, timezone

import numpy as np

#: Unix seconds of the GPS epoch, 1980-01-06 00:00:00 UTC.
GPS_EPOCH_UNIX = 315964800
WEEK_S = 604800
#: UTC dates from which GPS - UTC grew by one second (IERS Bulletin C).
_LEAP_DATES = (
    (1981, 7), (1982, 7), (1983, 7), (1985, 7), (1988, 1), (1990, 1), (1991, 1), (1992, 7), (1993, 7), (1994, 7),
    (1996, 1), (1997, 7), (1999, 1), (2006, 1), (2009, 1), (2012, 7), (2015, 7), (2017, 1),
)  # fmt: skip
_LEAP_UNIX = np.array([calendar.timegm((year, month, 1, 0, 0, 0)) for year, month in _LEAP_DATES], float)


def utc_to_gps(unix_s: np.ndarray | float) -> np.ndarray:
    """Unix (UTC) seconds -> GPS seconds."""
    unix = np.asarray(unix_s, float)
    return unix - GPS_EPOCH_UNIX + np.searchsorted(_LEAP_UNIX, unix, side="right")


def gps_to_utc(gps_s: np.ndarray | float) -> np.ndarray:
    """GPS seconds -> Unix (UTC) seconds."""
    gps = np.asarray(gps_s, float)
    steps = _LEAP_UNIX - GPS_EPOCH_UNIX + np.arange(1, len(_LEAP_UNIX) + 1)
    return gps + GPS_EPOCH_UNIX - np.searchsorted(steps, gps, side="right")


def week_tow_to_gps(week: np.ndarray | float, tow_s: np.ndarray | float) -> np.ndarray:
    """GPS week and seconds of week -> GPS seconds; 10-bit weeks (roll-over) are lifted to 2016 or later."""
    week = np.asarray(week, float)
    lifted = np.where(week < 1024, week + 1024 * np.ceil((1877 - week) / 1024), week)
    return lifted * WEEK_S + np.asarray(tow_s, float)


def describe_utc(unix_s: float) -> str:
    """``2026-03-12 15:15:02 UTC`` for messages."""
    return datetime.fromtimestamp(float(unix_s), tz=timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC")


def parse_datetime_unix(text: str) -> float:
    """``2026:03:12 10:15:02[.25]``, ``2026/03/12 ...`` or ISO 8601 without zone -> seconds as if it were UTC; NaN if
    not a date."""
    cleaned = text.strip().rstrip("Z").replace("T", " ").replace("/", ":").replace("-", ":")
    try:
        date, _, clock = cleaned.partition(" ")
        year, month, day = (int(part) for part in date.split(":"))
        hour, minute, second = clock.strip().split(":")
        whole = calendar.timegm(datetime(year, month, day, int(hour), int(minute)).timetuple())
        return whole + float(second)
    except ValueError:
        return float("nan")
