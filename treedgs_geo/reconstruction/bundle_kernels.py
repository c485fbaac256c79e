"""Compiled parts of the bundle adjustment: residuals with their derivatives, and the points eliminated.

All sums go over observations in a fixed order within one photo or one point, so that results do not depend on the
number of threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from ..core.machine import EXACT

#: Numbers of a photo: rotation vector (3), centre (3) and readout travel (3), metres.
N_POSE = 9
#: Columns of the shared parameters before the flights' own: log of the focal length, log of fy / fx, principal point,
#: Brown's k1, k2, p1, p2, k3 and the readout time in seconds.
LOG_F, LOG_ASPECT, CX, CY, K1, K2, P1, P2, K3, READOUT, FIRST_FLIGHT = range(11)

#: Numbers of a photo before its travel, which comes last.
STILL = 6


class Model(NamedTuple):
    """The unknowns as arrays: see :class:`.bundle.State`; velocity (N, 3) m/s."""

    shared: np.ndarray
    drift: np.ndarray
    rotations: np.ndarray
    centres: np.ndarray
    travel: np.ndarray
    points: np.ndarray
    velocity: np.ndarray


class Seen(NamedTuple):
    """M observations: photo, point, (M, 2) pixels, share of the readout (row / height - 0.5). flight: (N,)."""

    photo: np.ndarray
    point: np.ndarray
    pixels: np.ndarray
    share: np.ndarray
    flight: np.ndarray


class Rows(NamedTuple):
    """Rows of each photo or point: ``order[starts[k] : starts[k + 1]]``."""

    starts: np.ndarray
    order: np.ndarray


@njit(parallel=True, **EXACT)
def linearise(model, seen, residual, by_pose, by_shared, by_point):
    """Residuals and derivatives of all observations, into the arrays of a :class:`.bundle.Linear`."""
    shared, drift, rotations, centres, travel, points, velocity = model
    image, point, pixels, share, flight = seen
    fx0 = np.exp(shared[LOG_F])
    aspect = np.exp(shared[LOG_ASPECT])
    k1, k2, k3, p1, p2 = shared[K1], shared[K2], shared[K3], shared[P1], shared[P2]
    for m in prange(len(image)):
        i, p, s = image[m], point[m], share[m]
        r = rotations[i]
        fx = fx0 * np.exp(drift[flight[i]])
        fy = fx * aspect
        d0 = points[p, 0] - centres[i, 0] - s * (travel[i, 0] + shared[READOUT] * velocity[i, 0])
        d1 = points[p, 1] - centres[i, 1] - s * (travel[i, 1] + shared[READOUT] * velocity[i, 1])
        d2 = points[p, 2] - centres[i, 2] - s * (travel[i, 2] + shared[READOUT] * velocity[i, 2])
        a = r[0, 0] * d0 + r[0, 1] * d1 + r[0, 2] * d2
        b = r[1, 0] * d0 + r[1, 1] * d1 + r[1, 2] * d2
        c = r[2, 0] * d0 + r[2, 1] * d1 + r[2, 2] * d2
        by_pose[m] = 0.0
        by_shared[m] = 0.0
        by_point[m] = 0.0
        if c < 0.1:
            residual[m, 0] = np.nan
            residual[m, 1] = np.nan
            continue
        x, y = a / c, b / c
        xx, yy, xy = x * x, y * y, x * y
        r2 = xx + yy
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3))
        u = x * radial + 2 * p1 * xy + p2 * (r2 + 2 * xx)
        v = y * radial + p1 * (r2 + 2 * yy) + 2 * p2 * xy
        residual[m, 0] = fx * u + shared[CX] - pixels[m, 0]
        residual[m, 1] = fy * v + shared[CY] - pixels[m, 1]
        ux = fx * (radial + xx * slope + 2 * p1 * y + 6 * p2 * x) / c
        uy = fx * (xy * slope + 2 * p1 * x + 2 * p2 * y) / c
        vx = fy * (xy * slope + 2 * p1 * x + 2 * p2 * y) / c
        vy = fy * (radial + yy * slope + 6 * p1 * y + 2 * p2 * x) / c
        for k in range(2):
            gx, gy = (ux, uy) if k == 0 else (vx, vy)
            gz = -(gx * x + gy * y)
            # The rotation is updated from the left: d local = turn x local.
            by_pose[m, k, 0] = gz * b - gy * c
            by_pose[m, k, 1] = gx * c - gz * a
            by_pose[m, k, 2] = gy * a - gx * b
            for j in range(3):
                along = gx * r[0, j] + gy * r[1, j] + gz * r[2, j]
                by_point[m, k, j] = along
                by_pose[m, k, 3 + j] = -along
                by_pose[m, k, 6 + j] = -s * along
                by_shared[m, k, READOUT] -= s * along * velocity[i, j]
            pinhole, scale = (u, fx) if k == 0 else (v, fy)
            own, other = (x, y) if k == 0 else (y, x)
            by_shared[m, k, LOG_F] = scale * pinhole
            by_shared[m, k, LOG_ASPECT] = 0.0 if k == 0 else scale * pinhole
            by_shared[m, k, CX + k] = 1.0
            by_shared[m, k, K1] = scale * own * r2
            by_shared[m, k, K2] = scale * own * r2 * r2
            by_shared[m, k, K3] = scale * own * r2 * r2 * r2
            by_shared[m, k, P1 + k] = scale * 2 * own * other
            by_shared[m, k, P2 - k] = scale * (r2 + 2 * own * own)
            if flight[i] > 0:
                by_shared[m, k, FIRST_FLIGHT + flight[i] - 1] = scale * pinhole


@njit(parallel=True, **EXACT)
def bend(residual, by_pose, by_shared, by_point, share):
    """Residuals and derivatives, in place, so that their products have the loss's own curvature along each residual,
    ``share`` (M,) of its weight, and the same slope (Triggs et al. 2000, equation 11)."""
    for m in prange(len(residual)):
        square = residual[m, 0] * residual[m, 0] + residual[m, 1] * residual[m, 1]
        if share[m] < 1 and square > 0:
            kept = np.sqrt(share[m])
            _shrink(by_pose[m], residual[m], (1 - kept) / square)
            _shrink(by_shared[m], residual[m], (1 - kept) / square)
            _shrink(by_point[m], residual[m], (1 - kept) / square)
            residual[m, 0] /= kept
            residual[m, 1] /= kept


@njit(inline="always")
def _shrink(derivative, residual, factor):
    """(2, n) derivatives less a share of their part along the residual."""
    for n in range(derivative.shape[1]):
        along = factor * (residual[0] * derivative[0, n] + residual[1] * derivative[1, n])
        derivative[0, n] -= residual[0] * along
        derivative[1, n] -= residual[1] * along


@njit(parallel=True, **EXACT)
def eliminate(linear, weight, by_point_rows, known, damping, inverse, right, mixed):
    """Normal equations of the points, into the arrays of a :class:`.bundle.PointNormals`.

    known: (P, 3) weights and (P, 3) differences of points with a prior.
    """
    residual, _, by_shared, by_point = linear
    starts, order = by_point_rows
    prior, prior_residual = known
    size = by_shared.shape[2]
    for p in prange(len(starts) - 1):
        normal = np.zeros((3, 3))
        for j in range(3):
            right[p, j] = -prior[p, j] * prior_residual[p, j]
            normal[j, j] = prior[p, j]
        mixed[p] = 0.0
        for place in range(starts[p], starts[p + 1]):
            m = order[place]
            for k in range(2):
                w = weight[m]
                for j in range(3):
                    g = w * by_point[m, k, j]
                    right[p, j] -= g * residual[m, k]
                    for n in range(3):
                        normal[j, n] += g * by_point[m, k, n]
                    for n in range(size):
                        mixed[p, j, n] += g * by_shared[m, k, n]
        for j in range(3):
            normal[j, j] *= 1 + damping
            normal[j, j] += 1e-12
        _invert(normal, inverse[p])


@njit(**EXACT)
def _invert(normal, out):
    """Inverse of a symmetric 3 x 3 matrix by its cofactors."""
    a, b, c = normal[0, 0], normal[0, 1], normal[0, 2]
    d, e, f = normal[1, 1], normal[1, 2], normal[2, 2]
    out[0, 0], out[0, 1], out[0, 2] = d * f - e * e, c * e - b * f, b * e - c * d
    out[1, 1], out[1, 2], out[2, 2] = a * f - c * c, b * c - a * e, a * d - b * b
    scale = 1 / (a * out[0, 0] + b * out[0, 1] + c * out[0, 2])
    for j in range(3):
        for n in range(j, 3):
            out[j, n] *= scale
            out[n, j] = out[j, n]


@njit(parallel=True, **EXACT)
def couple(linear, weight, point_rows, out):
    """Products of the derivatives by the first ``W`` numbers of a photo with those by the point, weighted: (M, 3, W),
    in the order of ``point_rows``, so that those of one point lie side by side."""
    _, by_pose, _, by_point = linear
    starts, order = point_rows
    for p in prange(len(starts) - 1):
        for place in range(starts[p], starts[p + 1]):
            m = order[place]
            for j in range(3):
                g0, g1 = weight[m] * by_point[m, 0, j], weight[m] * by_point[m, 1, j]
                for d in range(out.shape[2]):
                    out[place, j, d] = g0 * by_pose[m, 0, d] + g1 * by_pose[m, 1, d]


@njit(inline="always")
def _take(block, lean, other):
    """``block`` (W, W) less ``lean`` (W, 3) times ``other`` (3, W).

    Three columns at once are written out: compilers make no vectors of loops over arrays that may overlap, and this is
    where an adjustment spends its time."""
    for n in range(0, block.shape[1], 3):
        a0, a1, a2 = other[0, n], other[0, n + 1], other[0, n + 2]
        b0, b1, b2 = other[1, n], other[1, n + 1], other[1, n + 2]
        c0, c1, c2 = other[2, n], other[2, n + 1], other[2, n + 2]
        for d in range(len(lean)):
            a, b, c = lean[d, 0], lean[d, 1], lean[d, 2]
            r0 = block[d, n] - (a * a0 + b * b0 + c * c0)
            r1 = block[d, n + 1] - (a * a1 + b * b1 + c * c1)
            r2 = block[d, n + 2] - (a * a2 + b * b2 + c * c2)
            block[d, n], block[d, n + 1], block[d, n + 2] = r0, r1, r2


@njit(parallel=True, **EXACT)
def reduce_photos(linear, weight, point, photo_there, image_rows, point_rows, places, coupled, normals, matrix, right):
    """The photos' rows of the reduced normal equations (upper part); those of numbers that are not coupled stay zero.

    Args:
        point: (M,) of the observations. photo_there: (M,) their photos in the order of ``point_rows`` (by point, then
            by photo). places: (M,) where each stands in that order. coupled: of :func:`couple`. matrix: (N * N_POSE +
            S,) squared, zeroed. right: as long.
    """
    image_starts, image_order = image_rows
    starts, _ = point_rows
    residual, by_pose, by_shared, _ = linear
    inverse, point_right, mixed = normals
    photos, size, width = len(image_starts) - 1, by_shared.shape[2], coupled.shape[2]
    first_shared = len(right) - size
    for k in prange(photos):
        # The first photos have most of the work (all later ones beside them): each thread gets as many of the last.
        i = k // 2 if k % 2 == 0 else photos - 1 - k // 2
        at = i * N_POSE
        blocks = np.zeros((photos - i, width, width))
        common, down, lean = np.zeros((width, size)), np.zeros(width), np.empty((width, 3))
        for row in range(image_starts[i], image_starts[i + 1]):
            m = image_order[row]
            p, w = point[m], weight[m]
            _lean(coupled[places[m]], inverse[p], lean)
            for d in range(width):
                u, v = w * by_pose[m, 0, d], w * by_pose[m, 1, d]
                a, b, c = lean[d, 0], lean[d, 1], lean[d, 2]
                pull = u * residual[m, 0] + v * residual[m, 1]
                down[d] += pull + (a * point_right[p, 0] + b * point_right[p, 1] + c * point_right[p, 2])
                for n in range(size):
                    total = u * by_shared[m, 0, n] + v * by_shared[m, 1, n]
                    common[d, n] += total - (a * mixed[p, 0, n] + b * mixed[p, 1, n] + c * mixed[p, 2, n])
                for n in range(width):
                    blocks[0, d, n] += u * by_pose[m, 0, n] + v * by_pose[m, 1, n]
            begin = places[m]
            while begin > starts[p] and photo_there[begin - 1] == i:
                begin -= 1
            for place in range(begin, starts[p + 1]):
                _take(blocks[photo_there[place] - i], lean, coupled[place])
        for d in range(width):
            right[at + d] -= down[d]
            for n in range(size):
                matrix[at + d, first_shared + n] += common[d, n]
            for h in range(len(blocks)):
                for n in range(width):
                    matrix[at + d, at + h * N_POSE + n] += blocks[h, d, n]


@njit(inline="always")
def _lean(cross, inverse, out):
    """(3, W) product of unknowns and a point, times the point's inverse normal equations, into (W, 3)."""
    for d in range(len(out)):
        for j in range(3):
            out[d, j] = cross[0, d] * inverse[0, j] + cross[1, d] * inverse[1, j] + cross[2, d] * inverse[2, j]


#: Sums over all observations or points are made in so many parts, whatever the number of threads.
PARTS = 16


@njit(parallel=True, **EXACT)
def reduce_shared(linear, weight, normals, matrix, right):
    """The shared parameters' rows: their own normal equations less what the points take up."""
    residual, _, by_shared, _ = linear
    inverse, point_right, mixed = normals
    size = by_shared.shape[2]
    squares, pulls = np.zeros((PARTS, size, size)), np.zeros((PARTS, size))
    rows, points = len(residual), len(inverse)
    for part in prange(PARTS):
        square, pull, lean = squares[part], pulls[part], np.empty((size, 3))
        for m in range(rows * part // PARTS, rows * (part + 1) // PARTS):
            for k in range(2):
                for n in range(size):
                    g = weight[m] * by_shared[m, k, n]
                    if g != 0.0:
                        pull[n] -= g * residual[m, k]
                        for j in range(size):
                            square[n, j] += g * by_shared[m, k, j]
        for p in range(points * part // PARTS, points * (part + 1) // PARTS):
            _lean(mixed[p], inverse[p], lean)
            for n in range(size):
                a, b, c = lean[n, 0], lean[n, 1], lean[n, 2]
                pull[n] -= a * point_right[p, 0] + b * point_right[p, 1] + c * point_right[p, 2]
                for k in range(size):
                    square[n, k] -= a * mixed[p, 0, k] + b * mixed[p, 1, k] + c * mixed[p, 2, k]
    at = len(right) - size
    for part in range(PARTS):
        for n in range(size):
            right[at + n] += pulls[part, n]
            for k in range(n, size):
                matrix[at + n, at + k] += squares[part, n, k]


@njit(parallel=True, **EXACT)
def move_points(linear, weight, image, point_rows, normals, step, out):
    """(P, 3) steps of the points that belong to a step of photos and shared parameters."""
    _, by_pose, _, by_point = linear
    starts, order = point_rows
    inverse, point_right, mixed = normals
    size = mixed.shape[2]
    first_shared = len(step) - size
    for p in prange(len(starts) - 1):
        rest = np.empty(3)
        for j in range(3):
            rest[j] = point_right[p, j]
            for n in range(size):
                rest[j] -= mixed[p, j, n] * step[first_shared + n]
        for place in range(starts[p], starts[p + 1]):
            m = order[place]
            at = image[m] * N_POSE
            for k in range(2):
                total = 0.0
                for d in range(N_POSE):
                    total += by_pose[m, k, d] * step[at + d]
                for j in range(3):
                    rest[j] -= weight[m] * by_point[m, k, j] * total
        for j in range(3):
            out[p, j] = inverse[p, j, 0] * rest[0] + inverse[p, j, 1] * rest[1] + inverse[p, j, 2] * rest[2]
