"""Matching of photo pairs where geotags and gimbals say which part of the one can show a feature of the other, or,
from coarse to fine, where poses do that came from such matches.

Flat ground and the tops of the crowns bound where along its ray a feature may lie; half a degree of gimbal error and
what the mounting adds bound how far beside. Among the few features there a descriptor has little to decide: more right
matches than a search through the whole photo, in a tenth of the time. What the matches are worth is verified as theirs.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from ..core.machine import in_threads
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
#: How far the direction from one photo to the other may be off at least, and at most where geotags hardly tell it, as
#: the first photo's rays have it (radians).
_ALONG_SD, _MAX_ALONG_SD = 0.02, 1.0


@dataclass(frozen=True)
class Guide:
    """What is known before features are matched. rotations (N, 3, 3), centres (N, 3): world -> camera by gimbals and
    geotags, local metres. low_m, high_m: between which heights features lie, local. reach_deg: (N,) how far a photo's
    direction may be off, ``None``: :data:`REACH_DEG` all. tolerance_px: of matches that agree on a turn. baseline_sd_m:
    standard error of the way from one photo to another, across."""

    rotations: np.ndarray
    centres: np.ndarray
    camera: Camera
    low_m: float
    high_m: float
    reach_deg: np.ndarray | None = None
    tolerance_px: float = _TOLERANCE_PX
    baseline_sd_m: float = 0.0

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
        turn = np.radians(max(self.reaches_deg[i], self.reaches_deg[j]))
        return float(max(turn, 2 * self.baseline_sd_m / max(self.centres[i, 2] - self.low_m, 1.0)))

    @property
    def reaches_deg(self) -> np.ndarray:
        """(N,) ``reach_deg``."""
        return np.full(len(self.centres), REACH_DEG) if self.reach_deg is None else self.reach_deg

    def more_than_chance(self, i: int, j: int, candidates: int) -> float:
        """Matches of so many candidates of a pair that agree by chance (wrong ones lie anywhere in the reach), and
        ``_CHANCE_SD`` standard deviations more."""
        chance = min(self.tolerance_px / (np.tan(self.reach(i, j)) * self.camera.fx), 1.0) * candidates
        return float(chance + _CHANCE_SD * np.sqrt(chance))

    def view(self, j: int) -> View:
        """Photo j as gimbal and geotag have it."""
        rotation = self.rotations[j]
        return View(str(j), Path(), self.camera, rotation, -rotation @ self.centres[j])


class _Photo(NamedTuple):
    """One photo as gimbal and geotag have it (``view``), its features in the order of cells. rays: (K, 3) of them,
    world frame. places: (K, 3) each, local metres, NaN unknown: where they lie if they are as high as may be, and as
    low, and those of a step along their directions if low."""

    view: View
    features: Features
    rays: np.ndarray
    bright: np.ndarray
    places: tuple[np.ndarray, np.ndarray, np.ndarray]

    @classmethod
    def of(cls, store: FeatureStore, guide: Guide, i: int) -> _Photo:
        """Photo i."""
        camera, own, view, centre = guide.camera, store.own[i], guide.view(i), guide.centres[i]
        features = Features(own.keypoints, own.described, camera.width, camera.height, own.turned, own.bright)
        turned = own.turned[features.order]
        along = _STEP_PX * np.column_stack([np.cos(turned), np.sin(turned)])
        rays, steps = view.rays(features.xy), view.rays(features.xy + along)
        looks_down = (rays[:, 2:] <= -0.05) & (centre[2] > guide.high_m)
        down, step_down = np.where(looks_down, rays[:, 2:], np.nan), np.where(steps[:, 2:] < 0, steps[:, 2:], np.nan)
        high, low = (centre + (height - centre[2]) / down * rays for height in (guide.high_m, guide.low_m))
        ahead = centre + (guide.low_m - centre[2]) / step_down * steps
        return cls(view, features, rays, own.bright[features.order], (high, low, ahead))


def match_guided(
    store: FeatureStore, pairs: np.ndarray, guide: Guide, seed: int, threads: int, reporter: Reporter
) -> None:
    """Match photos and verify the matches pair by pair, in place of ``store.matches``.

    pairs: (K, 2) numbers of photos.
    """
    used = np.unique(pairs).tolist()
    photos = dict(zip(used, in_threads(partial(_Photo.of, store, guide), used), strict=True))

    def work(pair: np.ndarray) -> np.ndarray:
        i, j = pair.tolist()
        reach_px = float(np.tan(guide.reach(i, j)) * guide.camera.fx)
        first, second, one = photos[i], photos[j], photos[i].features
        # Where they lie in the other photo, and which way their directions point there.
        high, low, ahead = (second.view.project(places)[0] for places in first.places)
        ends, turned = np.hstack([high, low]), np.arctan2(*(ahead - low).T[::-1]) % (2 * np.pi)
        best, distance = search(
            ends, one.described, one.square, second.features, reach_px, RATIO, kinds(turned, first.bright)
        )
        found = one_to_one(best, distance)
        rows = np.column_stack([found, best[found]])
        rows = rows[_verified(first, second, rows, guide, guide.reach(i, j), np.random.default_rng([seed, i, j]))]
        # As the store numbers features.
        return np.column_stack([one.order[rows[:, 0]], second.features.order[rows[:, 1]]])

    store.matches = {}
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(max_workers=threads) as workers:
        for count, (pair, rows) in enumerate(zip(pairs, workers.map(work, pairs), strict=True)):
            if len(rows):
                store.matches[pair[0].item(), pair[1].item()] = rows
            reporter.progress(count / len(pairs))


def _verified(
    first: _Photo, second: _Photo, rows: np.ndarray, guide: Guide, reach: float, rng: np.random.Generator
) -> np.ndarray:
    """Those of the matches (K, 2) that agree on how the two photos are turned; none where so many may by chance."""
    baseline = second.view.centre - first.view.centre
    if len(rows) < _LEAST or np.linalg.norm(baseline) < _MIN_BASELINE_M:
        return np.zeros(0, int)
    along_sd = float(np.clip(guide.baseline_sd_m / np.linalg.norm(baseline), _ALONG_SD, _MAX_ALONG_SD))
    # Matches that tell the turn, or where geotags do not tell it the direction, too.
    picks = rng.integers(0, len(rows), (_TRIALS, 3 if along_sd == _ALONG_SD else 5))
    agree = _agreeing(
        first.rays[rows[:, 0]],
        second.rays[rows[:, 1]],
        baseline / np.linalg.norm(baseline),
        guide.camera.fx,
        guide.tolerance_px,
        2 * reach,
        along_sd,
        picks,
    )
    i, j = int(first.view.name), int(second.view.name)
    enough = max(_LEAST, guide.more_than_chance(i, j, len(rows)))
    return np.flatnonzero(agree) if agree.sum() >= enough else np.zeros(0, int)


def line_scale(a: np.ndarray, b: np.ndarray, along: np.ndarray, focal: float) -> np.ndarray:
    """(K,) pixels that ``along . (a x b)`` of matches is worth: how far they are from their epipolar lines.

    a, b: (K, 3) unit rays of the two photos, world frame. along: (3,) unit, from the first to the second. focal: px.
    """
    return focal / np.sqrt(sum(np.sum(np.cross(along, each) ** 2, axis=1) for each in (a, b)) + 1e-12)


def _agreeing(
    a: np.ndarray,
    b: np.ndarray,
    along: np.ndarray,
    focal: float,
    tolerance: float,
    turn_sd: float,
    along_sd: float,
    picks: np.ndarray,
) -> np.ndarray:
    """(K,) bool: matches that agree on one turn of the second photo against the first (RANSAC).

    With the positions known the epipolar constraint ``along . (a x (b + turn x b)) = 0`` is linear in the turn: three
    matches give it (five the direction ``along``, too), held by what gimbals and geotags say. The largest set is then
    fitted again, the direction free within what they leave open.

    Args:
        a, b: (K, 3) unit rays of the two photos, world frame by gimbals. along: (3,) unit, from the first photo to the
            second. focal, tolerance: pixels. turn_sd, along_sd: standard errors, radians.
        picks: (T, 3 or 5) matches of each trial.
    """
    # Residual in pixels, and its derivatives by turn and by the direction.
    cross, scale = np.cross(a, b), line_scale(a, b, along, focal)
    off = scale * (cross @ along)
    by_turn = along * np.sum(a * b, axis=1)[:, None] - a * (b @ along)[:, None]
    # Only across: along itself the way between the photos would shrink to nothing, with which every match agrees.
    by = scale[:, None] * np.hstack([by_turn, cross - np.outer(cross @ along, along)])
    unknowns = 3 if picks.shape[1] == 3 else 6
    rows, held = by[picks, :unknowns], (tolerance / np.repeat([turn_sd, along_sd], 3)) ** 2
    normal = rows.transpose(0, 2, 1) @ rows + np.diag(held[:unknowns])
    turns = np.linalg.solve(normal, -rows.transpose(0, 2, 1) @ off[picks][:, :, None])[:, :, 0]
    agree = np.abs(off + turns @ by[:, :unknowns].T) < tolerance
    near = agree[agree.sum(axis=1).argmax()]
    for _ in range(3):
        found = np.linalg.solve(by[near].T @ by[near] + np.diag(held), -by[near].T @ off[near])
        near = np.abs(off + by @ found) < tolerance
    return near
