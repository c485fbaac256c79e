"""Crowns of hardwoods: limbs that fork into branches and twigs, with broad leaves or bare."""

from __future__ import annotations

import numpy as np

from .foliage import Faces, Material, blades_at, sticks_between, tones, unit, wooden
from .scene import PlantedStem, axis_at

#: Length and width of a leaf by 2 - detail of its tree, m; far crowns have larger ones of the same total area.
LEAF_M = ((0.09, 0.06), (0.115, 0.075), (0.40, 0.22), (0.24, 0.14))
#: The lowest limb, of the height that a pine's crown begins at.
LOWEST_LIMB = 0.6
#: Limbs, branches a limb and twigs a branch, by 2 - detail.
PARTS = ((22, 7, 7), (18, 6, 5), (10, 4, 3), (14, 5, 4))
LEAF_TONES = ((0.10, 0.17, 0.045), (0.15, 0.20, 0.06), (0.08, 0.13, 0.05), (0.19, 0.19, 0.07), (0.26, 0.16, 0.08))
DRY_TONE = (0.30, 0.19, 0.10)
#: Bare trees that keep some of their dry leaves, and which share of them.
DRY_TREES, DRY_LEAVES = 0.15, 0.12


def _fork(
    rng: np.random.Generator, start: np.ndarray, way: np.ndarray, length: np.ndarray, each: int, stray: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``each`` branches along the outer part of (N,) parents: feet (N each, 3), directions, and parents' numbers."""
    parent = np.repeat(np.arange(len(start)), each)
    along = rng.uniform(0.25, 1.0, len(parent))
    foot = start[parent] + way[parent] * (length[parent] * along)[:, None]
    direction = unit(way[parent] + stray * rng.standard_normal((len(parent), 3)) + [0, 0, 0.2])
    return foot, direction, parent


def hardwood_crown(rng: np.random.Generator, stem: PlantedStem, leaf_area_m2: float, leaf_off: bool) -> list[Faces]:
    """Limbs from the lower half of the stem up, branches and twigs, and leaves along the twigs."""
    limbs, branches, twigs = PARTS[2 - stem.detail]
    small = stem.kind == "sapling"
    base = stem.crown_base_m * rng.uniform(LOWEST_LIMB, 0.9)
    share = rng.random(limbs) ** 1.2
    foot, _, thick = axis_at(stem, base + 0.95 * (stem.height_m - base) * share)
    turn = rng.uniform(0, 2 * np.pi, limbs)
    rise = np.radians(np.clip(rng.normal(32, 10, limbs) + 30 * share, 5, 85))
    way = np.column_stack([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)])
    reach = (0.5 + 0.12 * stem.height_m if small else 1.2 + 7 * stem.dbh_m) * (1.05 - 0.65 * share)
    reach *= rng.uniform(0.7, 1.2, limbs)
    grey = tuple(np.array([0.20, 0.18, 0.155]) * rng.uniform(0.6, 1.2))

    def grown(start: np.ndarray, way: np.ndarray, length: np.ndarray, r0: np.ndarray, r1: np.ndarray) -> Faces:
        return wooden(rng, sticks_between(rng, start, start + way * length[:, None], r0, r1), grey)

    r0 = np.minimum(0.7 * thick, 0.008 + 0.014 * reach)
    parts = [grown(foot, way, reach, r0, 0.3 * r0)]
    start, direction, limb = _fork(rng, foot, way, reach, branches, 0.55)
    length = 0.42 * reach[limb] * rng.uniform(0.5, 1.2, len(limb))
    parts.append(grown(start, direction, length, 0.35 * r0[limb] + 0.002, np.full(len(limb), 0.004)))
    start, direction, branch = _fork(rng, start, direction, length, twigs, 0.75)
    length = np.minimum(0.6 * length[branch], 0.7) * rng.uniform(0.5, 1.2, len(branch))
    parts.append(grown(start, direction, length, np.full(len(branch), 0.005), np.full(len(branch), 0.002)))
    dry = leaf_off and rng.random() < DRY_TREES
    if stem.status == "dead" or leaf_area_m2 <= 0 or (leaf_off and not dry):
        return parts
    size, width = LEAF_M[2 - stem.detail]
    count = int(leaf_area_m2 * (DRY_LEAVES if dry else 1.0) / (0.5 * size * width))
    twig = rng.integers(0, len(start), count)
    spot = start[twig] + direction[twig] * (length[twig] * rng.uniform(0.1, 1.15, count))[:, None]
    spot += rng.normal(0, 0.10, spot.shape)
    # Leaves hang a little, their faces to the sky.
    heading = unit(direction[twig] + 0.9 * rng.standard_normal((count, 3)) + [0, 0, -0.2])
    blades = blades_at(rng, spot, heading, size * rng.uniform(0.6, 1.2, count), np.full(count, width))
    base_tone = DRY_TONE if dry else LEAF_TONES[rng.integers(len(LEAF_TONES))]
    tone = np.array(base_tone) * np.exp(rng.normal(0, 0.12, 3))
    parts.append(Faces.of(Material.FOLIAGE, blades, tones(rng, count, tuple(tone), 0.22), 0.3))
    return parts
