"""Open3D's Embree scene behind three plain array functions."""

from __future__ import annotations

from typing import Any

import numpy as np


def make_scene(vertices: np.ndarray, triangles: np.ndarray) -> Any:
    """(V, 3) and (F, 3) -> an ``open3d.t.geometry.RaycastingScene``."""
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor.from_numpy(np.ascontiguousarray(vertices, np.float32)),
        o3d.core.Tensor.from_numpy(np.ascontiguousarray(triangles, np.uint32)),
    )
    return scene


def cast(scene: Any, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N, 6) float32 origins and directions -> first hits: distance (N,) in direction lengths (inf = none), triangle
    (N,) uint32 and barycentric u, v (N, 2) float32 of its second and third corner."""
    import open3d as o3d

    hit = scene.cast_rays(o3d.core.Tensor.from_numpy(np.ascontiguousarray(rays, np.float32)))
    return hit["t_hit"].numpy(), hit["primitive_ids"].numpy(), hit["primitive_uvs"].numpy()


def blocked(scene: Any, rays: np.ndarray) -> np.ndarray:
    """(N, 6) -> (N,) bool: anything in the way."""
    import open3d as o3d

    return scene.test_occlusions(o3d.core.Tensor.from_numpy(np.ascontiguousarray(rays, np.float32))).numpy()
