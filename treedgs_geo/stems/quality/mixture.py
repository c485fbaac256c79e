"""What a diameter may be where several explanations of a stem are open: a mixture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import ndtr

from ...core.intervals import HALF_WIDTH_SE, LEVEL


@dataclass(frozen=True)
class Mixture:
    """(N,) probabilities that sum to 1, diameters and their standard errors, cm; the first is the one that is
    stated."""

    share: np.ndarray
    dbh_cm: np.ndarray
    se_cm: np.ndarray

    @cached_property
    def interval_cm(self) -> tuple[float, float]:
        """The middle :data:`treedgs_geo.core.intervals.LEVEL` of the mixture, cm; the stated diameter lies inside with
        its own standard error on both sides."""
        reach = 6 * float(self.se_cm.max())
        at = np.linspace(float(self.dbh_cm.min()) - reach, float(self.dbh_cm.max()) + reach, 4001)
        below = ndtr((at[:, None] - self.dbh_cm) / self.se_cm) @ self.share
        low, high = np.interp([(1 - LEVEL) / 2, (1 + LEVEL) / 2], below, at)
        stated, own = float(self.dbh_cm[0]), HALF_WIDTH_SE * float(self.se_cm[0])
        return max(min(float(low), stated - own), 0.0), max(float(high), stated + own)

    @property
    def se_of_interval_cm(self) -> float:
        """Standard error of a normal distribution with an interval that wide."""
        low_cm, high_cm = self.interval_cm
        return (high_cm - low_cm) / (2 * HALF_WIDTH_SE)
