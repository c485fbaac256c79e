"""Which pair of edges is the stem: a search over place, lean and radius that lets every view be blind.

Each view scores an edge pair; the score is compared with the same view's scores at random places (null model), and the
views' evidence is summed as a mixture "sees the stem / does not see it", so that hidden views cost nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from scipy.ndimage import maximum_filter

from ....core.machine import FAST
from ...quality.priors import START_TAPER
from ..images.axis_patches import Strips
from ..images.background import Silhouette
from ..images.background_kernels import contrast_of
from ..tuned import PULL
from .pattern_search import DISC_MOVES, disc_step, pattern_search
from .search_kernels import (
    GAIN,
    Edges,
    Null,
    objective,
    polish_many,
    score_many,
    sum_scores,
    table_scores,
    view_z,
)


@dataclass(frozen=True)
class Hypothesis:
    """One explanation, relative to the strips' axis: x, y, r at breast height (m) and extra lean lx, ly (m/m)."""

    x: float
    y: float
    lx: float
    ly: float
    r: float
    score: float

    @property
    def vector(self) -> np.ndarray:
        """(5,) x, y, lx, ly, r."""
        return np.array([self.x, self.y, self.lx, self.ly, self.r])


@dataclass(frozen=True)
class Prior:
    """Where the stem is believed to be, relative to the strips' axis: sds of place (m), lean (m/m), radius (m)."""

    xy_sd: float = 0.15
    lean_sd: float = 0.05
    r: float = 0.14
    r_sd: float = 0.125

    @property
    def row(self) -> np.ndarray:
        """(8,) as the kernels take it."""
        return np.array([0.0, 0.0, 0.0, 0.0, self.xy_sd, self.lean_sd, self.r, self.r_sd])

    def log_density(self, r: np.ndarray) -> np.ndarray:
        """Of radii (N,), m, but for a constant: Student's t with four degrees of freedom, since any stand has stems
        that are not like the others."""
        return -2.5 * np.log1p(((r - self.r) / self.r_sd) ** 2 / 4)


@dataclass(frozen=True)
class Search:
    """A stem's strips made ready for scoring."""

    strips: Strips
    ridge: np.ndarray
    unit: np.ndarray
    terminator: np.ndarray
    null: Null
    prior: Prior
    taper: float = START_TAPER

    @cached_property
    def edges(self) -> Edges:
        """What the compiled kernels take."""
        s, u = self.strips, self.strips.u
        place = float(u[0]), float(u[1] - u[0])
        filled = self.ridge[:, :, ::4].max(axis=2) > 0
        return Edges(self.ridge, self.unit, filled, s.q, s.widen, s.normal, self.terminator, *place, self.taper)

    @property
    def data(self) -> tuple[Edges, Null, np.ndarray, np.ndarray]:
        """What :func:`.search_kernels.objective` scores a vector by."""
        return self.edges, self.null, self.prior.row, np.empty(len(self.ridge))

    def z(self, p: np.ndarray) -> np.ndarray:
        """(V,) z-scores of (x, y, lx, ly, r); -9 where a view shows nothing."""
        out = np.empty(len(self.ridge))
        view_z(self.edges, self.null, np.asarray(p, float), out)
        return out

    def score(self, p: np.ndarray) -> float:
        """Summed LLR with priors."""
        return float(objective(self.data, np.asarray(p, float)))

    def hypotheses(self, reach_m: float = 0.30, n_hypotheses: int = 12) -> list[Hypothesis]:
        """Grid search: the best local maxima over place and radius (2 cm, 1 cm; 9 leans)."""
        radii = self.null.radii
        leans = np.array([(a, b) for a in (0.0, -0.05, 0.05) for b in (0.0, -0.05, 0.05)])
        dc = 0.01
        span = np.ceil(reach_m * 1.42 / dc) * dc
        offsets = np.arange(-span, span + dc / 2, dc)
        table = np.zeros((len(leans), len(self.ridge), len(offsets), len(radii)), np.float32)
        table_scores(self.edges, self.null, leans, offsets, GAIN, table)
        xs = np.arange(-reach_m, reach_m + 0.01, 0.02)
        score = np.full((len(xs), len(xs), len(radii)), -np.inf, np.float32)
        lean = np.zeros(score.shape, np.int64)
        table -= (0.5 * (leans**2).sum(axis=1) / self.prior.lean_sd**2 / max(len(self.ridge), 1))[:, None, None, None]
        sum_scores(table, self.strips.normal, xs, xs, offsets[0], dc, score, lean)
        gx, gy = np.meshgrid(xs, xs)
        score -= 0.5 * ((gx**2 + gy**2) / self.prior.xy_sd**2)[..., None].astype(np.float32)
        score -= (0.5 * ((radii - self.prior.r) / self.prior.r_sd) ** 2).astype(np.float32)
        peaks = np.argwhere((score >= maximum_filter(score, size=(5, 5, 5))) & np.isfinite(score))
        values = score[tuple(peaks.T)]
        order = np.argsort(-values, kind="stable")[:n_hypotheses]
        return [
            Hypothesis(
                float(xs[b]),
                float(xs[a]),
                float(leans[lean[a, b, r]][0]),
                float(leans[lean[a, b, r]][1]),
                float(radii[r]),
                float(score[a, b, r]),
            )
            for a, b, r in peaks[order]
        ]

    def polish_all(self, hypotheses: list[Hypothesis], r_low: list[float] | None = None) -> list[Hypothesis]:
        """Hypotheses refined on the continuous score, in parallel; their radii stay above ``r_low``."""
        starts = np.array([hypothesis.vector for hypothesis in hypotheses]).reshape(-1, 5)
        low = np.maximum(np.zeros(len(hypotheses)) if r_low is None else np.array(r_low), float(self.null.radii[0]))
        best = np.empty(len(hypotheses))
        polish_many(self.edges, self.null, self.prior.row, starts, low, float(self.null.radii[-1]), best)
        return [Hypothesis(*[*map(float, p), float(score)]) for p, score in zip(starts, best, strict=True)]

    def wholes(self, hypothesis: Hypothesis, share: float = 0.45, most: int = 2) -> list[Hypothesis]:
        """Larger explanations that keep one edge of ``hypothesis`` and score at least ``share`` of it, polished.

        The shaded part of a stem alone can score higher than the whole stem; the whole is then one of these.
        """
        growth = np.array([0.016, 0.026, 0.036, 0.046, 0.056, 0.07, 0.085, 0.10, 0.12])
        angle = np.arange(16) * (np.pi / 8)
        step = np.zeros((len(growth), len(angle), 5))
        step[..., 0], step[..., 1], step[..., 4] = np.cos(angle), np.sin(angle), 1.0
        trials = (hypothesis.vector + growth[:, None, None] * step).reshape(-1, 5)
        trials = np.ascontiguousarray(trials[trials[:, 4] <= self.null.radii[-1]])
        scores = np.empty(len(trials))
        score_many(self.edges, self.null, self.prior.row, trials, scores)
        good = scores > share * hypothesis.score
        found = [Hypothesis(*[*map(float, p), float(v)]) for p, v in zip(trials[good], scores[good], strict=True)]
        found.sort(key=lambda m: -m.score)
        kept: list[Hypothesis] = []
        for candidate in found:
            if all(
                np.hypot(candidate.x - k.x, candidate.y - k.y) > 0.03 or abs(candidate.r - k.r) > 0.025 for k in kept
            ):
                kept.append(candidate)
            if len(kept) == most:
                break
        return self.polish_all(kept, [hypothesis.r + 0.009] * len(kept))


def terminators(normal: np.ndarray, sun_azimuth: np.ndarray) -> np.ndarray:
    """Where each view sees the border of light and shade on an upright stem, as a share of the radius along ``normal``.

    normal: (V, 2) horizontal direction across the view. sun_azimuth: (V,) rad counter-clockwise from east, NaN = no
    sun. Returns (V,) in -1..1, 2 where there is no sun.
    """
    border = np.column_stack([-np.sin(sun_azimuth), np.cos(sun_azimuth)])
    view = np.column_stack([normal[:, 1], -normal[:, 0]])  # from the camera to the stem
    facing = -np.sign((border * view).sum(axis=1))
    place = facing * (border * normal).sum(axis=1)
    return np.where(np.isfinite(place), place, 2.0)


def distinct(hypotheses: list[Hypothesis], apart_m: float = 0.03, apart_r: float = 0.015) -> list[Hypothesis]:
    """Best first, without near-copies."""
    kept: list[Hypothesis] = []
    for hypothesis in hypotheses:
        if all(
            np.hypot(hypothesis.x - k.x, hypothesis.y - k.y) > apart_m or abs(hypothesis.r - k.r) > apart_r
            for k in kept
        ):
            kept.append(hypothesis)
    return kept


@njit(**FAST)
def _value(data, p):
    edges, silhouette, pull = data
    return objective(edges, p) + pull * contrast_of(silhouette, p)


@njit(**FAST)
def _move_to_edges(data, p, r_low, r_high):
    """Pattern search over place, lean and radius; p is changed in place."""
    return pattern_search(_value, data, disc_step, DISC_MOVES, p, r_low, r_high, (1.0, 0.5, 0.25), 10)


def moved_to_edges(search: Search, silhouette: Silhouette, chance: float, shape: np.ndarray) -> np.ndarray:
    """(5,) the silhouette ``shape`` moved to where it and the edges are clearest. chance: contrast chance reaches.

    Polished on edges alone (:meth:`Search.polish_all`) a silhouette slides to the strongest pair of edges, which may be
    a lit half. Here both witnesses pull at once, the silhouette much harder."""
    p = np.array(shape, float)
    radii = search.null.radii
    _move_to_edges((search.data, silhouette, PULL / chance), p, float(radii[0]), float(radii[-1]))
    return p
