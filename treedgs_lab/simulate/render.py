"""Photos: primary rays through the lens, first hits by Embree, shading by table."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numba
import numpy as np

from treedgs_geo.reconstruction.cameras import View

from .camera import STILL, Motion
from .casting import cast
from .light import Light
from .world import World

#: Rays a batch: bounds memory (about 80 bytes a ray).
BATCH_RAYS = 600_000
#: Linear albedo of moss and lichen on bark.
MOSS, LICHEN = (0.11, 0.17, 0.04), (0.29, 0.32, 0.26)


class _Lens(NamedTuple):
    """A photo's camera: width, height and lens in pixels, rounds of the inverse distortion, (3, 3) rotation world ->
    camera, (3,) centre."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    k1: float
    k2: float
    k3: float
    p1: float
    p2: float
    rounds: int
    rotation: np.ndarray
    centre: np.ndarray


def _lens(view: View) -> _Lens:
    camera = view.camera
    corner = np.array([camera.width / camera.fx, camera.height / camera.fy]) / 2
    shift = np.subtract(camera.distort(corner[:1], corner[1:]), (corner[:1], corner[1:]))
    # Each round leaves less than three times the distortion's share of what the round before left.
    rounds = 4 if np.linalg.norm(shift) < 0.02 * np.linalg.norm(corner) else 20
    own = [getattr(camera, name) for name in _Lens._fields[:-3]]
    return _Lens._make([*own, rounds, view.rotation, view.centre])


class _GroundLook(NamedTuple):
    """(n, n, 3) coded colours and (m, m, 3) light, each with its corner and cell, metres."""

    colour: np.ndarray
    low: float
    step: float
    light: np.ndarray
    light_low: float
    light_step: float


class _StemLook(NamedTuple):
    """Stem triangles with their (vertices, 2) place on the bark and (vertices, 3) light; owner: stem of each triangle;
    bark, tile, cover, masks: as :class:`.barks.Barks` has them; offset: (stems, 3) shifts and brightness."""

    triangles: np.ndarray
    place: np.ndarray
    light: np.ndarray
    owner: np.ndarray
    bark: np.ndarray
    tile: np.ndarray
    cover: np.ndarray
    masks: np.ndarray
    offset: np.ndarray


class _Hits(NamedTuple):
    """What (N, 6) rays met first: (N,) distance, (N,) primitive id (over ground, stems, then faces), (N, 2) place."""

    rays: np.ndarray
    distance: np.ndarray
    primitive: np.ndarray
    uv: np.ndarray


@numba.njit(parallel=True, cache=True)
def _primary_rays(first_row, rows, samples, lens, motion, seed, rays):
    """Rays of ``rows`` image rows, ``samples`` a pixel (a rank-1 lattice with a shift hashed from the pixel). Each has
    its own time: that of its row, and within the exposure."""
    width, height, fx, fy, cx, cy, k1, k2, k3, p1, p2, rounds, rotation, centre = lens
    travel, turn, blur, blur_turn = motion
    for r in numba.prange(rows):
        for c in range(width):
            key = np.uint32((first_row + r) * 73856093) ^ np.uint32(c * 19349663) ^ np.uint32(seed)
            key = np.uint32((key ^ (key >> np.uint32(16))) * np.uint32(0x45D9F3B))
            key = np.uint32((key ^ (key >> np.uint32(16))) * np.uint32(0x45D9F3B))
            key = key ^ (key >> np.uint32(16))
            shift_u = (key & np.uint32(0xFFFF)) / 65536.0
            shift_v = (key >> np.uint32(16)) / 65536.0
            shift_t = (np.uint32(key * np.uint32(0x9E3779B1)) >> np.uint32(16)) / 65536.0
            for k in range(samples):
                u = c + (shift_u + k * 0.7548776662) % 1.0
                v = first_row + r + (shift_v + (k + 0.5) / samples) % 1.0
                row_time = v / height - 0.5
                open_time = (shift_t + k * 0.5698402910) % 1.0 - 0.5
                xd = (u - cx) / fx
                yd = (v - cy) / fy
                x, y = xd, yd
                for _ in range(rounds):
                    r2 = x * x + y * y
                    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
                    dx = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
                    dy = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
                    x, y = (xd - dx) / radial, (yd - dy) / radial
                # A small turn about the camera's axes: d + angle x d.
                ax = turn[0] * row_time + blur_turn[0] * open_time
                ay = turn[1] * row_time + blur_turn[1] * open_time
                az = turn[2] * row_time + blur_turn[2] * open_time
                tx, ty, tz = x + ay - az * y, y + az * x - ax, 1.0 + ax * y - ay * x
                i = (r * width + c) * samples + k
                for a in range(3):
                    rays[i, a] = centre[a] + travel[a] * row_time + blur[a] * open_time
                    rays[i, 3 + a] = tx * rotation[0, a] + ty * rotation[1, a] + tz * rotation[2, a]


@numba.njit(cache=True, inline="always")
def _bilinear(image, top, bottom, left, right, down, across, a):
    """Channel ``a`` between four pixels: ``down`` and ``across`` are the shares of the later row and column."""
    return (image[top, left, a] * (1 - across) + image[top, right, a] * across) * (1 - down) + (
        image[bottom, left, a] * (1 - across) + image[bottom, right, a] * across
    ) * down


@numba.njit(cache=True, inline="always")
def _ground_light(x, y, ground):
    """Red, green and blue radiance of the ground at x, y."""
    texture, tex_low, tex_step, floor, floor_low, floor_step = ground
    tex_n, floor_n = texture.shape[0], floor.shape[0]
    col = (x - tex_low) / tex_step - 0.5
    row = (y - tex_low) / tex_step - 0.5
    c0, r0 = int(np.floor(col)), int(np.floor(row))
    fc, fr = col - c0, row - r0
    top, bottom, left, right = r0 % tex_n, (r0 + 1) % tex_n, c0 % tex_n, (c0 + 1) % tex_n
    col = min(max((x - floor_low) / floor_step - 0.5, 0.0), floor_n - 1.001)
    row = min(max((y - floor_low) / floor_step - 0.5, 0.0), floor_n - 1.001)
    c1, r1 = int(col), int(row)
    gc, gr = col - c1, row - r1
    red = _bilinear(texture, top, bottom, left, right, fr, fc, 0) / 255.0
    green = _bilinear(texture, top, bottom, left, right, fr, fc, 1) / 255.0
    blue = _bilinear(texture, top, bottom, left, right, fr, fc, 2) / 255.0
    return (
        red * red * _bilinear(floor, r1, r1 + 1, c1, c1 + 1, gr, gc, 0),
        green * green * _bilinear(floor, r1, r1 + 1, c1, c1 + 1, gr, gc, 1),
        blue * blue * _bilinear(floor, r1, r1 + 1, c1, c1 + 1, gr, gc, 2),
    )


@numba.njit(cache=True, inline="always")
def _covered(share, rank):
    """How much of a texel is under moss or lichen: its rank of 255 against the share of the bark that is."""
    return min(max((share - rank / 255.0) / 0.12 + 0.5, 0.0), 1.0) * 0.9


@numba.njit(cache=True, inline="always")
def _bark_light(f, b1, b2, stems):
    """Red, green and blue radiance of stem triangle f at barycentric b1, b2."""
    triangles, place, light, owner, bark, tile, cover, masks, offset = stems
    bark_h, bark_w = bark.shape[1], bark.shape[2]
    i0, i1, i2 = triangles[f, 0], triangles[f, 1], triangles[f, 2]
    b0 = 1.0 - b1 - b2
    s = owner[f]
    around = place[i0, 0] * b0 + place[i1, 0] * b1 + place[i2, 0] * b2
    along = place[i0, 1] * b0 + place[i1, 1] * b1 + place[i2, 1] * b2
    col = ((around * 0.5 + offset[s, 0]) % 1.0) * bark_w
    row = ((along + offset[s, 1]) / 0.005) % bark_h
    if row < 0:
        row += bark_h
    c0, r0 = int(col) % bark_w, int(row) % bark_h
    t = tile[s]
    red, green, blue = bark[t, r0, c0, 0] / 255.0, bark[t, r0, c0, 1] / 255.0, bark[t, r0, c0, 2] / 255.0
    red, green, blue = red * red, green * green, blue * blue
    if cover[s, 0] > 0:
        # Most of it on the lowest metre and a half, and on the north side (a quarter turn).
        share = cover[s, 0] * 1.81 * np.exp(-max(along, 0.0) / 1.5) * (1 + 0.8 * np.sin(2 * np.pi * around))
        share = _covered(share, masks[0, r0, c0])
        red += share * (MOSS[0] - red)
        green += share * (MOSS[1] - green)
        blue += share * (MOSS[2] - blue)
    if cover[s, 1] > 0:
        share = _covered(cover[s, 1], masks[1, r0, c0])
        red += share * (LICHEN[0] - red)
        green += share * (LICHEN[1] - green)
        blue += share * (LICHEN[2] - blue)
    return (
        red * (light[i0, 0] * b0 + light[i1, 0] * b1 + light[i2, 0] * b2) * offset[s, 2],
        green * (light[i0, 1] * b0 + light[i1, 1] * b1 + light[i2, 1] * b2) * offset[s, 2],
        blue * (light[i0, 2] * b0 + light[i1, 2] * b1 + light[i2, 2] * b2) * offset[s, 2],
    )


@numba.njit(parallel=True, cache=True)
def _shade(hits, samples, counts, ground, stems, faces, haze, out):
    """Mean radiance of each pixel's samples into ``out`` (pixels, 3). counts: triangles of the ground and of the stems.
    faces: (F, 3) light of the other triangles."""
    rays, distance, primitive, uv = hits
    ground_faces, stem_faces = counts
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
                r, g, b = _ground_light(rays[i, 0] + t * rays[i, 3], rays[i, 1] + t * rays[i, 4], ground)
            elif prim < ground_faces + stem_faces:
                r, g, b = _bark_light(prim - ground_faces, uv[i, 0], uv[i, 1], stems)
            else:
                f = prim - ground_faces - stem_faces
                r, g, b = faces[f, 0], faces[f, 1], faces[f, 2]
            red, green, blue = red + r, green + g, blue + b
        out[p, 0] = red / samples * (1 - haze) + haze * 0.22
        out[p, 1] = green / samples * (1 - haze) + haze * 0.25
        out[p, 2] = blue / samples * (1 - haze) + haze * 0.29


def radiance(
    world: World,
    light: Light,
    view: View,
    samples: int,
    seed: int,
    haze: float = 0.03,
    motion: Motion = STILL,
    looked: Callable[[slice, np.ndarray, np.ndarray], None] | None = None,
) -> np.ndarray:
    """(height, width, 3) float32 linear radiance through a perfect lens of the view's distortion.

    The pose is that of the middle row in the middle of its exposure; motion: what the camera does about it. looked: is
    given pixels (row-major), and distance and primitive of what their rays meet.
    """
    width, height = view.camera.width, view.camera.height
    mesh, texture = world.mesh, world.texture
    counts = (world.ground_faces, world.stem_faces)
    ground = _GroundLook(texture.colour, texture.low, texture.step, light.ground, light.low, light.step)
    look = world.barks
    stems = _StemLook(
        mesh.triangles,
        mesh.uv,
        light.stems,
        mesh.owner,
        look.tiles,
        look.tile,
        look.cover,
        look.masks,
        world.bark_offset,
    )
    image = np.empty((height * width, 3), np.float32)
    for pixels, hits in _first_hits(world, view, samples, seed, motion):
        _shade(hits, samples, counts, ground, stems, light.faces, haze, image[pixels])
        if looked is not None:
            looked(pixels, hits.distance, hits.primitive)
    return image.reshape(height, width, 3)


def _first_hits(world: World, view: View, samples: int, seed: int, motion: Motion) -> Iterator[tuple[slice, _Hits]]:
    """What the rays of a photo meet first, ``samples`` a pixel: the pixels (row-major) and their hits, part by part.
    Each part's arrays are good until the next."""
    width, height = view.camera.width, view.camera.height
    lens = _lens(view)
    rows_a_batch = max(1, BATCH_RAYS // (width * samples))
    rays = np.empty((rows_a_batch * width * samples, 6), np.float32)
    for row in range(0, height, rows_a_batch):
        rows = min(rows_a_batch, height - row)
        part = rays[: rows * width * samples]
        _primary_rays(row, rows, samples, lens, motion, seed & 0x7FFFFFFF, part)
        yield slice(row * width, (row + rows) * width), _Hits(part, *cast(world.scene, part))
