"""How thick bark is in a cloud, from the clearest rings in it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...geometry.cone import Cone
from .candidate_check import weigh
from .options import SegmentOptions
from .region_growing import Search
from .sensors import MAX_NOISE_M, Sensor

#: Rings that the noise is taken from: found in most rows, seen from most sides, empty inside, little outside (shares
#: of the bark's points), and small against the radius.
MIN_ROWS, MIN_ARC_DEG, MAX_INSIDE, MAX_OUTSIDE, MAX_OF_RADIUS = 0.8, 240.0, 0.12, 0.45, 0.35
#: Rings that make the noise a cloud's, and candidates that are looked at for them.
LEAST_RINGS, MAX_TRIED = 2, 60


def ring_noise(cones: Iterable[Cone], near: np.ndarray, sensor: Sensor, options: SegmentOptions) -> float | None:
    """Spread of the bark of the clearest ring among the cones fitted to (N, 3) points; ``None`` where none is one."""
    best: tuple[float, float] | None = None
    for cone in cones:
        if cone.sigma > MAX_OF_RADIUS * cone.radius(1.3) or not 0 < cone.radius(1.3) <= options.max_dbh_cm / 200:
            continue
        seen = weigh(cone, near, sensor, options, cone.sigma, 1)
        if seen.points < sensor.least_points or seen.row_share < MIN_ROWS or seen.arc_deg < MIN_ARC_DEG:
            continue
        stray = seen.inside + seen.outside
        if seen.inside <= MAX_INSIDE and seen.outside <= MAX_OUTSIDE and (best is None or stray < best[0]):
            best = stray, cone.sigma
    return None if best is None else best[1]


def measured_noise(search: Search, candidates: np.ndarray, least: int) -> float | None:
    """Spread of the bark in this cloud, from the best of (K, 4) candidates; ``None`` with fewer than ``least`` clear
    rings."""
    own, search.sensor = search.sensor, search.sensor.at_noise(MAX_NOISE_M)
    rings: list[tuple[float, np.ndarray]] = []
    for *place, h, radius in candidates[:MAX_TRIED]:
        xy = np.array(place)
        if any(np.hypot(*(ring - xy)) < 0.3 for _, ring in rings):
            continue
        near = search.near(xy, radius)
        spread = ring_noise(search.cones(near, xy, h, radius), search.points[near], search.sensor, search.options)
        if spread is not None:
            rings.append((spread, xy))
    search.sensor = own
    return float(np.median([spread for spread, _ in rings])) if len(rings) >= least else None
