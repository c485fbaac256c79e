"""Steps in an antenna's path that no drone can fly.

A wrong ambiguity, a spliced file or an edited one moves the path at once and leaves every epoch marked as fixed. What
gives it away is physics: the displacement between two epochs against the velocity around them.
"""

from __future__ import annotations

import numpy as np

#: Faster than this between two epochs is no drone (m/s): fixed wings with the wind behind them; climbs and descents.
MAX_SPEED_M_S, MAX_CLIMB_M_S = 40.0, 15.0
#: Harder than this no mapping drone brakes or turns (m/s2): full tilt of 45 degrees is 10.
MAX_ACCELERATION_M_S2 = 15.0
#: Epochs further apart than this (s) say nothing about each other's velocity: speed alone is asked there.
NEAR_S = 3.0
#: What noise and a swaying antenna may do to a displacement between fixed epochs, metres.
NOISE_M = 0.3
#: Velocity before and after a displacement: this many displacements on each side.
_BESIDE = 2


def path_offsets(times: np.ndarray, xyz: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """How far each fixed epoch lies off the path that most of them belong to.

    The path is cut where a step cannot be flown. Steps are added up, so that a jump out and back harms only what lies
    between. The longest part counts as right: which side of a lasting step is wrong cannot be seen from the path.
    Float and single epochs wander by themselves; only the photos' own positions judge them.

    Args:
        times: (T,) seconds, rising. xyz: (T, 3) metres. fixed: (T,) bool.

    Returns:
        (T, 3) metres, zero for every epoch that is believed or not fixed.
    """
    offset = np.zeros((len(times), 3))
    own = np.flatnonzero(fixed)
    if len(own) < 3:
        return offset
    chosen = _thinned(times[own])
    jump = _jumps(times[own][chosen], xyz[own][chosen])
    summed = np.vstack([np.zeros(3), np.cumsum(jump, axis=0)])
    number = np.concatenate([[0], np.cumsum((jump != 0).any(axis=1))])
    member = np.searchsorted(chosen, np.arange(len(own)), side="right") - 1
    part, place = number[member], summed[member]
    longest = int(np.argmax(np.bincount(part)))
    place = place - place[np.flatnonzero(part == longest)[0]]
    # Back to within what cannot be distinguished from flying is back.
    sizes = np.linalg.norm(jump, axis=1)
    usual = min(float(np.median(np.diff(times[own][chosen]))), NEAR_S)
    least = 0.5 * float(sizes[sizes > 0].min(initial=np.inf))
    place[np.linalg.norm(place, axis=1) <= min(least, MAX_ACCELERATION_M_S2 * usual**2 + NOISE_M)] = 0.0
    offset[own] = place
    return offset


def _thinned(times: np.ndarray) -> np.ndarray:
    """Numbers of the epochs that are apart: doubled ones a moment later have no velocity and go with the one before."""
    least = 0.5 * min(float(np.percentile(np.diff(times), 75)), NEAR_S)
    kept = [0]
    for i in range(1, len(times)):
        if times[i] - times[kept[-1]] >= least:
            kept.append(i)
    return np.array(kept)


def _jumps(times: np.ndarray, xyz: np.ndarray) -> np.ndarray:
    """(T - 1, 3) the part of each displacement that cannot have been flown, zero where all of it can."""
    dt = np.diff(times)
    moved = np.diff(xyz, axis=0)
    velocity = moved / dt[:, None]
    beside = np.full((2 * _BESIDE, len(dt), 3), np.nan)
    longest = dt.copy()
    for row, shift in enumerate(s for s in range(-_BESIDE, _BESIDE + 1) if s):
        source = np.arange(len(dt)) + shift
        inside = (source >= 0) & (source < len(dt))
        inside[inside] &= dt[source[inside]] <= NEAR_S
        beside[row, inside] = velocity[source[inside]]
        longest[inside] = np.maximum(longest[inside], dt[source[inside]])
    usual = np.zeros_like(velocity)
    known = np.isfinite(beside).any(axis=0).all(axis=1)
    usual[known] = np.nanmedian(beside[:, known], axis=0)
    excess = moved - usual * dt[:, None]
    fast = (np.linalg.norm(moved[:, :2], axis=1) > MAX_SPEED_M_S * dt + NOISE_M) | (
        np.abs(moved[:, 2]) > MAX_CLIMB_M_S * dt + NOISE_M
    )
    near = known & (longest <= NEAR_S)
    hard = near & (np.linalg.norm(excess, axis=1) > MAX_ACCELERATION_M_S2 * longest**2 + NOISE_M)
    bad, noisy = fast | hard, np.linalg.norm(excess, axis=1) > NOISE_M
    # The way back of a jump may hide half behind a manoeuvre.
    for jump in excess[bad]:
        bad |= near & noisy & (np.linalg.norm(excess + jump, axis=1) < 0.5 * np.linalg.norm(jump))
    return np.where(bad[:, None], excess, 0.0)
