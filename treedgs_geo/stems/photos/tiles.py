"""Pieces of ground that are searched at once."""

from __future__ import annotations

import numpy as np

from ...reconstruction.area import Area

#: Widest piece of ground searched at once, metres (bounds memory).
TILE_M = 26.0


def split(area: Area, margin_m: float) -> list[tuple[Area, tuple[float, float, float, float]]]:
    """Pieces small enough to search at once: (area of the piece, its box x0, y0, x1, y1).

    Where circles overlap, a piece that earlier ones cover is left out.
    """
    pieces = []
    for centre, radius in zip(area.centres, area.radii_m, strict=True):
        reach = float(radius) + margin_m
        n = max(int(np.ceil(2 * reach / TILE_M)), 1)
        step = 2 * reach / n
        for i in range(n):
            for j in range(n):
                x0, y0 = centre[0] - reach + j * step, centre[1] - reach + i * step
                box = (x0, y0, x0 + step, y0 + step)
                middle = np.array([x0 + step / 2, y0 + step / 2])
                if n == 1:
                    pieces.append((Area.circle(float(centre[0]), float(centre[1]), float(radius)), box))
                elif np.linalg.norm(middle - centre) < radius + step / np.sqrt(2):
                    pieces.append((Area.circle(float(middle[0]), float(middle[1]), step / np.sqrt(2)), box))
    return pieces if len(area.radii_m) < 2 else _without_covered(pieces, area, margin_m)


def _without_covered(pieces: list, area: Area, margin_m: float, cell_m: float = 0.5) -> list:
    """The pieces in which some of the area's ground has not been in an earlier piece's box."""
    x0, y0, x1, y1 = area.bounds(margin_m)
    shape = int((y1 - y0) / cell_m) + 2, int((x1 - x0) / cell_m) + 2
    wanted = np.zeros(shape, bool)

    def window(low_x: float, low_y: float, high_x: float, high_y: float) -> tuple[slice, slice]:
        # Cells whose centres lie inside.
        rows = np.ceil((np.array([low_y, high_y]) - y0) / cell_m - 0.5).astype(int)
        columns = np.ceil((np.array([low_x, high_x]) - x0) / cell_m - 0.5).astype(int)
        return slice(max(rows[0], 0), max(rows[1], 0)), slice(max(columns[0], 0), max(columns[1], 0))

    for (cx, cy), radius in zip(area.centres, area.radii_m + margin_m, strict=True):
        rows, columns = window(cx - radius, cy - radius, cx + radius, cy + radius)
        part = wanted[rows, columns]
        y = y0 + cell_m * (rows.start + 0.5 + np.arange(part.shape[0]))[:, None]
        x = x0 + cell_m * (columns.start + 0.5 + np.arange(part.shape[1]))[None]
        part |= np.hypot(x - cx, y - cy) <= radius
    kept = []
    for piece in pieces:
        part = wanted[window(*piece[1])]
        if part.any():
            kept.append(piece)
            part[:] = False
    return kept
