"""The antenna's trajectory at the exposure instants."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from .rtklib import FIX, FLOAT, Trajectory
from .velocity import MAX_GAP_S, path_offsets, path_velocities

#: Least standard deviation that is believed, metres (E, N, U): a fixed epoch; anything else.
FIX_FLOOR_M = np.array([0.01, 0.01, 0.02])
FLOAT_FLOOR_M = np.array([0.2, 0.2, 0.3])
SINGLE_FLOOR_M = np.array([1.5, 1.5, 3.0])

#: A fix held for less than this (seconds) between floats is no fix: in a real drive through a town
#: (``ppk_matrtklib``, 5 Hz) 117 of 448 such epochs were more than 0.2 m wrong, of 1351 longer held ones none.
MIN_FIX_S = 5.0


class Interpolated(NamedTuple):
    """Antenna or camera at N instants: xyz (N, 3) project metres (NaN = none), sd (N, 3) E, N, U metres, quality (N,)
    texts fix|float|single|none. off_m: (N,) how far the path jumps there in a way that no drone flies, 0 = it does not.
    velocity: (N, 3) m/s on the axes of xyz, NaN = unknown.
    """

    xyz: np.ndarray
    sd: np.ndarray
    quality: np.ndarray
    off_m: np.ndarray
    velocity: np.ndarray

    @classmethod
    def nothing(cls, count: int) -> Interpolated:
        """Nothing known of ``count`` instants, to be filled."""
        xyz, sd, velocity = (np.full((count, 3), np.nan) for _ in range(3))
        return cls(xyz, sd, np.full(count, "none", object), np.zeros(count), velocity)

    def put(self, at: np.ndarray, other: Interpolated) -> None:
        """Fill in what another one has for the instants ``at``."""
        for mine, theirs in zip(self, other, strict=True):
            mine[at] = theirs


def interpolate(
    trajectory: Trajectory, xyz: np.ndarray, gps_s: np.ndarray, max_gap_s: float = 1.0, own: np.ndarray | None = None
) -> Interpolated:
    """Monotone cubic (PCHIP) interpolation of the trajectory.

    A straight line between 5 Hz epochs errs by a centimetre when the drone brakes at 2 m/s2. The quality is the worse
    of the two neighbouring epochs. A gap of more than ``max_gap_s`` counts as float (the path is guessed), of more than
    10 s as no position. Where the path has jumped (:func:`.velocity.path_offsets`), ``off_m`` says so
    (:mod:`.agreement` judges it).

    Args:
        trajectory: T epochs. xyz: (T, 3) the same in project coordinates. gps_s: (N,) instants, GPS seconds.
        own: (T, 3) the solution's own velocities on the axes of xyz, m/s.
    """
    times = trajectory.gps_s
    found = Interpolated.nothing(len(gps_s))
    right = np.clip(np.searchsorted(times, gps_s), 1, len(times) - 1)
    left = right - 1
    # An exposure exactly at an epoch (an _events.pos) rests on that epoch alone, also after a gap.
    left = np.where(times[right] == gps_s, right, left)
    right = np.where(times[left] == gps_s, left, right)
    gap = times[right] - times[left]
    inside = (gps_s >= times[0]) & (gps_s <= times[-1]) & (gap <= 10.0)
    if not inside.any():
        return found
    # The rows of an _events.pos are too far apart to tell how long a fix was held.
    believed = trusted_quality(times, trajectory.quality) if np.isfinite(max_gap_s) else trajectory.quality
    offset = path_offsets(times, xyz, believed == FIX)
    jumps, off = np.linalg.norm(np.diff(offset, axis=0), axis=1), np.linalg.norm(offset, axis=1)
    found.off_m[inside] = np.maximum(off[left], off[right])[inside]
    # Flights are interpolated apart, and so are the two sides of a jump: a curve through a battery change would
    # overshoot on both sides.
    segment = np.concatenate([[0], np.cumsum((np.diff(times) > 10.0) | (jumps > 0))])
    for part in np.unique(segment[left[inside]]):
        epochs = np.flatnonzero(segment == part)
        wanted = inside & (segment[left] == part)
        if len(epochs) == 1:
            found.xyz[wanted] = xyz[epochs[0]]
        else:
            found.xyz[wanted] = PchipInterpolator(times[epochs], xyz[epochs])(gps_s[wanted])
    pair = np.column_stack([left, right])[inside]
    worst = np.where((believed[pair] > 0).all(axis=1), believed[pair].max(axis=1), 5)
    spread, guessed = trajectory.sd[pair], gap[inside] > max_gap_s
    own_sd = np.where(np.isfinite(spread).all(axis=(1, 2))[:, None], spread.max(axis=1), 0.0)
    grade = np.select([(worst == FIX) & ~guessed, np.isin(worst, (FIX, FLOAT, 6))], [0, 1], 2)
    found.quality[inside] = np.array(["fix", "float", "single"], object)[grade]
    floor = np.stack([FIX_FLOOR_M, FLOAT_FLOOR_M, SINGLE_FLOOR_M])[grade]
    found.sd[inside] = np.maximum(own_sd, floor) + np.where(guessed, 0.1 * gap[inside] ** 2, 0.0)[:, None]
    near = np.flatnonzero(inside & (gap <= MAX_GAP_S))
    found.velocity[near] = path_velocities(times, xyz, trajectory.quality, segment, gps_s[near], own)
    return found


def trusted_quality(times: np.ndarray, quality: np.ndarray) -> np.ndarray:
    """(T,) RTKLIB's Q, with fixes that were held for less than :data:`MIN_FIX_S` turned into floats."""
    fixed = quality == FIX
    # A run ends where epochs are missing, too.
    joined = fixed[1:] & fixed[:-1] & (np.diff(times) <= 3.0)
    starts = np.flatnonzero(fixed & ~np.r_[False, joined])
    ends = np.flatnonzero(fixed & ~np.r_[joined, False])
    believed = quality.copy()
    for start, end in zip(starts, ends, strict=True):
        if times[end] - times[start] < MIN_FIX_S:
            believed[start : end + 1] = FLOAT
    return believed
