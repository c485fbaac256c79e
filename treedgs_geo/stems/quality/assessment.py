"""What is stated of a stem: diameter, standard error, interval, flag and reasons. Evidence changes them here only."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.intervals import HALF_WIDTH_SE
from .findings import Findings, Flag


@dataclass(frozen=True)
class Assessment:
    """What is stated of one stem; each method returns the same with one more piece of evidence.

    A refused stem keeps the diameter and the error that it was refused with.
    """

    #: Diameter at breast height, cm.
    dbh_cm: float
    #: Its standard error, cm; NaN where the method has none.
    se_cm: float
    #: 90 % interval, cm, where it is not ``dbh_cm`` ± :data:`.HALF_WIDTH_SE` times ``se_cm``; NaN where it is.
    lo_cm: float = np.nan
    hi_cm: float = np.nan
    flag: Flag = "ok"
    #: Keys of :data:`.reasons.REASONS`, in the order in which they were found.
    reasons: tuple[str, ...] = ()

    @classmethod
    def refused(cls, *reasons: str, dbh_cm: float = np.nan) -> Assessment:
        """Of a place that is refused before anything is measured there. dbh_cm: as thick as it was looked for."""
        return cls(dbh_cm, np.nan, flag="reject", reasons=reasons)

    @property
    def measured(self) -> bool:
        """Has a diameter."""
        return self.flag != "reject"

    def adding(self, found: Findings, off_cm: float = 0.0, other_cm: float = np.nan) -> Assessment:
        """With what was found against it: flagged, or refused.

        off_cm: how far that may put the diameter off; the error grows by it, and the interval about the diameter.
        other_cm: another reading of the diameter, which the interval reaches.
        """
        if not found.reasons:
            return self
        reasons = tuple(dict.fromkeys((*self.reasons, *found.reasons)))
        if found.refused or not self.measured:
            return replace(self, flag="reject", reasons=reasons)
        flagged = replace(self, flag="check", reasons=reasons)
        return flagged if off_cm == 0.0 else flagged._reaching(float(np.hypot(self.se_cm, off_cm)), other_cm)

    def widened(self, more_cm: float) -> Assessment:
        """With another error (standard error, cm) on top of its own; its interval grows with it."""
        se_cm = float(np.hypot(self.se_cm, more_cm))
        low_cm, high_cm = (self.dbh_cm + se_cm / self.se_cm * (end - self.dbh_cm) for end in (self.lo_cm, self.hi_cm))
        return replace(self, se_cm=se_cm, lo_cm=low_cm if np.isnan(low_cm) else max(low_cm, 0.0), hi_cm=high_cm)

    def of_tree(self) -> dict[str, Any]:
        """The same as fields of :class:`.tree.Tree`, for its ``finish``."""
        low_cm, high_cm = (None, None) if np.isnan(self.lo_cm) else (self.lo_cm, self.hi_cm)
        return {
            "qc_flag": self.flag,
            "qc_reason": ",".join(self.reasons),
            "dbh_cm": self.dbh_cm,
            "dbh_se_cm": None if np.isnan(self.se_cm) else self.se_cm,
            "dbh_lo_cm": low_cm,
            "dbh_hi_cm": high_cm,
            "ba_m2": None,
        }

    def _reaching(self, se_cm: float, other_cm: float) -> Assessment:
        half = HALF_WIDTH_SE * se_cm
        low = np.nanmin([self.dbh_cm - half, self.lo_cm, other_cm])
        high = np.nanmax([self.dbh_cm + half, self.hi_cm, other_cm])
        return replace(self, se_cm=se_cm, lo_cm=max(float(low), 0.0), hi_cm=float(high))
