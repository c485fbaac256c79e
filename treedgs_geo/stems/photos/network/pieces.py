"""What the network (:mod:`.inference`) sees about single places: pieces of the photos' plumb maps instead of whole
ones, so that a few stems cost seconds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..images.axis_patches import StemAxis
from ..images.crops import PhotoStack
from ..images.vertical_rectification import PlumbGrid
from .inference import (
    MULTIPLE,
    OUTSIDE,
    OddsMaps,
    class_odds,
    network_scores,
    normalised,
    plumb_colours,
    quantised,
    together,
    tone_of,
)

#: Rows and columns of a piece are a multiple of this, so that the network meets few sizes.
SIZE_STEP = 4 * MULTIPLE
#: So many pixels around what is asked for are what it needs to judge it (shares of ivy to 0.015 the same as with larger
#: pieces on ``plot_a`` and ``plot_h``).
AROUND_PX = 24


class About(NamedTuple):
    """What a piece has to show of a stem: heights above the ground from ``low_m`` to ``high_m``, and ``aside_m`` on
    both sides of its axis."""

    low_m: float
    high_m: float
    aside_m: float = 0.0


@dataclass(frozen=True)
class Piece:
    """A part of a photo's plumb map about place number ``place``, ``size`` rows and columns; grid as in
    :class:`.inference.OddsMaps`."""

    view: int
    place: int
    size: int
    top: int
    left: int
    grid: tuple[float, float, float, float]


def piece_of(
    place: int, view: int, axis: StemAxis, about: About, stack: PhotoStack, plumbs: list[PlumbGrid]
) -> Piece | None:
    """The piece of a photo that shows ``about`` of an axis; ``None`` where the photo does not show its middle."""
    plumb = plumbs[view]
    x, y, z = axis.at(np.array([0.5 * (about.low_m + about.high_m)]))[0]
    dx, dy, below = x - stack.centre[view, 0], y - stack.centre[view, 1], stack.centre[view, 2] - z
    swing = (np.arctan2(dy, dx) - plumb.azimuth0 + 0.2) % (2 * np.pi) - 0.2
    flat = np.hypot(dx, dy)
    nadir, slant = np.arctan2(flat, below), np.hypot(flat, below)
    column, row = swing / plumb.step_a, (nadir - plumb.nadir0) / plumb.step_n
    rows, columns = plumb.shape
    if not (0 <= row < rows and 0 <= column < columns):
        return None
    half_m = 0.5 * (about.high_m - about.low_m)
    tall = 2 * (half_m * np.sin(nadir) / (slant * plumb.step_n) + AROUND_PX)
    wide = 2 * ((about.aside_m + half_m * np.hypot(*axis.s)) / (max(flat, 1.0) * plumb.step_a) + AROUND_PX)
    size = max(int(np.ceil(max(tall, wide) / SIZE_STEP)) * SIZE_STEP, 2 * SIZE_STEP)
    top, left = (max(min(int(at) - size // 2, n - size), 0) for at, n in ((row, rows), (column, columns)))
    grid = plumb.azimuth0 + left * plumb.step_a, plumb.step_a, plumb.nadir0 + top * plumb.step_n, plumb.step_n
    return Piece(view, place, size, top, left, grid)


def piece_odds(
    pieces: Sequence[Piece], stack: PhotoStack, plumbs: list[PlumbGrid], *wanted: tuple[str, ...]
) -> list[list[np.ndarray]]:
    """Of each piece, for each of the ``wanted`` groups of classes: (rows, columns) int8 log odds as
    :class:`.inference.OddsMaps` keeps them. Tones are those of the whole photo."""
    out: list[list[np.ndarray]] = [[] for _ in pieces]
    for view in sorted({piece.view for piece in pieces}):
        colour, good = plumb_colours(stack.arrays, view, plumbs[view])
        tone = tone_of(colour, good)
        for number, piece in enumerate(pieces):
            if piece.view != view:
                continue
            part = np.s_[piece.top : piece.top + piece.size, piece.left : piece.left + piece.size]
            scores = network_scores(normalised(colour[part], good[part], tone))
            out[number] = [quantised(class_odds(scores, *classes), good[part]) for classes in wanted]
    return out


def only_pieces(pieces: Sequence[Piece], odds: Sequence[np.ndarray], stack: PhotoStack) -> OddsMaps:
    """The maps of pieces, one a piece, and of no other photo."""
    return together(list(odds), np.array([piece.grid for piece in pieces]), stack.centre[[p.view for p in pieces]])


def of_all_photos(pieces: Sequence[Piece], odds: Sequence[np.ndarray], stack: PhotoStack) -> OddsMaps:
    """The maps of pieces of one place as those of all photos of a stack; a photo without one shows nothing."""
    maps = [np.full((1, 1), OUTSIDE, np.int8)] * len(stack)
    grid = np.tile([0.0, 1.0, 0.0, 1.0], (len(stack), 1))
    for piece, each in zip(pieces, odds, strict=True):
        maps[piece.view], grid[piece.view] = each, piece.grid
    return together(maps, grid, stack.centre)
