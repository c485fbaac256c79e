"""Gaussians and a stem primitive in one loop.

The Gaussians of a crop are those before the stem and those behind it, by the plane through the axis across the view
(a Gaussian beside the stem may be either: it covers none of it). Each epoch: Adam on the Gaussians through the mixture
front + T_front (alpha S + (1 - alpha) (behind + T_behind ground)), then Gauss-Newton on the stem and the photos'
shifts, its texture, the ground and the exposures. What the Gaussians explain (twigs, leaves before the bark) no longer
pulls at the edge; what the stem explains, no Gaussian is paid for.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import cv2
import numpy as np

from ..quality.priors import BREAST_HEIGHT_M
from .bands import Volume
from .crops import Crop, GroundPlane, gather_texture, sample_texture
from .field import COLOUR, LOG_SCALE, LOGIT, MEAN, N_PARAMETERS, QUATERNION
from .loss import d_ssim, l1
from .primitive.fit import PrimitiveExplanation, PrimitiveFit, fit_primitive, fit_shape
from .primitive.model import CELL_M, GAMMA, N_ANGLES
from .primitive.views import JointSettings, Sight, compare, draw, textures
from .splat_fit.band_fit import BandFit, BandModel, FitSettings, ground_textures, initial_parameters
from .splat_fit.controllers import FixedSchedule
from .splat_fit.held_out import held_out_error, held_out_quality, hold_out
from .splat_fit.optimise import Adam, constrain, learning_rates, relocate

#: The loop ends when a pass moved the diameter by less than this (cm) and the held-out photos are predicted no better
#: than by this share.
SETTLED_CM, SETTLED_SHARE = 0.1, 0.01


def axis_xy(shape: np.ndarray, bh_m: float, height_m: np.ndarray) -> np.ndarray:
    """(N, 2) axis at heights above the ground."""
    q = np.asarray(height_m, float) - bh_m
    return shape[:2] + np.outer(q, shape[2:4]) + np.outer(q * q, shape[4:6])


def radius_m(shape: np.ndarray, bh_m: float, height_m: np.ndarray) -> np.ndarray:
    """(N,) radius at heights above the ground."""
    return np.maximum(shape[6] + shape[7] * (np.asarray(height_m, float) - bh_m), 0.005)


@dataclass(frozen=True)
class HollowVolume(Volume):
    """The cylinder without the stem: a Gaussian inside the wood explains nothing."""

    shape: tuple[float, ...] = ()
    bh_m: float = BREAST_HEIGHT_M

    def contains(self, means: np.ndarray) -> np.ndarray:
        """(N,) bool."""
        shape = np.array(self.shape)
        with np.errstate(invalid="ignore", over="ignore"):
            finite = np.where(np.isfinite(means), means, 1e3)
            away = np.hypot(*(finite[:, :2] - axis_xy(shape, self.bh_m, finite[:, 2])).T)
            return super().contains(means) & (away > 0.95 * radius_m(shape, self.bh_m, finite[:, 2]))


class LayeredModel(BandModel):
    """:class:`.stem_fit.StemModel` with a stem between the Gaussians. ``primitive`` is the start and, after each epoch,
    the result."""

    def __init__(
        self,
        crops: list[Crop],
        plane: GroundPlane,
        parameters: np.ndarray,
        settings: FitSettings,
        around: list[Crop],
        primitive: PrimitiveFit,
        views: list[int],
        joint: JointSettings,
    ) -> None:
        """views: the photo that each of the primitive's shifts belongs to."""
        super().__init__(crops, plane, parameters, settings, around)
        self.joint, self.shape = joint, primitive.shape.copy()
        self.sd = np.full(8, np.nan)
        self.shift = dict(zip(views, primitive.shifts, strict=True))
        self._sights: dict[int, Sight] = {}
        self._texture: dict[int, np.ndarray] = {}
        self._common = primitive.texture

    def _scale(self, crop: Crop) -> float:
        return crop.camera.fx / self._full[crop.view]

    def use(self, crops: list[Crop], full: dict[int, float]) -> None:
        """Switch to these crops (another resolution). full: focal length of each photo's full-resolution crop."""
        self.crops, self._full = crops, full
        self._sights = {id(crop): Sight.of(crop, self.texture[crop.flight], self.gain[crop.view]) for crop in crops}
        self._refresh()

    def _refresh(self) -> None:
        sights = list(self._sights.values())
        draw(sights, self.shape, self._shifts(), self.joint.blur_px, self.joint)
        each = textures(sights, self.joint, True)
        compare(sights, each, self.joint)
        each = textures(sights, self.joint, False)
        self._texture = dict(zip(self._sights, each, strict=True))
        self._common = each.mean(axis=0)

    def _shifts(self) -> np.ndarray:
        return np.array([self.shift.get(crop.view, 0.0) * self._scale(crop) for crop in self.crops])

    def _sight(self, crop: Crop) -> tuple[Sight, np.ndarray]:
        """A crop's coverage and texture; held-out crops get theirs on the spot."""
        if id(crop) in self._sights:
            return self._sights[id(crop)], self._texture[id(crop)]
        sight = Sight.of(crop, self.texture[crop.flight])
        draw([sight], self.shape, np.array([self.shift.get(crop.view, 0.0)]), self.joint.blur_px, self.joint)
        return sight, self._common

    def _layers(self, crop: Crop):
        sight, texture = self._sight(crop)
        heights = self.parameters[:, 2]
        view = -crop.camera.centre[:2]
        before = (self.parameters[:, :2] - axis_xy(self.shape, self.joint.bh_m, heights)) @ view < 0
        passes = [self.rasteriser.forward(self.parameters[which], crop.camera) for which in (before, ~before)]
        self.pairs += passes[0].pairs + passes[1].pairs
        ground = np.empty_like(crop.image)
        sample_texture(self.texture[crop.flight], crop.texels, ground)
        front, through = np.moveaxis(passes[0].planes[:3], 0, -1), passes[0].planes[3]
        behind = np.moveaxis(passes[1].planes[:3], 0, -1) + passes[1].planes[3][..., None] * ground
        behind = np.clip(behind, 1e-4, 1)
        sight.front, sight.through = np.ascontiguousarray(front), np.ascontiguousarray(through)
        sight.behind = (behind**GAMMA).astype(np.float32)
        alpha = sight.coverage.alpha[..., None]
        bark = texture[sight.coverage.angle, np.minimum(sight.coverage.level, texture.shape[1] - 1)]
        light = np.maximum(alpha * bark + (1 - alpha) * sight.behind, 1e-6).astype(np.float32)
        lit = light ** np.float32(1 / GAMMA)
        composite = (front + through[..., None] * lit) * self.gain[crop.view]
        return sight, before, passes, ground, behind, light, lit, composite.astype(np.float32)

    def shown(self, crop: Crop, full: bool = False):
        """Forward pass; as the parent's, with the stem."""
        _, _, passes, ground, _, _, _, composite = self._layers(crop)
        return passes[0], ground, composite

    def view_gradient(self, crop: Crop, out: np.ndarray, done: float) -> float:
        """Add one crop's loss gradient to ``out`` (N, 14); returns the loss."""
        settings = self.settings
        sight, before, passes, ground, behind, light, lit, composite = self._layers(crop)
        weight = self.weights(crop, composite, done)
        loss, g = l1(composite, crop.image, weight)
        if settings.ssim > 0:
            structure, g_structure = d_ssim(composite, crop.image, weight)
            loss = (1 - settings.ssim) * loss + settings.ssim * structure
            g = (1 - settings.ssim) * g + settings.ssim * g_structure
        g = g * self.gain[crop.view]
        price = settings.alpha_cost * weight / max(weight.sum(), 1e-6)
        through = passes[0].planes[3][..., None]
        # d lit / d behind (both gamma space): the mixing is in linear light.
        share = (1 - sight.coverage.alpha[..., None]) * light ** (1 / GAMMA - 1) * behind ** (GAMMA - 1)
        g_behind = g * through * share
        for which, done_pass, colour, beyond in ((before, passes[0], g, lit), (~before, passes[1], g_behind, ground)):
            given = np.empty((4, *weight.shape), np.float32)
            given[:3] = np.moveaxis(colour, -1, 0)
            given[3] = price - np.einsum("hwc,hwc->hw", colour, beyond)
            out[which] += self.rasteriser.backward(self.parameters[which], done_pass, given)
        trans = passes[0].planes[3] * passes[1].planes[3] * (sight.coverage.alpha < 0.02)
        residual = (crop.image - composite) / self.gain[crop.view]
        clear = cv2.erode(weight, np.ones((3, 3), np.uint8)) * trans * crop.ground
        gather_texture(
            crop.texels,
            residual.astype(np.float32),
            clear.astype(np.float32),
            self._total[crop.flight],
            self._mass[crop.flight],
        )
        top = np.einsum("hw,hwc,hwc->c", weight, composite, crop.image)
        self._exposure[crop.view] = np.stack([top, np.einsum("hw,hwc,hwc->c", weight, composite, composite)])
        return loss

    def end_epoch(self) -> None:
        """Ground and exposures, then two steps of the stem."""
        super().end_epoch()
        sights = list(self._sights.values())
        for sight in sights:
            sight.gain = self.gain[sight.crop.view]
        blur = self.joint.blur_px
        fitted = fit_shape(
            sights, PrimitiveExplanation(self.shape, self._shifts()), self.joint, [blur, blur], first=False
        )
        self.shape, self.sd = fitted.shape, fitted.sd
        for crop, shift in zip(self.crops, fitted.shifts, strict=True):
            self.shift[crop.view] = shift / self._scale(crop)
        each = textures(sights, self.joint, False)
        self._texture = dict(zip(self._sights, each, strict=True))
        self._common = each.mean(axis=0)

    def result(self, primitive: PrimitiveFit, views: list[int]) -> PrimitiveFit:
        """The primitive as it stands now."""
        shifts = np.array([self.shift.get(view, 0.0) for view in views])
        se = float(np.hypot(200 * self.sd[6], 0.4)) if np.isfinite(self.sd[6]) else primitive.se_cm
        return replace(primitive, shape=self.shape.copy(), shifts=shifts, texture=self._common, se_cm=se)


def surface_gaussians(
    primitive: PrimitiveFit, bh_m: float, low_m: float, high_m: float, spacing_m: float, most: int
) -> np.ndarray:
    """(K, 14) opaque flat Gaussians on the bark of a primitive, coloured by its texture; at most ``most``.

    They are the stem for everything that knows Gaussians only (viewers, sampling). Discs touch a curved surface from
    outside, so each lies deeper by its mean bulge, sigma^2 / 2 r: sampled points then scatter about the bark.
    """
    heights = np.arange(low_m, high_m, spacing_m)
    radius = radius_m(primitive.shape, bh_m, heights)
    while np.maximum(np.ceil(2 * np.pi * radius / spacing_m), 6).sum() > most:
        spacing_m *= 1.1
        heights = np.arange(low_m, high_m, spacing_m)
        radius = radius_m(primitive.shape, bh_m, heights)
    pieces = []
    centre = axis_xy(primitive.shape, bh_m, heights)
    for row, (height, r) in enumerate(zip(heights, radius, strict=True)):
        n = max(int(np.ceil(2 * np.pi * r / spacing_m)), 6)
        angle = (np.arange(n) + 0.5 * (row % 2)) * 2 * np.pi / n
        sigma = 0.55 * min(spacing_m, 2 * np.pi * r / n)
        deep = r - sigma**2 / (2 * r)
        p = np.zeros((n, N_PARAMETERS))
        p[:, MEAN] = np.column_stack(
            [centre[row, 0] + deep * np.cos(angle), centre[row, 1] + deep * np.sin(angle), np.full(n, height)]
        )
        # First axis radial: a turn about the vertical.
        p[:, QUATERNION] = np.column_stack([np.cos(angle / 2), np.zeros(n), np.zeros(n), np.sin(angle / 2)])
        p[:, LOG_SCALE] = np.log([0.002, sigma, 0.55 * spacing_m])
        p[:, LOGIT] = np.log(0.95 / 0.05)
        cell = ((angle / (2 * np.pi)) * N_ANGLES).astype(int) % N_ANGLES
        level = min(int(height / CELL_M), primitive.texture.shape[1] - 1)
        p[:, COLOUR] = np.clip(primitive.texture[cell, max(level, 0)], 0, 1) ** (1 / GAMMA)
        pieces.append(p)
    return np.concatenate(pieces) if pieces else np.zeros((0, N_PARAMETERS))


def fit_with_primitive(
    crops: list[Crop],
    plane: GroundPlane,
    volume: Volume,
    settings: FitSettings,
    pixel_m: float,
    around: list[Crop],
    joint: JointSettings,
    bark: int,
    spread: Callable[..., Iterable] = map,
) -> BandFit | None:
    """One stem: primitive first, then primitive and ``settings.gaussians`` Gaussians together for
    at most ``settings.fine_epochs``, fewer where diameter and held-out photos have settled. bark: most Gaussians that
    the stem itself is written with (0: none). spread: as :func:`~.primitive.fit.fit_primitive` takes it.

    None where no stem stands out at all.
    """
    began = time.perf_counter()
    taught, held = hold_out(crops)
    ground = ground_textures(plane, around, {crop.flight for crop in crops})
    primitive = fit_primitive(taught, plane, ground, joint, spread=spread)
    if primitive is None:
        return None
    rng = np.random.default_rng(settings.seed)
    views = [crop.view for crop in taught]
    hollow = HollowVolume(**vars(volume), shape=tuple(primitive.shape), bh_m=joint.bh_m)
    parameters = initial_parameters(taught, hollow, settings.gaussians, None, rng)
    model = LayeredModel(taught, plane, parameters, settings, around, primitive, views, joint)
    model.use(taught, {crop.view: crop.camera.fx for crop in crops})
    adam, schedule = Adam.start(len(parameters), learning_rates(pixel_m)), FixedSchedule()
    stopped, epochs, dbh, error = "schedule", 0, primitive.dbh_cm, held_out_error(model, held)
    for epoch in range(settings.fine_epochs):
        order = rng.permutation(len(taught))
        for first in range(0, len(order), settings.views_per_step):
            batch = order[first : first + settings.views_per_step]
            done = (epoch + first / len(order)) / settings.fine_epochs
            gradient = np.zeros_like(parameters)
            for at in batch:
                model.view_gradient(taught[at], gradient, done)
            adam.step(parameters, gradient / len(batch), schedule.factors(done))
            constrain(parameters, hollow)
        model.end_epoch()
        hollow = replace(hollow, shape=tuple(model.shape))
        relocate(parameters, adam, hollow, rng)
        epochs, before, dbh, error_before = epoch + 1, dbh, 200 * float(model.shape[6]), error
        error = held_out_error(model, held)
        if abs(dbh - before) < SETTLED_CM and not error < (1 - SETTLED_SHARE) * error_before:
            stopped = "settled"
            break
    quality = held_out_quality(model, held)
    primitive = model.result(primitive, views)
    keep = (
        (1 / (1 + np.exp(-parameters[:, LOGIT])) >= 0.05)
        & hollow.contains(parameters[:, MEAN])
        & np.isfinite(parameters).all(axis=1)
    )
    pieces = [parameters[keep]]
    if bark:
        spacing = max(2.5 * pixel_m, 0.03)
        pieces.append(surface_gaussians(primitive, joint.bh_m, joint.low_m, joint.high_m, spacing, bark))
    return BandFit(
        np.concatenate(pieces),
        len(crops),
        sum(crop.pixels for crop in crops),
        epochs,
        model.pairs,
        time.perf_counter() - began,
        stopped,
        quality,
        primitive,
    )
