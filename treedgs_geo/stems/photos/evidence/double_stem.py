"""Two full stems that touch, taken for one: the photos that look along the pair show a narrower stem.

Across the pair the two are one stem as wide as both, and enough such photos fit a disc well; the photos that look along
it then count as not seeing the stem, which costs nothing there (:mod:`.fit.search`). Here the disc is split in two
that stay inside it, in every direction and several proportions. Where the edges of all photos together and the
silhouettes before the ground both speak for two rather than one, the disc is no stem; edges alone flag what is too
thick for one stem of the stand. Two discs inside a round or oval stem show far less than it does from the side.
Own method; figures: ``docs/evidence/photos.md``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from ....core.machine import FAST
from ...quality.limits import bound_of
from ..fit.pattern_search import pattern_search
from ..fit.search import Hypothesis, Search
from ..fit.search_kernels import above_null, edges_between, seen_sum
from ..images.background import Silhouette
from ..images.background_kernels import step_contrast
from ..tuned import APART_SD_M, BEYOND_M, MAX_FOLLOWED, MIN_PART, MIN_SPLIT_M, PAIR_LEAN_SD, PARTS, TOUCH_M

#: Gain by edges alone from which its share of the disc's own score counts (log likelihood units).
MIN_GAIN = bound_of("photos", "twins", "check")
#: Moves of the search over both discs (``_pair_step``).
PAIR_MOVES = 52


class Twins(NamedTuple):
    """Two full stems instead of one disc. gain: of the edges' log likelihood where the silhouettes of all photos stand
    out more, too, NaN elsewhere. share: the gain by edges alone over the disc's own score, 0 below
    :data:`MIN_GAIN`; NaN where nothing is said (thin discs, no silhouettes)."""

    gain: float
    share: float


NO_TWINS = Twins(float("nan"), float("nan"))


@njit(**FAST)
def _pair_view_z(edges, null, p, z):
    """z-score of two stems in every view. p: (10,) x, y, lx, ly, r of the one, then of the other."""
    ridge, unit, valid, q, widen, normal, terminator, u0, du, taper = edges
    n_views, n_blocks, n_u = ridge.shape
    for v in range(n_views):
        nx, ny = normal[v, 0], normal[v, 1]
        t, n_valid, width = 0.0, 0, 0.0
        for b in range(n_blocks):
            if not valid[v, b]:
                continue
            c = p[0] * nx + p[1] * ny + (p[2] * nx + p[3] * ny) * q[b]
            w = widen[v] * (p[4] + taper * q[b])
            low, high = c - w, c + w
            m = p[5] * nx + p[6] * ny + (p[7] * nx + p[8] * ny) * q[b]
            mw = max(p[9] + 0.5 * taper * q[b], 0.006)
            if m - mw < high + TOUCH_M and m + mw > low - TOUCH_M:
                low, high = min(low, m - mw), max(high, m + mw)
            left, right = (low - u0) / du, (high - u0) / du
            if left < 0 or int(right) >= n_u - 1 or right <= left:
                continue
            n_valid += 1
            width += 0.5 * (high - low) / widen[v] - taper * q[b]
            t += edges_between(ridge, unit, v, b, left, right, terminator[v])
        enough = n_valid >= max(2, n_blocks // 3)
        z[v] = above_null(null, v, width / n_valid, t / n_valid) if enough else -9.0


@njit(inline="always", **FAST)
def _pair_step(p, move, scale, trial):
    """One move of :func:`.fit.pattern_search.pattern_search` from the pair ``p`` (10,), into ``trial``."""
    trial[:] = p
    angle = (move % 8) * np.pi / 4
    c, s = np.cos(angle), np.sin(angle)
    if move < 24:  # the first moves; with it grows or shrinks; the second stays with it
        grow = 0.0 if move < 8 else (0.015 * scale if move < 16 else -0.015 * scale)
        trial[0] += 0.015 * scale * c
        trial[1] += 0.015 * scale * s
        trial[4] += grow
    elif move < 32:
        trial[2] += 0.02 * scale * c
        trial[3] += 0.02 * scale * s
    elif move < 40:
        trial[5] += 0.015 * scale * c
        trial[6] += 0.015 * scale * s
    elif move < 44:
        trial[7] += 0.02 * scale * np.cos(2 * angle)
        trial[8] += 0.02 * scale * np.sin(2 * angle)
    elif move < 46:  # about the first
        turn = 0.15 * scale * (1 if move == 44 else -1)
        dx, dy = p[5] - p[0], p[6] - p[1]
        trial[5] = p[0] + np.cos(turn) * dx - np.sin(turn) * dy
        trial[6] = p[1] + np.sin(turn) * dx + np.cos(turn) * dy
    elif move < 48:
        trial[9] += 0.008 * scale * (1 if move == 46 else -1)
    elif move < 50:
        trial[4] += 0.012 * scale * (1 if move == 48 else -1)
    else:  # the outer edges stay, the border between the two moves
        dx, dy = p[5] - p[0], p[6] - p[1]
        shift = 0.012 * scale * (1 if move == 50 else -1) / max(np.sqrt(dx * dx + dy * dy), 1e-6)
        trial[0] += shift * dx
        trial[1] += shift * dy
        trial[4] += 0.012 * scale * (1 if move == 50 else -1)
        trial[5] += shift * dx
        trial[6] += shift * dy
        trial[9] -= 0.012 * scale * (1 if move == 50 else -1)


@njit(**FAST)
def _twin_objective(data, p):
    """Summed log likelihood ratio of two stems, (10,), inside a disc. data: edges, null, disc (5,), scratch (V,)."""
    edges, null, whole, z = data
    for k in range(0, 10, 5):
        part = p[k + 4] / whole[4]
        if part < MIN_PART or part > (1 - MIN_PART):
            return -1e9
        if np.sqrt((p[k] - whole[0]) ** 2 + (p[k + 1] - whole[1]) ** 2) + p[k + 4] > whole[4] + BEYOND_M:
            return -1e9
    _pair_view_z(edges, null, p, z)
    total = seen_sum(z)
    gap = np.sqrt((p[5] - p[0]) ** 2 + (p[6] - p[1]) ** 2) - p[4] - p[9]
    total -= 0.5 * (gap / APART_SD_M) ** 2
    for k in range(0, 10, 5):
        lean = (p[k + 2] - whole[2]) ** 2 + (p[k + 3] - whole[3]) ** 2
        total -= 0.5 * lean / PAIR_LEAN_SD**2
    return total


@njit(parallel=True, **FAST)
def _twin_scores(edges, null, whole, pairs, scores):
    """:func:`_twin_objective` of (M, 10) pairs -> (M,) scores."""
    for m in prange(len(pairs)):
        z = np.empty(edges.ridge.shape[0])
        scores[m] = _twin_objective((edges, null, whole, z), pairs[m])


@njit(parallel=True, **FAST)
def _twin_polish(edges, null, whole, pairs, scores):
    """Pattern search over (M, 10) pairs, side by side; pairs and (M,) scores are changed in place."""
    for m in prange(len(pairs)):
        z = np.empty(edges.ridge.shape[0])
        data = edges, null, whole, z
        low, high = MIN_PART * whole[4], (1 - MIN_PART) * whole[4]
        scores[m] = pattern_search(_twin_objective, data, _pair_step, PAIR_MOVES, pairs[m], low, high, (1.0, 0.5), 6)


@njit(**FAST)
def _contrast(silhouette, p):
    """Contrast of the common silhouette of two stems, (10,), as
    :meth:`.images.background.Silhouette.contrast` is for one."""
    total, u0, qs, normal, widen, blind, taper = silhouette
    result = 0.0
    for v in range(total.shape[0]):
        if blind[v]:
            continue
        nx, ny = normal[v, 0], normal[v, 1]
        for b in range(total.shape[1]):
            q = qs[b]
            c = (p[0] + p[2] * q) * nx + (p[1] + p[3] * q) * ny
            half = widen[v] * max(p[4] + taper * q, 0.015)
            first, last = c - half, c + half
            m = (p[5] + p[7] * q) * nx + (p[6] + p[8] * q) * ny
            w = max(p[9] + 0.5 * taper * q, 0.006)
            if m - w < last + TOUCH_M and m + w > first - TOUCH_M:
                first, last = min(first, m - w), max(last, m + w)
            result += step_contrast(total, v, b, first, last, u0)
    return result


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
    both = _contrast(silhouette, best[first]) > silhouette.contrast(disc)
    return Twins(gain if both else float("nan"), gain / max(alone, 1.0) if gain > MIN_GAIN else 0.0)


def _alone(search: Search, disc: np.ndarray) -> float:
    """Summed log likelihood ratio of a disc, without priors, as :func:`_twin_objective` counts it."""
    return float(seen_sum(search.z(disc)))
