"""Everything that is neither ground nor stem, put together; what grows on and about stems near the ground."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .crowns import Crowns
from .dress import Streams
from .foliage import (
    LYING,
    ROOTED,
    Faces,
    Material,
    blades_at,
    crown,
    grass,
    scatter,
    shrubs,
    sticks_and_logs,
    sticks_between,
    tones,
    unit,
    wooden,
)
from .hardwoods import hardwood_crown
from .scene import PlantedStem
from .settings import SimulateSettings
from .stem_mesh import StemMesh
from .terrain import Ground


def _owned(parts: list[Faces], owner: list[int]) -> Faces:
    """The parts in one, each with its owner."""
    return replace(Faces.join(parts), owner=np.repeat(np.array(owner, np.int32), [len(part.corners) for part in parts]))


def all_foliage(
    rng: np.random.Generator,
    settings: SimulateSettings,
    ground: Ground,
    stems: list[PlantedStem],
    reach_m: float,
    own: Streams | None = None,
    crowns: Crowns | None = None,
) -> Faces:
    """Crowns, shrubs, grass, sticks and logs. Needle area of a tree goes with the square of its DBH, about the mean's.

    own: the streams of hardwoods and of shrubs of several kinds, needed where there are any. crowns: others' crowns,
    set on the stems in place of ours.
    """
    parts: list[Faces] = []
    owner: list[int] = []
    for index, stem in enumerate(stems):
        if stem.kind == "sapling":
            area = 0.035 * settings.leaf_area_m2 * stem.height_m / 4
        else:
            area = settings.leaf_area_m2 * (stem.dbh_m * 100 / settings.dbh_mean_cm) ** 1.6
            area *= 0.55 if stem.kind in ("branch", "fork_above") else 1.0
        if crowns is not None and stem.kind != "snag":
            parts += crowns.grow(rng, stem, index)
        elif own is not None and stem.look.hardwood:
            parts += hardwood_crown(own["hardwoods"], stem, area, settings.leaf_off)
        elif stem.kind != "snag":
            parts += crown(rng, stem, area)
        owner += [index] * (len(parts) - len(owner))
    if own is not None and settings.shrub_variety:
        parts.append(varied_shrubs(own["shrubs"], settings, ground, reach_m))
    else:
        parts.append(shrubs(rng, ground, reach_m, settings.shrubs_per_m2, settings.shrub_height_m))
    parts.append(grass(rng, ground, reach_m))
    parts.append(sticks_and_logs(rng, ground, reach_m, settings.logs))
    return _owned(parts, [*owner, ROOTED, ROOTED, LYING])


def overgrown(
    faces: Faces,
    own: Streams,
    settings: SimulateSettings,
    ground: Ground,
    stems: list[PlantedStem],
    mesh: StemMesh,
    reach_m: float,
) -> Faces:
    """The faces with what grows on and about the stems, and with the young plants; themselves if there is none."""
    parts, owner = [], []
    for index, stem in enumerate(stems):
        if stem.kind == "branch":
            continue
        if stem.look.ivy_m:
            parts.append(ivy(own["ivy"], mesh, index, stem))
            owner.append(index)
        if stem.look.wrap_m:
            parts.append(wrapping(own["wrap"], ground, stem, settings.leaf_off))
            owner.append(ROOTED)
    if settings.undergrowth_per_m2:
        parts.append(young_plants(own["shrubs"], settings.undergrowth_per_m2, ground, reach_m))
        owner.append(ROOTED)
    if not parts:
        return faces
    more = _owned(parts, owner)
    return replace(Faces.join([faces, more]), owner=np.concatenate([faces.owner, more.owner]))


#: How far ivy leaves stand off the bark, m; leaf area on each square metre of bark.
IVY_OFF_M, IVY_LEAVES = (0.03, 0.08), (1.8, 3.4)
#: Leaf area of a shrub on each square metre that it covers, and a metre of its height.
SHRUB_LEAVES = 2.2
#: Shrubs about a wrapped stem.
WRAP_SHRUBS = (4, 8)


@dataclass(frozen=True)
class ShrubKind:
    """tone: albedo. leaf_m: length of a leaf. slim: half width over height. bare: without leaves in a
    leaf-off stand."""

    tone: tuple[float, float, float]
    leaf_m: float
    slim: float
    bare: bool = False


#: Evergreen and deciduous, fine-leaved and coarse, fresh and dry.
SHRUBS = (
    ShrubKind((0.07, 0.12, 0.035), 0.05, 0.45),
    ShrubKind((0.11, 0.17, 0.05), 0.08, 0.50),
    ShrubKind((0.17, 0.23, 0.07), 0.12, 0.40, True),
    ShrubKind((0.13, 0.15, 0.09), 0.035, 0.55),
    ShrubKind((0.22, 0.22, 0.08), 0.07, 0.45, True),
    ShrubKind((0.25, 0.17, 0.08), 0.10, 0.40),
    ShrubKind((0.05, 0.095, 0.03), 0.16, 0.60),
    ShrubKind((0.19, 0.13, 0.09), 0.04, 0.35, True),
)


def _shrub(
    rng: np.random.Generator, foot: np.ndarray, tall: float, kind: ShrubKind, leaves: bool, fill: float = 1.0
) -> list[Faces]:
    """A few stems from the (3,) foot, and leaves in clumps about them; ``fill``: times the usual leaf area."""
    wide = tall * kind.slim * rng.uniform(0.75, 1.25)
    count = int(rng.integers(5, 11))
    tip = unit(rng.standard_normal((count, 3))) * rng.uniform(0.4, 1.0, (count, 1)) * [wide, wide, 0.45 * tall]
    tip = foot + tip + [0, 0, 0.55 * tall]
    start = foot + rng.normal(0, 0.04, (count, 3)) * [1, 1, 0]
    wood = sticks_between(rng, start, tip, np.full(count, 0.004 + 0.003 * tall), np.full(count, 0.002))
    bark = (0.17, 0.14, 0.11)
    parts = [wooden(rng, wood, bark)]
    twigs = count * (8 if leaves else 14)
    owner = rng.integers(0, count, twigs)
    along = rng.uniform(0.25, 1.0, (twigs, 1))
    fork = start[owner] + along * (tip - start)[owner]
    end = fork + unit(rng.standard_normal((twigs, 3)) + [0, 0, 0.4]) * (0.35 * tall * rng.uniform(0.3, 1, (twigs, 1)))
    parts.append(wooden(rng, sticks_between(rng, fork, end, np.full(twigs, 0.003), np.full(twigs, 0.0015)), bark))
    if not leaves:
        return parts
    width = 0.55 * kind.leaf_m
    number = int(fill * SHRUB_LEAVES * np.pi * wide**2 * tall / (0.5 * kind.leaf_m * width))
    twig = rng.integers(0, twigs, number)
    middle = fork[twig] + (end - fork)[twig] * rng.uniform(0, 1.1, (number, 1))
    # Down to the ground, but not below it.
    middle += rng.normal(0, 0.10 + 0.06 * tall, (number, 3))
    middle[:, 2] = np.maximum(middle[:, 2], foot[2] + 0.03)
    way = unit(unit(middle - foot - [0, 0, 0.5 * tall]) + rng.standard_normal((number, 3)))
    blades = blades_at(rng, middle, way, kind.leaf_m * rng.uniform(0.6, 1.2, number), np.full(number, width))
    tone = np.array(kind.tone) * np.exp(rng.normal(0, 0.15, 3))
    parts.append(Faces.of(Material.SHRUB, blades, tones(rng, number, tuple(tone), 0.25), 0.25))
    return parts


def _any_shrub(
    rng: np.random.Generator, foot: np.ndarray, tall: float, leaf_off: bool, fill: float = 1.0
) -> list[Faces]:
    kind = SHRUBS[rng.integers(len(SHRUBS))]
    return _shrub(rng, foot, tall, kind, not (leaf_off and kind.bare), fill)


def _feet(ground: Ground, xy: np.ndarray) -> np.ndarray:
    return np.column_stack([xy, ground.height(xy)])


def varied_shrubs(rng: np.random.Generator, settings: SimulateSettings, ground: Ground, reach_m: float) -> Faces:
    """Shrubs of several kinds."""
    parts = [Faces.none()]
    xy = scatter(rng, reach_m, settings.shrubs_per_m2)
    tallest = settings.shrub_height_m
    for foot in _feet(ground, xy):
        tall = float(np.clip(rng.lognormal(np.log(0.45 * tallest), 0.45), 0.15 * tallest, tallest))
        parts += _any_shrub(rng, foot, tall, settings.leaf_off)
    return Faces.join(parts)


def young_plants(rng: np.random.Generator, per_m2: float, ground: Ground, reach_m: float) -> Faces:
    """Young broadleaved plants: one thin stem of 0.5-2.5 m with leaves from the ground up."""
    parts = [Faces.none()]
    for foot in _feet(ground, scatter(rng, reach_m, per_m2)):
        tall, leaf = rng.uniform(0.5, 2.5), rng.uniform(0.05, 0.14)
        tip = foot + [*rng.normal(0, 0.10 * tall, 2), tall]
        thick = np.array([0.003 + 0.003 * tall])
        parts.append(wooden(rng, sticks_between(rng, foot[None], tip[None], thick, 0.3 * thick), (0.18, 0.15, 0.11)))
        count = int(140 * tall)
        share = rng.uniform(0.08, 1.0, (count, 1))
        out = unit(rng.normal(0, 1, (count, 3)) * [1, 1, 0.4] + [0, 0, 0.15])
        middle = foot + share * (tip - foot) + out * rng.uniform(0.02, 0.22, (count, 1)) * tall * (1.15 - share)
        blades = blades_at(rng, middle, out, leaf * rng.uniform(0.6, 1.2, count), np.full(count, 0.6 * leaf))
        tone = np.array(SHRUBS[rng.integers(len(SHRUBS))].tone)
        parts.append(Faces.of(Material.SHRUB, blades, tones(rng, count, tuple(tone), 0.2), 0.3))
    return Faces.join(parts)


def wrapping(rng: np.random.Generator, ground: Ground, stem: PlantedStem, leaf_off: bool) -> Faces:
    """Shrubs all round a stem, up to ``stem.look.wrap_m``."""
    number = int(rng.integers(*WRAP_SHRUBS))
    turn = 2 * np.pi * (np.arange(number) + rng.uniform(-0.3, 0.3, number)) / number
    away = stem.radii[0] + rng.uniform(0.05, 0.30, number)
    xy = stem.axis[0, :2] + away[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    tall = stem.look.wrap_m * rng.uniform(0.75, 1.0, number)
    parts = []
    for foot, height in zip(_feet(ground, xy), tall, strict=True):
        parts += _any_shrub(rng, foot, float(height), leaf_off, 2.6)
    return Faces.join(parts)


def ivy(rng: np.random.Generator, mesh: StemMesh, index: int, stem: PlantedStem) -> Faces:
    """Leaves of 4-10 cm all over the bark from the ground to about ``stem.look.ivy_m``, :data:`IVY_OFF_M` off it."""
    faces = np.arange(mesh.first[index], mesh.first[index + 1])
    along = mesh.uv[mesh.triangles[faces], 1]
    low = (along.min(axis=1) >= 0) & (along.max(axis=1) < stem.look.ivy_m)
    faces, along = faces[low], along[low]
    corners = mesh.vertices[mesh.triangles[faces]]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    size = rng.uniform(0.04, 0.10)
    count = int(rng.uniform(*IVY_LEAVES) * area.sum() / (0.5 * 0.8 * size**2))
    chosen = rng.choice(len(faces), count, p=area / area.sum())
    weight = rng.dirichlet((1.0, 1.0, 1.0), count)
    bark = (corners[chosen] * weight[..., None]).sum(axis=1)
    outward = unit((mesh.normals[mesh.triangles[faces[chosen]]] * weight[..., None]).sum(axis=1))
    height = (along[chosen] * weight).sum(axis=1)
    # Thinner towards its ragged upper end.
    kept = rng.random(count) < np.clip(3.0 * (1 - height / stem.look.ivy_m), 0.15, 1)
    bark, outward, count = bark[kept], outward[kept], int(kept.sum())
    down = unit(np.array([0, 0, -1.0]) + 0.7 * rng.standard_normal((count, 3)))
    # Leaves lie along the bark and hang, like shingles.
    way = unit(down - 0.9 * (down * outward).sum(axis=1, keepdims=True) * outward)
    across = unit(np.cross(way, outward) + 0.35 * rng.standard_normal((count, 3)))
    length = size * rng.uniform(0.7, 1.2, count)
    middle = bark + rng.uniform(*IVY_OFF_M, (count, 1)) * outward
    half = 0.4 * length[:, None] * across
    tail = way * length[:, None]
    leaves = np.stack([middle - tail / 3 - half, middle - tail / 3 + half, middle + 2 * tail / 3], axis=1)
    tone = np.array([0.055, 0.105, 0.032]) * np.exp(rng.normal(0, 0.2, 3) + rng.normal(0, 0.35))
    return Faces.of(Material.IVY, leaves, tones(rng, count, tuple(tone), 0.30), 0.15)
