"""From a cloud with tree ids, or a bare cloud, to measured trees."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import ndtr

from ....core.errors import InputError
from ....core.intervals import HALF_WIDTH_SE
from ....core.machine import in_threads
from ....core.map_scale import ground_scale
from ....core.progress import Reporter
from ....core.seeding import own_order
from ....pointcloud.cloud import PointCloud, extent
from ....terrain.dtm import Dtm
from ....terrain.ground import height_above_ground
from ...quality.limits import judge
from ...quality.methods import points_method
from ...quality.proportions import check_heights
from ...quality.tree import Tree, on_ground
from ..propose.candidate_check import ConeStem
from ..propose.labelling import Labeller
from ..propose.options import SegmentOptions
from ..propose.segment import StemMap, find_stems, guess_sensor
from ..propose.sensors import SENSORS, Sensor
from .frames import Surroundings, TreeFrame
from .heights import tree_heights
from .options import MeasureOptions
from .passes import Passes, fit_passes
from .published import by_cylinder, by_filling, by_the_paper
from .scans import Scanned, fitted_together
from .stem import StemMeasure, measure_points, refuse
from .track import SensorTrack

#: A stem's points beyond this many add nothing but time.
MOST_POINTS = 8000
#: Scans that do not fit together are moved so often at most, less one: stems are found anew in between.
MAX_ROUNDS = 4
#: Stems thicker than this are expected to be seen above the band too, in a cloud that reaches the crowns: a shelter of
#: 12 cm is not. Of 220 stems that are ok on real and simulated clouds three are to be checked for it.
SHOULD_GO_ON_CM = 10.0
#: Rings are compared where so many stems are measured; standard error of a thick one's diameter over its excess.
#: Bark is never taken to be thinner than this, m: its own relief.
LEAST_STEMS, RING_SE, LEAST_RING_M = 4, 4.0, 0.008
#: Bark in fewer rows than this shows gaps: points just outside it are twigs then.
VEILED_ROWS = 0.85
#: What bark at the rim of what its pass sees counts in the fit: it shows that there is bark, not where it ends.
RIM_WEIGHT = 0.02


def segment_options(options: MeasureOptions) -> SegmentOptions:
    """The segmentation settings that go with measuring settings."""
    return SegmentOptions(source=options.source, max_dbh_cm=options.max_dbh_cm, max_lean_deg=options.max_lean_deg)


def measure_cloud(
    cloud: PointCloud, dtm: Dtm, options: MeasureOptions | None = None, reporter: Reporter | None = None
) -> tuple[list[Tree], np.ndarray]:
    """Find and measure every stem: ``(trees, (N,) tree_id)``. The terrain comes from
    :func:`treedgs_geo.terrain.ground.dtm_from_cloud` or the user."""
    options, reporter = options or MeasureOptions(), reporter or Reporter()
    for attempt in range(MAX_ROUNDS):
        with reporter.stage("find stems", 0.0, 0.6):
            height = height_above_ground(cloud.xyz, dtm)
            stems = find_stems(cloud, dtm, segment_options(options), reporter, height=height)
            tree_id = Labeller(stems)(cloud.xyz, height)
        scanned = Scanned(cloud, tree_id, SENSORS[stems.sensor])
        together = fitted_together(cloud, scanned, height, stems, reporter) if attempt < MAX_ROUNDS - 1 else None
        if together is None:
            break
        cloud = together
    reporter.info(f"{len(stems.stems)} stems found ({stems.sensor} settings).")
    with reporter.stage("measure stems", 0.6, 1.0):
        trees = measure_stems(cloud, tree_id, dtm, options, reporter, stems, height, scanned)
    return trees, tree_id


def measure_stems(
    cloud: PointCloud,
    tree_id: np.ndarray,
    dtm: Dtm,
    options: MeasureOptions | None = None,
    reporter: Reporter | None = None,
    stems: StemMap | None = None,
    height: np.ndarray | None = None,
    scanned: Scanned | None = None,
) -> list[Tree]:
    """Measure segmented stems.

    tree_id: (N,) integers, <= 0 = no stem. stems: the map that gave the ids, if they are ours (starting values, and the
    labels of crowded points). height: (N,) above the terrain, scanned: of this cloud and ids, where known. One bad
    tree never ends the run: it gets a reason. Deterministic for a seed. Diameters are lengths on the ground: what the
    map's scale adds in the cloud's CRS is taken off here.

    Raises:
        InputError: the attribute that ``weights`` names is missing. CRSError: the cloud's CRS stretches lengths by more
            than half a per cent.
    """
    options, reporter = options or MeasureOptions(), reporter or Reporter()
    tree_id = np.asarray(tree_id)
    weights = point_weights(cloud, options.weights)
    owned = np.flatnonzero(tree_id > 0)
    if len(owned) == 0:
        return []
    if height is None:
        height = height_above_ground(cloud.xyz, dtm)
    source = options.source if stems is None else stems.sensor
    if source == "auto":
        points = np.column_stack([cloud.xyz[owned, :2], height[owned]])
        source = guess_sensor(cloud, points, segment_options(options))
    sensor = SENSORS[source]
    scanned = scanned or Scanned(cloud, tree_id, sensor)
    ids, groups = scanned.ids, scanned.groups
    frames = [
        TreeFrame.of(cloud, group, dtm, None if stems is None else (stems.stems[tree - 1].cone, stems.origin))
        for tree, group in zip(ids, groups, strict=True)
    ]
    if "even" in cloud.attributes:
        raise InputError(
            "These points are spread evenly over stems and surroundings, as older versions of sample-surface did, and "
            "say nothing by their place; run sample-surface again."
        )
    if options.method == "paper" and options.fit == "circle":
        results = by_the_paper(cloud, groups, frames, weights, options)
    elif sensor.solid and options.fit == "circle":
        results = by_filling(groups, frames, weights, options)
    else:
        results, around = [], Surroundings.of(cloud, tree_id, height)
        passes, track = scanned.passes, scanned.track

        def measure(k: int) -> StemMeasure:
            stem = stems.stems[int(ids[k]) - 1] if stems is not None else None
            return _measure_one(frames[k], groups[k], weights, sensor, options, stem, around, passes, track)

        for measured in in_threads(measure, range(len(ids))):
            results.append(measured)
            reporter.progress(len(results) / len(ids))
    results = bark_inside(results)
    if sensor.calibrated:
        results = beside_the_others(results)
    trees = [_tree(int(k), frame, each, options) for k, frame, each in zip(ids, frames, results, strict=True)]
    _finish(cloud, height, trees, results, groups)
    scale = ground_scale(cloud.crs, *np.median(cloud.xyz[owned[:: max(len(owned) // 100_000, 1)]], axis=0))
    return [on_ground(tree, scale) for tree in trees]


def point_weights(cloud: PointCloud, kind: str) -> np.ndarray | None:
    """(N,) reliabilities in (0, 1], or ``None`` for equal weights.

    Intensity is scaled by its 2nd and 98th percentile (it has no unit, and a few glints would rule otherwise).

    Raises:
        InputError: the cloud has no such attribute.
    """
    if kind == "none":
        return None
    if kind not in cloud.attributes:
        there = ", ".join(cloud.attributes) or "none"
        raise InputError(
            f"--weights {kind}: the cloud has no attribute {kind!r} (it has: {there}); use --weights none."
        )
    values = np.asarray(cloud.attributes[kind], float)
    if kind == "intensity":
        low, high = np.percentile(values, [2, 98])
        if not high > low:
            raise InputError(f"--weights {kind}: all points have the same intensity; use --weights none.")
        values = (values - low) / (high - low)
    return np.clip(np.nan_to_num(values, nan=0.0), 0.01, 1.0)


def _measure_one(
    frame: TreeFrame,
    group: np.ndarray,
    weights: np.ndarray | None,
    sensor: Sensor,
    options: MeasureOptions,
    stem: ConeStem | None,
    around: Surroundings,
    passes: Passes,
    track: SensorTrack | None,
) -> StemMeasure:
    if not np.isfinite(frame.ground):
        return refuse("no_ground", points=len(group))
    points = frame.points
    weight = None if weights is None else weights[group]
    # Crown and ground points of other segmenters' trees do not belong to the stem's band.
    band = (points[:, 2] > 0.1) & (points[:, 2] < 6.0)
    points, weight, index = points[band], None if weight is None else weight[band], group[band]
    if options.fit == "cylinder":
        points = points[own_order(points)]
    # Every n-th point, not voxels: the few points within the bark must stay few against those on it.
    stride = max(len(points) // MOST_POINTS, 1)
    points, weight, index = points[::stride], None if weight is None else weight[::stride], index[::stride]
    if options.fit == "cylinder":
        return by_cylinder(points, options)
    start = frame.start
    if stem is not None:
        if stem.refused:
            return refuse(stem.refused, cone=start, points=len(points))
        sensor = sensor.at_noise(stem.noise_m or 0.0)
    others, beside_index = (part[::stride] for part in around.near(frame))
    if track is not None and start is not None:
        weight = np.where(track.at_rim(points, start, index), RIM_WEIGHT, 1.0 if weight is None else weight)
    measured = measure_points(points, weight, sensor, options.bh_m, segment_options(options), start, others)
    index = np.concatenate([index, beside_index])
    weight = None if weights is None else weights[index]
    measured = _pass_by_pass(measured, points, others, weight, passes.of(index), sensor, options)
    if stem is None:
        return measured
    # A thick stem goes on above the band; a stump, a log or a shrub does not. Twigs hide a sapling's bark.
    beside = {"clutter": stem.seen.outside} if stem.seen.row_share < VEILED_ROWS else {}
    if around.has_crowns and measured.assessment.measured and measured.assessment.dbh_cm > SHOULD_GO_ON_CM:
        beside["n_above"] = len(stem.pieces)
    return measured.assessed(measured.assessment.adding(judge("points", beside)))


def _pass_by_pass(
    measured: StemMeasure,
    points: np.ndarray,
    others: np.ndarray,
    weights: np.ndarray | None,
    label: np.ndarray,
    sensor: Sensor,
    options: MeasureOptions,
) -> StemMeasure:
    """The stem measured again with its passes brought onto one axis, where they do not fit together; with a remark and
    a wider error where they show it at different diameters.

    weights, label: (N + M,) of the (N, 3) points and the (M, 3) others.
    """
    cone = measured.cone
    if cone is None or not label.any():
        return measured
    pool = np.concatenate([points, others])
    fit = fit_passes(pool, label, np.zeros(len(label), np.int64), cone, options.bh_m, sensor.floor_m)
    if fit.sure:
        kept = fit.placed[label]
        moved = pool[kept].copy()
        moved[:, :2] -= fit.shift[label[kept]]
        on = np.abs(cone.residuals(moved)) < max(4 * cone.sigma, 2.5 * sensor.cap_m)
        strength = None if weights is None else weights[kept][on]
        again = measure_points(moved[on], strength, sensor, options.bh_m, segment_options(options), cone, moved[~on])
        if again.assessment.measured:
            measured = again.assessed(again.assessment.widened(fit.se_cm))
    found = judge("points", {"dates_cm": fit.dates_cm})
    return measured.assessed(measured.assessment.widened(fit.dates_cm / 2).adding(found))


def bark_inside(results: list[StemMeasure]) -> list[StemMeasure]:
    """Flagged (``covered``), with an interval that reaches it, where bark shows inside what was fitted: leaves, ivy or
    moss hide the rest. Stems of a plot are judged together: where many are covered, less evidence is enough."""
    from scipy.stats import false_discovery_control  # half a second, which photos need not wait for

    known = [k for k, each in enumerate(results) if each.assessment.measured and np.isfinite(each.inside.skew_se)]
    if not known:
        return results
    chance = ndtr([-results[k].inside.skew_se for k in known])
    # Rate of false discoveries (Benjamini and Hochberg 1995) among stems of which those that lean as much outwards as
    # inwards are half of the clean ones (Storey, Taylor and Siegmund 2004).
    clean = min((1 + np.count_nonzero(chance >= 0.5)) / (0.5 * len(known)), 1.0)
    out = list(results)
    for k, false_share in zip(known, clean * false_discovery_control(chance), strict=True):
        stated, off_cm = results[k].assessment, 100 * results[k].inside.depth_m
        other_cm = stated.dbh_cm - 2 * off_cm - HALF_WIDTH_SE * stated.se_cm
        out[k] = results[k].assessed(stated.adding(judge("points", {"false_share": false_share}), off_cm, other_cm))
    return out


def beside_the_others(results: list[StemMeasure]) -> list[StemMeasure]:
    """Flagged or refused (``covered``), where the ring of points is far thicker than those of the plot's other stems:
    ivy, moss or twigs all round, which a circle takes for bark. A flagged one's error grows with the excess."""
    noise = np.array([each.noise_m for each in results if each.assessment.measured])
    if np.isfinite(noise).sum() < LEAST_STEMS:
        return results
    usual, out = max(float(np.nanmedian(noise)), LEAST_RING_M), list(results)
    for k, each in enumerate(results):
        found = judge("points", {"ring_ratio": each.noise_m / usual})
        if each.assessment.measured and found.reasons:
            excess_cm = 100 * float(np.sqrt(each.noise_m**2 - usual**2))
            out[k] = each.assessed(each.assessment.widened(RING_SE * excess_cm).adding(found))
    return out


def _tree(tree: int, frame: TreeFrame, measured: StemMeasure, options: MeasureOptions) -> Tree:
    if measured.cone is not None:
        x, y = measured.cone.centre(options.bh_m) + frame.origin
    else:
        near = np.abs(frame.points[:, 2] - options.bh_m) < 1.0
        chosen = frame.points[near] if near.any() else frame.points
        x, y = np.median(chosen[:, :2], axis=0) + frame.origin
    stated = measured.assessment
    if stated.measured:
        settings = {"min_dbh_cm": options.min_dbh_cm, "max_dbh_cm": options.max_dbh_cm}
        # A fit that ran away altogether counts as too large.
        dbh_cm = np.inf if np.isnan(stated.dbh_cm) else stated.dbh_cm
        stated = stated.adding(judge("points", {"dbh_cm": dbh_cm}, settings=settings))
    return Tree(
        tree_id=tree,
        x=float(x),
        y=float(y),
        z_ground=frame.ground if np.isfinite(frame.ground) else None,
        bh_m=options.bh_m,
        lean_deg=measured.cone.lean_deg if measured.cone is not None else None,
        arc_deg=measured.arc_deg or None,
        n_pts=measured.points,
        n_slices=measured.slices or None,
        taper_cm_m=measured.taper_cm_m,
        method=points_method(options.fit, options.method, options.weights),
        **stated.of_tree(),
    ).finish()


def _finish(
    cloud: PointCloud, height: np.ndarray, trees: list[Tree], results: list[StemMeasure], groups: list[np.ndarray]
) -> None:
    """Heights, opacity and the edge of the data; then the layer's own rules."""
    places = np.array([[tree.x, tree.y] for tree in trees]).reshape(-1, 2)
    slopes = np.array([[m.cone.dx, m.cone.dy] if m.cone is not None else [0.0, 0.0] for m in results]).reshape(-1, 2)
    known = [[np.nan if value is None else value for value in (tree.z_ground, tree.dbh_cm)] for tree in trees]
    z_ground, dbh_cm = np.array(known, float).reshape(-1, 2).T
    tops = tree_heights(cloud.xyz, height, places, slopes, z_ground, dbh_cm, trees[0].bh_m if trees else 0.0)
    low, high = extent(cloud.xyz[:, :2])
    # A file of stem points alone does not say where the survey ended.
    whole = sum(len(group) for group in groups) < 0.5 * len(cloud)
    opacity = cloud.attributes.get("opacity")
    for k, (tree, group) in enumerate(zip(trees, groups, strict=True)):
        if np.isfinite(tops.height_m[k]):
            tree.height_m, tree.height_se_m = float(tops.height_m[k]), float(tops.se_m[k])
        tree.height_why = tops.why[k] or None
        if opacity is not None:
            tree.opac_mean = float(np.mean(opacity[group]))
        if whole:
            place, radius_m = np.array([tree.x, tree.y]), (tree.dbh_cm or 20.0) / 200
            rim_m = float(np.minimum(place - low, high - place).min()) - radius_m
            for reason in judge("points", {"rim_m": rim_m}).reasons:
                tree.add_reason(reason)
        tree.finish()
    check_heights(trees)
    measured = [tree for tree in trees if tree.dbh_cm is not None]
    places = np.array([[tree.x, tree.y] for tree in measured]).reshape(-1, 2)
    for one, other in cKDTree(places).query_pairs(2.0):  # stems that touch
        gap = float(np.hypot(*(places[one] - places[other]))) - (measured[one].dbh_cm + measured[other].dbh_cm) / 200
        for reason in judge("points", {"gap_m": gap}).reasons:
            measured[one].add_reason(reason)
            measured[other].add_reason(reason)
