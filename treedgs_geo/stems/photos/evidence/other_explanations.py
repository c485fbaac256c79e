"""What a stem may be instead of what it was taken for, and how probable each of that is."""

from __future__ import annotations

import numpy as np

from ..fit.selection import Explanation, Selected
from ..quality_control import ErrorParts, OtherExplanation
from ..tuned import GAIN_LOW_CONFIDENCE, GAIN_MERGED


def companion_share(gain: float) -> float:
    """Probability that another stem touches this one, from the gain of the pair (log likelihood units)."""
    middle, spread = 0.5 * (GAIN_LOW_CONFIDENCE + GAIN_MERGED), (GAIN_MERGED - GAIN_LOW_CONFIDENCE) / (2 * np.log(9))
    return float(1 / (1 + np.exp((middle - gain) / spread)))


def other_explanations(
    choice: Selected, touched: Explanation | None, gain: float, dbh_cm: float, error: ErrorParts
) -> tuple[OtherExplanation, ...]:
    """Of a stem with ``dbh_cm`` and ``error``; none, where nothing else was tried.

    choice: among single discs. touched: the place as a stem that another one touches, if that was tried; gain: of such
    a pair over the best single disc.
    """
    listed, share, se_cm = [*choice.rivals], choice.share, [error.se_cm] * len(choice.rivals)
    if touched is not None:
        pair = companion_share(gain)
        listed, share = [*listed, touched], np.append((1 - pair) * share, pair)
        se_cm.append(ErrorParts(touched=1.0, soft=error.soft).se_cm)
    taken = len(listed) - 1 if touched is not None and gain > GAIN_MERGED else 0
    share = np.delete(share, taken)
    share = share / max(float(share.sum()), 1e-9)
    rest = [pair for k, pair in enumerate(zip(listed, se_cm, strict=True)) if k != taken]
    return tuple(
        OtherExplanation(float(p), 200 * item.fine.r0 - dbh_cm, se) for p, (item, se) in zip(share, rest, strict=True)
    )
