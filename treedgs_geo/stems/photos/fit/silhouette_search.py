"""Silhouette first: an explanation that stands where least ground is seen, moved to the edges nearby.

Polished on edges alone (:meth:`.search.Search.polish_all`) a silhouette slides to the strongest pair of edges, which
may be a lit half. Here both witnesses pull at once, the silhouette much harder.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ..images.background import Silhouette
from ..images.background_kernels import contrast_of
from .pattern_search import DISC_MOVES, disc_step, pattern_search
from .search import Search
from .search_kernels import objective

_FAST = {"nogil": True, "cache": True, "fastmath": True}
#: Edge score (log likelihood units) that one unit of silhouette contrast (what chance reaches) is worth here.
PULL = 400.0


@njit(**_FAST)
def _value(data, p):
    edges, silhouette, pull = data
    return objective(edges, p) + pull * contrast_of(silhouette, p)


@njit(**_FAST)
def _move_to_edges(data, p, r_low, r_high):
    """Pattern search over place, lean and radius; p is changed in place."""
    return pattern_search(_value, data, disc_step, DISC_MOVES, p, r_low, r_high, (1.0, 0.5, 0.25), 10)


def moved_to_edges(search: Search, silhouette: Silhouette, chance: float, shape: np.ndarray) -> np.ndarray:
    """(5,) the silhouette ``shape`` moved to where it and the edges are clearest. chance: contrast chance reaches."""
    p = np.array(shape, float)
    radii = search.null.radii
    _move_to_edges((search.data, silhouette, PULL / chance), p, float(radii[0]), float(radii[-1]))
    return p
