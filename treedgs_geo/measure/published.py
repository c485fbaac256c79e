"""The published measuring (sec:dbh_weighted): horizontal slices, weighted solid circles, taper RANSAC.

And, for points that fill the stem (samples of splats), the same circles along the stem's axis with a wider slope bound:
no ring fit holds there, and the published bound (0.3 cm/m) refuses pines, which lose 1 cm/m.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .circles import SolidCircle, fit_solid_circles
from .slices import slice_heights, slice_index
from .taper import Taper, TaperRansac, taper_ransac


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


def measure_published(stems: list[tuple[np.ndarray, np.ndarray]], bh_m: float, options: PublishedOptions | None = None,
                      seed: int = 0) -> list[PublishedResult]:
    """The published DBH of each stem: [(points (N, 3) with z = height above ground, weights (N,)), ...].

    All stems' slices go through one compiled batch.
    """
    options = options or PublishedOptions()
    tables = _circles(stems, options, seed)
    return [PublishedResult(table, taper_ransac(table[:, 0], table[:, 3], bh_m, options.taper, seed + number))
            for number, table in enumerate(tables)]


def measure_filled(stems: list[tuple[np.ndarray, np.ndarray]], bh_m: float, options: PublishedOptions | None = None,
                   seed: int = 0) -> list[tuple[PublishedResult, np.ndarray]]:
    """Solid circles along the axis and the taper RANSAC: [(result, (2,) axis slope), ...]; points and weights as above.

    A first pass gives the axis (median slope of the circle centres); the points are sheared along it for the second.
    """
    options = options or PublishedOptions(top_m=5.0, taper=TaperRansac(steepest_cm_m=2.5))
    first = _circles(stems, options, seed)
    slopes, sheared = [], []
    for (points, weight), table in zip(stems, first, strict=True):
        slope = _axis_slope(table)
        moved = points.copy()
        moved[:, :2] -= np.outer(points[:, 2] - bh_m, slope)
        slopes.append(slope)
        sheared.append((moved, weight))
    results = []
    for table, slope in zip(_circles(sheared, options, seed), slopes, strict=True):
        upright = float(np.cos(np.arctan(np.hypot(*slope))))
        table = table * (1.0, 1.0, 1.0, np.sqrt(upright))
        taper = taper_ransac(table[:, 0], table[:, 3], bh_m, options.taper, seed) if len(table) else None
        results.append((PublishedResult(table, taper), slope))
    return results


def _axis_slope(table: np.ndarray) -> np.ndarray:
    """(2,) robust slope of the circle centres over height (median of pairwise slopes), 0 where there are too few."""
    good = table[np.isfinite(table[:, 3]) & (table[:, 0] >= 0.5)]
    if len(good) < 8:
        return np.zeros(2)
    i, j = np.triu_indices(len(good), k=5)
    return np.median((good[j, 1:3] - good[i, 1:3]) / (good[j, :1] - good[i, :1]), axis=0)


def _circles(stems: list[tuple[np.ndarray, np.ndarray]], options: PublishedOptions, seed: int) -> list[np.ndarray]:
    """Per stem (S, 4): height, x, y, diameter cm (NaN where no circle), all stems in one batch."""
    flat, weights, owners, heights = [], [], [], []
    for number, (points, weight) in enumerate(stems):
        if len(points) == 0:
            continue
        centres = slice_heights(0.0, min(options.top_m, float(points[:, 2].max())), options.spacing_m)
        for centre, index in zip(centres, slice_index(points[:, 2], centres, options.thickness_m), strict=True):
            if len(index) >= options.least_points:
                flat.append(points[index, :2])
                weights.append(weight[index])
                owners.append(number)
                heights.append(centre)
    circles = fit_solid_circles(flat, weights, options.circle, seed)
    owner, height = np.asarray(owners, int), np.asarray(heights, float)
    table = np.column_stack([height, circles[:, :2], 200 * circles[:, 2]]) if len(circles) else np.empty((0, 4))
    return [table[owner == number] for number in range(len(stems))]
