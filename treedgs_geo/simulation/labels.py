"""What each pixel of a simulated photo shows: shares of stem, foliage and other wood; the rest is ground."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from ..reconstruction.cameras import View
from .foliage import Material
from .world import World

#: Channels of a label image.
STEM, FOLIAGE, WOOD = range(3)


class Labels:
    """Collects what the rays of one photo meet, as its radiance is rendered (``looked`` of :func:`.render.radiance`).

    shares: (height, width, 3) uint8, the share of each pixel's rays that meet a stem, foliage (leaves, shrubs, grass,
    ivy) or other wood (branches, sticks, logs) first, of 255, in the order of :data:`STEM`, :data:`FOLIAGE`,
    :data:`WOOD`.
    """

    def __init__(self, world: World, view: View, samples: int) -> None:
        stems = world.ground_faces
        faces = stems + world.stem_faces
        self._channel = np.full(faces + len(world.faces.kind) + 1, -1, np.int8)
        self._channel[stems:faces] = STEM
        self._channel[faces:-1] = np.where(world.faces.kind == Material.WOOD, WOOD, FOLIAGE)
        self._samples = samples
        self.shares = np.zeros((view.camera.height, view.camera.width, 3), np.uint8)

    def __call__(self, pixels: slice, distance: np.ndarray, primitive: np.ndarray) -> None:
        """What the rays of some pixels, row-major, meet: (N,) distance, inf = nothing, and (N,) primitive."""
        nothing = len(self._channel) - 1
        met = self._channel[np.where(np.isfinite(distance), primitive, nothing).astype(np.int64)]
        met = met.reshape(-1, self._samples)
        for k in (STEM, FOLIAGE, WOOD):
            self.shares.reshape(-1, 3)[pixels, k] = np.round(255 * (met == k).mean(axis=1))


def write_labels(path: Path, shares: np.ndarray) -> None:
    """One PNG whose red, green and blue are stem, foliage and other wood."""
    path.parent.mkdir(exist_ok=True)
    if not cv2.imwrite(str(path), shares[..., ::-1]):
        raise OSError(f"{path}: the label image cannot be written.")


def read_labels(path: Path) -> np.ndarray:
    """(height, width, 3) uint8 of :func:`write_labels`."""
    image = cv2.imread(str(path), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if image is None:
        raise FileNotFoundError(f"{path}: no label image can be read there.")
    return image[..., ::-1]
