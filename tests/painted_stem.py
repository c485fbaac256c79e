"""A small painted scene for several test rooms: a dark stem on speckled ground, seen by twelve oblique views."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import pyproj
import pytest

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.stems.splats.camera import CropCamera

FRAME = LocalFrame(pyproj.CRS.from_epsg(6344), np.array([611337.0, 3718451.0, 38.0]))
STEM, RADIUS, GROUND = np.array([1.0, -0.5]), 0.15, 2.0


def ground(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.full(np.shape(x), GROUND)


@lru_cache(maxsize=1)
def scene() -> tuple[tuple[View, ...], dict[str, np.ndarray]]:
    """Twelve oblique views of the stem, and their photos; skips where torch, which draws them, is missing."""
    pytest.importorskip("torch")
    from treedgs_geo.stems.splats.on_torch.rasterize import draw

    rng = np.random.default_rng(0)
    angle, height = rng.uniform(0, 2 * np.pi, 1500), rng.uniform(-0.3, 5, 1500)
    p = np.zeros((1500, 14))
    p[:, :3] = np.column_stack(
        [STEM[0] + (RADIUS - 0.02) * np.cos(angle), STEM[1] + (RADIUS - 0.02) * np.sin(angle), GROUND + height]
    )
    p[:, 3], p[:, 7:10], p[:, 10] = 1, np.log(0.03), 4
    p[:, 11:] = rng.uniform(0.1, 0.25, (1500, 1))
    cell, half = 0.08, 9.0
    texture = rng.uniform(0.45, 0.8, (round(2 * half / cell),) * 2).astype(np.float32)
    views, photos = [], {}
    for number in range(12):
        turn, tilt = 2 * np.pi * number / 12, np.radians(50)
        target = np.array([*STEM, GROUND + 1.5])
        centre = target + 60 * np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
        forward = (target - centre) / 60
        right = np.cross(forward, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        camera = Camera(260, 260, 2200, 2200, 130, 130)
        view = View(f"{number:02d}.jpg", Path(f"{number:02d}.jpg"), camera, rotation, -rotation @ centre, number % 2)
        crop = CropCamera.of(view)
        planes, rays = draw(p, crop), crop.pixel_rays() @ rotation
        met = (centre + (GROUND - centre[2]) / rays[..., 2:] * rays)[..., :2]
        across, down = np.moveaxis((met + half) / cell - 0.5, -1, 0).astype(np.float32)
        behind = cv2.remap(texture, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        picture = np.moveaxis(planes[:3], 0, -1) + (planes[3] * behind)[..., None]
        gain = 1 + 0.05 * np.sin(number)  # exposures differ
        photos[view.name] = np.clip(picture * gain * 255, 0, 255).astype(np.uint8)
        views.append(view)
    return tuple(views), photos


def load(view: View) -> np.ndarray:
    return scene()[1][view.name]
