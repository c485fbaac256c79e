"""Where a stem may stand and how thick it may be, before any fit: its silhouette against the ground.

Each crop says how unlike the ground texture each pixel is. Along an upright axis a stem is what is not ground, between
two vertical lines, in every photo that sees it. The contrast between inside and beside, summed over photos and heights,
ranks places and radii; the best different ones are the starting points of the fit (:mod:`.primitive.fit`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from scipy.ndimage import maximum_filter

from ...quality.priors import START_TAPER
from ..crops import Crop
from .model import Lens, axis_passage

_FAST: dict[str, Any] = {"nogil": True, "cache": True, "fastmath": True, "error_model": "numpy"}
#: Sideways bins (metres) and heights above ground (metres) that evidence is gathered in.
_BIN_M, _REACH_M = 0.02, 0.78
_LOW_M, _BLOCK_M, _BLOCKS = 0.4, 0.3, 8
_BESIDE_M = 0.2
#: Colour distance from the ground at which a pixel is half a stem's.
_UNLIKE = 0.12


@dataclass(frozen=True)
class SilhouetteEvidence:
    """total, mass: (V, B, U + 1) running sums, over the sideways bins, of "not ground" times weight, and of weight.
    normal: (V, 2) direction that bins count along. q: (B,) block heights minus breast height."""

    total: np.ndarray
    mass: np.ndarray
    normal: np.ndarray
    q: np.ndarray


@njit(**_FAST)
def _collect(lens, unlike, weight, bh, total, mass, normal):
    centre = lens.centre
    upright = np.zeros(8)
    flat = np.hypot(centre[0], centre[1])
    # s is measured along the axis' offset from the ray; a stem at (x, y) appears at s = (x, y) . n.
    normal[0], normal[1] = -centre[1] / flat, centre[0] / flat
    for y in range(unlike.shape[0]):
        for x in range(unlike.shape[1]):
            s, q, t, nx, ny, _, _, _ = axis_passage(upright, bh, lens, x, y)
            block = int((q + bh - _LOW_M) / _BLOCK_M)
            if q + bh < _LOW_M or block >= _BLOCKS or t <= 0:
                continue
            # The ray passes the axis at -s along its n; n turns with the ray, bins keep one direction a photo.
            place = -s * np.sign(nx * normal[0] + ny * normal[1])
            place = (place + _REACH_M) / _BIN_M - 0.5
            i = int(np.floor(place))
            if i < 0 or i >= total.shape[1] - 2:
                continue
            f = place - i
            w = weight[y, x]
            total[block, i + 1] += (1 - f) * w * unlike[y, x]
            total[block, i + 2] += f * w * unlike[y, x]
            mass[block, i + 1] += (1 - f) * w
            mass[block, i + 2] += f * w


def gather_evidence(crops: list[Crop], behind: list[np.ndarray], bh_m: float) -> SilhouetteEvidence:
    """behind: (H, W, 3) of each crop, the ground that it would show without a stem."""
    bins = int(2 * _REACH_M / _BIN_M)
    shape = (len(crops), _BLOCKS, bins + 1)
    total, mass, normal = np.zeros(shape), np.zeros(shape), np.zeros((len(crops), 2))
    for v, crop in enumerate(crops):
        camera = crop.camera
        lens = Lens(np.ascontiguousarray(camera.rotation, float), camera.centre, camera.intrinsics)
        square = ((behind[v] - crop.image) ** 2).sum(axis=-1)
        unlike = square / (square + np.float32(_UNLIKE**2))  # 0 = ground, 1 = certainly not (Geman and McClure)
        _collect(lens, unlike, crop.weight, bh_m, total[v], mass[v], normal[v])
    q = _LOW_M + (np.arange(_BLOCKS) + 0.5) * _BLOCK_M - bh_m
    return SilhouetteEvidence(np.cumsum(total, axis=2), np.cumsum(mass, axis=2), normal, q)


@njit(inline="always", **_FAST)
def _between(running, left, right):
    a = (left + _REACH_M) / _BIN_M
    b = (right + _REACH_M) / _BIN_M
    i, j = int(a), int(b)
    low = running[i] + (a - i) * (running[i + 1] - running[i])
    return running[j] + (b - j) * (running[j + 1] - running[j]) - low


@njit(**_FAST)
def _contrast(total, mass, normal, q, x, y, lx, ly, r):
    edge = _REACH_M - 2 * _BIN_M
    result = 0.0
    for v in range(total.shape[0]):
        for b in range(total.shape[1]):
            c = (x + lx * q[b]) * normal[v, 0] + (y + ly * q[b]) * normal[v, 1]
            half = r + START_TAPER * q[b]
            left, right = max(c - half - _BESIDE_M, -edge), min(c + half + _BESIDE_M, edge)
            if c - half < left + 0.02 or c + half > right - 0.02:
                continue
            inside = _between(mass[v, b], c - half, c + half)
            beside = _between(mass[v, b], left, right) - inside
            if inside < 1.0 or beside < 1.0:
                continue
            within = _between(total[v, b], c - half, c + half)
            around = _between(total[v, b], left, right) - within
            step = within / inside - around / beside
            result += inside * beside / (inside + beside) * step * abs(step)
    return result


@njit(**_FAST)
def _grid(total, mass, normal, q, offsets, radii, score):
    for a in range(offsets.size):
        for b in range(offsets.size):
            for k in range(radii.size):
                score[a, b, k] = _contrast(total, mass, normal, q, offsets[b], offsets[a], 0.0, 0.0, radii[k])


#: Stems are tried this far from the seed, with these radii (m).
_OFFSET_M, _RADII_M = 0.3, np.arange(0.04, 0.36, 0.02)
#: Radii (m) that divide the starts into classes. Each class sends its best: a thin stem beside a bush would have none.
_CLASSES = 0.0, 0.075, 0.11, 0.15, 0.22, 1.0
#: Starts: so many of all, and of each class.
_BEST, _BEST_OF_CLASS = 5, 2


def starts(evidence: SilhouetteEvidence) -> list[np.ndarray]:
    """Shape vectors of the best different silhouettes of upright stems near the seed, of all and of each class of
    radii."""
    offsets, radii = np.arange(-_OFFSET_M, _OFFSET_M + 0.01, 0.03), _RADII_M
    score = np.empty((len(offsets), len(offsets), len(radii)))
    _grid(evidence.total, evidence.mass, evidence.normal, evidence.q, offsets, radii, score)
    chosen: list[tuple[int, int, int]] = []

    def add(table: np.ndarray, count: int, least: float) -> None:
        peak = (table >= maximum_filter(table, size=(3, 3, 3))) & (table > least)
        top = np.argwhere(peak)
        for place in top[np.argsort(-table[tuple(top.T)], kind="stable")][:count]:
            if tuple(place) not in chosen:
                chosen.append((int(place[0]), int(place[1]), int(place[2])))

    best = max(float(score.max()), 1e-9)
    add(score, _BEST, 0.3 * best)
    for low, high in zip(_CLASSES[:-1], _CLASSES[1:], strict=True):
        own = (radii >= low) & (radii < high)
        if own.any():
            add(np.where(own, score, -np.inf), _BEST_OF_CLASS, 0.0)
    return [np.array([offsets[b], offsets[a], 0, 0, 0, 0, radii[k], START_TAPER]) for a, b, k in chosen]
