"""The published measuring (sec:dbh_weighted): horizontal slices, weighted solid circles, taper RANSAC.

And, for points that fill the stem (samples of splats), the same circles along the stem's axis with a wider slope bound:
no ring fit holds there, and the published bound (0.3 cm/m) refuses pines, which lose 1 cm/m.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ....core.seeding import own_order, own_seed, stream
from ...geometry.circles import SolidCircle, fit_solid_circles
from ...geometry.slices import slice_heights, slice_index
from ...geometry.taper import Taper, TaperRansac, taper_ransac


@dataclass(frozen=True)
class PublishedOptions:
    """Constants of "Experimental Settings". top_m bounds the slices: the taper is sought on the lower stem only."""

    spacing_m: float = 0.1
    thickness_m: float = 1.0
    least_points: int = 5
    top_m: float = 8.0
    circle: SolidCircle = field(default_factory=SolidCircle)
    taper: TaperRansac = field(default_factory=TaperRansac)


@dataclass(frozen=True)
class PublishedResult:
    """Slices (S, 4): height, x, y, diameter cm (NaN where no circle); the taper fit or ``None``."""

    slices: np.ndarray
    taper: Taper | None


def measure_published(
    stems: list[tuple[np.ndarray, np.ndarray]], bh_m: float, options: PublishedOptions | None = None, seed: int = 0
) -> list[PublishedResult]:
    """The published DBH of each stem: [(points (N, 3) with z = height above ground, weights (N,)), ...].

    All stems' slices go through one compiled batch; a stem's draws are seeded by its own points, so that it reads the
    same alone, among others, and in any order of stems or points.
    """
    options = options or PublishedOptions()
    stems, seeds = _in_own_order(stems, seed)
    return [
        PublishedResult(table, taper_ransac(table[:, 0], table[:, 3], bh_m, options.taper, own))
        for table, own in zip(_circles(stems, options, seeds), seeds, strict=True)
    ]


def measure_filled(
    stems: list[tuple[np.ndarray, np.ndarray]], bh_m: float, options: PublishedOptions | None = None, seed: int = 0
) -> list[tuple[PublishedResult, np.ndarray]]:
    """Solid circles along the axis and the taper RANSAC: [(result, (2,) axis slope), ...]; points and weights as above.

    A first pass gives the axis (median slope of the circle centres); the points are sheared along it for the second.
    Draws are seeded as in :func:`measure_published`.
    """
    options = options or PublishedOptions(top_m=5.0, taper=TaperRansac(steepest_cm_m=2.5))
    stems, seeds = _in_own_order(stems, seed)
    first = _circles(stems, options, seeds)
    slopes, sheared = [], []
    for (points, weight), table in zip(stems, first, strict=True):
        slope = _axis_slope(table)
        moved = points.copy()
        moved[:, :2] -= np.outer(points[:, 2] - bh_m, slope)
        slopes.append(slope)
        sheared.append((moved, weight))
    results = []
    for table, slope, own in zip(_circles(sheared, options, seeds), slopes, seeds, strict=True):
        upright = float(np.cos(np.arctan(np.hypot(*slope))))
        table = table * (1.0, 1.0, 1.0, np.sqrt(upright))
        taper = taper_ransac(table[:, 0], table[:, 3], bh_m, options.taper, own) if len(table) else None
        results.append((PublishedResult(table, taper), slope))
    return results


def _in_own_order(
    stems: list[tuple[np.ndarray, np.ndarray]], seed: int
) -> tuple[list[tuple[np.ndarray, np.ndarray]], list[int]]:
    """The stems, each with its points in an order that does not depend on the file, and the seed of each."""
    ordered = []
    for points, weight in stems:
        order = own_order(points, weight)
        ordered.append((points[order], weight[order]))
    return ordered, [own_seed(seed, points) for points, _ in ordered]


def _axis_slope(table: np.ndarray) -> np.ndarray:
    """(2,) robust slope of the circle centres over height (median of pairwise slopes), 0 where there are too few."""
    good = table[np.isfinite(table[:, 3]) & (table[:, 0] >= 0.5)]
    if len(good) < 8:
        return np.zeros(2)
    i, j = np.triu_indices(len(good), k=5)
    return np.median((good[j, 1:3] - good[i, 1:3]) / (good[j, :1] - good[i, :1]), axis=0)


def _circles(
    stems: list[tuple[np.ndarray, np.ndarray]], options: PublishedOptions, seeds: list[int]
) -> list[np.ndarray]:
    """Per stem (S, 4): height, x, y, diameter cm (NaN where no circle), all stems in one batch; one seed a stem."""
    flat, weights, owners, heights, streams = [], [], [], [], []
    for number, (points, weight) in enumerate(stems):
        if len(points) == 0:
            continue
        centres = slice_heights(0.0, min(options.top_m, float(points[:, 2].max())), options.spacing_m)
        indices = slice_index(points[:, 2], centres, options.thickness_m)
        for step, (centre, index) in enumerate(zip(centres, indices, strict=True)):
            if len(index) >= options.least_points:
                streams.append(stream(seeds[number], step))
                flat.append(points[index, :2])
                weights.append(weight[index])
                owners.append(number)
                heights.append(centre)
    circles = fit_solid_circles(flat, weights, options.circle, streams)
    owner, height = np.asarray(owners, int), np.asarray(heights, float)
    table = np.column_stack([height, circles[:, :2], 200 * circles[:, 2]]) if len(circles) else np.empty((0, 4))
    return [table[owner == number] for number in range(len(stems))]
