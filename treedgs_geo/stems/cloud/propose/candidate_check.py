"""Is a fitted cone a stem? The evidence, counted, and what it has to be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.cone import Cone
from .evidence import ROW_M, count_evidence
from .options import SegmentOptions
from .sensors import Sensor, tolerance

#: A ring thicker than this share of its radius is none; and where it is as thick as the cloud's bark is everywhere.
THICK, THICK_AS_ALL, AS_ALL = 0.35, 0.45, 1.25
#: A clean ring thicker than the thickest stem that is looked for is listed and refused, up to so many times that; it is
#: so sharp or sharper.
LISTED_TIMES, LARGE_SHARP = 4.0, 0.5


@dataclass(frozen=True)
class ConeEvidence:
    """What (N, 3) points say about a cone: points on its bark, share of rows with bark, arc, cells with bark, and in
    shares of these what lies inside, just outside, within twice the cloud's noise and within two to six times."""

    points: int
    row_share: float
    arc_deg: float
    cells: int
    inside: float
    outside: float
    core: float
    fringe: float

    @property
    def sharp(self) -> float:
        """1 = all bark within the cloud's noise and nothing beside it."""
        return self.core - 0.5 * self.fringe - self.inside

    @property
    def score(self) -> float:
        """Sharp cells of bark, for as much as rows show it."""
        return self.row_share * self.cells * self.sharp


@dataclass(frozen=True)
class ConeStem:
    """A found stem. cone: local frame (see :class:`StemMap`), heights above ground. seen: the evidence. pieces: cones
    that follow the axis upwards, by height. refused: why it is seen but not measurable (a key of the list of reasons),
    empty for a clean ring. noise_m: spread of the cloud's bark, where it could be measured. at_seed: nothing was found
    there, the place was given."""

    cone: Cone
    seen: ConeEvidence
    pieces: tuple[Cone, ...] = ()
    refused: str = ""
    noise_m: float | None = None
    at_seed: bool = False


def best_stem(
    cones: list[Cone], near: np.ndarray, sensor: Sensor, options: SegmentOptions, strict: bool = True
) -> ConeStem | None:
    """The cone with the highest score of those that are a stem (:func:`accept`)."""
    stems = (accept(cone, near, sensor, options, strict) for cone in cones)
    found = (stem for stem in stems if stem is not None)
    return max(found, key=lambda stem: (not stem.refused, stem.seen.score), default=None)


def weigh(
    cone: Cone, band: np.ndarray, sensor: Sensor, options: SegmentOptions, noise_m: float = 0.0, need: int = 0
) -> ConeEvidence:
    """The evidence for a cone in the (N, 3) points of the band around it. noise_m: instead of the sensor's, need:
    points that make a row, instead of what the sensor needs; 0 = these."""
    rows = int(np.ceil((options.fitted_m[1] - options.low_m) / ROW_M))
    need = need or (1 if sensor.least_points < 30 else 4)
    about = cone.vector, cone.h_ref, tolerance(cone, sensor), noise_m or sensor.noise_m, sensor.solid
    on, share, arc, cells, *parts = count_evidence(np.ascontiguousarray(band), *about, options.low_m, rows, need)
    return ConeEvidence(int(on), float(share), float(arc), int(cells), *(float(part) / max(cells, 1) for part in parts))


def accept(
    cone: Cone, band: np.ndarray, sensor: Sensor, options: SegmentOptions, strict: bool = True
) -> ConeStem | None:
    """The evidence that (N, 3) ``band`` points give for a cone, or ``None`` when it is no stem.

    strict: it has to be a clean ring; otherwise only bark in enough rows is asked for."""
    if not 0.015 < cone.radius(1.3) <= LISTED_TIMES * options.max_dbh_cm / 200:
        return None
    seen = weigh(cone, band, sensor, options)
    if seen.points < sensor.least_points or seen.row_share < options.min_rows or seen.arc_deg < options.min_arc_deg:
        return None
    if strict and (seen.inside > 0.35 or seen.outside > 1.2):
        return None
    # Sharpness decides between fits: cells with bark within the cloud's noise against cells with points near it.
    score, full = seen.score, seen.row_share * seen.cells
    # Few points have to be the cleaner: nothing inside, hardly anything around.
    pure = score >= max(0.5 * full, 18) or score >= max(0.6 * full, 10) and seen.inside + seen.outside < 0.2
    # Rough bark or a noisy scanner: not sharp, but empty inside, clean outside and continuous.
    clean = seen.inside <= 0.04 and seen.outside <= 0.2 and seen.row_share >= 0.85 and seen.arc_deg >= 150
    thick = THICK_AS_ALL if cone.sigma < AS_ALL * sensor.noise_m else THICK
    thickest = min(thick * float(cone.radius(1.3)), sensor.fuzzy_m)
    if strict and (not (pure or clean or sensor.solid) or cone.sigma > thickest):
        return None
    too_large = cone.radius(1.3) > options.max_dbh_cm / 200
    if too_large and not (clean and seen.sharp > LARGE_SHARP):
        return None
    return as_stem(cone, seen, sensor, "too_large" if too_large else "")


def as_stem(cone: Cone, seen: ConeEvidence, sensor: Sensor, refused: str = "") -> ConeStem:
    """The cone as a stem with its evidence."""
    return ConeStem(cone, seen, refused=refused, noise_m=sensor.noise_m if np.isfinite(sensor.fuzzy_m) else None)
