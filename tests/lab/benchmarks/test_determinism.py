"""Same input and seed, same result, whatever the threads are up to."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pycolmap
import pytest

from treedgs_geo.core.errors import ReconstructionError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.reconstruction.cameras import Camera
from treedgs_geo.reconstruction.colmap_process import run_task
from treedgs_geo.reconstruction.matching import match_all, nearest
from treedgs_geo.reconstruction.sift import FeatureStore, extract

CAMERA = Camera(900, 900, 900.0, 900.0, 450.0, 450.0)


def photos(folder: Path, count: int = 8) -> list[str]:
    """Photos of very different cost, so that threads finish out of order: the first is by far the slowest; others show
    one scene, shifted."""
    rng = np.random.default_rng(0)
    scene = cv2.resize(rng.integers(0, 255, (160, 160, 3), dtype=np.uint8), (1000, 1000), interpolation=cv2.INTER_CUBIC)
    names = []
    for k in range(count):
        noise = rng.integers(0, 255, (450, 450, 3), dtype=np.uint8)
        image = scene[5 * k :, 7 * k :][:900, :900] if k else cv2.resize(noise, (900, 900))
        names.append(f"{k:02d}.png")
        cv2.imwrite(str(folder / names[-1]), image)
    return names


def matched(folder: Path, names: list[str], threads: int) -> tuple[FeatureStore, Path]:
    """Features and matches, and the database for the mapper."""
    work = folder / f"work-{threads}"
    store = FeatureStore(extract([folder / name for name in names], 1500, 1000, threads, work, Reporter()))
    pairs = np.array([(i, j) for i in range(len(names)) for j in range(i + 1, len(names))])
    match_all(store, names, pairs, CAMERA, work / "matches.db", 1, threads, Reporter())
    return store, work / "matches.db"


def test_matches_repeat_on_any_number_of_threads_and_reach_the_mapper(tmp_path):
    names = photos(tmp_path)
    (one, database), (other, _) = matched(tmp_path, names, 4), matched(tmp_path, names, 1)
    assert one.matches.keys() == other.matches.keys() and len(one.matches) == 21  # all but those of the first
    assert all(np.array_equal(rows, other.matches[pair]) for pair, rows in one.matches.items())
    moved = one.keypoints[1][one.matches[1, 3][:, 0]] - one.keypoints[3][one.matches[1, 3][:, 1]]
    assert np.median(moved, axis=0) == pytest.approx([14, 10], abs=0.1)
    kept = pycolmap.Database.open(str(database))
    assert [image.name for image in kept.read_all_images()] == names and kept.num_verified_image_pairs() == 21
    assert np.array_equal(kept.read_two_view_geometry(2, 4).inlier_matches, one.matches[1, 3])
    kept.close()


def test_the_nearest_descriptors_are_those_of_every_distance():
    rng = np.random.default_rng(3)
    one, other = (rng.integers(0, 60, (count, 128), dtype=np.uint8) for count in (1500, 900))
    other[:200] = np.clip(one[1100:1300].astype(int) + rng.integers(-2, 3, (200, 128)), 0, 255)
    assert nearest(one, other).tolist() == [[1100 + k, k] for k in range(200)]
    assert nearest(one, other[:1]).shape == nearest(one[:0], other).shape == (0, 2)


def test_a_crashed_process_is_reported(tmp_path):
    with pytest.raises(ReconstructionError, match="'map_global' of structure from motion stopped"):
        run_task("map_global", {"database": str(tmp_path / "no" / "such.db")}, tmp_path)
