"""Cameras all round a plot, without photos."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_lab.simulate.flight import rotation_from_angles

CAMERA = Camera(560, 440, 3800.0, 3800.0, 280.0, 220.0)


def ring(count: int = 24) -> list[View]:
    """Photos from all sides, 57 degrees down, at 70 m."""
    views = []
    for k in range(count):
        yaw = 360 * k / count
        centre = 45 * np.array([-np.sin(np.radians(yaw)), -np.cos(np.radians(yaw)), 70 / 45])
        rotation = rotation_from_angles(yaw, -57.0, 0.0)
        views.append(View(f"{k:02d}.jpg", Path(f"{k:02d}.jpg"), CAMERA, rotation, -rotation @ centre))
    return views
