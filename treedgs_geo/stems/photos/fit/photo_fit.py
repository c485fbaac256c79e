"""A stem as the photos show it: what a fit gives out."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from ...quality.assessment import Assessment
from ...quality.findings import Flag
from ..images.axis_patches import StemAxis
from .search_kernels import SEEN_MEAN_Z, SEEN_PRIOR, Z_CAP


@dataclass(frozen=True)
class PhotoFit:
    """A stem as the photos show it, local frame."""

    #: Stem axis; ``axis.p`` is at breast height.
    axis: StemAxis
    #: Radius at breast height, m.
    r0: float
    #: Slope of the radius, m/m.
    r1: float
    #: Diameter at breast height, cm.
    dbh_cm: float
    #: Its standard error, cm, given that the right edges were found.
    se_cm: float
    flag: Flag
    #: Keys of :data:`treedgs_geo.stems.quality.reasons.REASONS`.
    reasons: tuple[str, ...]
    #: Score of the detection.
    seed_score: float
    #: Log likelihood ratio of the fit against chance.
    llr: float
    #: Lead of ``llr`` over the next different explanation.
    gap: float
    #: Photos that see it clearly.
    n_views: int
    #: Effective number of photos (Kish).
    kish: float
    #: Spread of their azimuths, degrees.
    arc_deg: float
    #: Edge residual, px.
    rms_px: float
    #: Diameter of the coarse stage, cm.
    polish_cm: float
    #: (V,) probability that each photo sees it.
    seen: np.ndarray = field(repr=False)
    #: Contrast of the silhouette, in units of what chance reaches.
    contrast: float = np.nan
    #: How probable this diameter is among the explanations tried.
    sure: float = np.nan
    #: Diameter of the silhouette alone, cm.
    outline_cm: float = np.nan
    #: Ground on the uphill side of the foot, local m.
    foot_z: float = np.nan
    #: Gain of "another stem touches it" over one stem, log likelihood.
    gain: float = 0.0
    #: Two full stems inside this one: gain and share (:class:`.evidence.double_stem.Twins`).
    twins: float = np.nan
    twins_share: float = np.nan
    #: 90 % interval, cm, where ``se_cm`` is that of several explanations
    #: (:mod:`.evidence.diameter_uncertainty`); NaN elsewhere.
    lo_cm: float = np.nan
    hi_cm: float = np.nan
    #: Measured above breast height (:mod:`.upper_stem`).
    carried: bool = False
    #: Oval of the section, m (:class:`.edge_adjustment.FineFit`).
    oval: tuple[float, float] = (0.0, 0.0)
    #: What the softness of the photos adds to ``se_cm``, cm (:mod:`.images.sharpness`).
    soft_cm: float = 0.0
    #: Names of the V photos looked at.
    photos: tuple[str, ...] = field(default=(), repr=False)

    @property
    def lean_deg(self) -> float:
        """Angle of the axis from the vertical at breast height."""
        return float(np.degrees(np.arctan(np.hypot(*self.axis.s))))

    @property
    def row(self) -> np.ndarray:
        """(10,) for :func:`.images.axis_patches.hide_known`."""
        return np.concatenate([self.axis.row, [self.r0, self.r1]])

    @property
    def measured(self) -> bool:
        """Has a diameter."""
        return self.flag != "reject"

    @property
    def assessment(self) -> Assessment:
        """What is stated of it, for more evidence."""
        return Assessment(self.dbh_cm, self.se_cm, self.lo_cm, self.hi_cm, self.flag, self.reasons)

    def assessed(self, stated: Assessment, **changes: Any) -> PhotoFit:
        """The fit of which that is stated. changes: other fields."""
        return replace(self, **asdict(stated), **changes)


def seen_probability(z: np.ndarray) -> np.ndarray:
    """(V,) posterior that a view sees the stem, from its z-score."""
    odds = SEEN_PRIOR * np.exp(SEEN_MEAN_Z * np.minimum(z, Z_CAP) - 0.5 * SEEN_MEAN_Z**2)
    return np.where(z > -8.9, odds / (1 - SEEN_PRIOR + odds), 0.0)
