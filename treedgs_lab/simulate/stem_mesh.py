"""Triangle meshes of the stems: bark-covered tubes about their axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from .scene import AXIS_STEP, PlantedStem, axis_at


@dataclass(frozen=True)
class StemMesh:
    """vertices (V, 3) float64; triangles (F, 3) int64; uv (V, 2): around (turns) and along (m); owner (F,) stem index;
    normals (V, 3) outward; first (S + 1,) first triangle of each stem."""

    vertices: np.ndarray
    triangles: np.ndarray
    uv: np.ndarray
    normals: np.ndarray
    owner: np.ndarray
    first: np.ndarray

    @property
    def vertex_owner(self) -> np.ndarray:
        """(V,) stem of each vertex."""
        owner = np.zeros(len(self.vertices), np.int32)
        owner[self.triangles.ravel()] = np.repeat(self.owner, 3)
        return owner


def no_stems() -> StemMesh:
    """A mesh without any stem."""
    none = np.zeros((0, 3))
    return StemMesh(none, np.zeros((0, 3), int), np.zeros((0, 2)), none, np.zeros(0, int), np.zeros(1, int))


def _rings(stem: PlantedStem) -> tuple[int, np.ndarray]:
    """Sides of the tube, and (N,) arc lengths of its rings, m: finer the nearer to a plot."""
    length = AXIS_STEP * (len(stem.axis) - 1)
    if stem.detail == 2:
        sides = 36
        s = np.concatenate([np.arange(0, min(5.0, length), 0.06), np.arange(5.0, max(length, 5.0), 0.25)])
    elif stem.detail == 1:
        sides, s = 16, np.concatenate([np.arange(0, 0.6, 0.15), np.arange(0.6, length, 0.4)])
    else:
        sides, s = 8, np.concatenate([[0.0, 0.4], np.arange(1.0, length, 1.2)])
    return sides, np.append(s[s < length - 0.01], length)


def mesh_stems(rng: np.random.Generator, stems: list[PlantedStem], ellipticity_pct: float = 0.0) -> StemMesh:
    """Tubes around the axes with ellipticity (0 = drawn), bark relief (plates of some millimetres), a lobed butt, and
    the lobes that a stem has."""
    parts: list[tuple] = []
    offset, faces = 0, [0]
    for index, stem in enumerate(stems):
        sides, s = _rings(stem)
        point, tangent, radius = axis_at(stem, s)
        if stem.kind != "branch":
            # A root end below the ground, so that no gap shows on the downhill side.
            s, radius = np.concatenate([[-0.35], s]), np.concatenate([[radius[0] * 1.25], radius])
            point, tangent = np.vstack([point[0] - 0.35 * tangent[0], point]), np.vstack([tangent[:1], tangent])
        theta = 2 * np.pi * np.arange(sides) / sides
        e1 = np.cross(np.array([0.0, 1.0, 0.0]), tangent)
        e1 /= np.linalg.norm(e1, axis=1, keepdims=True)
        e2 = np.cross(tangent, e1)
        relief = gaussian_filter(rng.standard_normal((len(s), sides)), (0.9, 0.8), mode=("nearest", "wrap"))
        relief *= (0.011 * radius + 0.0012)[:, None] / max(relief.std(), 1e-9)
        oval = rng.uniform(0.002, 0.03)
        ellipse = (ellipticity_pct / 200 or oval) * np.cos(2 * (theta - rng.uniform(0, np.pi)))
        lobes = 0.16 * np.cos(rng.integers(3, 6) * theta + rng.uniform(0, 6.28))
        lobes = lobes * np.exp(-np.maximum(s, 0) / 0.22)[:, None]
        if stem.look.lobes is not None:
            lobes = lobes + stem.look.lobes.share(theta, s)
        shape = radius[:, None] * (1 + ellipse + lobes) + relief
        outward = np.cos(theta)[None, :, None] * e1[:, None] + np.sin(theta)[None, :, None] * e2[:, None]
        # One column more than sides: the seam has its own texture coordinate.
        ring = np.concatenate(
            [point[:, None] + shape[..., None] * outward, (point[:, None] + shape[..., None] * outward)[:, :1]], axis=1
        )
        normal = np.concatenate([outward, outward[:, :1]], axis=1)
        rows, columns = ring.shape[:2]
        u = np.broadcast_to(np.arange(columns) / sides, (rows, columns))
        v = np.broadcast_to(s[:, None], (rows, columns))
        node = np.arange(rows * columns).reshape(rows, columns) + offset
        a, b, c, d = node[:-1, :-1], node[:-1, 1:], node[1:, :-1], node[1:, 1:]
        triangles = np.concatenate([np.stack([a, b, d], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)])
        parts.append(
            (
                ring.reshape(-1, 3),
                triangles,
                np.stack([u, v], -1).reshape(-1, 2),
                normal.reshape(-1, 3),
                np.full(len(triangles), index),
            )
        )
        offset += rows * columns
        faces.append(faces[-1] + len(triangles))
    vertices, triangles, uv, normals, owner = (np.concatenate([part[k] for part in parts]) for k in range(5))
    return StemMesh(vertices, triangles, uv, normals, owner, np.array(faces))
