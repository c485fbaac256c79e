"""Cameras and views as every later stage sees them.

Frames: world = the local frame of :class:`~treedgs_geo.core.crs.LocalFrame` (metres, z up); camera = OpenCV axes
(x right, y down, z forward), ``x_cam = R x_world + t``. Pixels: COLMAP's convention, the centre of the first pixel is
(0.5, 0.5); an array index is ``floor(u)``, and ``cv2.remap`` maps take ``u - 0.5``.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

#: Photos whose axis is farther than this from straight down look at stems from the side, degrees.
OBLIQUE_DEG = 17.0
#: Normalised coordinates without distortion are found when a step moves them by no more: 1e-10 pixels.
_SETTLED = 1e-13


@dataclass(frozen=True)
class Camera:
    """Intrinsics, Brown's lens model (Brown 1971) as OpenCV writes it. fx..cy in pixels; k1, k2, p1, p2, k3
    dimensionless.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    @property
    def matrix(self) -> np.ndarray:
        """(3, 3) calibration matrix."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1.0]])

    @property
    def distortion(self) -> np.ndarray:
        """(5,) k1, k2, p1, p2, k3 as OpenCV takes them."""
        return np.array([self.k1, self.k2, self.p1, self.p2, self.k3])

    def distort(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Normalised pinhole coordinates -> normalised distorted coordinates."""
        r2 = x * x + y * y
        radial = 1 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        return (
            x * radial + 2 * self.p1 * x * y + self.p2 * (r2 + 2 * x * x),
            y * radial + self.p1 * (r2 + 2 * y * y) + 2 * self.p2 * x * y,
        )

    def undistort(self, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pixels -> normalised pinhole coordinates, by fixed-point iteration (to 1e-12 for drone lenses)."""
        xd, yd = (np.asarray(u, float) - self.cx) / self.fx, (np.asarray(v, float) - self.cy) / self.fy
        x, y = xd.copy(), yd.copy()
        for _ in range(20):
            ex, ey = self.distort(x, y)
            dx, dy = xd - ex, yd - ey
            x, y = x + dx, y + dy
            if not ((np.abs(dx) > _SETTLED) | (np.abs(dy) > _SETTLED)).any():
                break
        return x, y


@dataclass(frozen=True)
class View:
    """One registered photo.

    name: file name. path: the original photo. rotation (3, 3), translation (3,): world -> camera. flight: 0-based index
    of the flight (or lighting block) the photo belongs to. readout_travel_m: (3,) in the world frame, how far the
    camera moves while the sensor is read from the first row to the last (rolling shutter); the pose is that of the
    middle row. Zero for a sensor that is exposed at once.
    """

    name: str
    path: Path
    camera: Camera
    rotation: np.ndarray
    translation: np.ndarray
    flight: int = 0
    readout_travel_m: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @property
    def centre(self) -> np.ndarray:
        """(3,) camera centre in the world frame."""
        return -self.rotation.T @ self.translation

    @property
    def nadir_angle_deg(self) -> float:
        """Angle between the optical axis and straight down, degrees."""
        return float(np.degrees(np.arccos(np.clip(-self.rotation[2, 2], -1, 1))))

    def at_point(self, point: np.ndarray) -> View:
        """The view as a camera that stands still where it stood when the row of ``point`` (3,) was read."""
        if not self.readout_travel_m.any():
            return self
        pixels, _ = self.project(np.asarray(point, float)[None])
        share = np.nan_to_num(pixels[0, 1] / self.camera.height - 0.5)
        moved = self.translation - share * self.rotation @ self.readout_travel_m
        return replace(self, translation=moved, readout_travel_m=np.zeros(3))

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N, 3) world points -> (N, 2) pixels with distortion, (N,) depth along the optical axis, metres.

        Points at depth <= 0 get NaN pixels.
        """
        local = np.asarray(points, float) @ self.rotation.T + self.translation
        pixels = self._pixels(local)
        if self.readout_travel_m.any():
            step, middle = self.rotation @ self.readout_travel_m, local
            # The row decides where the camera stood, and that the row: a contraction by 1e-3 or less per round.
            for _ in range(3):
                local = middle - (pixels[:, 1:] / self.camera.height - 0.5) * step
                pixels = self._pixels(local)
        return pixels, local[:, 2]

    def _pixels(self, local: np.ndarray) -> np.ndarray:
        """(N, 3) camera frame -> (N, 2) pixels, NaN behind the camera."""
        depth = local[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = local[:, 0] / depth, local[:, 1] / depth
        xd, yd = self.camera.distort(x, y)
        pixels = np.column_stack([self.camera.fx * xd + self.camera.cx, self.camera.fy * yd + self.camera.cy])
        pixels[~(depth > 0)] = np.nan
        return pixels

    def contains(self, pixels: np.ndarray, margin_px: float = 0.0) -> np.ndarray:
        """(N,) bool: pixels inside the image by at least ``margin_px``."""
        u, v = pixels[:, 0], pixels[:, 1]
        with np.errstate(invalid="ignore"):
            return (
                (u >= margin_px)
                & (u <= self.camera.width - margin_px)
                & (v >= margin_px)
                & (v <= self.camera.height - margin_px)
            )

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """(N, 2) pixels -> (N, 3) unit viewing directions in the world frame."""
        x, y = self.camera.undistort(pixels[:, 0], pixels[:, 1])
        directions = np.column_stack([x, y, np.ones_like(x)]) @ self.rotation
        return directions / np.linalg.norm(directions, axis=1, keepdims=True)


@dataclass(frozen=True)
class Sensor:
    """Lens and shutter of N photos.

    camera: intrinsics in the first flight. flight: (N,) int from 0. drift: (F,) log of each flight's focal length over
    that of the first. velocity_m_s: (N, 3) of the camera at the exposure, world frame, 0 where unknown. readout_s: time
    from the first row to the last, 0 for a sensor exposed at once. extra_travel_m: (N, 3) readout travel beyond
    readout_s x velocity_m_s.
    """

    camera: Camera
    flight: np.ndarray
    drift: np.ndarray
    velocity_m_s: np.ndarray
    readout_s: float
    extra_travel_m: np.ndarray

    @property
    def travel_m(self) -> np.ndarray:
        """(N, 3) how far the camera moves from the first row to the last, world frame."""
        return self.readout_s * self.velocity_m_s + self.extra_travel_m

    def camera_of(self, i: int) -> Camera:
        """Intrinsics of photo i."""
        factor = float(np.exp(self.drift[self.flight[i]]))
        return self.camera if factor == 1 else scaled_focal(self.camera, factor)

    def share(self, rows: np.ndarray) -> np.ndarray:
        """Share of the readout at which a row is read, from the middle row: -0.5 .. 0.5."""
        return rows / self.camera.height - 0.5

    def to_pixels(self, local: np.ndarray, image: np.ndarray) -> np.ndarray:
        """(M, 3) camera frame -> (M, 2) pixels of the photos ``image`` (M,); NaN behind the camera."""
        camera = self.camera
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = camera.distort(local[:, 0] / local[:, 2], local[:, 1] / local[:, 2])
        focal = np.exp(self.drift)[self.flight[image]]
        pixels = np.column_stack([camera.fx * focal * x + camera.cx, camera.fy * focal * y + camera.cy])
        pixels[local[:, 2] <= 0] = np.nan
        return pixels

    def directions(self, pixels: np.ndarray, image: np.ndarray | int) -> np.ndarray:
        """(M, 2) pixels of the photos ``image`` -> (M, 3) unit directions in the camera frame."""
        camera = self.camera
        focal = np.exp(self.drift)[self.flight[image]]
        middle = np.array([camera.cx, camera.cy])
        # The factor of the flight's focal length scales pixels about the principal point.
        even = middle + (pixels - middle) / np.broadcast_to(focal, len(pixels))[:, None]
        x, y = camera.undistort(even[:, 0], even[:, 1])
        rays = np.column_stack([x, y, np.ones_like(x)])
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def scaled_focal(camera: Camera, factor: float) -> Camera:
    """The camera with another focal length."""
    return replace(camera, fx=camera.fx * factor, fy=camera.fy * factor)
