"""The error of a diameter where it is unsure which explanation of a place is right: a mixture over the explanations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from ....core.intervals import HALF_WIDTH_SE, LEVEL
from ..fit.selection import Choice, Explanation
from ..quality_control import companion_share
from ..tuned import AMBIGUOUS_SE, GAIN_MERGED, PAIR_SE_CM

#: Reasons that say that another explanation may be the right one: the error is then that of all of them.
AMBIGUOUS = frozenset({"ambiguous", "merged"})
#: With few photos another may be right as well, and nothing says so: the error is that of all, each as it is stated.
OPEN = AMBIGUOUS | {"few_views"}


@dataclass(frozen=True)
class Mixture:
    """What a stem's diameter may be: (N,) probabilities that sum to 1, diameters and their standard errors, cm."""

    share: np.ndarray
    dbh_cm: np.ndarray
    se_cm: np.ndarray

    def error_cm(self, dbh_cm: float) -> float:
        """Root mean squared error of ``dbh_cm`` over the explanations."""
        return float(np.sqrt(self.share @ ((self.dbh_cm - dbh_cm) ** 2 + self.se_cm**2)))

    def interval_cm(self, dbh_cm: float) -> tuple[float, float]:
        """The middle :data:`treedgs_geo.core.intervals.LEVEL` of the mixture, cm; ``dbh_cm`` lies inside with its own
        standard error, that of the nearest explanation, on both sides."""
        reach = 6 * float(self.se_cm.max())
        at = np.linspace(float(self.dbh_cm.min()) - reach, float(self.dbh_cm.max()) + reach, 4001)
        below = ndtr((at[:, None] - self.dbh_cm) / self.se_cm) @ self.share
        low, high = np.interp([(1 - LEVEL) / 2, (1 + LEVEL) / 2], below, at)
        own = HALF_WIDTH_SE * float(self.se_cm[np.argmin(np.abs(self.dbh_cm - dbh_cm))])
        return max(min(float(low), dbh_cm - own), 0.0), max(float(high), dbh_cm + own)


@dataclass(frozen=True)
class Others:
    """The other explanations of a fitted stem. choice: among single discs; touched: the place as a stem that another
    one touches, if that was tried; gain: of such a pair over the best single disc."""

    choice: Choice
    touched: Explanation | None
    gain: float

    def mixture(self, dbh_cm: float, se_cm: float, times: float = AMBIGUOUS_SE, soft_cm: float = 0.0) -> Mixture:
        """Over all explanations; the one that was taken has ``dbh_cm`` at breast height along the stem, ``se_cm`` were
        it certain. times: standard errors are larger by this. soft_cm: what of ``se_cm`` soft photos make."""
        pair = companion_share(self.gain) if self.touched is not None else 0.0
        listed = [*self.choice.rivals, *([] if self.touched is None else [self.touched])]
        share = np.append((1 - pair) * self.choice.share, pair)[: len(listed)]
        taken = listed[-1] if self.touched is not None and self.gain > GAIN_MERGED else listed[0]
        dbh = np.array([dbh_cm if item is taken else 200 * item.fine.r0 for item in listed])
        pair_cm = float(np.hypot(PAIR_SE_CM, soft_cm))
        error = np.array([pair_cm if item is self.touched else times * se_cm for item in listed])
        return Mixture(share, dbh, error)
