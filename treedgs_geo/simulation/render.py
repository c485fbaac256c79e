"""Photos: primary rays through the lens, first hits by Embree, shading by table, then sensor and tone curve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numba
import numpy as np

from ..reconstruction.cameras import View
from .casting import cast, make_scene
from .foliage import Faces
from .light import Light
from .scene import StemMesh
from .terrain import Ground
from .textures import GroundTexture

#: Rays a batch: bounds memory (about 80 bytes a ray).
BATCH_RAYS = 600_000


@dataclass(frozen=True)
class World:
    """Everything that rays can hit, in one scene; primitive ids run over ground, stems, then faces.

    scene: ``open3d.t.geometry.RaycastingScene``. stem_owner: (F_stems,) stem index of each stem triangle.
    """

    scene: Any
    ground: Ground
    mesh: StemMesh
    faces: Faces
    texture: GroundTexture
    bark: np.ndarray
    bark_offset: np.ndarray
    ground_faces: int
    stem_faces: int

    @property
    def stem_owner(self) -> np.ndarray:
        return self.mesh.owner

    def first_hits(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N, 3) each -> distance (N,) in lengths of ``directions`` (inf = none), primitive id (N,) (-1 = none)."""
        rays = np.concatenate([np.broadcast_to(origins, directions.shape), directions], axis=1)
        distance, primitive, _ = cast(self.scene, rays)
        return distance, np.where(np.isfinite(distance), primitive.astype(np.int64), -1)


def build_world(
    ground: Ground, mesh: StemMesh, faces: Faces, texture: GroundTexture, bark: np.ndarray, rng: np.random.Generator
) -> World:
    """One Embree scene of ground, stems and faces; per-stem shifts of the bark tile so that no two look alike."""
    scene = scene_of(ground, mesh, faces)
    count = len(mesh.first) - 1
    shift = np.column_stack([rng.uniform(0, 1, count), rng.uniform(0, 30, count), rng.uniform(0.75, 1.3, count)])
    return World(
        scene,
        ground,
        mesh,
        faces,
        texture,
        bark,
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


@numba.njit(parallel=True, cache=True)
def _primary_rays(first_row, rows, width, samples, fx, fy, cx, cy, k1, k2, rotation, centre, seed, rays):
    """Rays of ``rows`` image rows, ``samples`` a pixel (a rank-1 lattice with a shift hashed from the pixel)."""
    for r in numba.prange(rows):
        for c in range(width):
            key = np.uint32((first_row + r) * 73856093) ^ np.uint32(c * 19349663) ^ np.uint32(seed)
            key = np.uint32((key ^ (key >> np.uint32(16))) * np.uint32(0x45D9F3B))
            key = np.uint32((key ^ (key >> np.uint32(16))) * np.uint32(0x45D9F3B))
            key = key ^ (key >> np.uint32(16))
            shift_u = (key & np.uint32(0xFFFF)) / 65536.0
            shift_v = (key >> np.uint32(16)) / 65536.0
            for k in range(samples):
                u = c + (shift_u + k * 0.7548776662) % 1.0
                v = first_row + r + (shift_v + (k + 0.5) / samples) % 1.0
                xd = (u - cx) / fx
                yd = (v - cy) / fy
                x, y = xd, yd
                for _ in range(4):
                    r2 = x * x + y * y
                    radial = 1.0 + r2 * (k1 + r2 * k2)
                    x, y = xd / radial, yd / radial
                i = (r * width + c) * samples + k
                for a in range(3):
                    rays[i, a] = centre[a]
                    rays[i, 3 + a] = x * rotation[0, a] + y * rotation[1, a] + rotation[2, a]


@numba.njit(parallel=True, cache=True)
def _shade(
    rays,
    distance,
    primitive,
    uv,
    samples,
    ground_faces,
    stem_faces,
    texture,
    tex_low,
    tex_step,
    floor,
    floor_low,
    floor_step,
    triangles,
    stem_uv,
    stem_light,
    owner,
    bark,
    bark_offset,
    face_light,
    haze,
    out,
):
    """Mean radiance of each pixel's samples into ``out`` (pixels, 3)."""
    tex_n, floor_n = texture.shape[0], floor.shape[0]
    bark_h, bark_w = bark.shape[0], bark.shape[1]
    for p in numba.prange(out.shape[0]):
        red = green = blue = 0.0
        for k in range(samples):
            i = p * samples + k
            t = distance[i]
            if not np.isfinite(t):
                red, green, blue = red + 0.3, green + 0.36, blue + 0.42
                continue
            prim = np.int64(primitive[i])
            if prim < ground_faces:
                x = rays[i, 0] + t * rays[i, 3]
                y = rays[i, 1] + t * rays[i, 4]
                col = (x - tex_low) / tex_step - 0.5
                row = (y - tex_low) / tex_step - 0.5
                c0, r0 = int(np.floor(col)), int(np.floor(row))
                fc, fr = col - c0, row - r0
                col = min(max((x - floor_low) / floor_step - 0.5, 0.0), floor_n - 1.001)
                row = min(max((y - floor_low) / floor_step - 0.5, 0.0), floor_n - 1.001)
                c1, r1 = int(col), int(row)
                gc, gr = col - c1, row - r1
                for a in range(3):
                    t00 = texture[r0 % tex_n, c0 % tex_n, a]
                    t01 = texture[r0 % tex_n, (c0 + 1) % tex_n, a]
                    t10 = texture[(r0 + 1) % tex_n, c0 % tex_n, a]
                    t11 = texture[(r0 + 1) % tex_n, (c0 + 1) % tex_n, a]
                    code = ((t00 * (1 - fc) + t01 * fc) * (1 - fr) + (t10 * (1 - fc) + t11 * fc) * fr) / 255.0
                    light = (floor[r1, c1, a] * (1 - gc) + floor[r1, c1 + 1, a] * gc) * (1 - gr) + (
                        floor[r1 + 1, c1, a] * (1 - gc) + floor[r1 + 1, c1 + 1, a] * gc
                    ) * gr
                    value = code * code * light
                    if a == 0:
                        red += value
                    elif a == 1:
                        green += value
                    else:
                        blue += value
            elif prim < ground_faces + stem_faces:
                f = prim - ground_faces
                i0, i1, i2 = triangles[f, 0], triangles[f, 1], triangles[f, 2]
                b1, b2 = uv[i, 0], uv[i, 1]
                b0 = 1.0 - b1 - b2
                s = owner[f]
                around = stem_uv[i0, 0] * b0 + stem_uv[i1, 0] * b1 + stem_uv[i2, 0] * b2
                along = stem_uv[i0, 1] * b0 + stem_uv[i1, 1] * b1 + stem_uv[i2, 1] * b2
                col = ((around * 0.5 + bark_offset[s, 0]) % 1.0) * bark_w
                row = ((along + bark_offset[s, 1]) / 0.005) % bark_h
                if row < 0:
                    row += bark_h
                c0, r0 = int(col) % bark_w, int(row) % bark_h
                for a in range(3):
                    code = bark[r0, c0, a] / 255.0
                    light = stem_light[i0, a] * b0 + stem_light[i1, a] * b1 + stem_light[i2, a] * b2
                    value = code * code * light * bark_offset[s, 2]
                    if a == 0:
                        red += value
                    elif a == 1:
                        green += value
                    else:
                        blue += value
            else:
                f = prim - ground_faces - stem_faces
                red += face_light[f, 0]
                green += face_light[f, 1]
                blue += face_light[f, 2]
        out[p, 0] = red / samples * (1 - haze) + haze * 0.22
        out[p, 1] = green / samples * (1 - haze) + haze * 0.25
        out[p, 2] = blue / samples * (1 - haze) + haze * 0.29


def radiance(world: World, light: Light, view: View, samples: int, seed: int, haze: float = 0.03) -> np.ndarray:
    """(height, width, 3) float32 linear radiance through a perfect lens of the view's distortion."""
    camera = view.camera
    width, height = camera.width, camera.height
    image = np.empty((height * width, 3), np.float32)
    rows_a_batch = max(1, BATCH_RAYS // (width * samples))
    rays = np.empty((rows_a_batch * width * samples, 6), np.float32)
    for row in range(0, height, rows_a_batch):
        rows = min(rows_a_batch, height - row)
        part = rays[: rows * width * samples]
        _primary_rays(
            row,
            rows,
            width,
            samples,
            camera.fx,
            camera.fy,
            camera.cx,
            camera.cy,
            camera.k1,
            camera.k2,
            view.rotation,
            view.centre,
            seed & 0x7FFFFFFF,
            part,
        )
        distance, primitive, corner = cast(world.scene, part)
        _shade(
            part,
            distance,
            primitive,
            corner,
            samples,
            world.ground_faces,
            world.stem_faces,
            world.texture.colour,
            world.texture.low,
            world.texture.step,
            light.ground,
            light.low,
            light.step,
            world.mesh.triangles,
            world.mesh.uv,
            light.stems,
            world.mesh.owner,
            world.bark,
            world.bark_offset,
            light.faces,
            haze,
            image[row * width : (row + rows) * width],
        )
    return image.reshape(height, width, 3)


def develop(
    image: np.ndarray,
    exposure: float,
    white: np.ndarray,
    rng: np.random.Generator,
    blur_px: float = 0.55,
    full_well: float = 7000.0,
) -> np.ndarray:
    """Linear radiance -> (height, width, 3) uint8 sRGB: lens blur, exposure and white balance, shot and read noise."""
    sharp = cv2.GaussianBlur(image, (0, 0), blur_px) * (exposure * np.asarray(white, np.float32))
    noise = rng.standard_normal(sharp.shape, dtype=np.float32)
    noisy = sharp + noise * np.sqrt(np.maximum(sharp, 0) / full_well + 0.0015**2, dtype=np.float32)
    linear = np.clip(noisy, 0, 1)
    coded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return (255 * coded + 0.5).astype(np.uint8)
