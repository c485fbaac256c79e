"""Stems under ivy: the network (:mod:`.network.inference`) looks at each fitted stem in the photos that show it best.

Edges and silhouettes take a column of ivy for a stem that is 10 to 16 cm thicker. Only pieces of the photos about
breast height are looked at, so that this costs seconds.
"""

from __future__ import annotations

import numpy as np

from ..fit.photo_fit import PhotoFit
from ..images.crops import PhotoStack
from ..images.vertical_rectification import PlumbGrid
from ..network.pieces import About, Piece, only_pieces, piece_odds, piece_of
from ..network.silhouettes import covered_share
from ..tuned import ABOUT_M, SEES


def without_covered(fits: list[PhotoFit], stack: PhotoStack, plumbs: list[PlumbGrid]) -> list[PhotoFit]:
    """The fits; those that ivy covers at breast height are flagged, with a wider error, or refused (``covered``).

    Refused ones are looked at too: the network would take the ivy for bark as well. fits: of this stack.
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
        out[k] = fit.knowing(covered=covered_share(ivy, either, fit.axis, fit.r0, fit.r1))
    return out


def _pieces(number: int, fit: PhotoFit, stack: PhotoStack, plumbs: list[PlumbGrid]) -> list[Piece]:
    """Where the photos that show a stem best show breast height, by photo."""
    clear = [view for view in np.argsort(-fit.seen, kind="stable")[:8] if fit.seen[view] >= SEES]
    about = About(fit.axis.bh_m - ABOUT_M, fit.axis.bh_m + ABOUT_M)
    found = (piece_of(number, int(view), fit.axis, about, stack, plumbs) for view in clear)
    return sorted((piece for piece in found if piece is not None), key=lambda piece: piece.view)
