"""A small exact photogrammetric block for tests."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from treedgs_geo.reconstruction.adjustment import Known
from treedgs_geo.reconstruction.cameras import Camera, Sensor, View
from treedgs_geo.reconstruction.poses import rotation_from_gimbal
from treedgs_geo.reconstruction.tracks import Block

CAMERA = Camera(1280, 960, 1900.0, 1900.0, 645.0, 476.0, -0.02, 0.01)


def ring(count: int = 10, height: float = 60.0, pitch: float = -60.0, camera: Camera = CAMERA) -> list[View]:
    """Views that look at the origin from all sides."""
    views = []
    for k in range(count):
        yaw = 360.0 * k / count
        back = height / np.tan(np.radians(-pitch))
        centre = np.array([-np.sin(np.radians(yaw)) * back, -np.cos(np.radians(yaw)) * back, height])
        rotation = rotation_from_gimbal(yaw, pitch, 0.0)
        views.append(View(f"{k}.png", Path(f"{k}.png"), camera, rotation, -rotation @ centre))
    return views


def still_sensor(camera: Camera, count: int) -> Sensor:
    """One flight of photos that are exposed at once."""
    zero = np.zeros((count, 3))
    return Sensor(camera, np.zeros(count, int), np.zeros(1), zero, 0.0, zero.copy())


def block_of(views: list[View], points: np.ndarray, noise_px: float, rng: np.random.Generator) -> Block:
    """Every point seen by every view that frames it."""
    keypoints, image, key, point = [], [], [], []
    for i, view in enumerate(views):
        pixels, _ = view.project(points)
        seen = np.flatnonzero(view.contains(pixels))
        keypoints.append(pixels[seen] + rng.normal(0, noise_px, (len(seen), 2)))
        image.append(np.full(len(seen), i))
        key.append(np.arange(len(seen)))
        point.append(seen)
    sensor = still_sensor(views[0].camera, len(views))
    travel = np.array([view.readout_travel_m for view in views])
    return Block(
        replace(sensor, velocity_m_s=travel, readout_s=1.0) if travel.any() else sensor,
        np.array([v.rotation for v in views]),
        np.array([v.translation for v in views]),
        keypoints,
        points.copy(),
        np.concatenate(image),
        np.concatenate(key),
        np.concatenate(point),
    )


#: Parts of the lens that obliques determine.
LENS = frozenset({"focal", "principal_point", "radial", "tangential"})


def known_of(tags: np.ndarray, sd: float | np.ndarray, camera: Camera = CAMERA, **more) -> Known:
    """What holds a block: geotags with their standard errors, and a lens known to 2 % of its focal length."""
    lens_sd = np.array([0.02, 2e-4, 13.0, 13.0, 0.3, 0.5, 2e-3, 2e-3, 1.0])
    return Known(tags, np.broadcast_to(sd, tags.shape).astype(float), camera, lens_sd, **more)
