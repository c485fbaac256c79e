"""Which photo belongs to which exposure mark: the pairing that camera clock, positions and numbers make most likely.

A mark or a photo may be missing anywhere. Every constant error of the clock that some pairs have in common is tried;
for each, all pairings in their order and with gaps are summed up (forward and backward, as for hidden Markov models).
A pair counts when all of them together leave it no doubt.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..core.errors import GeotagError
from .gpstime import describe_utc, gps_to_utc
from .mrk import Marks
from .photos import Photo

QUARTER_HOUR_S = 900.0
#: A clock is off by its zone (quarter hours, within 14 h) plus at most this, seconds.
MAX_CLOCK_ERROR_S = 60.0
#: Photos of another clock error than the others' (set back in flight) are paired from this number on.
MIN_OF_ANOTHER_CLOCK = 3
#: A share of the photos that is enough without their positions' word.
ENOUGH_SHARE = 0.5
#: Probability that a pair has to reach.
NO_DOUBT = 0.9

#: Spread of the clock's error, seconds: of whole seconds, of fractions, the largest that is believed; share and spread
#: of times written late.
_WHOLE_S, _FRACTION_S, _ROUGH_S, _LATE, _LATE_S = 0.3, 0.05, 0.8, 0.03, 1.5
#: A clock that is this far off the others' is no witness for the pair, seconds.
_FAR_S = 4.0
#: Spread of a photo's own position about the exposure's, metres: smallest, largest believed; share and spread of rough.
_SHARP_M, _ROUGH_M, _STRAY, _STRAY_M = 0.5, 3.0, 0.1, 5.0
#: What a pair is compared with: a time within a minute, a place within 50 m. Logarithms of what speaks against a pair.
_ANY_TIME_S, _ANY_PLACE_M2, _NEVER, _ELSEWHERE = 60.0, 2500.0, -20.0, -6.0
#: Cost of a photo without an exposure between two that have one, and of an exposure without a photo; weight of numbers:
#: equal, and apart by a constant.
_LOST, _SPARE, _SAME_NUMBER, _SHIFTED_NUMBER = 2.0, 1.0, 2.2, 1.0
#: Clock errors that are glanced at, the most common ones; the likeliest that are tried, at most this share less likely.
_GLANCED, _TRIED, _LESS = 300, 8, 0.2


@dataclass(frozen=True)
class Pairing:
    """rows: (N,) row of the marks for each photo, -1 where there is none. utc: (N,) Unix seconds by the photos' clock
    and its error, NaN unknown."""

    rows: np.ndarray
    utc: np.ndarray


class _Side(NamedTuple):
    """What K photos, in the order taken, or marks say. time_s: (K,), NaN unknown. place: (K, 2) metres, NaN unknown.
    number: (K,), -1 unknown."""

    time_s: np.ndarray
    place: np.ndarray
    number: np.ndarray

    def part(self, rows: np.ndarray) -> _Side:
        return _Side(*(values[rows] for values in self))


@dataclass(frozen=True)
class _Evidence:
    """What N photos and M marks say. zoned: the clock's zone is unknown."""

    photos: _Side
    marks: _Side
    zoned: bool

    @property
    def knows_places(self) -> bool:
        return bool(np.isfinite(self.photos.place).any() and np.isfinite(self.marks.place).any())

    def part(self, photos: np.ndarray, marks: np.ndarray) -> _Evidence:
        return replace(self, photos=self.photos.part(photos), marks=self.marks.part(marks))


@dataclass(frozen=True)
class _Shared:
    """What all pairs share: the clock's error (NaN: no times), the positions' offset, how both scatter, how far numbers
    are apart."""

    clock_s: float
    offset: np.ndarray
    clock_sd: float
    place_sd: float
    apart: int


def pair_photos(photos: list[Photo], marks: Marks) -> Pairing:
    """Pair the photos of one flight folder, N, with M exposures.

    Raises:
        GeotagError: nothing pairs, or there is nothing to pair by.
    """
    seen = _evidence(photos, marks)
    # As they were taken: by time, equal times and unknown ones by number, then by name.
    timed = np.isfinite(seen.photos.time_s).all()
    order = np.lexsort((seen.photos.number, seen.photos.time_s if timed else np.zeros(len(photos))))
    ranks = np.argsort(seen.marks.time_s, kind="stable")
    sorted_seen = seen.part(order, ranks)
    if not np.isfinite(seen.photos.time_s).any() and not seen.knows_places:
        rows = _by_number_alone(seen)
        if rows is None:
            raise GeotagError(
                f"{marks.path}: {len(marks.index)} exposures for {len(photos)} photos whose EXIF has neither time nor "
                "place, so they cannot be paired safely; give photos with their EXIF, or positions by photo name (CSV)."
            )
        return Pairing(rows, np.full(len(rows), np.nan))
    rows, shared = _likeliest(sorted_seen)
    paired = rows >= 0
    sure = _agree_in_place(sorted_seen, rows, shared)
    if not paired.any() or (paired.mean() < ENOUGH_SHARE and sure.sum() < MIN_OF_ANOTHER_CLOCK):
        times = seen.photos.time_s[np.isfinite(seen.photos.time_s)]
        first, last = (describe_utc(t)[:-4] for t in (times.min(), times.max())) if len(times) else ("unknown",) * 2
        raise GeotagError(
            f"{marks.path}: its {len(marks.index)} exposures ({describe_utc(sorted_seen.marks.time_s[0])} to "
            f"{describe_utc(sorted_seen.marks.time_s[-1])}) belong to other photos than these {len(photos)} (camera "
            f"clock {first} to {last}): times and places agree without doubt for {paired.mean():.0%} of them; give the "
            "MRK of this flight, or positions by photo name (CSV)."
        )
    if not paired.all():
        rows = _with_another_clock(sorted_seen, rows, shared)
    found = np.full(len(rows), -1)
    found[order] = np.where(rows >= 0, ranks[rows], -1)
    return Pairing(found, seen.photos.time_s - shared.clock_s)


def _evidence(photos: list[Photo], marks: Marks) -> _Evidence:
    degrees = np.column_stack([marks.lon_deg, marks.lat_deg])
    degrees[(marks.flag == 0) | ~degrees.any(axis=1)] = np.nan
    middle = np.nanmedian(degrees, axis=0) if np.isfinite(degrees).any() else np.zeros(2)
    metres = 111200.0 * np.array([np.cos(np.radians(middle[1])), 1.0])
    place = np.array([(photo.lon_deg, photo.lat_deg) for photo in photos])
    times = np.array([photo.time_s for photo in photos])
    own = _Side(times, (place - middle) * metres, np.array([photo.sequence for photo in photos]))
    marked = _Side(gps_to_utc(marks.gps_s), (degrees - middle) * metres, marks.index)
    return _Evidence(own, marked, not all(np.isfinite(photo.utc) for photo in photos))


def _by_number_alone(seen: _Evidence) -> np.ndarray | None:
    """Equal numbers where every photo has its own, or the order where there are as many; else nothing is safe."""
    rows = {int(number): row for row, number in enumerate(seen.marks.number)}
    by_number = np.array([rows.get(int(number), -1) for number in seen.photos.number])
    if (by_number >= 0).all() and len(np.unique(by_number)) == len(by_number):
        return by_number
    return np.arange(len(seen.photos.number)) if len(seen.photos.number) == len(seen.marks.number) else None


def _likeliest(seen: _Evidence) -> tuple[np.ndarray, _Shared]:
    """Rows by all clock errors together, and what the pairs of the likeliest share."""
    sharp = np.mean(np.abs(seen.photos.time_s - np.round(seen.photos.time_s)) > 1e-6) > 0.5
    least_s = _FRACTION_S if sharp else _WHOLE_S
    tried = []
    for clock_s in _clock_errors(seen):
        shared = _Shared(clock_s, np.zeros(2), _ROUGH_S, _ROUGH_M, 0)
        rows = np.full(len(seen.photos.time_s), -1)
        for _ in range(5):
            before = rows
            total, pairs = _sum_up(_gains(seen, shared))
            rows = _rows(pairs, 0.5)
            if not (rows >= 0).any() or (rows == before).all():
                break
            shared = _shared(seen, rows, shared, least_s)
        tried.append((total + _prior(seen, shared), shared))
    best = max(total for total, _ in tried)
    weights = np.array([np.exp(total - best) for total, _ in tried])
    weights /= weights.sum()
    likely = [(weight, shared) for weight, (_, shared) in zip(weights, tried, strict=True) if weight > 0.001]
    together = sum(weight * _sum_up(_gains(seen, shared))[1] for weight, shared in likely)
    return _rows(together, NO_DOUBT), tried[int(weights.argmax())][1]


def _rows(pairs: np.ndarray, least: float) -> np.ndarray:
    """(N,) the likeliest column of each row of (N, M) probabilities, -1 below ``least``."""
    return np.where(pairs.max(axis=1) >= least, pairs.argmax(axis=1), -1)


def _clock_errors(seen: _Evidence, most_s: float = MAX_CLOCK_ERROR_S) -> list[float]:
    """The most common differences of photo times and mark times that a clock may have; NaN alone without times."""
    times = seen.photos.time_s[np.isfinite(seen.photos.time_s)]
    if not len(times):
        return [float("nan")]
    apart = (times[:: max(len(times) // 500, 1), None] - seen.marks.time_s[None, :]).ravel()
    apart = apart[np.abs(_beyond_zone(apart, seen.zoned)) <= most_s]
    if not len(apart):
        return [float(np.median(times) - np.median(seen.marks.time_s))]
    bins, count = np.unique(np.round(apart / 0.5), return_counts=True)
    common = 0.5 * bins[np.argsort(-count, kind="stable")][:_GLANCED]
    clocks = [float(np.median(apart[np.abs(apart - each) <= 0.5])) for each in common]
    glances = np.array([_glance(seen, each) for each in clocks])
    best = np.argsort(-glances, kind="stable")[:_TRIED]
    return [clocks[k] for k in best if glances[k] >= glances.max() - _LESS * abs(glances.max())]


def _glance(seen: _Evidence, clock_s: float) -> float:
    """How likely a clock error is, by the mark that is nearest in time to each photo."""
    when = seen.photos.time_s - clock_s
    middles = 0.5 * (seen.marks.time_s[1:] + seen.marks.time_s[:-1])
    rows = np.searchsorted(middles, np.nan_to_num(when))
    off_s, apart = when - seen.marks.time_s[rows], seen.photos.place - seen.marks.place[rows]
    near = np.abs(off_s) < _FAR_S
    known = near & np.isfinite(apart).all(axis=1)
    offset = np.median(apart[known], axis=0) if known.any() else np.zeros(2)
    gain = _time_gain(off_s, _ROUGH_S) + np.where(known, _place_gain(np.hypot(*(apart - offset).T), _ROUGH_M), 0.0)
    shared = _Shared(clock_s, offset, _ROUGH_S, _ROUGH_M, 0)
    return float(np.nansum(np.maximum(gain, 0.0))) + _prior(seen, shared)


def _beyond_zone(apart_s: np.ndarray, zoned: bool) -> np.ndarray:
    """Clock error without its zone; infinite where no zone is so far from UTC."""
    if not zoned:
        return apart_s
    zone = np.round(apart_s / QUARTER_HOUR_S) * QUARTER_HOUR_S
    return np.where(np.abs(zone) <= 14 * 3600, apart_s - zone, np.inf)


def _gains(seen: _Evidence, shared: _Shared) -> np.ndarray:
    """(N, M) natural logarithm of how much more likely a photo and a mark look alike as a pair than as strangers."""
    gain = np.zeros((len(seen.photos.time_s), len(seen.marks.time_s)), np.float32)
    if np.isfinite(shared.clock_s):
        off_s = seen.photos.time_s[:, None] - shared.clock_s - seen.marks.time_s
        gain += np.nan_to_num(_time_gain(off_s, shared.clock_sd))
    if seen.knows_places:
        east, north = (seen.photos.place - shared.offset).T[..., None] - seen.marks.place.T[:, None]
        gain += np.nan_to_num(_place_gain(np.hypot(east, north), shared.place_sd))
    numbers = seen.photos.number[:, None] - seen.marks.number
    known = seen.photos.number[:, None] >= 0
    return gain + known * (_SAME_NUMBER * (numbers == 0) + _SHIFTED_NUMBER * (numbers == shared.apart)) / len(gain)


def _time_gain(off_s: np.ndarray, sd: float) -> np.ndarray:
    usual = (1 - _LATE) * np.exp(-0.5 * (off_s / sd) ** 2) / sd
    late = _LATE * np.exp(-0.5 * (off_s / _LATE_S) ** 2) / _LATE_S
    with np.errstate(divide="ignore"):
        gain = np.log(_ANY_TIME_S / np.sqrt(2 * np.pi) * (usual + late))
    return np.where(np.abs(off_s) > _FAR_S, _NEVER, gain)


def _place_gain(off_m: np.ndarray, sd: float) -> np.ndarray:
    usual = (1 - _STRAY) * np.exp(-0.5 * (off_m / sd) ** 2) / sd**2
    stray = _STRAY * np.exp(-0.5 * (off_m / _STRAY_M) ** 2) / _STRAY_M**2
    with np.errstate(divide="ignore"):
        return np.maximum(np.log(_ANY_PLACE_M2 / (2 * np.pi) * (usual + stray)), _ELSEWHERE)


def _shared(seen: _Evidence, rows: np.ndarray, before: _Shared, least_s: float) -> _Shared:
    """What the pairs have in common, by medians."""
    own = np.flatnonzero(rows >= 0)
    off_s = seen.photos.time_s[own] - seen.marks.time_s[rows[own]]
    off_s = off_s[np.isfinite(off_s)]
    clock_s, clock_sd = before.clock_s, before.clock_sd
    if len(off_s):
        clock_s = float(np.median(off_s))
        clock_sd = float(np.clip(1.5 * np.median(np.abs(off_s - clock_s)), least_s, _ROUGH_S))
    apart = seen.photos.place[own] - seen.marks.place[rows[own]]
    apart = apart[np.isfinite(apart).all(axis=1)]
    offset, place_sd = before.offset, before.place_sd
    if len(apart):
        offset = np.median(apart, axis=0)
        place_sd = float(np.clip(0.85 * np.median(np.hypot(*(apart - offset).T)), _SHARP_M, _ROUGH_M))
    numbers, count = np.unique(seen.photos.number[own] - seen.marks.number[rows[own]], return_counts=True)
    return _Shared(clock_s, offset, clock_sd, place_sd, int(numbers[count.argmax()]))


def _prior(seen: _Evidence, shared: _Shared) -> float:
    """Natural logarithm of how common such a clock error and such an offset are: drones that set their clock by GPS and
    write the position of the mark itself have none."""
    total = 0.0
    if np.isfinite(shared.clock_s):
        rest = float(_beyond_zone(np.array(shared.clock_s), seen.zoned))
        total += float(np.log(np.exp(-0.5 * (rest / 0.5) ** 2) / (0.5 * np.sqrt(2 * np.pi)) + 0.5 / MAX_CLOCK_ERROR_S))
    if seen.knows_places:
        square = float(shared.offset @ shared.offset)
        total += float(np.logaddexp(-0.5 * square / 0.09 - np.log(0.09), -0.5 * square / 9 - np.log(9)))
    return total


def _sum_up(gain: np.ndarray) -> tuple[float, np.ndarray]:
    """Logarithm of the sum over all pairings that keep the order of both sides; the (N, M) probability of each pair.

    Rows and columns before the first and after the last pair cost nothing, others :data:`_LOST` and :data:`_SPARE`.
    """
    ahead, total = _ending_at(gain)
    back = _ending_at(gain[::-1, ::-1])[0][::-1, ::-1]
    return total, np.exp(np.minimum(ahead + back - gain - total, 0.0))


def _ending_at(gain: np.ndarray) -> tuple[np.ndarray, float]:
    """(N, M) logarithm of the sum over the pairings whose last pair is this one, and of the sum over all."""
    from scipy.signal import lfilter  # half a second, which most flights need not wait for

    found = np.full(gain.shape, -np.inf)
    # In units of exp(scale): sums over the rows so far, by their last column, and faded over the columns since.
    ended, before, total, scale = np.zeros(gain.shape[1]), np.zeros(gain.shape[1]), 1.0, 0.0
    for i, row in enumerate(gain.astype(float)):
        with np.errstate(divide="ignore"):
            found[i] = row + scale + np.log(before + np.exp(-scale))
        higher = max(scale, float(found[i].max()))
        fade, new = np.exp(scale - higher), np.exp(found[i] - higher)
        ended, total, scale = ended * fade * np.exp(-_LOST) + new, total * fade + new.sum(), higher
        before = np.concatenate([[0.0], lfilter([1.0], [1.0, -np.exp(-_SPARE)], ended)[:-1]])
    return found, scale + float(np.log(total))


def _agree_in_place(seen: _Evidence, rows: np.ndarray, shared: _Shared) -> np.ndarray:
    """(N,) bool: paired, and the photo's own position says so."""
    apart = np.full(len(rows), np.nan)
    own = rows >= 0
    apart[own] = np.hypot(*(seen.photos.place[own] - shared.offset - seen.marks.place[rows[own]]).T)
    return np.nan_to_num(_place_gain(apart, shared.place_sd)) > 0


def _with_another_clock(seen: _Evidence, rows: np.ndarray, shared: _Shared) -> np.ndarray:
    """Photos that are left, whatever their clock's error, where their own positions lie with marks that are left."""
    photos, marks = np.flatnonzero(rows < 0), np.setdiff1d(np.arange(len(seen.marks.time_s)), rows)
    rest = seen.part(photos, marks)
    # Photos of another day's flight by the same plan have the same places, and the same numbers.
    repeated = np.isin(rest.photos.number, seen.photos.number[rows >= 0]).any()
    if repeated or len(photos) < MIN_OF_ANOTHER_CLOCK or not len(marks) or not rest.knows_places:
        return rows
    found = rows.copy()
    for clock_s in _clock_errors(replace(rest, zoned=False), np.inf)[:1]:
        other = _rows(_sum_up(_gains(rest, replace(shared, clock_s=clock_s)))[1], NO_DOUBT)
        agree = _agree_in_place(rest, other, shared)
        if agree.sum() >= MIN_OF_ANOTHER_CLOCK:
            found[photos[agree]] = marks[other[agree]]
    return found
