"""How the photos are turned, from all candidate matches of all pairs at once.

Where crowns move, nine in ten candidates of a pair are wrong, and some turn of the pair agrees with as many of them by
chance. But a photo has one turn in all of its pairs: wrong candidates lie anywhere, the right ones agree. A robust
adjustment of all turns (and of the positions within their standard errors) finds them, as its loss narrows step by step
from a gimbal's error to that of a match (graduated non-convexity, Blake and Zisserman 1987; Geman and McClure's loss).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.transform import Rotation

#: The loss narrows by this factor a step; steps at its last width, and the turn (radians) that ends them before.
_NARROWER, _LAST_STEPS, _NO_TURN = 0.9, 120, 2e-5
#: Rounds of search on a grid, how far it reaches, standard errors of a turn, and by how much better a place is to be
#: taken (a candidate counts up to one).
_ROUNDS, _REACH_SD, _BETTER = 3, 2.0, 5.0
#: Unknowns of a photo: turn about the axes of the world, radians, and shift, metres.
_OF_PHOTO = 6


class Candidates(NamedTuple):
    """Candidate matches, pair after pair. pairs: (P, 2) numbers of photos. starts: (P + 1,) where the candidates of
    each pair begin. a, b: (K, 3) unit rays of the two photos, world frame."""

    pairs: np.ndarray
    starts: np.ndarray
    a: np.ndarray
    b: np.ndarray


def agreed_turns(
    found: Candidates,
    centres: np.ndarray,
    turn_sd: np.ndarray,
    shift_sd: np.ndarray,
    focal_px: float,
    widths_px: tuple[float, float],
) -> tuple[np.ndarray, np.ndarray]:
    """The turns that most candidates agree with.

    Args:
        centres: (N, 3) where the photos were taken, metres. turn_sd: (N, 3) rad, shift_sd: (N, 3) m, standard errors of
            the rotations that the rays were made with, about the world's axes, and of the centres. widths_px: of the
            loss at first and at last: distance from the epipolar line at which a candidate counts a quarter.

    Returns:
        (N, 3, 3) turns of the rays in the world frame, and (K,) how far each candidate is from its line, pixels.
    """
    network = _Network(found, centres, 1 / np.hstack([turn_sd, shift_sd]) ** 2, focal_px)
    moved, off = network.settled(np.zeros((len(centres), _OF_PHOTO)), *widths_px)
    for _ in range(_ROUNDS):
        again = network.searched(moved, turn_sd, widths_px[1])
        if again is None:
            break
        moved, off = network.settled(again, widths_px[1], widths_px[1])
    return Rotation.from_rotvec(moved[:, :3]).as_matrix(), off


@dataclass(frozen=True)
class _Network:
    """found, centres, focal_px: as :func:`agreed_turns`. held: (N, 6) inverse variances of the photos' unknowns."""

    found: Candidates
    centres: np.ndarray
    held: np.ndarray
    focal_px: float

    def settled(self, moved: np.ndarray, width: float, last: float) -> tuple[np.ndarray, np.ndarray]:
        """(N, 6) unknowns where the robust adjustment ends that starts from ``moved``, and (K,) distances."""
        found, held = self.found, self.held
        off, moved, left = np.zeros(len(found.a)), moved.copy(), _LAST_STEPS
        blocks = np.zeros((len(found.pairs), 2 * _OF_PHOTO, 2 * _OF_PHOTO))
        pulls = np.zeros((len(found.pairs), 2 * _OF_PHOTO))
        at = (_OF_PHOTO * found.pairs[:, :, None] + np.arange(_OF_PHOTO)).reshape(-1, 2 * _OF_PHOTO)
        while True:
            turns, centres = Rotation.from_rotvec(moved[:, :3]).as_matrix(), self.centres + moved[:, 3:]
            _normals(*found, turns, centres, self.focal_px, width, off, blocks, pulls)
            if left == 0:
                return moved, off
            matrix, right = np.diag(held.ravel()), -(held * moved).ravel()
            for rows, block, pull in zip(at, blocks, pulls, strict=True):
                matrix[np.ix_(rows, rows)] += block
                right[rows] -= pull
            step = cho_solve(cho_factor(matrix, overwrite_a=True, check_finite=False), right).reshape(-1, _OF_PHOTO)
            moved += step
            if width <= last:
                left = 0 if np.abs(step[:, :3]).max() < _NO_TURN else left - 1
            width = max(_NARROWER * width, last)

    def searched(self, moved: np.ndarray, turn_sd: np.ndarray, width: float) -> np.ndarray | None:
        """The unknowns with each photo turned to where its candidates agree best on a grid, the others held; ``None``
        where no photo has a better place than it has. A photo with few right candidates may have settled beside them.
        """
        found = self.found
        turns = Rotation.from_rotvec(moved[:, :3]).as_matrix()
        off, rows = np.zeros(len(found.a)), np.zeros((2, len(found.a), 3))
        _by_turns(*found, turns, self.centres + moved[:, 3:], self.focal_px, off, rows)
        pair = np.repeat(np.arange(len(found.pairs)), np.diff(found.starts))
        photo = found.pairs[pair].T
        # A step moves a picture by one width and a half; heads turn it about its middle, and less.
        step = 1.5 * width / self.focal_px * np.array([1.0, 1.0, 4.0])
        better = moved.copy()
        for i in range(len(moved)):
            own = [np.flatnonzero(side == i) for side in photo]
            if not sum(map(len, own)):
                continue
            here = np.concatenate([off[each] for each in own])
            by = np.concatenate([side[each] for side, each in zip(rows, own, strict=True)])
            reach = np.maximum(np.ceil(_REACH_SD * turn_sd[i] / step), 1).astype(int)
            axes = [one * np.arange(-count, count + 1) for one, count in zip(step, reach, strict=True)]
            tried = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
            square = ((here[:, None] + by @ tried.T) / width) ** 2
            cost = (square / (1 + square)).sum(axis=0) + (((moved[i, :3] + tried) ** 2) * self.held[i, :3]).sum(axis=1)
            best = int(cost.argmin())
            if cost[best] < cost[len(tried) // 2] - _BETTER:
                better[i, :3] += tried[best]
        return None if (better == moved).all() else better


@njit(nogil=True, cache=True)
def _line(a, b, turn_i, turn_j, u, length, focal, row):
    """Distance of a candidate from its epipolar line, pixels, and into ``row`` (12,) its derivatives by turn and shift
    of the two photos. u: unit vector from the first photo to the second, ``length`` apart."""
    x0, x1, x2 = a[0], a[1], a[2]
    a0 = turn_i[0, 0] * x0 + turn_i[0, 1] * x1 + turn_i[0, 2] * x2
    a1 = turn_i[1, 0] * x0 + turn_i[1, 1] * x1 + turn_i[1, 2] * x2
    a2 = turn_i[2, 0] * x0 + turn_i[2, 1] * x1 + turn_i[2, 2] * x2
    x0, x1, x2 = b[0], b[1], b[2]
    b0 = turn_j[0, 0] * x0 + turn_j[0, 1] * x1 + turn_j[0, 2] * x2
    b1 = turn_j[1, 0] * x0 + turn_j[1, 1] * x1 + turn_j[1, 2] * x2
    b2 = turn_j[2, 0] * x0 + turn_j[2, 1] * x1 + turn_j[2, 2] * x2
    c0, c1, c2 = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    au = a0 * u[0] + a1 * u[1] + a2 * u[2]
    bu = b0 * u[0] + b1 * u[1] + b2 * u[2]
    cu = c0 * u[0] + c1 * u[1] + c2 * u[2]
    ab = a0 * b0 + a1 * b1 + a2 * b2
    # |u x a|^2 + |u x b|^2: how much a pixel of either photo is worth.
    scale = focal / np.sqrt(2.0 - au * au - bu * bu + 1e-12)
    r = scale * cu
    row[0], row[1], row[2] = b0 * au - u[0] * ab, b1 * au - u[1] * ab, b2 * au - u[2] * ab
    row[6], row[7], row[8] = u[0] * ab - a0 * bu, u[1] * ab - a1 * bu, u[2] * ab - a2 * bu
    row[9], row[10], row[11] = (c0 - cu * u[0]) / length, (c1 - cu * u[1]) / length, (c2 - cu * u[2]) / length
    row[3], row[4], row[5] = -row[9], -row[10], -row[11]
    for m in range(12):
        row[m] *= scale
    return r


@njit(parallel=True, nogil=True, cache=True)
def _normals(pairs, starts, a, b, turns, centres, focal, width, off, blocks, pulls):
    """Distances of the candidates from their epipolar lines, pixels, and by pair the weighted normal equations of the
    two photos' turns and shifts. Sums go in a fixed order: they do not depend on the number of threads."""
    for p in prange(len(pairs)):
        i, j = pairs[p, 0], pairs[p, 1]
        blocks[p] = 0.0
        pulls[p] = 0.0
        base = centres[j] - centres[i]
        length = np.sqrt(base[0] ** 2 + base[1] ** 2 + base[2] ** 2)
        u = base / length
        row = np.empty(12)
        for k in range(starts[p], starts[p + 1]):
            r = _line(a[k], b[k], turns[i], turns[j], u, length, focal, row)
            off[k] = r
            weight = 1 / (width * (1 + (r / width) ** 2)) ** 2
            for m in range(12):
                pulls[p, m] += weight * row[m] * r
                for n in range(12):
                    blocks[p, m, n] += weight * row[m] * row[n]


@njit(nogil=True, cache=True)
def _by_turns(pairs, starts, a, b, turns, centres, focal, off, rows):
    """Distances of the candidates, and (2, K, 3) their derivatives by the turns of the two photos."""
    row = np.empty(12)
    for p in range(len(pairs)):
        i, j = pairs[p, 0], pairs[p, 1]
        base = centres[j] - centres[i]
        length = np.sqrt(base[0] ** 2 + base[1] ** 2 + base[2] ** 2)
        u = base / length
        for k in range(starts[p], starts[p + 1]):
            off[k] = _line(a[k], b[k], turns[i], turns[j], u, length, focal, row)
            rows[0, k] = row[:3]
            rows[1, k] = row[6:9]
