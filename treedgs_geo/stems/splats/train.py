"""From photos and stem seeds to one Gaussian field of the stem band (``docs/analyst/gaussians.md``).

The paper optimises the whole forest on a large GPU. Here each stem is a small problem of its own: crops over its band,
a tapered primitive among Gaussians in a cylinder, the ground behind it as a texture. Stems are independent, so they run
side by side, and time and memory grow linearly with their number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field

import numpy as np

from ...core.crs import LocalFrame
from ...core.errors import InputError
from ...core.progress import Reporter
from ...core.seeding import own_seed
from ...reconstruction.cameras import View
from .bands import Band, CutPhotos, cut_bands, read_photo
from .crops import FoliageRule
from .field import LARGEST_COORDINATE_M, MEAN, GaussianField, merge_fields
from .joint_fit import BandFit, fit_with_primitive
from .layered_model import FitSettings
from .options import GaussianOptions
from .primitive.fit import PrimitiveFit
from .primitive.views import JointSettings


@dataclass(frozen=True)
class FitReport:
    """What was modelled, for ``run.json``. stems: one dict per seed with crops, pixels, Gaussians, seconds and why it
    stopped. primitives: fitted stems by seed.
    """

    stems: list[dict]
    photos: int = 0
    megapixels: float = 0.0
    pairs: int = 0
    foliage: FoliageRule | None = None
    warnings: list[str] = field(default_factory=list)
    primitives: dict[int, FoundStem] = field(default_factory=dict)


@dataclass(frozen=True)
class FoundStem:
    """A stem primitive where it stands: ``origin`` (3,) local, its seed on the ground."""

    origin: np.ndarray
    primitive: PrimitiveFit


def fit_with_report(
    views: Sequence[View],
    frame: LocalFrame,
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    seeds_xy: np.ndarray,
    options: GaussianOptions | None = None,
    reporter: Reporter | None = None,
    load: Callable[[View], np.ndarray] = read_photo,
) -> tuple[GaussianField, FitReport]:
    """Fit a field of the stem band around seeds.

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
    return _merged(bands, fits), _report(bands, fits, warnings)


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


def _fit_all(bands: CutPhotos, options: GaussianOptions, reporter: Reporter) -> dict[int, BandFit]:
    """The stems side by side; those without a band or a fit are left out."""
    share = max(options.max_gaussians // max(len(bands.origins), 1), 10)

    def work(stem: int) -> tuple[int, BandFit | None]:
        band = bands.band(stem)
        origin = bands.origins[stem]
        return stem, None if band is None else _fit_one(origin, band, options, share, spread)

    fits: dict[int, BandFit] = {}
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


def _merged(bands: CutPhotos, fits: dict[int, BandFit]) -> GaussianField:
    """One field, local frame, of the stems' own."""
    pieces = []
    for stem in sorted(fits):
        parameters = fits[stem].parameters.copy()
        parameters[:, MEAN] += bands.origins[stem]
        pieces.append(GaussianField.from_packed(parameters, stem))
    return merge_fields(pieces)


def _report(bands: CutPhotos, fits: dict[int, BandFit], warnings: list[str]) -> FitReport:
    found = {stem: FoundStem(bands.origins[stem], fit.primitive) for stem, fit in fits.items()}
    return FitReport(
        stems=[_modelled(stem, fit) for stem, fit in sorted(fits.items())],
        photos=bands.photos,
        megapixels=round(sum(fit.pixels for fit in fits.values()) / 1e6, 3),
        pairs=sum(fit.pairs for fit in fits.values()),
        foliage=bands.rule,
        warnings=warnings,
        primitives=found,
    )


def _modelled(stem: int, fit: BandFit) -> dict:
    held_out = fit.held_out
    return {
        "seed": stem,
        "crops": fit.crops,
        "pixels": fit.pixels,
        "gaussians": len(fit.parameters),
        "epochs": fit.epochs,
        "seconds": round(fit.seconds, 2),
        "stopped": fit.stopped,
        "held_out": None
        if held_out is None
        else {key: round(value, 4) for key, value in vars(held_out).items() if math.isfinite(value)},
        "dbh_cm": round(fit.primitive.dbh_cm, 2),
    }


def _fit_one(
    origin: np.ndarray, band: Band, options: GaussianOptions, share: int, spread: Callable[..., Iterable]
) -> BandFit | None:
    """share: most Gaussians of a stem."""
    budget = min(share, options.gaussians)
    # Drawn by the stem's place: neighbours found or not change nothing.
    seed = own_seed(options.seed, origin) % 2**31
    around = FitSettings(min(options.stem_gaussians, budget // 2), options.stem_epochs, options.device, seed)
    joint = JointSettings(bh_m=options.bh_m, high_m=min(options.band_m - 0.1, 2.9))
    bark = max(budget - around.gaussians, 0)
    return fit_with_primitive(
        band.crops, band.plane, band.volume, around, band.pixel_m, band.around, joint, bark, spread
    )
