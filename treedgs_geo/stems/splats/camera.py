"""The pinhole camera that Gaussians are drawn for: a photo without its lens distortion, or a piece of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...reconstruction.cameras import View


@dataclass(frozen=True)
class CropCamera:
    """A pinhole camera over a rectangle of interest.

    width, height: pixels. fx, fy, cx, cy: pixels, relative to the crop's own corner; the centre of the first pixel is
    (0.5, 0.5). rotation (3, 3), translation (3,): world -> camera, OpenCV axes.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    rotation: np.ndarray
    translation: np.ndarray

    @classmethod
    def of(cls, view: View) -> CropCamera:
        """The whole photo, undistorted."""
        c = view.camera
        return cls(c.width, c.height, c.fx, c.fy, c.cx, c.cy, view.rotation, view.translation)

    @property
    def centre(self) -> np.ndarray:
        """(3,) camera centre in the world frame."""
        return -self.rotation.T @ self.translation

    def scaled(self, factor: float) -> CropCamera:
        """The same view at ``factor`` times the resolution (pixel corners, not centres, scale)."""
        width, height = max(int(round(self.width * factor)), 1), max(int(round(self.height * factor)), 1)
        along, down = width / self.width, height / self.height
        return replace(
            self, width=width, height=height,
            fx=self.fx * along, fy=self.fy * down, cx=self.cx * along, cy=self.cy * down,
        )  # fmt: skip

    def part(self, left: int, top: int, width: int, height: int) -> CropCamera:
        """A piece of the view, given in its pixels; it may reach beyond."""
        return replace(self, width=width, height=height, cx=self.cx - left, cy=self.cy - top)

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N, 3) world -> (N, 2) pixels, (N,) depth along the axis; NaN pixels at depth <= 0."""
        local = np.asarray(points, float) @ self.rotation.T + self.translation
        depth = local[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels = np.column_stack([self.fx * local[:, 0] / depth + self.cx, self.fy * local[:, 1] / depth + self.cy])
        pixels[depth <= 0] = np.nan
        return pixels, depth

    def pixel_rays(self) -> np.ndarray:
        """(height, width, 3) float64 unit viewing directions through the pixel centres, camera axes."""
        x = (np.arange(self.width) + 0.5 - self.cx) / self.fx
        y = (np.arange(self.height) + 0.5 - self.cy) / self.fy
        rays = np.stack([*np.meshgrid(x, y), np.ones((self.height, self.width))], axis=-1)
        return rays / np.linalg.norm(rays, axis=-1, keepdims=True)
