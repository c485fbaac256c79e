"""Pieces of ground that are searched at once."""

from __future__ import annotations

import numpy as np
from shapely import box

from ...reconstruction.area import Area
from .tuned import TILE_M


def split(area: Area, margin_m: float) -> list[tuple[Area, tuple[float, float, float, float]]]:
    """Pieces small enough to search at once: (area of the piece, its box x0, y0, x1, y1).

    Only those with ground of the area that no earlier piece has.
    """
    reaches = area.radii_m + margin_m
    left = area.shape(margin_m)
    pieces = []
    for (cx, cy), reach, radius in zip(area.centres.tolist(), reaches.tolist(), area.radii_m.tolist(), strict=True):
        n = max(int(np.ceil(2 * reach / TILE_M)), 1)
        step = 2 * reach / n
        for row, column in np.ndindex(n, n):
            x0, y0 = cx - reach + column * step, cy - reach + row * step
            part = box(x0, y0, x0 + step, y0 + step)
            # Slivers less than a stem wide are rounding.
            if left.intersection(part).buffer(-0.05).is_empty:
                continue
            left = left.difference(part)
            middle = cx + (column + 0.5 - n / 2) * step, cy + (row + 0.5 - n / 2) * step
            tile = Area.circle(*middle, radius if n == 1 else step / np.sqrt(2))
            pieces.append((tile, (x0, y0, x0 + step, y0 + step)))
    return pieces
