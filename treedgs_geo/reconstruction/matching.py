"""Matching of photo pairs where nothing says where to look: every feature of the one with every feature of the other.

Squared distances of whole numbers below 2^24 are exact in float32, whatever the order of their sums: the matches repeat
to the bit on any number of threads.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from ..core.progress import Reporter
from .cameras import Camera
from .colmap import camera_to_colmap
from .guided_matching import RATIO
from .sift import FeatureStore

#: Features of the largest scale of each photo that tell which photos are alike, and the ratio of their matches: among
#: so few a looser one lets chance decide. Of all verified matches of 31 photos above a stand 91 % are in the 45 % of
#: the pairs chosen so, 77 % by a ratio of 0.8, and half by 100 features of which four match, as Wu has them.
FIRST_FEATURES, FIRST_RATIO = 800, 0.7
#: Rows of a table of distances at once: 30 MB of 8,000 features.
_ROWS = 1024


def match_all(
    store: FeatureStore,
    names: list[str],
    pairs: np.ndarray,
    camera: Camera,
    database: Path,
    seed: int,
    threads: int,
    reporter: Reporter,
) -> None:
    """Match photos and verify the matches, in place of ``store.matches``; both go into ``database`` for a mapper.

    pairs: (K, 2) numbers of photos in ``names``.
    """
    import pycolmap

    options, lens = pycolmap.TwoViewGeometryOptions(), camera_to_colmap(camera)
    options.ransac.random_seed = seed
    geometries: dict[tuple[int, int], Any] = {}

    def work(pair: np.ndarray) -> Any:
        i, j = pair.tolist()
        rows = nearest(store.descriptors[i], store.descriptors[j]).astype(np.uint32)
        return pycolmap.estimate_two_view_geometry(lens, store.keypoints[i], lens, store.keypoints[j], rows, options)

    with threadpool_limits(1, "blas"), ThreadPoolExecutor(max_workers=threads) as workers:
        for count, (pair, geometry) in enumerate(zip(pairs.tolist(), workers.map(work, pairs), strict=True)):
            if len(geometry.inlier_matches):
                geometries[pair[0], pair[1]] = geometry
            reporter.progress(count / len(pairs))
    store.matches = {pair: np.asarray(each.inlier_matches, np.int64) for pair, each in geometries.items()}
    _write(database, store, names, lens, geometries)


def similar_pairs(store: FeatureStore, pairs: np.ndarray, neighbours: int, threads: int) -> np.ndarray:
    """Those of the pairs (K, 2) that are, for one of their photos, among so many whose features of the largest scale
    match most (Wu 2013, "Towards linear-time incremental structure from motion", preemptive matching)."""
    first = [each[-FIRST_FEATURES:] for each in store.descriptors]
    table, (i, j) = np.full((len(first), len(first)), -1), pairs.T
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(max_workers=threads) as workers:
        found = workers.map(lambda pair: len(nearest(first[pair[0]], first[pair[1]], FIRST_RATIO)), pairs.tolist())
        table[i, j] = table[j, i] = list(found)
    rank = np.argsort(np.argsort(-table, axis=1, kind="stable"), axis=1)
    return pairs[np.minimum(rank[i, j], rank[j, i]) < neighbours]


def nearest(one: np.ndarray, other: np.ndarray, ratio: float = RATIO) -> np.ndarray:
    """(M, 2) numbers of descriptors (K, 128), (L, 128) uint8 that are each other's nearest, with the second nearest
    clearly farther."""
    if len(one) < 2 or len(other) < 2:
        return np.zeros((0, 2), int)
    best, clear = _nearest_of(one, other, ratio)
    kept = np.flatnonzero(clear)
    back, _ = _nearest_of(other[best[kept]], one, ratio)
    kept = kept[back == kept]
    return np.column_stack([kept, best[kept]])


def _nearest_of(one: np.ndarray, other: np.ndarray, ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """By descriptor of the one (K,) the number of its nearest among the others, and whether the second is farther."""
    a, b = one.astype(np.float32), other.astype(np.float32)
    length_a, length_b = (np.einsum("kd,kd->k", each, each) for each in (a, b))
    best, clear, twice = np.empty(len(a), int), np.empty(len(a), bool), -2 * b.T
    for start in range(0, len(a), _ROWS):
        here = slice(start, start + _ROWS)
        square = a[here] @ twice
        square += length_b
        best[here] = square.argmin(axis=1)
        rows = np.arange(len(square))
        first = square[rows, best[here]]
        square[rows, best[here]] = np.inf
        clear[here] = first + length_a[here] < ratio**2 * (square.min(axis=1) + length_a[here])
    return best, clear


def _write(database: Path, store: FeatureStore, names: list[str], lens: Any, geometries: dict) -> None:
    """A new database with keypoints and verified matches; photo i of ``names`` has the number i + 1."""
    import pycolmap

    database.unlink(missing_ok=True)
    into = pycolmap.Database.open(str(database))
    try:
        into.write_camera(lens, True)
        rig = pycolmap.Rig(rig_id=1)
        rig.add_ref_sensor(lens.sensor_id)
        into.write_rig(rig, True)
        for number, (name, keypoints) in enumerate(zip(names, store.keypoints, strict=True), start=1):
            image = pycolmap.Image(name=name, camera_id=lens.camera_id, image_id=number)
            frame = pycolmap.Frame(frame_id=number, rig_id=1)
            frame.add_data_id(image.data_id)
            into.write_image(image, True)
            into.write_frame(frame, True)
            into.write_keypoints(number, keypoints.astype(np.float32))
        for (i, j), geometry in geometries.items():
            into.write_two_view_geometry(i + 1, j + 1, geometry)
    finally:
        into.close()
