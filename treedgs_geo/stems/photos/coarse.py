"""Which pair of edges is the stem: a search over place, lean and radius that lets every view be blind.

Each view scores an edge pair; the score is compared with the same view's scores at random places (null model), and the
views' evidence is summed as a mixture "sees the stem / does not see it", so that hidden views cost nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange

from .strips import Strips

_FAST = {"nogil": True, "cache": True, "fastmath": True}

#: Prior probability that a view sees the stem, and the mean z-score when it does.
SEEN_PRIOR = 0.35
SEEN_MEAN_Z = 2.5
Z_CAP = 8.0
#: Weight of opposite colour gradients on the two sides, and of single edges.
SIGN_WEIGHT = 0.8
SINGLE_WEIGHT = 0.1


@dataclass(frozen=True)
class Null:
    """Scores of edge pairs at random places. mean, sd: (V, R) per view and radius; radii: (R,) metres."""

    radii: np.ndarray
    mean: np.ndarray
    sd: np.ndarray


@dataclass(frozen=True)
class Mode:
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


@njit(**_FAST)
def _pair(e, g, i, j, terminator):
    """Score of the left edge at sample i and the right edge at sample j of one block.

    Opposite colour gradients (dark stem on light ground or the reverse) count more. Equal ones do so only where the
    border of light and shade on the bark lies between them, at ``terminator`` (share of the radius; 2 = unknown), and
    turns the other way: without this the shaded part of a stem alone beats the whole stem.
    """
    dot = g[i, 0] * g[j, 0] + g[i, 1] * g[j, 1] + g[i, 2] * g[j, 2]
    factor = 1.0 - SIGN_WEIGHT * dot
    if dot > 0.1 and terminator < 0.9 and terminator > -0.9 and e[i] * e[j] > 0.01:
        m = int(0.5 * (i + j) + 0.5 * terminator * (j - i) + 0.5)
        best = 0.0
        for k in (m - 2, m - 1, m, m + 1, m + 2):
            if k <= i + 2 or k >= j - 2:
                continue
            turn = -0.5 * (
                g[k, 0] * (g[i, 0] + g[j, 0]) + g[k, 1] * (g[i, 1] + g[j, 1]) + g[k, 2] * (g[i, 2] + g[j, 2])
            )
            if turn * e[k] > best:
                best = turn * e[k]
        factor += 2 * SIGN_WEIGHT * dot * best
    return e[i] * e[j] * factor + SINGLE_WEIGHT * (e[i] + e[j])


@njit(inline="always", **_FAST)
def mixture(z):
    """Log likelihood ratio of one view."""
    z = min(z, Z_CAP)
    return np.log(1.0 - SEEN_PRIOR + SEEN_PRIOR * np.exp(SEEN_MEAN_Z * z - 0.5 * SEEN_MEAN_Z * SEEN_MEAN_Z))


@njit(parallel=True, **_FAST)
def _null_kernel(ridge, unit, terminator, u0, du, centres, radii, total, square, count):
    n_views, n_blocks, n_u = ridge.shape
    for v in prange(n_views):
        blocks = 0
        for b in range(n_blocks):
            filled = False
            for i in range(0, n_u, 4):
                if ridge[v, b, i] > 0:
                    filled = True
                    break
            blocks += filled
        if blocks < n_blocks:
            continue
        for m in range(radii.size):
            for k in range(centres.size):
                i = int((centres[k] - radii[m] - u0) / du + 0.5)
                j = int((centres[k] + radii[m] - u0) / du + 0.5)
                t = 0.0
                for b in range(n_blocks):
                    t += _pair(ridge[v, b], unit[v, b], i, j, terminator[v])
                t /= n_blocks
                total[v, m] += t
                square[v, m] += t * t
        count[v] += centres.size


class NullBuilder:
    """Gathers null scores from strips at random places."""

    def __init__(self, n_views: int, radii: np.ndarray) -> None:
        self.radii = radii
        self._total = np.zeros((n_views, len(radii)))
        self._square = np.zeros((n_views, len(radii)))
        self._count = np.zeros(n_views)

    def add(self, strips: Strips, ridge: np.ndarray, unit: np.ndarray, terminator: np.ndarray) -> None:
        """Add one random place."""
        reach = -strips.u[0] - self.radii.max() - 0.01
        centres = np.arange(-reach, reach + 1e-6, 0.04)
        du = strips.u[1] - strips.u[0]
        total, square = np.zeros_like(self._total), np.zeros_like(self._total)
        count = np.zeros(len(self._count))
        _null_kernel(ridge, unit, terminator, strips.u[0], du, centres, self.radii, total, square, count)
        self._total += total
        self._square += square
        self._count += count

    def finish(self) -> Null:
        """Mean and sd per view and radius; a view with too few places takes those of all views."""
        n = self._count[:, None]
        pooled = max(float(n.sum()), 1.0)
        mean_all = self._total.sum(axis=0) / pooled
        sd_all = np.sqrt(np.maximum(self._square.sum(axis=0) / pooled - mean_all**2, 1e-8))
        enough = n >= 100
        mean = np.where(enough, self._total / np.maximum(n, 1), mean_all)
        variance = self._square / np.maximum(n, 1) - (self._total / np.maximum(n, 1)) ** 2
        sd = np.where(enough, np.sqrt(np.maximum(variance, 1e-8)), sd_all)
        return Null(self.radii, mean, np.maximum(sd, 0.25 * sd_all))


@njit(parallel=True, **_FAST)
def _table_kernel(ridge, unit, q, widen, normal, terminator, leans, u0, du, offsets, radii, taper, mean, sd, table):
    """LLR of every view for every extra lean, sideways offset and radius: table (L, V, C, R)."""
    n_views, n_blocks, n_u = ridge.shape
    for v in prange(n_views):
        valid = np.zeros(n_blocks, np.bool_)
        n_valid = 0
        for b in range(n_blocks):
            for i in range(0, n_u, 4):
                if ridge[v, b, i] > 0:
                    valid[b] = True
                    break
            n_valid += valid[b]
        if n_valid < max(2, n_blocks // 3):
            continue
        for m in range(leans.shape[0]):
            slope = leans[m, 0] * normal[v, 0] + leans[m, 1] * normal[v, 1]
            for k in range(offsets.size):
                for r in range(radii.size):
                    t = 0.0
                    for b in range(n_blocks):
                        if not valid[b]:
                            continue
                        c = offsets[k] + slope * q[b]
                        w = widen[v] * (radii[r] + taper * q[b])
                        i = int((c - w - u0) / du + 0.5)
                        j = int((c + w - u0) / du + 0.5)
                        if i < 0 or j >= n_u or j <= i:
                            continue
                        t += _pair(ridge[v, b], unit[v, b], i, j, terminator[v])
                    table[m, v, k, r] = mixture((t / n_valid - mean[v, r]) / sd[v, r])


@njit(parallel=True, **_FAST)
def _sum_kernel(table, normal, xs, ys, c0, dc, score, best_lean):
    """Sum of the views' LLR on the (x, y, r) grid, best over leans."""
    n_leans, n_views, n_c, n_r = table.shape
    for a in prange(ys.size):
        line = np.empty(n_r, np.float32)
        for b in range(xs.size):
            for m in range(n_leans):
                line[:] = 0.0
                for v in range(n_views):
                    k = int((normal[v, 0] * xs[b] + normal[v, 1] * ys[a] - c0) / dc + 0.5)
                    k = min(max(k, 0), n_c - 1)
                    for r in range(n_r):
                        line[r] += table[m, v, k, r]
                for r in range(n_r):
                    if line[r] > score[a, b, r]:
                        score[a, b, r] = line[r]
                        best_lean[a, b, r] = m


@njit(**_FAST)
def view_z(ridge, unit, q, widen, normal, terminator, u0, du, x, y, lx, ly, radius, taper, radii, mean, sd, z):
    """z-score of one explanation in every view; a view without data gets -9."""
    n_views, n_blocks, n_u = ridge.shape
    step = radii[1] - radii[0]
    for v in range(n_views):
        t = 0.0
        n_valid = 0
        for b in range(n_blocks):
            c = x * normal[v, 0] + y * normal[v, 1] + (lx * normal[v, 0] + ly * normal[v, 1]) * q[b]
            w = widen[v] * (radius + taper * q[b])
            left = (c - w - u0) / du
            right = (c + w - u0) / du
            i = int(left)
            j = int(right)
            if left < 0 or j >= n_u - 1 or right <= left:
                continue
            filled = False
            for k in range(0, n_u, 4):
                if ridge[v, b, k] > 0:
                    filled = True
                    break
            if not filled:
                continue
            n_valid += 1
            a = left - i
            d = right - j
            e, g = ridge[v, b], unit[v, b]
            i2 = i + 1 if a > 0.5 else i
            j2 = j + 1 if d > 0.5 else j
            pair = _pair(e, g, i2, j2, terminator[v]) - SINGLE_WEIGHT * (e[i2] + e[j2])
            el = e[i] * (1 - a) + e[i + 1] * a
            er = e[j] * (1 - d) + e[j + 1] * d
            t += pair * (el * er) / max(e[i2] * e[j2], 1e-9) + SINGLE_WEIGHT * (el + er)
        if n_valid < max(2, n_blocks // 3):
            z[v] = -9.0
            continue
        f = min(max((radius - radii[0]) / step, 0.0), radii.size - 1.001)
        k = int(f)
        f -= k
        z[v] = (t / n_valid - mean[v, k] * (1 - f) - mean[v, k + 1] * f) / (sd[v, k] * (1 - f) + sd[v, k + 1] * f)


@njit(**_FAST)
def _objective(ridge, unit, q, widen, normal, terminator, u0, du, p, taper, radii, mean, sd, z, prior):
    view_z(ridge, unit, q, widen, normal, terminator, u0, du, p[0], p[1], p[2], p[3], p[4], taper, radii, mean, sd, z)
    total = 0.0
    for v in range(z.size):
        if z[v] > -8.9:
            total += mixture(z[v])
    ex = p[0] - prior[0]
    ey = p[1] - prior[1]
    return (
        total
        - 0.5
        * (
            (ex * ex + ey * ey) / (prior[4] * prior[4])
            + ((p[2] - prior[2]) ** 2 + (p[3] - prior[3]) ** 2) / (prior[5] * prior[5])
        )
        - 0.5 * ((p[4] - prior[6]) / prior[7]) ** 2
    )


@njit(**_FAST)
def _polish(ridge, unit, q, widen, normal, terminator, u0, du, p, taper, radii, mean, sd, prior, r_low, r_high):
    """Pattern search over place, lean, radius and "one edge stays" moves; p is changed in place."""
    z = np.empty(ridge.shape[0])
    best = _objective(ridge, unit, q, widen, normal, terminator, u0, du, p, taper, radii, mean, sd, z, prior)
    trial = np.empty(5)
    for scale in (1.0, 0.5, 0.25, 0.12):
        for _ in range(12):
            improved = False
            for move in range(34):
                trial[:] = p
                if move < 24:
                    angle = (move % 8) * np.pi / 4
                    trial[0] += 0.02 * scale * np.cos(angle)
                    trial[1] += 0.02 * scale * np.sin(angle)
                    if move >= 16:
                        trial[4] -= 0.02 * scale
                    elif move >= 8:
                        trial[4] += 0.02 * scale
                elif move < 32:
                    angle = (move - 24) * np.pi / 4
                    trial[2] += 0.02 * scale * np.cos(angle)
                    trial[3] += 0.02 * scale * np.sin(angle)
                elif move == 32:
                    trial[4] += 0.015 * scale
                else:
                    trial[4] -= 0.015 * scale
                if trial[4] < r_low or trial[4] > r_high:
                    continue
                value = _objective(
                    ridge, unit, q, widen, normal, terminator, u0, du, trial, taper, radii, mean, sd, z, prior
                )
                if value > best + 1e-6:
                    best = value
                    p[:] = trial
                    improved = True
            if not improved:
                break
    return best


@dataclass(frozen=True)
class Prior:
    """Where the stem is believed to be, relative to the strips' axis: sds of place (m), lean (m/m), radius (m)."""

    xy_sd: float = 0.15
    lean_sd: float = 0.05
    r: float = 0.14
    r_sd: float = 0.125

    @property
    def row(self) -> np.ndarray:
        return np.array([0.0, 0.0, 0.0, 0.0, self.xy_sd, self.lean_sd, self.r, self.r_sd])


@dataclass(frozen=True)
class Search:
    """A stem's strips made ready for scoring."""

    strips: Strips
    ridge: np.ndarray
    unit: np.ndarray
    terminator: np.ndarray
    null: Null
    prior: Prior
    taper: float = -0.0045

    def _common(self) -> tuple:
        s = self.strips
        return (self.ridge, self.unit, s.q, s.widen, s.normal, self.terminator, float(s.u[0]), float(s.u[1] - s.u[0]))

    def z(self, p: np.ndarray) -> np.ndarray:
        """(V,) z-scores of (x, y, lx, ly, r); -9 where a view shows nothing."""
        out = np.empty(len(self.ridge))
        view_z(*self._common(), *map(float, p), self.taper, self.null.radii, self.null.mean, self.null.sd, out)
        return out

    def score(self, p: np.ndarray) -> float:
        """Summed LLR with priors."""
        out = np.empty(len(self.ridge))
        return float(
            _objective(
                *self._common(),
                np.asarray(p, float),
                self.taper,
                self.null.radii,
                self.null.mean,
                self.null.sd,
                out,
                self.prior.row,
            )
        )

    def modes(self, reach_m: float = 0.30, n_modes: int = 12) -> list[Mode]:
        """Grid search: the best local maxima over place and radius (2 cm, 1 cm; 9 leans)."""
        radii = self.null.radii
        leans = np.array([(a, b) for a in (0.0, -0.05, 0.05) for b in (0.0, -0.05, 0.05)])
        dc = 0.01
        span = np.ceil(reach_m * 1.42 / dc) * dc
        offsets = np.arange(-span, span + dc / 2, dc)
        table = np.zeros((len(leans), len(self.ridge), len(offsets), len(radii)), np.float32)
        ridge, unit, q, widen, normal, terminator, u0, du = self._common()
        _table_kernel(
            ridge,
            unit,
            q,
            widen,
            normal,
            terminator,
            leans,
            u0,
            du,
            offsets,
            radii,
            self.taper,
            self.null.mean,
            self.null.sd,
            table,
        )
        xs = np.arange(-reach_m, reach_m + 0.01, 0.02)
        score = np.full((len(xs), len(xs), len(radii)), -np.inf, np.float32)
        lean = np.zeros(score.shape, np.int64)
        table -= (0.5 * (leans**2).sum(axis=1) / self.prior.lean_sd**2 / max(len(self.ridge), 1))[:, None, None, None]
        _sum_kernel(table, normal, xs, xs, offsets[0], dc, score, lean)
        gx, gy = np.meshgrid(xs, xs)
        score -= 0.5 * ((gx**2 + gy**2) / self.prior.xy_sd**2)[..., None].astype(np.float32)
        score -= (0.5 * ((radii - self.prior.r) / self.prior.r_sd) ** 2).astype(np.float32)
        from scipy.ndimage import maximum_filter

        peaks = np.argwhere((score >= maximum_filter(score, size=(5, 5, 5))) & np.isfinite(score))
        values = score[tuple(peaks.T)]
        order = np.argsort(-values, kind="stable")[:n_modes]
        return [
            Mode(
                float(xs[b]),
                float(xs[a]),
                float(leans[lean[a, b, r]][0]),
                float(leans[lean[a, b, r]][1]),
                float(radii[r]),
                float(score[a, b, r]),
            )
            for a, b, r in peaks[order]
        ]

    def polish(self, mode: Mode, r_low: float = 0.0) -> Mode:
        """Refine a mode on the continuous score; the radius stays above ``r_low``."""
        p = mode.vector
        best = _polish(
            *self._common(),
            p,
            self.taper,
            self.null.radii,
            self.null.mean,
            self.null.sd,
            self.prior.row,
            max(float(self.null.radii[0]), r_low),
            float(self.null.radii[-1]),
        )
        return Mode(*[*map(float, p), float(best)])

    def wholes(self, mode: Mode, share: float = 0.45, most: int = 2) -> list[Mode]:
        """Larger explanations that keep one edge of ``mode`` and score at least ``share`` of it, polished.

        The shaded part of a stem alone can score higher than the whole stem; the whole is then one of these.
        """
        found = []
        for growth in (0.016, 0.026, 0.036, 0.046, 0.056, 0.07, 0.085, 0.10, 0.12):
            for angle in np.arange(16) * (np.pi / 8):
                p = mode.vector + growth * np.array([np.cos(angle), np.sin(angle), 0, 0, 1])
                if p[4] > self.null.radii[-1]:
                    continue
                score = self.score(p)
                if score > share * mode.score:
                    found.append(Mode(*[*map(float, p), score]))
        found.sort(key=lambda m: -m.score)
        kept: list[Mode] = []
        for candidate in found:
            if all(
                np.hypot(candidate.x - k.x, candidate.y - k.y) > 0.03 or abs(candidate.r - k.r) > 0.025 for k in kept
            ):
                kept.append(candidate)
            if len(kept) == most:
                break
        return [self.polish(k, mode.r + 0.009) for k in kept]


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
