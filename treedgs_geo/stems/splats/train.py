"""From photos and stem seeds to stem primitives, and one Gaussian field of their bark (``docs/analyst/gaussians.md``).

Each stem is a small problem of its own: crops over its band, a tapered primitive, the ground behind it as a texture.
Stems are independent, so they run side by side, and time and memory grow linearly with their number.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.crs import LocalFrame
from ...core.errors import InputError
from ...core.field_stems import read_field_stems
from ...core.progress import Reporter
from ...reconstruction.cameras import View
from .bands import Band, CutPhotos, cut_bands, read_photo
from .crops import ground_textures
from .field import COLOUR, LARGEST_COORDINATE_M, LOG_SCALE, LOGIT, MEAN, N_PARAMETERS, QUATERNION, GaussianField
from .options import GaussianOptions
from .primitive.fit import PrimitiveFit, fit_primitive
from .primitive.model import CELL_M, GAMMA, N_ANGLES, axis_xy, radius_m
from .primitive.views import PrimitiveSettings

#: Opacity of the Gaussians on the bark, and their standard deviation across it, m.
_BARK_OPACITY, _BARK_M = 0.95, 0.002


@dataclass(frozen=True)
class FoundStem:
    """A stem primitive where it stands: ``origin`` (3,) local, its seed on the ground."""

    origin: np.ndarray
    primitive: PrimitiveFit


@dataclass(frozen=True)
class FitReport:
    """What was modelled, for ``run.json``. stems: one dict per seed with crops, pixels, Gaussians, seconds and
    diameter. photos: how many were needed. primitives: fitted stems by seed.
    """

    stems: list[dict]
    photos: int
    warnings: list[str]
    primitives: dict[int, FoundStem]

    @property
    def megapixels(self) -> float:
        """In all crops."""
        return round(sum(stem["pixels"] for stem in self.stems) / 1e6, 3)


def fit_with_report(
    views: Sequence[View],
    frame: LocalFrame,
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    seeds_xy: np.ndarray,
    options: GaussianOptions | None = None,
    reporter: Reporter | None = None,
    load: Callable[[View], np.ndarray] = read_photo,
) -> tuple[GaussianField, FitReport]:
    """Fit a primitive at each seed; the Gaussians of the field lie on their bark.

    views: registered photos, local frame. frame: that frame (only named in messages; the field stays local). ground:
    local x, y arrays -> local ground height, NaN where unknown. seeds_xy: (K, 2) local stem positions, good to a few
    decimetres. load: reads a photo.

    A seed without ground or without a photo that shows its band gets no Gaussians and a warning; the rest go on.

    Raises:
        InputError: no view, no seed, coordinates that are not local, or no seed that could be fitted.
    """
    options, reporter = options or GaussianOptions(), reporter or Reporter()
    seeds = _checked_seeds(views, frame, seeds_xy)
    warnings: list[str] = []
    with reporter.stage("cut crops", 0.0, 0.15):
        bands = cut_bands(views, ground, seeds, options, reporter, warnings, load)
    reporter.info(
        "Foliage is masked by a colour split learned from these photos."
        if bands.rule
        else "No clear colour split between foliage and the rest was found; no pixel is masked by colour."
    )
    with reporter.stage("fit stems", 0.15, 1.0):
        fits = _fit_all(bands, options, reporter)
    blind = [stem for stem in bands.origins if stem not in fits]
    if blind:
        warnings.append(
            f"{len(blind)} of {len(seeds)} stems are shown by no photo well enough and got no Gaussians "
            f"(seeds {', '.join(map(str, blind[:8]))}{', ...' if len(blind) > 8 else ''})."
        )
    for warning in warnings:
        reporter.warn(warning)
    if not fits:
        raise InputError(
            "No stem could be fitted: no photo shows the stem band of any of the "
            f"{len(seeds)} positions; check the positions, the ground model and the photos' overlap."
        )
    found = {stem: FoundStem(bands.origins[stem], fit.primitive) for stem, fit in sorted(fits.items())}
    packed, groups = [], []
    for stem, fit in sorted(fits.items()):
        fit.bark[:, MEAN] += bands.origins[stem]
        packed.append(fit.bark)
        groups.append(np.full(len(fit.bark), stem))
    made = GaussianField.from_packed(np.concatenate(packed), np.concatenate(groups))
    modelled = [{"seed": stem, **fit.modelled} for stem, fit in sorted(fits.items())]
    return made, FitReport(modelled, bands.photos, warnings, found)


def read_seeds(path: Path, frame: LocalFrame) -> np.ndarray:
    """(K, 2) stem positions in the local frame.

    path: as :func:`~treedgs_geo.core.field_stems.read_field_stems` reads it.

    Raises:
        InputError: not readable, without a position of each stem, or not where the photos are.
    """
    found = read_field_stems(path, frame.crs).xy
    local = frame.to_local(np.column_stack([found, np.zeros(len(found))]))[:, :2]
    if np.abs(local).max() > 5000:
        raise InputError(
            f"{path}: stem positions lie {np.abs(local).max() / 1000:.0f} km from the photos; give them in "
            f"{frame.crs.to_string()}."
        )
    return local


def _checked_seeds(views: Sequence[View], frame: LocalFrame, seeds_xy: np.ndarray) -> np.ndarray:
    seeds = np.asarray(seeds_xy, float).reshape(-1, 2)
    if not views:
        raise InputError("There is no registered photo to fit Gaussians to; run reconstruct first.")
    if len(seeds) == 0:
        raise InputError(
            "There is no stem position to fit Gaussians around; give seeds or run the step that finds stems."
        )
    if not np.isfinite(seeds).all() or np.abs(seeds).max() > LARGEST_COORDINATE_M:
        raise InputError(
            f"Stem positions reach {np.abs(seeds).max():.6g}, expected local coordinates within "
            f"{LARGEST_COORDINATE_M:g} m of the frame's origin "
            f"({frame.origin[0]:.0f}, {frame.origin[1]:.0f})."
        )
    return seeds


@dataclass(frozen=True)
class _StemFit:
    """bark: (N, 14) in the stem's own frame. modelled: as :class:`FitReport` has it."""

    primitive: PrimitiveFit
    bark: np.ndarray
    modelled: dict


def _fit_all(bands: CutPhotos, options: GaussianOptions, reporter: Reporter) -> dict[int, _StemFit]:
    """The stems side by side; those without a band or a fit are left out."""

    def work(stem: int) -> tuple[int, _StemFit | None]:
        band = bands.band(stem)
        return stem, None if band is None else _fit_one(band, options, spread)

    fits: dict[int, _StemFit] = {}
    # Explanations of one stem run side by side as well: a last stem alone would leave all but one core idle.
    with ThreadPoolExecutor(options.threads) as parts, ThreadPoolExecutor(options.threads) as pool:
        spread = parts.map if options.threads > 1 else map
        waiting = [pool.submit(work, stem) for stem in bands.origins]
        try:
            for done, future in enumerate(as_completed(waiting), start=1):
                stem, fit = future.result()
                if fit is not None:
                    fits[stem] = fit
                reporter.progress(done / len(waiting), f"stem {done} of {len(waiting)}")
        except BaseException:
            for future in waiting:
                future.cancel()
            raise
    return fits


def _fit_one(band: Band, options: GaussianOptions, spread: Callable[..., Iterable]) -> _StemFit | None:
    began = time.perf_counter()
    settings = PrimitiveSettings(bh_m=options.bh_m, high_m=min(options.band_m - 0.1, 2.9))
    ground = ground_textures(band.plane, band.around, {crop.flight for crop in band.crops})
    primitive = fit_primitive(band.crops, band.plane, ground, settings, spread)
    if primitive is None:
        return None
    spacing_m = max(2.5 * band.pixel_m, 0.03)
    bark = bark_gaussians(primitive, options.bh_m, settings.low_m, settings.high_m, spacing_m, options.gaussians)
    modelled = {
        "crops": len(band.crops),
        "pixels": sum(crop.pixels for crop in band.crops),
        "gaussians": len(bark),
        "seconds": round(time.perf_counter() - began, 2),
        "dbh_cm": round(primitive.dbh_cm, 2),
    }
    return _StemFit(primitive, bark, modelled)


def bark_gaussians(
    primitive: PrimitiveFit, bh_m: float, low_m: float, high_m: float, spacing_m: float, max_count: int
) -> np.ndarray:
    """(K, 14) opaque flat Gaussians on the bark of a primitive, coloured by its texture; at most ``max_count``.

    They are the stem for everything that knows Gaussians only (viewers, sampling). Discs touch a curved surface from
    outside, so each lies deeper by its mean bulge, sigma^2 / 2 r: sampled points then scatter about the bark.
    """
    while True:
        heights = np.arange(low_m, high_m, spacing_m)
        radius = radius_m(primitive.shape, bh_m, heights)
        around = np.maximum(np.ceil(2 * np.pi * radius / spacing_m), 6).astype(int)
        if around.sum() <= max_count:
            break
        spacing_m *= 1.1
    row = np.repeat(np.arange(len(heights)), around)
    height, r, n = heights[row], radius[row], around[row]
    angle = (np.concatenate([np.arange(count) for count in around]) + 0.5 * (row % 2)) * 2 * np.pi / n
    sigma = 0.55 * np.minimum(spacing_m, 2 * np.pi * r / n)
    deep = (r - sigma**2 / (2 * r))[:, None]
    p = np.zeros((len(row), N_PARAMETERS))
    p[:, MEAN] = np.column_stack(
        [axis_xy(primitive.shape, bh_m, height) + deep * np.column_stack([np.cos(angle), np.sin(angle)]), height]
    )
    # First axis radial: a turn about the vertical.
    p[:, QUATERNION] = np.column_stack([np.cos(angle / 2), 0 * angle, 0 * angle, np.sin(angle / 2)])
    p[:, LOG_SCALE] = np.log(np.column_stack([0 * sigma + _BARK_M, sigma, 0 * sigma + 0.55 * spacing_m]))
    p[:, LOGIT] = np.log(_BARK_OPACITY / (1 - _BARK_OPACITY))
    cell = ((angle / (2 * np.pi)) * N_ANGLES).astype(int) % N_ANGLES
    level = np.minimum((height / CELL_M).astype(int), primitive.texture.shape[1] - 1)
    p[:, COLOUR] = np.clip(primitive.texture[cell, level], 0, 1) ** (1 / GAMMA)
    return p
