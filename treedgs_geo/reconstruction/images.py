"""Photos as arrays: loading, maps without distortion, photos finer than a stem needs as those of a coarser sensor.
Pixel convention as in :mod:`.cameras`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from ..core.errors import InputError
from .cameras import Camera, View

#: Linear light of a photo's 0..1 values is their power of this (as the fit takes them).
GAMMA = 2.2
#: Finer pixels on the ground than this (m) are averaged, two by two or more: a stem's edges are found to a fraction of
#: a pixel anyway, and four times the pixels cost four times the memory.
FINEST_GSD_M = 0.008
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
    camera: Camera, box: tuple[float, float, float, float], scale: float = 1.0
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


def shrink_factor(camera: Camera, depth_m: float, finest_m: float = FINEST_GSD_M) -> int:
    """By how much a photo is reduced: whole pixels that fit into ``finest_m`` at a depth; 1 = as it is."""
    return max(int(finest_m * max(camera.fx, camera.fy) / max(depth_m, 1e-6)), 1)


def shrunk_camera(camera: Camera, k: int) -> Camera:
    """The camera of a photo whose pixels were averaged k by k (pixel centres are at +0.5, so all scales alike)."""
    return replace(
        camera,
        width=camera.width // k,
        height=camera.height // k,
        fx=camera.fx / k,
        fy=camera.fy / k,
        cx=camera.cx / k,
        cy=camera.cy / k,
    )


def shrink(image: np.ndarray, k: int) -> np.ndarray:
    """(H, W, 3) uint8 -> (H / k, W / k, 3) uint8, contiguous: means of k x k pixels in linear light, as a coarser
    sensor would have counted them. H and W are multiples of k."""
    if k == 1:
        return np.ascontiguousarray(image)
    linear = cv2.LUT(image, ((np.arange(256) / 255.0) ** GAMMA).astype(np.float32))
    small = cv2.resize(linear, (image.shape[1] // k, image.shape[0] // k), interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(np.rint(255.0 * small ** (1 / GAMMA)).astype(np.uint8))
