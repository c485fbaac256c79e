"""The per-pixel loops: forward and backward compositing, float32.

Gaussians come sorted front to back as columns of the rows of ``on_torch/project.py``. Each is drawn over the row
spans that its ellipse alpha >= alpha_min covers. Compositing is eq:alpha_compositing without early termination: exact,
and the backward pass replays it front to back.

Pictures lie in memory as cells: ``LANES`` neighbouring pixels of a row, all their planes side by side. One cell is one
contiguous piece of memory, so the compiler needs no check for overlapping arrays and turns the loop over its pixels
into a few wide instructions, although an ellipse is seldom wider than ten pixels. (Two things would undo that: an index
that may be negative, and a division that may raise.)
"""

from __future__ import annotations

import math

import numba
import numpy as np

#: Pixels of one cell.
LANES = 8

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


def to_cells(planes: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(C, H, W) float32 planes into cells (H, ceil(W / LANES), C, LANES), zero beyond the right edge; flat."""
    count, height, width = planes.shape
    whole = width // LANES
    cells[:, whole:] = 0
    moved = planes.transpose(1, 0, 2)
    cells[:, :whole] = moved[:, :, : whole * LANES].reshape(height, count, whole, LANES).transpose(0, 2, 1, 3)
    if width > whole * LANES:
        cells[:, whole, :, : width - whole * LANES] = moved[:, :, whole * LANES :]
    return cells.reshape(-1)


def from_cells(cells: np.ndarray, count: int, height: int, width: int) -> np.ndarray:
    """Flat cells -> (C, H, W) float32 planes."""
    planes = cells.reshape(height, -1, count, LANES).transpose(2, 0, 1, 3).reshape(count, height, -1)
    return np.ascontiguousarray(planes[:, :, :width])


@numba.njit(inline="always", fastmath=True, error_model="numpy")
def _rows(v, ka, det, cut, height):
    """First and one-past-last row whose centre the ellipse reaches."""
    reach = np.sqrt(cut * ka / det)
    return max(int(math.ceil(v - reach - _F(0.5))), 0), min(int(math.floor(v + reach - _F(0.5))) + 1, height)


@numba.njit(inline="always", fastmath=True)
def _span(middle, square, width):
    """First and one-past-last column whose centre lies within the root of ``square`` of ``middle``."""
    half = np.sqrt(max(square, _F(0.0)))
    return max(int(math.ceil(middle - half - _F(0.5))), 0), min(int(math.floor(middle + half - _F(0.5))) + 1, width)


def _make_forward(full: bool):
    """The forward kernel, with or without depth and normals (one loop in the source, two machine codes)."""
    count = N_PLANES if full else 4
    size = count * LANES

    @numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
    def forward(proj, n, height, width, image):
        top, zero = _F(ALPHA_MAX), _F(0.0)
        across = (width + LANES - 1) // LANES
        for g in range(n):
            u, v, ka, kb, kc = proj[0, g], proj[1, g], proj[2, g], proj[3, g], proj[4, g]
            o, dist, sx, sy, cut = proj[5, g], proj[6, g], proj[7, g], proj[8, g], proj[13, g]
            nx, ny, nz = proj[9, g], proj[10, g], proj[11, g]
            cr, cg, cb = proj[14, g], proj[15, g], proj[16, g]
            det = ka * kc - kb * kb
            first, last = _rows(v, ka, det, cut, height)
            inverse = _F(1.0) / ka
            skew, square, bend, quad = kb * inverse, cut * inverse, det * inverse * inverse, _F(-0.5) * ka
            for y in range(first, last):
                dy = _F(y) + _F(0.5) - v
                x0, x1 = _span(u - skew * dy, square - bend * dy * dy, width)
                if x1 <= x0:
                    continue
                base, slope, plane = _F(-0.5) * kc * dy * dy, -kb * dy, dist + sy * dy
                for block in range(x0 // LANES, (x1 - 1) // LANES + 1):
                    at = (y * across + block) * size
                    cell = image[at : at + size]
                    low, high = x0 - block * LANES, x1 - block * LANES
                    start = _F(block * LANES) + _F(0.5) - u
                    for k in range(LANES):
                        dx = _F(k) + start
                        alpha = min(o * fast_exp(base + dx * (slope + quad * dx)), top)
                        inside = (k >= low) & (k < high)
                        alpha = alpha if inside else zero
                        t = cell[3 * LANES + k]
                        w = alpha * t
                        cell[k] += w * cr
                        cell[LANES + k] += w * cg
                        cell[2 * LANES + k] += w * cb
                        cell[3 * LANES + k] = t - w
                        if full:
                            d = plane + sx * dx
                            cell[4 * LANES + k] += w * d
                            take = inside & (t > _F(0.5))
                            cell[5 * LANES + k] = d if take else cell[5 * LANES + k]
                            cell[6 * LANES + k] += w * nx
                            cell[7 * LANES + k] += w * ny
                            cell[8 * LANES + k] += w * nz

    return forward


#: Composite colour and transmittance: ``kernel(proj, n, height, width, image)``. image: cells of R, G, B (zero) and
#: T (one), updated.
forward_colour = _make_forward(False)
#: As ``forward_colour`` with the cells of N_PLANES planes: plane 4 accumulates w d, plane 5 takes d of the last
#: Gaussian met while T > 0.5, planes 6-8 accumulate w n.
forward_full = _make_forward(True)


def _make_backward(full: bool):
    """The backward kernel, with or without depth and normals."""
    given = 9 if full else 4
    size = (given + 2) * LANES

    @numba.njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
    def backward(proj, n, height, width, state, grad):
        top, zero, one, half = _F(ALPHA_MAX), _F(0.0), _F(1.0), _F(0.5)
        across = (width + LANES - 1) // LANES
        for g in range(n):
            u, v, ka, kb, kc = proj[0, g], proj[1, g], proj[2, g], proj[3, g], proj[4, g]
            o, dist, sx, sy, cut = proj[5, g], proj[6, g], proj[7, g], proj[8, g], proj[13, g]
            nx, ny, nz = proj[9, g], proj[10, g], proj[11, g]
            cr, cg, cb = proj[14, g], proj[15, g], proj[16, g]
            det = ka * kc - kb * kb
            first, last = _rows(v, ka, det, cut, height)
            inverse = one / ka
            skew, square, bend, quad = kb * inverse, cut * inverse, det * inverse * inverse, _F(-0.5) * ka
            s_r, s_g, s_b, s_p = zero, zero, zero, zero
            s_x, s_y, s_xx, s_xy, s_yy = zero, zero, zero, zero, zero
            s_d, s_dx, s_dy, s_n0, s_n1, s_n2 = zero, zero, zero, zero, zero, zero
            for y in range(first, last):
                dy = _F(y) + _F(0.5) - v
                x0, x1 = _span(u - skew * dy, square - bend * dy * dy, width)
                if x1 <= x0:
                    continue
                base, slope, plane = _F(-0.5) * kc * dy * dy, -kb * dy, dist + sy * dy
                r_r, r_g, r_b, r_p, r_x, r_xx = zero, zero, zero, zero, zero, zero
                r_d, r_dx, r_0, r_1, r_2 = zero, zero, zero, zero, zero
                for block in range(x0 // LANES, (x1 - 1) // LANES + 1):
                    at = (y * across + block) * size
                    cell = state[at : at + size]
                    low, high = x0 - block * LANES, x1 - block * LANES
                    start = _F(block * LANES) + _F(0.5) - u
                    for k in range(LANES):
                        dx = _F(k) + start
                        raw = o * fast_exp(base + dx * (slope + quad * dx))
                        alpha = min(raw, top)
                        inside = (k >= low) & (k < high)
                        alpha = alpha if inside else zero
                        t = cell[k]
                        w = alpha * t
                        g_r, g_g, g_b = cell[2 * LANES + k], cell[3 * LANES + k], cell[4 * LANES + k]
                        h = cell[5 * LANES + k] + g_r * cr + g_g * cg + g_b * cb
                        if full:
                            h += cell[6 * LANES + k] * (plane + sx * dx) + cell[7 * LANES + k] * nx
                            h += cell[8 * LANES + k] * ny + cell[9 * LANES + k] * nz
                        behind = cell[LANES + k] - w * h
                        cell[LANES + k] = behind
                        cell[k] = t - w
                        dp = (t * h - behind / (one - alpha)) * alpha
                        dp = dp if raw < top else zero
                        r_r += w * g_r
                        r_g += w * g_g
                        r_b += w * g_b
                        if full:
                            # The median depth is this Gaussian's where the light falls to a half in it.
                            median = inside & (t > half) & (t - w <= half)
                            wd = w * cell[6 * LANES + k] + (cell[10 * LANES + k] if median else zero)
                            r_0 += w * cell[7 * LANES + k]
                            r_1 += w * cell[8 * LANES + k]
                            r_2 += w * cell[9 * LANES + k]
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


#: Gradients of a loss on colour and alpha: ``kernel(proj, n, height, width, state, grad)``. state: cells of six planes,
#: used up: T (one on entry), the sum of given x rendered (what all Gaussians contribute), then the given dL/dR, dL/dG,
#: dL/dB, dL/dA. grad: (15, >= n) float32, accumulated.
backward_colour = _make_backward(False)
#: As ``backward_colour`` with five more given planes: dL/d of sum w d, of sum w n (3) and of the median depth. Which
#: Gaussian the median selects has no gradient, its distance plane has.
backward_full = _make_backward(True)
