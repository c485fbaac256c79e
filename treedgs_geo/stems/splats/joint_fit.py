"""Gaussians and a stem primitive in one loop.

The Gaussians of a crop are those before the stem and those behind it, by the plane through the axis across the view
(a Gaussian beside the stem may be either: it covers none of it). Each epoch: Adam on the Gaussians through the mixture
front + T_front (alpha S + (1 - alpha) (behind + T_behind ground)), then Gauss-Newton on the stem and the photos'
shifts, its texture, the ground and the exposures. What the Gaussians explain (twigs, leaves before the bark) no longer
pulls at the edge; what the stem explains, no Gaussian is paid for.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from ..quality.priors import BREAST_HEIGHT_M
from .bands import Volume
from .crops import Crop, GroundPlane
from .field import COLOUR, LOG_SCALE, LOGIT, MEAN, N_PARAMETERS, QUATERNION
from .held_out import HeldOut, held_out_error, held_out_quality, hold_out
from .layered_model import FitSettings, LayeredModel, axis_xy, ground_textures, radius_m
from .optimise import Adam, constrain, decay, learning_rates, relocate
from .primitive.fit import PrimitiveFit, fit_primitive
from .primitive.model import CELL_M, GAMMA, N_ANGLES
from .primitive.views import JointSettings

#: The loop ends when a pass moved the diameter by less than this (cm) and the held-out photos are predicted no better
#: than by this share.
SETTLED_CM, SETTLED_SHARE = 0.1, 0.01
#: Crops averaged in one Adam step.
VIEWS_PER_STEP = 2


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


@dataclass(frozen=True)
class BandFit:
    """A fitted stem in its own frame. parameters: (N, 14). held_out: how well crops that took no part are predicted
    (None where there were too few to hold any out).
    """

    parameters: np.ndarray
    crops: int
    pixels: int
    epochs: int
    pairs: int
    seconds: float
    stopped: str
    held_out: HeldOut | None
    primitive: PrimitiveFit


def initial_parameters(crops: list[Crop], volume: Volume, count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, 14) start: uniform in the volume.

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
    at most ``settings.epochs``, fewer where diameter and held-out photos have settled. bark: most Gaussians that
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
    parameters = initial_parameters(taught, hollow, settings.gaussians, rng)
    model = LayeredModel(taught, plane, parameters, settings, around, primitive, views, joint)
    model.use(taught, {crop.view: crop.camera.fx for crop in crops})
    adam = Adam.start(len(parameters), learning_rates(pixel_m))
    stopped, epochs, dbh, error = "schedule", 0, primitive.dbh_cm, held_out_error(model, held)
    for epoch in range(settings.epochs):
        order = rng.permutation(len(taught))
        for first in range(0, len(order), VIEWS_PER_STEP):
            batch = order[first : first + VIEWS_PER_STEP]
            done = (epoch + first / len(order)) / settings.epochs
            gradient = np.zeros_like(parameters)
            for at in batch:
                model.view_gradient(taught[at], gradient, done)
            adam.step(parameters, gradient / len(batch), decay(done))
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
