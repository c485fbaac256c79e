"""Fit the stem primitive to its crops: alternating Gauss-Newton, textures and ground; several starts, one winner.

Explanations are ranked by how well each photo is predicted by a texture that the *other* photos painted: a cylinder
that is too thick paints ground onto itself, and only a photo that took no part can tell.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ...trees.limits import Findings, judge
from ...trees.priors import BREAST_HEIGHT_M, START_TAPER, TAPER_SD
from ..crops import Crop, GroundPlane, halved, sample_texture
from ..loss import robust_weight
from .model import CELL_M, GAMMA, N_ANGLES, N_SHAPE, compose, cover, gather, normal_equations
from .search import gather_evidence, starts

#: Prior means and sds of the shape: place, slope, bend, radius, taper.
PRIOR = np.array([0, 0, 0, 0, 0, 0, 0, START_TAPER])
PRIOR_SD = np.array([0.3, 0.3, 0.05, 0.05, 0.004, 0.004, np.inf, TAPER_SD])


@dataclass(frozen=True)
class JointSettings:
    """blur_px: edge blur of the photos (sd). scale: colour error (RGB norm) at which a pixel loses its say.
    noise: colour sd that balances pixels against priors. shift_sd_px: pose error of a photo across the stem. window_m,
    low_m, high_m: the compared region about the seed. sharpness: exponent on how well an edge's surroundings are
    explained; higher trusts fewer, clearer edges."""

    bh_m: float = BREAST_HEIGHT_M
    blur_px: float = 0.6
    scale: float = 0.2
    noise: float = 0.15
    shift_sd_px: float = 0.3
    window_m: float = 0.45
    low_m: float = 0.3
    high_m: float = 2.9
    sharpness: float = 8.0


@dataclass
class Sight:
    """One crop made ready. behind, front, through: what Gaussians and ground show there (see ``stem_model.compose``);
    front and through change while Gaussians are fitted along."""

    crop: Crop
    linear: np.ndarray
    behind: np.ndarray
    front: np.ndarray
    through: np.ndarray
    gain: np.ndarray
    rotation: np.ndarray
    centre: np.ndarray
    intrinsics: np.ndarray
    shown: np.ndarray
    weight: np.ndarray
    alpha: np.ndarray
    edge: np.ndarray
    angle: np.ndarray
    level: np.ndarray
    window: np.ndarray
    clear: np.ndarray
    drawn: bool = False

    @classmethod
    def of(cls, crop: Crop, ground: np.ndarray, gain: np.ndarray | None = None) -> Sight:
        """ground: (S, S, 3) gamma-space ground texture of the crop's flight."""
        return cls.between(crop, *ground_layers(crop, ground), gain)

    @classmethod
    def between(
        cls, crop: Crop, front: np.ndarray, through: np.ndarray, behind: np.ndarray, gain: np.ndarray | None = None
    ) -> Sight:
        """front, through: of what stands before the stem. behind: (H, W, 3) gamma space."""
        shape = crop.image.shape[:2]
        return cls(
            crop,
            (np.clip(crop.image, 0, 1) ** GAMMA).astype(np.float32),
            (np.clip(behind, 0, 1) ** GAMMA).astype(np.float32),
            front,
            through,
            np.ones(3, np.float32) if gain is None else gain,
            np.ascontiguousarray(crop.camera.rotation, float),
            np.asarray(crop.camera.centre, float),
            crop.camera.intrinsics,
            np.empty_like(crop.image),
            crop.weight.copy(),
            np.zeros(shape, np.float32),
            np.zeros(shape, np.float32),
            np.zeros(shape, np.int16),
            np.zeros(shape, np.int16),
            np.zeros(shape, np.bool_),
            np.zeros((2, 64)),
        )


#: What a photo shows without the stem: before it (H, W, 3), the light that this lets pass (H, W), and behind it
#: (H, W, 3); gamma space, float32.
Layers = tuple[np.ndarray, np.ndarray, np.ndarray]


def ground_layers(crop: Crop, texture: np.ndarray) -> Layers:
    """Nothing before the stem, the ground behind it. texture: (S, S, 3) of the crop's flight."""
    behind = np.empty_like(crop.image)
    sample_texture(texture, crop.texels, behind)
    return np.zeros_like(crop.image), np.ones(crop.image.shape[:2], np.float32), behind


@dataclass
class PrimitiveExplanation:
    """A fitted shape. shifts: (V,) px. loss: leave-one-photo-out mean of rho. losses, areas: per photo. sd: formal
    standard errors of the shape. texture: (V, A, L, 3)."""

    shape: np.ndarray
    shifts: np.ndarray
    loss: float = math.inf
    losses: np.ndarray = field(default_factory=lambda: np.zeros(0))
    areas: np.ndarray = field(default_factory=lambda: np.zeros(0))
    sd: np.ndarray = field(default_factory=lambda: np.full(N_SHAPE, np.nan))

    @property
    def dbh_cm(self) -> float:
        return 200 * float(self.shape[6])


def levels(settings: JointSettings) -> int:
    """Texture rows."""
    return int(math.ceil((settings.high_m + 0.3) / CELL_M))


def textures(sights: list[Sight], settings: JointSettings, first: bool) -> np.ndarray:
    """(V, A, L, 3) linear-light texture that each photo is compared with: painted by the other photos of its flight.

    first: colours are medians over the photos, because nothing is known yet about which pixels to trust.
    """
    n, rows = len(sights), levels(settings)
    total = np.zeros((n, N_ANGLES, rows, 3), np.float32)
    mass = np.zeros((n, N_ANGLES, rows), np.float32)
    for v, sight in enumerate(sights):
        weight = sight.crop.weight if first else sight.weight
        linear = sight.linear
        if sight.front.any():
            bare = (sight.crop.image / sight.gain - sight.front) / np.maximum(sight.through[..., None], 0.05)
            linear = (np.clip(bare, 0, 1) ** GAMMA).astype(np.float32)
        elif not first:
            linear = (np.clip(sight.crop.image / sight.gain, 0, 1) ** GAMMA).astype(np.float32)
        gather(sight.alpha, sight.angle, sight.level, sight.window, linear, sight.through, weight, total[v], mass[v])
    flights = np.array([sight.crop.flight for sight in sights])
    counts = {f: int((flights == f).sum()) for f in set(flights.tolist())}
    if min(counts.values()) < 6:
        flights = np.zeros(n, int)
    out = np.empty_like(total)
    for flight in set(flights.tolist()):
        own = np.flatnonzero(flights == flight)
        if first:
            colour = np.where(mass[own, ..., None] > 0.5, total[own] / np.maximum(mass[own, ..., None], 1e-6), np.nan)
            median = _median(colour)
            overall = np.nan_to_num(_median(colour.reshape(-1, 3)), nan=0.1)
            out[own] = np.where(np.isfinite(median), median, overall)
            continue
        all_total, all_mass = total[own].sum(axis=0), mass[own].sum(axis=0)
        rest_total = np.maximum(all_total - total[own], 0)
        rest_mass = np.maximum(all_mass - mass[own], 0)
        near_total = _blurred(rest_total)
        near_mass = _blurred(rest_mass)
        grand = rest_total.sum(axis=(1, 2)) / np.maximum(rest_mass.sum(axis=(1, 2)), 1e-6)[:, None]
        wide = (near_total + 0.5 * grand[:, None, None]) / (near_mass[..., None] + 0.5)
        out[own] = (rest_total + 2.0 * wide) / (rest_mass[..., None] + 2.0)
    return out


def _median(values: np.ndarray) -> np.ndarray:
    """Lower median over the first axis, NaN left out; NaN where nothing is left.

    Not ``np.nanmedian``: it warns there, and warnings cannot be silenced in one thread only.
    """
    ordered = np.sort(values, axis=0)  # NaN last
    middle = np.maximum(np.isfinite(values).sum(axis=0) - 1, 0) // 2
    return np.take_along_axis(ordered, middle[None], axis=0)[0]


def _blurred(values: np.ndarray) -> np.ndarray:
    """Smoothed over one cell around the stem and along it; the sum is kept."""
    return gaussian_filter1d(gaussian_filter1d(values, 1.0, axis=1, mode="wrap"), 1.0, axis=2, mode="nearest")


def draw(sights: list[Sight], shape: np.ndarray, shifts: np.ndarray, blur_px: float, settings: JointSettings) -> None:
    """Fill every sight's coverage and texture cells."""
    for sight, shift in zip(sights, shifts, strict=True):
        cover(
            shape,
            settings.bh_m,
            sight.rotation,
            sight.centre,
            sight.intrinsics,
            shift,
            blur_px,
            settings.window_m,
            settings.low_m,
            settings.high_m,
            sight.alpha,
            sight.edge,
            sight.angle,
            sight.level,
            sight.window,
            sight.drawn,
        )
        sight.drawn = True


def compare(sights: list[Sight], texture: np.ndarray, settings: JointSettings) -> tuple[np.ndarray, np.ndarray]:
    """Composite every sight; (V,) sums of rho and of weight."""
    result = np.array(
        [
            compose(
                s.alpha,
                s.edge,
                s.angle,
                s.level,
                s.window,
                texture[v],
                s.behind,
                s.front,
                s.through,
                s.gain,
                s.crop.image,
                s.crop.weight,
                settings.scale,
                s.shown,
                s.weight,
                s.clear,
            )
            for v, s in enumerate(sights)
        ]
    )
    return result[:, 0], result[:, 1]


def fit_shape(
    sights: list[Sight],
    start: PrimitiveExplanation,
    settings: JointSettings,
    blurs: list[float],
    first: bool = True,
    free_taper: bool = True,
) -> PrimitiveExplanation:
    """Gauss-Newton from ``start``, one step for each blur; the loss is of the shape before the last step's draw."""
    shape, shifts = start.shape.copy(), start.shifts.copy()
    prior, sd = PRIOR.copy(), PRIOR_SD.copy()
    formal = np.full(N_SHAPE, np.nan)
    noise = settings.noise**2
    for step, blur in enumerate([*blurs, blurs[-1]]):
        draw(sights, shape, shifts, blur, settings)
        texture = textures(sights, settings, first and step == 0)
        rho, area = compare(sights, texture, settings)
        if first and step == 0:
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
            normal_equations(
                shape,
                settings.bh_m,
                s.rotation,
                s.centre,
                s.intrinsics,
                shifts[v],
                blur,
                s.alpha,
                s.edge,
                s.angle,
                s.level,
                s.window,
                texture[v],
                s.behind,
                s.through,
                s.gain,
                s.crop.image,
                s.shown,
                s.weight,
                s.clear,
                settings.sharpness,
                h,
                g,
            )
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
    return PrimitiveExplanation(shape, shifts, float(rho.sum() / max(area.sum(), 1e-9)), rho, area, formal)


def expose(sights: list[Sight]) -> None:
    """Least-squares gain of each photo and channel, held near 1, their mean kept at 1."""
    gains = []
    for s in sights:
        weight = s.weight * s.window
        base = s.shown / s.gain
        top = np.einsum("hw,hwc,hwc->c", weight, base, s.crop.image)
        bottom = np.einsum("hw,hwc,hwc->c", weight, base, base)
        stiff = 0.5 * bottom.mean() + 1e-6
        gains.append(np.clip((top + stiff) / (bottom + stiff), 0.7, 1.4))
    mean = np.mean(gains, axis=0)
    for s, gain in zip(sights, gains, strict=True):
        s.gain = (gain / mean).astype(np.float32)


@dataclass(frozen=True)
class PrimitiveFit:
    """A stem as its crops show it, in the stem frame (origin at the seed, on the ground).

    shape: (8,) of ``stem_model``. se_cm: standard error of the diameter, given that the right explanation won. n_views:
    photos that show both edges near breast height. gap: how much worse the next different explanation predicts the
    photos; evidence: how much worse the bare ground does. shifts: (V,) sideways pose errors, px. texture: (A, L, 3)
    linear-light colours, all photos. loss: mean rho. seconds: process time.
    """

    shape: np.ndarray
    se_cm: float
    n_views: int
    gap: float
    evidence: float
    loss: float
    shifts: np.ndarray
    texture: np.ndarray
    seconds: float

    @property
    def dbh_cm(self) -> float:
        """Diameter at breast height."""
        return 200 * float(self.shape[6])

    @property
    def findings(self) -> Findings:
        """Why its diameter is refused or of low confidence (:mod:`treedgs_geo.trees.limits`)."""
        measured = {"n_views": self.n_views, "gap": self.gap, "evidence": self.evidence, "se_cm": self.se_cm}
        return judge("gaussians", measured, self.dbh_cm)


#: Explanations whose diameters differ less (cm) are one answer.
_SAME_CM = 2.5
_COARSE_BLURS, _FINE_BLURS = [1.3, 1.1, 0.9, 0.7, 0.6, 0.6], [1.0, 0.8, 0.7, 0.6, 0.6, 0.6]


def different(one: PrimitiveExplanation, other: PrimitiveExplanation) -> bool:
    """Not the same local optimum."""
    apart = float(np.hypot(*(one.shape[:2] - other.shape[:2])))
    return apart > 0.02 or abs(one.shape[6] - other.shape[6]) > 0.01


def fit_primitive(
    crops: list[Crop],
    plane: GroundPlane,
    ground: dict[int, np.ndarray] | Callable[[Crop], Layers],
    settings: JointSettings | None = None,
    reach_m: float = 0.3,
    finalists: int = 3,
) -> PrimitiveFit | None:
    """Find and fit the stem within ``reach_m`` of the seed.

    crops: full resolution, stem frame. ground: ground texture of each flight; or what a crop shows without the stem,
    where more than the ground is known (Gaussians of the whole scene). None where nothing stands out at all.
    """
    settings = settings or JointSettings()
    began = time.process_time()
    look = ground if callable(ground) else lambda crop: ground_layers(crop, ground[crop.flight])
    half = [halved(crop, plane) for crop in crops]
    sights, unlike = [], []
    for crop in half:
        front, through, behind = look(crop)
        sights.append(Sight.between(crop, front, through, behind))
        bare = front + through[..., None] * behind
        unlike.append(1 - np.sqrt(robust_weight(bare - crop.image, 0.12)))
    evidence = gather_evidence(half, unlike, settings.bh_m)
    tried = []
    for shape in starts(evidence, reach_m, np.arange(0.04, 0.36, 0.02), 5):
        for sight in sights:
            sight.gain = np.ones(3, np.float32)
        tried.append(fit_shape(sights, PrimitiveExplanation(shape, np.zeros(len(sights))), settings, _COARSE_BLURS))
    kept: list[PrimitiveExplanation] = []
    for item in sorted(tried, key=lambda e: e.loss):
        if all(different(item, other) for other in kept):
            kept.append(item)
    if not kept:
        return None
    fine = [Sight.between(crop, *look(crop)) for crop in crops]
    ended = []
    for item in kept[:finalists]:
        for sight in fine:
            sight.gain = np.ones(3, np.float32)
        ended.append(fit_shape(fine, PrimitiveExplanation(item.shape, 2 * item.shifts), settings, _FINE_BLURS))
    ended.sort(key=lambda e: e.loss)
    best = ended[0]
    rivals = [e.loss for e in ended[1:] if abs(e.dbh_cm - best.dbh_cm) > _SAME_CM]
    for sight in fine:
        sight.gain = np.ones(3, np.float32)
    nothing = PrimitiveExplanation(np.array([0, 0, 0, 0, 0, 0, 1e-4, 0.0]), np.zeros(len(fine)))
    bare = _loss_of(fine, nothing, settings)
    loss, texture = _loss_of(fine, best, settings), textures(fine, settings, False)
    return PrimitiveFit(
        best.shape,
        float(np.hypot(200 * best.sd[6], 0.4)),
        clear_views(fine, settings),
        min(rivals) - best.loss if rivals else math.inf,
        bare - loss,
        best.loss,
        best.shifts,
        texture.mean(axis=0),
        time.process_time() - began,
    )


def clear_views(sights: list[Sight], settings: JointSettings) -> int:
    """Photos that show both edges over half a metre or more around breast height."""
    rows = slice(int((settings.bh_m - 0.6) / CELL_M), int((settings.bh_m + 0.6) / CELL_M) + 1)
    return int(sum((np.minimum(*sight.clear[:, rows]) > 0.5).sum() >= 2 for sight in sights))


def _loss_of(sights: list[Sight], explanation: PrimitiveExplanation, settings: JointSettings) -> float:
    draw(sights, explanation.shape, explanation.shifts, settings.blur_px, settings)
    rho, area = np.zeros(1), np.zeros(1)
    for first in (True, False, False):
        texture = textures(sights, settings, first)
        rho, area = compare(sights, texture, settings)
        expose(sights)
    return float(rho.sum() / max(area.sum(), 1e-9))
