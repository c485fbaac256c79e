"""Matching of photo pairs where geotags and gimbals say which part of the one can show a feature of the other.

Flat ground and the tops of the crowns bound where along its ray a feature may lie; half a degree of gimbal error and
what the mounting adds bound how far beside. Among the few features there a descriptor has little to decide: more right
matches than a search through the whole photo, in a tenth of the time. What the matches are worth is verified as theirs.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numba import njit

from ..core.progress import Reporter
from .cameras import Camera, View
from .features import FeatureStore
from .guided import CELL_PX, MAX_SQUARED, grid_cells, one_to_one

#: A gimbal's angles and their mounting, both photos', are believed to this, degrees.
REACH_DEG = 1.2
#: A match is believed when the second best in its reach is this much farther, as COLMAP's matcher does.
_RATIO = 0.8
#: Matches that a verified pair has; so many standard deviations more than chance would give.
_LEAST, _CHANCE_SD = 15, 6.0
#: Verification: distance from the epipolar line, trials, and the least distance between two photos.
_TOLERANCE_PX, _TRIALS, _LEAST_BASELINE_M = 4.0, 400, 0.3
#: How far the direction from one photo to the other may be off, as the first photo's rays have it (radians).
_ALONG_SD = 0.02


@dataclass(frozen=True)
class Guide:
    """What is known before features are matched. rotations (N, 3, 3), centres (N, 3): world -> camera by gimbals and
    geotags, local metres. low_m, high_m: between which heights features lie, local."""

    rotations: np.ndarray
    centres: np.ndarray
    camera: Camera
    low_m: float
    high_m: float

    def ends(self, i: int, j: int, pixels: np.ndarray) -> np.ndarray:
        """(K, 4) where pixels (K, 2) of photo i lie in photo j when they are as high as may be, and as low; NaN where
        photo j cannot show them."""
        rays = self.view(i).rays(pixels)
        found = []
        for height in (self.high_m, self.low_m):
            with np.errstate(divide="ignore", invalid="ignore"):
                away = (height - self.centres[i, 2]) / rays[:, 2]
            away = np.where((rays[:, 2] < -0.05) & (away > 0), away, np.nan)
            places = self.centres[i] + away[:, None] * rays
            found.append(self.view(j).project(places)[0])
        return np.hstack(found)

    def view(self, j: int) -> View:
        """Photo j as gimbal and geotag have it."""
        rotation = self.rotations[j]
        return View(str(j), Path(), self.camera, rotation, -rotation @ self.centres[j])


class _Photo:
    """The features of one photo, in the order of cells."""

    def __init__(self, keypoints: np.ndarray, descriptors: np.ndarray, guide: Guide, i: int) -> None:
        camera = guide.camera
        self.order, self.starts, self.columns, self.rows = grid_cells(keypoints, camera.width, camera.height)
        self.xy = np.ascontiguousarray(keypoints[self.order])
        self.rays = guide.view(i).rays(self.xy)
        self.centre = guide.centres[i]
        self.described = np.ascontiguousarray(descriptors[self.order])
        self.square = np.sum(self.described.astype(np.int64) ** 2, axis=1)


def match_guided(
    store: FeatureStore, pairs: np.ndarray, guide: Guide, seed: int, threads: int, reporter: Reporter
) -> None:
    """Match photos and verify the matches, in place of ``store.matches``.

    pairs: (K, 2) numbers of photos.
    """
    store.matches = {}
    photos: dict[int, _Photo] = {}
    for i in np.unique(pairs).tolist():
        photos[i] = _Photo(store.keypoints[i], store.descriptors[i], guide, i)
    reach_px = float(np.tan(np.radians(REACH_DEG)) * guide.camera.fx)

    def work(pair: np.ndarray) -> np.ndarray:
        i, j = pair.tolist()
        rows = _matches(photos[i], photos[j], guide.ends(i, j, photos[i].xy), reach_px)
        return rows[_verified(photos[i], photos[j], rows, guide, reach_px, np.random.default_rng([seed, i, j]))]

    with ThreadPoolExecutor(max_workers=threads) as workers:
        for count, (pair, rows) in enumerate(zip(pairs, workers.map(work, pairs), strict=True)):
            if len(rows):
                i, j = pair.tolist()
                store.matches[i, j] = np.column_stack([photos[i].order[rows[:, 0]], photos[j].order[rows[:, 1]]])
            reporter.progress(count / len(pairs))


def _verified(
    first: _Photo, second: _Photo, rows: np.ndarray, guide: Guide, reach_px: float, rng: np.random.Generator
) -> np.ndarray:
    """Those of the matches (K, 2) that agree on how the two photos are turned; none where so many may by chance."""
    baseline = second.centre - first.centre
    if len(rows) < _LEAST or np.linalg.norm(baseline) < _LEAST_BASELINE_M:
        return np.zeros(0, int)
    picks = rng.integers(0, len(rows), (_TRIALS, 3))
    agree = _agreeing(
        first.rays[rows[:, 0]],
        second.rays[rows[:, 1]],
        baseline / np.linalg.norm(baseline),
        guide.camera.fx,
        _TOLERANCE_PX,
        np.radians(2 * REACH_DEG),
        picks,
    )
    # Wrong matches lie anywhere in the reach, some of them near the line.
    chance = min(_TOLERANCE_PX / reach_px, 1.0) * len(rows)
    enough = max(_LEAST, chance + _CHANCE_SD * np.sqrt(chance))
    return np.flatnonzero(agree) if agree.sum() >= enough else np.zeros(0, int)


def _matches(first: _Photo, second: _Photo, ends: np.ndarray, reach_px: float) -> np.ndarray:
    """(K, 2) numbers in the order of cells, one to one."""
    best, distance = _search(
        ends,
        first.described,
        first.square,
        second.xy,
        second.described,
        second.square,
        second.starts,
        second.columns,
        second.rows,
        reach_px,
        _RATIO**2,
        MAX_SQUARED,
    )
    found = one_to_one(best, distance)
    return np.column_stack([found, best[found]])


@njit(nogil=True, cache=True)
def _dot(a, k, b, q):
    total = np.int32(0)
    for d in range(128):
        # Kept to 32 bits: sixteen products at once.
        total = np.int32(total + np.int32(np.int32(a[k, d]) * np.int32(b[q, d])))
    return total


@njit(nogil=True, cache=True)
def _search(ends, described, square, points, others, other_square, starts, columns, rows, reach, ratio2, limit):
    """Best feature of the other photo for each: its number or -1, and squared distance of the descriptors.

    ends: (K, 4) of :meth:`Guide.ends`. points, others, other_square, starts, columns, rows: the other photo's features
    in the order of cells.
    """
    count = len(ends)
    best = np.full(count, -1, np.int64)
    distance = np.full(count, limit, np.int64)
    for k in range(count):
        x0, y0, x1, y1 = ends[k, 0], ends[k, 1], ends[k, 2], ends[k, 3]
        if not (np.isfinite(x0) and np.isfinite(y0) and np.isfinite(x1) and np.isfinite(y1)):
            continue
        top, bottom = min(y0, y1) - reach, max(y0, y1) + reach
        if bottom < 0 or top >= rows * CELL_PX:
            continue
        dx, dy = x1 - x0, y1 - y0
        per_length2 = 1 / max(dx * dx + dy * dy, 1e-9)
        first, second, who = limit, limit, -1
        for r in range(max(int(top // CELL_PX), 0), min(int(bottom // CELL_PX), rows - 1) + 1):
            # The part of the line that is within reach of this row of cells.
            begin, end = 0.0, 1.0
            if abs(dy) > 1e-6:
                one, two = (r * CELL_PX - reach - y0) / dy, ((r + 1) * CELL_PX + reach - y0) / dy
                begin, end = max(min(one, two), 0.0), min(max(one, two), 1.0)
                if begin > end:
                    continue
            left, right = min(x0 + begin * dx, x0 + end * dx) - reach, max(x0 + begin * dx, x0 + end * dx) + reach
            if right < 0 or left >= columns * CELL_PX:
                continue
            c0, c1 = max(int(left // CELL_PX), 0), min(int(right // CELL_PX), columns - 1)
            for q in range(starts[r * columns + c0], starts[r * columns + c1 + 1]):
                u, v = points[q, 0] - x0, points[q, 1] - y0
                along = min(max((u * dx + v * dy) * per_length2, 0.0), 1.0)
                u -= along * dx
                v -= along * dy
                if u * u + v * v > reach * reach:
                    continue
                away = square[k] + other_square[q] - 2 * np.int64(_dot(described, k, others, q))
                if away < first:
                    first, second, who = away, first, q
                elif away < second:
                    second = away
        if who >= 0 and first < ratio2 * second:
            best[k] = who
            distance[k] = first
    return best, distance


@njit(nogil=True, cache=True)
def _agreeing(a, b, along, focal, tolerance, turn_sd, picks):
    """(K,) bool: matches that agree on one turn of the second photo against the first (RANSAC).

    With the positions known the epipolar constraint ``along . (a x (b + turn x b)) = 0`` is linear in the turn: three
    matches give it, held by what the gimbals say. The largest set is then fitted again, the direction ``along`` free
    within what the gimbals leave open.

    Args:
        a, b: (K, 3) unit rays of the two photos, world frame by gimbals. along: (3,) unit, from the first photo to the
            second. focal, tolerance: pixels. turn_sd: radians. picks: (T, 3) matches of each trial.
    """
    count = len(a)
    # Residual in pixels, and its derivatives by turn and by the direction.
    off, by = np.empty(count), np.empty((count, 6))
    for k in range(count):
        cross = np.cross(a[k], b[k])
        one, two = np.cross(along, a[k]), np.cross(along, b[k])
        scale = focal / np.sqrt(np.dot(one, one) + np.dot(two, two) + 1e-12)
        off[k] = scale * np.dot(along, cross)
        near, beside = np.dot(a[k], b[k]), np.dot(along, b[k])
        for d in range(3):
            by[k, d] = scale * (along[d] * near - a[k, d] * beside)
            by[k, 3 + d] = scale * cross[d]
    found, most = np.zeros(6), -1
    normal, right = np.empty((3, 3)), np.empty(3)
    for trial in range(len(picks)):
        for d in range(3):
            right[d] = 0.0
            for e in range(3):
                normal[d, e] = (tolerance / turn_sd) ** 2 if d == e else 0.0
        for pick in picks[trial]:
            for d in range(3):
                right[d] -= by[pick, d] * off[pick]
                for e in range(3):
                    normal[d, e] += by[pick, d] * by[pick, e]
        turn = np.linalg.solve(normal, right)
        agree = 0
        for k in range(count):
            agree += abs(off[k] + by[k, 0] * turn[0] + by[k, 1] * turn[1] + by[k, 2] * turn[2]) < tolerance
        if agree > most:
            most = agree
            found[:3] = turn
    near = np.abs(off + by @ found) < tolerance
    for _ in range(3):
        whole, pull = np.zeros((6, 6)), np.zeros(6)
        for d in range(6):
            whole[d, d] = (tolerance / (turn_sd if d < 3 else _ALONG_SD)) ** 2
        for k in range(count):
            if near[k]:
                for d in range(6):
                    pull[d] -= by[k, d] * off[k]
                    for e in range(6):
                        whole[d, e] += by[k, d] * by[k, e]
        near = np.abs(off + by @ np.linalg.solve(whole, pull)) < tolerance
    return near
