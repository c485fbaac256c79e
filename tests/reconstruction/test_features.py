"""Own features: where a known warp puts them, how many, and the same on any number of threads."""

import cv2
import numpy as np
import pytest

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.reconstruction.matching import similar_pairs
from treedgs_geo.reconstruction.predicted_points import Features, kinds, one_to_one, search, squares
from treedgs_geo.reconstruction.sift import PARTS, SMALL_PHOTO_PX, FeatureStore, PhotoFeatures, extract, features_of


def texture(width: int = 640, height: int = 480, seed: int = 3) -> np.ndarray:
    """Noise of several sizes, (H, W) uint8."""
    rng = np.random.default_rng(seed)
    total = np.zeros((height, width), np.float32)
    for sigma in (1.5, 3.0, 6.0, 12.0):
        total += sigma * cv2.GaussianBlur(rng.normal(size=total.shape).astype(np.float32), (0, 0), sigma)
    return np.clip(128 + 40 * total / total.std(), 0, 255).astype(np.uint8)


def matched(one: PhotoFeatures, other: PhotoFeatures, expected: np.ndarray) -> np.ndarray:
    """(M, 2) numbers of features of both, looked for in the whole photo. expected: (K, 3) x, y, direction there."""
    photo = Features(other.keypoints, other.described, 1000, 1000, other.turned, other.bright)
    ends = np.hstack([expected[:, :2], expected[:, :2]])
    kind = kinds(expected[:, 2], one.bright)
    best, distance = search(ends, one.described, squares(one.described), photo, 60.0, 0.8, kind)
    found = one_to_one(best, distance)
    return np.column_stack([found, photo.order[best[found]]])


def test_features_lie_where_a_known_turn_and_scale_puts_them():
    image = texture()
    turn, scale = np.radians(25), 1.15
    matrix = scale * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    middle = np.array([image.shape[1] / 2, image.shape[0] / 2])
    shift = middle - matrix @ middle
    # Pixel centres at + 0.5: cv2 counts them from 0.
    shown = cv2.warpAffine(image, np.column_stack([matrix, shift + matrix @ [0.5, 0.5] - 0.5]), (640, 480))
    one, other = features_of(image, 3000), features_of(shown, 3000)
    places = one.keypoints @ matrix.T + shift
    rows = matched(one, other, np.column_stack([places, (one.turned + turn) % (2 * np.pi)]))
    off = np.linalg.norm(places[rows[:, 0]] - other.keypoints[rows[:, 1]], axis=1)
    assert len(rows) > 300
    assert (off < 1.0).mean() > 0.95
    assert np.median(off) < 0.2
    # The same matches are not found under another direction.
    wrong = matched(one, other, np.column_stack([places, (one.turned + turn + np.pi) % (2 * np.pi)]))
    assert len(wrong) < 0.1 * len(rows)


def test_the_clearest_of_each_part_are_described():
    image = texture()
    image[:, :320] = (0.35 * image[:, :320].astype(float) + 80).astype(np.uint8)  # a weak half
    everything, some = features_of(image, 100_000), features_of(image, 400)
    places = np.unique(some.keypoints.round(3), axis=0)
    assert len(places) <= 400 < len(everything.keypoints)
    column = (places[:, 0] * PARTS[0] / 640).astype(int)
    assert np.bincount(column, minlength=PARTS[0]).min() > 0.25 * 400 / PARTS[0]


def test_bright_and_dark_spots_have_their_sign():
    image = np.full((200, 300), 120, np.uint8)
    cv2.circle(image, (80, 100), 6, 220, -1)
    cv2.circle(image, (220, 100), 6, 20, -1)
    found = features_of(cv2.GaussianBlur(image, (0, 0), 1.0), 100)
    for x, bright in ((80.5, True), (220.5, False)):
        own = np.hypot(*(found.keypoints - [x, 100.5]).T) < 1
        assert own.any() and (found.bright[own] == bright).all()


def test_photos_of_one_scene_are_the_similar_pairs_and_the_largest_features_come_last():
    scenes = [texture(1000, 600, seed) for seed in (1, 2)]
    photos = [features_of(scenes[k % 2][20 * k :, 30 * k :][:400, :640], 3000) for k in range(8)]
    pairs = np.column_stack(np.triu_indices(8, 1))
    for threads in (1, 3):
        kept = similar_pairs(FeatureStore(photos), pairs, 3, threads)
        assert np.array_equal(kept, pairs[np.diff(pairs)[:, 0] % 2 == 0])
    image = np.full((200, 300), 120, np.uint8)
    cv2.circle(image, (80, 100), 12, 220, -1)
    cv2.circle(image, (220, 100), 3, 220, -1)
    found = features_of(cv2.GaussianBlur(image, (0, 0), 1.0), 100).keypoints
    assert np.hypot(*(found[-1] - [80.5, 100.5])) < 1 and (np.hypot(*(found - [220.5, 100.5]).T) < 1).any()


def test_small_and_large_photos_keep_their_pixels(tmp_path):
    image = texture(600, 400)
    path = tmp_path / "photo.png"
    cv2.imwrite(str(path), image)
    assert image.size < SMALL_PHOTO_PX
    spot = features_of(image, 5000).keypoints
    for largest in (4000, 300):
        (found,) = extract([path], 5000, largest, 1, tmp_path / f"kept-{largest}", Reporter())
        near = np.linalg.norm(found.keypoints[:, None] - spot[None], axis=2).min(axis=1)
        assert (near < 1.5).mean() > (0.2 if largest == 4000 else 0.4), largest
        assert (found.keypoints > 0).all() and (found.keypoints < [600, 400]).all()


def test_same_on_any_number_of_threads_and_kept(tmp_path):
    paths = []
    for number in range(5):
        paths.append(tmp_path / f"{number}.png")
        cv2.imwrite(str(paths[-1]), texture(1280, 960, number))
    one, four = (extract(paths, 1000, 4000, n, tmp_path / str(n), Reporter()) for n in (1, 4))
    for a, b in zip(one, four, strict=True):
        assert np.array_equal(a.keypoints, b.keypoints) and np.array_equal(a.described, b.described)
    for path in paths:
        path.unlink()
    again = extract(paths, 1000, 4000, 2, tmp_path / "1", Reporter())
    assert all(np.array_equal(a.described, b.described) for a, b in zip(one, again, strict=True))
    with pytest.raises(InputError, match="cannot be decoded"):
        extract(paths[:1], 1000, 4000, 1, tmp_path / "new", Reporter())
