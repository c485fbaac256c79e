"""Stems by other methods than the default: cylinder, filled stems, and the published measuring (sec:dbh_weighted):
horizontal slices, weighted solid circles, taper RANSAC.

And, for points that fill the stem (samples of splats), the same circles along the stem's axis with a wider slope bound:
no ring fit holds there, and the published bound (0.3 cm/m) refuses pines, which lose 1 cm/m.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ....core.seeding import own_order, own_seed, stream
from ....pointcloud.cloud import PointCloud
from ...geometry.circles import SolidCircle, fit_solid_circles
from ...geometry.cone import Cone
from ...geometry.cylinder import fit_cylinder
from ...geometry.slices import slice_heights, slice_index
from ...geometry.taper import Taper, TaperRansac, taper_ransac
from ...quality.assessment import Assessment
from ...quality.limits import judge
from ...quality.priors import USUAL_TAPER_CM_M
from .frames import TreeFrame
from .options import MeasureOptions
from .stem import StemMeasure, refuse


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


def _in_own_order(
    stems: list[tuple[np.ndarray, np.ndarray]], seed: int
) -> tuple[list[tuple[np.ndarray, np.ndarray]], list[int]]:
    """The stems, each with its points in an order that does not depend on the file, and the seed of each."""
    orders = [own_order(points, weight) for points, weight in stems]
    ordered = [(points[order], weight[order]) for (points, weight), order in zip(stems, orders, strict=True)]
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


#: Exponent p of eq:weighted_score by what weighs the points (paper.tex: held-out validation).
PAPER_POWER = {"opacity": 0.6, "intensity": 0.85}
#: Error of stems that their points fill: what splat samples of rendered plots gave (sd, and share of the diameter).
FILLED_SE_CM, FILLED_SE_SHARE = 2.0, 0.07


def by_cylinder(points: np.ndarray, options: MeasureOptions) -> StemMeasure:
    """The cylinder baseline: as published (``method=paper``: 2 r) or brought to breast height along the usual taper."""
    found = fit_cylinder(points, seed=options.seed)
    if found is None:
        return refuse("not_round" if len(points) >= 30 else "few_points", points=len(points))
    dbh = 200 * found.r
    if options.method == "default":
        dbh += USUAL_TAPER_CM_M * (found.height_m - options.bh_m)
    dx, dy = (found.axis[:2] / max(found.axis[2], 1e-6)).tolist()
    x, y, height_m = found.centre.tolist()
    cone = Cone(x, y, dx, dy, found.r, 0.0, height_m)
    se = float(np.hypot(0.6, 0.02 * dbh)) if options.method == "default" else np.nan
    stated = Assessment(dbh, se).adding(judge("points", {"on_cylinder": found.inlier_share}))
    return StemMeasure(cone, stated, points=found.points)


def by_the_paper(
    cloud: PointCloud,
    groups: list[np.ndarray],
    frames: list[TreeFrame],
    weights: np.ndarray | None,
    options: MeasureOptions,
) -> list[StemMeasure]:
    """The published method on the points of each tree, in its own frame: one measure a group, in order."""
    # Unweighted points use the exponent of their own kind: surface samples fill the stem, LiDAR lies on it.
    kind = options.weights if options.weights != "none" else "opacity" if "opacity" in cloud.attributes else "intensity"
    published = PublishedOptions(circle=SolidCircle(power=PAPER_POWER[kind]))
    results = measure_published(_weighted(groups, frames, weights), options.bh_m, published, options.seed)
    # The published method has no standard error; its bias depends on how the points fill the stem.
    return [
        _along_taper(frame, group, result, np.zeros(2), options.bh_m)
        for frame, group, result in zip(frames, groups, results, strict=True)
    ]


def _along_taper(
    frame: TreeFrame, group: np.ndarray, result: PublishedResult, slope: np.ndarray, bh_m: float
) -> StemMeasure:
    """What the taper of the slices says of a stem, without an error (``unchecked``). slope: (2,) of its axis."""
    taper = result.taper
    if not np.isfinite(frame.ground):
        return refuse("no_ground", points=len(group))
    if taper is None:
        few = len(result.slices) < TaperRansac.least_inliers
        return refuse("few_slices" if few else "no_taper", points=len(group))
    used = result.slices[taper.inliers]
    x, y, dx, dy = (float(value) for value in (*np.median(used[:, 1:3], axis=0), *slope))
    cone = Cone(x, y, dx, dy, taper.at_bh_cm / 200, taper.slope_cm_m / 200, bh_m)
    stated = Assessment(taper.at_bh_cm, np.nan, flag="check", reasons=("unchecked",))
    return StemMeasure(cone, stated, 0.0, len(group), len(used), taper.slope_cm_m)


def _weighted(
    groups: list[np.ndarray], frames: list[TreeFrame], weights: np.ndarray | None
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points with a known height and their weights, per tree."""
    known = [np.isfinite(frame.points[:, 2]) for frame in frames]
    return [
        (frame.points[sure], np.ones(sure.sum()) if weights is None else weights[group[sure]])
        for group, frame, sure in zip(groups, frames, known, strict=True)
    ]


def by_filling(
    groups: list[np.ndarray], frames: list[TreeFrame], weights: np.ndarray | None, options: MeasureOptions
) -> list[StemMeasure]:
    """Stems that their points fill: solid circles along the axis and the taper RANSAC, draws seeded as in
    :func:`measure_published`. The error is what such points gave on rendered plots, not less.

    A first pass gives the axis (median slope of the circle centres); the points are sheared along it for the second.
    """
    published, bh_m = PublishedOptions(top_m=5.0, taper=TaperRansac(steepest_cm_m=2.5)), options.bh_m
    stems, seeds = _in_own_order(_weighted(groups, frames, weights), options.seed)
    slopes = [_axis_slope(table) for table in _circles(stems, published, seeds)]
    sheared = [
        (np.column_stack([points[:, :2] - np.outer(points[:, 2] - bh_m, slope), points[:, 2]]), weight)
        for (points, weight), slope in zip(stems, slopes, strict=True)
    ]
    tables = _circles(sheared, published, seeds)
    measures = []
    for frame, group, table, slope, own in zip(frames, groups, tables, slopes, seeds, strict=True):
        table = table * (1.0, 1.0, 1.0, np.sqrt(np.cos(np.arctan(np.hypot(*slope)))))
        taper = taper_ransac(table[:, 0], table[:, 3], bh_m, published.taper, own)
        measured = _along_taper(frame, group, PublishedResult(table, taper), slope, bh_m)
        if measured.assessment.measured and taper is not None:
            se = float(np.sqrt(taper.se_cm**2 + FILLED_SE_CM**2 + (FILLED_SE_SHARE * taper.at_bh_cm) ** 2))
            # The slices that agree should surround breast height.
            near = bool((np.abs(table[taper.inliers, 0] - bh_m) < 0.3).any())
            reasons = ("wide_error" if near else "no_taper",)
            measured = measured.assessed(Assessment(taper.at_bh_cm, se, flag="check", reasons=reasons))
        measures.append(measured)
    return measures
