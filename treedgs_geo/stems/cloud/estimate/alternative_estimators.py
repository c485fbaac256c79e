"""Stems by other methods than the default: cylinder, the published circles, filled stems."""

from __future__ import annotations

import numpy as np

from ....pointcloud.cloud import PointCloud
from ...geometry.circles import SolidCircle
from ...geometry.cone import Cone
from ...geometry.cylinder import fit_cylinder
from ...quality.assessment import Assessment
from ...quality.limits import judge
from ...quality.priors import USUAL_TAPER_CM_M
from .frames import TreeFrame
from .options import MeasureOptions
from .published import PublishedOptions, PublishedResult, measure_filled, measure_published
from .stem_measure import StemMeasure, refuse

#: Exponent p of eq:weighted_score by what weighs the points (paper.tex: held-out validation).
PAPER_POWER = {"opacity": 0.6, "intensity": 0.85, "range_intensity": 0.85}
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
    slope = found.axis[:2] / max(found.axis[2], 1e-6)
    cone = Cone(
        float(found.centre[0]),
        float(found.centre[1]),
        float(slope[0]),
        float(slope[1]),
        found.r,
        0.0,
        float(found.centre[2]),
    )
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
    measures = []
    for frame, group, result in zip(frames, groups, results, strict=True):
        # The published method has no standard error; its bias depends on how the points fill the stem.
        measures.append(_along_taper(frame, group, result, published.taper.least_inliers, np.zeros(2), options.bh_m))
    return measures


def _along_taper(
    frame: TreeFrame, group: np.ndarray, result: PublishedResult, min_slices: int, slope: np.ndarray, bh_m: float
) -> StemMeasure:
    """What the taper of the slices says of a stem, without an error (``unchecked``). slope: (2,) of its axis."""
    taper = result.taper
    if not np.isfinite(frame.ground):
        return refuse("no_ground", points=len(group))
    if taper is None:
        return refuse("few_slices" if len(result.slices) < min_slices else "no_taper", points=len(group))
    used = result.slices[taper.inliers]
    x, y, dx, dy = (float(value) for value in (*np.median(used[:, 1:3], axis=0), *slope))
    cone = Cone(x, y, dx, dy, taper.at_bh_cm / 200, taper.slope_cm_m / 200, bh_m)
    stated = Assessment(taper.at_bh_cm, np.nan, flag="check", reasons=("unchecked",))
    return StemMeasure(cone, stated, 0.0, len(group), len(used), taper.slope_cm_m)


def _weighted(
    groups: list[np.ndarray], frames: list[TreeFrame], weights: np.ndarray | None
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points with a known height and their weights, per tree."""
    stems = []
    for group, frame in zip(groups, frames, strict=True):
        known = np.isfinite(frame.points[:, 2])
        weight = np.ones(len(group)) if weights is None else weights[group]
        stems.append((frame.points[known], weight[known]))
    return stems


def by_filling(
    groups: list[np.ndarray], frames: list[TreeFrame], weights: np.ndarray | None, options: MeasureOptions
) -> list[StemMeasure]:
    """Stems that their points fill. The error is what such points gave on rendered plots, not less."""
    measures = []
    results = measure_filled(_weighted(groups, frames, weights), options.bh_m, seed=options.seed)
    for frame, group, (result, slope) in zip(frames, groups, results, strict=True):
        measured, taper = _along_taper(frame, group, result, 10, slope, options.bh_m), result.taper
        if measured.assessment.measured and taper is not None:
            se = float(np.sqrt(taper.se_cm**2 + FILLED_SE_CM**2 + (FILLED_SE_SHARE * taper.at_bh_cm) ** 2))
            # The slices that agree should surround breast height.
            near = bool((np.abs(result.slices[taper.inliers, 0] - options.bh_m) < 0.3).any())
            reasons = ("wide_error" if near else "no_taper",)
            measured = measured.assessed(Assessment(taper.at_bh_cm, se, flag="check", reasons=reasons))
        measures.append(measured)
    return measures
