"""Features of photos, whatever finds them (:mod:`.sift`, :mod:`.xfeat`): which are kept, and where."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from ..core.errors import InputError
from ..core.files import atomic_path
from ..core.machine import free_memory
from ..core.progress import Reporter

#: Parts of a photo that get equal shares of the features, columns and rows.
PARTS = (8, 6)
#: Memory of one photo while its features are found, bytes a pixel.
_BYTES_A_PIXEL = 64
#: A match is believed when the second best is this much farther, as COLMAP's matcher does.
RATIO = 0.8


class PhotoFeatures(NamedTuple):
    """keypoints: (K, 2) float64 pixels, the first pixel's centre at 0.5, 0.5. described: (K, 128) uint8, whose squared
    distances are those of vectors of length 512. turned: (K,) float32 directions, radians from the first axis to the
    second, NaN where a feature has none. bright: (K,) bool, brighter than what is around."""

    keypoints: np.ndarray
    described: np.ndarray
    turned: np.ndarray
    bright: np.ndarray


#: Finds features in a grey photo (H, W) uint8: so many at most, where photos with a longer side than so many pixels are
#: reduced to it.
Finder = Callable[[np.ndarray, int, int], PhotoFeatures]


def clearest(xy: np.ndarray, value: np.ndarray, shape: tuple[int, ...], max_features: int) -> np.ndarray:
    """(K,) bool: at most so many of the places (K, 2) of a picture, the clearest by ``value`` of each part in turns, so
    that a photo full of leaves costs no more than another, and a weak part keeps what it has."""
    kept = np.zeros(len(value), bool)
    if len(value) <= max_features:
        return ~kept
    column, row = (np.clip((xy[:, k] * PARTS[k] / shape[1 - k]).astype(int), 0, PARTS[k] - 1) for k in range(2))
    part = row * PARTS[0] + column
    order = np.lexsort((-value, part))
    rank = np.empty(len(order), int)
    starts = np.searchsorted(part[order], np.arange(PARTS[0] * PARTS[1]))
    rank[order] = np.arange(len(order)) - starts[part[order]]
    kept[np.lexsort((-value, rank))[:max_features]] = True
    return kept


def extract(
    finder: Finder,
    paths: list[Path],
    max_features: int,
    max_px: int,
    threads: int,
    kept: Path,
    reporter: Reporter,
) -> list[PhotoFeatures]:
    """Features of photos, several photos at once as memory allows.

    max_features, max_px: as :data:`Finder` takes them. kept: folder with what an earlier run of the same finder has
    found already, made if missing.

    Raises:
        InputError: a photo cannot be decoded.
    """
    kept.mkdir(parents=True, exist_ok=True)

    def work(item: tuple[int, Path]) -> PhotoFeatures:
        number, path = item
        file = kept / f"{number}-{max_features}.npz"
        if file.exists():
            with np.load(file) as there:
                return PhotoFeatures(**there)
        found = finder(_grey(path), max_features, max_px)
        with atomic_path(file) as temporary, open(temporary, "wb") as target:
            np.savez(target, **found._asdict())
        return found

    room = free_memory() / (2 * _BYTES_A_PIXEL * max_px**2)
    features = []
    with ThreadPoolExecutor(max_workers=max(min(threads, int(room)), 1)) as workers:
        for each in workers.map(work, enumerate(paths)):
            features.append(each)
            reporter.progress(len(features) / len(paths))
    return features


def _grey(path: Path) -> np.ndarray:
    grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
    if grey is None:
        raise InputError(f"{path}: cannot be decoded as a photo; copy it again or remove it.")
    return grey


class FeatureStore:
    """Features and verified matches of N photos.

    keypoints: per photo (K, 2) float64 pixels. descriptors: per photo (K, 128) uint8. matches: (i, j) with i < j ->
    (M, 2) numbers of their keypoints. ratio: of descriptor distances, best to second best, that a match is believed at.
    """

    def __init__(self, own: list[PhotoFeatures], ratio: float = RATIO) -> None:
        self.own, self.ratio = own, ratio
        self.keypoints, self.descriptors = [each.keypoints for each in own], [each.described for each in own]
        self.matches: dict[tuple[int, int], np.ndarray] = {}
