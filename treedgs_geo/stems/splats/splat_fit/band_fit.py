"""Fit the Gaussians of one stem band to its crops."""

from __future__ import annotations

import math
import time
from copy import deepcopy
from dataclasses import dataclass

import cv2
import numpy as np

from ..bands import Volume
from ..crops import Crop, GroundPlane, gather_texture, halved, median_texture, sample_texture
from ..devices import make_rasteriser
from ..field import COLOUR, LOG_SCALE, LOGIT, MEAN, N_PARAMETERS, QUATERNION, smoothed, smoothed_backward
from ..loss import d_ssim, l1, normal_consistency, robust_weight
from ..primitive.fit import PrimitiveFit
from .controllers import Controller, make_controller
from .held_out import HeldOut, held_out_error, held_out_quality, hold_out
from .optimise import Adam, constrain, densify, learning_rates, relocate


@dataclass(frozen=True)
class FitSettings:
    """Numbers of one stem fit; ``train.GaussianOptions`` fills them.

    gaussians: the budget. density: relocate (a fixed number, dead ones move) or split (a third at first, then split,
    clone and prune). controller: a name of ``controllers.make_controller``. coarse_epochs run at half resolution,
    fine_epochs at full. views_per_step: crops averaged per Adam step. alpha_cost: price of covering a pixel.
    filter_m: 3D smoothing filter; dilation_px2: 2D filter (variance). binary: weight of the opacities' entropy.
    """

    gaussians: int
    coarse_epochs: int
    fine_epochs: int
    views_per_step: int = 2
    ssim: float = 0.2
    normals: float = 0.0
    alpha_cost: float = 0.05
    relocate_until: float = 0.85
    robust_scale: float = 0.12
    dilation_px2: float = 0.15
    filter_m: float = 0.0
    binary: float = 0.0
    controller: str = "fixed"
    density: str = "relocate"
    device: str = "cpu"
    seed: int = 0


@dataclass(frozen=True)
class BandFit:
    """A fitted stem in its own frame. parameters: (N, 14). held_out: how well crops that took no part are predicted
    (None where there were too few to hold any out). primitive: the stem, where one was fitted.
    """

    parameters: np.ndarray
    crops: int
    pixels: int
    epochs: int
    pairs: int
    seconds: float
    stopped: str
    held_out: HeldOut | None
    primitive: PrimitiveFit | None = None


def initial_parameters(
    crops: list[Crop], volume: Volume, count: int, dense: np.ndarray | None, rng: np.random.Generator
) -> np.ndarray:
    """(count, 14) start: from dense points (K, 3, stem frame) where there are enough, else uniform in the volume.

    Colours are medians over the crops that each centre projects into; sizes follow the spacing.
    """
    p = np.zeros((count, N_PARAMETERS))
    height = volume.high_m - volume.low_m
    radius = 0.9 * volume.radius_m * np.sqrt(rng.random(count))
    angle = 2 * np.pi * rng.random(count)
    p[:, MEAN] = np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle), volume.low_m + height * rng.random(count)]
    )
    size = (np.pi * volume.radius_m**2 * height / max(count, 1)) ** (1 / 3) * 0.4
    if dense is not None and len(dense) >= 50:
        from_points = min(len(dense), count // 2)
        p[:from_points, MEAN] = dense[rng.choice(len(dense), from_points, replace=False)]
    p[:, QUATERNION] = rng.standard_normal((count, 4))
    p[:, QUATERNION] /= np.linalg.norm(p[:, QUATERNION], axis=1, keepdims=True)
    p[:, LOG_SCALE] = math.log(min(max(size, volume.smallest_m), volume.largest_m))
    p[:, LOGIT] = math.log(0.18 / 0.82)
    samples = np.full((count, len(crops), 3), np.nan, np.float32)
    for j, crop in enumerate(crops):
        pixels, _ = crop.camera.project(p[:, MEAN])
        u, v = np.nan_to_num(pixels, nan=-1).T
        inside = (u >= 0) & (v >= 0) & (u < crop.camera.width) & (v < crop.camera.height)
        rows, columns = v[inside].astype(int), u[inside].astype(int)
        samples[inside, j] = np.where(crop.weight[rows, columns, None] > 0.5, crop.image[rows, columns], np.nan)
    found = np.isfinite(samples[..., 0]).any(axis=1)
    p[:, COLOUR] = 0.5
    if found.any():
        p[found, COLOUR] = np.nanmedian(samples[found], axis=1)
    return p


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


class BandModel:
    """Parameters, background and exposure of one stem while it is being fitted."""

    def __init__(
        self,
        crops: list[Crop],
        plane: GroundPlane,
        parameters: np.ndarray,
        settings: FitSettings,
        around: list[Crop],
    ) -> None:
        self.crops, self.plane, self.parameters, self.settings = crops, plane, parameters, settings
        self.rasteriser = make_rasteriser(settings.device, settings.dilation_px2)
        self.pairs, self.fog_factor = 0, 1.0
        self.gain = {crop.view: np.ones(3, np.float32) for crop in crops}
        self.texture = ground_textures(plane, around, {crop.flight for crop in crops})
        self._reset_sums()

    def _reset_sums(self) -> None:
        shape = next(iter(self.texture.values())).shape
        self._total = {flight: np.zeros(shape, np.float32) for flight in self.texture}
        self._mass = {flight: np.zeros(shape[:2], np.float32) for flight in self.texture}
        self._exposure: dict[int, np.ndarray] = {}

    def _drawn(self) -> np.ndarray:
        return smoothed(self.parameters, self.settings.filter_m)

    def shown(self, crop: Crop, full: bool = False):
        """Forward pass, ground behind it and the composite (H, W, 3) with exposure."""
        done = self.rasteriser.forward(self._drawn(), crop.camera, full)
        self.pairs += done.pairs
        ground = np.empty_like(crop.image)
        sample_texture(self.texture[crop.flight], crop.texels, ground)
        composite = (np.moveaxis(done.planes[:3], 0, -1) + done.planes[3][..., None] * ground) * self.gain[crop.view]
        return done, ground, composite

    def weights(self, crop: Crop, composite: np.ndarray, done: float) -> np.ndarray:
        """Pixel weights: the mask times a robust factor that tightens as the fit settles."""
        scale = self.settings.robust_scale * (3 - 2 * min(done * 2, 1))
        return (crop.weight * robust_weight(composite - crop.image, scale)).astype(np.float32)

    def view_gradient(self, crop: Crop, out: np.ndarray, done: float) -> float:
        """Add one crop's loss gradient to ``out`` (N, 14); returns the loss."""
        settings = self.settings
        full = settings.normals > 0 and done > 0.5
        passed, ground, composite = self.shown(crop, full)
        weight = self.weights(crop, composite, done)
        loss, g = l1(composite, crop.image, weight)
        if settings.ssim > 0:
            structure, g_structure = d_ssim(composite, crop.image, weight)
            loss = (1 - settings.ssim) * loss + settings.ssim * structure
            g = (1 - settings.ssim) * g + settings.ssim * g_structure
        g = g * self.gain[crop.view]
        given = np.zeros((8 if full else 4, *weight.shape), np.float32)
        given[:3] = np.moveaxis(g, -1, 0)
        given[3] = -np.einsum("hwc,hwc->hw", g, ground)
        # Fog: a pixel is ground unless a Gaussian in front of it gains more than this in mean absolute colour.
        given[3] += self.fog_factor * settings.alpha_cost * weight / max(weight.sum(), 1e-6)
        if full:
            bent, g_bent = normal_consistency(passed.planes, crop.camera.pixel_rays(), weight)
            given += settings.normals * g_bent
            loss += settings.normals * bent
        drawn = self.rasteriser.backward(self._drawn(), passed, given)
        out += smoothed_backward(self.parameters, settings.filter_m, drawn)
        self._collect(crop, passed.planes, ground, composite, weight)
        return loss

    def _collect(
        self, crop: Crop, planes: np.ndarray, ground: np.ndarray, composite: np.ndarray, weight: np.ndarray
    ) -> None:
        # Ground: weighted least squares of I / gain = C + T B over the epoch, cell by cell.
        trans = planes[3]
        residual = crop.image / self.gain[crop.view] - np.moveaxis(planes[:3], 0, -1) - trans[..., None] * ground
        clear = cv2.erode(weight, np.ones((3, 3), np.uint8)) * trans * crop.ground
        gather_texture(crop.texels, residual, clear, self._total[crop.flight], self._mass[crop.flight])
        top = np.einsum("hw,hwc,hwc->c", weight, composite, crop.image)
        self._exposure[crop.view] = np.stack([top, np.einsum("hw,hwc,hwc->c", weight, composite, composite)])

    def end_epoch(self) -> None:
        """Move the ground towards what the clear pixels saw, and the exposures towards their least-squares gains."""
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


@dataclass
class _Pass:
    """One pass over the crops as controllers see it (``controllers.Phase``)."""

    model: BandModel
    adam: Adam
    volume: Volume
    controller: Controller
    rng: np.random.Generator
    held: list[Crop]
    done: float = 0.0
    share: float = 1.0
    pull: np.ndarray | None = None

    @property
    def knobs(self) -> int:
        """Density: the share densified and how much a split shrinks; with a fixed number of Gaussians, as RLGS does
        there, the price that limits them instead (of fog)."""
        return 2 if self.model.settings.density == "split" else 1

    def run(self, factors: np.ndarray, density: np.ndarray | None = None) -> None:
        """Density (after the first pass), then Adam over all crops in random order, then ground and exposures."""
        model, settings = self.model, self.model.settings
        density = np.ones(self.knobs) if density is None else density
        self._control(density)
        model.fog_factor = float(density[0]) if settings.density == "relocate" else 1.0
        parameters = model.parameters
        pull = np.zeros(len(parameters))
        order = self.rng.permutation(len(model.crops))
        for first in range(0, len(order), settings.views_per_step):
            batch = [model.crops[i] for i in order[first : first + settings.views_per_step]]
            done = self.done + self.share * first / len(order)
            gradient = np.zeros_like(parameters)
            for crop in batch:
                model.view_gradient(crop, gradient, done)
            gradient /= len(batch)
            if settings.binary and done > 0.4:
                # Of o (1 - o): a Gaussian is wood or it is nothing.
                opacity = 1 / (1 + np.exp(-parameters[:, LOGIT]))
                gradient[:, LOGIT] += settings.binary / len(parameters) * opacity * (1 - opacity) * (1 - 2 * opacity)
            pull += np.linalg.norm(gradient[:, MEAN], axis=1)
            self.adam.step(parameters, gradient, self.controller.factors(done) * factors)
            constrain(parameters, self.volume)
        model.end_epoch()
        self.pull = pull

    def _control(self, density: np.ndarray) -> None:
        """Dead Gaussians move, or the field is split, cloned and pruned by the pull of the pass before."""
        model, settings = self.model, self.model.settings
        if self.pull is None or self.done > settings.relocate_until + 1e-9:
            return
        if settings.density == "relocate":
            relocate(model.parameters, self.adam, self.volume, self.rng)
        else:
            model.parameters, self.adam = densify(
                model.parameters,
                self.adam,
                self.pull,
                self.volume,
                settings.gaussians,
                self.rng,
                share=0.1 * float(density[0]),
                shrink=1.6 * float(density[1]),
            )

    def save(self) -> tuple:
        """Everything that running changes."""
        model, adam = self.model, self.adam
        return deepcopy(
            (
                model.parameters,
                model.texture,
                model.gain,
                adam.moment,
                adam.square,
                adam.steps,
                self.rng.bit_generator.state,
                self.pull,
            )
        )

    def restore(self, state: tuple) -> None:
        """Back to a saved state."""
        model, adam = self.model, self.adam
        kept = deepcopy(state)
        model.parameters, model.texture, model.gain, adam.moment, adam.square, adam.steps = kept[:6]
        self.rng.bit_generator.state = kept[6]
        self.pull = kept[7]

    def reward_loss(self) -> float:
        """Of the held-out crops."""
        return held_out_error(self.model, self.held) if self.held else math.nan


def fit_stem(
    crops: list[Crop],
    plane: GroundPlane,
    volume: Volume,
    settings: FitSettings,
    pixel_m: float,
    dense: np.ndarray | None = None,
    controller: Controller | None = None,
    around: list[Crop] | None = None,
) -> BandFit:
    """Fit one stem's Gaussians: half resolution first, then full, dead Gaussians moved every epoch.

    crops: at full resolution, stem frame. pixel_m: footprint of a crop pixel at the stem. dense: (K, 3) points in the
    stem frame. The same input and seed give the same field.
    """
    began = time.perf_counter()
    rng = np.random.default_rng(settings.seed)
    controller = controller or make_controller(settings.controller, settings.seed)
    taught, held = hold_out(crops)
    coarse = [halved(crop, plane) for crop in taught]
    first = settings.gaussians if settings.density == "relocate" else max(settings.gaussians // 3, 1)
    model = BandModel(coarse, plane, initial_parameters(coarse, volume, first, dense, rng), settings, around or coarse)
    passes = _Pass(model, Adam.start(len(model.parameters), learning_rates(pixel_m)), volume, controller, rng, held)
    epochs = settings.coarse_epochs + settings.fine_epochs
    run = 0
    for epoch in range(epochs):
        if epoch >= settings.coarse_epochs:
            model.crops = taught
        passes.done, passes.share = epoch / epochs, 1 / epochs
        stop = controller.phase(passes)
        run = epoch + 1
        if stop and epoch >= settings.coarse_epochs:
            break
    parameters = smoothed(model.parameters, settings.filter_m)
    keep = (
        (1 / (1 + np.exp(-parameters[:, LOGIT])) >= 0.01)
        & volume.contains(parameters[:, MEAN])
        & np.isfinite(parameters).all(axis=1)
    )
    return BandFit(
        parameters[keep],
        len(crops),
        sum(crop.pixels for crop in crops),
        run,
        model.pairs,
        time.perf_counter() - began,
        controller.reason,
        held_out_quality(model, held),
    )
