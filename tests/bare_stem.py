"""One dark, straight stem on light ground under an even light: what a camera makes of it has a known answer."""

from __future__ import annotations

import dataclasses

import numpy as np

from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_lab.simulate import scene, stem_mesh, terrain
from treedgs_lab.simulate.barks import Barks
from treedgs_lab.simulate.flight import rotation_from_angles
from treedgs_lab.simulate.foliage import Faces
from treedgs_lab.simulate.light import Light
from treedgs_lab.simulate.textures import GroundTexture
from treedgs_lab.simulate.world import World, build_world

CAMERA = Camera(320, 400, 1900.0, 1900.0, 163.0, 196.0, k1=-0.02, k2=0.01)


def stem_world() -> tuple[World, Light, np.ndarray]:
    """World, light, and the (K, 3) axis of its only stem: vertical, 30 cm at breast height, 12 m high."""
    rng = np.random.default_rng(0)
    ground = terrain.make_ground(rng, 40, 0.0, 0.0)
    fields = dict(tree_id="T1", kind="normal", status="live", in_plot=True, detail=2, crown_base_m=8.0)
    stem = scene.grow_stem(rng, ground, np.zeros(2), 0.30, 12.0, 0.0, 0.0, **fields)
    up = scene.AXIS_STEP * np.arange(len(stem.axis))
    stem = dataclasses.replace(stem, axis=np.column_stack([0 * up, 0 * up, up]))
    mesh = stem_mesh.mesh_stems(np.random.default_rng(1), [stem])
    faces = Faces.none()
    texture = GroundTexture(-40.0, 1.0, np.full((80, 80, 3), 255, np.uint8))
    dark = Barks.plain(np.zeros((8, 8, 3), np.uint8), 1)
    light = Light(
        -40.0,
        1.0,
        np.full((80, 80, 3), 0.5, np.float32),
        np.zeros((len(mesh.vertices), 3), np.float32),
        np.zeros((0, 3), np.float32),
    )
    return build_world(ground, mesh, faces, texture, dark, rng), light, stem.axis


def side_view(camera: Camera = CAMERA, travel_m: np.ndarray | None = None, yaw_deg: float = 0.0) -> View:
    """A camera 30 m up that looks at the stem from the south, 50 degrees down."""
    rotation = rotation_from_angles(yaw_deg, -50.0, 0.0)
    centre = np.array([0.0, -22.0, 30.0])
    return View("a", "a", camera, rotation, -rotation @ centre, 0, np.zeros(3) if travel_m is None else travel_m)


def stem_columns(image: np.ndarray) -> np.ndarray:
    """(H,) place of the stem's middle in each row, pixels (centres at + 0.5); NaN where the row shows none."""
    dark = np.clip(1 - image[..., 1] / np.median(image[..., 1]), 0, 1)
    dark[dark < 0.05] = 0
    weight = dark.sum(axis=1)
    with np.errstate(invalid="ignore"):
        return np.where(weight > 4, (dark @ (np.arange(image.shape[1]) + 0.5)) / weight, np.nan)
