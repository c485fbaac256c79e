"""Stems under ivy, by what the network (:mod:`.network.inference`) sees of each in the photos that show it best: edges
and silhouettes take a column of ivy for a stem that is 10 to 16 cm thicker."""

from __future__ import annotations

import numpy as np

from ..fit.photo_fit import PhotoFit
from ..network.inference import OddsMaps
from ..network.silhouettes import covered_share
from ..tuned import SEES

#: Photos of a stem that are looked at, the clearest.
_PHOTOS = 8


def without_covered(fits: list[PhotoFit], bark: OddsMaps, either: OddsMaps) -> list[PhotoFit]:
    """The fits; those that ivy covers at breast height are flagged, with a wider error, or refused (``covered``).

    Refused ones are looked at too: the network would take the ivy for bark as well. bark, either: the network's maps,
    of bark, and of bark or ivy.
    """
    return [fit.knowing(covered=_covered(fit, bark, either)) for fit in fits]


def _covered(fit: PhotoFit, bark: OddsMaps, either: OddsMaps) -> float:
    clear = [view for view in np.argsort(-fit.seen, kind="stable")[:_PHOTOS] if fit.seen[view] >= SEES]
    return covered_share(bark, either, sorted(clear), fit.axis, fit.r0, fit.r1)
