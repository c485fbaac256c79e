"""One stem from its points: the default estimator, with its error and the reasons that speak against it.

A leaning, tapering cone is fitted to the bark points of a window around breast height that opens only as far as the
points need (dense scans: +-0.5 m; drone LiDAR: the whole lower stem). Sectors that hold many points weigh less, because
a stem is not round and what repeats there is its shape, not noise. Slices across the axis give the taper, its model and
the spread between heights.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...geometry.cone import Cone, fit_cone
from ...geometry.cone_kernels import BEND_SD
from ...geometry.section_kernels import bark_cells, bark_weights, slice_rows
from ...geometry.slices import across_axis, slice_heights
from ...geometry.taper import taper_line
from ...quality.assessment import Assessment
from ...quality.findings import Findings
from ...quality.limits import judge
from ...quality.priors import BREAST_HEIGHT_M, USUAL_TAPER
from ..propose.options import SegmentOptions
from ..propose.segment import search_tile, without_doubles
from ..propose.sensors import Sensor
from .rings import Inside, Rings, inner_face, kurtosis, without_waves
from .surface_quality import ROUNDNESS, Bark, FittedStem, diameter_errors, girth_factor, uneven_ring
from .sweep import LEAST_CONES, STEP_M, BowedAxis, follow_axis, is_bowed


@dataclass(frozen=True)
class StemMeasure:
    """One stem's measurement. cone: in the tree's own frame, metres. assessment: diameter, error, flag and reasons.
    arc_deg: circumference covered by bark. taper_cm_m: change of the diameter with height. noise_m: spread of the
    points about the bark, NaN unknown. inside: points on its inner side."""

    cone: Cone | None
    assessment: Assessment
    arc_deg: float = 0.0
    points: int = 0
    slices: int = 0
    taper_cm_m: float | None = None
    noise_m: float = float("nan")
    inside: Inside = Inside()

    def assessed(self, assessment: Assessment, cone: Cone | None = None) -> StemMeasure:
        """The same with more evidence; cone: instead of its own."""
        return replace(self, assessment=assessment, cone=cone or self.cone)


def refuse(*reasons: str, cone: Cone | None = None, points: int = 0) -> StemMeasure:
    """A stem without a number."""
    return StemMeasure(cone, Assessment.refused(*reasons), points=points)


#: Windows (below, above breast height), m, that are tried in turn until the bark in them is plenty. None reaches into
#: the butt swell below half a metre: a straight cone through it reads too thick at breast height. Beginning 25 cm
#: higher costs more than the rest of the swell: three rendered plots and a simulated one, rms 0.43 against 0.36 cm, and
#: half stems 0.33 against 0.20.
WINDOWS_M = ((0.35, 0.35), (0.5, 0.6), (0.6, 1.0), (0.75, 1.8), (0.85, 2.8))
#: Bark points that are plenty for a window: sectors x rows are counted, not points.
PLENTY_CELLS, PLENTY_POINTS = 100, 400
#: Points count as bark under a coat up to so many of its spreads outside its face; error of the diameter in spreads.
COAT_REACH_SD, COAT_SE = 1.5, 0.5
#: Error of a cone that narrows too fast, share of what it is too thick by if it is right at the top.
TOUCHED_SE = 0.6
#: Error of a ring that is thick on one side, share of the excess on the diameter.
UNEVEN_SE = 0.5
#: Error of the diameter of a flat ring, in the spread of its points on the diameter.
FLAT_SE = 1.0


def measure_points(
    points: np.ndarray,
    weights: np.ndarray | None,
    sensor: Sensor,
    bh_m: float = BREAST_HEIGHT_M,
    options: SegmentOptions | None = None,
    start: Cone | None = None,
    others: np.ndarray | None = None,
    upright: bool = False,
    bare: bool = False,
) -> StemMeasure:
    """Measure one stem from its (N, 3) points: local metres, z above the ground at its foot.

    weights: (N,) reliabilities or ``None``. start: a cone from segmentation; otherwise the stem is searched in the
    points. others: (M, 3) points around the stem that are not its own: where shrubs crowd it, its points count less.
    upright: the points have been straightened (:mod:`.sweep`): no bow is looked for. bare: no coat is looked for.
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
        stems = without_doubles(search_tile(points, weights, sensor, options, follow=False))
        stem = max(stems, key=lambda stem: stem.seen.score, default=None)
        if stem is None:
            return refuse("not_round", points=len(points))
        cone, sensor = stem.cone, sensor.at_noise(stem.noise_m or 0.0)
    fitted = _window_fit(points, weights, cone, sensor, bh_m, others)
    if fitted is None:
        return refuse("not_round", cone=cone, points=len(points))
    cone, window, on = fitted
    inside = Inside()
    if not sensor.solid and not bare:
        pool = np.concatenate([points, others])
        inside, rings = Inside.of(pool, cone, window), Rings.of(pool, cone, window)
        inner = replace(cone, r=cone.r + rings.inner_m, sigma=rings.inner_sd)
        face = inner if rings.is_coat else inner_face(pool, cone, window, sensor.floor_m)
        if face is not None:
            return _measure_under_coat(pool, weights, face, cone, inside, sensor, bh_m, options)
        if rings.inner_deg:
            measured = measure_points(points, weights, sensor, bh_m, options, start, others, upright, bare=True)
            # Which of the two is the bark is not known: the inner one by its share of the points.
            off_cm = 200 * abs(rings.inner_m) * float(np.sqrt(rings.share * (1 - rings.share)))
            two = judge("points", {"twice_cm": rings.twice_cm})
            return replace(measured.assessed(measured.assessment.widened(off_cm).adding(two)), inside=inside)
    # A short window, where points are plenty, shows no bow and needs no straightening.
    if not sensor.solid and not upright and window[1] - window[0] >= LEAST_CONES * STEP_M:
        pool = np.concatenate([points, others])
        axis = follow_axis(pool, cone, sensor, bh_m)
        if axis is not None and is_bowed(axis, cone, window):
            strength = None if weights is None else np.r_[weights, np.full(len(others), np.median(weights))]
            return _measure_bowed(pool, strength, len(points), axis, sensor, bh_m, options)
    slices = _slices(points, weights, cone, sensor)
    taper = taper_line(slices[:, 0], slices[:, 1], slices[:, 2], bh_m, slices_per_independent=3.0)
    measured = _conclude(FittedStem(points, cone, window, on, slices, taper, others), sensor, bh_m, options)
    return replace(measured, inside=inside)


def _measure_under_coat(
    pool: np.ndarray,
    weights: np.ndarray | None,
    face: Cone,
    cone: Cone,
    inside: Inside,
    sensor: Sensor,
    bh_m: float,
    options: SegmentOptions,
) -> StemMeasure:
    """The stem measured by the bark that shows through leaves, ivy or moss: the inner ``face`` of what ``cone`` was
    fitted to. ``pool``: (N, 3) all points near it. ``inside``: what shows it."""
    on_bark = face.residuals(pool) < COAT_REACH_SD * face.sigma
    if weights is not None:
        weights = np.r_[weights, np.full(len(pool) - len(weights), np.median(weights))][on_bark]
    measured = measure_points(pool[on_bark], weights, sensor, bh_m, options, face, bare=True)
    found = judge("points", {"coat_cm": 100 * (cone.r - face.r)})
    measured = measured.assessed(measured.assessment.widened(COAT_SE * 200 * face.sigma).adding(found))
    return replace(measured, inside=replace(inside, depth_m=0.0))


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
    start = Cone(float(x), float(y), 0.0, 0.0, axis.radius_m, USUAL_TAPER, bh_m, sensor.cap_m)
    # The straight cone that chose the points left some of the bark out.
    mine = start.residuals(pool) < 2.5 * sensor.cap_m
    mine[:own] = True
    measured = measure_points(
        pool[mine], None if weights is None else weights[mine], sensor, bh_m, options, start, pool[~mine], upright=True
    )
    stated = measured.assessment
    if measured.cone is None or not stated.measured:
        return measured
    leaning = replace(measured.cone, dx=measured.cone.dx + float(dx), dy=measured.cone.dy + float(dy))
    bowed = {"bowed_share": abs(stated.dbh_cm / (200 * axis.radius_m) - 1), "bowed_lean_deg": leaning.lean_deg}
    return measured.assessed(stated.adding(judge("points", bowed)), leaning)


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
        # Short windows do not show lean and taper: they are held near what the long stem says.
        length, scales = below + above, (max(0.02, 3 * sensor.floor_m),)
        lean_sd, taper_sd, bend_sd = 0.05 + 0.05 * length, 0.002 + 0.001 * length, BEND_SD if length > 2 else 0.0
        fitted = fit_cone(near, start, balanced, scales, sensor.floor_m, sensor.cap_m, lean_sd, taper_sd, bend_sd)
        if fitted is None:
            continue
        tolerance = max(3 * fitted.sigma, 0.01)
        residual = fitted.residuals(points)
        on = inside & ((residual < tolerance) if sensor.solid else (np.abs(residual) < tolerance))
        if on.sum() >= PLENTY_POINTS and bark_cells(points, on, fitted.vector, fitted.h_ref) >= PLENTY_CELLS:
            return fitted, window, on
        last = fitted, window, on
    return last


def _slices(points: np.ndarray, weights: np.ndarray | None, cone: Cone, sensor: Sensor) -> np.ndarray:
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
    about = float(cone.r), float(cone.taper), float(cone.h_ref), max(cone.sigma, sensor.floor_m), sensor.floor_m
    return slice_rows(flat[order], chosen[order, 2], strength, centres, thickness, *about)


def _conclude(fitted: FittedStem, sensor: Sensor, bh_m: float, options: SegmentOptions) -> StemMeasure:
    """DBH, its standard error, flag and reasons."""
    # Breast height is measured along the stem: a leaning one reaches it lower.
    bh_m = bh_m * float(np.cos(np.radians(fitted.cone.lean_deg)))
    bark = Bark.of(fitted, sensor)
    # A tape reads the girth: of an oval section that is a little more than the mean radius gives.
    dbh_cm = 200 * float(fitted.cone.radius(bh_m)) * girth_factor(fitted.points[fitted.on], fitted.cone, sensor)
    cautious_cm, reported_cm = diameter_errors(fitted, bark, sensor, bh_m, dbh_cm)
    measured = _quantities(fitted, bark, sensor, bh_m, dbh_cm, cautious_cm)
    flat, (beside, remarks) = 0.0, _remarks(fitted, sensor, bh_m, dbh_cm)
    if not sensor.solid:
        # Without its waves: an oval stem is no flat ring.
        inside = fitted.points[(fitted.points[:, 2] >= fitted.window[0]) & (fitted.points[:, 2] <= fitted.window[1])]
        off = without_waves(fitted.cone.residuals(inside), fitted.cone.azimuths(inside))
        measured["kurtosis"] = kurtosis(off, bark.noise_m)
        # The bark may lie anywhere in a ring that does not heap up in its middle.
        flat = FLAT_SE * 200 * bark.noise_m if judge("points", {"kurtosis": measured["kurtosis"]}).reasons else 0.0
    settings = {
        "max_lean_deg": options.max_lean_deg,
        "max_dbh_cm": options.max_dbh_cm,
        "min_dbh_cm": 0.0,  # judged for every method at the end, in cloud.py
        "least_points": sensor.least_points,
        "least_at_bh": sensor.least_points // 4,
    }
    found = judge("points", measured, dbh_cm, settings)
    se_cm = float(np.hypot(reported_cm, np.hypot(flat, beside)))
    stated = Assessment(dbh_cm, se_cm, flag=found.flag("points"), reasons=found.reasons).adding(remarks)
    taper = fitted.taper.slope_cm_m if fitted.taper is not None and fitted.taper.model != "constant" else None
    on, slices = int(fitted.on.sum()), len(fitted.slices)
    return StemMeasure(fitted.cone, stated, bark.arc_deg, on, slices, taper, bark.noise_m)


def _remarks(fitted: FittedStem, sensor: Sensor, bh_m: float, dbh_cm: float) -> tuple[float, Findings]:
    """What speaks of leaves on one side, of another stem against this one, or of a pole, in drone LiDAR, whose windows
    are long: standard error, cm, and flags."""
    cone = fitted.cone
    if not sensor.calibrated or cone.covariance is None:
        return 0.0, Findings()
    narrows_cm_m, se_cm_m = -200 * cone.taper, 200 * float(np.sqrt(cone.covariance[5, 5]))
    pool = np.concatenate([fitted.points, fitted.others])
    pool = pool[(pool[:, 2] >= fitted.window[0]) & (pool[:, 2] <= fitted.window[1])]
    uneven, thick_m = uneven_ring(pool, cone)
    one_sided = judge("points", {"uneven": uneven})
    # A thinner stem that touches this one leaves it upwards: at the top of the window the cone is the stem's own.
    touched = judge("points", {"narrows_cm_m": narrows_cm_m}, dbh_cm)
    too_thick_cm = (narrows_cm_m + 200 * USUAL_TAPER) * (fitted.window[1] - bh_m)
    parts = UNEVEN_SE * 200 * thick_m * bool(one_sided.found), TOUCHED_SE * too_thick_cm * bool(touched.found)
    pole = judge("points", {"narrows_at_most_cm_m": narrows_cm_m + 2 * se_cm_m})
    return float(np.hypot(*parts)), one_sided + touched + pole


def _quantities(
    fitted: FittedStem, bark: Bark, sensor: Sensor, bh_m: float, dbh_cm: float, se_cm: float
) -> dict[str, float]:
    """A stem's measured quantities, for :func:`treedgs_geo.stems.quality.limits.judge`."""
    cone, taper, heights = fitted.cone, fitted.taper, fitted.points[fitted.on, 2]
    found: dict[str, float] = {
        # Points that were given as this stem's, lie in the window, and are on no side of the fitted bark.
        "stray": bark.share_beyond(cone, 1),
        "arc_deg": bark.arc_deg,
        "lobes": bark.lobes,
        "lean_deg": cone.lean_deg,
        "n_slices": len(fitted.slices),
        "solid_purity" if sensor.solid else "purity": bark.purity,
        "n_points": int(fitted.on.sum()),
        # The stem may show above and below, but not where it is measured.
        "n_at_bh": int(np.count_nonzero(np.abs(heights - bh_m) < 0.5)),
        "dbh_cm": dbh_cm,
        "se_cm": se_cm,
    }
    if judge("points", {"stray": found["stray"]}).flagged:
        # Strays among few sectors of bark: they fill the gap and pull the circle into it.
        found["clear_arc_deg"] = bark.clear_arc_deg
    if not sensor.solid:
        found["deep"] = bark.share_beyond(cone, -1)
    if taper is not None and not judge("points", {"n_slices": len(fitted.slices)}).reasons:
        found["taper_cm_m"] = taper.slope_cm_m
        found["slices_off_se"] = abs(taper.at_bh_cm - dbh_cm) / float(np.hypot(se_cm, taper.se_cm))
    return found
