"""Pattern search (Hooke and Jeeves 1961), compiled once for every score of one or two discs."""

from __future__ import annotations

import numpy as np
from numba import njit

_FAST = {"nogil": True, "fastmath": True, "error_model": "numpy"}
#: Moves of one disc: eight ways sideways, alone and with a thinner or thicker stem, eight leans, two radii.
DISC_MOVES = 34


@njit(inline="always", **_FAST)
def disc_step(p, move, scale, trial):
    """One move of :func:`pattern_search` from ``p`` (5,) x, y, lx, ly, r, into ``trial``."""
    trial[:] = p
    angle = (move % 8) * np.pi / 4
    if move < 24:
        trial[0] += 0.02 * scale * np.cos(angle)
        trial[1] += 0.02 * scale * np.sin(angle)
        if move >= 16:
            trial[4] -= 0.02 * scale
        elif move >= 8:
            trial[4] += 0.02 * scale
    elif move < 32:
        trial[2] += 0.02 * scale * np.cos(angle)
        trial[3] += 0.02 * scale * np.sin(angle)
    elif move == 32:
        trial[4] += 0.015 * scale
    else:
        trial[4] -= 0.015 * scale


@njit(inline="always", **_FAST)
def pattern_search(score, data, step, moves, p, low, high, scales, rounds):
    """Climb ``score(data, p)``, a compiled function, from ``p``, which is changed in place; returns the best score.

    step: compiled function of :func:`disc_step`'s kind; moves: how many it has. low, high: limits of the radius, m.
    scales: of the steps, coarse to fine; rounds: at most so many of each. Always inlined: compiled functions that take
    others cannot be kept on disk, their callers can.
    """
    trial = np.empty(p.size)
    best = score(data, p)
    for scale in scales:
        for _ in range(rounds):
            improved = False
            for move in range(moves):
                step(p, move, scale, trial)
                if trial[4] < low or trial[4] > high:
                    continue
                value = score(data, trial)
                if value > best + 1e-6:
                    best = value
                    p[:] = trial
                    improved = True
            if not improved:
                break
    return best
