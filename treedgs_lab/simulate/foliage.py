"""What stands in the way: crowns of needle tufts, dead branches, shrubs, sapling crowns, grass, logs and sticks.

Everything is loose triangles with one albedo and one transmittance a face; crowns far from the photographed ground are
made of fewer, larger needles of the same total area (they only cast shadows and close the view).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import IntEnum
from pathlib import Path

import numpy as np

from .scene import PlantedStem, axis_at
from .sensor import linear_light
from .terrain import Ground
from .textures import read_photographs

#: Owner of shrubs and grass, and of sticks and logs.
ROOTED, LYING = -1, -2


class Material(IntEnum):
    """What a face is. WOOD: branches and twigs, sticks and logs (not the stems, which are a mesh of their own).
    SCANNED: a patch about a point of a scan, whatever it is."""

    FOLIAGE = 1
    SHRUB = 2
    GRASS = 3
    WOOD = 4
    IVY = 5
    SCANNED = 6


@dataclass(frozen=True)
class Faces:
    """corners (F, 3, 3) float32; albedo (F, 3) float32 linear; through (F,) float32 share of light let through; kind
    (F,) uint8 :class:`Material`; owner (F,) index of the stem that a face grows on, :data:`ROOTED` or :data:`LYING`
    (only of :func:`.vegetation.all_foliage`)."""

    corners: np.ndarray
    albedo: np.ndarray
    through: np.ndarray
    kind: np.ndarray
    owner: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))

    @staticmethod
    def of(kind: Material, corners: np.ndarray, albedo: np.ndarray, through: float) -> Faces:
        """Faces that are all of one material and let the same share of light through."""
        count = len(corners)
        return Faces(corners, albedo, np.full(count, through), np.full(count, kind, np.uint8))

    @staticmethod
    def none() -> Faces:
        """No face."""
        return Faces.of(Material.FOLIAGE, np.zeros((0, 3, 3)), np.zeros((0, 3)), 0.0)

    @staticmethod
    def join(parts: list[Faces]) -> Faces:
        """Concatenate (without owners)."""
        return Faces(
            *(
                np.concatenate([getattr(part, name) for part in parts]).astype(dtype)
                for name, dtype in (
                    ("corners", np.float32),
                    ("albedo", np.float32),
                    ("through", np.float32),
                    ("kind", np.uint8),
                )
            )
        )


def unit(vectors: np.ndarray) -> np.ndarray:
    """(..., 3) vectors at length 1."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)


def blades_at(
    rng: np.random.Generator, start: np.ndarray, direction: np.ndarray, length: np.ndarray, width: np.ndarray
) -> np.ndarray:
    """(N, 3, 3) pointed blades: base edge of ``width`` at ``start``, tip ``length`` along ``direction``."""
    across = unit(np.cross(direction, rng.standard_normal(direction.shape))) * (width / 2)[:, None]
    return np.stack([start - across, start + across, start + direction * length[:, None]], axis=1)


def sticks_between(
    rng: np.random.Generator, start: np.ndarray, end: np.ndarray, r0: np.ndarray, r1: np.ndarray
) -> np.ndarray:
    """(4 N, 3, 3): each stick is two crossed tapering quads."""
    axis = unit(end - start)
    first = unit(np.cross(axis, rng.standard_normal(axis.shape)))
    second = np.cross(axis, first)
    faces = []
    for side in (first, second):
        a, b = start - side * r0[:, None], start + side * r0[:, None]
        c, d = end - side * r1[:, None], end + side * r1[:, None]
        faces += [np.stack([a, b, d], 1), np.stack([a, d, c], 1)]
    return np.concatenate(faces)


def tones(rng: np.random.Generator, count: int, base: tuple[float, float, float], spread: float) -> np.ndarray:
    """(count, 3) linear albedos about ``base``; ``spread``: of the logarithm of their brightness."""
    return np.clip(
        np.array(base) * np.exp(rng.normal(0, spread, (count, 1))) * np.exp(rng.normal(0, 0.10, (count, 3))), 0.004, 0.9
    )


def crown(rng: np.random.Generator, stem: PlantedStem, leaf_area_m2: float) -> list[Faces]:
    """Whorled branches from the crown base up, needle tufts on their outer two thirds, dead branches below."""
    parts = []
    crown_length = stem.height_m - stem.crown_base_m
    reach_max = 1.0 + 4.0 * stem.dbh_m if stem.kind != "sapling" else 0.45 + 0.10 * stem.height_m
    whorls = max(3, int(crown_length / 0.55))
    height = np.repeat(stem.crown_base_m + crown_length * (np.arange(whorls) + 0.3) / whorls, 5)
    height = height + rng.normal(0, 0.10, len(height))
    height = np.clip(height, 0.2 * stem.height_m, stem.height_m - 0.05)
    keep = rng.random(len(height)) < 0.88
    height = height[keep]
    share = (height - stem.crown_base_m) / crown_length
    share = np.clip(share, 0, 1)
    profile = np.clip(np.minimum(1.0, 0.55 + 2.2 * share) * (1.02 - share) ** 0.75, 0.06, 1)
    reach = reach_max * profile * rng.uniform(0.7, 1.15, len(height))
    azimuth = rng.uniform(0, 2 * np.pi, len(height))
    rise = np.radians(rng.normal(12, 10, len(height)) + 32 * share)
    direction = np.column_stack([np.cos(azimuth) * np.cos(rise), np.sin(azimuth) * np.cos(rise), np.sin(rise)])
    foot = axis_at(stem, height)[0]
    tip = foot + direction * reach[:, None]
    wood = sticks_between(rng, foot, tip, np.maximum(0.010, 0.011 * reach), np.full(len(reach), 0.003))
    parts.append(wooden(rng, wood, (0.15, 0.115, 0.085)))
    parts.append(dead_branches(rng, stem))
    if stem.status == "dead" or leaf_area_m2 <= 0:
        return parts
    length, width = ((0.17, 0.021), (0.21, 0.030), (0.55, 0.11), (0.34, 0.050))[2 - stem.detail]
    total = int(leaf_area_m2 / (0.5 * length * width))
    per_tuft = 12 if stem.detail else 6
    tufts = max(8, total // per_tuft)
    branch = rng.choice(len(reach), tufts, p=reach / reach.sum())
    # Tufts sit on twigs beside the branch, denser towards its end.
    along = np.sqrt(rng.uniform(0.10, 1.0, tufts))
    twig = rng.normal(0, 1, (tufts, 3)) * (0.16 * reach[branch] * (1.15 - along) + 0.05)[:, None] * [1, 1, 0.55]
    centre = foot[branch] + direction[branch] * (reach[branch] * along)[:, None] + twig
    way = unit(direction[branch] + 0.5 * rng.standard_normal((tufts, 3)) + [0, 0, 0.25])
    owner = np.repeat(np.arange(tufts), per_tuft)
    needle = unit(way[owner] + 0.75 * rng.standard_normal((len(owner), 3)))
    blades = blades_at(
        rng, centre[owner], needle, length * rng.uniform(0.7, 1.2, len(owner)), np.full(len(owner), width)
    )
    tone = np.exp(rng.normal(0, 0.08)) * np.array([0.100, 0.150, 0.058]) * np.array([rng.uniform(0.88, 1.2), 1, 1])
    albedo = tones(rng, tufts, tuple(tone), 0.20)[owner] * np.exp(rng.normal(0, 0.12, (len(owner), 1)))
    brown = (rng.random(tufts) < 0.012)[owner]
    albedo[brown] = np.array([0.40, 0.22, 0.09])
    parts.append(Faces.of(Material.FOLIAGE, blades, albedo, 0.25))
    return parts


def dead_branches(rng: np.random.Generator, stem: PlantedStem) -> Faces:
    """What is left of branches below the crown; a sapling has none."""
    count = rng.poisson(9 if stem.detail else 2)
    if not count or stem.kind == "sapling":
        return Faces.none()
    s = rng.uniform(0.16, 1.0, count) * stem.crown_base_m
    turn, drop = rng.uniform(0, 2 * np.pi, count), rng.normal(-0.05, 0.25, count)
    way = unit(np.column_stack([np.cos(turn), np.sin(turn), drop]))
    start = axis_at(stem, s)[0]
    length = rng.uniform(0.3, 1.5, (count, 1))
    sticks = sticks_between(rng, start, start + way * length, np.full(count, 0.011), np.full(count, 0.005))
    return wooden(rng, sticks, (0.24, 0.215, 0.19))


def wooden(rng: np.random.Generator, faces: np.ndarray, tone: tuple[float, float, float]) -> Faces:
    """(F, 3, 3) triangles of wood of about that albedo."""
    return Faces.of(Material.WOOD, faces, np.array(tone) * np.exp(rng.normal(0, 0.25, (len(faces), 1))), 0.0)


def scatter(rng: np.random.Generator, reach_m: float, per_m2: float) -> np.ndarray:
    """(N, 2) places at random within ``reach_m`` of the origin."""
    count = rng.poisson(per_m2 * np.pi * reach_m**2)
    radius, turn = reach_m * np.sqrt(rng.random(count)), rng.uniform(0, 2 * np.pi, count)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])


def shrubs(rng: np.random.Generator, ground: Ground, reach_m: float, per_m2: float, tallest_m: float = 2.0) -> Faces:
    """Leafy balls of 0.25 m up to ``tallest_m``, usually a third of it; 260 leaves a metre of height."""
    spot = scatter(rng, reach_m, per_m2)
    parts = []
    for xy in spot:
        tall = float(np.clip(rng.lognormal(np.log(0.375 * tallest_m), 0.5), 0.25, tallest_m))
        count = int(260 * tall * rng.uniform(0.6, 1.5))
        shell = unit(rng.standard_normal((count, 3))) * rng.uniform(0.35, 1.0, (count, 1)) ** 0.6
        wide = tall * rng.uniform(0.35, 0.6)
        centre = np.array([*xy, float(ground.height(xy[None])[0]) + 0.52 * tall]) + shell * [wide, wide, 0.5 * tall]
        blades = blades_at(
            rng,
            centre,
            unit(shell + rng.standard_normal((count, 3))),
            rng.uniform(0.05, 0.11, count),
            rng.uniform(0.03, 0.06, count),
        )
        tone = rng.choice(3)
        base = ((0.11, 0.17, 0.05), (0.16, 0.20, 0.07), (0.20, 0.16, 0.09))[tone]
        parts.append(Faces.of(Material.SHRUB, blades, tones(rng, count, base, 0.28), 0.25))
    return Faces.join(parts) if parts else Faces.none()


def grass(rng: np.random.Generator, ground: Ground, reach_m: float, per_m2: float = 4.0) -> Faces:
    """Tufts of six blades, 12-35 cm."""
    spot = np.repeat(scatter(rng, reach_m, per_m2), 6, axis=0)
    spot += rng.normal(0, 0.03, spot.shape)
    way = unit(rng.normal(0, 0.5, (len(spot), 3)) + [0, 0, 1])
    blades = blades_at(
        rng,
        np.column_stack([spot, ground.height(spot)]),
        way,
        rng.uniform(0.12, 0.35, len(spot)),
        np.full(len(spot), 0.014),
    )
    return Faces.of(Material.GRASS, blades, tones(rng, len(spot), (0.26, 0.25, 0.11), 0.3), 0.2)


def sticks_and_logs(
    rng: np.random.Generator, ground: Ground, reach_m: float, logs: int, sticks_per_m2: float = 0.22
) -> Faces:
    """Fallen branches (grey, 0.5-2.5 m) and logs of 10-25 cm."""
    foot = scatter(rng, reach_m, sticks_per_m2)
    turn, length = rng.uniform(0, 2 * np.pi, len(foot)), rng.uniform(0.5, 2.5, len(foot))
    end = foot + length[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    lift = rng.uniform(0.01, 0.10, (2, len(foot)))
    faces = sticks_between(
        rng,
        np.column_stack([foot, ground.height(foot) + lift[0]]),
        np.column_stack([end, ground.height(end) + lift[1]]),
        rng.uniform(0.008, 0.022, len(foot)),
        np.full(len(foot), 0.006),
    )
    parts = [wooden(rng, faces, (0.33, 0.31, 0.28))]
    for _ in range(logs):
        xy = rng.uniform(-0.8, 0.8, 2) * reach_m
        heading, long, radius = rng.uniform(0, 2 * np.pi), rng.uniform(2, 6), rng.uniform(0.05, 0.12)
        ends = np.stack([xy, xy + long * np.array([np.cos(heading), np.sin(heading)])])
        axis = np.column_stack([ends, ground.height(ends) + 0.7 * radius])
        points = np.linspace(axis[0], axis[1], 12)
        way = unit(axis[1] - axis[0])
        side = unit(np.cross(way, [0, 0, 1.0]))
        up = np.cross(side, way)
        theta = 2 * np.pi * np.arange(11) / 10
        ring = points[:, None] + radius * (np.cos(theta)[None, :, None] * side + np.sin(theta)[None, :, None] * up)
        a, b, c, d = ring[:-1, :-1], ring[:-1, 1:], ring[1:, :-1], ring[1:, 1:]
        tube = np.concatenate([np.stack([a, b, d], 2).reshape(-1, 3, 3), np.stack([a, d, c], 2).reshape(-1, 3, 3)])
        parts.append(wooden(rng, tube, (0.22, 0.18, 0.145)))
    return Faces.join(parts)


def photographed_leaves(folder: Path) -> list[np.ndarray]:
    """(N, 3) linear colours of the leaves in each photograph of a folder: of its opaque pixels.

    Raises:
        InputError: none is there.
    """
    photos = read_photographs(folder, "ones of leaves")
    shown = (photo[photo[..., 3] > 250] if photo.shape[2] == 4 else photo.reshape(-1, 3) for photo in photos)
    return [linear_light(colours[:, :3] / np.float32(255)) for colours in shown]


def in_colours(rng: np.random.Generator, faces: Faces, photos: list[np.ndarray]) -> Faces:
    """Leaves of crowns, shrubs and ivy in colours of photographs, those of a tree in one's: a leaf is smaller than a
    pixel, so that nothing but its colour shows."""
    leaf = np.isin(faces.kind, (Material.FOLIAGE, Material.SHRUB, Material.IVY))
    albedo = faces.albedo.copy()
    photo = np.where(faces.owner >= 0, faces.owner, rng.integers(len(photos), size=len(leaf))) % len(photos)
    for number, colours in enumerate(photos):
        own = leaf & (photo == number)
        albedo[own] = colours[rng.integers(len(colours), size=int(own.sum()))]
    return replace(faces, albedo=albedo)
