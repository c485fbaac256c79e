"""Random draws that belong to one thing (a tree, a stem) and to nothing else in the run."""

from __future__ import annotations

import hashlib

import numpy as np

_MASK = 2**64 - 1


def own_seed(seed: int, *arrays: np.ndarray) -> int:
    """A seed, 0 to 2**64 - 1, made of the run's seed and of the numbers in ``arrays``.

    The same tree draws the same numbers alone, among others, in any order of the trees and under any id; another seed
    of the run gives another draw.
    """
    digest = hashlib.blake2b(int(seed).to_bytes(16, "little", signed=True), digest_size=8)
    for array in arrays:
        # + 0.0 turns -0.0, which is the same number in other bytes, into 0.0.
        digest.update(np.ascontiguousarray(np.asarray(array, float) + 0.0).tobytes())
    return int.from_bytes(digest.digest(), "little")


def stream(seed: int, number: int) -> int:
    """The ``number``-th seed after ``seed``, 0 to 2**64 - 1: one a slice, one a part."""
    return (seed * 1000003 + number) & _MASK


def own_order(points: np.ndarray, *values: np.ndarray) -> np.ndarray:
    """(N,) indices that sort (N, D) points by their coordinates, ties by the (N,) ``values``: what is drawn by index
    is then the same points, in whatever order a file holds them."""
    return np.lexsort([*reversed(values), *points.T])
