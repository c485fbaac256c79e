"""The camera of the simulated flights: its lens, how it drifts, and how it moves while a photo is taken."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from treedgs_geo.core.errors import InputError
from treedgs_geo.reconstruction.cameras import Camera

from .settings import SimulateSettings, Sizes


class Motion(NamedTuple):
    """How the camera moves during one photo: (3,) metres in the world frame and (3,) radians about the camera's own
    axes, from the first row to the last (readout) and from the begin to the end of one row's exposure."""

    readout_travel_m: np.ndarray
    readout_turn_rad: np.ndarray
    exposure_travel_m: np.ndarray
    exposure_turn_rad: np.ndarray


STILL = Motion(*(np.zeros(3) for _ in range(4)))


def make_camera(settings: SimulateSettings, sizes: Sizes) -> Camera:
    """The lens: f from the GSD at 70 m, principal point off centre, distortion as set.

    Raises:
        InputError: a distortion that folds the image over within the frame.
    """
    focal = float(round(7000 / settings.gsd_cm))
    camera = Camera(
        sizes.image_width,
        sizes.image_height,
        focal,
        focal,
        sizes.image_width / 2 + 5.3,
        sizes.image_height / 2 - 3.7,
        **{name: getattr(settings, name) for name in ("k1", "k2", "p1", "p2", "k3")},
    )
    # The rim and a little beyond, where the inverse must still be one.
    reach = 1.1 * np.linspace(-0.5, 0.5, 41)
    u, v = (np.meshgrid(sizes.image_width * reach, sizes.image_height * reach)[k] for k in (0, 1))
    x, y = u / focal, v / focal
    back = camera.undistort(*(camera.distort(x, y)[k] * focal + c for k, c in ((0, camera.cx), (1, camera.cy))))
    if not np.allclose(back, (x, y), atol=1e-6):
        raise InputError(
            f"--camera k1, k2, k3, p1, p2: found {settings.k1:g}, {settings.k2:g}, {settings.k3:g}, {settings.p1:g}, "
            f"{settings.p2:g}, expected a distortion without a fold within the photo; give smaller values."
        )
    return camera


def camera_of_flight(camera: Camera, focal_drift: float, flight: int) -> Camera:
    """The camera as it is in the given flight (0-based): the focal length drifts in proportion to the number."""
    factor = 1 + focal_drift * flight
    return replace(camera, fx=camera.fx * factor, fy=camera.fy * factor)


def motions(settings: SimulateSettings, velocity: np.ndarray, rng: np.random.Generator) -> list[Motion]:
    """One a photo. velocity: (P, 3) m/s in the world frame at the middle of each photo."""
    readout_s, exposure_s = settings.readout_ms / 1000, settings.exposure_ms / 1000
    rate = np.radians(settings.gimbal_rate_deg_s) * rng.standard_normal(velocity.shape)
    return [
        Motion(readout_s * v, readout_s * w, exposure_s * v, exposure_s * w)
        for v, w in zip(velocity, rate, strict=True)
    ]
