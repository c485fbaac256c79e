"""The per-point loop of the opacity query: how much opacity lies in front of each point, Gaussian by Gaussian."""

from __future__ import annotations

import numba
import numpy as np

from .kernels import ALPHA_MAX, fast_exp

_F = np.float32


@numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def opacity_before(proj, start, items, point_start, points, opacity, drawn):
    """Cumulative opacity in front of each point (eq:radegs_point_offset ... eq:pointwise_opacity_integral).

    proj: projected Gaussians, any order (the product is order-free); row 13 limits each ellipse. start, items:
    Gaussians by tile, as ``on_torch/project.py`` lists them. point_start: (tiles + 1,) points by tile. points: (3, M)
    float32 u, v, distance, sorted by tile. opacity: (M,) float32 out. drawn: (M,) int32 out, how many Gaussians the
    point's ray meets.
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
