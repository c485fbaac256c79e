"""Tying photos to a block by features where the geometry predicts them."""

from __future__ import annotations

import numpy as np
from scipy.special import bdtrc
from threadpoolctl import threadpool_limits

from ..core.machine import in_threads
from .adjustment import Known
from .cameras import Sensor
from .predicted_points import find_points, turn_to_points
from .sift import FeatureStore
from .tracks import Block, build_tracks, intersect, triangulate

#: A photo with fewer observations than this after the adjustment counts as not registered.
MIN_OBSERVATIONS = 12
#: The gimbal's angles are believed to this, degrees (half a degree stated; three times that and the yaw's compass).
GIMBAL_REACH_DEG = 1.5
#: Of descriptor distances, best to second best near where a point must be.
RATIO = 0.8
#: A photo is confirmed when of the features that look like a point of the other photos and lie within this of where it
#: must be, pixels, more lie so near to it than chance would put there but once in a million photos: some points are
#: there because the photo's own wrong matches chose them.
CONFIRMED_REACH_PX, CONFIRMED_PX, CONFIRMED_CHANCE = 40.0, 4.0, 1e-6
#: So many of a photo's points are asked first.
PROOF_POINTS = 100


def from_matches(
    store: FeatureStore, photos: np.ndarray, rotations: np.ndarray, translations: np.ndarray, sensor: Sensor
) -> Block:
    """Block of the verified matches between these photos; points not placed yet."""
    image, key, track = build_tracks(store.keypoints, store.matches, photos)
    return Block(
        sensor,
        rotations.copy(),
        translations.copy(),
        store.keypoints,
        np.zeros((int(track.max(initial=-1)) + 1, 3)),
        image,
        key,
        track,
    )


def resect(
    block: Block, store: FeatureStore, loose: np.ndarray, guess: np.ndarray, known: Known, rng: np.random.Generator
) -> np.ndarray:
    """Turn each loose photo, standing at its geotag, until known points fall on its features; returns who succeeded."""
    joined = np.zeros(len(loose), bool)
    focal = block.camera.fx
    for i in np.flatnonzero(loose).tolist():
        rotation, translation, inliers = guess[i], -guess[i] @ known.xyz[i], np.zeros(0, bool)
        # A strict ratio in the wide circle (few, mostly right), then a lax one in a narrow circle.
        for radius, ratio, tolerance_px, share in (
            (np.tan(np.radians(GIMBAL_REACH_DEG)) * focal, 0.75, 6.0, 0.3),
            (12.0, 0.75, 4.0, 0.2),
            (6.0, 0.75, 3.0, 0.4),
        ):
            point, key = find_points(block, store.descriptors, i, rotation, translation, radius, ratio)
            pixels = store.keypoints[i][key]
            rays = block.sensor.directions(pixels, i)
            tolerance = (tolerance_px + _slack_px(block, known, i)) / focal
            turned = turn_to_points(
                block.moved(i, block.points[point], pixels),
                rays,
                known.xyz[i],
                tolerance,
                rng,
                near=guess[i],
                max_turn_deg=2 * GIMBAL_REACH_DEG,
            )
            inliers = np.zeros(0, bool) if turned is None else turned[1]
            if turned is None or inliers.sum() < 6 or inliers.mean() < share:
                break
            rotation, translation = turned[0], -turned[0] @ known.xyz[i]
        else:
            if inliers.sum() >= MIN_OBSERVATIONS:
                joined[i] = True
                block.rotations[i], block.translations[i] = rotation, translation
                block.add(np.full(inliers.sum(), i), key[inliers], point[inliers])
    return joined


def _slack_px(block: Block, known: Known, i: int) -> float:
    """Pixels by which an uncertain position moves the picture, beyond what a rotation takes up."""
    distance = max(float(np.median(np.linalg.norm(block.points - known.xyz[i], axis=1))), 1.0)
    return min(0.5 * block.camera.fx * float(np.linalg.norm(known.sd[i])) / distance, 30.0)


def retriangulate(block: Block, store: FeatureStore) -> None:
    """Add the points that verified matches between posed photos give and the block does not have yet."""
    fresh = from_matches(store, block.is_posed, block.rotations, block.translations, block.sensor)
    taken = np.isin(_codes(fresh), _codes(block))
    # A track of which any keypoint is already known would only double it.
    known = np.zeros(len(fresh.points), bool)
    known[fresh.point[taken]] = True
    fresh.keep(~known[fresh.point])
    triangulate(fresh, 15.0)
    block.add(fresh.image, fresh.key, fresh.point + len(block.points))
    block.points = np.concatenate([block.points, fresh.points])


def _codes(block: Block) -> np.ndarray:
    return block.image.astype(np.int64) << 32 | block.key


def extend(block: Block, store: FeatureStore, radius_px: float) -> None:
    """Look for every point in every photo; join points that turn out to be the same feature.

    A point may be joined to another only if no photo sees both.
    """
    count = len(block.points)
    seen = np.zeros((len(block.keypoints), count), bool)
    seen[block.image, block.point] = True
    posed = np.flatnonzero(block.is_posed).tolist()

    def work(i: int) -> tuple[np.ndarray, np.ndarray]:
        return find_points(block, store.descriptors, i, block.rotations[i], block.translations[i], radius_px, RATIO)

    # Threads of BLAS would wait busily on the cores that these photos need.
    with threadpool_limits(1, "blas"):
        matches = list(in_threads(work, posed))
    point, key = (np.concatenate([match[k] for match in matches]) for k in (0, 1))
    image = np.repeat(posed, [len(found) for found, _ in matches])
    # The point that has the keypoint already, -1 for none.
    code, order = image << 32 | key, np.argsort(_codes(block))
    own = _codes(block)[order]
    place = np.searchsorted(own, code).clip(max=len(own) - 1)
    other = np.where(own[place] == code, block.point[order[place]], -1)
    new = ~seen[image, point]
    added, same = new & (other < 0), new & (other >= 0) & (other != point)
    block.add(image[added], key[added], point[added])
    seen[image[added], point[added]] = True
    target = np.arange(count)
    for a, b in zip(other[same].tolist(), point[same].tolist(), strict=True):
        while target[a] != a:
            a = target[a]
        while target[b] != b:
            b = target[b]
        if a != b and not (seen[:, a] & seen[:, b]).any():
            target[b] = a
            seen[:, a] |= seen[:, b]
    while (target[target] != target).any():
        target = target[target]
    block.point = target[block.point]
    # The same keypoint offered to two points: neither is sure of it.
    code = _codes(block)
    _, place, repeated = np.unique(code, return_inverse=True, return_counts=True)
    block.keep(repeated[place] == 1)


def confirmed(block: Block, store: FeatureStore) -> np.ndarray:
    """(N,) bool: posed photos that show points which other photos made where the block says that they are.

    Wrong matches that agree with each other turn a photo as they like, and its residuals are small; the points as the
    others alone have them tell; where most are right a part of them does.
    """
    rays, posed = block.rays(), np.flatnonzero(block.is_posed)
    shown = np.bincount(block.image, minlength=len(block.keypoints))

    def tells(i: int, each: int) -> bool:
        """Whether every ``each``-th point does."""
        some = np.arange(len(block.points)) % each == 0
        others = block.part(some)
        intersect(others, rays.of(some[block.point]).of(others.keep(others.image != i)))
        pose = block.rotations[i], block.translations[i]
        point, key = find_points(others, store.descriptors, i, *pose, CONFIRMED_REACH_PX, RATIO)
        off = np.linalg.norm(store.keypoints[i][key] - block.view(i).project(others.points[point])[0], axis=1)
        off = off[off < CONFIRMED_REACH_PX]
        chance = (CONFIRMED_PX / CONFIRMED_REACH_PX) ** 2
        return bool(bdtrc(np.sum(off < CONFIRMED_PX) - 1, len(off), chance) < CONFIRMED_CHANCE)

    def work(i: int) -> bool:
        few = max(shown[i] // PROOF_POINTS, 1)
        return tells(i, few) or (few > 1 and tells(i, 1))

    found = np.zeros(len(block.keypoints), bool)
    with threadpool_limits(1, "blas"):
        found[posed] = list(in_threads(work, posed.tolist()))
    return found
