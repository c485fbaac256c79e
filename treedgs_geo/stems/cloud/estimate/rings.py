"""How the points lie about a fitted stem, inwards and outwards: one ring of bark, or bark under a coat, or bark twice.

Their distances from the cone are told apart into two groups (normal distributions) where that is clearly better than
one. A group inside the fitted bark, in most directions, is the stem's own face: leaves, ivy or moss lie outside it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from ...geometry.cone import Cone, fit_cone
from ...geometry.section_kernels import SECTORS

#: Distances that are looked at, m; points that settle it; rounds, or until no middle or spread moves so far, m.
REACH_M, MAX_POINTS, ROUNDS, SETTLED_M = 0.10, 1500, 40, 1e-6
#: First guesses of two groups: their middles in spreads of all, and the inner one's share.
_STARTS = ((-1.0, 1.0, 0.5), (-2.0, 0.3, 0.2), (-3.0, 0.5, 0.1))
#: A group of its own: log likelihood it gains, distance inside the fitted bark, m and in its spreads, from the other
#: group in sums of both spreads, and share of the points.
GAIN, INSIDE_M, INSIDE_SD, APART, SHARES = 12.0, 0.008, 1.5, 1.0, (0.04, 0.6)
#: The inner group is bark under a coat where it is a ring in itself (share, arc, degrees) and sharper than what lies
#: outside it; as sharp as that, the bark is there twice, if so large a share of it is.
COAT_SHARE, COAT_DEG, SHARPER, TWICE_SHARE = 0.05, 225.0, 1.25, 0.12
#: The inner face is looked for by a fit that lets points lie outside but not inside: scale, m, weight of those inside,
#: rounds, and the spread of bark at most, m. It is the stem where it lies so far inside the fitted bark (on the
#: diameter, cm), is seen over so many degrees, and leaves so little inside itself, but the fitted bark so much.
FACE_M, FACE_WEIGHT, FACE_ROUNDS, FACE_CAP_M = 0.012, 3.0, 12, 0.014
FACE_CM, FACE_DEG, FACE_INSIDE, BARK_INSIDE = 1.0, 240.0, 0.04, 0.08
#: Distances count up to so many spreads, those beyond the other number lie inside the bark; so many points show it. A
#: mean direction of these as long as that is one side alone: a scan beside the others, an oval stem's. Furrows of bark
#: are less deep than this, m.
CLIP_SD, BEYOND_SD, INSIDE_POINTS, ONE_SIDED, FURROW_M = 3.0, 2.0, 60, 0.5, 0.018
#: Points that show whether a ring is flat: noise heaps up in the middle, leaves and scans that do not fit do not.
FLAT_POINTS = 300


@dataclass(frozen=True)
class Rings:
    """inner_m: where the inner group lies, m, negative inside the fitted bark. inner_sd, outer_sd: spreads, m.
    share: of the points in it. inner_deg: arc it is seen over; 0 where there is no group of its own."""

    inner_m: float = 0.0
    inner_sd: float = 0.0
    outer_m: float = 0.0
    outer_sd: float = 0.0
    share: float = 0.0
    inner_deg: float = 0.0

    @classmethod
    def of(cls, points: np.ndarray, cone: Cone, window: tuple[float, float]) -> Rings:
        """Of the (N, 3) points in a window of heights."""
        points = points[(points[:, 2] >= window[0]) & (points[:, 2] <= window[1])]
        e = cone.residuals(points)
        near = np.abs(e) < REACH_M
        points, e = points[near], e[near]
        stride = max(len(e) // MAX_POINTS, 1)
        points, e = points[::stride], e[::stride]
        if len(e) < 60:
            return cls()
        spread = max(1.4826 * float(np.median(np.abs(e - np.median(e)))), 0.004)
        one, *_ = _groups(e, np.array([np.median(e)]), spread, np.array([1.0]))
        fits = [
            _groups(e, np.array([low, high]) * spread, 0.7 * spread, np.array([share, 1 - share]))
            for low, high, share in _STARTS
        ]
        two, middle, sd, share, member = max(fits, key=lambda fit: fit[0])
        inner, outer = np.argsort(middle)
        apart = (middle[outer] - middle[inner]) / (sd[0] + sd[1])
        own = two - one > GAIN and middle[inner] < -max(INSIDE_M, INSIDE_SD * sd[inner]) and apart > APART
        if not own or not SHARES[0] <= share[inner] <= SHARES[1]:
            return cls()
        there = np.bincount(cone.sectors(points, SECTORS), member[inner], SECTORS)
        arc = 360.0 / SECTORS * np.count_nonzero(there >= max(1.0, 0.3 * there.mean()))
        return cls(
            float(middle[inner]), float(sd[inner]), float(middle[outer]), float(sd[outer]), float(share[inner]), arc
        )

    @property
    def is_coat(self) -> bool:
        """Bark shows through something rougher outside it."""
        ring, deep = self.inner_deg >= COAT_DEG, self.outer_m - self.inner_m > FURROW_M
        return ring and deep and self.share >= COAT_SHARE and self.outer_sd > SHARPER * self.inner_sd

    @property
    def twice_cm(self) -> float:
        """Diameters of two rings as sharp as one another apart by, cm; 0 = one ring."""
        two = self.share >= TWICE_SHARE and self.inner_deg >= COAT_DEG and not self.is_coat
        return 200 * (self.outer_m - self.inner_m) if two else 0.0


def inner_face(points: np.ndarray, cone: Cone, window: tuple[float, float], floor_m: float) -> Cone | None:
    """The cone of the innermost bark of (N, 3) points in a window of heights; ``None`` where the fitted one is it."""
    points = points[(points[:, 2] >= window[0]) & (points[:, 2] <= window[1])]
    points = points[np.abs(cone.residuals(points)) < 1.5 * REACH_M]
    points = points[:: max(len(points) // MAX_POINTS, 1)]
    if len(points) < 60:
        return None
    face = cone
    for _ in range(FACE_ROUNDS):
        e, turn, t = face.residuals(points), face.azimuths(points), points[:, 2] - face.h_ref
        weight = np.where(e < 0, FACE_WEIGHT, 1 / (1 + (e / FACE_M) ** 2) ** 2)
        c, s = np.cos(turn), np.sin(turn)
        design = np.column_stack([c, s, c * t, s * t, np.ones(len(t))])
        pulled = np.diag([0.01, 0.01, 0.2, 0.2, 0.01])
        dx, dy, lean_x, lean_y, r = np.linalg.solve(
            (design * weight[:, None]).T @ design + pulled, design.T @ (weight * e)
        )
        face = replace(face, x=face.x + dx, y=face.y + dy, dx=face.dx + lean_x, dy=face.dy + lean_y, r=face.r + r)
        if not 0.015 < face.r < 3.0:
            return None
    found = fit_cone(points, face, None, (max(0.015, 2 * floor_m),), floor_m, FACE_CAP_M, taper_sd=0.003)
    if found is None or 200 * (found.r - cone.r) > -FACE_CM:
        return None
    e, limit = found.residuals(points), max(2 * found.sigma, FACE_M)
    on = np.abs(e) < limit
    there = np.bincount(found.sectors(points[on], SECTORS), minlength=SECTORS)
    arc = 360.0 / SECTORS * np.count_nonzero(there >= max(1.0, 0.25 * there.mean()))
    inside = np.mean(e < -limit) <= FACE_INSIDE and np.mean(cone.residuals(points) < -limit) >= BARK_INSIDE
    return found if inside and arc >= FACE_DEG and on.mean() >= COAT_SHARE else None


@dataclass(frozen=True)
class Inside:
    """Points inside a fitted stem, all round. skew_se: how surely the distances from the bark lean inwards, in standard
    errors (NaN: not known). depth_m: how far the points off the bark on its inner side lie inside it.

    Nothing is seen inside wood: noise, drift and a section that is not round scatter points to both sides, twigs and
    leaves to the outside. Distances that lean inwards are bark that shows through what the stem was fitted to.
    """

    skew_se: float = float("nan")
    depth_m: float = 0.0

    @classmethod
    def of(cls, points: np.ndarray, cone: Cone, window: tuple[float, float]) -> Inside:
        """Of the (N, 3) points in a window of heights; points above one another (repeated, on a lattice) count once."""
        points = points[(points[:, 2] >= window[0]) & (points[:, 2] <= window[1])]
        points = points[np.unique(points[:, 0] + 1j * points[:, 1], return_index=True)[1]]
        e, turn = cone.residuals(points), cone.azimuths(points)
        near = np.abs(e) < REACH_M
        e, turn = e[near], turn[near]
        if len(e) < INSIDE_POINTS:
            return cls()
        e = without_waves(e, turn)
        e -= np.median(e)
        spread = max(1.4826 * float(np.median(np.abs(e))), 0.002)
        within = e < -BEYOND_SD * spread
        if not within.any() or np.hypot(np.cos(turn[within]).mean(), np.sin(turn[within]).mean()) > ONE_SIDED:
            return cls(0.0)
        depth_m = -float(e[within].mean())
        if depth_m < FURROW_M:
            return cls(0.0)
        # The third Hermite polynomial: skewness that the middle's own error does not enter. Its error is what chance
        # would make of these distances if each could as well lie on the other side: thick tails are no skewness.
        u = np.clip(e / spread, -CLIP_SD, CLIP_SD)
        skew = 3 * u - u**3
        return cls(float(skew.sum() / np.sqrt((skew**2).sum())), depth_m)


def without_waves(e: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """(N,) distances ``e`` from the bark, in directions ``turn``, without the waves of an oval or three-sided stem."""
    waves = np.column_stack([wave(k * turn) for k in (2, 3) for wave in (np.cos, np.sin)])
    near = np.abs(e) < REACH_M
    return e - waves @ np.linalg.lstsq(waves[near], e[near], rcond=None)[0] if near.sum() > 8 else e


def kurtosis(e: np.ndarray, spread: float) -> float:
    """Excess kurtosis of the (N,) distances from the bark that lie within three spreads; 0 for few of them."""
    core = e[np.abs(e) < 3 * spread]
    return float(np.mean((core - core.mean()) ** 4) / core.var() ** 2 - 3) if len(core) >= FLAT_POINTS else 0.0


@njit(cache=True, nogil=True)
def _groups(e, middle, spread, share):  # pragma: no cover - compiled
    """Log likelihood, middles, spreads, shares and (K, N) memberships of normal groups and an even background (EM)."""
    groups, n = len(middle), len(e)
    middle, sd = middle.copy(), np.full(groups, spread)
    share = np.append(0.98 * share, 0.02)
    member = np.empty((groups + 1, n))
    likelihood = 0.0
    for _ in range(ROUNDS):
        likelihood = 0.0
        for m in range(n):
            total = 0.0
            for k in range(groups):
                off = (e[m] - middle[k]) / sd[k]
                member[k, m] = share[k] * np.exp(-0.5 * off * off) / (sd[k] * np.sqrt(2 * np.pi))
                total += member[k, m]
            member[groups, m] = share[groups] / (2 * REACH_M)
            total += member[groups, m]
            likelihood += np.log(total)
            for k in range(groups + 1):
                member[k, m] /= total
        weight = np.empty(groups + 1)
        for k in range(groups + 1):
            weight[k] = max(member[k].sum(), 1e-9)
        share = weight / weight.sum()
        moved = 0.0
        for k in range(groups):
            before, spread_before = middle[k], sd[k]
            middle[k] = (member[k] * e).sum() / weight[k]
            sd[k] = max(np.sqrt((member[k] * (e - middle[k]) ** 2).sum() / weight[k]), 0.003)
            moved = max(moved, abs(middle[k] - before), abs(sd[k] - spread_before))
        if moved < SETTLED_M:
            break
    return likelihood, middle, sd, share, member
