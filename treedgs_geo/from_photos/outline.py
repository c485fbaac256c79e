"""Silhouette first: an explanation that stands where least ground is seen, moved to the edges nearby.

Polished on edges alone (:meth:`.coarse.Search.polish`) a silhouette slides to the strongest pair of edges, which may be
a lit half. Here both witnesses pull at once, the silhouette much harder.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .backdrop import Silhouette
from .backdrop_kernels import contrast_of
from .coarse import Search
from .coarse_kernels import MOVES, objective, step_to

_FAST = {"nogil": True, "cache": True, "fastmath": True}
#: Edge score (log likelihood units) that one unit of silhouette contrast (what chance reaches) is worth here.
PULL = 400.0


@njit(**_FAST)
def _value(edges, null, prior, outline, pull, p, z):
    ridge, unit, q, widen, normal, terminator, u0, du = edges
    taper, radii, mean, sd = null
    score = objective(ridge, unit, q, widen, normal, terminator, u0, du, p, taper, radii, mean, sd, z, prior)
    total, qs, sides, wide, blind, first = outline
    return score + pull * contrast_of(total, qs, sides, wide, blind, p[0], p[1], p[2], p[3], p[4], taper, first)


@njit(**_FAST)
def _move_to_edges(edges, null, prior, outline, pull, p, r_low, r_high):
    """Pattern search over place, lean and radius; p is changed in place."""
    z = np.empty(edges[0].shape[0])
    trial = np.empty(5)
    best = _value(edges, null, prior, outline, pull, p, z)
    for scale in (1.0, 0.5, 0.25):
        for _ in range(10):
            improved = False
            for move in range(MOVES):
                step_to(p, move, scale, trial)
                if trial[4] < r_low or trial[4] > r_high:
                    continue
                value = _value(edges, null, prior, outline, pull, trial, z)
                if value > best + 1e-6:
                    best = value
                    p[:] = trial
                    improved = True
            if not improved:
                break
    return best


def moved_to_edges(search: Search, outline: Silhouette, chance: float, shape: np.ndarray) -> np.ndarray:
    """(5,) the silhouette ``shape`` moved to where it and the edges are clearest. chance: contrast chance reaches."""
    s, u = search.strips, search.strips.u
    edges = (search.ridge, search.unit, s.q, s.widen, s.normal, search.terminator, float(u[0]), float(u[1] - u[0]))
    null = (search.taper, search.null.radii, search.null.mean, search.null.sd)
    sides = (outline.total, outline.q, outline.normal, outline.widen, outline.blind, outline.u0)
    p = np.array(shape, float)
    _move_to_edges(edges, null, search.prior.row, sides, PULL / chance, p, float(null[1][0]), float(null[1][-1]))
    return p
