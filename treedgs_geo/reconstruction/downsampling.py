"""Photos finer than a stem needs, read as those of a coarser sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .cameras import Camera

#: Linear light of a photo's 0..1 values is their power of this (as the fit takes them).
GAMMA = 2.2
#: Finer pixels on the ground than this (m) are averaged, two by two or more: a stem's edges are found to a fraction of
#: a pixel anyway, and four times the pixels cost four times the memory.
FINEST_GSD_M = 0.008


def shrink_factor(camera: Camera, depth_m: float) -> int:
    """By how much a photo is reduced: whole pixels that fit into :data:`FINEST_GSD_M` at a depth; 1 = as it is."""
    return max(int(FINEST_GSD_M * max(camera.fx, camera.fy) / max(depth_m, 1e-6)), 1)


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
    import cv2

    if k == 1:
        return np.ascontiguousarray(image)
    linear = cv2.LUT(image, ((np.arange(256) / 255.0) ** GAMMA).astype(np.float32))
    small = cv2.resize(linear, (image.shape[1] // k, image.shape[0] // k), interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(np.rint(255.0 * small ** (1 / GAMMA)).astype(np.uint8))
