"""Crops that a fit does not see, and how well it predicts them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .crops import Crop
from .layered_model import ROBUST_SCALE
from .loss import d_ssim, robust_weight

if TYPE_CHECKING:
    from .layered_model import LayeredModel


@dataclass(frozen=True)
class HeldOut:
    """l1: mean absolute colour error, robustly weighted. psnr_db, ssim: of the band, foliage masked."""

    l1: float
    psnr_db: float
    ssim: float


def hold_out(crops: list[Crop]) -> tuple[list[Crop], list[Crop]]:
    """(taught, held out): two crops are held out where there are twelve or more."""
    held = crops[:: max(len(crops) // 2, 6)][:2] if len(crops) >= 12 else []
    return [crop for crop in crops if not any(crop is other for other in held)], held


def _predict(model: LayeredModel, crop: Crop) -> np.ndarray:
    """A held-out crop's prediction at its least-squares exposure."""
    model.gain.setdefault(crop.view, np.ones(3, np.float32))
    composite = model.shown(crop)
    gain = np.einsum("hw,hwc,hwc->c", crop.weight, composite, crop.image) / np.maximum(
        np.einsum("hw,hwc,hwc->c", crop.weight, composite, composite), 1e-6
    )
    return composite * gain.astype(np.float32)


def held_out_error(model: LayeredModel, held: list[Crop]) -> float:
    """Weighted mean absolute colour error of crops that the fit does not see."""
    total = mass = 0.0
    for crop in held:
        if crop.flight not in model.texture:
            continue
        shown = _predict(model, crop)
        error = np.abs(shown - crop.image).mean(axis=-1)
        weight = crop.weight * robust_weight(shown - crop.image, ROBUST_SCALE)
        total, mass = total + float((weight * error).sum()), mass + float(weight.sum())
    return total / mass if mass > 0 else math.nan


def held_out_quality(model: LayeredModel, held: list[Crop]) -> HeldOut | None:
    """Error, PSNR and SSIM over all held-out crops together; None where there are none."""
    square, structure, mass = 0.0, 0.0, 0.0
    for crop in held:
        if crop.flight not in model.texture:
            continue
        shown = np.clip(_predict(model, crop), 0, 1).astype(np.float32)
        weight = float(crop.weight.sum())
        square += float((crop.weight * ((shown - crop.image) ** 2).mean(axis=-1)).sum())
        structure += (1 - 2 * d_ssim(shown, crop.image, crop.weight)[0]) * weight
        mass += weight
    if mass <= 0:
        return None
    return HeldOut(held_out_error(model, held), -10 * math.log10(max(square / mass, 1e-10)), structure / mass)
