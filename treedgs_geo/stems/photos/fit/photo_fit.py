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
    """A stem as the photos show it, local frame.

    axis: stem axis, ``axis.p`` at breast height. r0, r1: radius at breast height (m) and its slope (m/m).
    dbh_cm, se_cm: diameter and its standard error given that the right edges were found. flag: ok, check or reject;
    reasons: keys of ``trees.reasons.REASONS``. seed_score: of the detection. llr: log likelihood ratio of the fit.
    gap: its lead over the next different explanation. n_views: photos that see it clearly. kish: effective photos.
    arc_deg: spread of their azimuths. rms_px: edge residual. polish_cm: diameter of the coarse stage. seen: (V,)
    probability that each photo sees it. contrast: of the silhouette, in units of what chance reaches. sure: how
    probable this diameter is among the explanations tried. outline_cm: diameter of the silhouette alone.
    foot_z: ground on the uphill side of the foot, local metres. gain: of "another stem touches it" over one stem;
    twins, twins_share: two full stems inside this one (:class:`.evidence.double_stem.Twins`).
    lo_cm, hi_cm: 90 % interval where se_cm is that of a mixture over the explanations
    (:mod:`.evidence.diameter_uncertainty`), NaN elsewhere. carried: measured above breast height
    (:mod:`.upper_stem`). oval: of the section, metres (:class:`.edge_adjustment.FineFit`). soft_cm: what the softness
    of the photos adds to se_cm (:mod:`.images.sharpness`). photos: names of the V photos looked at.
    """

    axis: StemAxis
    r0: float
    r1: float
    dbh_cm: float
    se_cm: float
    flag: Flag
    reasons: tuple[str, ...]
    seed_score: float
    llr: float
    gap: float
    n_views: int
    kish: float
    arc_deg: float
    rms_px: float
    polish_cm: float
    seen: np.ndarray = field(repr=False)
    contrast: float = np.nan
    sure: float = np.nan
    outline_cm: float = np.nan
    foot_z: float = np.nan
    gain: float = 0.0
    twins: float = np.nan
    twins_share: float = np.nan
    lo_cm: float = np.nan
    hi_cm: float = np.nan
    carried: bool = False
    oval: tuple[float, float] = (0.0, 0.0)
    soft_cm: float = 0.0
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
