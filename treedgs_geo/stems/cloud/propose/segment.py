"""Stems in a point cloud, without trained weights: vote for rings, fit leaning cones, keep what is bark.

Steps: slab over the terrain -> candidates (:mod:`.candidates`) tile by tile -> robust cone fit from the candidate,
grown from its layer to the whole band -> evidence checks (rows of the stem with bark, arc, emptiness inside, clutter
outside) -> explained points are taken away from later candidates -> the axis is followed upwards -> every point
near a stem gets its ``tree_id``. Parameters follow treeX for drone LiDAR where they have a counterpart.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from scipy.spatial import cKDTree

from ....core.machine import available_threads
from ....core.progress import Reporter
from ....pointcloud.cloud import PointCloud, extent, slices
from ....terrain.dtm import Dtm
from ....terrain.ground import height_above_ground
from .candidate_check import ConeStem, best_stem
from .candidates import find_candidates
from .evidence import stands_at
from .forks import without_limbs
from .labelling import Labeller
from .nearby import Nearby
from .noise import LEAST_RINGS, measured_noise
from .options import SegmentOptions
from .refused import Rejected, at_seeds, axis_row, listed, not_round
from .region_growing import REACH_M, fit_candidate, follow_up
from .sensors import SENSORS, Sensor, settled, tolerance

#: Side of the squares that a cloud is searched in, and how far outside a square its stems may stand, metres.
TILE_M, OUTSIDE_M = 30.0, 0.8


@dataclass(frozen=True)
class StemMap:
    """Stems of a cloud: ``origin`` (2,) is added to the cones' xy for project coordinates; index + 1 = tree_id.
    unseen: given places (seeds) where none was found, with the reason."""

    stems: tuple[ConeStem, ...]
    origin: np.ndarray
    sensor: str
    unseen: tuple[ConeStem, ...] = ()

    @classmethod
    def of(cls, found: list[ConeStem], origin: np.ndarray, sensor: str) -> StemMap:
        """In a stable order, north to south."""
        found = sorted(found, key=lambda stem: (-round(stem.cone.y, 1), stem.cone.x))
        return cls(
            tuple(stem for stem in found if not stem.at_seed),
            origin,
            sensor,
            tuple(stem for stem in found if stem.at_seed),
        )


def segment_stems(
    cloud: PointCloud, dtm: Dtm, options: SegmentOptions | None = None, reporter: Reporter | None = None
) -> np.ndarray:
    """(N,) int32 ``tree_id`` of each point, 0 = no stem. See :func:`find_stems` for the stems themselves."""
    height = height_above_ground(cloud.xyz, dtm)
    stems = find_stems(cloud, dtm, options, reporter, height=height)
    return label_points(cloud.xyz, height, stems)


def find_stems(
    cloud: PointCloud,
    dtm: Dtm,
    options: SegmentOptions | None = None,
    reporter: Reporter | None = None,
    seeds_xy: np.ndarray | None = None,
    height: np.ndarray | None = None,
) -> StemMap:
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
    del slab  # as large as the coordinates that it chose
    source = options.source if options.source != "auto" else guess_sensor(cloud, points, options)
    sensor = SENSORS[source]
    if len(points):
        kept = settled(points, sensor)
        points, weights = points[kept], None if weights is None else weights[kept]
    seeds = None if seeds_xy is None else np.asarray(seeds_xy, float) - origin
    found = _search(points, weights, sensor, options, reporter, seeds) if len(points) else []
    return StemMap.of(found, origin, source)


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


@njit(cache=True, nogil=True)
def in_columns(points, low, high):  # pragma: no cover - compiled
    """(M,) indices of the (N, 3) points with (2,) low <= xy < high."""
    index = np.empty(points.shape[0], np.int64)
    count = 0
    for m in range(points.shape[0]):
        if low[0] <= points[m, 0] < high[0] and low[1] <= points[m, 1] < high[1]:
            index[count] = m
            count += 1
    return index[:count].copy()


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
    low, high = (np.floor(corner / size_m).astype(np.int64) for corner in extent(points[:, :2]))
    span = high[1] - low[1] + 1

    def keys(part: np.ndarray) -> np.ndarray:
        i, j = (np.floor(part[:, :2] / size_m).astype(np.int64) - low).T
        return np.unique(i * span + j)

    key = np.unique(np.concatenate([keys(points[part]) for part in slices(len(points))]))
    return np.column_stack([key // span, key % span]) + low


def label_points(xyz: np.ndarray, height: np.ndarray, stems: StemMap) -> np.ndarray:
    """(N,) int32 tree ids: points inside a stem's bark or within its noise outside; the nearest bark wins."""
    return Labeller(stems)(xyz, height)


def search_points(
    points: np.ndarray, weights: np.ndarray | None, sensor: Sensor, options: SegmentOptions | None = None
) -> list[ConeStem]:
    """The stems in a small set of (N, 3) points (x, y, height above ground), say one tree of another segmenter."""
    return without_doubles(search_tile(points, weights, sensor, options or SegmentOptions(), follow=False))


def _search(
    points: np.ndarray,
    weights: np.ndarray | None,
    sensor: Sensor,
    options: SegmentOptions,
    reporter: Reporter,
    seeds: np.ndarray | None = None,
) -> list[ConeStem]:
    """Tile by tile with a buffer; what two tiles both find is kept once."""
    found: list[ConeStem] = []
    tiles = _cells(points, TILE_M)

    def stems_in(corner: np.ndarray) -> list[ConeStem]:
        low, high = corner * TILE_M - buffer_m(options), (corner + 1) * TILE_M + buffer_m(options)
        inside = in_columns(points, low, high)
        stems = search_tile(points[inside], None if weights is None else weights[inside], sensor, options, seeds=seeds)
        return [stem for stem in stems if stands_in(stem, corner)]

    with ThreadPoolExecutor(min(available_threads(), len(tiles))) as workers:
        for number, stems in enumerate(workers.map(stems_in, tiles)):
            found += stems
            reporter.progress((number + 1) / len(tiles))
    return without_doubles(found)


def buffer_m(options: SegmentOptions) -> float:
    """How far a square sees into its neighbours: half of the thickest stem, and what is around it."""
    return max(1.5, OUTSIDE_M + options.max_dbh_cm / 200 + 0.1)


def stands_in(stem: ConeStem, corner: np.ndarray) -> bool:
    """Whether a stem stands in the square of (2,) ``corner`` or just outside it: farther out it may be cut in half."""
    foot = stem.cone.centre(1.3)
    return bool(((foot > corner * TILE_M - OUTSIDE_M) & (foot < (corner + 1) * TILE_M + OUTSIDE_M)).all())


def search_tile(
    points: np.ndarray,
    weights: np.ndarray | None,
    sensor: Sensor,
    options: SegmentOptions,
    follow: bool = True,
    seeds: np.ndarray | None = None,
) -> list[ConeStem]:
    """Stems in (N, 3) points: xy metres, height above ground. seeds: (K, 2) places where weaker evidence is looked at;
    follow: bark is followed up the stem."""
    band = (points[:, 2] >= options.low_m) & (points[:, 2] < options.high_m)
    if band.sum() < sensor.least_points:
        return []
    candidates = find_candidates(
        points[band],
        None if weights is None else weights[band],
        options.low_m,
        options.high_m,
        sensor.solid,
        options.max_dbh_cm / 100,  # thicker ones are listed
        near=seeds,
    )
    tree = Nearby(points)
    free = np.ones(len(points), bool)
    if not sensor.solid:
        noise = measured_noise(points, tree, weights, candidates, sensor, options, LEAST_RINGS if follow else 1)
        sensor = sensor if noise is None else sensor.at_noise(noise)
    found: list[ConeStem] = []
    axes = np.empty((0, 9))
    rejected: list[Rejected] = []
    low, high = options.low_m - 0.1, min(options.high_m, 4.25)
    for xy, h, radius in zip(candidates.xy, candidates.height, candidates.radius, strict=True):
        if stands_at(axes, xy[0], xy[1], h, 0.8, 0.05, 0.0):
            continue
        near = tree.within(xy, REACH_M + radius, low, high)
        near = near[free[near]]
        cones = fit_candidate(points[near], None if weights is None else weights[near], xy, h, radius, sensor, options)
        stem = best_stem(cones, points[near], sensor, options)
        if stem is None:
            rejected.append(Rejected(xy, float(h), float(radius), len(near), cones))
            continue
        if any(_same(stem, other) for other in found):
            continue
        residual = stem.cone.residuals(points[near])
        free[near[residual < tolerance(stem.cone, sensor)]] = False
        pieces = follow_up(points, tree, weights, stem.cone, sensor, options) if follow else ()
        found.append(replace(stem, pieces=pieces))
        axes = np.vstack([axes, axis_row(stem.cone)])
    if follow:
        found += not_round(points, tree, weights, free, rejected, axes, sensor, options)
        if not sensor.solid:
            axes = np.array([axis_row(stem.cone) for stem in found]).reshape(-1, 9)
            found += listed(points, tree, free, rejected, axes, sensor, options)
        found = without_limbs(found, points, tree, sensor, min(options.high_m, 4.25))
    if seeds is not None and follow:
        axes = np.array([axis_row(stem.cone) for stem in found]).reshape(-1, 9)
        found += at_seeds(points, tree, weights, free, seeds, axes, sensor, options)
    return found


def _same(one: ConeStem, other: ConeStem) -> bool:
    """Two fits of one stem: their axes come closer than bark allows, at breast height or above."""
    for h in (1.3, 3.0):
        gap = np.hypot(*(one.cone.centre(h) - other.cone.centre(h)))
        if gap < max(0.7 * max(one.cone.radius(h), other.cone.radius(h)), 0.05):
            return True
    return False


def without_doubles(stems: list[ConeStem]) -> list[ConeStem]:
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
