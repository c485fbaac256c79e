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
from .guided import Features, one_to_one, search

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


@dataclass(frozen=True)
class _Photo:
    """One photo: rays (K, 3) of its features in the order of cells, world frame by its gimbal; where it stands."""

    features: Features
    rays: np.ndarray
    centre: np.ndarray

    @classmethod
    def of(cls, store: FeatureStore, guide: Guide, i: int) -> _Photo:
        """Photo i."""
        camera = guide.camera
        features = Features(store.keypoints[i], store.descriptors[i], camera.width, camera.height)
        return cls(features, guide.view(i).rays(features.xy), guide.centres[i])


def match_guided(
    store: FeatureStore, pairs: np.ndarray, guide: Guide, seed: int, threads: int, reporter: Reporter
) -> None:
    """Match photos and verify the matches, in place of ``store.matches``.

    pairs: (K, 2) numbers of photos.
    """
    store.matches = {}
    photos: dict[int, _Photo] = {}
    for i in np.unique(pairs).tolist():
        photos[i] = _Photo.of(store, guide, i)
    reach_px = float(np.tan(np.radians(REACH_DEG)) * guide.camera.fx)

    def work(pair: np.ndarray) -> np.ndarray:
        i, j = pair.tolist()
        one, other = photos[i].features, photos[j].features
        best, distance = search(guide.ends(i, j, one.xy), one.described, one.square, other, reach_px, _RATIO)
        found = one_to_one(best, distance)
        rows = np.column_stack([found, best[found]])
        return rows[_verified(photos[i], photos[j], rows, guide, reach_px, np.random.default_rng([seed, i, j]))]

    with ThreadPoolExecutor(max_workers=threads) as workers:
        for count, (pair, rows) in enumerate(zip(pairs, workers.map(work, pairs), strict=True)):
            if len(rows):
                i, j = pair.tolist()
                store.matches[i, j] = np.column_stack(
                    [photos[i].features.order[rows[:, 0]], photos[j].features.order[rows[:, 1]]]
                )
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
