"""Which photo belongs to which exposure mark: by number, checked by count and by time."""

from __future__ import annotations

import numpy as np

from ..core.errors import GeotagError
from .gpstime import describe_utc, gps_to_utc
from .mrk import Marks
from .photos import Photo

#: EXIF times are whole seconds and may be written when the file is saved.
TIME_TOLERANCE_S = 2.5
QUARTER_HOUR_S = 900.0


def pair_photos(photos: list[Photo], marks: Marks) -> np.ndarray:
    """Row of ``marks`` for each photo, -1 where there is none.

    Tried in turn, each accepted only if the clock agrees: the sequence number in the file name, the order (equal
    counts), the
    time itself. The camera clock may be off by its zone (whole quarter hours) plus a constant of at most a minute.

    Args:
        photos: of one flight folder, N. marks: M exposures.

    Raises:
        GeotagError: nothing pairs, or the clocks disagree.
    """
    times = np.array([photo.utc if np.isfinite(photo.utc) else photo.local_time for photo in photos])
    zoned = not all(np.isfinite(photo.utc) for photo in photos)
    mark_times = gps_to_utc(marks.gps_s)
    rows = {int(number): row for row, number in enumerate(marks.index)}
    by_number = np.array([rows.get(photo.sequence, -1) for photo in photos])
    found: list[np.ndarray] = []
    if (by_number >= 0).any() and _unique(by_number):
        found.append(by_number)
    if len(photos) == len(marks.index):
        found.append(np.arange(len(photos)))
    if not np.isfinite(times).any():
        if found and (found[0] >= 0).all():
            return found[0]
        raise GeotagError(
            f"{marks.path}: {len(marks.index)} exposures for {len(photos)} photos whose EXIF has no time, so they "
            "cannot be paired safely; give photos with their EXIF, or positions by photo name (CSV)."
        )
    best = 0.0
    for candidate in found:
        share, kept = _agreement(times, mark_times, candidate, zoned)
        best = max(best, share)
        if share >= 0.9:
            return kept
    by_time = _pair_by_time(times, mark_times, zoned)
    if (by_time >= 0).mean() >= 0.9:
        return by_time
    raise GeotagError(
        f"{marks.path}: its {len(marks.index)} exposures ({describe_utc(mark_times.min())} to "
        f"{describe_utc(mark_times.max())}) do not "
        f"belong to the {len(photos)} photos (camera clock {describe_utc(np.nanmin(times))[:-4]} to "
        f"{describe_utc(np.nanmax(times))[:-4]}): {best:.0%} of the times agree; give the MRK of this flight."
    )


def _unique(rows: np.ndarray) -> bool:
    kept = rows[rows >= 0]
    return len(np.unique(kept)) == len(kept)


def _agreement(times: np.ndarray, mark_times: np.ndarray, rows: np.ndarray, zoned: bool) -> tuple[float, np.ndarray]:
    """Share of the paired photos whose clock agrees; the pairing without those that do not.

    The clock's error must be one constant: a zone between -14 and +14 h in quarter hours plus at most a minute.
    """
    have = (rows >= 0) & np.isfinite(times)
    if not have.any():
        return 0.0, rows
    offset = times[have] - mark_times[rows[have]]
    constant = np.median(offset)
    zone = np.round(constant / QUARTER_HOUR_S) * QUARTER_HOUR_S if zoned else 0.0
    if abs(zone) > 14 * 3600 or abs(constant - zone) > 60:
        return 0.0, rows
    agree = np.abs(offset - constant) <= TIME_TOLERANCE_S
    kept = rows.copy()
    kept[np.flatnonzero(have)[~agree]] = -1
    return float(agree.mean()), kept


def _pair_by_time(times: np.ndarray, mark_times: np.ndarray, zoned: bool) -> np.ndarray:
    """Nearest mark for each photo under the best clock constant; ambiguous or far ones get -1."""
    best, merit = np.full(len(times), -1), (0, 0.0)
    fill = np.where(np.isfinite(times), times, -1e12)
    first = np.nanmin(times)
    for mark in mark_times:
        shift = first - mark
        zone = np.round(shift / QUARTER_HOUR_S) * QUARTER_HOUR_S if zoned else 0.0
        if abs(zone) > 14 * 3600 or abs(shift - zone) > 60:
            continue
        distance = np.abs(fill[:, None] - shift - mark_times[None, :])
        rows = distance.argmin(axis=1)
        rows[distance.min(axis=1) > TIME_TOLERANCE_S / 2] = -1
        kept = rows[rows >= 0]
        taken, counts = np.unique(kept, return_counts=True)
        rows[np.isin(rows, taken[counts > 1])] = -1
        # Evenly timed exposures fit under several constants: the smallest clock error is the likeliest.
        found = int((rows >= 0).sum()), -abs(shift - zone)
        if found > merit:
            best, merit = rows, found
    return best
