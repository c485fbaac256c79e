"""Everything that is neither ground nor stem, put together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .dress import Streams
from .foliage import LYING, ROOTED, Faces, crown, grass, shrubs, sticks_and_logs
from .hardwoods import hardwood_crown
from .scene import PlantedStem
from .settings import SimulateSettings
from .stem_mesh import StemMesh
from .terrain import Ground
from .undergrowth import ivy, varied_shrubs, wrapping, young_plants


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
) -> Faces:
    """Crowns, shrubs, grass, sticks and logs. Needle area of a tree goes with the square of its DBH, about the mean's.

    own: the streams of hardwoods and of shrubs of several kinds, needed where there are any.
    """
    parts: list[Faces] = []
    owner: list[int] = []
    for index, stem in enumerate(stems):
        if stem.kind == "sapling":
            area = 0.035 * settings.leaf_area_m2 * stem.height_m / 4
        else:
            area = settings.leaf_area_m2 * (stem.dbh_m * 100 / settings.dbh_mean_cm) ** 1.6
            area *= 0.55 if stem.kind in ("branch", "fork_above") else 1.0
        if own is not None and stem.look.hardwood:
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
