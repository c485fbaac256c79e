"""The error of a diameter where it is unsure which explanation of a place is right: a mixture over the explanations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from ....core.intervals import HALF_WIDTH_SE, LEVEL
from ..fit.selection import Choice, Explanation
from ..quality_control import companion_share
from ..tuned import GAIN_MERGED, PAIR_SE_CM, WRONG_SD


@dataclass(frozen=True)
class Mixture:
    """What a stem's diameter may be: (N,) probabilities that sum to 1, diameters and their standard errors, cm."""

    share: np.ndarray
    dbh_cm: np.ndarray
    se_cm: np.ndarray

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

    def mixture(self, dbh_cm: float, se_cm: float, wrong: float, soft_cm: float = 0.0) -> Mixture:
        """Of the stem as it was taken, with ``dbh_cm`` at breast height and ``se_cm`` were it certain, and of what it
        is with the probability ``wrong``: half of that the other explanations, half anything. soft_cm: what of
        ``se_cm`` soft photos make."""
        pair = companion_share(self.gain) if self.touched is not None else 0.0
        listed = [*self.choice.rivals, *([] if self.touched is None else [self.touched])]
        share = np.append((1 - pair) * self.choice.share, pair)[: len(listed)]
        share[-1 if self.touched is not None and self.gain > GAIN_MERGED else 0] = 0.0
        share *= 0.5 * wrong / max(float(share.sum()), 1e-9)
        pair_cm = float(np.hypot(PAIR_SE_CM, soft_cm))
        dbh = [200 * item.fine.r0 for item in listed]
        error = [pair_cm if item is self.touched else se_cm for item in listed]
        return Mixture(
            np.array([1 - wrong, wrong - share.sum(), *share]),
            np.array([dbh_cm, dbh_cm, *dbh]),
            np.array([se_cm, WRONG_SD * dbh_cm, *error]),
        )
