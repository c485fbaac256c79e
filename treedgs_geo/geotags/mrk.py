"""DJI (and Autel) Timestamp.MRK: one line an exposure.

Fields are found by their suffix (``17,N``, ``35.93,Lat`` ...): firmwares disagree about order, decimals and columns.
Meaning (DJI P4R white paper): offset = antenna phase centre -> camera, millimetres, N and E positive north and east,
V positive DOWN; Lat, Lon, Ellh = the camera; standard deviations N, E, U metres; Q 0 none, 16 single, 32-49 float,
50-52 fixed.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from ..core.errors import GeotagError
from ..core.tables import numbered_lines
from .gpstime import WEEK_S, week_tow_to_gps

_NUMBER = r"([-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)"
_TAGGED = {key: re.compile(rf"{_NUMBER}\s*,\s*{key}\b") for key in ("N", "E", "V", "Lat", "Lon", "Ellh", "Q")}
_START = re.compile(rf"\s*(\d+)[\s,]+{_NUMBER}(?:[\s,]+\[(\d+)\])?")
_SD = re.compile(rf"Ellh[\s,]+{_NUMBER}\s*,\s*{_NUMBER}\s*,\s*{_NUMBER}(?!\s*,\s*Q)")


@dataclass(frozen=True)
class Marks:
    """Exposures of one MRK file, M of them, in file order.

    index: (M,) int. gps_s: (M,) GPS seconds. offset_enu: (M, 3) metres antenna -> camera, E, N, U (U up). lon_deg,
    lat_deg, height_m: (M,) camera. sd: (M, 3) E, N, U metres, NaN if the file has none. flag: (M,) int Q, -1 unknown.
    """

    path: Path
    index: np.ndarray
    gps_s: np.ndarray
    offset_enu: np.ndarray
    lon_deg: np.ndarray
    lat_deg: np.ndarray
    height_m: np.ndarray
    sd: np.ndarray
    flag: np.ndarray
    notes: tuple[str, ...] = ()

    @property
    def is_placed(self) -> np.ndarray:
        """(M,) bool: has a position."""
        return (self.flag != 0) & (self.lat_deg != 0)


def read_mrk(path: Path) -> Marks:
    """Read a MRK file. A last line cut short by a power-off is dropped with a note.

    Raises:
        GeotagError: no readable line, a broken line in the middle, a position or time that cannot be, doubled numbers.
    """
    path = Path(path)
    filled = numbered_lines(path, "give the drone's Timestamp.MRK", GeotagError)
    rows, notes = [], []
    for place, (number, line) in enumerate(filled):
        try:
            rows.append(_parse_line(line))
        except ValueError as problem:
            if place == len(filled) - 1 and rows:
                notes.append(f"{path.name}, line {number}: the last line is incomplete ({problem}) and was left out.")
                continue
            raise GeotagError(
                f"{path}, line {number}: {problem}; expected a DJI MRK line such as '1 267313.99 [2164] 17,N -10,E "
                "193,V 35.93,Lat 139.97,Lon 84.7,Ellh ... 50,Q'; copy the file again."
            ) from None
    if not rows:
        raise GeotagError(f"{path}: holds no exposure, expected one line a photo; copy the file again from the drone.")
    table = pd.DataFrame(rows)
    index = table["index"].to_numpy(int)
    if len(np.unique(index)) < len(index):
        doubled = index[np.flatnonzero(np.diff(np.sort(index)) == 0)[0]]
        raise GeotagError(f"{path}: exposure number {doubled} appears twice; give the unedited file of one flight.")
    if table["week"].isna().any():
        raise GeotagError(
            f"{path}: has no [GPS week] column, so the date of its times is unknown; give the MRK as the drone wrote "
            "it."
        )
    gps = week_tow_to_gps(table["week"], table["tow"])
    if (np.diff(gps) < -WEEK_S / 2).any():
        # The receiver wrote the old week number past midnight on Saturday.
        gps = gps + WEEK_S * np.concatenate([[0], np.cumsum(np.diff(gps) < -WEEK_S / 2)])
    offset, sd = table[["E", "N", "V"]].to_numpy() * [1, 1, -1] / 1000, table[["sd_e", "sd_n", "sd_u"]].to_numpy()
    lon, lat, height = (table[name].to_numpy() for name in ("Lon", "Lat", "Ellh"))
    return Marks(path, index, gps, offset, lon, lat, height, sd, table["Q"].fillna(-1).to_numpy(int), tuple(notes))


def _parse_line(line: str) -> dict[str, float]:
    """index, tow, week, sd_n, sd_e, sd_u and what is tagged; absent optional values are NaN."""
    start = _START.match(line)
    if not start:
        raise ValueError("found no exposure number and GPS time")
    tow = float(start[2])
    if not 0 <= tow < WEEK_S:
        raise ValueError(f"found GPS seconds of week {tow:g}")
    found = {key: pattern.search(line) for key, pattern in _TAGGED.items()}
    values = {key: float(match[1] if match else "nan") for key, match in found.items()}
    for key in ("N", "E", "V", "Lat", "Lon", "Ellh"):
        if np.isnan(values[key]):
            raise ValueError(f"found no {key} value")
    if abs(values["Lat"]) > 90 or abs(values["Lon"]) > 180 or abs(values["Ellh"]) > 2e4:
        raise ValueError(f"found the impossible position {values['Lat']:g}, {values['Lon']:g}, {values['Ellh']:g}")
    if max(abs(values[key]) for key in "NEV") > 20000:
        raise ValueError("found an antenna offset above 20 m")
    sd = _SD.search(line)
    deviations = [float(part) for part in sd.groups()] if sd else [np.nan] * 3
    values |= dict(zip(("sd_n", "sd_e", "sd_u"), deviations, strict=True))
    return values | {"index": float(start[1]), "tow": tow, "week": float(start[3] or "nan")}
