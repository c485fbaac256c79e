"""Accept a fitted stem, flag it or refuse it: what the photos show, held against
:mod:`treedgs_geo.stems.quality.limits`."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from ..quality.findings import Findings, Flag
from ..quality.limits import LIMITS, bound_of, judge
from ..quality.priors import START_TAPER
from .options import PhotoStemOptions
from .tuned import (
    CHANCE_LLR,
    DISAGREE_SHARE,
    GAIN_LOW_CONFIDENCE,
    GAIN_MERGED,
    GAP_LLR,
    NETWORK_OFFSET_CM,
    OUTLINE_OFFSET_CM,
    RAGGED_LLR,
)

#: Edge score below which the network has to see the stem clearly.
WEAK_LLR = bound_of("photos", "llr", "check")


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
    def outvoted(self) -> bool:
        """The network's silhouettes chose an explanation that the edges clearly do not."""
        return self.network and not self.pair and self.gap < -GAP_LLR

    @property
    def outline_off_cm(self) -> float:
        """By how much the silhouette is thicker than the edges say, cm."""
        return self.outline_cm + (NETWORK_OFFSET_CM if self.network else OUTLINE_OFFSET_CM) - self.dbh_cm

    @property
    def solid(self) -> bool:
        """The silhouette stands out from what chance reaches."""
        return self.contrast > 1.0

    @property
    def pair(self) -> bool:
        """Taken for one of two stems that touch."""
        return self.gain > GAIN_MERGED

    @property
    def twins_likely(self) -> bool:
        """It may be two full stems."""
        return bool(judge("photos", {"twins": self.twins, "twins_share": self.twins_share}, self.dbh_cm).reasons)

    def quantities(self) -> dict[str, float]:
        """The quantities that apply, for :func:`treedgs_geo.stems.quality.limits.judge`: every field that has a limit
        of its name, those of :data:`SOMETIMES` where the other evidence calls for them, and what is made of several."""
        found = {name: getattr(self, name) for name in _LIMITED - SOMETIMES}
        found |= {"taper_off": abs(self.r1 - START_TAPER), "slope": self.r1}
        found |= {"pair_se_cm" if self.pair else "se_cm": self.se_cm}
        if self.outvoted:
            found |= {"against_cm": self.against_cm}
        if self.network and self.llr < RAGGED_LLR:
            found |= {"rms_network_px": self.rms_px}
            found |= {"weak_contrast": self.contrast} if self.llr < WEAK_LLR else {}
        # With a silhouette, that is the second witness; without one, the coarse stage has to do.
        if self.solid:
            found |= {"llr": self.llr, "outline_off_cm": abs(self.outline_off_cm)}
        else:
            found |= {"llr_alone": self.llr, "coarse_off_cm": abs(self.dbh_cm - self.polish_cm)}
            found |= {"contrast": self.contrast}
            found |= {"rms_px": self.rms_px} if self.llr < RAGGED_LLR else {}
            found |= {"rms_weak_px": self.rms_px} if self.llr < CHANCE_LLR else {}
        return found | ({"sure": self.sure} if np.isfinite(self.sure) else {"gap": self.gap})


#: Fields that are not always judged under their own name.
SOMETIMES = frozenset({"llr", "contrast", "rms_px", "sure", "gap", "against_cm", "se_cm"})
_LIMITED = frozenset(limit.quantity for limit in LIMITS["photos"]) & {item.name for item in fields(Evidence)}


def quality_control(quality: Evidence, options: PhotoStemOptions) -> tuple[Flag, tuple[str, ...]]:
    """Flag and reasons. Wrong explanations show in a low likelihood, close rivals, ragged edges and a silhouette of
    another width."""
    settings = {"min_dbh_cm": options.min_dbh_cm, "max_dbh_cm": options.max_dbh_cm}
    found = judge("photos", quality.quantities(), quality.dbh_cm, settings)
    count = _independent(found, bool(np.isfinite(quality.sure)))
    # A stem that the network sees is not refused for two of them.
    return found.flag("photos", count - (quality.network and quality.solid)), found.reasons


def widened_cm(se_cm: float, quality: Evidence, reasons: tuple[str, ...]) -> float:
    """Standard error of the diameter (cm) with what the reasons for a check say it may be off besides: a share
    (``DISAGREE_SHARE``) of what silhouette and edges differ by, of what the section is off a circle, and of what
    the edges' own best explanation is away. Never smaller than ``se_cm``."""
    parts = [se_cm]
    if quality.network and "disagree" in reasons and np.isfinite(quality.outline_off_cm):
        parts.append(DISAGREE_SHARE * quality.outline_off_cm)
    if "not_round" in reasons:
        # No stem's section is that oval: something beside it is taken for a part of it.
        parts.append(DISAGREE_SHARE * quality.oval * quality.dbh_cm)
    if quality.outvoted:
        parts.append(DISAGREE_SHARE * quality.against_cm)
    return math.hypot(*parts)


def _independent(found: Findings, weighed: bool) -> int:
    """How many reasons flag the tree by themselves. weighed: its explanations were weighed against each other.

    A possible companion counts only where the diameter is unsure as well; and where explanations were weighed, a low
    edge score and a silhouette somewhat off are in that balance already.
    """
    flagged = set(found.flagged)
    count = len(flagged) - ("merged" in flagged and not {"ambiguous", "disagree"} & flagged)
    if weighed:
        few = bool({"n_views", "kish"} & found.quantities)
        count -= ("few_views" in flagged and not few) + ("disagree" in flagged and "merged" not in flagged)
    return count


def companion_share(gain: float) -> float:
    """Probability that another stem touches this one, from the gain of the pair (log likelihood units)."""
    middle, spread = 0.5 * (GAIN_LOW_CONFIDENCE + GAIN_MERGED), (GAIN_MERGED - GAIN_LOW_CONFIDENCE) / (2 * np.log(9))
    return float(1 / (1 + np.exp((middle - gain) / spread)))
