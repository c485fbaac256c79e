"""From photos and stem seeds to one Gaussian field of the stem band (``docs/gaussians.md``).

The paper optimises the whole forest on a large GPU. Here each stem is a small problem of its own: crops over its band,
1-3 thousand Gaussians in a cylinder, the ground behind it as a texture. Stems are independent, so they run side by
side, and time and memory grow linearly with their number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field, replace

import numpy as np

from ..core.crs import LocalFrame
from ..core.errors import InputError
from ..core.progress import Reporter
from ..reconstruction.cameras import View
from ..reconstruction.images import load_image
from ..reconstruction.shrinking import shrink, shrink_factor, shrunk_camera
from .crops import (
    Crop,
    CropCamera,
    FoliageRule,
    GroundPlane,
    band_outline,
    crop_camera,
    cut_out,
    foliage_rule,
    near_axis,
)
from .field import LARGEST_COORDINATE_M, MEAN, GaussianField, merge_fields
from .optimise import Volume
from .options import GaussianOptions
from .stem_fit import FitSettings, StemFit, fit_stem
from .stem_joint import JointSettings, StemPrimitive
from .stem_loop import fit_with_primitive

#: Most Gaussians of one stem with its primitive, unless more are asked for.
MOST_BARK = 3000
#: Most photos a stem primitive is fitted to.
STEM_VIEWS = 60
#: Ground is modelled to this many band heights from a stem: as far as an oblique ray through the band's top goes.
_BEHIND = 1.1


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
    primitive: StemPrimitive


def read_photo(view: View) -> np.ndarray:
    """(H, W, 3) uint8 RGB of the view's photo.

    Raises:
        InputError: unreadable, or another size than the camera says.
    """
    image = load_image(view)
    if image.shape[:2] != (view.camera.height, view.camera.width):
        raise InputError(
            f"{view.path}: is {image.shape[1]} x {image.shape[0]} pixels, expected {view.camera.width} x "
            f"{view.camera.height} as reconstructed; give the photos that were reconstructed."
        )
    return image


def choose_views(views: Sequence[View], point: np.ndarray, most: int, least_slant: float = 0.25) -> list[int]:
    """Photos for one stem: oblique to it (sine of the angle to the plumb line above ``least_slant``), spread in
    azimuth.

    Looking straight down, a stem is a disc: such views cost pixels and say nothing about its width. Where no view is
    oblique, all are kept.
    """
    centres = np.array([view.centre for view in views])
    ray = point - centres
    distance = np.linalg.norm(ray, axis=1)
    slant = np.hypot(ray[:, 0], ray[:, 1]) / np.maximum(distance, 1e-9)
    index = np.flatnonzero(slant > least_slant)
    if len(index) == 0:
        index = np.arange(len(views))
    if len(index) <= most:
        return index.tolist()
    azimuth = np.arctan2(ray[index, 1], ray[index, 0])
    # Sorting by azimuth and keeping every so-manyth spreads them; ties between flights stay deterministic.
    order = index[np.argsort(azimuth, kind="stable")]
    return sorted(order[np.arange(most) * len(order) // most].tolist())


@dataclass(frozen=True)
class _Job:
    """A crop to cut: which stem, from which photo, at which camera (stem frame)."""

    stem: int
    view: int
    flight: int
    camera: CropCamera
    wide: bool = False


def fit_gaussians(
    views: Sequence[View],
    frame: LocalFrame,
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    seeds_xy: np.ndarray,
    dense: tuple[np.ndarray, np.ndarray | None] | None = None,
    options: GaussianOptions | None = None,
    reporter: Reporter | None = None,
    load: Callable[[View], np.ndarray] = read_photo,
) -> GaussianField:
    """Fit a field of the stem band around seeds; see :func:`fit_with_report` for the arguments."""
    return fit_with_report(views, frame, ground, seeds_xy, dense, options, reporter, load)[0]


def fit_with_report(
    views: Sequence[View],
    frame: LocalFrame,
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    seeds_xy: np.ndarray,
    dense: tuple[np.ndarray, np.ndarray | None] | None = None,
    options: GaussianOptions | None = None,
    reporter: Reporter | None = None,
    load: Callable[[View], np.ndarray] = read_photo,
) -> tuple[GaussianField, FitReport]:
    """Fit a field of the stem band around seeds.

    views: registered photos, local frame. frame: that frame (only named in messages; the field stays local). ground:
    local x, y arrays -> local ground height, NaN where unknown. seeds_xy: (K, 2) local stem positions, good to a few
    decimetres. dense: (points (M, 3) local, colours or None) to start from. load: reads a photo.

    A seed without ground or without a photo that shows its band gets no Gaussians and a warning; the rest go on.

    Raises:
        InputError: no view, no seed, coordinates that are not local, or no seed that could be fitted.
    """
    options, reporter = options or GaussianOptions(), reporter or Reporter()
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
    warnings: list[str] = []
    origins = _origins(seeds, ground, warnings)
    views, load = averaged_photos(views, list(origins.values()), load)
    low, high = -0.15, options.band_m + 0.4
    outline = band_outline(options.radius_m + 0.3, low, options.band_m)
    surround = band_outline(_BEHIND * options.band_m, 0.0, 0.1)
    jobs: dict[int, list[_Job]] = {}
    # A primitive is cheap, and every clear view of its edges counts.
    most = int(options.value("max_views")) if options.free else options.max_views or STEM_VIEWS
    for stem, origin in origins.items():
        for view in choose_views(views, origin, most):
            camera = crop_camera(views[view], origin, outline)
            if camera is not None:
                jobs.setdefault(view, []).append(_Job(stem, view, views[view].flight, camera))
        # The ground behind the stem, from every photo: half the resolution is plenty for a background.
        for view in range(len(views)):
            camera = crop_camera(views[view], origin, surround)
            if camera is not None:
                jobs.setdefault(view, []).append(_Job(stem, view, views[view].flight, camera.scaled(0.5), True))
    with reporter.stage("cut crops", 0.0, 0.15):
        cut, rule = _cut_crops(views, jobs, options.mask_foliage, load, reporter, warnings)
    reporter.info(
        "Foliage is masked by a colour split learned from these photos."
        if rule
        else "No clear colour split between foliage and the rest was found; no pixel is masked by colour."
    )
    share = max(options.max_gaussians // max(len(origins), 1), 10)
    settings = FitSettings(
        gaussians=min(int(options.value("gaussians")), share),
        coarse_epochs=int(options.value("coarse_epochs")),
        fine_epochs=int(options.value("fine_epochs")),
        ssim=options.value("ssim"),
        normals=options.value("normals"),
        alpha_cost=options.value("fog"),
        controller=options.controller,
        density=options.density,
        device=options.device,
        seed=options.seed,
    )

    def work(stem: int) -> tuple[int, StemFit | None]:
        near = [other - origins[stem] for key, other in origins.items() if key != stem]
        near = [offset for offset in near if np.hypot(offset[0], offset[1]) < 2 * _BEHIND * options.band_m]
        return stem, _fit_one(
            stem, origins[stem], cut.get(stem, []), near, ground, settings, options, (low, high), dense, share
        )

    fits: dict[int, StemFit] = {}
    with reporter.stage("fit stems", 0.15, 1.0), ThreadPoolExecutor(options.threads) as pool:
        waiting = [pool.submit(work, stem) for stem in origins]
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
    blind = [stem for stem in origins if stem not in fits]
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
    pieces = []
    for stem in sorted(fits):
        parameters = fits[stem].parameters.copy()
        parameters[:, MEAN] += origins[stem]
        pieces.append(GaussianField.from_packed(parameters, stem))
    report = FitReport(
        [
            {
                "seed": stem,
                "crops": fit.crops,
                "pixels": fit.pixels,
                "gaussians": len(fit.parameters),
                "epochs": fit.epochs,
                "seconds": round(fit.seconds, 2),
                "stopped": fit.stopped,
                "held_out": None
                if fit.held_out is None
                else {key: round(value, 4) for key, value in vars(fit.held_out).items() if math.isfinite(value)},
                "dbh_cm": None if fit.primitive is None else round(fit.primitive.dbh_cm, 2),
            }
            for stem, fit in sorted(fits.items())
        ],
        len(jobs),
        round(sum(fit.pixels for fit in fits.values()) / 1e6, 3),
        sum(fit.pairs for fit in fits.values()),
        rule,
        warnings,
        {stem: FoundStem(origins[stem], fit.primitive) for stem, fit in fits.items() if fit.primitive is not None},
    )
    return merge_fields(pieces), report


def averaged_photos(
    views: Sequence[View], origins: Sequence[np.ndarray], load: Callable[[View], np.ndarray]
) -> tuple[Sequence[View], Callable[[View], np.ndarray]]:
    """Photos much finer at the stems (``origins``: (3,) local) than :data:`.shrinking.FINEST_GSD_M` as a coarser sensor
    would have taken them: their cameras, and how to read them. The others stay as they are."""
    whole: dict[str, tuple[View, int]] = {}
    coarse = []
    for view in views:
        depth = np.array([view.rotation[2] @ origin + view.translation[2] for origin in origins])
        k = shrink_factor(view.camera, float(np.median(depth[depth > 0]))) if (depth > 0).any() else 1
        coarse.append(replace(view, camera=shrunk_camera(view.camera, k)) if k > 1 else view)
        if k > 1:
            whole[view.name] = view, k

    def read(view: View) -> np.ndarray:
        if view.name not in whole:
            return load(view)
        fine, k = whole[view.name]
        image = load(fine)
        return shrink(image[: image.shape[0] // k * k, : image.shape[1] // k * k], k)

    return coarse, read


def _origins(seeds: np.ndarray, ground: Callable, warnings: list[str]) -> dict[int, np.ndarray]:
    heights = np.asarray(ground(seeds[:, 0], seeds[:, 1]), float)
    missing = np.flatnonzero(~np.isfinite(heights))
    if len(missing):
        warnings.append(f"{len(missing)} stem positions lie where no ground height is known and were left out.")
    return {int(stem): np.array([*seeds[stem], heights[stem]]) for stem in np.flatnonzero(np.isfinite(heights))}


def _cut_crops(
    views: Sequence[View],
    jobs: dict[int, list[_Job]],
    mask: bool,
    load: Callable,
    reporter: Reporter,
    warnings: list[str],
) -> tuple[dict[int, list[tuple[_Job, np.ndarray, np.ndarray]]], FoliageRule | None]:
    """Read each photo once, cut every stem's crop, then learn the foliage split from what was cut."""
    cut: dict[int, list[tuple[_Job, np.ndarray, np.ndarray]]] = {}
    samples = []
    for done, (view, wanted) in enumerate(sorted(jobs.items()), start=1):
        try:
            photo = load(views[view])
        except InputError as problem:
            warnings.append(f"Photo left out: {problem}")
            continue
        for job in wanted:
            image, inside = cut_out(photo, views[view], job.camera)
            cut.setdefault(job.stem, []).append((job, image, inside))
            if not job.wide:
                samples.append(image.reshape(-1, 3)[::29])
        reporter.progress(done / len(jobs))
    rule = foliage_rule(np.concatenate(samples)) if mask and samples else None
    if rule is not None:
        cut = {
            stem: [(job, image, inside * rule.weight(image)) for job, image, inside in own] for stem, own in cut.items()
        }
    return cut, rule


def _fit_one(
    stem: int,
    origin: np.ndarray,
    cut: Iterable[tuple[_Job, np.ndarray, np.ndarray]],
    neighbours: list[np.ndarray],
    ground: Callable,
    settings: FitSettings,
    options: GaussianOptions,
    band: tuple[float, float],
    dense: tuple[np.ndarray, np.ndarray | None] | None,
    budget: int,
) -> StemFit | None:
    everything = list(cut)
    # A crop that is almost all foliage has nothing to teach.
    own = [item for item in everything if not item[0].wide and item[2].mean() > 0.15]
    if not own:
        return None
    footprint = float(np.median([np.linalg.norm(job.camera.centre) / job.camera.fx for job, _, _ in own]))
    plane = GroundPlane.around(ground, origin, _BEHIND * options.band_m + 1, max(0.04, 2 * footprint))
    volume = Volume(options.radius_m, band[0], band[1], 0.3 * footprint, max(0.15, 4 * footprint))

    def crop(job: _Job, image: np.ndarray, weight: np.ndarray) -> Crop:
        camera = job.camera
        stem = near_axis(camera, 0.9 * options.radius_m, 0.0, 2 * options.band_m)
        for offset in neighbours:
            stem |= near_axis(camera.moved(offset), 0.6 * options.radius_m, 0.0, 2 * options.band_m)
        # The stem goes on above the band, where neither Gaussians nor ground can explain it.
        above = near_axis(camera, 0.7 * options.radius_m, band[1], 3 * options.band_m)
        above &= ~near_axis(camera, options.radius_m, band[0], band[1])
        pixels = image.astype(np.float32) / np.float32(255)
        clear = (weight * ~stem).astype(np.float32)
        return Crop(camera, pixels, weight * ~above, plane.texels(camera), clear, job.view, job.flight)

    crops = [crop(*item) for item in own]
    around = [crop(*item) for item in everything if item[0].wide]
    points = None
    if dense is not None and len(dense[0]):
        local = np.asarray(dense[0], float) - origin
        points = local[volume.contains(local) & (local[:, 2] > 0.1)]
    settings = replace(
        settings,
        seed=settings.seed + 1000003 * stem % (2**31 - 1),
        filter_m=options.value("smoothing_px") * footprint,
    )
    joint = JointSettings(bh_m=options.bh_m, high_m=min(options.band_m - 0.1, 2.9))
    start = None
    if not options.free:
        budget = min(budget, options.gaussians or MOST_BARK)
        few = replace(
            settings, gaussians=min(options.stem_gaussians, budget // 2), fine_epochs=options.stem_epochs
        )
        bark = max(budget - few.gaussians, 0)
        fit = fit_with_primitive(crops, plane, volume, few, footprint, around, joint, bark)
        if options.stems == "primitive" or fit is None:
            return fit
        start, settings = fit.parameters, replace(settings, gaussians=budget, coarse_epochs=0)
    return fit_stem(
        crops,
        plane,
        volume,
        settings,
        footprint,
        points,
        around=around,
        start=start,
    )
