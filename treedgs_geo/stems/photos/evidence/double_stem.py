"""Two full stems that touch, taken for one: the photos that look along the pair show a narrower stem.

Across the pair the two are one stem as wide as both, and enough such photos fit a disc well; the photos that look along
it then count as not seeing the stem, which costs nothing there (:mod:`.fit.search`). Here the disc is split in two
that stay inside it, in every direction and several proportions. Where the edges of all photos together and the
silhouettes before the ground both speak for two rather than one, the disc is no stem; edges alone flag what is too
thick for one stem of the stand. :mod:`.companion` looks for a thin companion beside a stem; this for two that are
alike, of which neither is the disc. Two discs inside a round or oval stem show far less than it does from the side.
Own method; figures: ``docs/evidence/photos.md``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from ...quality.limits import bound_of
from ..fit.pattern_search import pattern_search
from ..fit.search import Hypothesis, Search
from ..fit.search_kernels import seen_sum
from ..images.background import Silhouette
from ..tuned import APART_SD_M, BEYOND_M, MATE_LEAN_SD, MAX_FOLLOWED, MIN_PART, MIN_SPLIT_M, PARTS
from .companion import PAIR_MOVES, pair_contrast, pair_step, pair_view_z

_FAST = {"nogil": True, "cache": True, "fastmath": True}
#: Gain by edges alone from which its share of the disc's own score counts (log likelihood units).
MIN_GAIN = bound_of("photos", "twins", "check")


class Twins(NamedTuple):
    """Two full stems instead of one disc. gain: of the edges' log likelihood where the silhouettes of all photos stand
    out more, too, NaN elsewhere. share: the gain by edges alone over the disc's own score, 0 below
    :data:`MIN_GAIN`; NaN where nothing is said (thin discs, no silhouettes)."""

    gain: float
    share: float

    def clearest(self, other: Twins) -> Twins:
        """The larger of both, each."""
        return Twins(float(np.fmax(self.gain, other.gain)), float(np.fmax(self.share, other.share)))


NO_TWINS = Twins(float("nan"), float("nan"))


@njit(**_FAST)
def _twin_objective(data, p):
    """Summed log likelihood ratio of two stems, (10,), inside a disc. data: edges, null, disc (5,), scratch (V,)."""
    edges, null, whole, z = data
    for k in range(0, 10, 5):
        part = p[k + 4] / whole[4]
        if part < MIN_PART or part > (1 - MIN_PART):
            return -1e9
        if np.sqrt((p[k] - whole[0]) ** 2 + (p[k + 1] - whole[1]) ** 2) + p[k + 4] > whole[4] + BEYOND_M:
            return -1e9
    pair_view_z(edges, null, p, z)
    total = seen_sum(z)
    gap = np.sqrt((p[5] - p[0]) ** 2 + (p[6] - p[1]) ** 2) - p[4] - p[9]
    total -= 0.5 * (gap / APART_SD_M) ** 2
    for k in range(0, 10, 5):
        lean = (p[k + 2] - whole[2]) ** 2 + (p[k + 3] - whole[3]) ** 2
        total -= 0.5 * lean / MATE_LEAN_SD**2
    return total


@njit(parallel=True, **_FAST)
def _twin_scores(edges, null, whole, pairs, scores):
    """:func:`_twin_objective` of (M, 10) pairs -> (M,) scores."""
    for m in prange(len(pairs)):
        z = np.empty(edges.ridge.shape[0])
        scores[m] = _twin_objective((edges, null, whole, z), pairs[m])


@njit(parallel=True, **_FAST)
def _twin_polish(edges, null, whole, pairs, scores):
    """Pattern search over (M, 10) pairs, side by side; pairs and (M,) scores are changed in place."""
    for m in prange(len(pairs)):
        z = np.empty(edges.ridge.shape[0])
        data = edges, null, whole, z
        low, high = MIN_PART * whole[4], (1 - MIN_PART) * whole[4]
        scores[m] = pattern_search(_twin_objective, data, pair_step, PAIR_MOVES, pairs[m], low, high, (1.0, 0.5), 6)


def halves(disc: np.ndarray) -> np.ndarray:
    """(M, 10) pairs of stems side by side that are together as wide as a disc (5,) and fill it in one direction."""
    pairs = []
    for angle in np.arange(12) * (np.pi / 12):
        away = np.array([np.cos(angle), np.sin(angle)])
        for part in PARTS:
            one, other = part * disc[4], (1 - part) * disc[4]
            first, second = disc[:2] - (disc[4] - one) * away, disc[:2] + (disc[4] - other) * away
            pairs.append(np.concatenate([first, disc[2:4], [one], second, disc[2:4], [other]]))
    return np.array(pairs)


def find_twins(search: Search, disc: np.ndarray, silhouette: Silhouette | None) -> Twins:
    """How much better two stems inside a disc, (5,) x, y, lx, ly, r, explain the photos than the disc.

    Edges alone are a weak witness: between the leaves that hide a stem from some photos there are enough of them for
    two narrow stems.
    """
    if disc[4] < MIN_SPLIT_M or silhouette is None:
        return NO_TWINS
    edges, null, _, _ = search.data
    settled = search.polish_all([Hypothesis(*[*map(float, disc), 0.0])])[0].vector
    alone = max(_alone(search, disc), _alone(search, settled))
    pairs = halves(disc)
    scores = np.empty(len(pairs))
    _twin_scores(edges, null, disc, pairs, scores)
    best = pairs[np.argsort(-scores, kind="stable")[:MAX_FOLLOWED]].copy()
    reached = np.empty(len(best))
    _twin_polish(edges, null, disc, best, reached)
    first = int(reached.argmax())
    gain = float(reached[first] - alone)
    both = pair_contrast(silhouette, best[first]) > silhouette.contrast(disc)
    return Twins(gain if both else float("nan"), gain / max(alone, 1.0) if gain > MIN_GAIN else 0.0)


def _alone(search: Search, disc: np.ndarray) -> float:
    """Summed log likelihood ratio of a disc, without priors, as :func:`_twin_objective` counts it."""
    return float(seen_sum(search.z(disc)))
