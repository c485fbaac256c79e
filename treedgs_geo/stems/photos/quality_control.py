"""Accept a fitted stem, flag it or refuse it: what the photos show, held against
:mod:`treedgs_geo.stems.quality.limits`."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from scipy.special import expit

from ..quality.findings import Flag
from ..quality.limits import INTERCEPT, LIMITS, PREDICTORS, WRONG_CHECK, WRONG_REJECT, judge
from .options import PhotoStemOptions
from .tuned import GAIN_LOW_CONFIDENCE, GAIN_MERGED, NETWORK_OFFSET_CM, OUTLINE_OFFSET_CM


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What was found out about a stem: numbers, which decide nothing by themselves; NaN where there is nothing to be
    had, as where nothing could be fitted. :data:`.measurement.EVIDENCE` finds them, :func:`quality_control` judges them
    together."""

    #: Diameter at breast height by the edges, cm, and its standard error before anything speaks against it.
    dbh_cm: float
    se_cm: float = np.nan
    #: Diameter of the coarse search, cm.
    polish_cm: float = np.nan
    #: Slope of the radius, m/m.
    r1: float = np.nan
    #: Angle of the axis from the vertical, degrees.
    lean_deg: float = np.nan
    #: Log likelihood ratio of the fit against chance.
    llr: float = 0.0
    #: Lead of ``llr`` over the next different explanation.
    gap: float = 0.0
    #: Photos that see it clearly.
    n_views: int = 0
    #: Effective number of photos (Kish); infinite for one of a pair, which hardly any photo shows whole.
    kish: float = 0.0
    #: Directions that these photos look from, from the first to the last, degrees.
    arc_deg: float = np.nan
    #: Edge residual, px.
    rms_px: float = np.nan
    #: How probable this diameter is among the explanations tried.
    sure: float = np.nan
    #: Contrast of the silhouette, in units of what chance reaches.
    contrast: float = np.nan
    #: Diameter of the silhouette alone, cm.
    outline_cm: float = np.nan
    #: Share of the photos that show the ground through it (:mod:`.evidence.opacity_test`).
    through: float = 0.0
    #: How alike neighbouring photos are on its bark, and by how much more, at most, than on the plane through its edges
    #: (:mod:`.evidence.surface`).
    on_bark: float = np.nan
    bark_lead: float = np.nan
    #: By how much its section is off a circle, share of the radius.
    oval: float = 0.0
    #: Gain of "another stem touches it" over one stem, log likelihood.
    gain: float = 0.0
    #: Two full stems inside this one: gain and share (:class:`.evidence.double_stem.Twins`).
    twins: float = np.nan
    twins_share: float = np.nan
    #: The network was asked.
    network: bool = False
    #: How far the edges' own best explanation is away, cm (:class:`.fit.selection.Choice`).
    against_cm: float = 0.0

    @property
    def outline_off_cm(self) -> float:
        """By how much the silhouette is thicker than the edges say, cm."""
        return self.outline_cm + (NETWORK_OFFSET_CM if self.network else OUTLINE_OFFSET_CM) - self.dbh_cm

    @property
    def solid(self) -> bool:
        """The silhouette stands out from what chance reaches."""
        return self.contrast > 1.0

    @property
    def twins_likely(self) -> bool:
        """It may be two full stems."""
        return bool(judge("photos", {"twins": self.twins, "twins_share": self.twins_share}, self.dbh_cm).reasons)

    def quantities(self) -> dict[str, float]:
        """What is judged by limits of its own (:func:`treedgs_geo.stems.quality.limits.judge`): every field that has a
        limit of its name; where no silhouette stands out, edges have to do alone."""
        found = {name: getattr(self, name) for name in _LIMITED}
        return found if self.solid else found | {"llr_alone": self.llr, "gap_alone": self.gap}

    def predictors(self) -> dict[str, float]:
        """How much speaks against the diameter, by the names of :data:`treedgs_geo.stems.quality.limits.PREDICTORS`: 0
        where nothing does or nothing is known."""
        off = abs(self.outline_off_cm) / max(self.dbh_cm, 1.0)
        found = {
            "photos": -math.log(max(self.kish, 0.5) / 12),
            "residual": (self.rms_px - 0.49) / 0.05,
            "outline": np.minimum(off / 0.1, 3.0),
            "section": self.oval / 0.05,
            "explanations": 1 - self.sure,
        }
        return {name: max(float(np.nan_to_num(amount)), 0.0) for name, amount in found.items()}


#: The error is judged when all that widens it is known.
_LIMITED = {limit.quantity for limit in LIMITS["photos"]} & {item.name for item in fields(Evidence)} - {"se_cm"}


def quality_control(quality: Evidence, options: PhotoStemOptions) -> tuple[Flag, tuple[str, ...], float]:
    """Flag, reasons, and the probability that the diameter is not the stem's: limits of what decides by itself, and
    what all predictors together leave open; the reasons are then those that do."""
    settings = {"min_dbh_cm": options.min_dbh_cm, "max_dbh_cm": options.max_dbh_cm}
    found = judge("photos", quality.quantities(), quality.dbh_cm, settings)
    odds = {name: PREDICTORS[name].weight * amount for name, amount in quality.predictors().items()}
    flag, wrong = found.flag("photos"), float(expit(INTERCEPT + sum(odds.values())))
    if wrong < WRONG_CHECK:
        return flag, found.reasons, wrong
    enough = min(1.0, max(odds.values()))
    reasons = dict.fromkeys((*found.reasons, *(PREDICTORS[name].reason for name in odds if odds[name] >= enough)))
    return "reject" if flag == "reject" or wrong > WRONG_REJECT else "check", tuple(reasons), wrong


def companion_share(gain: float) -> float:
    """Probability that another stem touches this one, from the gain of the pair (log likelihood units)."""
    middle, spread = 0.5 * (GAIN_LOW_CONFIDENCE + GAIN_MERGED), (GAIN_MERGED - GAIN_LOW_CONFIDENCE) / (2 * np.log(9))
    return float(1 / (1 + np.exp((middle - gain) / spread)))
