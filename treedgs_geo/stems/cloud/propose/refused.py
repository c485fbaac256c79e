"""Candidates that are no measurable stems: what they are listed as, and why."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ....pointcloud.cloud import extent
from ...geometry.cone import Cone
from .candidate_check import AS_ALL, THICK, ConeEvidence, ConeStem, as_stem, best_stem, weigh
from .options import SegmentOptions
from .region_growing import Search
from .sensors import Sensor

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
    """Candidates that look like stems and cannot be measured: upright, empty inside, little around them, but too few
    sides seen, too thin for the noise, or veiled by twigs."""
    kept: list[ConeStem] = []
    for one in rejected[:MAX_LISTED]:
        if search.is_stem(one.xy, one.height, beyond_m=BESIDE_M):
            continue
        stem = veiled(one.cones, search.points[search.near(one.xy, one.radius)], search.sensor, search.options)
        if stem is not None and not search.is_stem(stem.cone.centre(one.height), one.height, beyond_m=BESIDE_M):
            kept.append(stem)
            search.add(stem.cone)
    return kept


def veiled(cones: list[Cone], near: np.ndarray, sensor: Sensor, options: SegmentOptions) -> ConeStem | None:
    """The clearest of the cones that stand out as upright and hollow without being a clean ring, with the reason."""
    best: ConeStem | None = None
    for cone in cones:
        if not 0.015 < cone.radius(1.3) <= options.max_dbh_cm / 200:
            continue
        seen = weigh(cone, near, sensor, options)
        upright = seen.points >= LISTED_POINTS * sensor.least_points and seen.row_share >= LISTED_ROWS
        hollow = seen.inside <= LISTED_INSIDE and seen.outside <= LISTED_OUTSIDE and seen.sharp >= LISTED_SHARP
        if not upright or not hollow or seen.arc_deg < LISTED_ARC_DEG:
            continue
        stem = as_stem(cone, seen, sensor, _reason(cone, seen, sensor, options))
        if stem.refused and (best is None or stem.seen.score > best.seen.score):
            best = stem
    return best


def _reason(cone: Cone, seen: ConeEvidence, sensor: Sensor, options: SegmentOptions) -> str:
    """Why it is no clean ring; empty where a sliver of bark is not even sharp."""
    if seen.arc_deg < options.min_arc_deg:
        return "short_arc" if seen.sharp >= LISTED_SHARP_ARC else ""
    thin = THICK * cone.radius(1.3) < cone.sigma <= AS_ALL * sensor.noise_m
    return "too_small" if thin else "occluded"


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
    seen = [
        weigh(cone, near, sensor, options) for cone in cones if 0.015 < cone.radius(1.3) <= options.max_dbh_cm / 200
    ]
    best = max(seen, key=lambda one: one.score, default=None)
    if best is None or best.row_share < options.min_rows:
        return "occluded"
    if best.arc_deg < options.min_arc_deg:
        return "short_arc"
    return "not_round" if best.inside > 0.35 else "occluded"
