"""A stem as the photos show it: what a fit gives out."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...quality.assessment import Assessment
from ...quality.findings import Flag
from ..images.axis_patches import StemAxis
from ..quality_control import Evidence, assess
from ..tuned import SEEN_MEAN_Z, SEEN_PRIOR, Z_CAP


@dataclass(frozen=True)
class PhotoFit:
    """A stem as the photos show it, local frame."""

    #: Stem axis; ``axis.p`` is at breast height.
    axis: StemAxis
    #: Radius at breast height, m.
    r0: float
    #: Slope of the radius, m/m.
    r1: float
    #: What was found out about it.
    evidence: Evidence
    #: Score of the detection.
    seed_score: float
    #: (V,) probability that each photo sees it.
    seen: np.ndarray = field(repr=False)
    #: Ground on the uphill side of the foot, local m.
    foot_z: float = np.nan
    #: Oval of the section, m (:class:`.edge_adjustment.FineFit`).
    oval: tuple[float, float] = (0.0, 0.0)
    #: Names of the V photos looked at.
    photos: tuple[str, ...] = field(default=(), repr=False)

    @cached_property
    def assessment(self) -> Assessment:
        """What is stated of it: diameter, error, interval, flag and reasons."""
        return assess(self.evidence)

    @property
    def carried(self) -> bool:
        """Measured above breast height (:mod:`.upper_stem`)."""
        return self.evidence.carried_m > 0

    @property
    def lean_deg(self) -> float:
        """Angle of the axis from the vertical at breast height."""
        return float(np.degrees(np.arctan(np.hypot(*self.axis.s))))

    @property
    def row(self) -> np.ndarray:
        """(10,) for :func:`.images.axis_patches.hide_known`."""
        return np.concatenate([self.axis.row, [self.r0, self.r1]])

    @property
    def dbh_cm(self) -> float:
        """Diameter that is stated, cm."""
        return self.assessment.dbh_cm

    @property
    def se_cm(self) -> float:
        """Its standard error, cm."""
        return self.assessment.se_cm

    @property
    def flag(self) -> Flag:
        """``ok``, ``check`` or ``reject``."""
        return self.assessment.flag

    @property
    def reasons(self) -> tuple[str, ...]:
        """Keys of :data:`treedgs_geo.stems.quality.reasons.REASONS`."""
        return self.assessment.reasons

    @property
    def measured(self) -> bool:
        """Has a diameter."""
        return self.assessment.measured

    def knowing(self, **evidence: Any) -> PhotoFit:
        """The fit with other values of fields of its evidence."""
        return replace(self, evidence=replace(self.evidence, **evidence))


def seen_probability(z: np.ndarray) -> np.ndarray:
    """(V,) posterior that a view sees the stem, from its z-score."""
    odds = SEEN_PRIOR * np.exp(SEEN_MEAN_Z * np.minimum(z, Z_CAP) - 0.5 * SEEN_MEAN_Z**2)
    return np.where(z > -8.9, odds / (1 - SEEN_PRIOR + odds), 0.0)
