"""Matching of photo pairs where geotags and gimbals say which part of the one can show a feature of the other, or,
from coarse to fine, where poses do that came from such matches.

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
from .predicted_points import Features, kinds, one_to_one, search
from .sift import FeatureStore

#: A gimbal's angles and their mounting, both photos', are believed to this, degrees.
REACH_DEG = 1.2
#: The same of poses that matches have made sure: 10 px of a narrow lens, for what moves and for a shutter that rolls.
FINE_REACH_DEG = 0.15
#: A match is believed when the second best in its reach is this much farther, as COLMAP's matcher does.
RATIO = 0.8
#: Matches that a verified pair has; so many standard deviations more than chance would give.
_LEAST, _CHANCE_SD = 15, 6.0
#: The direction of a feature in the other photo is that of a step of so many pixels along the ground.
_STEP_PX = 8.0
#: Verification: distance from the epipolar line, trials, and the least distance between two photos.
_TOLERANCE_PX, _TRIALS, _MIN_BASELINE_M = 4.0, 400, 0.3
#: The tolerance of a guide that is finer: a crown that moves stays nearer to its line than a wrong match, but not near.
FINE_TOLERANCE_PX = 2.0
#: How far the direction from one photo to the other may be off, as the first photo's rays have it (radians).
_ALONG_SD = 0.02


@dataclass(frozen=True)
class Guide:
    """What is known before features are matched. rotations (N, 3, 3), centres (N, 3): world -> camera by gimbals and
    geotags, local metres. low_m, high_m: between which heights features lie, local. reach_deg: (N,) how far a photo's
    direction may be off, ``None``: :data:`REACH_DEG` all. tolerance_px: of matches that agree on a turn."""

    rotations: np.ndarray
    centres: np.ndarray
    camera: Camera
    low_m: float
    high_m: float
    reach_deg: np.ndarray | None = None
    tolerance_px: float = _TOLERANCE_PX

    def finer(self, rotations: np.ndarray, centres: np.ndarray, camera: Camera, sure: np.ndarray) -> Guide:
        """The guide that a block gives. rotations (N, 3, 3), centres (N, 3), camera: of the block. sure: (N,) bool,
        whose poses are believed; the others stay as they were."""
        return Guide(
            np.where(sure[:, None, None], rotations, self.rotations),
            np.where(sure[:, None], centres, self.centres),
            camera,
            self.low_m,
            self.high_m,
            np.where(sure, FINE_REACH_DEG, REACH_DEG),
            FINE_TOLERANCE_PX,
        )

    def reach(self, i: int, j: int) -> float:
        """Of a pair of photos, radians."""
        return float(np.radians(REACH_DEG if self.reach_deg is None else max(self.reach_deg[i], self.reach_deg[j])))

    def view(self, j: int) -> View:
        """Photo j as gimbal and geotag have it."""
        rotation = self.rotations[j]
        return View(str(j), Path(), self.camera, rotation, -rotation @ self.centres[j])


@dataclass(frozen=True)
class _Photo:
    """One photo: rays (K, 3) of its features in the order of cells, world frame by its gimbal, and those of a step
    along their directions; bright (K,); where it stands, and its camera as a row (:func:`_lens_row`)."""

    features: Features
    rays: np.ndarray
    steps: np.ndarray
    bright: np.ndarray
    centre: np.ndarray
    row: np.ndarray

    @classmethod
    def of(cls, store: FeatureStore, guide: Guide, i: int) -> _Photo:
        """Photo i."""
        camera, own, view = guide.camera, store.own[i], guide.view(i)
        features = Features(own.keypoints, own.described, camera.width, camera.height, own.turned, own.bright)
        turned = own.turned[features.order]
        along = _STEP_PX * np.column_stack([np.cos(turned), np.sin(turned)])
        lens = [camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion]
        row = np.concatenate([view.rotation.ravel(), guide.centres[i], lens]).astype(float)
        rays, steps = view.rays(features.xy), view.rays(features.xy + along)
        return cls(features, rays, steps, own.bright[features.order], guide.centres[i], row)


def match_guided(
    store: FeatureStore, pairs: np.ndarray, guide: Guide, seed: int, threads: int, reporter: Reporter
) -> None:
    """Match photos and verify the matches, in place of ``store.matches``.

    pairs: (K, 2) numbers of photos.
    """
    store.matches = {}
    photos = {i: _Photo.of(store, guide, i) for i in np.unique(pairs).tolist()}

    def work(pair: np.ndarray) -> np.ndarray:
        i, j = pair.tolist()
        reach_px = float(np.tan(guide.reach(i, j)) * guide.camera.fx)
        first, second, one = photos[i], photos[j], photos[i].features
        ends, turned = _expected(first.rays, first.steps, first.centre, second.row, guide.low_m, guide.high_m)
        best, distance = search(
            ends, one.described, one.square, second.features, reach_px, RATIO, kinds(turned, first.bright)
        )
        found = one_to_one(best, distance)
        rows = np.column_stack([found, best[found]])
        rng = np.random.default_rng([seed, i, j])
        return rows[_verified(first, second, rows, guide, guide.reach(i, j), rng)]

    with ThreadPoolExecutor(max_workers=threads) as workers:
        for count, (pair, rows) in enumerate(zip(pairs, workers.map(work, pairs), strict=True)):
            if len(rows):
                i, j = pair.tolist()
                store.matches[i, j] = np.column_stack(
                    [photos[i].features.order[rows[:, 0]], photos[j].features.order[rows[:, 1]]]
                )
            reporter.progress(count / len(pairs))


def _verified(
    first: _Photo, second: _Photo, rows: np.ndarray, guide: Guide, reach: float, rng: np.random.Generator
) -> np.ndarray:
    """Those of the matches (K, 2) that agree on how the two photos are turned; none where so many may by chance."""
    baseline = second.centre - first.centre
    if len(rows) < _LEAST or np.linalg.norm(baseline) < _MIN_BASELINE_M:
        return np.zeros(0, int)
    picks = rng.integers(0, len(rows), (_TRIALS, 3))
    agree = _agreeing(
        first.rays[rows[:, 0]],
        second.rays[rows[:, 1]],
        baseline / np.linalg.norm(baseline),
        guide.camera.fx,
        guide.tolerance_px,
        2 * reach,
        picks,
    )
    # Wrong matches lie anywhere in the reach, some of them near the line.
    chance = min(guide.tolerance_px / (np.tan(reach) * guide.camera.fx), 1.0) * len(rows)
    enough = max(_LEAST, chance + _CHANCE_SD * np.sqrt(chance))
    return np.flatnonzero(agree) if agree.sum() >= enough else np.zeros(0, int)


@njit(inline="always", nogil=True)
def _shown(row, x, y, z):
    """Pixel of a point, local metres, in a photo (``_Photo.row``); NaN behind it."""
    dx, dy, dz = x - row[9], y - row[10], z - row[11]
    c = row[6] * dx + row[7] * dy + row[8] * dz
    if c <= 0.1:
        return np.nan, np.nan
    a, b = (row[0] * dx + row[1] * dy + row[2] * dz) / c, (row[3] * dx + row[4] * dy + row[5] * dz) / c
    r2 = a * a + b * b
    radial = 1 + r2 * (row[16] + r2 * (row[17] + r2 * row[20]))
    u = a * radial + 2 * row[18] * a * b + row[19] * (r2 + 2 * a * a)
    v = b * radial + row[18] * (r2 + 2 * b * b) + 2 * row[19] * a * b
    return row[12] * u + row[14], row[13] * v + row[15]


@njit(nogil=True, cache=True)
def _expected(rays, steps, centre, row, low, high):
    """Where the features of one photo lie in another when they are as high as may be and as low, (K, 4), NaN where it
    cannot show them; and their directions there, 0 to 2 pi, if they lie on the ground, (K,)."""
    ends, turned = np.full((len(rays), 4), np.nan), np.zeros(len(rays))
    for k in range(len(rays)):
        if rays[k, 2] > -0.05 or centre[2] <= high:
            continue
        for which, height in enumerate((high, low)):
            away = (height - centre[2]) / rays[k, 2]
            x, y = _shown(row, centre[0] + away * rays[k, 0], centre[1] + away * rays[k, 1], height)
            ends[k, 2 * which], ends[k, 2 * which + 1] = x, y
        away = (low - centre[2]) / steps[k, 2] if steps[k, 2] < 0 else np.nan
        x, y = _shown(row, centre[0] + away * steps[k, 0], centre[1] + away * steps[k, 1], low)
        turn = np.arctan2(y - ends[k, 3], x - ends[k, 2])
        turned[k] = turn % (2 * np.pi) if np.isfinite(turn) else 0.0
    return ends, turned


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
