"""The per-point loop of the opacity query: how much opacity lies in front of each point, Gaussian by Gaussian."""

from __future__ import annotations

import numba
import numpy as np

from .kernels import ALPHA_MAX, fast_exp

_F = np.float32
#: Side of the squares that Gaussians are listed by, pixels.
TILE_PX = 8


@numba.njit(cache=True, nogil=True)
def _list_by_tile(proj, n, tiles_x, tiles_y, start, items, fill):
    """Tiles that each Gaussian's ellipse box touches, as compressed rows.

    First call with ``fill`` False counts into ``start[1:]``; after a cumulative sum, a call with ``fill`` True writes
    the Gaussians to ``items`` (``start`` ends one tile ahead and must be a copy).
    """
    for g in range(n):
        ka, kb, kc, cut = proj[2, g], proj[3, g], proj[4, g], proj[13, g]
        det = ka * kc - kb * kb
        reach_u, reach_v = np.sqrt(cut * kc / det), np.sqrt(cut * ka / det)
        x0 = max(int(np.floor((proj[0, g] - reach_u) / TILE_PX)), 0)
        x1 = min(int(np.floor((proj[0, g] + reach_u) / TILE_PX)), tiles_x - 1)
        y0 = max(int(np.floor((proj[1, g] - reach_v) / TILE_PX)), 0)
        y1 = min(int(np.floor((proj[1, g] + reach_v) / TILE_PX)), tiles_y - 1)
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                tile = y * tiles_x + x
                if fill:
                    items[start[tile]] = g
                    start[tile] += 1
                else:
                    start[tile + 1] += 1


def tile_lists(projected: np.ndarray, tiles_x: int, tiles_y: int) -> tuple[np.ndarray, np.ndarray]:
    """Gaussians (columns of the projected matrix) by tile, in their order: start (tiles + 1,) and items, int64."""
    n, start = projected.shape[1], np.zeros(tiles_x * tiles_y + 1, np.int64)
    _list_by_tile(projected, n, tiles_x, tiles_y, start, start, False)
    start = np.cumsum(start)
    items = np.empty(start[-1], np.int64)
    _list_by_tile(projected, n, tiles_x, tiles_y, start.copy(), items, True)
    return start, items


@numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def opacity_before(proj, start, items, point_start, points, opacity, drawn):
    """Cumulative opacity in front of each point (eq:radegs_point_offset ... eq:pointwise_opacity_integral).

    proj: projected Gaussians, any order (the product is order-free); row 13 limits each ellipse. start, items:
    Gaussians by tile. point_start: (tiles + 1,) points by tile. points: (3, M) float32 u, v, distance, sorted by tile.
    opacity: (M,) float32 out. drawn: (M,) int32 out, how many Gaussians the point's ray meets.
    """
    one, zero, half, top = _F(1.0), _F(0.0), _F(0.5), _F(ALPHA_MAX)
    longest = 1
    for tile in range(len(start) - 1):
        longest = max(longest, start[tile + 1] - start[tile])
    local = np.empty((11, longest), np.float32)
    rows = np.array([0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13])
    for tile in range(len(start) - 1):
        p0, p1 = point_start[tile], point_start[tile + 1]
        if p1 <= p0:
            continue
        first, n = start[tile], start[tile + 1] - start[tile]
        for j in range(11):
            for i in range(n):
                local[j, i] = proj[rows[j], items[first + i]]
        # Distances relative to a common one keep float32 exact to micrometres at any flying height.
        base_r = points[2, p0]
        for i in range(n):
            local[6, i] -= base_r
            # Half the squared distance at which alpha falls to the least that is drawn: no exponential to test it.
            local[10, i] = min(half * local[10, i], _F(8.0))
        gu, gv, ka, kb, kc = local[0], local[1], local[2], local[3], local[4]
        go, gr, sx, sy, isr, cut = local[5], local[6], local[7], local[8], local[9], local[10]
        for p in range(p0, p1):
            u, v, r = points[0, p], points[1, p], points[2, p] - base_r
            left = one
            met = 0
            for i in range(n):
                dx, dy = u - gu[i], v - gv[i]
                flat = half * (ka[i] * dx * dx + kc[i] * dy * dy) + kb[i] * dx * dy
                gap = r - (gr[i] + sx[i] * dx + sy[i] * dy)
                seen = flat <= cut[i]
                met += seen
                fall = half * isr[i] * gap * gap
                bent = flat + (fall if gap < zero else zero)
                alpha = min(go[i] * fast_exp(-min(bent, _F(8.0))), top)
                factor = one - alpha if bent <= cut[i] else one
                left *= factor if seen else one
            opacity[p] = one - left
            drawn[p] = met
