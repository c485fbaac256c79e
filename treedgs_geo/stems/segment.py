"""Stems in a point cloud, without trained weights: vote for rings, fit leaning cones, keep what is bark.

Steps: slab over the terrain -> candidates (:mod:`.candidates`) tile by tile -> robust cone fit from the candidate,
grown from its layer to the whole band -> evidence checks (rows of the stem with bark, arc, emptiness inside, clutter
outside) -> explained points are taken away from later candidates -> the axis is followed upwards -> every point
near a stem gets its ``tree_id``. Parameters follow treeX for drone LiDAR where they have a counterpart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from scipy.spatial import cKDTree

from ..core.progress import Reporter
from ..pointcloud.cloud import PointCloud, extent, thin
from ..terrain.dtm import Dtm
from ..terrain.ground import height_above_ground
from .candidates import find_candidates
from .cone import Cone, fit_cone
from .cone_kernels import TAPER_PRIOR, grow
from .evidence import ROW_M, count_evidence, stands_at
from .nearby import Nearby
from .options import SegmentOptions

_TILE_M, _BUFFER_M = 30.0, 1.5
_REACH_M = 0.75
#: Points that a candidate's cone is fitted to at most.
MOST_FITTED = 3000
#: A candidate's layer, half of its thickness, m, and the prior sd of its lean.
_LAYER_M, _LAYER_LEAN_SD = 0.8, 0.08


@dataclass(frozen=True)
class Sensor:
    """What a kind of cloud looks like: noise floor and cap on bark, thinning, points needed, filled stems or shells,
    the usual noise, and whether standard errors were calibrated on such clouds with known diameters."""

    floor_m: float
    cap_m: float
    thin_m: float
    least_points: int
    solid: bool
    noise_m: float
    calibrated: bool = False


SENSORS = {
    "tls": Sensor(0.004, 0.02, 0.015, 60, False, 0.010),
    "uls": Sensor(0.007, 0.025, 0.0, 16, False, 0.012, calibrated=True),
    "splat": Sensor(0.010, 0.05, 0.015, 40, True, 0.03),
}


@dataclass(frozen=True)
class Stem:
    """A found stem. cone: local frame (see :class:`StemMap`), heights above ground. rows, arc_deg, inside, clutter:
    the evidence. pieces: cones that follow the axis upwards, by height. round: False = a stem by what is above it,
    but no ring at breast height (buttresses, a fork): seen, not measurable."""

    cone: Cone
    score: float
    rows: float
    arc_deg: float
    inside: float
    clutter: float
    points: int
    pieces: tuple[Cone, ...] = ()
    round: bool = True


@dataclass(frozen=True)
class StemMap:
    """Stems of a cloud: ``origin`` (2,) is added to the cones' xy for project coordinates; index + 1 = tree_id."""

    stems: tuple[Stem, ...]
    origin: np.ndarray
    sensor: str


def segment_stems(cloud: PointCloud, dtm: Dtm, options: SegmentOptions | None = None,
                  reporter: Reporter | None = None) -> np.ndarray:
    """(N,) int32 ``tree_id`` of each point, 0 = no stem. See :func:`find_stems` for the stems themselves."""
    height = height_above_ground(cloud.xyz, dtm)
    stems = find_stems(cloud, dtm, options, reporter, height=height)
    return label_points(cloud.xyz, height, stems)


def find_stems(cloud: PointCloud, dtm: Dtm, options: SegmentOptions | None = None,
               reporter: Reporter | None = None, seeds_xy: np.ndarray | None = None,
               height: np.ndarray | None = None) -> StemMap:
    """The stems of a cloud in project coordinates over its terrain model, in a stable order (north to south).

    seeds_xy: (K, 2) project coordinates of stems that are known (field stems): weaker evidence is looked at there.
    height: (N,) above the terrain, where it has been computed.
    """
    options, reporter = options or SegmentOptions(), reporter or Reporter()
    if height is None:
        height = height_above_ground(cloud.xyz, dtm)
    origin = np.floor(extent(cloud.xyz[:, :2])[0])
    points, slab = _slab(cloud.xyz, height, origin, 0.2, float(options.grow_m))
    weights = cloud.attributes.get("opacity")
    weights = None if weights is None else np.clip(np.asarray(weights, float)[slab], 0.02, 1.0)
    source = options.source if options.source != "auto" else guess_sensor(cloud, points, options)
    sensor = SENSORS[source]
    if sensor.thin_m and len(points):
        kept = thin(points, sensor.thin_m)
        points, weights = points[kept], None if weights is None else weights[kept]
    seeds = None if seeds_xy is None else np.asarray(seeds_xy, float) - origin
    found = _search(points, weights, sensor, options, reporter, seeds) if len(points) else []
    found.sort(key=lambda stem: (-round(stem.cone.y, 1), stem.cone.x))
    return StemMap(tuple(found), origin, source)


@njit(cache=True)
def _slab(xyz, height, origin, low_m, high_m):  # pragma: no cover - compiled
    """(M, 3) xy from ``origin`` and height of the points with low_m < height < high_m, and their (M,) indices."""
    count = 0
    for h in height:
        count += low_m < h < high_m
    points, index = np.empty((count, 3)), np.empty(count, np.int64)
    count = 0
    for m in range(height.shape[0]):
        if low_m < height[m] < high_m:
            points[count, 0], points[count, 1] = xyz[m, 0] - origin[0], xyz[m, 1] - origin[1]
            points[count, 2], index[count] = height[m], m
            count += 1
    return points, index


def guess_sensor(cloud: PointCloud, points: np.ndarray, options: SegmentOptions) -> str:
    """``splat`` when points carry opacity; else by density: more than 120 points/m2 of stem band are terrestrial."""
    if "opacity" in cloud.attributes:
        return "splat"
    band = points[(points[:, 2] > options.low_m) & (points[:, 2] < options.high_m)]
    if len(band) < 50:
        return "uls"
    return "tls" if len(band) / len(_cells(band, 1.0)) > 120 else "uls"


def _cells(points: np.ndarray, size_m: float) -> np.ndarray:
    """(K, 2) the cells of the lattice of ``size_m`` that hold points, west to east, then south to north."""
    i, j = (np.floor(points[:, axis] / size_m).astype(np.int64) for axis in (0, 1))
    low, span = (i.min(), j.min()), j.max() - j.min() + 1
    key = np.unique((i - low[0]) * span + j - low[1])
    return np.column_stack([key // span, key % span]) + low


def label_points(xyz: np.ndarray, height: np.ndarray, stems: StemMap) -> np.ndarray:
    """(N,) int32 tree ids: points inside a stem's bark or within its noise outside; the nearest bark wins."""
    from .labelling import Labeller  # which is built on this module

    return Labeller(stems)(xyz, height)


def search_points(points: np.ndarray, weights: np.ndarray | None, sensor: Sensor,
                  options: SegmentOptions | None = None) -> list[Stem]:
    """The stems in a small set of (N, 3) points (x, y, height above ground), say one tree of another segmenter."""
    return _without_doubles(_search_tile(points, weights, sensor, options or SegmentOptions(), follow=False))


def _tolerance(cone: Cone, sensor: Sensor) -> float:
    return max(3 * cone.sigma, 0.02, 2 * sensor.floor_m)


def _search(points: np.ndarray, weights: np.ndarray | None, sensor: Sensor, options: SegmentOptions,
            reporter: Reporter, seeds: np.ndarray | None = None) -> list[Stem]:
    """Tile by tile with a buffer; what two tiles both find is kept once."""
    found: list[Stem] = []
    tiles = _cells(points, _TILE_M)
    for number, corner in enumerate(tiles):
        low, high = corner * _TILE_M - _BUFFER_M, (corner + 1) * _TILE_M + _BUFFER_M
        x, y = points[:, 0], points[:, 1]
        inside = (x >= low[0]) & (x < high[0]) & (y >= low[1]) & (y < high[1])
        stems = _search_tile(points[inside], None if weights is None else weights[inside], sensor, options,
                             seeds=seeds)
        # Near the rim of the buffer a stem may be cut in half: the neighbouring tile has it whole.
        feet = [stem.cone.centre(1.3) for stem in stems]
        found += [stem for stem, foot in zip(stems, feet, strict=True)
                  if ((foot > low + 0.7) & (foot < high - 0.7)).all()]
        reporter.progress((number + 1) / len(tiles))
    return _without_doubles(found)


def _search_tile(points: np.ndarray, weights: np.ndarray | None, sensor: Sensor,
                 options: SegmentOptions, follow: bool = True, seeds: np.ndarray | None = None) -> list[Stem]:
    band = (points[:, 2] >= options.low_m) & (points[:, 2] < options.high_m)
    if band.sum() < sensor.least_points:
        return []
    candidates = find_candidates(points[band], None if weights is None else weights[band], options.low_m,
                                 options.high_m, sensor.solid, options.max_dbh_cm / 200, near=seeds)
    tree = Nearby(points)
    free = np.ones(len(points), bool)
    found: list[Stem] = []
    axes = np.empty((0, 9))
    rejected: list[_Rejected] = []
    low, high = options.low_m - 0.1, min(options.high_m, 4.25)
    for xy, h, radius in zip(candidates.xy, candidates.height, candidates.radius, strict=True):
        if stands_at(axes, xy[0], xy[1], h, 0.8, 0.05, 0.0):
            continue
        near = tree.within(xy, _REACH_M + radius, low, high)
        near = near[free[near]]
        cones = _fit_candidate(points[near], None if weights is None else weights[near], xy, h, radius, sensor,
                               options)
        stem = _best(cones, points[near], sensor, options)
        if stem is None:
            rejected.append(_Rejected(xy, float(h), float(radius), len(near), cones))
            continue
        if any(_same(stem, other) for other in found):
            continue
        residual = stem.cone.residuals(points[near])
        free[near[residual < _tolerance(stem.cone, sensor)]] = False
        pieces = _follow(points, tree, weights, stem.cone, sensor, options) if follow else ()
        found.append(replace(stem, pieces=pieces))
        axes = np.vstack([axes, _axis(stem.cone)])
    if follow:
        found += _not_round(points, tree, weights, free, rejected, axes, sensor, options)
    return found


def _axis(cone: Cone) -> np.ndarray:
    """(9,) for :func:`stands_at`."""
    return np.r_[cone.vector, cone.h_ref]


@dataclass(frozen=True)
class _Rejected:
    """A candidate that was no clean ring, and the cones fitted to the ``points`` free points around it."""

    xy: np.ndarray
    height: float
    radius: float
    points: int
    cones: list[Cone]


def _not_round(points: np.ndarray, tree: Nearby, weights: np.ndarray | None, free: np.ndarray,
               rejected: list[_Rejected], axes: np.ndarray, sensor: Sensor,
               options: SegmentOptions) -> list[Stem]:
    """Trees whose lower stem is no ring (buttresses, forks): bark in every row there, and a clean stem above it."""
    loose = replace(options, min_rows=0.85)
    low, high = options.low_m - 0.1, min(options.high_m, 4.25)
    kept: list[Stem] = []
    for one in rejected[:200]:
        h = one.height
        if stands_at(axes, one.xy[0], one.xy[1], h, 1.0, 0.0, 0.6):
            continue
        near = tree.within(one.xy, _REACH_M + one.radius, low, high)
        near = near[free[near]]
        cones = one.cones if len(near) == one.points else _fit_candidate(
            points[near], None if weights is None else weights[near], one.xy, h, one.radius, sensor, loose)
        stem = _best(cones, points[near], sensor, loose, strict=False)
        if stem is None or stem.points < 4 * sensor.least_points:
            continue
        pieces = _follow(points, tree, weights, stem.cone, sensor, options)
        if len(pieces) >= 5 and np.median([piece.sigma for piece in pieces]) < 0.9 * sensor.cap_m:
            kept.append(replace(stem, pieces=pieces, round=False))
            axes = np.vstack([axes, _axis(stem.cone)])
    return kept


def _best(cones: list[Cone], near: np.ndarray, sensor: Sensor, options: SegmentOptions,
          strict: bool = True) -> Stem | None:
    """The cone with the highest score of those that are a stem (:func:`judge`)."""
    best: Stem | None = None
    for cone in cones:
        stem = judge(cone, near, sensor, options, strict)
        if stem is not None and (best is None or stem.score > best.score):
            best = stem
    return best


def _fit_candidate(near: np.ndarray, weights: np.ndarray | None, xy: np.ndarray, h: float, radius: float,
                   sensor: Sensor, options: SegmentOptions) -> list[Cone]:
    """Cones grown from the candidate's layer to the whole band of (N, 3) points, from several starting radii."""
    if np.count_nonzero(np.abs(near[:, 2] - h) < _LAYER_M) < 6 or len(near) < sensor.least_points:
        return []
    # A few thousand points settle a fit; the judging counts them all.
    stride = max(len(near) // MOST_FITTED, 1)
    some = np.ascontiguousarray(near[::stride])
    weight = np.ones(len(some)) if weights is None else np.ascontiguousarray(weights[::stride])
    fits = grow(some, weight, xy, h, radius, _LAYER_M, sensor.floor_m, sensor.cap_m, _LAYER_LEAN_SD,
                float(np.tan(np.radians(options.max_lean_deg))), 6)
    grown = []
    for vector, covariance, sigma in zip(*fits, strict=True):
        x, y, dx, dy, r, taper, _, _ = vector.tolist()
        cone = Cone(x, y, dx, dy, r, taper, float(h), float(sigma), covariance)
        grown.append(_solid_radius(cone, near, weights) if sensor.solid else cone)
    return grown


def judge(cone: Cone, band: np.ndarray, sensor: Sensor, options: SegmentOptions, strict: bool = True) -> Stem | None:
    """The evidence that (N, 3) ``band`` points give for a cone, or ``None`` when it is no stem.

    strict: it has to be a clean ring; otherwise only bark in enough rows is asked for."""
    if not 0.015 < cone.radius(1.3) <= options.max_dbh_cm / 200:
        return None
    rows = int(np.ceil((min(options.high_m, 4.25) - options.low_m) / ROW_M))
    need = 1 if sensor.least_points < 30 else 4
    # Counted by voxels of row and sector, so that one dense side does not outvote the rest.
    on, share, arc, cells, inner, outer, core, fringe = count_evidence(
        np.ascontiguousarray(band), cone.vector, cone.h_ref, _tolerance(cone, sensor), sensor.noise_m, sensor.solid,
        options.low_m, rows, need)
    if on < sensor.least_points:
        return None
    inner, outer = inner / cells, outer / cells
    if share < options.min_rows or arc < options.min_arc_deg or strict and (inner > 0.35 or outer > 1.2):
        return None
    # Sharpness decides between fits: cells with bark within the sensor's noise against cells with points near it.
    score = share * (core - 0.5 * fringe - inner * cells)
    # Few points have to be the cleaner: nothing inside, hardly anything around.
    pure = score >= max(0.5 * share * cells, 18) or score >= max(0.6 * share * cells, 10) and inner + outer < 0.2
    # Rough bark or a noisy scanner: not sharp, but empty inside, clean outside and continuous.
    clean = inner <= 0.04 and outer <= 0.2 and share >= 0.85 and arc >= 150
    if strict and (not (pure or clean or sensor.solid) or cone.sigma > 0.35 * cone.radius(1.3)):
        return None
    return Stem(cone, float(score), share, float(arc), float(inner), float(outer), int(on))


def _solid_radius(cone: Cone, points: np.ndarray, weights: np.ndarray | None) -> Cone:
    """Radius of a filled stem: the largest mass within r over r (eq:weighted_score with p = 1, centre known)."""
    distance = cone.residuals(points) + cone.radius(points[:, 2])
    near = distance < 0.8
    order = np.argsort(distance[near])
    mass = np.cumsum(np.ones(near.sum()) if weights is None else weights[near][order])
    r = distance[near][order]
    usable = r > 0.03
    if not usable.any():
        return cone
    best = float(r[usable][np.argmax(mass[usable] / r[usable])])
    return replace(cone, r=best - cone.taper * 0.0)


def _same(one: Stem, other: Stem) -> bool:
    """Two fits of one stem: their axes come closer than bark allows, at breast height or above."""
    for h in (1.3, 3.0):
        gap = np.hypot(*(one.cone.centre(h) - other.cone.centre(h)))
        if gap < max(0.7 * max(one.cone.radius(h), other.cone.radius(h)), 0.05):
            return True
    return False


def _without_doubles(stems: list[Stem]) -> list[Stem]:
    """The better one of stems that stand in one another."""
    stems = sorted(stems, key=lambda stem: -stem.score)
    if len(stems) < 2:
        return stems
    feet = np.array([stem.cone.centre(1.3) for stem in stems])
    near = cKDTree(feet).query_ball_point(feet, 1.5)
    kept = np.zeros(len(stems), bool)
    for number, stem in enumerate(stems):
        kept[number] = not any(kept[other] and _same(stem, stems[other]) for other in near[number] if other < number)
    return [stem for stem, keep in zip(stems, kept, strict=True) if keep]


def _follow(points: np.ndarray, tree: Nearby, weights: np.ndarray | None, cone: Cone, sensor: Sensor,
            options: SegmentOptions) -> tuple[Cone, ...]:
    """Cones of 1.5 m length every metre above the band, as long as there is bark where the axis leads."""
    pieces: list[Cone] = []
    current = cone
    h = 4.75
    while h < options.grow_m - 0.75:
        middle = current.centre(h)
        near = tree.within(middle, float(current.radius(h)) + 0.15, h - 0.75, h + 0.75)
        if len(near) < sensor.least_points // 3:
            break
        near = near[::max(len(near) // MOST_FITTED, 1)]
        start = Cone(float(middle[0]), float(middle[1]), current.dx, current.dy, float(current.radius(h)),
                     TAPER_PRIOR, h, current.sigma)
        piece = fit_cone(points[near], start, None if weights is None else weights[near], (0.03,),
                         sensor.floor_m, sensor.cap_m, lean_sd=0.1)
        if piece is None or np.hypot(piece.x - middle[0], piece.y - middle[1]) > 0.10:
            break
        if not 0.75 < piece.r / start.r < 1.2 or piece.r < 0.015:
            break
        residual = np.abs(piece.residuals(points[near]))
        if (residual < _tolerance(piece, sensor)).mean() < 0.3:
            break
        pieces.append(piece)
        current = piece
        h += 1.0
    return tuple(pieces)
