"""Spoil an input by a known amount: poses, photos, ground, cloud. Pure functions of arrays and a generator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.reconstruction.cameras import OBLIQUE_DEG, View
from treedgs_geo.reconstruction.images import load_image

from ...simulate.trouble import TroubleSettings, disturb, photo_troubles


def noisy_poses(views: list[View], noise_px: float, rng: np.random.Generator) -> list[View]:
    """Each photo turned so that its image moves by N(0, ``noise_px``) along both axes (as a bad adjustment does)."""
    moved = []
    for view in views:
        turn = rng.normal(0, noise_px, 2) / view.camera.fx
        small, _ = cv2.Rodrigues(np.array([turn[1], turn[0], 0.0]))
        moved.append(replace(view, rotation=small @ view.rotation, translation=small @ view.translation))
    return moved


def few_views(views: list[View], count: int, rng: np.random.Generator) -> list[View]:
    """``count`` oblique photos, spread evenly over the flight from a random start."""
    oblique = [view for view in views if view.nadir_angle_deg > OBLIQUE_DEG]
    if count >= len(oblique):
        return views
    place = (rng.uniform() + np.arange(count)) * len(oblique) / count
    return [oblique[int(k) % len(oblique)] for k in place]


def sector_views(views: list[View], sector_deg: float, rng: np.random.Generator) -> list[View]:
    """The photos taken from one side: within a sector of directions of this width about a random one."""
    middle = rng.uniform(0, 2 * np.pi)
    kept = []
    for view in views:
        azimuth = np.arctan2(view.centre[1], view.centre[0])
        apart = np.abs((azimuth - middle + np.pi) % (2 * np.pi) - np.pi)
        if np.degrees(apart) <= sector_deg / 2:
            kept.append(view)
    return kept


def scaled_views(views: list[View], factor: float) -> list[View]:
    """The block reconstructed too large by ``factor``: every camera that much farther from the origin."""
    return [replace(view, translation=view.translation * factor) for view in views]


def scaled_ground(height: Callable, factor: float) -> Callable:
    """The ground that belongs to :func:`scaled_views`."""
    return lambda x, y: factor * height(np.asarray(x) / factor, np.asarray(y) / factor)


def shifted_ground(height: Callable, up_m: float) -> Callable:
    """The ground too high by ``up_m``."""
    return lambda x, y: height(x, y) + up_m


def troubled_photos(views: list[View], settings: TroubleSettings, folder: Path, rng: np.random.Generator) -> list[View]:
    """Copies of the photos in ``folder``, disturbed as ``simulate-plot`` would have."""
    folder.mkdir(parents=True, exist_ok=True)
    changed = []
    for view, trouble in zip(views, photo_troubles(settings, len(views), rng), strict=True):
        if trouble.shake_px < 1 and trouble.gain == 1 and (trouble.white == 1).all():
            changed.append(view)
            continue
        pixels = load_image(view)
        path = folder / view.path.name
        spoiled = np.ascontiguousarray(disturb(pixels, trouble)[..., ::-1])
        cv2.imwrite(str(path), spoiled, [cv2.IMWRITE_JPEG_QUALITY, 92])
        changed.append(replace(view, path=path))
    return changed


def thin_cloud(cloud: PointCloud, share: float, rng: np.random.Generator) -> PointCloud:
    """A random share of the points."""
    return cloud.select(rng.random(len(cloud)) < share)


def noisy_cloud(cloud: PointCloud, sd_m: float, rng: np.random.Generator) -> PointCloud:
    """Range and trajectory noise of ``sd_m`` on every point."""
    return replace(cloud, xyz=cloud.xyz + rng.normal(0, sd_m, cloud.xyz.shape))


def cluttered_cloud(cloud: PointCloud, stems: np.ndarray, per_m3: float, rng: np.random.Generator) -> PointCloud:
    """Floating points about the stems: uniform within 0.6 m of their axes, ground to 4 m. stems: (K, 3) x, y, foot."""
    volume = np.pi * 0.6**2 * 4.0
    count = int(per_m3 * volume)
    extra = []
    for x, y, z in stems:
        radius, turn = 0.6 * np.sqrt(rng.random(count)), rng.uniform(0, 2 * np.pi, count)
        extra.append(
            np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn), z + rng.uniform(0.2, 4.2, count)])
        )
    added = np.concatenate(extra) if extra else np.empty((0, 3))
    attributes = {
        name: np.concatenate([values, rng.choice(values, len(added))]).astype(values.dtype)
        for name, values in cloud.attributes.items()
    }
    return replace(cloud, xyz=np.vstack([cloud.xyz, added]), attributes=attributes)


def one_side_of_stems(cloud: PointCloud, stems: np.ndarray, arc_deg: float, rng: np.random.Generator) -> PointCloud:
    """Bark points outside an arc of the stem removed. stems: (K, 4) x, y, ground z, radius, m."""
    drop = np.zeros(len(cloud), bool)
    for x, y, z, radius in stems:
        dx, dy = cloud.xyz[:, 0] - x, cloud.xyz[:, 1] - y
        own = (np.hypot(dx, dy) < radius + 0.12) & (cloud.xyz[:, 2] > z + 0.3) & (cloud.xyz[:, 2] < z + 6)
        apart = np.abs((np.arctan2(dy, dx) - rng.uniform(0, 2 * np.pi) + np.pi) % (2 * np.pi) - np.pi)
        drop |= own & (np.degrees(apart) > arc_deg / 2)
    return cloud.select(~drop)
