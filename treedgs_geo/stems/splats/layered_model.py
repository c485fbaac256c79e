"""A stem primitive between Gaussians: what its crops should show, and how far off that is.

The Gaussians of a crop are those before the stem and those behind it, by the plane through the axis across the view
(a Gaussian beside the stem may be either: it covers none of it). A pixel is the mixture
front + T_front (alpha S + (1 - alpha) (behind + T_behind ground)).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from .crops import Crop, GroundPlane, gather_texture, median_texture, sample_texture
from .devices import make_rasteriser
from .loss import d_ssim, l1, robust_weight
from .primitive.fit import PrimitiveExplanation, PrimitiveFit, fit_shape
from .primitive.model import GAMMA
from .primitive.views import JointSettings, Sight, compare, draw, textures

#: Share of D-SSIM in the loss; price of covering a pixel, in mean absolute colour: with less, Gaussians explain ground.
SSIM, FOG = 0.1, 0.07
#: Colour error that halves a pixel's weight once the fit has settled; variance of the 2D filter.
ROBUST_SCALE, DILATION_PX2 = 0.12, 0.15


@dataclass(frozen=True)
class FitSettings:
    """Of one stem's fit. gaussians: around the stem. epochs: passes over the crops. device: ``cpu`` or ``cuda``."""

    gaussians: int
    epochs: int
    device: str = "cpu"
    seed: int = 0


def axis_xy(shape: np.ndarray, bh_m: float, height_m: np.ndarray) -> np.ndarray:
    """(N, 2) axis at heights above the ground."""
    q = np.asarray(height_m, float) - bh_m
    return shape[:2] + np.outer(q, shape[2:4]) + np.outer(q * q, shape[4:6])


def radius_m(shape: np.ndarray, bh_m: float, height_m: np.ndarray) -> np.ndarray:
    """(N,) radius at heights above the ground."""
    return np.maximum(shape[6] + shape[7] * (np.asarray(height_m, float) - bh_m), 0.005)


def ground_textures(plane: GroundPlane, around: list[Crop], flights: set[int]) -> dict[int, np.ndarray]:
    """Ground colours of each flight. Shadows move between flights: each with enough crops has a ground of its own."""
    pooled, textures = None, {}
    for flight in sorted(flights):
        own = [crop for crop in around if crop.flight == flight]
        if 6 <= len(own) < len(around):
            textures[flight] = median_texture(plane, own)
        else:
            pooled = median_texture(plane, around) if pooled is None else pooled
            textures[flight] = pooled.copy()
    return textures


class LayeredModel:
    """One stem while it is fitted: Gaussians with a primitive between them, ground, exposures."""

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
        """primitive: the start. views: the photo that each of the primitive's shifts belongs to."""
        self.crops, self.parameters = crops, parameters
        self.rasteriser = make_rasteriser(settings.device, DILATION_PX2)
        self.pairs = 0
        self.gain = {crop.view: np.ones(3, np.float32) for crop in crops}
        self.texture = ground_textures(plane, around, {crop.flight for crop in crops})
        self._reset_sums()
        self.joint, self.shape = joint, primitive.shape.copy()
        self.sd = np.full(8, np.nan)
        self.shift = dict(zip(views, primitive.shifts, strict=True))
        self._sights: dict[int, Sight] = {}
        self._texture: dict[int, np.ndarray] = {}
        self._common = primitive.texture

    def _reset_sums(self) -> None:
        shape = next(iter(self.texture.values())).shape
        self._total = {flight: np.zeros(shape, np.float32) for flight in self.texture}
        self._mass = {flight: np.zeros(shape[:2], np.float32) for flight in self.texture}
        self._exposure: dict[int, np.ndarray] = {}

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

    def shown(self, crop: Crop) -> np.ndarray:
        """(H, W, 3) float32: what the photo should show."""
        return self._layers(crop)[-1]

    def weights(self, crop: Crop, composite: np.ndarray, done: float) -> np.ndarray:
        """Pixel weights: the mask times a robust factor that tightens as the fit settles."""
        scale = ROBUST_SCALE * (3 - 2 * min(done * 2, 1))
        return (crop.weight * robust_weight(composite - crop.image, scale)).astype(np.float32)

    def view_gradient(self, crop: Crop, out: np.ndarray, done: float) -> float:
        """Add one crop's loss gradient to ``out`` (N, 14); returns the loss."""
        sight, before, passes, ground, behind, light, lit, composite = self._layers(crop)
        weight = self.weights(crop, composite, done)
        loss, g = l1(composite, crop.image, weight)
        structure, g_structure = d_ssim(composite, crop.image, weight)
        loss = (1 - SSIM) * loss + SSIM * structure
        g = (1 - SSIM) * g + SSIM * g_structure
        g = g * self.gain[crop.view]
        price = FOG * weight / max(weight.sum(), 1e-6)
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
        """Ground towards what the clear pixels saw and exposures to least squares, then two steps of the stem."""
        for flight, texture in self.texture.items():
            mass = self._mass[flight][..., None]
            texture += 0.7 * self._total[flight] / (mass + 0.5)
            np.clip(texture, 0, 1, out=texture)
        gains = {}
        for view, (top, bottom) in self._exposure.items():
            stiff = 0.5 * bottom.mean() + 1e-6
            gains[view] = np.clip(self.gain[view] * (top + stiff) / (bottom + stiff), 0.6, 1.6).astype(np.float32)
        if gains:
            # Only ratios between photos are known: keep their mean at 1, or field and gains drift apart.
            mean = np.mean(list(gains.values()), axis=0)
            for view, gain in gains.items():
                self.gain[view] = (gain / mean).astype(np.float32)
        self._reset_sums()
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
