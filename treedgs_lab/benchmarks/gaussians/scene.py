"""A whole scene of Gaussians, as published: crowns, ground and stems, over whole photos (for ``stems/splats/band.py``).

0.8 L1 + 0.2 D-SSIM, Adam, a fixed number of Gaussians with dead ones moved onto live ones (3DGS-MCMC); half resolution,
then full, each until photos that take no part are predicted no better, then a few passes with falling steps; or a
number of steps that is given (:meth:`Fit.run_length`).
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.stems.splats.bands import Band, Volume
from treedgs_geo.stems.splats.crops import Crop
from treedgs_geo.stems.splats.field import COLOUR, LOG_SCALE, LOGIT, MEAN, N_PARAMETERS, QUATERNION, GaussianField
from treedgs_geo.stems.splats.loss import d_ssim, l1
from treedgs_geo.stems.splats.options import GaussianOptions
from treedgs_geo.stems.splats.primitive.fit import PrimitiveFit, fit_primitive
from treedgs_geo.stems.splats.primitive.views import JointSettings, Layers
from treedgs_geo.stems.splats.raster import Rasteriser
from treedgs_geo.stems.splats.splat_fit.controllers import FixedSchedule
from treedgs_geo.stems.splats.splat_fit.held_out import hold_out
from treedgs_geo.stems.splats.splat_fit.optimise import Adam, constrain, learning_rates, relocate
from treedgs_geo.stems.splats.whole_photos import WholePhotos

#: Heights above ground that crowns reach to, metres.
CROWN_TOP_M = 25.0
#: A stage ends when the held-out photos have gained less than this (dB) in so many passes.
SETTLED_DB, PATIENCE = 0.05, 3
#: Where Gaussians may be and how large, metres.
ANYWHERE = Volume(1e4, -1e3, 1e3, 0.005, 2.0)
#: 2D filter, square pixels: that of the stem bands.
DILATION = 0.15


@dataclass(frozen=True)
class Photos(WholePhotos):
    """held: photos that take no part."""

    held: list[int] = field(default_factory=list)

    @classmethod
    def of(cls, views: list[View], held: list[int]) -> Photos:
        whole = WholePhotos.load(views)
        return cls(whole.cameras, whole.images, whole.inside, held)

    @property
    def taught(self) -> list[int]:
        return [k for k in range(len(self.cameras)) if k not in self.held]


def points_on_rays(photos: Photos, ground: Callable, count: int, rng: np.random.Generator) -> tuple:
    """(count, 3) places that the photos look through and their (count, 3) colours: four in ten on the ground, the rest
    anywhere up to the crowns' tops."""
    xyz, colours = np.empty((count, 3)), np.empty((count, 3))
    height = np.where(rng.random(count) < 0.4, 0.0, CROWN_TOP_M * rng.random(count))
    which = rng.choice(photos.taught, count)
    for k in photos.taught:
        own = np.flatnonzero(which == k)
        camera = photos.cameras[k]
        rows, columns = rng.integers(0, camera.height, len(own)), rng.integers(0, camera.width, len(own))
        rays = (camera.pixel_rays() @ camera.rotation)[rows, columns]
        level = np.full(len(own), float(ground(np.zeros(1), np.zeros(1))[0]))
        for _ in range(4):
            place = camera.centre + ((level + height[own] - camera.centre[2]) / rays[:, 2])[:, None] * rays
            known = np.asarray(ground(place[:, 0], place[:, 1]), float)
            level = np.where(np.isfinite(known), known, level)
        xyz[own], colours[own] = place, photos.images[k][rows, columns] / 255
    return xyz, colours


def start(points: np.ndarray, colours: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, 14) Gaussians at the points and, where the budget is larger, beside them."""
    gap = np.clip(cKDTree(points).query(points, k=4)[0][:, 1:].mean(axis=1), 0.01, 0.5)
    from_points = np.concatenate([rng.permutation(len(points)), rng.integers(0, len(points), max(count, 1))])[:count]
    own = gap[from_points]
    p = np.zeros((count, N_PARAMETERS))
    jitter = rng.standard_normal((count, 3)) * own[:, None]
    jitter[: len(points)] = 0
    p[:, MEAN] = points[from_points] + jitter
    p[:, QUATERNION] = rng.standard_normal((count, 4))
    p[:, QUATERNION] /= np.linalg.norm(p[:, QUATERNION], axis=1, keepdims=True)
    copies = max(count / len(points), 1)
    p[:, LOG_SCALE] = np.log(np.clip(own / copies ** (1 / 3), 0.006, 0.3))[:, None]
    p[:, LOGIT] = np.log(0.18 / 0.82)
    p[:, COLOUR] = colours[from_points]
    return p


@dataclass
class Fit:
    """A scene while it is fitted. curve: one row a pass."""

    photos: Photos
    p: np.ndarray
    pixel_m: float
    seed: int
    cpu_s: float = 0.0
    pairs: int = 0
    steps: int = 0
    pixels: int = 0
    curve: list[dict] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.seed)
        self.rasteriser = Rasteriser(1, DILATION)
        self.adam = Adam.start(len(self.p), learning_rates(self.pixel_m))

    def held_out_db(self, factor: float) -> float:
        """PSNR of the whole held-out photos."""
        square = mass = 0.0
        for k in self.photos.held:
            camera, image, weight = self.photos.at(k, factor)
            shown = np.clip(np.moveaxis(self.rasteriser.forward(self.p, camera).planes[:3], 0, -1), 0, 1)
            square += float((weight * ((shown - image) ** 2).mean(axis=-1)).sum())
            mass += float(weight.sum())
        return float(-10 * np.log10(max(square, 1e-12) / max(mass, 1e-12)))

    def one_pass(self, stage: str, factor: float, done: float, more: float, move: bool) -> float:
        """Every taught photo once; the steps go from progress ``done`` by ``more``. Returns the held-out PSNR."""
        began, schedule, taught = time.process_time(), FixedSchedule(), self.photos.taught
        for at, k in enumerate(self.rng.permutation(taught)):
            camera, image, weight = self.photos.at(k, factor)
            shown = self.rasteriser.forward(self.p, camera)
            picture = np.ascontiguousarray(np.moveaxis(shown.planes[:3], 0, -1))
            _, g = l1(picture, image, weight)
            _, g_structure = d_ssim(picture, image, weight)
            given = np.zeros((4, camera.height, camera.width), np.float32)
            given[:3] = np.moveaxis(0.8 * g + 0.2 * g_structure, -1, 0)
            factors = schedule.factors(done + more * at / len(taught))
            self.adam.step(self.p, self.rasteriser.backward(self.p, shown, given), factors)
            constrain(self.p, ANYWHERE)
            self.pairs, self.steps = self.pairs + shown.pairs, self.steps + 1
            self.pixels += camera.width * camera.height
        moved = relocate(self.p, self.adam, ANYWHERE, self.rng) if move else 0
        found = self.held_out_db(factor)
        self.cpu_s += time.process_time() - began
        self.curve.append(
            {
                "pass": len(self.curve) + 1,
                "stage": stage,
                "held_out_db": round(found, 3),
                "moved": moved,
                "cpu_s": round(self.cpu_s, 1),
            }
        )
        print(self.curve[-1], flush=True)
        return found

    def settled(self, stage: str) -> bool:
        """The last passes of a stage brought nothing."""
        found = [row["held_out_db"] for row in self.curve if row["stage"] == stage]
        return len(found) > PATIENCE and max(found[-PATIENCE:]) < max(found[:-PATIENCE]) + SETTLED_DB

    def run(self, most: tuple[int, int], last: int, after: Callable[[Fit], None]) -> None:
        """Half resolution, full resolution, each until settled or ``most`` passes; ``last`` passes with falling steps.
        Passes that ``curve`` has already are not repeated. after: called after each pass, its time not counted."""

        def passes(stage: str) -> int:
            return sum(row["stage"] == stage for row in self.curve)

        for stage, factor, limit, next_stage in (("half", 0.5, most[0], "full"), ("full", 1.0, most[1], "falling")):
            while passes(stage) < limit and not passes(next_stage) and not self.settled(stage):
                self.one_pass(stage, factor, 0.0, 0.0, True)
                after(self)
        while passes("falling") < last:
            self.one_pass("falling", 1.0, passes("falling") / last, 1 / last, False)
            after(self)

    def run_length(self, steps: int, after: Callable[[Fit], None]) -> None:
        """A length that is given, at full resolution and with steps that fall over the whole of it, as published; dead
        Gaussians are moved in its first half. Goes on from ``curve``."""
        total = -(-steps // len(self.photos.taught))
        while len(self.curve) < total:
            done = len(self.curve) / total
            self.one_pass("full", 1.0, done, 1 / total, done < 0.5)
            after(self)

    def save(self, path: Path) -> None:
        """Everything but the photos, to go on from."""
        kept = {
            "cpu_s": self.cpu_s,
            "pairs": self.pairs,
            "steps": self.steps,
            "pixels": self.pixels,
            "curve": self.curve,
            "adam_steps": self.adam.steps,
            "rng": self.rng.bit_generator.state,
        }
        part = path.with_suffix(".part.npz")
        np.savez(part, p=self.p, moment=self.adam.moment, square=self.adam.square, kept=json.dumps(kept))
        part.replace(path)

    def restore(self, path: Path) -> None:
        """Go on from :meth:`save`."""
        with np.load(path) as held:
            self.p, self.adam.moment, self.adam.square = held["p"], held["moment"], held["square"]
            kept = json.loads(str(held["kept"]))
        self.adam.steps, self.rng.bit_generator.state = kept.pop("adam_steps"), kept.pop("rng")
        for name, value in kept.items():
            setattr(self, name, value)


def near_stems(p: np.ndarray, seeds: np.ndarray, radius_m: float, band_m: float) -> GaussianField:
    """The Gaussians about the stems, as the field of the stem band has them. seeds: (K, 3) local, on the ground."""
    away, nearest = cKDTree(seeds[:, :2]).query(p[:, :2])
    above = p[:, 2] - seeds[nearest, 2]
    chosen = np.flatnonzero((away <= radius_m) & (above > -0.15) & (above < band_m + 0.4))
    return GaussianField.from_packed(p[chosen], nearest[chosen].astype(np.int32))


def without_stem(p: np.ndarray, options: GaussianOptions) -> Callable[[Crop], Layers]:
    """What crops show of a scene without one stem: its Gaussians before and behind the plane through the seed across
    the view, less those in the cylinder that the stem is fitted in (from 0.2 m up: the ground at its foot stays).

    p: (N, 14) in the stem's frame.
    """
    inside = (np.hypot(p[:, 0], p[:, 1]) < options.radius_m) & (p[:, 2] > 0.2) & (p[:, 2] < options.band_m + 0.4)
    rest, rasteriser = p[~inside], Rasteriser(1, DILATION)

    def look(crop: Crop) -> Layers:
        before = rest[:, :2] @ crop.camera.centre[:2] > 0
        planes = rasteriser.forward(rest[before], crop.camera).planes
        front, through = np.ascontiguousarray(np.moveaxis(planes[:3], 0, -1)), planes[3].copy()
        behind = np.moveaxis(rasteriser.forward(rest[~before], crop.camera).planes[:3], 0, -1)
        return front, through, np.ascontiguousarray(behind)

    return look


def primitive_in_scene(p: np.ndarray, origin: np.ndarray, band: Band, options: GaussianOptions) -> PrimitiveFit | None:
    """The stem that best completes a scene of Gaussians (N, 14, local): the same crops, search and fit as in a band."""
    own = p.copy()
    own[:, MEAN] -= origin
    joint = JointSettings(bh_m=options.bh_m, high_m=min(options.band_m - 0.1, 2.9))
    return fit_primitive(hold_out(band.crops)[0], band.plane, without_stem(own, options), joint)


def band_db(p: np.ndarray, origin: np.ndarray, band: Band) -> float:
    """PSNR of a scene (N, 14, local) in the held-out crops of one stem, masked and exposed as a band's own is."""
    own, rasteriser = p.copy(), Rasteriser(1, DILATION)
    own[:, MEAN] -= origin
    square = mass = 0.0
    for crop in hold_out(band.crops)[1]:
        shown = np.moveaxis(rasteriser.forward(own, crop.camera).planes[:3], 0, -1)
        weight = crop.weight
        gain = np.einsum("hw,hwc,hwc->c", weight, shown, crop.image)
        gain /= np.maximum(np.einsum("hw,hwc,hwc->c", weight, shown, shown), 1e-6)
        shown = np.clip(shown * gain, 0, 1)
        square += float((weight * ((shown - crop.image) ** 2).mean(axis=-1)).sum())
        mass += float(weight.sum())
    return float(-10 * np.log10(max(square, 1e-12) / mass)) if mass else float("nan")
