"""One stem from its points: the default estimator, with its error and the reasons to doubt it.

A leaning, tapering cone is fitted to the bark points of a window around breast height that opens only as far as the
points need (dense scans: +-0.5 m; drone LiDAR: the whole lower stem). Sectors that hold many points weigh less, because
a stem is not round and what repeats there is its shape, not noise. Slices across the axis give the taper, its model and
the spread between heights.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ...shapes.cone import Cone, fit_cone
from ...shapes.cone_kernels import BEND_SD, TAPER_PRIOR
from ...shapes.ellipse import fit_ellipse
from ...shapes.section_kernels import SECTORS as _SECTORS
from ...shapes.section_kernels import bark_cells, bark_weights, slice_rows
from ...shapes.slices import across_axis, slice_heights
from ...shapes.taper import Taper, taper_line
from ..segmentation.evidence import FAINT, usual
from ..segmentation.judging import ConeStem
from ..segmentation.options import SegmentOptions
from ..segmentation.segment import search_points
from ..segmentation.sensors import Sensor
from .bow import LEAST_CONES, STEP_M, BowedAxis, follow_axis, is_bowed

#: Windows (below, above breast height) that are tried in turn until the bark in them is plenty.
WINDOWS_M = ((0.35, 0.35), (0.5, 0.6), (0.7, 1.0), (0.9, 1.8), (0.95, 2.8))
#: Bark points that are plenty for a window: sectors x rows are counted, not points.
PLENTY_CELLS, PLENTY_POINTS = 100, 400
#: Out-of-roundness of real stems, share of the radius (1 sd of a 60 degree sector).
ROUNDNESS = 0.02
#: Error that no cloud resolves: bark, ground height, breast height (cm), and the share of the diameter it grows by.
FLOOR_CM, FLOOR_SHARE = 0.25, 0.010
#: Error of terrestrial scans that the spread of the points about the bark tells of, share of it on the diameter: where
#: walks with a mobile scanner drift, the walls of a stem do not lie where the stem is, however many points show them
#: (even seeds of ``benchmarks/clouds/dense_clouds.py``).
DRIFT_SHARE = 0.25
#: The same of half rings, share of the shape's error on top of it, below this arc.
HALF_RING, HALF_RING_DEG = 0.75, 200.0
#: What of each part counts in the error of drone LiDAR (``benchmarks/clouds/interval_coverage.py``): the fit at the
#: noise the points have, its clutter, the shape that shows, the slices, the noise itself (half-hit rims lie outside
#: the bark), a share of the diameter, and a floor, cm: flight lines are off by a centimetre each, one side of the bark
#: against the other, which the spread of the points hardly shows.
ULS_FIT, ULS_SHAPE, ULS_HEIGHT, ULS_NOISE, ULS_SHARE, ULS_FLOOR_CM = 1.0, 0.5, 0.25, 0.2, 0.004, 0.8
#: An arc below this does not show the shape, degrees.
SHAPE_SEEN_DEG = 270.0
#: Where the slices show butt swell, the cone is fitted above this height, m.
ABOVE_BUTT_M = 0.8
#: Slices along the stem and the cone at breast height: this many standard errors (of both) apart is a doubt.
DISAGREE_SE = 4.0
#: Where a quarter of the points is stray, this much of the circumference has to hold as many points as bark does.
CLEAR_ARC_DEG = 240.0
#: A straightened stem whose diameter differs by more than this share from its short cone's was not followed rightly.
BOWED_SHARE = 0.2


@dataclass(frozen=True)
class StemMeasure:
    """What the points say about one stem. dbh_cm is ``None`` when refused; reasons are keys of ``quality.REASONS``."""

    cone: Cone | None
    dbh_cm: float | None
    se_cm: float | None
    flag: Literal["ok", "check", "reject"]
    reasons: tuple[str, ...]
    arc_deg: float = 0.0
    points: int = 0
    slices: int = 0
    taper_cm_m: float | None = None
    details: dict[str, float] = field(default_factory=dict)


def refuse(*reasons: str, cone: Cone | None = None, points: int = 0) -> StemMeasure:
    """A stem without a number."""
    return StemMeasure(cone, None, None, "reject", reasons, points=points)


def measure_points(
    points: np.ndarray,
    weights: np.ndarray | None,
    sensor: Sensor,
    bh_m: float = 1.37,
    options: SegmentOptions | None = None,
    start: Cone | None = None,
    others: np.ndarray | None = None,
    upright: bool = False,
) -> StemMeasure:
    """Measure one stem from its (N, 3) points: local metres, z above the ground at its foot.

    weights: (N,) reliabilities or ``None``. start: a cone from segmentation; otherwise the stem is searched in the
    points. others: (M, 3) points around the stem that are not its own: where shrubs crowd it, its points count less.
    upright: the points have been straightened (:mod:`.bow`): no bow is looked for.
    """
    options = options or SegmentOptions()
    points = np.ascontiguousarray(points, dtype=float)
    others = np.empty((0, 3)) if others is None else np.ascontiguousarray(others, dtype=float)
    known = np.isfinite(points).all(axis=1)
    if not known.all():
        points, weights = points[known], None if weights is None else weights[known]
    near_bh = np.abs(points[:, 2] - bh_m) < 1.0
    if len(points) < sensor.least_points or near_bh.sum() < sensor.least_points // 3:
        return refuse("few_points", points=len(points))
    cone = start
    if cone is None:
        stem = _search(points, weights, sensor, options)
        if stem is None:
            return refuse("not_round", points=len(points))
        cone, sensor = stem.cone, sensor.at_noise(stem.noise_m or 0.0)
    fitted = _window_fit(points, weights, cone, sensor, bh_m, others)
    if fitted is None:
        return refuse("not_round", cone=cone, points=len(points))
    cone, window, on = fitted
    # A short window, where points are plenty, shows no bow and needs no straightening.
    if not sensor.solid and not upright and window[1] - window[0] >= LEAST_CONES * STEP_M:
        pool = np.concatenate([points, others])
        axis = follow_axis(pool, cone, sensor, bh_m)
        if axis is not None and is_bowed(axis, cone, window):
            strength = None if weights is None else np.r_[weights, np.full(len(others), np.median(weights))]
            return _measure_bowed(pool, strength, len(points), axis, sensor, bh_m, options)
    slices = _slices(points, weights, cone, sensor, bh_m)
    taper = taper_line(slices[:, 0], slices[:, 1], slices[:, 2], bh_m, slices_per_independent=3.0)
    if taper is not None and taper.model == "butt" and window[0] < ABOVE_BUTT_M:
        # The cone knows no swell: it is fitted again above it.
        above = points[:, 2] > ABOVE_BUTT_M
        again = _window_fit(points[above], None if weights is None else weights[above], cone, sensor, bh_m, others)
        if again is not None:
            cone, (_, high), on_above = again
            window, on = (ABOVE_BUTT_M, high), np.zeros(len(points), bool)
            on[above] = on_above
    return _conclude(points, cone, window, on, slices, taper, sensor, bh_m, options, others)


def _measure_bowed(
    pool: np.ndarray,
    weights: np.ndarray | None,
    own: int,
    axis: BowedAxis,
    sensor: Sensor,
    bh_m: float,
    options: SegmentOptions,
) -> StemMeasure:
    """The stem set upright along its curved axis and measured there; ``pool``: (N, 3) all points near it, the first
    ``own`` of them its own."""
    (x, y), (dx, dy) = (values[0] for values in axis.at(bh_m))
    pool = axis.straightened(pool, bh_m)
    start = Cone(float(x), float(y), 0.0, 0.0, axis.radius_m, TAPER_PRIOR, bh_m, sensor.cap_m)
    # The straight cone that chose the points left some of the bark out.
    mine = start.residuals(pool) < 2.5 * sensor.cap_m
    mine[:own] = True
    measured = measure_points(
        pool[mine], None if weights is None else weights[mine], sensor, bh_m, options, start, pool[~mine], upright=True
    )
    if measured.cone is None or measured.dbh_cm is None:
        return measured
    if abs(measured.dbh_cm / (200 * axis.radius_m) - 1) > BOWED_SHARE:
        return refuse("disagree", cone=measured.cone, points=measured.points)
    leaning = replace(measured.cone, dx=measured.cone.dx + float(dx), dy=measured.cone.dy + float(dy))
    if leaning.lean_deg <= 15:
        return replace(measured, cone=leaning)
    return replace(measured, cone=leaning, flag="check", reasons=tuple(dict.fromkeys([*measured.reasons, "lean"])))


def _search(points: np.ndarray, weights: np.ndarray | None, sensor: Sensor, options: SegmentOptions) -> ConeStem | None:
    return max(search_points(points, weights, sensor, options), key=lambda stem: stem.score, default=None)


def _window_fit(
    points: np.ndarray, weights: np.ndarray | None, cone: Cone, sensor: Sensor, bh_m: float, others: np.ndarray
) -> tuple[Cone, tuple[float, float], np.ndarray] | None:
    """The cone in the smallest window with plenty of bark; ``(cone, window, on-bark mask over points)``."""
    last = None
    for below, above in WINDOWS_M:
        window = bh_m - below, bh_m + above
        inside = (points[:, 2] >= window[0]) & (points[:, 2] <= window[1])
        if inside.sum() < 12:
            continue
        x, y = cone.centre(bh_m)
        start = Cone(float(x), float(y), cone.dx, cone.dy, float(cone.radius(bh_m)), cone.taper, bh_m, cone.sigma)
        near = points[inside]
        balance, purity = bark_weights(near, others, start.vector, start.h_ref, start.sigma, sensor.floor_m, ROUNDNESS)
        balanced = balance * purity**2
        if weights is not None:
            balanced = balanced * weights[inside]
        # Short windows cannot tell lean and taper: they are held near what the long stem says.
        length = below + above
        fitted = fit_cone(
            near,
            start,
            balanced,
            (max(0.02, 3 * sensor.floor_m),),
            sensor.floor_m,
            sensor.cap_m,
            lean_sd=0.05 + 0.05 * length,
            taper_sd=0.002 + 0.001 * length,
            bend_sd=BEND_SD if length > 2 else 0.0,
        )
        if fitted is None:
            continue
        tolerance = max(3 * fitted.sigma, 0.01)
        residual = fitted.residuals(points)
        on = inside & ((residual < tolerance) if sensor.solid else (np.abs(residual) < tolerance))
        if on.sum() >= PLENTY_POINTS and bark_cells(points, on, fitted.vector, fitted.h_ref) >= PLENTY_CELLS:
            return fitted, window, on
        last = fitted, window, on
    return last


def _slices(points: np.ndarray, weights: np.ndarray | None, cone: Cone, sensor: Sensor, bh_m: float) -> np.ndarray:
    """(S, 5): height, diameter cm, its standard error cm, arc deg, 1 if the centre was free."""
    on = np.abs(cone.residuals(points)) < max(4 * cone.sigma, 0.03)
    band = on & (points[:, 2] > 0.3) & (points[:, 2] < 4.5)
    if band.sum() < 10:
        return np.empty((0, 5))
    chosen = points[band]
    # Thick enough for about 40 points, between 0.1 m and 1 m.
    per_metre = len(chosen) / max(float(np.ptp(chosen[:, 2])), 0.5)
    thickness = float(np.clip(40.0 / per_metre, 0.1, 1.0))
    centres = slice_heights(0.3 + thickness / 2, min(4.5, chosen[:, 2].max()) - thickness / 2, 0.1)
    flat = across_axis(chosen, cone)
    order = np.argsort(chosen[:, 2], kind="stable")
    strength = np.ones(len(chosen)) if weights is None else np.asarray(weights, float)[band][order]
    return slice_rows(
        flat[order],
        chosen[order, 2],
        strength,
        centres,
        thickness,
        float(cone.r),
        float(cone.taper),
        float(cone.h_ref),
        max(cone.sigma, sensor.floor_m),
        sensor.floor_m,
    )


def _conclude(
    points: np.ndarray,
    cone: Cone,
    window: tuple[float, float],
    on: np.ndarray,
    slices: np.ndarray,
    taper: Taper | None,
    sensor: Sensor,
    bh_m: float,
    options: SegmentOptions,
    others: np.ndarray,
) -> StemMeasure:
    """DBH, its standard error, flag and reasons."""
    # Breast height is measured along the stem: a leaning one reaches it lower.
    bh_m = bh_m * float(np.cos(np.radians(cone.lean_deg)))
    radius = float(cone.radius(bh_m))
    inside_window = (points[:, 2] >= window[0]) & (points[:, 2] <= window[1])
    residual = cone.residuals(points[inside_window])
    near = np.abs(residual[np.abs(residual) < 2.5 * sensor.cap_m])
    # The fit's own sigma has a floor, which clean clouds lie below.
    noise = float(np.clip(1.4826 * np.median(near), 0.002, sensor.cap_m)) if len(near) >= 6 else cone.sigma
    sector = np.floor((cone.azimuths(points[on]) + np.pi) / (2 * np.pi) * _SECTORS).astype(int) % _SECTORS
    per_sector = np.bincount(sector, minlength=_SECTORS)
    # Strays that fill a gap are few against the bark beside it.
    arc = 360.0 / _SECTORS * np.count_nonzero(per_sector >= max(1.0, FAINT * usual(per_sector)))
    purity = (
        float(
            np.mean(bark_weights(points[on], others, cone.vector, cone.h_ref, cone.sigma, sensor.floor_m, ROUNDNESS)[1])
        )
        if on.any()
        else 0.0
    )
    dbh = 200 * radius
    covariance = cone.covariance if cone.covariance is not None else np.full((8, 8), np.nan)
    reach = np.array([0, 0, 0, 0, 1.0, bh_m - cone.h_ref, 0, 0])
    fit_se = 200 * float(np.sqrt(max(reach @ covariance @ reach, 0)))
    lobes = _lobes(points[on], cone)
    # A tape reads the girth: of an oval section that is a little more than the mean radius tells.
    dbh *= _girth_factor(points[on], cone, sensor)
    shape_se = 200 * radius * max(ROUNDNESS, lobes) / np.sqrt(max(arc / 60.0, 1.0))
    height_se = 0.0
    slope = None
    if taper is not None:
        slope = taper.slope_cm_m if taper.model != "constant" else None
        height_se = taper.se_cm
    # Bark that cannot be told from twigs: half the twigs' reach, in the share that they have.
    clutter_se = (1 - purity) * 200 * cone.sigma
    # Points scatter to all sides: the mean distance from the axis of a ring as thick as this is too large.
    curve_se = 100 * noise**2 / radius
    parts = (fit_se, clutter_se, curve_se, shape_se, 0.5 * height_se, FLOOR_CM, FLOOR_SHARE * dbh)
    # Half a ring does not show an oval section's other half.
    hidden_se = HALF_RING * shape_se if arc < HALF_RING_DEG else 0.0
    told_parts = (*parts, DRIFT_SHARE * 200 * noise, hidden_se)
    # Doubts go by this cautious sum for every kind of cloud; the error that is told is calibrated where it could be.
    se, told_se = float(np.sqrt(np.square(parts).sum())), float(np.sqrt(np.square(told_parts).sum()))
    if sensor.calibrated:
        seen = lobes if arc >= SHAPE_SEEN_DEG else max(ROUNDNESS, lobes)
        seen_se = 200 * radius * seen / np.sqrt(max(arc / 60.0, 1.0))
        known = (
            ULS_FIT * fit_se * min(noise / cone.sigma, 1.0),
            clutter_se,
            ULS_SHAPE * seen_se,
            ULS_HEIGHT * height_se,
            ULS_NOISE * 200 * noise,
            ULS_SHARE * dbh,
            ULS_FLOOR_CM,
        )
        told_se = float(np.sqrt(np.square(known).sum()))
    reject, check = [], []
    # Points that were given as this stem's, lie in the window, and are on no side of the fitted bark.
    stray = float(np.mean(residual > max(4 * cone.sigma, 0.03))) if len(residual) else 0.0
    if stray > 0.5:
        reject.append("not_round")
    elif stray > 0.25:
        check.append("not_round")
        # Strays among few sectors of bark: they fill the gap and pull the circle into it.
        if 360.0 / _SECTORS * np.count_nonzero(per_sector > 0.25 * np.percentile(per_sector, 75)) < CLEAR_ARC_DEG:
            reject.append("short_arc")
    if arc < 90:
        reject.append("short_arc")
    elif arc < 180:
        check.append("short_arc")
    if not sensor.solid:
        deep = float(np.mean(residual < -max(4 * cone.sigma, 0.03))) if len(residual) else 0.0
        if deep > 0.25:
            reject.append("not_round")
        elif deep > 0.12:
            check.append("not_round")
    if lobes > 0.15:
        reject.append("not_round")
    elif lobes > 0.10:
        check.append("not_round")
    if cone.lean_deg > options.max_lean_deg:
        reject.append("lean")
    elif cone.lean_deg > 15:
        check.append("lean")
    if len(slices) < 5:
        check.append("few_slices")
    elif taper is not None and (taper.slope_cm_m > 2.0 or taper.slope_cm_m < -6.0):
        check.append("no_taper")
    if len(slices) >= 5 and taper is not None and abs(taper.at_bh_cm - dbh) > DISAGREE_SE * np.hypot(se, taper.se_cm):
        check.append("disagree")
    if purity < 0.6:
        (reject if purity < 0.35 and not sensor.solid else check).append("occluded")
    if on.sum() < sensor.least_points:
        reject.append("few_points")
    elif np.count_nonzero(np.abs(points[on, 2] - bh_m) < 0.5) < sensor.least_points // 4:
        # The stem shows above and below, but not where it is measured.
        check.append("few_points")
    if dbh > options.max_dbh_cm:
        reject.append("too_large")
    if se > max(2.0, 0.1 * dbh):
        reject.append("wide_error")
    elif se > max(1.0, 0.06 * dbh):
        check.append("wide_error")
    if len(set(check)) >= 3:
        # Three doubts at once were gross errors on sparse clouds more often than not.
        reject.append(check[0])
    flag: Literal["ok", "check", "reject"] = "reject" if reject else "check" if check else "ok"
    reasons = tuple(dict.fromkeys([*reject, *check]))
    details = {
        "noise_m": noise,
        "fit_se": fit_se,
        "lobes": lobes,
        "height_se": height_se,
        "shape_se": shape_se,
        "purity": purity,
        "taper_at_bh": taper.at_bh_cm if taper else np.nan,
        "low": window[0],
        "high": window[1],
    }
    return StemMeasure(
        cone,
        None if reject else dbh,
        None if reject else told_se,
        flag,
        reasons,
        arc,
        int(on.sum()),
        len(slices),
        slope,
        details,
    )


def _girth_factor(points: np.ndarray, cone: Cone, sensor: Sensor) -> float:
    """Girth / pi over the mean diameter of the section's ellipse; 1 where the circle is the better model."""
    if sensor.solid or len(points) < 60:
        return 1.0
    some = points[:: max(len(points) // 600, 1)]
    flat = across_axis(some, cone) * (float(cone.r) / np.maximum(cone.radius(some[:, 2]), 1e-3))[:, None]
    oval = fit_ellipse(flat, noise_m=max(cone.sigma, sensor.floor_m), start=np.array([0.0, 0.0, float(cone.r)]))
    return oval.girth_d / (oval.a + oval.b) if oval is not None and oval.gain > 0 else 1.0


def _lobes(points: np.ndarray, cone: Cone) -> float:
    """Amplitude of the 2nd to 4th harmonics of the cross-section over the radius: 0 = circle, > 0.1 = buttresses."""
    if len(points) < 40:
        return 0.0
    angle, residual = cone.azimuths(points), cone.residuals(points)
    sector = np.floor((angle + np.pi) / (2 * np.pi) * _SECTORS).astype(int) % _SECTORS
    count = np.bincount(sector, minlength=_SECTORS)
    if (count > 0).sum() < 16:
        return 0.0
    mean = np.bincount(sector, residual, minlength=_SECTORS) / np.maximum(count, 1)
    middle = (np.arange(_SECTORS) + 0.5) / _SECTORS * 2 * np.pi - np.pi
    filled = count > 0
    waves = [wave(k * middle[filled]) for k in (1, 2, 3, 4) for wave in (np.cos, np.sin)]
    basis = np.column_stack([np.ones(filled.sum()), *waves])
    # Sector means are noisy where points are few: shrink by their noise.
    noise = cone.sigma**2 / np.maximum(count[filled], 1)
    shape = (0.03 * cone.r) ** 2
    weight = 1 / (noise + 1e-8)
    ridge = np.diag([0.0] + [1 / shape] * 8)
    weighted = (basis * weight[:, None]).T
    coefficient = np.linalg.solve(weighted @ basis + ridge, weighted @ mean[filled])
    return float(np.sqrt((coefficient[3:] ** 2).sum()) / cone.r)


def rebased(cone: Cone, shift_xy: np.ndarray, shift_h: float) -> Cone:
    """The cone in a frame whose origin moved by ``shift_xy`` and whose heights lost ``shift_h``."""
    return replace(cone, x=cone.x - shift_xy[0], y=cone.y - shift_xy[1], h_ref=cone.h_ref - shift_h)
