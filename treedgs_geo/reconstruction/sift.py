"""Own SIFT features (Lowe 2004, "Distinctive image features from scale-invariant keypoints"), for the guided level.

As COLMAP's: first octave at the photo's own size, root descriptors. Of the extrema those are described that are the
clearest of their part of the photo, so that a photo full of leaves costs no more than another, and a weak one keeps
what it has.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from ..core.errors import InputError
from ..core.files import atomic_path
from ..core.machine import free_memory
from ..core.progress import Reporter
from . import sift_kernels as kernels
from .sift_kernels import LEVELS

#: Photos with fewer pixels are doubled: at their own size they give too few features.
SMALL_PHOTO_PX = 900_000
#: Scale of the first Gaussian of an octave, and what a photo has by itself, pixels.
SIGMA, OWN_SIGMA = 1.6, 0.5
#: Octaves; least contrast of an extremum, grey values; most ratio of its curvatures. As COLMAP's with 0.0067.
OCTAVES, MIN_CONTRAST, MAX_EDGE = 4, 1.7, 10.0
#: Parts of a photo that get equal shares of the features, columns and rows.
PARTS = (8, 6)
#: Memory of one photo's octave, bytes a pixel.
_BYTES_A_PIXEL = 64
_SMALLEST_PX = 32


class PhotoFeatures(NamedTuple):
    """keypoints: (K, 2) float64 pixels, the first pixel's centre at 0.5, 0.5. described: (K, 128) uint8. turned: (K,)
    float32 directions, radians from the first axis to the second. bright: (K,) bool, brighter than what is around. In
    the order of their scale, the largest last."""

    keypoints: np.ndarray
    described: np.ndarray
    turned: np.ndarray
    bright: np.ndarray


def features_of(grey: np.ndarray, most: int, own_sigma: float = OWN_SIGMA) -> PhotoFeatures:
    """Features of a grey photo (H, W) uint8. most: places described; one with two orientations counts once. own_sigma:
    how blurred the photo is, pixels."""
    octaves = []
    for octave, layers, gaussians in _octaves(grey.astype(np.float32), own_sigma):
        found = np.empty((layers[0].size // 12 + 64, 5), np.float32)
        count = kernels.extrema(layers, MIN_CONTRAST, MAX_EDGE, found)
        octaves.append((octave, found[:count], gaussians))
    chosen = _chosen([(octave, found) for octave, found, _ in octaves], grey.shape, most)
    decay = np.exp(-np.arange(16 * 16) / 16).astype(np.float32)
    parts = [PhotoFeatures(np.empty((0, 2)), np.empty((0, 128), np.uint8), np.empty(0, np.float32), np.empty(0, bool))]
    for (octave, found, gaussians), own in zip(octaves, chosen, strict=True):
        size, turn = np.zeros(gaussians.shape[1:], np.float32), np.zeros(gaussians.shape[1:], np.float32)
        for level in range(1, LEVELS + 1):
            rows = found[own & (found[:, 4] == level)]
            if not len(rows):
                continue
            kernels.gradients(gaussians[level], size, turn)
            most_rows = 2 * len(rows)
            kept, turned = np.empty(most_rows, np.int64), np.empty(most_rows, np.float32)
            out = np.empty((most_rows, 128), np.uint8)
            places = np.ascontiguousarray(rows[:, :3])
            count = kernels.describe_level(size, turn, places, SIGMA, decay, kept, turned, out)
            kept = kept[:count]
            # A difference of Gaussians is low where the photo is bright.
            bright = rows[kept, 3] < 0
            keypoints = rows[kept, :2].astype(float) * 2**octave + 0.5
            parts.append(PhotoFeatures(keypoints, out[:count], turned[:count], bright))
    return PhotoFeatures(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def _octaves(image: np.ndarray, own_sigma: float) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Number, differences and Gaussians of each octave."""
    sigmas = SIGMA * 2 ** (np.arange(LEVELS + 3) / LEVELS)
    steps = np.sqrt(np.diff(sigmas**2))
    base = cv2.GaussianBlur(image, (0, 0), float(np.sqrt(SIGMA**2 - own_sigma**2)))
    for octave in range(OCTAVES):
        if min(base.shape) < _SMALLEST_PX:
            return
        gaussians = np.empty((LEVELS + 3, *base.shape), np.float32)
        gaussians[0] = base
        for level, step in enumerate(steps, start=1):
            cv2.GaussianBlur(gaussians[level - 1], (0, 0), float(step), dst=gaussians[level])
        yield octave, np.diff(gaussians, axis=0), gaussians
        base = np.ascontiguousarray(gaussians[LEVELS, ::2, ::2])


def _chosen(octaves: list[tuple[int, np.ndarray]], shape: tuple[int, ...], most: int) -> list[np.ndarray]:
    """By octave which of its extrema (N, 5) are described: the clearest of each part of the photo, in turns."""
    xy = np.vstack([found[:, :2] * 2**octave for octave, found in octaves])
    value = np.abs(np.concatenate([found[:, 3] for _, found in octaves]))
    if len(value) <= most:
        return [np.ones(len(found), bool) for _, found in octaves]
    column, row = (np.clip((xy[:, k] * PARTS[k] / shape[1 - k]).astype(int), 0, PARTS[k] - 1) for k in range(2))
    part = row * PARTS[0] + column
    order = np.lexsort((-value, part))
    rank = np.empty(len(order), int)
    starts = np.searchsorted(part[order], np.arange(PARTS[0] * PARTS[1]))
    rank[order] = np.arange(len(order)) - starts[part[order]]
    kept = np.zeros(len(order), bool)
    kept[np.lexsort((-value, rank))[:most]] = True
    return np.split(kept, np.cumsum([len(found) for _, found in octaves])[:-1])


def extract(
    paths: list[Path], most: int, largest_px: int, threads: int, kept: Path, reporter: Reporter
) -> list[PhotoFeatures]:
    """Features of photos, several photos at once as memory allows.

    most: places described in a photo. largest_px: photos with a longer side are reduced to it. kept: folder with what
    an earlier run has found already, made if missing.

    Raises:
        InputError: a photo cannot be decoded.
    """
    kept.mkdir(parents=True, exist_ok=True)

    def work(item: tuple[int, Path]) -> PhotoFeatures:
        number, path = item
        file = kept / f"{number}-{most}.npz"
        if file.exists():
            with np.load(file) as there:
                return PhotoFeatures(**there)
        found = _of_file(path, most, largest_px)
        with atomic_path(file) as temporary, open(temporary, "wb") as target:
            np.savez(target, **found._asdict())
        return found

    room = free_memory() / (2 * _BYTES_A_PIXEL * largest_px**2)
    features = []
    with ThreadPoolExecutor(max_workers=max(min(threads, int(room)), 1)) as workers:
        for each in workers.map(work, enumerate(paths)):
            features.append(each)
            reporter.progress(len(features) / len(paths))
    return features


def _of_file(path: Path, most: int, largest_px: int) -> PhotoFeatures:
    grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
    if grey is None:
        raise InputError(f"{path}: cannot be decoded as a photo; copy it again or remove it.")
    height, width = grey.shape
    factor = min(largest_px / max(height, width), 2.0 if height * width < SMALL_PHOTO_PX else 1.0)
    if factor == 1:
        return features_of(grey, most)
    how = cv2.INTER_AREA if factor < 1 else cv2.INTER_LINEAR
    resized = cv2.resize(grey, (round(width * factor), round(height * factor)), interpolation=how)
    found = features_of(resized, most, max(factor, 1.0) * OWN_SIGMA)
    back = np.array([width / resized.shape[1], height / resized.shape[0]])
    return found._replace(keypoints=found.keypoints * back)


class FeatureStore:
    """Features and verified matches of N photos.

    keypoints: per photo (K, 2) float64 pixels. descriptors: per photo (K, 128) uint8. matches: (i, j) with i < j ->
    (M, 2) numbers of their keypoints.
    """

    def __init__(self, own: list[PhotoFeatures]) -> None:
        self.own = own
        self.keypoints, self.descriptors = [each.keypoints for each in own], [each.described for each in own]
        self.matches: dict[tuple[int, int], np.ndarray] = {}

    def with_places(self, photos: list[int], pixels: list[np.ndarray]) -> np.ndarray:
        """Places (K, 2) in photos that were found otherwise, in place of those of before; their numbers, one photo
        after the other. Their descriptors are all zero, far from any feature's."""
        numbers = []
        for i, places in zip(photos, pixels, strict=True):
            own = self.own[i]
            self.keypoints[i] = np.concatenate([own.keypoints, places])
            self.descriptors[i] = np.concatenate([own.described, np.zeros((len(places), 128), np.uint8)])
            numbers.append(len(own.keypoints) + np.arange(len(places)))
        return np.concatenate(numbers)
