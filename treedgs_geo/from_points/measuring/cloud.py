"""From a cloud with tree ids, or a bare cloud, to measured trees."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ...core.draws import own_order
from ...core.errors import InputError
from ...core.progress import Reporter
from ...core.scale import ground_scale
from ...pointcloud.cloud import PointCloud, extent
from ...shapes.circles import SolidCircle
from ...shapes.cone import Cone
from ...shapes.cylinder import fit_cylinder
from ...terrain.dtm import Dtm
from ...terrain.ground import height_above_ground
from ...trees.proportions import flag_short_trees
from ...trees.tree import Tree, on_ground
from ..segmentation.nearby import Nearby
from ..segmentation.options import SegmentOptions
from ..segmentation.segment import StemMap, find_stems, guess_sensor, label_points
from ..segmentation.sensors import SENSORS, Sensor
from .heights import tree_heights
from .opacity_cone import fit_opacity_cone
from .options import MeasureOptions
from .published import PublishedOptions, measure_filled, measure_published
from .stem import StemMeasure, measure_points, rebased, refuse

#: Exponent p of eq:weighted_score by what weighs the points (paper.tex: held-out validation).
PAPER_POWER = {"opacity": 0.6, "intensity": 0.85, "range_intensity": 0.85}
#: Diameter lost per metre of height, where the slices of a stem do not say (planted pine, research/forest.md 4.3).
USUAL_TAPER_CM_M = 1.0
#: A stem's points beyond this many add nothing but time.
MOST_POINTS = 8000
#: Stems thicker than this are expected to be seen above the band too, in a cloud that reaches the crowns.
SHOULD_GO_ON_CM = 18.0
#: Bark in fewer rows than this, with more than this share of points just outside it, is veiled.
VEILED_ROWS, VEILED_CLUTTER = 0.85, 0.25
#: Error of stems that their points fill: what splat samples of rendered plots gave (sd, and share of the diameter).
FILLED_SE_CM, FILLED_SE_SHARE = 2.0, 0.07
#: The same where inside and outside are told by opacity: RMSE 1.9 cm on 37 stems of two rendered plots.
OPACITY_SE_CM = 2.5
#: A cone that explains less of the opacities' variance is not the stem (on those plots none explained less than 0.17).
LEAST_EXPLAINED = 0.1
#: Bark of two stems closer than this may be one stem with a branch, or two in one another.
TOUCHING_M = 0.05


def segment_options(options: MeasureOptions) -> SegmentOptions:
    """The segmentation settings that go with measuring settings."""
    return SegmentOptions(source=options.source, max_dbh_cm=options.max_dbh_cm, max_lean_deg=options.max_lean_deg)


def measure_cloud(
    cloud: PointCloud, dtm: Dtm, options: MeasureOptions | None = None, reporter: Reporter | None = None
) -> tuple[list[Tree], np.ndarray]:
    """Find and measure every stem: ``(trees, (N,) tree_id)``. The terrain comes from
    :func:`treedgs_geo.terrain.ground.dtm_from_cloud` or the user."""
    options, reporter = options or MeasureOptions(), reporter or Reporter()
    with reporter.stage("find stems", 0.0, 0.6):
        height = height_above_ground(cloud.xyz, dtm)
        stems = find_stems(cloud, dtm, segment_options(options), reporter, height=height)
        tree_id = label_points(cloud.xyz, height, stems)
    reporter.info(f"{len(stems.stems)} stems found ({stems.sensor} settings).")
    with reporter.stage("measure stems", 0.6, 1.0):
        trees = measure_stems(cloud, tree_id, dtm, options, reporter, stems, height)
    return trees, tree_id


def measure_stems(
    cloud: PointCloud,
    tree_id: np.ndarray,
    dtm: Dtm,
    options: MeasureOptions | None = None,
    reporter: Reporter | None = None,
    stems: StemMap | None = None,
    height: np.ndarray | None = None,
) -> list[Tree]:
    """Measure segmented stems.

    tree_id: (N,) integers, <= 0 = no stem. stems: the map that gave the ids, if they are ours (starting values, and the
    labels of crowded points). height: (N,) above the terrain, where it has been computed. One bad tree never ends the
    run: it gets a reason. Deterministic for a seed. Diameters are lengths on the ground: what the map's scale adds in
    the cloud's CRS is taken off here.

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
    order = owned[np.argsort(tree_id[owned], kind="stable")]
    ids, starts = np.unique(tree_id[order], return_index=True)
    groups = np.split(order, starts[1:])
    sensor = SENSORS[_source(cloud, height, options, stems, owned)]
    frames = [_TreeFrame.of(cloud, group, dtm) for group in groups]
    if "even" in cloud.attributes and "opacity" in cloud.attributes:
        if options.method == "paper" or options.fit != "circle":
            raise InputError(
                "These points are spread evenly over stems and surroundings (sample-surface --points "
                "volume), which neither the published method nor a cylinder can read; use --method "
                "default, or sample with --points sampled."
            )
        # Opacities as they are: weights are kept from zero, which would move the edge.
        results = _by_opacity(groups, frames, np.asarray(cloud.attributes["opacity"], float), options)
    elif options.method == "paper" and options.fit == "circle":
        results = _by_the_paper(cloud, groups, frames, weights, options)
    elif sensor.solid and options.fit == "circle":
        results = _filled(groups, frames, weights, options)
    else:
        results = []
        around = _Surroundings.of(cloud, tree_id, height)
        for number, (tree, group, frame) in enumerate(zip(ids, groups, frames, strict=True)):
            results.append(_measure_one(frame, group, weights, sensor, options, stems, int(tree), around))
            reporter.progress((number + 1) / len(ids))
    trees = [
        _tree(int(tree), frame, measured, options) for tree, frame, measured in zip(ids, frames, results, strict=True)
    ]
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
    if kind == "range_intensity":
        from .intensity import range_normalised

        cloud = cloud.with_attribute("range_intensity", range_normalised(cloud))
    if kind not in cloud.attributes:
        there = ", ".join(cloud.attributes) or "none"
        raise InputError(
            f"--weights {kind}: the cloud has no attribute {kind!r} (it has: {there}); use --weights none."
        )
    values = np.asarray(cloud.attributes[kind], float)
    if kind in ("intensity", "range_intensity"):
        low, high = np.percentile(values, [2, 98])
        if not high > low:
            raise InputError(f"--weights {kind}: all points have the same intensity; use --weights none.")
        values = (values - low) / (high - low)
    return np.clip(np.nan_to_num(values, nan=0.0), 0.01, 1.0)


@dataclass(frozen=True)
class _TreeFrame:
    """A tree's own frame: xy from ``origin``, heights above the ground at its foot."""

    origin: np.ndarray
    ground: float
    points: np.ndarray

    @classmethod
    def of(cls, cloud: PointCloud, group: np.ndarray, dtm: Dtm) -> _TreeFrame:
        xyz = cloud.xyz[group]
        low = xyz[:, 2] <= np.percentile(xyz[:, 2], 30)
        foot = np.median(xyz[low, :2], axis=0)
        origin = np.floor(foot)
        ground = float(dtm.height(foot[0], foot[1]))
        return cls(origin, ground, np.column_stack([xyz[:, :2] - origin, xyz[:, 2] - ground]))


def _source(
    cloud: PointCloud, height: np.ndarray, options: MeasureOptions, stems: StemMap | None, owned: np.ndarray
) -> str:
    if stems is not None:
        return stems.sensor
    if options.source != "auto":
        return options.source
    points = np.column_stack([cloud.xyz[owned, :2], height[owned]])
    return guess_sensor(cloud, points, segment_options(options))


@dataclass(frozen=True)
class _Surroundings:
    """The points of the stem band that belong to no stem: twigs and shrubs that crowd the bark."""

    tree: Nearby
    has_crowns: bool

    @classmethod
    def of(cls, cloud: PointCloud, tree_id: np.ndarray, height: np.ndarray) -> _Surroundings:
        free = np.flatnonzero(tree_id <= 0)
        height = height[free]
        with np.errstate(invalid="ignore"):
            crowns = bool((height > 8.0).mean() > 0.05) if len(free) else False
            free = free[(height > 0.2) & (height < 5.0)]
        return cls(Nearby(cloud.xyz[free]), crowns)

    def near(self, frame: _TreeFrame) -> np.ndarray:
        """(M, 3) in the tree's frame, within 25 cm of its points' extent."""
        band = (frame.points[:, 2] > 0.2) & (frame.points[:, 2] < 5.0)
        xy = frame.points[band, :2] if band.any() else frame.points[:, :2]
        middle, reach = np.median(xy, axis=0), np.percentile(np.hypot(*(xy - np.median(xy, axis=0)).T), 98)
        found = self.tree.within(middle + frame.origin, min(float(reach), 1.5) + 0.25)
        return self.tree.points[found] - [*frame.origin, frame.ground]


def _measure_one(
    frame: _TreeFrame,
    group: np.ndarray,
    weights: np.ndarray | None,
    sensor: Sensor,
    options: MeasureOptions,
    stems: StemMap | None,
    tree: int,
    around: _Surroundings,
) -> StemMeasure:
    if not np.isfinite(frame.ground):
        return refuse("no_ground", points=len(group))
    points = frame.points
    weight = None if weights is None else weights[group]
    # Crown and ground points of other segmenters' trees do not belong to the stem's band.
    band = (points[:, 2] > 0.1) & (points[:, 2] < 6.0)
    points, weight = points[band], None if weight is None else weight[band]
    if options.fit == "cylinder":
        points = points[own_order(points)]
    # Every n-th point, not voxels: the few points within the bark must stay few against those on it.
    stride = max(len(points) // MOST_POINTS, 1)
    points, weight = points[::stride], None if weight is None else weight[::stride]
    if options.fit == "cylinder":
        return _cylinder(points, options)
    start = None
    stem = stems.stems[tree - 1] if stems is not None else None
    if stem is not None and stems is not None:
        if stem.refused:
            return refuse(stem.refused, cone=rebased(stem.cone, frame.origin - stems.origin, 0.0), points=len(points))
        start = rebased(stem.cone, frame.origin - stems.origin, 0.0)
        sensor = sensor.at_noise(stem.noise_m or 0.0)
    measured = measure_points(
        points, weight, sensor, options.bh_m, segment_options(options), start, around.near(frame)[::stride]
    )
    thick = measured.dbh_cm is not None and measured.dbh_cm > SHOULD_GO_ON_CM
    veiled = stem is not None and stem.rows < VEILED_ROWS and stem.clutter > VEILED_CLUTTER
    if stem is not None and (veiled or around.has_crowns and thick and len(stem.pieces) < 2):
        # A thick stem goes on above the band; a stump, a log or a shrub does not. Twigs hide a sapling's bark.
        flag = "check" if measured.flag == "ok" else measured.flag
        measured = replace(measured, flag=flag, reasons=tuple(dict.fromkeys([*measured.reasons, "occluded"])))
    return measured


def _cylinder(points: np.ndarray, options: MeasureOptions) -> StemMeasure:
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
    se = float(np.hypot(0.6, 0.02 * dbh)) if options.method == "default" else None
    if found.inlier_share < 0.2:
        return StemMeasure(cone, dbh, se, "check", ("not_round",), 0.0, found.points)
    return StemMeasure(cone, dbh, se, "ok", (), 0.0, found.points)


def _by_the_paper(
    cloud: PointCloud,
    groups: list[np.ndarray],
    frames: list[_TreeFrame],
    weights: np.ndarray | None,
    options: MeasureOptions,
) -> list[StemMeasure]:
    # Unweighted points use the exponent of their own kind: surface samples fill the stem, LiDAR lies on it.
    kind = options.weights if options.weights != "none" else "opacity" if "opacity" in cloud.attributes else "intensity"
    published = PublishedOptions(circle=SolidCircle(power=PAPER_POWER[kind]))
    results = measure_published(_weighted(groups, frames, weights), options.bh_m, published, options.seed)
    measures = []
    for frame, group, result in zip(frames, groups, results, strict=True):
        if not np.isfinite(frame.ground):
            measured = refuse("no_ground", points=len(group))
        elif len(result.slices) < published.taper.least_inliers:
            measured = refuse("few_slices", points=len(group))
        elif result.taper is None:
            measured = refuse("no_taper", points=len(group))
        else:
            taper = result.taper
            used = result.slices[taper.inliers]
            middle = np.median(used[:, 1:3], axis=0)
            cone = Cone(
                float(middle[0]), float(middle[1]), 0.0, 0.0, taper.at_bh_cm / 200, taper.slope_cm_m / 200, options.bh_m
            )
            # The published method has no standard error; its bias depends on how the points fill the stem.
            measured = StemMeasure(
                cone,
                taper.at_bh_cm,
                None,
                "check",
                ("unchecked",),
                0.0,
                len(group),
                int(taper.inliers.sum()),
                taper.slope_cm_m,
            )
        measures.append(measured)
    return measures


def _weighted(
    groups: list[np.ndarray], frames: list[_TreeFrame], weights: np.ndarray | None
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points with a known height and their weights, per tree."""
    stems = []
    for group, frame in zip(groups, frames, strict=True):
        known = np.isfinite(frame.points[:, 2])
        weight = np.ones(len(group)) if weights is None else weights[group]
        stems.append((frame.points[known], weight[known]))
    return stems


def _filled(
    groups: list[np.ndarray], frames: list[_TreeFrame], weights: np.ndarray | None, options: MeasureOptions
) -> list[StemMeasure]:
    """Stems that their points fill. The error is what such points gave on rendered plots, not less."""
    measures = []
    results = measure_filled(_weighted(groups, frames, weights), options.bh_m, seed=options.seed)
    for frame, group, (result, slope) in zip(frames, groups, results, strict=True):
        taper = result.taper
        if not np.isfinite(frame.ground):
            measures.append(refuse("no_ground", points=len(group)))
        elif taper is None:
            measures.append(refuse("no_taper" if len(result.slices) >= 10 else "few_slices", points=len(group)))
        else:
            used = result.slices[taper.inliers]
            middle = np.median(used[:, 1:3], axis=0)
            cone = Cone(
                float(middle[0]),
                float(middle[1]),
                float(slope[0]),
                float(slope[1]),
                taper.at_bh_cm / 200,
                taper.slope_cm_m / 200,
                options.bh_m,
            )
            se = float(np.sqrt(taper.se_cm**2 + FILLED_SE_CM**2 + (FILLED_SE_SHARE * taper.at_bh_cm) ** 2))
            # The slices that agree should surround breast height.
            near = bool((np.abs(used[:, 0] - options.bh_m) < 0.3).any())
            reason = "wide_error" if near else "no_taper"
            measures.append(
                StemMeasure(cone, taper.at_bh_cm, se, "check", (reason,), 0.0, len(group), len(used), taper.slope_cm_m)
            )
    return measures


def _by_opacity(
    groups: list[np.ndarray], frames: list[_TreeFrame], opacity: np.ndarray, options: MeasureOptions
) -> list[StemMeasure]:
    """Points spread evenly over stems and surroundings: the cone at whose bark their opacity ends. The error is what
    such points gave on rendered plots, not less."""
    measures = []
    for frame, group, stem in zip(frames, groups, _weighted(groups, frames, opacity), strict=True):
        found = fit_opacity_cone(*stem, options.bh_m)
        if not np.isfinite(frame.ground):
            measures.append(refuse("no_ground", points=len(group)))
        elif found is None or found.explained < LEAST_EXPLAINED:
            measures.append(refuse("occluded" if len(group) >= 200 else "few_points", points=len(group)))
        else:
            cone = Cone(found.x, found.y, found.slope_x, found.slope_y, found.radius_m, found.taper_m, options.bh_m)
            measures.append(
                StemMeasure(
                    cone, found.dbh_cm, OPACITY_SE_CM, "check", ("wide_error",), 0.0, len(group), 0, 200 * found.taper_m
                )
            )
    return measures


def _tree(tree: int, frame: _TreeFrame, measured: StemMeasure, options: MeasureOptions) -> Tree:
    if measured.cone is not None:
        x, y = measured.cone.centre(options.bh_m) + frame.origin
    else:
        near = np.abs(frame.points[:, 2] - options.bh_m) < 1.0
        chosen = frame.points[near] if near.any() else frame.points
        x, y = np.median(chosen[:, :2], axis=0) + frame.origin
    flag, reasons = measured.flag, list(measured.reasons)
    dbh = measured.dbh_cm
    if dbh is not None and not options.min_dbh_cm <= dbh <= options.max_dbh_cm:
        reasons.insert(0, "too_small" if dbh < options.min_dbh_cm else "too_large")
        flag, dbh = "reject", None
    name = options.method if options.fit == "circle" else f"cylinder-{options.method}"
    return Tree(
        tree_id=tree,
        x=float(x),
        y=float(y),
        z_ground=frame.ground if np.isfinite(frame.ground) else None,
        dbh_cm=dbh,
        dbh_se_cm=measured.se_cm if dbh is not None else None,
        bh_m=options.bh_m,
        lean_deg=measured.cone.lean_deg if measured.cone is not None else None,
        arc_deg=measured.arc_deg or None,
        n_pts=measured.points,
        n_slices=measured.slices or None,
        taper_cm_m=measured.taper_cm_m,
        method=f"points-{name}-{options.weights}",
        qc_flag=flag,
        qc_reason=",".join(dict.fromkeys(reasons)),
    )


def _finish(
    cloud: PointCloud, height: np.ndarray, trees: list[Tree], results: list[StemMeasure], groups: list[np.ndarray]
) -> None:
    """Heights, opacity and the edge of the data; then the layer's own rules."""
    feet = np.array([[tree.x, tree.y] for tree in trees]).reshape(-1, 2)
    slopes = np.array([[m.cone.dx, m.cone.dy] if m.cone is not None else [0.0, 0.0] for m in results]).reshape(-1, 2)
    tops = tree_heights(cloud.xyz, height, feet, slopes)
    low, high = extent(cloud.xyz[:, :2])
    # A file of stem points alone does not say where the survey ended.
    whole = sum(len(group) for group in groups) < 0.5 * len(cloud)
    opacity = cloud.attributes.get("opacity")
    for tree, group, top in zip(trees, groups, tops, strict=True):
        tree.height_m = float(top) if np.isfinite(top) else None
        if opacity is not None:
            tree.opac_mean = float(np.mean(opacity[group]))
        margin = (tree.dbh_cm or 20.0) / 200 + 0.02
        place = np.array([tree.x, tree.y])
        if whole and ((place - margin < low) | (place + margin > high)).any():
            tree.qc_reason = ",".join(filter(None, [tree.qc_reason, "edge"]))
            tree.qc_flag = "check" if tree.qc_flag == "ok" else tree.qc_flag
        tree.finish()
    flag_short_trees(trees)
    _mark_touching(trees)


def _mark_touching(trees: list[Tree]) -> None:
    measured = [tree for tree in trees if tree.dbh_cm is not None]
    if len(measured) < 2:
        return
    places = np.array([[tree.x, tree.y] for tree in measured])
    for one, other in cKDTree(places).query_pairs(2.0):
        gap = float(np.hypot(*(places[one] - places[other]))) - (measured[one].dbh_cm + measured[other].dbh_cm) / 200
        if gap < TOUCHING_M:
            for tree in (measured[one], measured[other]):
                if "merged" not in tree.qc_reason:
                    tree.qc_reason = ",".join(filter(None, [tree.qc_reason, "merged"]))
                    tree.qc_flag = "check" if tree.qc_flag == "ok" else tree.qc_flag
