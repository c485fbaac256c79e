"""Geotags against what the photos themselves say: another flight's, a path that jumps, heights that cannot be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyproj

from ..core.crs import horizontal
from ..core.errors import CRSError, GeotagError
from ..core.frames import transform
from ..core.map_scale import zone_hint
from ..core.progress import Reporter
from ..core.shown import shorten
from .gpstime import describe_utc
from .stations import Stations
from .trajectory import FLOAT_FLOOR_M, SINGLE_FLOOR_M

#: Geotags whose median distance to the photos' own GPS is larger belong to other photos, metres.
MAX_MEDIAN_DISTANCE_M = 15.0
#: A photo this far from its own positions, across or in height, is not fixed, and further away has no geotag, metres.
DISTRUST_M, MAX_DISTANCE_M = 20.0, 40.0
#: Where the path jumps by more than this, the photo's own position is the better one, metres.
OWN_BETTER_M = 5.0
#: Positions lie elsewhere than the drone's own receiver says from so many standard errors of what that is usually off.
ELSEWHERE_SD = 3.5
#: Sea level lies at most this far from the ellipsoid, metres (India -107, New Guinea +86).
MAX_GEOID_M = 110.0


def check_agreement(
    stations: Stations, own: Stations, marked: np.ndarray, off_m: np.ndarray, source: Path, reporter: Reporter
) -> Stations:
    """Stations that contradict physics or the photos lose ``fix``, get a wider standard deviation and a note.

    Across, the photo's EXIF / XMP decides (the drone's MRK where it has none). In height every witness has to
    contradict: MRK, EXIF / XMP and the barometer's relative altitude; those two may have another zero and are compared
    within a flight.

    Args:
        own: the same photos as their EXIF / XMP says. marked: (N, 3) as the drone's MRK says, project metres, NaN
            unknown. off_m: (N,) metres by which the antenna's path jumps there, 0 = it does not.

    Raises:
        GeotagError: most positions are far from the photos' own.
    """
    exif, mark = (np.linalg.norm((stations.xyz - other)[:, :2], axis=1) for other in (own.xyz, marked))
    across = np.nan_to_num(np.where(np.isfinite(exif), exif, mark))
    off_m = _believed_side(stations, own, marked, off_m)
    known = np.isfinite(exif) & (off_m == 0)
    if known.any() and np.median(exif[known]) > MAX_MEDIAN_DISTANCE_M:
        hint = zone_hint(
            " (in {zone}, they would fit)",
            stations.crs,
            stations.xyz[known, :2],
            lambda xy: bool(np.median(np.hypot(*(xy - own.xyz[known, :2]).T)) <= MAX_MEDIAN_DISTANCE_M),
        )
        raise GeotagError(
            f"{source}: its positions are {np.median(exif[known]):.0f} m (median) from the GPS positions in the "
            f"photos, expected a few metres; these geotags belong to other photos or another CRS{hint}, or were "
            "solved with a wrong place of the base station."
        )
    witnesses = [
        np.abs(stations.xyz[:, 2] - marked[:, 2]),
        _within_flight(stations.xyz[:, 2] - own.xyz[:, 2], stations, off_m),
        _within_flight(stations.xyz[:, 2] - stations.relative_altitude_m, stations, off_m),
    ]
    # The nearest counts, where there is one.
    height = np.nan_to_num(np.fmin.reduce(witnesses))
    if stations.is_placed.any():
        _note_elsewhere(stations, own, marked, off_m == 0, source, reporter)
    notes = list(stations.notes or [""] * len(stations))
    found = replace(stations, xyz=stations.xyz.copy(), sd=stations.sd.copy(), quality=[*stations.quality], notes=notes)
    away, jumped = np.fmax(across, height), off_m > 0
    lost = (np.fmax(away, off_m) > MAX_DISTANCE_M) & ~(jumped & own.is_placed)
    _replace_jumped(found, own, off_m, np.flatnonzero(jumped & ~lost), source, reporter)
    precise = np.array([quality in ("fix", "float") for quality in found.quality], bool)
    far = (away > DISTRUST_M) & ~lost & ~jumped & precise
    if lost.any():
        reporter.warn(
            f"{lost.sum()} photos are more than {MAX_DISTANCE_M:.0f} m from their own GPS position or height, or from "
            f"the rest of the path, and lose their geotag: {shorten([*np.array(found.names)[lost]])}."
        )
        found.xyz[lost], found.sd[lost] = np.nan, np.nan
    if far.any():
        reporter.warn(
            f"{far.sum()} photos are {away[far].min():.0f} to {away[far].max():.0f} m from their own GPS "
            f"position or height and are not fixed any more: {shorten([*np.array(found.names)[far]])}."
        )
        found.sd[far] = np.maximum(found.sd[far], away[far, None])
    for i in np.flatnonzero(lost | far):
        found.quality[i] = "none" if lost[i] else "single"
        found.notes[i] = f"geotag {max(away[i], off_m[i]):.0f} m from the photo's own position"
    return found


def _believed_side(stations: Stations, own: Stations, marked: np.ndarray, off_m: np.ndarray) -> np.ndarray:
    """(N,) jumps; the path believes its longer part, unless MRK or EXIF lie with the shorter one."""
    jumped = off_m > OWN_BETTER_M
    from_mark = np.linalg.norm(stations.xyz - marked, axis=1)
    from_exif = np.linalg.norm((stations.xyz - own.xyz)[:, :2], axis=1)
    away = np.where(np.isfinite(from_mark), from_mark, from_exif)
    known = np.isfinite(away)
    if not (jumped & known).any() or not (~jumped & known).any():
        return off_m
    size = float(np.median(off_m[jumped]))
    right = away < 0.4 * off_m
    if np.mean(right[jumped & known]) < 0.8 or np.median(away[~jumped & known]) < 0.6 * size:
        return off_m
    return np.where(jumped, np.where(right, 0.0, off_m), np.where(stations.is_placed, size, 0.0))


def _within_flight(difference: np.ndarray, stations: Stations, off_m: np.ndarray) -> np.ndarray:
    """(N,) distance of a height difference to what is usual in its flight; NaN with fewer than five photos."""
    away = np.full(len(difference), np.nan)
    for flight in np.unique(stations.flight):
        member = (stations.flight == flight) & np.isfinite(difference)
        sure = member & (off_m == 0)
        if sure.sum() >= 5:
            away[member] = np.abs(difference[member] - np.median(difference[sure]))
    return away


def _replace_jumped(
    found: Stations, own: Stations, off_m: np.ndarray, rows: np.ndarray, source: Path, reporter: Reporter
) -> None:
    """Photos taken where the path had jumped: their own GPS where that is better, else the path with its jump."""
    if not len(rows):
        return
    sure = found.is_placed & own.is_placed & (off_m == 0)
    shift = np.median((found.xyz - own.xyz)[sure], axis=0) if sure.sum() >= 5 else np.zeros(3)
    swapped = [i for i in rows if off_m[i] > OWN_BETTER_M and own.is_placed[i]]
    for i in rows:
        found.notes[i] = f"antenna path jumps by {off_m[i]:.1f} m"
        found.sd[i] = np.maximum(np.maximum(found.sd[i], FLOAT_FLOOR_M), off_m[i])
        if found.quality[i] != "none":
            found.quality[i] = "float" if off_m[i] < SINGLE_FLOOR_M[0] else "single"
    for i in swapped:
        found.xyz[i], found.sd[i], found.quality[i] = own.xyz[i] + shift, own.sd[i], own.quality[i]
        found.notes[i] += ", own GPS used"
    times = found.utc[rows]
    span = f"from {describe_utc(float(np.nanmin(times)))} to {describe_utc(float(np.nanmax(times)))}"
    reporter.warn(
        f"{source}: the antenna's path jumps by up to {off_m[rows].max():.1f} m, faster than a drone can fly "
        f"({span}): {len(rows)} photos there are not fixed any more"
        + (f", {len(swapped)} of them take their own GPS position" if swapped else "")
        + f" ({shorten([found.names[i] for i in rows])}); the other part of the path is believed: process the "
        "PPK again."
    )


def _note_elsewhere(
    stations: Stations, own: Stations, marked: np.ndarray, sure: np.ndarray, source: Path, reporter: Reporter
) -> None:
    """Whole flights in another place or height: nothing in them looks odd, and no diameter changes, but every position
    does. What a receiver without corrections is off has a part that all photos share: no mean is better than that."""
    by_mark = bool(np.isfinite(marked[sure]).any())
    other, whose = (marked, "the drone's MRK") if by_mark else (own.xyz, "the photos' EXIF")
    away = np.where(sure[:, None], stations.xyz - other, np.nan)
    geoid, found, limit = np.nan if by_mark else _geoid_m(stations), np.zeros(len(stations), bool), np.zeros(3)
    for flight in np.unique(stations.flight):
        rows = (stations.flight == flight) & np.isfinite(away).all(axis=1)
        if not rows.any():
            continue
        shift = np.median(away[rows], axis=0)
        spread = SINGLE_FLOOR_M if by_mark else np.maximum(np.median(own.sd[rows], axis=0), SINGLE_FLOOR_M)
        spread = np.hypot(spread * np.sqrt(1 + 1 / rows.sum()), np.median(stations.sd[rows], axis=0))
        across, up, bound = np.hypot(*(shift / spread)[:2]), abs(shift[2]), ELSEWHERE_SD * spread
        if not by_mark:
            # EXIF does not say above what its heights are.
            up = np.nanmin(np.abs(shift[2] - np.array([0.0, geoid, -geoid])))
            bound[2] = 1.5 * DISTRUST_M if np.isfinite(geoid) else MAX_GEOID_M
        if across > ELSEWHERE_SD or up > bound[2]:
            found, limit = found | rows, bound
    if found.any():
        east, north, up = np.median(away[found], axis=0)
        reporter.warn(
            f"{source}: the positions of {found.sum()} of {len(stations)} photos are {east:+.0f} m east, "
            f"{north:+.0f} m north and {up:+.0f} m up (median) from those of {whose}, expected within {limit[0]:.0f} m "
            f"across and {limit[2]:.0f} m in height; the base station's place may be wrong, or its height above sea "
            "level: correct it and solve again, else every tree is off by that, and no height can be compared with a "
            "terrain model."
        )


def _geoid_m(stations: Stations) -> float:
    """Sea level above the ellipsoid at the flight (EGM96); NaN where PROJ's grid is not installed."""
    try:
        to_degrees = pyproj.Transformer.from_crs(horizontal(stations.crs), "EPSG:4326", always_xy=True)
        points = np.array([[*to_degrees.transform(*np.nanmedian(stations.xyz[:, :2], axis=0)), 0.0]])
        return -float(transform(pyproj.CRS("EPSG:4979"), pyproj.CRS("EPSG:4326+5773"), points, "geotags")[0, 2])
    except (CRSError, pyproj.exceptions.ProjError):
        return float("nan")
