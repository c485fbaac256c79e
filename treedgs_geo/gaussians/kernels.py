"""The per-pixel loops: forward and backward compositing, float32, one horizontal strip of the image at a time.

Gaussians come sorted front to back as columns of the projected matrix of ``project.py``. Each is drawn over the row
spans that its ellipse alpha >= alpha_min covers, so the inner loop has no test and vectorises; strips make the work
parallel without shared writes. Compositing is eq:alpha_compositing without early termination: exact, and the backward
pass replays it front to back.
"""

from __future__ import annotations

import math

import numba
import numpy as np

#: Largest alpha of one Gaussian at one pixel; keeps 1 / (1 - alpha) in the backward pass below 100.
ALPHA_MAX = 0.99
#: Planes of the full image: red, green, blue, transmittance, sum of w d, median d, sum of w n (3).
N_PLANES = 9

_F = np.float32
_A0, _A1, _A2, _A3, _A4, _A5 = (_F(math.exp(-0.1875) / math.factorial(k)) for k in range(6))


@numba.njit(inline="always", fastmath=True)
def fast_exp(x):
    """exp(x) for -8 <= x <= 0, relative error below 1e-5: a degree-5 polynomial of x/16, squared four times."""
    t = x * _F(0.0625) + _F(0.1875)
    y = _A0 + t * (_A1 + t * (_A2 + t * (_A3 + t * (_A4 + t * _A5))))
    y = y * y
    y = y * y
    y = y * y
    return y * y


@numba.njit(inline="always", fastmath=True)
def _rows(v, ka, kb, kc, cut, low, high):
    """First and one-past-last row whose centre the ellipse reaches, within low..high."""
    reach = np.sqrt(cut * ka / (ka * kc - kb * kb))
    return max(int(math.ceil(v - reach - _F(0.5))), low), min(int(math.floor(v + reach - _F(0.5))) + 1, high)


@numba.njit(inline="always", fastmath=True)
def _span(u, ka, kb, kc, cut, dy, width):
    """First and one-past-last column inside the ellipse on the row at offset dy."""
    middle = u - kb * dy / ka
    inside = cut * ka - (ka * kc - kb * kb) * dy * dy
    half = np.sqrt(max(inside, _F(0.0))) / ka
    return max(int(math.ceil(middle - half - _F(0.5))), 0), min(int(math.floor(middle + half - _F(0.5))) + 1, width)


def _make_forward(full: bool):
    """The forward kernel, with or without depth and normals (one loop in the source, two machine codes)."""

    @numba.njit(cache=True, nogil=True, fastmath=True)
    def forward(proj, n, y0, y1, image):
        width = image.shape[2]
        top = _F(ALPHA_MAX)
        pairs = 0
        for g in range(n):
            u, v, ka, kb, kc = proj[0, g], proj[1, g], proj[2, g], proj[3, g], proj[4, g]
            o, dist, sx, sy, cut = proj[5, g], proj[6, g], proj[7, g], proj[8, g], proj[13, g]
            nx, ny, nz = proj[9, g], proj[10, g], proj[11, g]
            cr, cg, cb = proj[14, g], proj[15, g], proj[16, g]
            first, last = _rows(v, ka, kb, kc, cut, y0, y1)
            for y in range(first, last):
                dy = _F(y) + _F(0.5) - v
                x0, x1 = _span(u, ka, kb, kc, cut, dy, width)
                if x1 <= x0:
                    continue
                red, green, blue, trans = image[0, y], image[1, y], image[2, y], image[3, y]
                pairs += x1 - x0
                base, slope, quad = _F(-0.5) * kc * dy * dy, -kb * dy, _F(-0.5) * ka
                start, plane = _F(0.5) - u, dist + sy * dy
                if full:
                    depth, median = image[4, y], image[5, y]
                    mx, my, mz = image[6, y], image[7, y], image[8, y]
                for x in range(x0, x1):
                    dx = _F(x) + start
                    alpha = min(o * fast_exp(base + dx * (slope + quad * dx)), top)
                    t = trans[x]
                    w = alpha * t
                    red[x] += w * cr
                    green[x] += w * cg
                    blue[x] += w * cb
                    if full:
                        d = plane + sx * dx
                        depth[x] += w * d
                        median[x] = d if t > _F(0.5) else median[x]
                        mx[x] += w * nx
                        my[x] += w * ny
                        mz[x] += w * nz
                    trans[x] = t - w
        return pairs

    return forward


#: Composite colour and transmittance: ``kernel(proj, n, y0, y1, image)``. image: (>= 4, H, W) float32 planes R, G, B
#: (zero) and T (one) to update. Returns the number of pixel-Gaussian pairs.
forward_colour = _make_forward(False)
#: As ``forward_colour`` with image (N_PLANES, H, W): plane 4 accumulates w d, plane 5 takes d of the last Gaussian met
#: while T > 0.5, planes 6-8 accumulate w n.
forward_full = _make_forward(True)


def _make_backward(full: bool):
    """The backward kernel, with or without depth and normals."""

    @numba.njit(cache=True, nogil=True, fastmath=True)
    def backward(proj, n, y0, y1, given, rest, trans_plane, grad):
        width = given.shape[2]
        top = _F(ALPHA_MAX)
        zero = _F(0.0)
        for g in range(n):
            u, v, ka, kb, kc = proj[0, g], proj[1, g], proj[2, g], proj[3, g], proj[4, g]
            o, dist, sx, sy, cut = proj[5, g], proj[6, g], proj[7, g], proj[8, g], proj[13, g]
            nx, ny, nz = proj[9, g], proj[10, g], proj[11, g]
            cr, cg, cb = proj[14, g], proj[15, g], proj[16, g]
            first, last = _rows(v, ka, kb, kc, cut, y0, y1)
            s_r, s_g, s_b, s_p = zero, zero, zero, zero
            s_x, s_y, s_xx, s_xy, s_yy = zero, zero, zero, zero, zero
            s_d, s_dx, s_dy, s_n0, s_n1, s_n2 = zero, zero, zero, zero, zero, zero
            for y in range(first, last):
                dy = _F(y) + _F(0.5) - v
                x0, x1 = _span(u, ka, kb, kc, cut, dy, width)
                if x1 <= x0:
                    continue
                g_r, g_g, g_b, g_a = given[0, y], given[1, y], given[2, y], given[3, y]
                if full:
                    g_d, g_0, g_1, g_2 = given[4, y], given[5, y], given[6, y], given[7, y]
                trans, left = trans_plane[y], rest[y]
                base, slope, quad = _F(-0.5) * kc * dy * dy, -kb * dy, _F(-0.5) * ka
                start, plane = _F(0.5) - u, dist + sy * dy
                r_r, r_g, r_b, r_p, r_x, r_xx = zero, zero, zero, zero, zero, zero
                r_d, r_dx, r_0, r_1, r_2 = zero, zero, zero, zero, zero
                for x in range(x0, x1):
                    dx = _F(x) + start
                    raw = o * fast_exp(base + dx * (slope + quad * dx))
                    alpha = min(raw, top)
                    t = trans[x]
                    w = alpha * t
                    h = g_a[x] + g_r[x] * cr + g_g[x] * cg + g_b[x] * cb
                    if full:
                        h += g_d[x] * (plane + sx * dx) + g_0[x] * nx + g_1[x] * ny + g_2[x] * nz
                    behind = left[x] - w * h
                    left[x] = behind
                    trans[x] = t - w
                    dp = (t * h - behind / (_F(1.0) - alpha)) * alpha
                    dp = dp if raw < top else zero
                    r_r += w * g_r[x]
                    r_g += w * g_g[x]
                    r_b += w * g_b[x]
                    if full:
                        wd = w * g_d[x]
                        r_0 += w * g_0[x]
                        r_1 += w * g_1[x]
                        r_2 += w * g_2[x]
                        r_d += wd
                        r_dx += wd * dx
                    r_p += dp
                    r_x += dp * dx
                    r_xx += dp * dx * dx
                s_r += r_r
                s_g += r_g
                s_b += r_b
                s_p += r_p
                s_x += r_x
                s_y += r_p * dy
                s_xx += r_xx
                s_xy += r_x * dy
                s_yy += r_p * dy * dy
                if full:
                    s_n0 += r_0
                    s_n1 += r_1
                    s_n2 += r_2
                    s_d += r_d
                    s_dx += r_dx
                    s_dy += r_d * dy
            grad[0, g] += ka * s_x + kb * s_y - sx * s_d
            grad[1, g] += kb * s_x + kc * s_y - sy * s_d
            grad[2, g] -= _F(0.5) * s_xx
            grad[3, g] -= s_xy
            grad[4, g] -= _F(0.5) * s_yy
            grad[5, g] += s_p / o
            if full:
                grad[6, g] += s_d
                grad[7, g] += s_dx
                grad[8, g] += s_dy
                grad[9, g] += s_n0
                grad[10, g] += s_n1
                grad[11, g] += s_n2
            grad[12, g] += s_r
            grad[13, g] += s_g
            grad[14, g] += s_b

    return backward


#: Gradients of a loss on colour and alpha: ``kernel(proj, n, y0, y1, given, rest, trans, grad)``. given: (4, H, W)
#: float32 dL/dR, dL/dG, dL/dB, dL/dA. rest: (H, W) float32, sum of given x rendered on entry (what all Gaussians
#: contribute), used up. trans: (H, W) float32 ones, used up. grad: (15, >= n) float32, accumulated.
backward_colour = _make_backward(False)
#: As ``backward_colour`` with given (8, H, W): dL/d of R, G, B, A, sum w d, sum w n (3). The median depth is a
#: selection; its gradient (to the selected plane only) is left out.
backward_full = _make_backward(True)
