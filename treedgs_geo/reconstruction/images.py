"""Photos as arrays: loading, undistorting, pinhole crops. Pixel convention as in :mod:`.cameras`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from ..core.errors import InputError
from .cameras import Camera, View

#: How a photo is read at a share of its size: JPEG decoders take the less time the smaller it is.
_READ = {1: cv2.IMREAD_COLOR, 4: cv2.IMREAD_REDUCED_COLOR_4}


def load_image(photo: View | Path, reduced: int = 1) -> np.ndarray:
    """(H, W, 3) uint8 RGB of a view or file, as stored (no EXIF rotation: the calibration is of the stored pixels).

    reduced: 1 or 4, by how much each side is smaller.

    Raises:
        InputError: the file is missing or broken.
    """
    path = photo.path if isinstance(photo, View) else Path(photo)
    pixels = cv2.imread(str(path), _READ[reduced] | cv2.IMREAD_IGNORE_ORIENTATION)
    if pixels is None:
        raise InputError(f"{path}: cannot be decoded as a photo; copy it again or remove it.")
    return cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB)


def pinhole_maps(
    camera: Camera,
    box: tuple[float, float, float, float],
    scale: float = 1.0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``cv2.remap`` maps of an undistorted window, and its calibration matrix.

    Args:
        camera: the photo's. box: left, top, right, bottom of the window in pixels of the undistorted photo that keeps
        fx, fy, cx, cy.
        scale: output pixels per input pixel (0.5 = half size).

    Returns:
        map_x, map_y: (h, w) float32; K: (3, 3) with pixel centres at + 0.5, as everywhere.
    """
    left, top, right, bottom = box
    width, height = int(round((right - left) * scale)), int(round((bottom - top) * scale))
    k = np.array(
        [
            [camera.fx * scale, 0, (camera.cx - left) * scale],
            [0, camera.fy * scale, (camera.cy - top) * scale],
            [0, 0, 1.0],
        ]
    )
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    x, y = camera.distort((u - k[0, 2]) / k[0, 0], (v - k[1, 2]) / k[1, 1])
    return (
        (camera.fx * x + camera.cx - 0.5).astype(np.float32),
        (camera.fy * y + camera.cy - 0.5).astype(np.float32),
        k,
    )


def pinhole_crop(
    view: View,
    box: tuple[float, float, float, float],
    image: np.ndarray | None = None,
    scale: float = 1.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Undistorted window of a photo and its calibration matrix (see :func:`pinhole_maps`).

    Args:
        image: the loaded photo; None loads it.

    Returns:
        (h, w, 3) uint8 (black outside the photo) and K (3, 3). The view's rotation and translation hold unchanged.
    """
    pixels = load_image(view) if image is None else image
    map_x, map_y, k = pinhole_maps(view.camera, box, scale)
    return cv2.remap(pixels, map_x, map_y, cv2.INTER_AREA if scale < 0.5 else cv2.INTER_LINEAR), k


def undistort_view(view: View, image: np.ndarray | None = None) -> tuple[np.ndarray, View]:
    """The whole photo without distortion, and the view with a pinhole camera that belongs to it."""
    camera = view.camera
    pixels, k = pinhole_crop(view, (0, 0, camera.width, camera.height), image)
    return pixels, replace(view, camera=Camera(camera.width, camera.height, k[0, 0], k[1, 1], k[0, 2], k[1, 2]))
