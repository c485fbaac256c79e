"""An antenna's path whose times are off: found by the positions that drone and photos wrote at the exposures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: Shifts that are looked for, seconds: GPS time read as UTC is 18 s off.
MAX_SHIFT_S = 30.0
#: A shift counts from this many standard errors on ...
CERTAIN_SD = 6.0
#: ... and from so many seconds, by what the witnesses are: precise positions of the drone (RTK) at the exposure itself;
#: its navigation, which drifts by decimetres over a line of photos; EXIF, which may be a second old on some drones.
PRECISE_MIN_S, ROUGH_MIN_S, EXIF_MIN_S = 0.02, 0.3, 0.7
#: Positions with standard deviations below this are precise, metres.
PRECISE_M = 0.1
#: Photos that have to bear witness, and the share of them that the shifted path has to cover.
MIN_WITNESSES, MIN_COVERED = 5, 0.8
#: GPS time is this far ahead of UTC since 2017; a shift within this of it is taken for it, seconds.
GPS_UTC_S, NEAR_S = 18.0, 0.5
_STEP_S, _ROUNDS = 0.1, 8


@dataclass(frozen=True)
class Shift:
    """seconds: the path's times are so much too late. sd_s: standard error. speed_m_s: median of the drone's."""

    seconds: float
    sd_s: float
    speed_m_s: float


def find_shift(
    times: np.ndarray, path: np.ndarray, at: np.ndarray, witness: np.ndarray, least_s: float
) -> Shift | None:
    """By how much a path comes late against positions at N exposures, a constant offset aside; ``None`` where that is
    not certain: hardly more than none, or not the only one.

    Args:
        times: (T,) seconds, rising. path: (T, 2) metres. at: (N,) seconds. witness: (N, 2) metres, NaN unknown.
        least_s: shorter shifts say nothing.
    """
    known = np.isfinite(witness).all(axis=1)
    if known.sum() < MIN_WITNESSES:
        return None
    at, witness = at[known], witness[known]
    tried = np.arange(-MAX_SHIFT_S, MAX_SHIFT_S + 0.5 * _STEP_S, _STEP_S)
    away = np.array([_away(_at(times, path, at + shift) - witness) for shift in tried])
    if not np.isfinite(away).any():
        return None
    best = int(np.nanargmin(away))
    found = _refined(times, path, at, witness, float(tried[best]))
    if found is None:
        return None
    seconds, sd_s, speed = found
    # Flights repeat themselves: another shift that fits as well leaves it open.
    there, here = (_away(_at(times, path, at + shift) - witness) for shift in (seconds, 0.0))
    elsewhere = away[np.abs(tried - seconds) > max(1.0, 3 * sd_s)]
    alone = not (elsewhere < 1.5 * max(there, 0.02)).any()
    closer = not np.isfinite(here) or there < here
    certain = alone and closer and abs(seconds) > max(least_s, CERTAIN_SD * sd_s)
    return Shift(seconds, sd_s, speed) if certain else None


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


def _refined(
    times: np.ndarray, path: np.ndarray, at: np.ndarray, witness: np.ndarray, start_s: float
) -> tuple[float, float, float] | None:
    """Shift, its standard error and the median speed, by robust least squares with a constant offset."""
    shift, sd_s, speed = start_s, np.inf, 0.0
    for _ in range(_ROUNDS):
        place = _at(times, path, at + shift)
        velocity = (_at(times, path, at + shift + 0.25) - _at(times, path, at + shift - 0.25)) / 0.5
        known = np.isfinite(place + velocity).all(axis=1)
        if known.sum() < MIN_WITNESSES:
            return None
        step, sd_s, _ = along_velocity((witness - place)[known], velocity[known])
        speed = float(np.median(np.linalg.norm(velocity[known], axis=1)))
        shift += float(np.clip(step, -1.0, 1.0))
    return (shift, sd_s, speed) if np.isfinite(sd_s) else None


def along_velocity(away: np.ndarray, velocity: np.ndarray) -> tuple[float, float, np.ndarray]:
    """Seconds that, times their velocities, explain (N, K) distances best beside a constant offset; their standard
    error; the offset (K,). Robust (Cauchy weights by the median)."""
    count, axes = away.shape
    design = np.concatenate([velocity.reshape(-1, 1), np.tile(np.eye(axes), (count, 1))], axis=1)
    value, weight = away.ravel(), np.ones(count)
    found, cov, scale = np.zeros(axes + 1), np.full((axes + 1, axes + 1), np.inf), 0.0
    for _ in range(20):
        normal = design.T @ (design * np.repeat(weight, axes)[:, None])
        if np.linalg.cond(normal) > 1e10:
            return 0.0, np.inf, np.median(away, axis=0)
        found = np.linalg.solve(normal, design.T @ (value * np.repeat(weight, axes)))
        left = np.linalg.norm((value - design @ found).reshape(count, axes), axis=1)
        scale = max(1.5 * float(np.median(left)) / np.sqrt(axes), 1e-4)
        weight = 1 / (1 + (left / (3 * scale)) ** 2)
        cov = np.linalg.inv(normal) * scale**2
    return float(found[0]), float(np.sqrt(cov[0, 0])), found[1:]
