"""Fit the stem primitive to its crops: alternating Gauss-Newton, textures and ground; several starts, one winner.

Explanations are ranked by how well each photo is predicted by a texture that the *other* photos painted: a cylinder
that is too thick paints ground onto itself, and only a photo that took no part can show it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from ...quality.findings import Findings
from ...quality.limits import judge
from ...quality.priors import START_TAPER, TAPER_SD
from ..crops import Crop, GroundPlane, halved
from .model import CELL_M, N_SHAPE, StemView, normal_equations
from .search import gather_evidence, starts
from .views import NO_STEM, PrimitiveSettings, Sight, compare, draw, expose, ground_seen, textures

#: Prior means and sds of the shape: place, slope, bend, radius, taper.
PRIOR = np.array([0, 0, 0, 0, 0, 0, 0, START_TAPER])
PRIOR_SD = np.array([0.3, 0.3, 0.05, 0.05, 0.004, 0.004, np.inf, TAPER_SD])


@dataclass
class PrimitiveExplanation:
    """A fitted shape. shifts: (V,) px. loss: leave-one-photo-out mean of rho. sd: formal standard errors of the
    shape."""

    shape: np.ndarray
    shifts: np.ndarray
    loss: float = math.inf
    sd: np.ndarray = field(default_factory=lambda: np.full(N_SHAPE, np.nan))

    @property
    def dbh_cm(self) -> float:
        """Diameter at breast height, cm."""
        return 200 * float(self.shape[6])


def fit_shape(
    sights: list[Sight],
    start: PrimitiveExplanation,
    settings: PrimitiveSettings,
    blurs: list[float],
) -> PrimitiveExplanation:
    """Gauss-Newton from ``start``, one step for each blur; the loss is of the shape before the last step's draw."""
    shape, shifts = start.shape.copy(), start.shifts.copy()
    prior, sd = PRIOR.copy(), PRIOR_SD.copy()
    formal = np.full(N_SHAPE, np.nan)
    noise = settings.noise**2
    for step, blur in enumerate([*blurs, blurs[-1]]):
        draw(sights, shape, shifts, blur, settings)
        texture = textures(sights, settings, step == 0)
        rho, area = compare(sights, texture, settings)
        if step == 0:
            texture = textures(sights, settings, False)
            rho, area = compare(sights, texture, settings)
        expose(sights)
        if step == len(blurs):
            break
        lhs, rhs = np.diag(1 / sd**2), (prior - shape) / sd**2
        rhs[6] = 0.0
        each = []
        for v, s in enumerate(sights):
            h, g = np.zeros((9, 9)), np.zeros(9)
            stem = StemView(shape, settings.bh_m, shifts[v], blur)
            normal_equations(stem, s.lens, s.coverage, texture[v], s.scene, s.composite, settings.sharpness, h, g)
            h = np.tril(h) + np.tril(h, -1).T
            h, g = h / noise, g / noise
            stiff = 1 / settings.shift_sd_px**2
            h[8, 8] += stiff
            g[8] -= shifts[v] * stiff
            each.append((h, g))
            lhs += h[:8, :8] - np.outer(h[:8, 8], h[8, :8]) / h[8, 8]
            rhs += g[:8] - h[:8, 8] * g[8] / h[8, 8]
        damped = lhs + np.diag(1e-2 * np.diag(lhs) + 1e-9)
        move = np.linalg.solve(damped, rhs)
        formal = np.sqrt(np.maximum(np.diag(np.linalg.pinv(lhs)), 0))
        limit = max(0.6 * blur * 0.02, 0.004)
        factor = min(1.0, 2 * limit / max(np.abs(move[:2]).max(), 1e-12), limit / max(abs(move[6]), 1e-12))
        move *= factor
        shape = shape + move
        shape[6] = np.clip(shape[6], 0.015, 0.8)
        shape[2:4] = np.clip(shape[2:4], -0.3, 0.3)
        for v, (h, g) in enumerate(each):
            shifts[v] = np.clip(shifts[v] + (g[8] - h[8, :8] @ move) / h[8, 8], -2, 2)
    return PrimitiveExplanation(shape, shifts, float(rho.sum() / max(area.sum(), 1e-9)), formal)


@dataclass(frozen=True)
class PrimitiveFit:
    """A stem as its crops show it, in the stem frame (origin at the seed, on the ground).

    shape: (8,) of :mod:`.primitive.model`. se_cm: standard error of the diameter, given that the right explanation
    won. n_views: photos that show both edges near breast height. gap: how much worse the next different explanation
    predicts the photos; evidence: how much worse the bare ground does. texture: (A, L, 3) linear-light colours, all
    photos. loss: mean rho.
    """

    shape: np.ndarray
    se_cm: float
    n_views: int
    gap: float
    evidence: float
    loss: float
    texture: np.ndarray

    @property
    def dbh_cm(self) -> float:
        """Diameter at breast height."""
        return 200 * float(self.shape[6])

    @property
    def findings(self) -> Findings:
        """Why its diameter is refused or of low confidence (:mod:`treedgs_geo.stems.quality.limits`)."""
        measured = {"n_views": self.n_views, "gap": self.gap, "evidence": self.evidence, "se_cm": self.se_cm}
        return judge("gaussians", measured, self.dbh_cm)


#: Explanations whose diameters differ less (cm) are one answer.
_SAME_CM = 2.5
#: Different explanations that are fitted at full resolution.
_FINALISTS = 3
_COARSE_BLURS, _FINE_BLURS = [1.3, 1.1, 0.9, 0.7, 0.6, 0.6], [1.0, 0.8, 0.7, 0.6, 0.6, 0.6]


def different(one: PrimitiveExplanation, other: PrimitiveExplanation) -> bool:
    """Not the same local optimum."""
    apart = float(np.hypot(*(one.shape[:2] - other.shape[:2])))
    return apart > 0.02 or abs(one.shape[6] - other.shape[6]) > 0.01


def fit_primitive(
    crops: list[Crop],
    plane: GroundPlane,
    ground: dict[int, np.ndarray],
    settings: PrimitiveSettings | None = None,
    spread: Callable[..., Iterable] = map,
) -> PrimitiveFit | None:
    """Find and fit the stem near the seed.

    crops: full resolution, stem frame. ground: ground texture of each flight. spread: ``map``, or one like it that
    tries several explanations at once. None where nothing stands out at all.
    """
    settings = settings or PrimitiveSettings()
    half = [halved(crop, plane) for crop in crops]
    behind = [ground_seen(crop, ground[crop.flight]) for crop in half]
    sights = [Sight.of(*pair).compared(settings) for pair in zip(half, behind, strict=True)]
    evidence = gather_evidence(half, behind, settings.bh_m)

    def rough(shape: np.ndarray) -> PrimitiveExplanation:
        own = [sight.again() for sight in sights]
        return fit_shape(own, PrimitiveExplanation(shape, np.zeros(len(own))), settings, _COARSE_BLURS)

    tried = list(spread(rough, starts(evidence)))
    kept: list[PrimitiveExplanation] = []
    for item in sorted(tried, key=lambda e: e.loss):
        if all(different(item, other) for other in kept):
            kept.append(item)
    if not kept:
        return None
    fine = [Sight.of(crop, ground_seen(crop, ground[crop.flight])).compared(settings) for crop in crops]

    def closer(item: PrimitiveExplanation) -> PrimitiveExplanation:
        own = [sight.again() for sight in fine]
        return fit_shape(own, PrimitiveExplanation(item.shape, 2 * item.shifts), settings, _FINE_BLURS)

    ended = list(spread(closer, kept[:_FINALISTS]))
    ended.sort(key=lambda e: e.loss)
    best = ended[0]
    rivals = [e.loss for e in ended[1:] if abs(e.dbh_cm - best.dbh_cm) > _SAME_CM]
    nothing = PrimitiveExplanation(NO_STEM, np.zeros(len(fine)))
    bare = _loss_of(fine, nothing, settings)
    loss, texture = _loss_of(fine, best, settings), textures(fine, settings, False)
    return PrimitiveFit(
        best.shape,
        float(np.hypot(200 * best.sd[6], 0.4)),
        clear_views(fine, settings),
        min(rivals) - best.loss if rivals else math.inf,
        bare - loss,
        best.loss,
        texture.mean(axis=0),
    )


def clear_views(sights: list[Sight], settings: PrimitiveSettings) -> int:
    """Photos that show both edges over half a metre or more around breast height."""
    rows = slice(int((settings.bh_m - 0.6) / CELL_M), int((settings.bh_m + 0.6) / CELL_M) + 1)
    return int(sum((np.minimum(*sight.composite.clear[:, rows]) > 0.5).sum() >= 2 for sight in sights))


def _loss_of(sights: list[Sight], explanation: PrimitiveExplanation, settings: PrimitiveSettings) -> float:
    draw(sights, explanation.shape, explanation.shifts, settings.blur_px, settings)
    rho, area = np.zeros(1), np.zeros(1)
    for first in (True, False, False):
        texture = textures(sights, settings, first)
        rho, area = compare(sights, texture, settings)
        expose(sights)
    return float(rho.sum() / max(area.sum(), 1e-9))
