"""What each pixel of a simulated photo shows: shares of stem, foliage, other wood and ivy; the rest is ground."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from treedgs_geo.reconstruction.cameras import View

from .foliage import Material
from .world import World

#: Channels of a label image.
STEM, FOLIAGE, WOOD, IVY = range(4)


class Labels:
    """Collects what the rays of one photo meet, as its radiance is rendered (``looked`` of :func:`.render.radiance`).

    shares: (height, width, 4) uint8, the share of each pixel's rays that meet a stem, foliage (leaves, shrubs, grass),
    other wood (branches, sticks, logs) or the ivy on a stem first, of 255, in the order of :data:`STEM`,
    :data:`FOLIAGE`, :data:`WOOD`, :data:`IVY`.
    """

    def __init__(self, world: World, view: View, samples: int) -> None:
        stems = world.ground_faces
        faces = stems + world.stem_faces
        self._channel = np.full(faces + len(world.faces.kind) + 1, -1, np.int8)
        self._channel[stems:faces] = STEM
        kind = world.faces.kind
        self._channel[faces:-1] = np.select([kind == Material.WOOD, kind == Material.IVY], [WOOD, IVY], FOLIAGE)
        self._samples = samples
        self.shares = np.zeros((view.camera.height, view.camera.width, 4), np.uint8)

    def __call__(self, pixels: slice, distance: np.ndarray, primitive: np.ndarray) -> None:
        """What the rays of some pixels, row-major, meet: (N,) distance, inf = nothing, and (N,) primitive."""
        nothing = len(self._channel) - 1
        met = self._channel[np.where(np.isfinite(distance), primitive, nothing).astype(np.int64)]
        met = met.reshape(-1, self._samples)
        for k in (STEM, FOLIAGE, WOOD, IVY):
            self.shares.reshape(-1, 4)[pixels, k] = np.round(255 * (met == k).mean(axis=1))


def write_labels(path: Path, shares: np.ndarray) -> None:
    """One PNG whose red, green and blue are stem, foliage and other wood; where ivy is, it is transparent."""
    path.parent.mkdir(exist_ok=True)
    if not cv2.imwrite(str(path), np.dstack([shares[..., 2::-1], 255 - shares[..., IVY]])):
        raise OSError(f"{path}: the label image cannot be written.")


def read_labels(path: Path) -> np.ndarray:
    """(height, width, 4) uint8 of :func:`write_labels`."""
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None or image.ndim != 3 or image.shape[2] != 4:
        raise FileNotFoundError(f"{path}: no label image of red, green, blue and alpha can be read there.")
    return np.dstack([image[..., 2::-1], 255 - image[..., 3]])
