"""What a stem may be instead of what it was taken for, and how probable each of that is."""

from __future__ import annotations

from ..fit.selection import Selected
from ..quality_control import OtherExplanation


def other_explanations(choice: Selected, dbh_cm: float, se_cm: float) -> tuple[OtherExplanation, ...]:
    """Of a stem with ``dbh_cm`` and its standard error; none, where nothing else was tried. choice: of the place."""
    share = choice.share[1:] / max(float(choice.share[1:].sum()), 1e-9)
    rest = zip(share, choice.rivals[1:], strict=True)
    return tuple(OtherExplanation(float(p), 200 * item.fine.r0 - dbh_cm, se_cm) for p, item in rest)
