"""The photos cut into one band a stem: which photos, which pixels, what may stand where.

Everything that fits a stem starts from a :class:`Band`. Photos are read once, kept as 8-bit crops for all stems, and
become floating point for the stem at hand only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...core.errors import InputError
from ...core.progress import Reporter
from ...reconstruction.cameras import View
from ...reconstruction.images import load_image, shrink, shrink_factor, shrunk_camera
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
from .options import GaussianOptions

#: Ground is modelled to this many band heights from a stem: as far as an oblique ray through the band's top goes.
_BEHIND = 1.1
#: Pixels are explained from so much below the ground to so much above the band, m.
_LOW_M, _ABOVE_M = -0.15, 0.4


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
    """A crop to cut: which stem, of which flight, at which camera (stem frame); wide: of the ground about it."""

    stem: int
    flight: int
    camera: CropCamera
    wide: bool = False


@dataclass(frozen=True)
class Band:
    """One stem's crops in its own frame. around: wider crops of the ground about it. pixel_m: footprint of a pixel."""

    crops: list[Crop]
    around: list[Crop]
    plane: GroundPlane
    pixel_m: float


@dataclass(frozen=True)
class CutPhotos:
    """Crops of all stems. origins: (3,) local by seed, on the ground. rule: foliage split, None where there is none.
    photos: how many were needed."""

    origins: dict[int, np.ndarray]
    rule: FoliageRule | None
    photos: int
    _ground: Callable[[np.ndarray, np.ndarray], np.ndarray]
    _options: GaussianOptions
    _cut: dict[int, list[tuple[_Job, np.ndarray, np.ndarray]]]

    def band(self, stem: int) -> Band | None:
        """The band of one seed; None where no photo shows enough of it."""
        options, everything, origin = self._options, self._cut.get(stem, []), self.origins[stem]
        near = [other - origin for key, other in self.origins.items() if key != stem]
        near = [offset for offset in near if np.hypot(offset[0], offset[1]) < 2 * _BEHIND * options.band_m]
        # A crop that is almost all foliage has nothing to teach.
        own = [item for item in everything if not item[0].wide and item[2].mean() > 0.15]
        if not own:
            return None
        footprint = float(np.median([np.linalg.norm(job.camera.centre) / job.camera.fx for job, _, _ in own]))
        plane = GroundPlane.around(self._ground, origin, _BEHIND * options.band_m + 1, max(0.04, 2 * footprint))
        low, high = _LOW_M, options.band_m + _ABOVE_M

        def crop(job: _Job, image: np.ndarray, weight: np.ndarray) -> Crop:
            camera = job.camera
            stem = near_axis(camera, 0.9 * options.radius_m, 0.0, 2 * options.band_m)
            for offset in near:
                stem |= near_axis(camera.moved(offset), 0.6 * options.radius_m, 0.0, 2 * options.band_m)
            # The stem goes on above the band, where neither primitive nor ground can explain it.
            above = near_axis(camera, 0.7 * options.radius_m, high, 3 * options.band_m)
            above &= ~near_axis(camera, options.radius_m, low, high)
            pixels = image.astype(np.float32) / np.float32(255)
            clear = (weight * ~stem).astype(np.float32)
            return Crop(camera, pixels, weight * ~above, plane.texels(camera), clear, job.flight)

        return Band(
            [crop(*item) for item in own],
            [crop(*item) for item in everything if item[0].wide],
            plane,
            footprint,
        )


def cut_bands(
    views: Sequence[View],
    ground: Callable[[np.ndarray, np.ndarray], np.ndarray],
    seeds: np.ndarray,
    options: GaussianOptions,
    reporter: Reporter,
    warnings: list[str],
    load: Callable[[View], np.ndarray] = read_photo,
) -> CutPhotos:
    """Choose photos for each seed ((K, 2) local) and cut them; arguments as of ``train.fit_with_report``."""
    origins = _origins(seeds, ground, warnings)
    views, load = averaged_photos(views, list(origins.values()), load)
    outline = band_outline(options.radius_m + 0.3, _LOW_M, options.band_m)
    surround = band_outline(_BEHIND * options.band_m, 0.0, 0.1)
    jobs: dict[int, list[_Job]] = {}
    for stem, origin in origins.items():
        for view in choose_views(views, origin, options.max_views):
            camera = crop_camera(views[view], origin, outline)
            if camera is not None:
                jobs.setdefault(view, []).append(_Job(stem, views[view].flight, camera))
        # The ground behind the stem, from every photo: half the resolution is plenty for a background.
        for view in range(len(views)):
            camera = crop_camera(views[view], origin, surround)
            if camera is not None:
                jobs.setdefault(view, []).append(_Job(stem, views[view].flight, camera.scaled(0.5), True))
    cut, rule = _cut_crops(views, jobs, load, reporter, warnings)
    return CutPhotos(origins, rule, len(jobs), ground, options, cut)


def averaged_photos(
    views: Sequence[View], origins: Sequence[np.ndarray], load: Callable[[View], np.ndarray]
) -> tuple[Sequence[View], Callable[[View], np.ndarray]]:
    """Photos much finer at the stems (``origins``: (3,) local) than :data:`.images.FINEST_GSD_M` as a coarser
    sensor would have taken them: their cameras, and how to read them. The others stay as they are."""
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
    rule = foliage_rule(np.concatenate(samples)) if samples else None
    if rule is not None:
        cut = {
            stem: [(job, image, inside * rule.weight(image)) for job, image, inside in own] for stem, own in cut.items()
        }
    return cut, rule
