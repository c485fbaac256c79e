"""What is stated of a stem, from all that was found out about it (:func:`assess`): diameter, interval, and whether it
is accepted, flagged or refused, held against :mod:`treedgs_geo.stems.quality.limits`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from scipy.special import expit

from ..quality.assessment import Assessment
from ..quality.findings import Flag
from ..quality.limits import INTERCEPT, LIMITS, PREDICTORS, WRONG_CHECK, WRONG_REJECT, judge
from ..quality.mixture import Mixture
from .tuned import (
    BARK,
    COVER_CM,
    ERROR_WEIGHTS,
    NETWORK_OFFSET_CM,
    OPEN_SHARE,
    OUTLINE_OFFSET_CM,
    PARTS,
    THERE_LLR,
    THICKER_SD,
    WRONG_SD,
)


class ErrorParts(NamedTuple):
    """What makes the error of a diameter, given that the right edges were found: each a standard deviation in cm that
    :data:`.tuned.ERROR_WEIGHTS` scales."""

    #: Standard error of the mean of the photos' diameters.
    scatter: float = 0.0
    #: Formal error of the fit, without the oval: edges of one stem err together.
    formal: float = 0.0
    #: What an oval adds that the photos do not show all round.
    oval: float = 0.0
    #: What an oval adds that the photos show.
    seen_oval: float = 0.0
    #: The diameter, for its one section beside the stem's others.
    section: float = 0.0
    #: The diameter times the tangent of the lean.
    lean: float = 0.0
    #: A taper beyond what is usual over a metre.
    taper: float = 0.0
    #: By how much the reading from above moved it.
    above: float = 0.0
    #: Blurred edges.
    soft: float = 0.0

    @property
    def se_cm(self) -> float:
        """Standard error of the diameter."""
        return math.hypot(*(ERROR_WEIGHTS[name] * part for name, part in self._asdict().items()))


class OtherExplanation(NamedTuple):
    """Another explanation of a stem."""

    #: Its probability among all others.
    share: float
    #: By how much it is thicker than the one that was taken, cm.
    off_cm: float
    #: Standard error of its diameter, cm.
    se_cm: float


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What was found out about a stem: numbers, which decide nothing by themselves; NaN where there is nothing to be
    had, as where nothing could be fitted. :data:`.measurement.EVIDENCE` and later steps find them, :func:`assess`
    judges them together."""

    #: Diameter at breast height by the edges, cm, and what makes its error before anything speaks against it.
    dbh_cm: float
    error: ErrorParts | None = None
    #: Diameter of the coarse search, cm.
    polish_cm: float = np.nan
    #: Slope of the radius, m/m.
    r1: float = np.nan
    #: Angle of the axis from the vertical, degrees.
    lean_deg: float = np.nan
    #: Log likelihood ratio of the fit against chance.
    llr: float = 0.0
    #: Photos that see it clearly.
    n_views: int = 0
    #: Effective number of photos (Kish).
    kish: float = 0.0
    #: Directions that these photos look from: 360 less the largest gap between two, degrees.
    arc_deg: float = np.nan
    #: Edge residual, px.
    rms_px: float = np.nan
    #: How probable this diameter is among the explanations tried.
    sure: float = np.nan
    #: Contrast of the silhouette, in units of what chance reaches.
    contrast: float = np.nan
    #: Diameter of the silhouette alone, cm.
    outline_cm: float = np.nan
    #: Photos that show the ground, or another stem, through it (:mod:`.evidence.opacity_test`).
    n_through: int = 0
    #: How alike neighbouring photos are on its bark, and by how much more, at most, than on the plane through its edges
    #: (:mod:`.evidence.surface`).
    on_bark: float = np.nan
    bark_lead: float = np.nan
    #: By how much its section is off a circle, share of the radius.
    oval: float = 0.0
    #: Two full stems inside this one: gain and share (:class:`.evidence.double_stem.Twins`).
    twins: float = np.nan
    twins_share: float = np.nan
    #: By how many standard deviations it is thicker than the stand's stems.
    thicker_sd: float = 0.0
    #: The network was asked.
    network: bool = False
    #: The other explanations.
    others: tuple[OtherExplanation, ...] = ()
    #: Share of ivy in what the network sees of it (:mod:`.evidence.ivy`).
    covered: float = 0.0
    #: Measured so far above breast height, m (:mod:`.upper_stem`).
    carried_m: float = 0.0
    #: Reason for which nothing was measured, empty where something was.
    refused: str = ""
    #: Diameters that are wanted, cm.
    min_dbh_cm: float = 0.0
    max_dbh_cm: float = np.inf

    @property
    def se_cm(self) -> float:
        """Standard error before anything speaks against it, cm; NaN where nothing could be fitted."""
        return np.nan if self.error is None else self.error.se_cm

    @property
    def outline_off_cm(self) -> float:
        """By how much the silhouette is thicker than the edges say, cm."""
        return self.outline_cm + (NETWORK_OFFSET_CM if self.network else OUTLINE_OFFSET_CM) - self.dbh_cm

    @property
    def solid(self) -> bool:
        """More than edges speak for a stem: a silhouette that stands out from what chance reaches, or bark between the
        edges."""
        return self.contrast > 1.0 or (self.on_bark > BARK and self.llr > THERE_LLR)

    @property
    def open_cm(self) -> list[float]:
        """Diameters that it may have besides, cm: of the stem under the ivy, of one of two full stems."""
        bare = [self.dbh_cm - COVER_CM] if judge("photos", {"covered": self.covered}).reasons else []
        twins = judge("photos", self.two_in_one).reasons
        return [*bare, *([PARTS[0] * self.dbh_cm] if twins else [])]

    @property
    def two_in_one(self) -> dict[str, float]:
        """What speaks for two full stems inside it: furrowed bark has edges enough for two narrow stems, so that these
        count alone only in what is too thick for one stem of the stand."""
        share = self.twins_share if self.thicker_sd > THICKER_SD else 0.0
        return {"twins": self.twins, "twins_share": share}

    def quantities(self) -> dict[str, float]:
        """What is judged by limits of its own (:func:`treedgs_geo.stems.quality.limits.judge`): every field that has a
        limit of its name; where there is nothing else, edges have to do alone."""
        through = self.n_through / max(self.n_through + self.n_views, 1)
        found = {name: getattr(self, name) for name in _LIMITED} | self.two_in_one
        found |= {"through": through}
        if math.isnan(self.contrast):  # no silhouettes: level photos
            found |= {"arc_alone": self.arc_deg} | ({} if self.solid else {"llr_alone": self.llr})
        return found

    def predictors(self) -> dict[str, float]:
        """How much speaks against the diameter, by the names of :data:`treedgs_geo.stems.quality.limits.PREDICTORS`: 0
        where nothing does or nothing is known."""
        off, photos = abs(self.outline_off_cm) / max(self.dbh_cm, 1.0), max(self.kish, 0.5)
        found = {
            "photos": -math.log(photos / 12),
            "residual": (self.rms_px - 0.49) / 0.05,
            "outline": np.minimum(off / 0.1, 3.0),
            "section": self.oval / 0.05,
            "explanations": -math.log(max(self.sure, 0.01)),
            "edges": min(-math.log(max(self.llr, 0.1) / (6 * photos)), 4.0),
            "stand": min(self.thicker_sd - 2, 2.7),
        }
        return {name: max(float(np.nan_to_num(amount)), 0.0) for name, amount in found.items()}


#: The error, no field, is judged when all that widens it is known.
_LIMITED = {limit.quantity for limit in LIMITS["photos"]} & {item.name for item in fields(Evidence)}


def quality_control(evidence: Evidence) -> tuple[Flag, tuple[str, ...], float]:
    """Flag, reasons, and the probability that the diameter is not the stem's: limits of what decides by itself, and
    what all predictors together leave open; the reasons are then those that do. What photos show through is no stem
    where these speak against it, too."""
    settings = {"min_dbh_cm": evidence.min_dbh_cm, "max_dbh_cm": evidence.max_dbh_cm}
    found = judge("photos", evidence.quantities(), evidence.dbh_cm, settings)
    odds = {name: PREDICTORS[name].weight * amount for name, amount in evidence.predictors().items()}
    flag, wrong = found.flag("photos"), float(expit(INTERCEPT + sum(odds.values())))
    if wrong < WRONG_CHECK:
        return flag, found.reasons, wrong
    enough = min(1.0, max(odds.values()))
    reasons = dict.fromkeys((*found.reasons, *(PREDICTORS[name].reason for name in odds if odds[name] >= enough)))
    refused = flag == "reject" or wrong > WRONG_REJECT or "see_through" in found.reasons
    return "reject" if refused else "check", tuple(reasons), wrong


def assess(evidence: Evidence) -> Assessment:
    """What is stated of a stem with that evidence."""
    if evidence.refused:
        cover = judge("photos", {"covered": evidence.covered})
        return Assessment.refused(evidence.refused, dbh_cm=evidence.dbh_cm).adding(cover)
    flag, reasons, wrong = quality_control(evidence)
    alone, besides = explanations(evidence, wrong), evidence.open_cm
    all_open = explanations(evidence, wrong, besides) if besides else alone
    # What is open besides has its own reason.
    wide = judge("photos", {"se_cm": alone.se_of_interval_cm}, evidence.dbh_cm)
    return Assessment(evidence.dbh_cm, all_open.se_of_interval_cm, *all_open.interval_cm, flag, reasons).adding(wide)


def explanations(evidence: Evidence, wrong: float, besides: Sequence[float] = ()) -> Mixture:
    """What the diameter may be: as it was taken; ``besides`` (cm), :data:`.tuned.OPEN_SHARE` each; and with the
    probability ``wrong`` half the other explanations, half anything."""
    dbh_cm, se_cm = evidence.dbh_cm, evidence.se_cm
    others = wrong / 2 if evidence.others else 0.0
    left = 1 - OPEN_SHARE * len(besides)
    rows = [
        (left * (1 - wrong), dbh_cm, se_cm),
        (left * (wrong - others), dbh_cm, WRONG_SD * dbh_cm),
        *((left * others * other.share, dbh_cm + other.off_cm, other.se_cm) for other in evidence.others),
        *((OPEN_SHARE, open_cm, se_cm) for open_cm in besides),
    ]
    return Mixture(*np.array(rows).T)
