"""Compiled parts of the bundle adjustment: residuals with their derivatives, and the points eliminated.

All sums go over observations in a fixed order within one photo or one point, so that results do not depend on the
number of threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

#: Numbers of a photo: rotation vector (3), centre (3) and readout travel (3), metres.
N_POSE = 9
#: Columns of the shared parameters before the flights' own: log of the focal length, log of fy / fx, principal point,
#: Brown's k1, k2, p1, p2, k3 and the readout time in seconds.
LOG_F, LOG_ASPECT, CX, CY, K1, K2, P1, P2, K3, READOUT, FIRST_FLIGHT = range(11)

_FAST = {"nogil": True, "cache": True}


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
    """Observations: see :class:`.bundle.Observations`; flight (N,) of each photo."""

    photo: np.ndarray
    point: np.ndarray
    pixels: np.ndarray
    share: np.ndarray
    flight: np.ndarray


class Rows(NamedTuple):
    """Rows of each photo or point: ``order[starts[k] : starts[k + 1]]``."""

    starts: np.ndarray
    order: np.ndarray


@njit(parallel=True, **_FAST)
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


@njit(parallel=True, **_FAST)
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
                        mixed[p, n, j] += g * by_shared[m, k, n]
        for j in range(3):
            normal[j, j] *= 1 + damping
            normal[j, j] += 1e-12
        inverse[p] = np.linalg.inv(normal)


@njit(parallel=True, **_FAST)
def reduce_photos(linear, weight, image, point, image_rows, point_rows, normals, matrix, right):
    """The photos' rows of the reduced normal equations (upper part).

    matrix: (N * N_POSE + S,) squared, zeroed. right: as long.
    """
    image_starts, image_order = image_rows
    starts, order = point_rows
    residual, by_pose, by_shared, by_point = linear
    inverse, point_right, mixed = normals
    size = by_shared.shape[2]
    first_shared = (len(image_starts) - 1) * N_POSE
    for i in prange(len(image_starts) - 1):
        at = i * N_POSE
        cross = np.zeros((N_POSE, 3))
        lean = np.zeros((N_POSE, 3))
        for place in range(image_starts[i], image_starts[i + 1]):
            m = image_order[place]
            p, w = point[m], weight[m]
            for d in range(N_POSE):
                for j in range(3):
                    cross[d, j] = w * (by_pose[m, 0, d] * by_point[m, 0, j] + by_pose[m, 1, d] * by_point[m, 1, j])
            for d in range(N_POSE):
                for j in range(3):
                    lean[d, j] = (
                        cross[d, 0] * inverse[p, 0, j] + cross[d, 1] * inverse[p, 1, j] + cross[d, 2] * inverse[p, 2, j]
                    )
            for d in range(N_POSE):
                right[at + d] -= w * (by_pose[m, 0, d] * residual[m, 0] + by_pose[m, 1, d] * residual[m, 1])
                for j in range(3):
                    right[at + d] -= lean[d, j] * point_right[p, j]
                for n in range(N_POSE):
                    matrix[at + d, at + n] += w * (
                        by_pose[m, 0, d] * by_pose[m, 0, n] + by_pose[m, 1, d] * by_pose[m, 1, n]
                    )
                for n in range(size):
                    total = w * (by_pose[m, 0, d] * by_shared[m, 0, n] + by_pose[m, 1, d] * by_shared[m, 1, n])
                    for j in range(3):
                        total -= lean[d, j] * mixed[p, n, j]
                    matrix[at + d, first_shared + n] += total
            for other in range(starts[p], starts[p + 1]):
                q = order[other]
                h = image[q]
                if h < i:
                    continue
                to, v = h * N_POSE, weight[q]
                for n in range(N_POSE):
                    g0 = v * by_pose[q, 0, n]
                    g1 = v * by_pose[q, 1, n]
                    c0 = g0 * by_point[q, 0, 0] + g1 * by_point[q, 1, 0]
                    c1 = g0 * by_point[q, 0, 1] + g1 * by_point[q, 1, 1]
                    c2 = g0 * by_point[q, 0, 2] + g1 * by_point[q, 1, 2]
                    for d in range(N_POSE):
                        matrix[at + d, to + n] -= lean[d, 0] * c0 + lean[d, 1] * c1 + lean[d, 2] * c2


@njit(**_FAST)
def reduce_shared(linear, weight, normals, matrix, right):
    """The shared parameters' rows: their own normal equations less what the points take up."""
    residual, _, by_shared, _ = linear
    inverse, point_right, mixed = normals
    size = by_shared.shape[2]
    at = len(right) - size
    for m in range(len(residual)):
        w = weight[m]
        for k in range(2):
            for n in range(size):
                g = w * by_shared[m, k, n]
                if g != 0.0:
                    right[at + n] -= g * residual[m, k]
                    for j in range(n, size):
                        matrix[at + n, at + j] += g * by_shared[m, k, j]
    lean = np.empty(3)
    for p in range(len(inverse)):
        for n in range(size):
            for j in range(3):
                lean[j] = (
                    mixed[p, n, 0] * inverse[p, 0, j]
                    + mixed[p, n, 1] * inverse[p, 1, j]
                    + mixed[p, n, 2] * inverse[p, 2, j]
                )
            for j in range(3):
                right[at + n] -= lean[j] * point_right[p, j]
            for k in range(n, size):
                matrix[at + n, at + k] -= lean[0] * mixed[p, k, 0] + lean[1] * mixed[p, k, 1] + lean[2] * mixed[p, k, 2]


@njit(parallel=True, **_FAST)
def move_points(linear, weight, image, point_rows, normals, step, out):
    """(P, 3) steps of the points that belong to a step of photos and shared parameters."""
    _, by_pose, _, by_point = linear
    starts, order = point_rows
    inverse, point_right, mixed = normals
    size = mixed.shape[1]
    first_shared = len(step) - size
    for p in prange(len(starts) - 1):
        rest = np.empty(3)
        for j in range(3):
            rest[j] = point_right[p, j]
            for n in range(size):
                rest[j] -= mixed[p, n, j] * step[first_shared + n]
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
