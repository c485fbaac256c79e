"""Stems in a point cloud, without trained weights: vote for rings, fit leaning cones, keep what is bark.

Steps: slab over the terrain -> candidates (:mod:`.candidates`) tile by tile -> robust cone fit from the candidate,
grown from its layer to the whole band -> evidence checks (rows of the stem with bark, arc, emptiness inside, clutter
outside) -> explained points are taken away from later candidates -> the axis is followed upwards -> every point
near a stem gets its ``tree_id``. A fork above breast height is one tree. Parameters follow treeX for drone LiDAR where
they have a counterpart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from scipy.spatial import cKDTree

from ....core.machine import in_threads
from ....core.progress import Reporter
from ....pointcloud.cloud import PointCloud, by_key, extent, thin
from ....terrain.dtm import Dtm
from ....terrain.ground import height_above_ground
from ...geometry.cone import Cone
from .candidate_check import AS_ALL, THICK, ConeEvidence, ConeStem, as_stem, best_stem, weigh
from .candidates import find_candidates
from .options import SegmentOptions
from .region_growing import Search
from .sensors import MAX_NOISE_M, SENSORS, Sensor, tolerance

#: Side of the squares that a cloud is searched in, how far outside a square its stems may stand, and side of the cells
#: that its points are taken from, metres.
TILE_M, OUTSIDE_M, CELL_M = 30.0, 0.8, 3.0
#: The lowest points of a search, metres above ground.
SLAB_M = 0.2


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
        stems, unseen = (tuple(stem for stem in found if stem.at_seed == at_seed) for at_seed in (False, True))
        return cls(stems, origin, sensor, unseen)


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
    low, high = extent(cloud.xyz[:, :2])
    origin = np.floor(low)
    source = options.source
    if source == "auto":
        band = np.flatnonzero((height > options.low_m) & (height < options.high_m))
        source = guess_sensor(cloud, np.column_stack([cloud.xyz[band, :2] - origin, height[band]]), options)
        del band  # a part of the cloud
    weights = cloud.attributes.get("opacity")
    span = np.floor((high - origin) / CELL_M).astype(np.int64) + 1
    order, starts = by_key(_cells(cloud.xyz, height, origin, SLAB_M, float(options.grow_m), span), np.prod(span))
    held = np.flatnonzero(np.diff(starts))
    tiles = list(np.unique(np.column_stack([held // span[1], held % span[1]]) // round(TILE_M / CELL_M), axis=0))
    sensor = SENSORS[source]
    seeds = None if seeds_xy is None else np.asarray(seeds_xy, float) - origin
    found: list[ConeStem] = []
    # How far a tile sees into its neighbours: half of the thickest stem, and what is around it.
    buffer_m = max(1.5, OUTSIDE_M + options.max_dbh_cm / 200 + 0.1)

    def stems_in(tile: np.ndarray) -> list[ConeStem]:
        low, high = tile * TILE_M - buffer_m, (tile + 1) * TILE_M + buffer_m
        first, last = (np.clip(np.floor(corner / CELL_M).astype(int), 0, span - 1) for corner in (low, high))
        rows = [i * span[1] for i in range(first[0], last[0] + 1)]
        parts = [order[starts[row + first[1]] : starts[row + last[1] + 1]] for row in rows]
        points, index = _columns(cloud.xyz, height, origin, np.sort(np.concatenate(parts)), low, high)
        # The search costs as much in any denser cloud, and finds the same.
        kept = thin(points, sensor.voxel_m, sensor.max_points)
        weight = None if weights is None else np.clip(np.asarray(weights[index[kept]], float), 0.02, 1.0)
        stems = search_tile(points[kept], weight, sensor, options, seeds=seeds)
        feet = [stem.cone.centre(1.3) for stem in stems]
        # Farther out a stem may be cut in half.
        low, high = tile * TILE_M - OUTSIDE_M, (tile + 1) * TILE_M + OUTSIDE_M
        return [stem for stem, foot in zip(stems, feet, strict=True) if ((foot > low) & (foot < high)).all()]

    for number, in_tile in enumerate(in_threads(stems_in, tiles)):
        found += in_tile
        reporter.progress((number + 1) / len(tiles))
    return StemMap.of(without_doubles(found), origin, source)


@njit(cache=True)
def _cells(xyz, height, origin, low_m, high_m, span):  # pragma: no cover - compiled
    """(N,) the cell of each point with low_m < height < high_m, -1 for others."""
    cell = np.full(height.shape[0], -1, np.int32)
    for m in range(height.shape[0]):
        if low_m < height[m] < high_m:
            i, j = int((xyz[m, 0] - origin[0]) / CELL_M), int((xyz[m, 1] - origin[1]) / CELL_M)
            cell[m] = i * span[1] + j
    return cell


@njit(cache=True, nogil=True)
def _columns(xyz, height, origin, index, low, high):  # pragma: no cover - compiled
    """(M, 3) xy from ``origin`` and height of those of the points of ``index`` with (2,) low <= xy < high, and their
    indices."""
    points, kept = np.empty((index.shape[0], 3)), np.empty(index.shape[0], np.int64)
    count = 0
    for m in index:
        x, y = xyz[m, 0] - origin[0], xyz[m, 1] - origin[1]
        if low[0] <= x < high[0] and low[1] <= y < high[1]:
            points[count, 0], points[count, 1], points[count, 2], kept[count] = x, y, height[m], m
            count += 1
    return points[:count], kept[:count]


def guess_sensor(cloud: PointCloud, points: np.ndarray, options: SegmentOptions) -> str:
    """``splat`` when points carry opacity; else by density: more than 120 points/m2 of stem band are terrestrial."""
    if "opacity" in cloud.attributes:
        return "splat"
    band = points[(points[:, 2] > options.low_m) & (points[:, 2] < options.high_m)]
    if len(band) < 50:
        return "uls"
    low, high = (np.floor(corner).astype(np.int64) for corner in extent(band[:, :2]))
    cell = np.floor(band[:, :2]).astype(np.int64) - low
    return "tls" if len(band) / len(np.unique(cell[:, 0] * (high[1] - low[1] + 1) + cell[:, 1])) > 120 else "uls"


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
    some, limits = None if weights is None else weights[band], (options.low_m, options.high_m)
    # Twice the radius that is measured: thicker ones are listed.
    candidates = find_candidates(points[band], some, *limits, sensor.solid, options.max_dbh_cm / 100, near=seeds)
    search = Search(points, weights, sensor, options)
    if not sensor.solid:
        noise = measured_noise(search, candidates, LEAST_RINGS if follow else 1)
        search.sensor = sensor = sensor if noise is None else sensor.at_noise(noise)
    found: list[ConeStem] = []
    rejected: list[Rejected] = []
    for *place, h, radius in candidates:
        xy = np.array(place)
        if search.is_stem(xy, h, 0.8, 0.05):
            continue
        near = search.near(xy, radius)
        cones = search.cones(near, xy, h, radius)
        stem = best_stem(cones, points[near], sensor, options)
        if stem is None:
            rejected.append(Rejected(xy, float(h), float(radius), len(near), cones))
            continue
        if any(_same(stem, other) for other in found):
            continue
        search.free[near[stem.cone.residuals(points[near]) < tolerance(stem.cone, sensor)]] = False
        found.append(replace(stem, pieces=search.follow_up(stem.cone)) if follow else stem)
        search.add(stem.cone)
    if follow:
        found += not_round(search, rejected)
        if not sensor.solid:
            found += listed(search, rejected)
        stems = without_limbs(search, found)
        if seeds is not None:
            search.axes = search.axes[:0]
            search.add(*(stem.cone for stem in stems))
            stems += at_seeds(search, seeds)
        found = stems
    return found


def _same(one: ConeStem, other: ConeStem) -> bool:
    """Two fits of one stem: their axes come closer than bark allows, at breast height or above."""
    return any(
        np.hypot(*(one.cone.centre(h) - other.cone.centre(h)))
        < max(0.7 * max(one.cone.radius(h), other.cone.radius(h)), 0.05)
        for h in (1.3, 3.0)
    )


def without_doubles(stems: list[ConeStem]) -> list[ConeStem]:
    """The better one of stems that stand in one another."""
    stems = sorted(stems, key=lambda stem: -stem.seen.score)
    if len(stems) < 2:
        return stems
    feet = np.array([stem.cone.centre(1.3) for stem in stems])
    near = cKDTree(feet).query_ball_point(feet, 1.5)
    kept = np.zeros(len(stems), bool)
    for number, stem in enumerate(stems):
        kept[number] = not any(kept[other] and _same(stem, stems[other]) for other in near[number] if other < number)
    return [stem for stem, keep in zip(stems, kept, strict=True) if keep]


#: Heights between which a tree has bark of its own at its foot, and from which on a limb's own bark counts, m.
FOOT_M, LIMB_M = (0.4, 1.5), 1.6
#: A limb has less than this share of its own density of points at the foot; its stem more than the second.
OWN_FOOT, STEM_FOOT = 0.2, 0.4
#: Limbs start this close to the bark of their stem at one of these heights, m.
JOINS_M, _JOINED_AT_M = 0.15, (1.3, 2.0, 3.0)


def without_limbs(search: Search, found: list[ConeStem]) -> list[ConeStem]:
    """The stems without those that are limbs of another one: no bark of their own at the foot, and joining it."""
    at = np.array([[*stem.cone.centre(h), stem.cone.radius(h)] for stem in found for h in _JOINED_AT_M])
    at = at.reshape(len(found), len(_JOINED_AT_M), 3)
    stems = []
    for number, limb in enumerate(found):
        # Stems whose axes come close enough for this one to grow out of them.
        gap = np.hypot(at[:, :, 0] - at[number, :, 0], at[:, :, 1] - at[number, :, 1])
        near = np.flatnonzero((gap < at[:, :, 2] + at[number, :, 2] + JOINS_M).any(axis=1))
        others = [found[k] for k in near if k != number and not found[k].refused and not found[k].at_seed]
        if not any(_is_limb(search, limb, stem) for stem in others):
            stems.append(limb)
    return stems


def _is_limb(search: Search, limb: ConeStem, stem: ConeStem) -> bool:
    """Bark that each of the two has for itself, below and above: a point belongs to the nearer bark; what lies within
    the stem is not the limb's."""
    sensor, top_m = search.sensor, search.options.fitted_m[1]
    middle = limb.cone.centre(2.0)
    reach = float(limb.cone.radius(0.5)) + 0.1 + 3.0 * float(np.hypot(limb.cone.dx, limb.cone.dy))
    reach += float(np.hypot(*(middle - stem.cone.centre(2.0)))) + float(stem.cone.radius(0.5))
    near = search.points[search.tree.within(middle, reach, FOOT_M[0], top_m)]
    of_limb, of_stem = limb.cone.residuals(near), stem.cone.residuals(near)
    near_stem = of_stem < tolerance(stem.cone, sensor)
    low, high = (near[:, 2] < FOOT_M[1]), (near[:, 2] > LIMB_M)
    own = (np.abs(of_limb) < tolerance(limb.cone, sensor)) & ~(near_stem & (near[:, 2] < FOOT_M[1]))
    main = np.abs(of_stem) < tolerance(stem.cone, sensor)
    foot, above = FOOT_M[1] - FOOT_M[0], top_m - LIMB_M
    usual = np.count_nonzero(own & high & ~near_stem) / above
    below = np.count_nonzero(own & low) / foot
    return bool(usual > 0 and below < OWN_FOOT * usual and np.count_nonzero(main & low) / foot > STEM_FOOT * usual)


#: Rings that the noise is taken from: found in most rows, seen from most sides, empty inside, little outside (shares
#: of the bark's points), and small against the radius.
MIN_ROWS, MIN_ARC_DEG, MAX_INSIDE, MAX_OUTSIDE, MAX_OF_RADIUS = 0.8, 240.0, 0.12, 0.45, 0.35
#: Rings that make the noise a cloud's, and candidates that are looked at for them.
LEAST_RINGS, MAX_TRIED = 2, 60


def measured_noise(search: Search, candidates: np.ndarray, least: int) -> float | None:
    """Spread of the bark in this cloud, from the best of (K, 4) candidates, the clearest ring at each; ``None`` with
    fewer than ``least`` clear rings."""
    own, options = search.sensor, search.options
    search.sensor = sensor = own.at_noise(MAX_NOISE_M)
    rings: list[tuple[float, np.ndarray]] = []
    for *place, h, radius in candidates[:MAX_TRIED]:
        xy = np.array(place)
        if any(np.hypot(*(ring - xy)) < 0.3 for _, ring in rings):
            continue
        near = search.near(xy, radius)
        clear = []
        for cone in search.cones(near, xy, h, radius):
            if cone.sigma > MAX_OF_RADIUS * cone.radius(1.3) or not 0 < cone.radius(1.3) <= options.max_dbh_cm / 200:
                continue
            seen = weigh(cone, search.points[near], sensor, options, cone.sigma, 1)
            whole = seen.points >= sensor.least_points and seen.row_share >= MIN_ROWS and seen.arc_deg >= MIN_ARC_DEG
            if whole and seen.inside <= MAX_INSIDE and seen.outside <= MAX_OUTSIDE:
                clear.append((seen.inside + seen.outside, cone.sigma))
        if clear:
            rings.append((min(clear, key=lambda ring: ring[0])[1], xy))
    search.sensor = own
    return float(np.median([spread for spread, _ in rings])) if len(rings) >= least else None


#: What is listed as seen but not measurable: rows with bark, arc, shares inside and outside, sharpness (of a sliver of
#: bark: more), points (of the least a stem needs). Set on generated mobile scans (even seeds) and the shared real
#: clouds, so that shrubs are not listed.
LISTED_ROWS, LISTED_ARC_DEG, LISTED_INSIDE, LISTED_OUTSIDE = 0.9, 45.0, 0.05, 0.25
LISTED_SHARP, LISTED_SHARP_ARC, LISTED_POINTS = 0.2, 0.6, 2
#: Candidates looked at, and distance from the bark of stems within which a candidate is part of them, m.
MAX_LISTED, BESIDE_M = 200, 0.15

#: A found stem whose bark is closer than this to a given place answers for it; height that is looked at, and radii that
#: cones are started from where none is, m.
SEED_M, SEED_AT_M, SEED_RADII_M = 0.3, 1.5, (0.06, 0.12, 0.2)


@dataclass(frozen=True)
class Rejected:
    """A candidate that was no clean ring, and the cones fitted to the ``points`` free points around it."""

    xy: np.ndarray
    height: float
    radius: float
    points: int
    cones: list[Cone]


def not_round(search: Search, rejected: list[Rejected]) -> list[ConeStem]:
    """Trees whose lower stem is no ring (buttresses, forks): bark in every row there, and a clean stem above it."""
    sensor, loose = search.sensor, replace(search.options, min_rows=0.85)
    kept: list[ConeStem] = []
    for one in rejected[:200]:
        if search.is_stem(one.xy, one.height, beyond_m=0.6):
            continue
        near = search.near(one.xy, one.radius)
        same = len(near) == one.points
        cones = one.cones if same else search.cones(near, one.xy, one.height, one.radius, loose)
        stem = best_stem(cones, search.points[near], sensor, loose, strict=False)
        if stem is None or stem.seen.points < 4 * sensor.least_points:
            continue
        pieces = search.follow_up(stem.cone)
        if len(pieces) >= 5 and np.median([piece.sigma for piece in pieces]) < 0.9 * sensor.cap_m:
            kept.append(replace(stem, pieces=pieces, refused="not_round"))
            search.add(stem.cone)
    return kept


def listed(search: Search, rejected: list[Rejected]) -> list[ConeStem]:
    """Candidates that look like stems and cannot be measured, the clearest cone of each: upright, empty inside, little
    around them, but too few sides seen, too thin for the noise, or veiled by twigs."""
    sensor, options = search.sensor, search.options
    kept: list[ConeStem] = []
    for one in rejected[:MAX_LISTED]:
        if search.is_stem(one.xy, one.height, beyond_m=BESIDE_M):
            continue
        found = []
        for cone, seen in _weighed(one.cones, search.points[search.near(one.xy, one.radius)], sensor, options):
            upright = seen.points >= LISTED_POINTS * sensor.least_points and seen.row_share >= LISTED_ROWS
            hollow = seen.inside <= LISTED_INSIDE and seen.outside <= LISTED_OUTSIDE and seen.sharp >= LISTED_SHARP
            reason = "occluded"
            if seen.arc_deg < options.min_arc_deg:
                # A sliver of bark has to be sharp.
                reason = "short_arc" if seen.sharp >= LISTED_SHARP_ARC else ""
            elif THICK * cone.radius(1.3) < cone.sigma <= AS_ALL * sensor.noise_m:
                reason = "too_small"
            if upright and hollow and seen.arc_deg >= LISTED_ARC_DEG and reason:
                found.append(as_stem(cone, seen, sensor, reason))
        stem = max(found, key=lambda stem: stem.seen.score, default=None)
        if stem is not None and not search.is_stem(stem.cone.centre(one.height), one.height, beyond_m=BESIDE_M):
            kept.append(stem)
            search.add(stem.cone)
    return kept


def _weighed(
    cones: list[Cone], near: np.ndarray, sensor: Sensor, options: SegmentOptions
) -> list[tuple[Cone, ConeEvidence]]:
    """The cones that are no thicker than a stem may be, with their evidence in (N, 3) points."""
    fitting = [cone for cone in cones if 0.015 < cone.radius(1.3) <= options.max_dbh_cm / 200]
    return [(cone, weigh(cone, near, sensor, options)) for cone in fitting]


def at_seeds(search: Search, seeds: np.ndarray) -> list[ConeStem]:
    """An answer for each of (K, 2) places given where no stem was found within ``SEED_M``: a stem after all, where a
    cone started at the place itself is one, or the reason why there is none (``at_seed``)."""
    sensor, options = search.sensor, search.options
    low, high = extent(search.points[:, :2])
    inside = (seeds >= low - SEED_M).all(axis=1) & (seeds <= high + SEED_M).all(axis=1)
    answers: list[ConeStem] = []
    for place in seeds[inside]:
        if search.is_stem(place, SEED_AT_M, beyond_m=SEED_M):
            continue
        near = search.near(place)
        cones = [
            cone
            for radius in SEED_RADII_M
            for cone in search.cones(near, place, SEED_AT_M, radius)
            if np.hypot(*(cone.centre(SEED_AT_M) - place)) < SEED_M + cone.radius(SEED_AT_M)
        ]
        stem = best_stem(cones, search.points[near], sensor, options)
        if stem is None or search.is_stem(stem.cone.centre(SEED_AT_M), SEED_AT_M, beyond_m=BESIDE_M):
            there = Cone(float(place[0]), float(place[1]), 0.0, 0.0, 0.05, 0.0, SEED_AT_M)
            reason = _reason_at(cones, search.points[near], place, sensor, options)
            seen = ConeEvidence(len(near), 0.0, 0.0, 0, 0.0, 0.0, 0.0, 0.0)
            stem = ConeStem(there, seen, at_seed=True, refused=reason)
        else:
            search.add(stem.cone)
        answers.append(stem)
    return answers


def _reason_at(cones: list[Cone], near: np.ndarray, place: np.ndarray, sensor: Sensor, options: SegmentOptions) -> str:
    """Why (N, 3) points around a given place show no stem."""
    close = np.count_nonzero(np.hypot(*(near[:, :2] - place).T) < SEED_M + SEED_RADII_M[-1])
    if close < LISTED_POINTS * sensor.least_points:
        return "few_points"
    seen = [each for _, each in _weighed(cones, near, sensor, options)]
    best = max(seen, key=lambda one: one.score, default=None)
    if best is None or best.row_share < options.min_rows:
        return "occluded"
    if best.arc_deg < options.min_arc_deg:
        return "short_arc"
    return "not_round" if best.inside > 0.35 else "occluded"
