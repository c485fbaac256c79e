"""A tiny painted world for the tests: cylinders on a flat, textured ground, ray cast in numpy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from treedgs_geo.reconstruction.cameras import Camera, View


@dataclass(frozen=True)
class Stem:
    """A leaning, tapering stem: x, y and radius at 1.37 m, lean in m/m, taper in m/m."""

    x: float
    y: float
    r: float
    lx: float = 0.0
    ly: float = 0.0
    taper: float = -0.005
    top: float = 9.0


def oblique_views(
    folder: Path,
    n: int,
    height: float = 40.0,
    distance: float = 27.0,
    width: int = 520,
    rows: int = 400,
    focal: float = 1500.0,
) -> list[View]:
    """Cameras on a ring looking at the origin."""
    views = []
    for k in range(n):
        angle = 2 * np.pi * (k + 0.3) / n
        centre = np.array([distance * np.cos(angle), distance * np.sin(angle), height])
        forward = np.array([0, 0, 1.5]) - centre
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        camera = Camera(width, rows, focal, focal, width / 2 + 1.5, rows / 2 - 1.0, -0.02, 0.01)
        views.append(View(f"photo_{k:02d}.png", folder / f"photo_{k:02d}.png", camera, rotation, -rotation @ centre, 0))
    return views


def render(views: list[View], stems: list[Stem], seed: int = 0, samples: int = 2, sky: float = 0.8) -> None:
    """Paint every view: bright textured ground, darker textured bark, a sky (1 = white), lens and pixel blur, noise."""
    rng = np.random.default_rng(seed)
    litter = cv2.GaussianBlur(rng.normal(size=(1200, 1200)).astype(np.float32), (0, 0), 1.5)
    litter = 0.42 + 0.10 * litter / litter.std()
    bark = cv2.GaussianBlur(rng.normal(size=(256, 512)).astype(np.float32), (0, 0), 2.0)
    bark = 0.16 + 0.03 * bark / bark.std()
    for view in views:
        camera = view.camera
        u, v = np.meshgrid(
            (np.arange(camera.width * samples) + 0.5) / samples, (np.arange(camera.height * samples) + 0.5) / samples
        )
        rays = view.rays(np.column_stack([u.ravel(), v.ravel()]))
        origin = view.centre
        down = np.minimum(rays[:, 2], -1e-3)
        depth = -origin[2] / down
        ground = origin + depth[:, None] * rays
        column = (np.abs(ground[:, 0] + 30) * 20).astype(int) % 1200
        row = (np.abs(ground[:, 1] + 30) * 20).astype(int) % 1200
        light = np.where(down == rays[:, 2], litter[row, column], sky)
        nearest = depth.copy()
        for stem in stems:
            hit, point = _hit(origin, rays, stem)
            closer = hit & (point[0] < nearest)
            angle = ((point[2] / (2 * np.pi) + 1) % 1 * 511).astype(int)
            light = np.where(closer, bark[(point[1] * 40).astype(int) % 256, angle], light)
            nearest = np.where(closer, point[0], nearest)
        image = light.reshape(camera.height * samples, camera.width * samples).astype(np.float32)
        image = cv2.GaussianBlur(image, (0, 0), 0.6 * samples)
        image = cv2.resize(image, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
        image = np.clip(image, 0, 1) ** (1 / 2.2) + rng.normal(0, 0.006, image.shape)
        gray = np.clip(image * 255, 0, 255).astype(np.uint8)
        cv2.imwrite(str(view.path), cv2.merge([(gray * 0.8).astype(np.uint8), (gray * 0.9).astype(np.uint8), gray]))


def _hit(origin: np.ndarray, rays: np.ndarray, stem: Stem) -> tuple[np.ndarray, tuple]:
    """First meeting of rays with a leaning cone: |p_xy - axis(z)| = r(z)."""
    q0 = origin[2] - 1.37
    a = rays[:, 0] - stem.lx * rays[:, 2]
    b = rays[:, 1] - stem.ly * rays[:, 2]
    c = origin[0] - stem.x - stem.lx * q0
    d = origin[1] - stem.y - stem.ly * q0
    e = stem.taper * rays[:, 2]
    f = stem.r + stem.taper * q0
    qa, qb, qc = a * a + b * b - e * e, a * c + b * d - e * f, c * c + d * d - f * f
    inside = qb * qb - qa * qc
    t = (-qb - np.sqrt(np.maximum(inside, 0))) / qa
    z = origin[2] + t * rays[:, 2]
    angle = np.arctan2(d + t * b, c + t * a)
    return (inside > 0) & (t > 0) & (z > 0) & (z < stem.top), (t, np.abs(z), angle)


def leaves(views: list[View], rng: np.random.Generator) -> float:
    """Paint crowns of leaves 7 to 9 m above the ground into the photos; the share of the middle that a photo loses."""
    crowns = np.column_stack([rng.uniform(-11, 11, (320, 2)), rng.uniform(7, 9, 320)])
    places = np.repeat(crowns, 60, axis=0) + rng.normal(0, 0.35, (19200, 3))
    hidden = []
    for number, view in enumerate(views):
        image, cover = cv2.imread(str(view.path)), np.zeros((view.camera.height, view.camera.width), np.uint8)
        pixels, depth = view.project(places)
        near, sizes = view.contains(pixels, -20), rng.uniform(0.06, 0.14, len(places))
        for pixel, away, size in zip(pixels[near], depth[near], sizes[near], strict=True):
            disc = (int(pixel[0]), int(pixel[1])), int(size * view.camera.fx / away)
            cv2.circle(image, *disc, (40, int(rng.uniform(60, 140)), 50), -1)
            cv2.circle(cover, *disc, 1, -1)
        # Each photo is exposed a little otherwise.
        cv2.imwrite(str(view.path), np.clip(image * (0.85, 1.0, 1.15)[number % 3], 0, 255).astype(np.uint8))
        hidden.append(cover[120:280, 160:360].mean())
    return float(np.mean(hidden))
