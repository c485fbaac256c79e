"""Stems under ivy: the network (:mod:`..network.inference`) looks at each fitted stem in the photos that show it best.

Edges and silhouettes take a column of ivy for a stem that is 10 to 16 cm thicker. Only pieces of the photos about
breast height are looked at, so that this costs seconds.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ....core.intervals import HALF_WIDTH_SE
from ...quality.limits import judge
from ..fit.photo_fit import PhotoFit
from ..images.crops import PhotoStack
from ..images.vertical_rectification import PlumbGrid
from ..network.inference import NetworkMaps
from ..network.pieces import About, Piece, only_pieces, piece_odds, piece_of
from ..network.silhouettes import covered_share

#: Photos that are looked at for each stem, and how probable it is that they show it, at least.
MOST_PHOTOS, LEAST_SEEN = 8, 0.5
#: They are looked at this far up and down from breast height, m.
ABOUT_M = 0.6
#: Standard error for each unit of ivy's share, cm: leaves stand 3 to 8 cm off the bark on both sides.
COVER_CM = 15.0


def without_covered(fits: list[PhotoFit], stack: PhotoStack, plumbs: list[PlumbGrid]) -> list[PhotoFit]:
    """The fits; those that ivy covers at breast height are flagged, with a wider error, or refused (``covered``).

    Refused ones are looked at too: a second measurement would take the ivy for bark as well. fits: of this stack.
    plumbs: one a photo.
    """
    pieces = [piece for k, fit in enumerate(fits) for piece in _pieces(k, fit, stack, plumbs)]
    odds = piece_odds(pieces, stack, plumbs, ("ivy",), ("stem", "ivy"))
    shown: dict[int, list[int]] = {}
    for number, piece in enumerate(pieces):
        shown.setdefault(piece.place, []).append(number)
    out = list(fits)
    for k, numbers in shown.items():
        own = [pieces[n] for n in numbers]
        ivy, either = (only_pieces(own, [odds[n][group] for n in numbers], stack) for group in (0, 1))
        fit = fits[k]
        out[k] = _judged(fit, covered_share(NetworkMaps(either, ivy, either), fit.axis, fit.r0, fit.r1))
    return out


def _pieces(number: int, fit: PhotoFit, stack: PhotoStack, plumbs: list[PlumbGrid]) -> list[Piece]:
    """Where the photos that show a stem best show breast height, by photo."""
    clear = [view for view in np.argsort(-fit.seen, kind="stable")[:MOST_PHOTOS] if fit.seen[view] >= LEAST_SEEN]
    about = About(fit.axis.bh_m - ABOUT_M, fit.axis.bh_m + ABOUT_M)
    found = (piece_of(number, int(view), fit.axis, about, stack, plumbs) for view in clear)
    return sorted((piece for piece in found if piece is not None), key=lambda piece: piece.view)


def _judged(fit: PhotoFit, share: float) -> PhotoFit:
    found = judge("photos", {"covered": share}, fit.dbh_cm)
    if not found.reasons:
        return fit
    reasons = (*fit.reasons, *found.reasons)
    if found.refused or not fit.measured:
        return replace(fit, flag="reject", reasons=reasons)
    se = float(np.hypot(fit.se_cm, COVER_CM * share))
    low, high = fit.dbh_cm - HALF_WIDTH_SE * se, fit.dbh_cm + HALF_WIDTH_SE * se
    if np.isfinite(fit.lo_cm):
        low, high = min(low, fit.lo_cm), max(high, fit.hi_cm)
    return replace(fit, flag="check", reasons=reasons, se_cm=se, lo_cm=max(low, 0.0), hi_cm=high)
