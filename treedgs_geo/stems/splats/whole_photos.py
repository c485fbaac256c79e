"""Whole photos without lens distortion, for fits of a whole scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from ...reconstruction.cameras import View
from .bands import read_photo
from .crops import cut_out
from .project import CropCamera


@dataclass(frozen=True)
class WholePhotos:
    """cameras: pinhole, one a photo. images: (H, W, 3) uint8 RGB. inside: (H, W) float32, 0 where the photo has no
    pixel once its distortion is taken out."""

    cameras: list[CropCamera]
    images: list[np.ndarray]
    inside: list[np.ndarray]

    @classmethod
    def load(cls, views: Sequence[View], factor: float = 1.0) -> WholePhotos:
        """The views' photos, at ``factor`` times their size (held in memory at that size)."""
        found = cls([], [], [])
        for view in views:
            c = view.camera
            camera = CropCamera(c.width, c.height, c.fx, c.fy, c.cx, c.cy, view.rotation, view.translation)
            image, inside = cut_out(read_photo(view), view, camera)
            found.cameras.append(camera.scaled(factor))
            found.images.append(_reduced(image, found.cameras[-1]))
            found.inside.append(_reduced(inside, found.cameras[-1]))
        return found

    def __len__(self) -> int:
        return len(self.cameras)

    def at(self, k: int, factor: float) -> tuple[CropCamera, np.ndarray, np.ndarray]:
        """Camera, (h, w, 3) float32 picture 0..1 and (h, w) weight of a photo at ``factor`` times the size held."""
        camera = self.cameras[k].scaled(factor)
        image = _reduced(self.images[k], camera).astype(np.float32) / np.float32(255)
        return camera, image, _reduced(self.inside[k], camera)


def _reduced(picture: np.ndarray, camera: CropCamera) -> np.ndarray:
    if picture.shape[:2] == (camera.height, camera.width):
        return picture
    return cv2.resize(picture, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
