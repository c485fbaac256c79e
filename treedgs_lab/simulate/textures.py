"""Litter and bark: colour images with detail from metres down to one or two pixels of the photos.

Stored as uint8 square roots of linear albedo: fine steps where it is dark.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter

from treedgs_geo.core.errors import InputError

#: Linear albedo of needle litter and of moss.
LITTER_RGB = np.array([0.30, 0.205, 0.125], np.float32)
MOSS_RGB = np.array([0.20, 0.24, 0.09], np.float32)


@dataclass(frozen=True)
class GroundTexture:
    """colour: (n, n, 3) uint8 RGB, root-encoded; texel (i, j) covers low + j step .. along x and i along y."""

    low: float
    step: float
    colour: np.ndarray


def read_photographs(folder: Path, expected: str) -> list[np.ndarray]:
    """(h, w, 3 or 4) uint8 RGB of each photograph in a folder, by name, with its transparency where it has one.

    Raises:
        InputError: none is there. expected: what it should hold.
    """
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in (".jpg", ".jpeg", ".png"))
    photos = []
    for path in paths:
        photo = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        if photo is not None and (photo.shape[2:] != (4,) or photo.dtype != np.uint8):
            photo = cv2.imread(str(path))
        if photo is not None:
            photos.append(photo)
    if not photos:
        raise InputError(f"{folder}: holds no photograph, expected {expected} (.jpg, .png); add some.")
    return [photo[..., [2, 1, 0, 3][: photo.shape[2]]] for photo in photos]


def encode(albedo: np.ndarray) -> np.ndarray:
    """Linear albedo 0..1 -> uint8 root code."""
    return np.clip(255 * np.sqrt(np.clip(albedo, 0, 1)) + 0.5, 0, 255).astype(np.uint8)


def _noise(rng: np.random.Generator, n: int, wavelength: float) -> np.ndarray:
    """(n, n) float32 noise of unit spread with the given wavelength in texels (upsampled from a coarse grid)."""
    coarse = max(4, int(np.ceil(n / max(wavelength / 2, 1))) + 3)
    image = cv2.resize(rng.standard_normal((coarse, coarse), dtype=np.float32), (n, n), interpolation=cv2.INTER_CUBIC)
    return image / image.std()


def litter(rng: np.random.Generator, half_m: float, step_m: float = 0.011) -> GroundTexture:
    """Needle litter, leaves, twigs, bare soil and cones over a square of ``half_m``."""
    n = int(np.ceil(2 * half_m / step_m))
    tone = (
        0.16 * _noise(rng, n, 3.0 / step_m)
        + 0.13 * _noise(rng, n, 0.7 / step_m)
        + 0.13 * _noise(rng, n, 0.16 / step_m)
        + 0.15 * _noise(rng, n, 0.05 / step_m)
        + 0.14 * rng.standard_normal((n, n), dtype=np.float32)
    )
    tone = np.exp(1.15 * tone)
    moss = np.clip(_noise(rng, n, 1.4 / step_m) - 1.1, 0, 1)
    image = np.empty((n, n, 3), np.uint8)
    # A channel at a time: wide surveys have 80 million texels.
    for channel, (warm, green) in enumerate(zip(LITTER_RGB, MOSS_RGB, strict=True)):
        colour = warm * tone
        colour += moss * (green - colour) * 0.7
        image[..., channel] = encode(colour)
    area = (2 * half_m) ** 2
    # Leaves and bits of bark: 2-7 cm, light and dark. Needles and twigs: thin streaks.
    count = int(90 * area)
    centre = rng.integers(0, n * 16, (count, 2))
    size = np.clip(rng.lognormal(np.log(0.021), 0.5, (count, 2)), 0.008, 0.06) / step_m
    angle = rng.uniform(0, 180, count)
    shade = np.where(rng.random(count) < 0.62, rng.uniform(0.42, 0.80, count), rng.uniform(0.04, 0.12, count))
    tint = np.array([1.0, 0.80, 0.58]) + rng.normal(0, 0.09, (count, 3))
    bits = encode(shade[:, None] * tint).tolist()
    for k in range(count):
        axes = (int(size[k, 0] * 16) + 4, int(size[k, 1] * 10) + 4)
        middle = int(centre[k, 0]), int(centre[k, 1])
        cv2.ellipse(image, middle, axes, float(angle[k]), 0, 360, bits[k], -1, cv2.LINE_AA, 4)
    count = int(28 * area)
    start = rng.integers(0, n * 16, (count, 2))
    heading, length = rng.uniform(0, 2 * np.pi, count), rng.uniform(0.06, 0.30, count) / step_m * 16
    end = (start + length[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])).astype(int)
    streaks = encode(rng.uniform(0.10, 0.62, count)[:, None] * np.array([1.0, 0.80, 0.60])).tolist()
    for k in range(count):
        cv2.line(image, tuple(map(int, start[k])), tuple(map(int, end[k])), streaks[k], 1, cv2.LINE_AA, 4)
    return GroundTexture(-n * step_m / 2, step_m, image)


def bark(rng: np.random.Generator, width: int = 512, height: int = 1024) -> np.ndarray:
    """(height, width, 3) uint8 root code, periodic both ways: plates, furrows between them, lichen; 5 mm a texel."""
    relief = np.zeros((height, width), np.float32)
    for sigma, share in (((16, 7), 0.8), ((7, 4), 1.0), ((2.2, 1.4), 0.45), ((0.8, 0.7), 0.25)):
        field = gaussian_filter(rng.standard_normal((height, width), dtype=np.float32), sigma, mode="wrap")
        relief += share * field / field.std()
    relief /= relief.std()
    tone = 0.115 * np.exp(0.80 * np.clip(relief, -1.9, 2.0))
    colour = tone[..., None] * np.array([1.0, 0.83, 0.72], np.float32)
    lichen = gaussian_filter(rng.standard_normal((height, width), dtype=np.float32), 5, mode="wrap")
    lichen = np.clip(lichen / lichen.std() - 1.7, 0, 1)[..., None]
    colour += lichen * (np.array([0.34, 0.36, 0.31], np.float32) - colour) * 0.6
    return encode(colour)
