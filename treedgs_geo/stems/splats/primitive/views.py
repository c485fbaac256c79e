"""Crops made ready for the stem primitive: what they show besides it, and the texture that they paint of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ...quality.priors import BREAST_HEIGHT_M
from ..crops import Crop, sample_texture
from .model import (
    CELL_M,
    GAMMA,
    N_ANGLES,
    Composite,
    Coverage,
    Lens,
    Region,
    StemView,
    Surroundings,
    compose,
    cover,
    gather,
)


@dataclass(frozen=True)
class PrimitiveSettings:
    """How a primitive is compared with its crops.

    bh_m: breast height. blur_px: edge blur of the photos (sd). scale: colour error (RGB norm) at which a pixel loses
    its say. noise: colour sd that balances pixels against priors. shift_sd_px: pose error of a photo across the stem.
    window_m, low_m, high_m: the compared region about the seed. sharpness: exponent on how well an edge's surroundings
    are explained; higher trusts fewer, clearer edges."""

    bh_m: float = BREAST_HEIGHT_M
    blur_px: float = 0.6
    scale: float = 0.2
    noise: float = 0.15
    shift_sd_px: float = 0.3
    window_m: float = 0.45
    low_m: float = 0.3
    high_m: float = 2.9
    sharpness: float = 8.0

    @property
    def region(self) -> Region:
        """The compared pixels."""
        return Region(self.window_m, self.low_m, self.high_m)

    @property
    def rows(self) -> int:
        """Texture rows."""
        return int(math.ceil((self.high_m + 0.3) / CELL_M))


@dataclass
class Sight:
    """One crop made ready. linear, behind: (H, W, 3) float32 linear light, of the photo and of the ground. gain: (3,)
    exposure, fitted along. drawn: which pixels are compared is known."""

    crop: Crop
    linear: np.ndarray
    behind: np.ndarray
    gain: np.ndarray
    lens: Lens
    coverage: Coverage
    composite: Composite
    drawn: bool = False

    @classmethod
    def of(cls, crop: Crop, behind: np.ndarray) -> Sight:
        """behind: (H, W, 3) gamma space, :func:`ground_seen`."""
        camera = crop.camera
        return cls(
            crop,
            linear=(np.clip(crop.image, 0, 1) ** GAMMA).astype(np.float32),
            behind=(np.clip(behind, 0, 1) ** GAMMA).astype(np.float32),
            gain=np.ones(3, np.float32),
            lens=Lens(
                np.ascontiguousarray(camera.rotation, float), np.asarray(camera.centre, float), camera.intrinsics
            ),
            coverage=empty_coverage(crop.image.shape[:2]),
            composite=_empty_composite(crop),
        )

    def again(self) -> Sight:
        """The same for another explanation beside this one."""
        coverage = self.coverage
        if self.drawn:  # which pixels are looked at hangs on no shape
            alpha, edge, angle, level, window = coverage
            coverage = Coverage(alpha.copy(), edge.copy(), angle.copy(), level.copy(), window)
        else:
            coverage = empty_coverage(self.crop.image.shape[:2])
        return replace(self, gain=np.ones(3, np.float32), coverage=coverage, composite=_empty_composite(self.crop))

    def compared(self, settings: PrimitiveSettings) -> Sight:
        """The same with only those rows and columns that hold compared pixels: a fit that reads no others takes a
        third of the time."""
        none = StemView(NO_STEM, settings.bh_m, 0.0, settings.blur_px)
        cover(none, self.lens, settings.region, self.coverage)
        rows, columns = np.nonzero(self.coverage.window)
        if not len(rows):
            return replace(self, drawn=True)
        top, left = int(rows.min()), int(columns.min())
        box = np.s_[top : rows.max() + 1, left : columns.max() + 1]
        crop = self.crop.part(box)
        return replace(
            self,
            crop=crop,
            linear=np.ascontiguousarray(self.linear[box]),
            behind=np.ascontiguousarray(self.behind[box]),
            lens=self.lens._replace(intrinsics=crop.camera.intrinsics),
            coverage=Coverage(*[np.ascontiguousarray(values[box]) for values in self.coverage]),
            composite=_empty_composite(crop),
            drawn=True,
        )

    @property
    def scene(self) -> Surroundings:
        """What the crop shows besides the stem, as the kernels take it."""
        return Surroundings(self.behind, self.gain, self.crop.image, self.crop.weight)


def _empty_composite(crop: Crop) -> Composite:
    return Composite(np.empty_like(crop.image), crop.weight.copy(), np.zeros((2, 64)))


def empty_coverage(shape: tuple[int, ...]) -> Coverage:
    """For a crop of (H, W) pixels."""
    alpha, edge = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    return Coverage(alpha, edge, np.zeros(shape, np.int16), np.zeros(shape, np.int16), np.zeros(shape, np.bool_))


#: A stem too thin to be seen.
NO_STEM = np.array([0, 0, 0, 0, 0, 0, 1e-4, 0.0])


def ground_seen(crop: Crop, texture: np.ndarray) -> np.ndarray:
    """(H, W, 3) float32, gamma space: what a crop shows without the stem. texture: (S, S, 3) of the crop's flight."""
    behind = np.empty_like(crop.image)
    sample_texture(texture, crop.texels, behind)
    return behind


def textures(sights: list[Sight], settings: PrimitiveSettings, first: bool) -> np.ndarray:
    """(V, A, L, 3) linear-light texture that each photo is compared with: painted by the other photos of its flight.

    first: colours are medians over the photos, because nothing is known yet about which pixels to trust.
    """
    n, rows = len(sights), settings.rows
    total = np.zeros((n, N_ANGLES, rows, 3), np.float32)
    mass = np.zeros((n, N_ANGLES, rows), np.float32)
    for v, sight in enumerate(sights):
        weight = sight.crop.weight if first else sight.composite.weight
        linear = sight.linear
        if not first:
            linear = (np.clip(sight.crop.image / sight.gain, 0, 1) ** GAMMA).astype(np.float32)
        gather(sight.coverage, linear, weight, total[v], mass[v])
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


def draw(
    sights: list[Sight], shape: np.ndarray, shifts: np.ndarray, blur_px: float, settings: PrimitiveSettings
) -> None:
    """Fill every sight's coverage and texture cells."""
    for sight, shift in zip(sights, shifts, strict=True):
        stem = StemView(shape, settings.bh_m, shift, blur_px)
        cover(stem, sight.lens, settings.region, sight.coverage, sight.drawn)
        sight.drawn = True


def compare(sights: list[Sight], texture: np.ndarray, settings: PrimitiveSettings) -> tuple[np.ndarray, np.ndarray]:
    """Composite every sight; (V,) sums of rho and of weight."""
    result = np.array(
        [compose(s.coverage, texture[v], s.scene, settings.scale, s.composite) for v, s in enumerate(sights)]
    )
    return result[:, 0], result[:, 1]


def expose(sights: list[Sight]) -> None:
    """Least-squares gain of each photo and channel, held near 1, their mean kept at 1."""
    gains = []
    for s in sights:
        weight = s.composite.weight * s.coverage.window
        base = s.composite.shown / s.gain
        top = np.einsum("hw,hwc,hwc->c", weight, base, s.crop.image)
        bottom = np.einsum("hw,hwc,hwc->c", weight, base, base)
        stiff = 0.5 * bottom.mean() + 1e-6
        gains.append(np.clip((top + stiff) / (bottom + stiff), 0.7, 1.4))
    mean = np.mean(gains, axis=0)
    for s, gain in zip(sights, gains, strict=True):
        s.gain = (gain / mean).astype(np.float32)
