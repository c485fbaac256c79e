"""Exposures and photos: which marks belong to which photos, and where the camera was at each; an antenna's path whose
times are off is found by the positions that drone and photos wrote."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyproj

from ..core.crs import grid_convergence_deg, lonlat_to_project
from ..core.errors import GeotagError
from ..core.progress import Reporter
from ..core.shown import shorten
from .datum import decimal_year
from .gpstime import gps_to_utc
from .mrk import Marks
from .pairing import MAX_CLOCK_ERROR_S, Pairing, pair_photos
from .photos import Photo
from .rtklib import Trajectory, read_pos
from .trajectory import Interpolated, interpolate
from .velocity import turned_to_grid


def note_pairing(marks: Marks, pairing: Pairing, names: list[str], reporter: Reporter) -> None:
    """Say which photos have no exposure, which exposures no photo (a lost one, or an event that was none), and which
    paired photos have another clock than the others."""
    paired, name = np.flatnonzero(pairing.rows >= 0), marks.path.name
    used = pairing.rows[paired]
    if lost := [names[i] for i in np.flatnonzero(pairing.rows < 0)]:
        reporter.warn(f"{name}: no exposure for {len(lost)} of {len(names)} photos: {shorten(lost)}.")
    spare = np.setdiff1d(np.arange(len(marks.index)), used)
    if len(spare):
        numbers = shorten([str(n) for n in marks.index[spare]], 8)
        reporter.warn(f"{name}: {len(spare)} of {len(marks.index)} exposures have no photo (number {numbers}).")
    apart_s = pairing.utc[paired] - gps_to_utc(marks.gps_s[used])
    with np.errstate(invalid="ignore"):
        other = np.flatnonzero(np.abs(apart_s) > MAX_CLOCK_ERROR_S)
    if len(other):
        reporter.warn(
            f"{name}: the clock of {len(other)} of {len(paired)} photos is {np.median(apart_s[other]):+.0f} s off that "
            f"of the others, as if it had been set in flight ({shorten([names[i] for i in paired[other]])}); they were "
            "paired with their exposures by their own GPS positions: check that all photos are of this flight."
        )


def marks_of_events(path: Path, reporter: Reporter) -> Marks:
    """An ``_events.pos`` has one row an exposure: marks without a lever arm."""
    track = read_pos(path)
    reporter.warn(
        f"{path.name}: without the drone's MRK the offset from antenna to camera is unknown and taken as zero "
        "(0.1 to 0.3 m on DJI drones)."
    )
    count, place = len(track.gps_s), (track.lon_deg, track.lat_deg, track.height_m)
    index, unknown = np.arange(1, count + 1), np.full(count, -1)
    return Marks(path, index, track.gps_s, np.zeros((count, 3)), *place, track.sd, unknown)


def assign_marks(marks: list[Marks], photos: list[Photo]) -> list[tuple[Marks, list[int]]]:
    """Which photos each MRK is for: by common folder name where that decides it, else by trying which pairs best."""
    if len(marks) == 1:
        return [(marks[0], list(range(len(photos))))]
    left = list(range(len(photos)))
    assigned: list[tuple[Marks, list[int]]] = []
    refused: list[GeotagError] = []
    for each in marks:
        beside = [i for i in left if photos[i].path.parent.resolve() == each.path.parent.resolve()]
        for group in (beside, list(left), _within(each, left, photos)):
            if not group:
                continue
            try:
                rows = pair_photos([photos[i] for i in group], each).rows
            except GeotagError as problem:
                refused.append(problem)
                continue
            taken = [i for i, row in zip(group, rows, strict=True) if row >= 0]
            assigned.append((each, taken))
            left = [i for i in left if i not in set(taken)]
            break
    if not assigned:
        raise refused[0]
    return assigned


def _within(marks: Marks, left: list[int], photos: list[Photo]) -> list[int]:
    """Photos whose clock falls into the MRK's span, zone aside."""
    first, last = gps_to_utc(marks.gps_s[[0, -1]])
    inside = []
    for i in left:
        local = not np.isfinite(photos[i].utc)
        zone = np.round((photos[i].time_s - (first + last) / 2) / 900) * 900 if local else 0.0
        if first - 5 <= photos[i].time_s - zone <= last + 5:
            inside.append(i)
    return inside


def on_map(
    known: Marks | Trajectory, crs: pyproj.CRS, source: pyproj.CRS | None, rows: np.ndarray | slice = slice(None)
) -> np.ndarray:
    """(K, 3) positions of marks or epochs in the project CRS. source: the geotags' frame, if not the project's."""
    lon, lat, height = (values[rows] for values in (known.lon_deg, known.lat_deg, known.height_m))
    return lonlat_to_project(crs, lon, lat, height, source, decimal_year(known.gps_s))


def antenna_at(
    marks: Marks, rows: np.ndarray, tracks: list[Trajectory], crs: pyproj.CRS, source: pyproj.CRS | None, delay_s: float
) -> Interpolated:
    """Camera positions: the antenna's trajectory at the exposure plus the lever arm, once."""
    gps = marks.gps_s[rows] + delay_s
    solutions = [
        interpolate(
            track,
            on_map(track, crs, source),
            gps,
            max_gap_s=np.inf if track.path.stem.lower().endswith("_events") else 1.0,
            own=_on_axes(track.velocity_enu, crs, track),
        )
        for track in tracks
    ]
    covered = [np.isfinite(solution.xyz[:, 0]) for solution in solutions]
    if (np.sum(covered, axis=0) > 1).any():
        double = [track.path.name for track, mask in zip(tracks, covered, strict=True) if mask.any()]
        raise GeotagError(
            f"{marks.path}: its exposures are covered by {len(double)} solutions ({', '.join(double)}); keep only the "
            "one to use, or name it with --geotags."
        )
    found = Interpolated.nothing(len(rows))
    for solution, mask in zip(solutions, covered, strict=True):
        found.put(mask, Interpolated(*(values[mask] for values in solution)))
    found.xyz[:] += _on_axes(marks.offset_enu[rows], crs, tracks[0])
    return found


def in_time(
    marks: Marks,
    rows: np.ndarray,
    tracks: list[Trajectory],
    own: np.ndarray,
    crs: pyproj.CRS,
    source: pyproj.CRS | None,
    delay_s: float,
    reporter: Reporter,
) -> tuple[list[Trajectory], float]:
    """The antenna's paths with the times of the one over these exposures corrected where it certainly comes late or
    early, and the standard error of that, seconds.

    Args:
        own: (N, 2) the photos' own positions, project metres, NaN unknown: witnesses where the marks have none.
    """
    at = marks.gps_s[rows] + delay_s
    over = [k for k, track in enumerate(tracks) if track.gps_s[0] < at.max() and track.gps_s[-1] > at.min()]
    if len(over) != 1:
        return tracks, 0.0
    track = tracks[over[0]]
    path, seen = on_map(track, crs, source), marks.is_placed[rows]
    witness, least_s, whose = own, EXIF_MIN_S, "the photos' own GPS positions"
    if seen.sum() >= MIN_WITNESSES:
        witness = (on_map(marks, crs, source, rows) - _on_axes(marks.offset_enu[rows], crs, track))[:, :2]
        witness[~seen] = np.nan
        precise = np.nan_to_num(np.median(marks.sd[rows][seen].max(axis=1)), nan=np.inf) <= PRECISE_M
        least_s, whose = PRECISE_MIN_S if precise else ROUGH_MIN_S, f"the positions in {marks.path.name}"
    stated_m = float(np.nan_to_num(np.median(track.sd[:, :2])))
    shift = find_shift(track.gps_s, path[:, :2], at, witness, least_s, stated_m)
    if shift is None:
        return tracks, 0.0
    seconds, sd_s, why = shift.seconds, shift.sd_s, ""
    if abs(abs(seconds) - GPS_UTC_S) < min(NEAR_S, 4 * sd_s + 0.1):
        seconds, sd_s = float(np.copysign(GPS_UTC_S, seconds)), 0.0
        why = " (GPS time was taken for UTC, or the reverse)"
    reporter.warn(
        f"{track.path.name}: its times are {abs(seconds):.2f} s too {'late' if seconds > 0 else 'early'}{why}, by "
        f"{whose}; they were corrected (to {shift.sd_s:.2f} s, {shift.sd_s * shift.speed_m_s:.2f} m along the flight). "
        "Look at the time system of the PPK."
    )
    corrected = replace(track, gps_s=track.gps_s - seconds)
    return [corrected if k == over[0] else each for k, each in enumerate(tracks)], sd_s


def _on_axes(enu: np.ndarray, crs: pyproj.CRS, track: Trajectory) -> np.ndarray:
    """(N, 3) vectors in true east, north, up on the axes of the project where the track is."""
    middle = float(np.median(track.lon_deg)), float(np.median(track.lat_deg))
    return turned_to_grid(enu, grid_convergence_deg(crs, *middle))


#: Shifts that are looked for, seconds: GPS time read as UTC is 18 s off.
MAX_SHIFT_S = 30.0
#: A shift counts from this many standard errors on ...
CERTAIN_SD = 4.0
#: ... and from so many seconds, by how late the witnesses may be themselves: precise positions of the drone (RTK) at
#: the exposure itself; those of its navigation, which smooths; EXIF, which may be a second old on some drones.
PRECISE_MIN_S, ROUGH_MIN_S, EXIF_MIN_S = 0.02, 0.2, 0.7
#: Positions with standard deviations below this are precise, metres.
PRECISE_M = 0.1
#: Photos that have to bear witness, and the share of them that the shifted path has to cover.
MIN_WITNESSES, MIN_COVERED = 5, 0.8
#: Velocities that differ by less (standard deviation) are one: the epochs' noise alone makes 0.03, m/s.
MIN_SPREAD_M_S = 0.3
#: GPS time is this far ahead of UTC since 2017; a shift within this of it is taken for it, seconds.
GPS_UTC_S, NEAR_S = 18.0, 0.5
#: A shift of less than this need not be the only one that fits, as clocks are hardly ever far off; nor does an estimate
#: move further from where it begins, seconds.
USUAL_S = 1.0
_STEP_S, _ROUNDS = 0.1, 8


@dataclass(frozen=True)
class Shift:
    """seconds: the path's times are so much too late. sd_s: standard error. speed_m_s: median of the drone's."""

    seconds: float
    sd_s: float
    speed_m_s: float


def find_shift(
    times: np.ndarray, path: np.ndarray, at: np.ndarray, witness: np.ndarray, least_s: float, least_m: float = 0.0
) -> Shift | None:
    """By how much a path comes late against positions at N exposures, a constant offset aside; ``None`` where that is
    not certain (hardly more than none, or another one far from it fits as well) or moves less than the path's accuracy.

    Args:
        times: (T,) seconds, rising. path: (T, 2) metres. at: (N,) seconds. witness: (N, 2) metres, NaN unknown.
        least_s: shorter shifts say nothing. least_m: nor do those that move most positions by less.
    """
    known = np.argsort(at, kind="stable")
    known = known[np.isfinite(witness[known]).all(axis=1)]
    if len(known) < MIN_WITNESSES:
        return None
    at, witness = at[known], witness[known]
    tried = np.arange(-MAX_SHIFT_S, MAX_SHIFT_S + 0.5 * _STEP_S, _STEP_S)
    away = np.array([_away(_at(times, path, at + shift) - witness) for shift in tried])
    if not np.isfinite(away).any():
        return None
    # Flights repeat themselves: a far shift counts where no other, apart from it, fits as well.
    fits = away < 1.5 * max(float(np.nanmin(away)), 0.02)
    usual = fits & (np.abs(tried) <= USUAL_S)
    if not usual.any() and (np.diff(np.flatnonzero(fits)) * _STEP_S > 1.0).any():
        return None
    best = int(np.nanargmin(np.where(usual, away, np.nan) if usual.any() else away))
    found = _refined(times, path, at, witness, float(tried[best]))
    if found is None or abs(found.seconds - tried[best]) > USUAL_S:
        return None
    moved = np.linalg.norm(_at(times, path, at + found.seconds) - _at(times, path, at), axis=1)
    certain = abs(found.seconds) > max(least_s, CERTAIN_SD * found.sd_s) and not np.nanmedian(moved) < least_m
    return found if certain else None


def _at(times: np.ndarray, path: np.ndarray, instants: np.ndarray) -> np.ndarray:
    """(N, 2) path at N instants, NaN outside it and in its gaps."""
    found = np.column_stack([np.interp(instants, times, axis, np.nan, np.nan) for axis in path.T])
    right = np.clip(np.searchsorted(times, instants), 1, len(times) - 1)
    found[times[right] - times[right - 1] > 10.0] = np.nan
    return found


def _away(residual: np.ndarray) -> float:
    """Median distance from the median; NaN where too few are known."""
    known = np.isfinite(residual).all(axis=1)
    if known.sum() < max(MIN_WITNESSES, MIN_COVERED * len(residual)):
        return float("nan")
    residual = residual[known]
    return float(np.median(np.hypot(*(residual - np.median(residual, axis=0)).T)))


def _refined(times: np.ndarray, path: np.ndarray, at: np.ndarray, witness: np.ndarray, start_s: float) -> Shift | None:
    """By robust least squares with a constant offset."""
    shift, sd_s, speed = start_s, np.inf, 0.0
    for _ in range(_ROUNDS):
        place = _at(times, path, at + shift)
        velocity = (_at(times, path, at + shift + 0.25) - _at(times, path, at + shift - 0.25)) / 0.5
        known = np.isfinite(place + velocity).all(axis=1)
        if known.sum() < MIN_WITNESSES:
            return None
        # The few that brake or turn on one straight line would decide by themselves, with their errors.
        odd = np.linalg.norm(velocity - np.median(velocity[known], axis=0), axis=1)
        known &= odd <= np.percentile(odd[known], 90)
        if np.linalg.norm(np.std(velocity[known], axis=0)) < MIN_SPREAD_M_S:
            return None
        step, sd_s, _ = along_velocity((witness - place)[known], velocity[known])
        speed = float(np.median(np.linalg.norm(velocity[known], axis=1)))
        shift += float(np.clip(step, -1.0, 1.0))
    return Shift(shift, sd_s, speed) if np.isfinite(sd_s) else None


def along_velocity(away: np.ndarray, velocity: np.ndarray) -> tuple[float, float, np.ndarray]:
    """Seconds that, times their velocities, explain (N, K) distances best beside a constant offset; their standard
    error; the offset (K,). In order of time: errors of navigation last from one to the next, so much as they show
    (autoregression, :math:`x_i - r x_{i-1}`)."""
    design = np.concatenate([velocity[:, :, None], np.tile(np.eye(away.shape[1]), (len(away), 1, 1))], axis=2)
    rows, value = design, away
    for _ in range(4):
        found, sd = _robust(rows, value)
        if not np.isfinite(sd):
            return 0.0, np.inf, np.median(away, axis=0)
        left = away - design @ found
        size = np.linalg.norm(left, axis=1)
        left *= np.minimum(1.0, 3 * np.median(size) / np.maximum(size, 1e-9))[:, None]
        lasts = np.sum(left[1:] * left[:-1]) / max(np.sum(left**2), 1e-12)
        # The estimate is too small by this (Kendall 1954).
        lasts = float(np.clip(lasts + (1 + 3 * lasts) / len(left), 0.0, 0.99))
        rows, value = design[1:] - lasts * design[:-1], away[1:] - lasts * away[:-1]
    return float(found[0]), sd, found[1:]


def _robust(design: np.ndarray, value: np.ndarray) -> tuple[np.ndarray, float]:
    """(P,) unknowns of (N, K) values by their (N, K, P) design, and the standard error of the first: Cauchy weights by
    the median."""
    count, axes, unknowns = design.shape
    weight, found, sd = np.ones(count), np.zeros(unknowns), np.inf
    for _ in range(20):
        normal = np.einsum("n,nkp,nkq->pq", weight, design, design)
        if np.linalg.cond(normal) > 1e10:
            return found, np.inf
        found = np.linalg.solve(normal, np.einsum("n,nkp,nk->p", weight, design, value))
        left = np.linalg.norm(value - design @ found, axis=1)
        # 1.2: a normal distribution's, of two axes; a median of few is rough.
        scale = max(1.2 * (1 + 4 / count) * float(np.median(left)) / np.sqrt(axes), 1e-4)
        weight = 1 / (1 + (left / (3 * scale)) ** 2)
        sd = float(np.sqrt(np.linalg.inv(normal)[0, 0])) * scale
    return found, sd
