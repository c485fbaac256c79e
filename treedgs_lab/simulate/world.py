"""Everything that rays can hit, in one scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .barks import Barks
from .casting import cast, make_scene
from .crowns import Crowns
from .foliage import Faces
from .stem_mesh import StemMesh
from .terrain import Ground
from .textures import GroundTexture


@dataclass(frozen=True)
class World:
    """Everything that rays can hit, in one scene; primitive ids run over ground, stems, then faces.

    scene: ``open3d.t.geometry.RaycastingScene``. bark_offset: (S, 3) float32 shifts of each stem on its bark tile,
    around (turns) and along (m), and its brightness. stem_owner: (F_stems,) stem index of each stem triangle. crowns:
    those among the faces that others have grown.
    """

    scene: Any
    ground: Ground
    mesh: StemMesh
    faces: Faces
    texture: GroundTexture
    barks: Barks
    bark_offset: np.ndarray
    ground_faces: int
    stem_faces: int
    crowns: Crowns | None = None

    @property
    def stem_owner(self) -> np.ndarray:
        """(F,) stem of each face."""
        return self.mesh.owner

    def first_hits(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N, 3) each -> distance (N,) in lengths of ``directions`` (inf = none), primitive id (N,) (-1 = none)."""
        rays = np.concatenate([np.broadcast_to(origins, directions.shape), directions], axis=1)
        distance, primitive, _ = cast(self.scene, rays)
        return distance, np.where(np.isfinite(distance), primitive.astype(np.int64), -1)


def build_world(
    ground: Ground, mesh: StemMesh, faces: Faces, texture: GroundTexture, barks: Barks, rng: np.random.Generator
) -> World:
    """One Embree scene of ground, stems and faces; per-stem shifts of the bark tiles so that no two look alike."""
    scene = scene_of(ground, mesh, faces)
    count = len(mesh.first) - 1
    shift = np.column_stack([rng.uniform(0, 1, count), rng.uniform(0, 30, count), rng.uniform(0.75, 1.3, count)])
    return World(
        scene,
        ground,
        mesh,
        faces,
        texture,
        barks,
        shift.astype(np.float32),
        2 * (len(ground.z) - 1) ** 2,
        len(mesh.triangles),
    )


def scene_of(ground: Ground, mesh: StemMesh, faces: Faces) -> Any:
    """One ``open3d.t.geometry.RaycastingScene``; primitive ids run over ground, stems, then faces."""
    ground_vertices, ground_triangles = ground.mesh()
    leaves = faces.corners.reshape(-1, 3)
    vertices = np.concatenate([ground_vertices, mesh.vertices, leaves])
    triangles = np.concatenate(
        [
            ground_triangles,
            mesh.triangles + len(ground_vertices),
            np.arange(len(leaves)).reshape(-1, 3) + len(ground_vertices) + len(mesh.vertices),
        ]
    )
    return make_scene(vertices, triangles)
