"""A stem and a thinner one that touches it: two discs against one.

Seen across the pair, the two are one silhouette as wide as both; seen along it, the stem alone. A single disc has to
settle for one of them, and its edges then fit half of the photos only. The pair fits all of them. Its edge score is the
same one as in :mod:`.fit.search`, with the left edge of whichever stands further left and the right edge of whichever
stands further right; what it gains over the best single disc is the evidence for the second stem.
Own method; what it gained on stems with and without a companion is in ``docs/evidence/photos.md``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange

from ..fit.pattern_search import pattern_search
from ..fit.search import Hypothesis, Search, distinct
from ..fit.search_kernels import above_null, edges_between, seen_sum
from ..images.axis_patches import StemAxis
from ..images.background import Silhouette
from ..images.background_kernels import step_contrast
from ..tuned import CLEAR_M, MATE_LEAN_SD, MATE_RADII_M, MAX_FOLLOWED, MAX_MATE, THICKEST_M, TOUCH_M, WORTH

_FAST = {"nogil": True, "cache": True, "fastmath": True}
#: Moves of the search over both discs (:func:`pair_step`).
PAIR_MOVES = 52


@njit(**_FAST)
def pair_view_z(edges, null, p, z):
    """z-score of a stem and its companion in every view. p: (10,) x, y, lx, ly, r of the one, then of the other."""
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


@njit(**_FAST)
def _pair_objective(data, p):
    """Summed log likelihood ratio of a pair, (10,)."""
    edges, null, prior, upright, z = data
    if p[9] < TOUCH_M or p[9] > THICKEST_M or p[9] > MAX_MATE * p[4]:
        return -1e9
    pair_view_z(edges, null, p, z)
    total = seen_sum(z)
    total -= 0.5 * ((p[0] - prior[0]) ** 2 + (p[1] - prior[1]) ** 2) / prior[4] ** 2
    total -= 0.5 * ((p[2] - prior[2]) ** 2 + (p[3] - prior[3]) ** 2) / prior[5] ** 2
    total -= 0.5 * ((p[4] - prior[6]) / prior[7]) ** 2
    gap = np.sqrt((p[5] - p[0]) ** 2 + (p[6] - p[1]) ** 2) - p[4] - p[9]
    total -= 0.5 * (gap / TOUCH_M) ** 2
    # A companion stands upright or leans as the stem does, whichever is nearer.
    one = (p[7] - upright[0]) ** 2 + (p[8] - upright[1]) ** 2
    other = (p[7] - p[2]) ** 2 + (p[8] - p[3]) ** 2
    return total - 0.5 * min(one, other) / MATE_LEAN_SD**2


@njit(inline="always", **_FAST)
def pair_step(p, move, scale, trial):
    """One move of :func:`.fit.pattern_search.pattern_search` from the pair ``p`` (10,), into ``trial``."""
    trial[:] = p
    angle = (move % 8) * np.pi / 4
    c, s = np.cos(angle), np.sin(angle)
    if move < 24:  # the stem moves; with it grows or shrinks; the companion stays with it
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
    elif move < 46:  # about the stem
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


@njit(**_FAST)
def _pair_polish(data, p, low, high, scales):
    """Pattern search over both discs; p is changed in place."""
    return pattern_search(_pair_objective, data, pair_step, PAIR_MOVES, p, low, high, scales, 6)


@njit(parallel=True, **_FAST)
def _pair_scores(edges, null, prior, upright, pairs, scores):
    """:func:`_pair_objective` of (M, 10) pairs -> (M,) scores."""
    for m in prange(len(pairs)):
        z = np.empty(edges.ridge.shape[0])
        scores[m] = _pair_objective((edges, null, prior, upright, z), pairs[m])


@njit(parallel=True, **_FAST)
def _pair_polish_many(edges, null, prior, upright, pairs, limits, scales, scores):
    """:func:`_pair_polish` of (M, 10) pairs, side by side; pairs and (M,) scores are changed in place."""
    low, high = limits
    for m in prange(len(pairs)):
        z = np.empty(edges.ridge.shape[0])
        scores[m] = _pair_polish((edges, null, prior, upright, z), pairs[m], low, high, scales)


@dataclass(frozen=True)
class Pair:
    """A stem and its companion. vector: (10,) x, y, lx, ly, r of the stem, then of the companion, relative to the
    strips' axis. score: summed log likelihood ratio with priors. gain: over the best single disc, polished alike."""

    vector: np.ndarray
    score: float
    gain: float

    def mate_row(self, start: StemAxis) -> np.ndarray:
        """(1, 10) of the companion, for :func:`.images.axis_patches.hide_known`."""
        p = self.vector[5:]
        axis = StemAxis(start.p + p[:2], start.s + p[2:4], np.zeros(2), start.ground_z, start.bh_m)
        return np.concatenate([axis.row, [p[4] + TOUCH_M, -0.0022]])[None]


def find_companion(search: Search, start: StemAxis, stems: list[np.ndarray]) -> Pair | None:
    """The best pair made of one of ``stems`` ((5,) vectors) and a companion; None where no companion helps."""
    data = _data(search, start)
    singles = search.polish_all([Hypothesis(*[*map(float, stem), 0.0]) for stem in stems])
    singles = distinct(sorted(singles, key=lambda hypothesis: -hypothesis.score), 0.015, 0.008)[:MAX_FOLLOWED]
    single = max((hypothesis.score for hypothesis in singles), default=0.0)
    owners, pairs = _beside([hypothesis.vector for hypothesis in singles], -start.s)
    scores = np.empty(len(pairs))
    _pair_scores(*data[:4], pairs, scores)
    starts: list[tuple[int, np.ndarray]] = []
    for at in np.argsort(-scores, kind="stable"):
        owner, p = owners[at], pairs[at]
        if len(starts) == MAX_FOLLOWED**2 or scores[at] < WORTH * single:
            break
        # Each single disc gets its turn, from different sides.
        near = [np.hypot(*(p[5:7] - k[5:7])) < 0.05 and abs(p[4] - k[4]) < 0.01 for _, k in starts]
        if any(near) or sum(other == owner for other, _ in starts) == MAX_FOLLOWED:
            continue
        starts.append((owner, p))
    if not starts:
        return None
    limits = float(search.null.radii[0]), float(search.null.radii[-1])
    begun, reached = np.array([p for _, p in starts]), np.empty(len(starts))
    _pair_polish_many(*data[:4], begun, limits, np.array([1.0]), reached)
    best = int(np.argmax(reached))
    if reached[best] < single:
        return None
    vector = begun[best]
    score = float(_pair_polish(data, vector, *limits, np.array([0.5, 0.25])))
    return Pair(vector, score, score - single)


def _beside(stems: list[np.ndarray], upright: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Companions all round stems ((5,) vectors): number of the stem, (M,), and both, (M, 10). upright: (2,) lean of an
    upright stem."""
    owners, pairs = [], []
    turns = np.arange(24) * (np.pi / 12)
    for owner, stem in enumerate(stems):
        for angle, radius in ((a, r) for a in turns for r in MATE_RADII_M):
            away = np.array([np.cos(angle), np.sin(angle)])
            # Beside the disc, or split off from it: the disc itself may be the sum of both.
            for shrink in (0.0, radius):
                thick = stem[4] - shrink
                if radius > MAX_MATE * thick:
                    continue
                place = stem[:2] - shrink * away
                mate = place + (thick + radius) * away
                for lean in (upright, stem[2:4]):
                    owners.append(owner)
                    pairs.append(np.concatenate([place, stem[2:4], [thick], mate, lean, [radius]]))
    return np.array(owners, int), np.array(pairs).reshape(-1, 10)


def crowded(vector: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(V, 2) bool: left and right sides of the thicker stem of a (10,) pair where the other one reaches its edge."""
    across = normal @ (vector[5:7] - vector[:2])
    inside = vector[4] - CLEAR_M
    return np.column_stack([-across + vector[9] > inside, across + vector[9] > inside])


def pair_z(search: Search, vector: np.ndarray) -> np.ndarray:
    """(V,) z-scores of a (10,) pair; -9 where a view shows nothing."""
    out = np.empty(len(search.ridge))
    pair_view_z(search.edges, search.null, vector, out)
    return out


def _data(search: Search, start: StemAxis) -> tuple:
    """What :func:`_pair_objective` scores a pair by."""
    edges, null, prior, scratch = search.data
    return edges, null, prior, -start.s, scratch


def pair_contrast(silhouette: Silhouette, vector: np.ndarray) -> float:
    """Contrast of the common silhouette of a (10,) pair, as :meth:`.images.background.Silhouette.contrast` is for one
    disc."""
    return float(_contrast(silhouette, vector))


@njit(**_FAST)
def _contrast(silhouette, p):
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
