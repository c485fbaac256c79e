"""Stems under ivy: the network (:mod:`.stem_net`) looks at each fitted stem in the photos that show it best.

Edges and silhouettes take a column of ivy for a stem that is 10 to 16 cm thicker. Only pieces of the photos about
breast height are looked at, so that this costs seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core.intervals import HALF_WIDTH_SE
from ..trees.limits import judge
from .photo_fit import PhotoFit
from .plumb import PlumbGrid
from .stack import PhotoStack
from .stem_evidence import covered_share
from .stem_net import NetworkMaps, class_odds, network_scores, normalised, plumb_colours, quantised, together, tone_of

#: Photos that are looked at for each stem, and how probable it is that they show it, at least.
MOST_PHOTOS, LEAST_SEEN = 8, 0.5
#: Rows and columns of a piece: breast height -+ 0.6 m and so many pixels that the network needs around it; the smaller
#: one where that is enough (shares of ivy to 0.015 the same on ``plot_a`` and ``plot_h``, half the time).
PIECES, ABOUT_M, AROUND_PX = (128, 192), 0.6, 24
#: Standard error for each unit of ivy's share, cm: leaves stand 3 to 8 cm off the bark on both sides.
COVER_CM = 15.0


@dataclass(frozen=True)
class _Piece:
    """A part of a photo's plumb map about a stem, ``size`` rows and columns; grid as in :class:`.stem_net.OddsMaps`."""

    view: int
    fit: int
    size: int
    top: int
    left: int
    grid: tuple[float, float, float, float]


def without_covered(fits: list[PhotoFit], stack: PhotoStack, plumbs: list[PlumbGrid]) -> list[PhotoFit]:
    """The fits; those that ivy covers at breast height are flagged, with a wider error, or refused (``covered``).

    Refused ones are looked at too: a second measurement would take the ivy for bark as well. fits: of this stack.
    plumbs: one a photo.
    """
    pieces = [piece for k, fit in enumerate(fits) for piece in _pieces(k, fit, stack, plumbs)]
    shown: dict[int, list[tuple[_Piece, np.ndarray]]] = {}
    for view in sorted({piece.view for piece in pieces}):
        colour, good = plumb_colours(stack.arrays, view, plumbs[view])
        tone = tone_of(colour, good)
        for piece in (each for each in pieces if each.view == view):
            part = np.s_[piece.top : piece.top + piece.size, piece.left : piece.left + piece.size]
            scores = network_scores(normalised(colour[part], good[part], tone))
            odds = [quantised(class_odds(scores, *wanted), good[part]) for wanted in (("ivy",), ("stem", "ivy"))]
            shown.setdefault(piece.fit, []).append((piece, np.stack(odds)))
    return [_judged(fit, _share(fit, shown[k], stack)) if k in shown else fit for k, fit in enumerate(fits)]


def _pieces(number: int, fit: PhotoFit, stack: PhotoStack, plumbs: list[PlumbGrid]) -> list[_Piece]:
    """Where the photos that show a stem best show breast height."""
    out = []
    for view in np.argsort(-fit.seen, kind="stable")[:MOST_PHOTOS]:
        if fit.seen[view] < LEAST_SEEN:
            break
        plumb = plumbs[view]
        dx, dy = fit.axis.p - stack.centre[view, :2]
        below = stack.centre[view, 2] - (fit.axis.ground_z + fit.axis.bh_m)
        swing = (np.arctan2(dy, dx) - plumb.azimuth0 + 0.2) % (2 * np.pi) - 0.2
        nadir, slant = np.arctan2(np.hypot(dx, dy), below), np.sqrt(dx * dx + dy * dy + below * below)
        column, row = swing / plumb.step_a, (nadir - plumb.nadir0) / plumb.step_n
        rows, columns = plumb.shape
        if not (0 <= row < rows and 0 <= column < columns):
            continue
        tall = 2 * (ABOUT_M * np.sin(nadir) / (slant * plumb.step_n) + AROUND_PX)
        size = PIECES[0] if tall <= PIECES[0] else PIECES[1]
        top, left = (max(min(int(at) - size // 2, n - size), 0) for at, n in ((row, rows), (column, columns)))
        grid = plumb.azimuth0 + left * plumb.step_a, plumb.step_a, plumb.nadir0 + top * plumb.step_n, plumb.step_n
        out.append(_Piece(int(view), number, size, top, left, grid))
    return out


def _share(fit: PhotoFit, shown: list[tuple[_Piece, np.ndarray]], stack: PhotoStack) -> float:
    grid = np.array([piece.grid for piece, _ in shown])
    centre = stack.centre[[piece.view for piece, _ in shown]]
    ivy, either = (together([odds[k] for _, odds in shown], grid, centre) for k in (0, 1))
    return covered_share(NetworkMaps(either, ivy, either), fit.axis, fit.r0, fit.r1)


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
