"""The published measuring (sec:dbh_weighted): horizontal slices, weighted solid circles, taper RANSAC."""

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
    results = []
    for number in range(len(stems)):
        mine = owner == number
        table = np.column_stack([height[mine], circles[mine, :2], 200 * circles[mine, 2]])
        taper = taper_ransac(table[:, 0], table[:, 3], bh_m, options.taper, seed + number) if len(table) else None
        results.append(PublishedResult(table, taper))
    return results
