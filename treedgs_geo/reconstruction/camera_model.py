"""What the photos of a block share: the lens, its drift from flight to flight, and how the sensor is read."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .cameras import Camera


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

    @classmethod
    def fixed(cls, camera: Camera, count: int) -> Sensor:
        """One flight of photos that are exposed at once."""
        zero = np.zeros((count, 3))
        return cls(camera, np.zeros(count, int), np.zeros(1), zero, 0.0, zero.copy())

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
