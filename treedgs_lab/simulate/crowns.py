"""Crowns grown by others: a few templates, each standing on many stems, leaning and as large as the tree asks for."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .foliage import Faces, Material, dead_branches
from .hardwoods import LOWEST_LIMB
from .scene import PlantedStem, axis_at

#: Height of the trees that Sapling grows, m, and how much of it is below the crown.
TREE_M, BARE_SHARE = 18.0, 0.5
#: Presets of Sapling and what is changed of them: a straight stem, crowns of these heights, fewer parts.
_STRAIGHT = {"scale": TREE_M, "scaleV": 0.0, "scaleV0": 0.0, "baseSplits": 0, "baseSize": BARE_SHARE, "resU": 1}
_THIN = {"bevelRes": 0, "leafShape": "rect", "curveV": (0.0, 60.0, 60.0, 0.0), "nrings": 0}
PINE = ("small_pine", {**_STRAIGHT, **_THIN, "leaves": 110, "branches": (0, 48, 8, 0)})
HARDWOOD = ("white_birch", {**_STRAIGHT, **_THIN, "segSplits": (0, 0.35, 0.35, 0), "leaves": 14,
                            "branches": (0, 44, 16, 0)})  # fmt: skip
#: Templates of each, and the colour of their leaves.
VARIANTS = 3
PINE_TONES = ((0.045, 0.085, 0.022), (0.060, 0.095, 0.030), (0.075, 0.100, 0.028))
HARDWOOD_TONES = ((0.080, 0.135, 0.036), (0.120, 0.160, 0.048), (0.150, 0.150, 0.055))
#: Every so-maniest leaf of a far crown and of a sapling's, and how much longer it is; share of the wood of far crowns.
FAR_LEAVES, SAPLING_LEAVES, FAR_WOOD = 8, 5, 0.2


@dataclass(frozen=True)
class Crown:
    """One shape of a crown, its tree's foot at the origin. leaves: (N, 4, 3) and wood (M, 3, 3), m; tone: of leaves;
    height, reach: of the tree and of the leaves about its stem, m."""

    leaves: np.ndarray
    wood: np.ndarray
    tone: tuple[float, float, float]
    height: float
    reach: float

    def thinned(self, every: int, longer: float, wood: float) -> Crown:
        """Every so-maniest leaf, larger about its middle, and the first share of the wood (the thickest)."""
        kept = self.leaves[::every]
        middle = kept.mean(axis=1, keepdims=True)
        return replace(self, leaves=middle + longer * (kept - middle), wood=self.wood[: int(wood * len(self.wood))])


def recipes(rng: np.random.Generator, hardwoods: bool) -> list[dict]:
    """What :mod:`.inside_blender` shall grow: pines, then hardwoods if there are any."""
    kinds = [PINE, HARDWOOD] if hardwoods else [PINE]
    return [
        {"preset": preset, "changes": {**changes, "seed": int(rng.integers(1, 10_000))}}
        for preset, changes in kinds
        for _ in range(VARIANTS)
    ]


def _area(leaves: np.ndarray) -> float:
    """Area of (N, 4, 3) leaves, m2."""
    return float(0.5 * np.linalg.norm(np.cross(leaves[:, 2] - leaves[:, 0], leaves[:, 3] - leaves[:, 1]), axis=1).sum())


class Crowns:
    """The crowns of a stand: ``kinds`` of them, and where each stands (``kind``, ``matrix``: (4, 4); ``stem``, its
    ``ends``: lower and upper, (2, 3), m)."""

    def __init__(self, grown: dict[str, np.ndarray], leaf_area_m2: float, dbh_m: float, leaf_off: bool) -> None:
        """grown: what :mod:`.inside_blender` wrote. leaf_area_m2: of a tree of that DBH."""
        self.kinds: list[Crown] = []
        self.kind: list[int] = []
        self.matrix: list[np.ndarray] = []
        self.stem: list[int] = []
        self.ends: list[np.ndarray] = []
        self._faces: list[Faces] = []
        self._owner: list[int] = []
        self.plants = Faces.none()
        tones = PINE_TONES + HARDWOOD_TONES
        for number in range(sum(name.startswith("leaves_") for name in grown)):
            leaves, height = grown[f"leaves_{number}"], float(grown[f"height_{number}"])
            reach = float(np.quantile(np.hypot(*leaves.mean(axis=1)[:, :2].T), 0.97))
            whole = Crown(leaves, grown[f"wood_{number}"], tones[number], height, reach)
            scale = np.array([crown_reach(dbh_m, number >= VARIANTS) / reach] * 2 + [20.0 / height])
            area = _area(whole.leaves * scale)
            bare = leaf_area_m2 <= 0 or (leaf_off and number >= VARIANTS)
            whole = whole.thinned(1, np.sqrt(leaf_area_m2 / area), 1.0)
            shapes = [
                whole,
                whole.thinned(FAR_LEAVES, np.sqrt(FAR_LEAVES), FAR_WOOD),
                whole.thinned(SAPLING_LEAVES, 1.3, 1.0),
            ]
            self.kinds += [replace(crown, leaves=crown.leaves[:0]) if bare else crown for crown in shapes]

    def grow(self, rng: np.random.Generator, stem: PlantedStem, index: int) -> list[Faces]:
        """Set a crown on a stem; returns the dead branches below it."""
        hardwood = stem.look.hardwood
        number = int(rng.integers(VARIANTS)) + VARIANTS * hardwood
        shape = 2 if stem.kind == "sapling" else 0 if stem.detail > 0 else 1
        crown = self.kinds[3 * number + shape]
        base_m = stem.crown_base_m * (LOWEST_LIMB if hardwood else 1.0)
        foot, top = axis_at(stem, np.array([base_m, stem.height_m]))[0]
        wide = crown_reach(stem.dbh_m, hardwood) if stem.kind != "sapling" else 0.45 + 0.10 * stem.height_m
        wide *= rng.uniform(0.85, 1.15) / crown.reach
        turn = rng.uniform(0, 2 * np.pi)
        matrix = np.eye(4)
        matrix[:2, :2] = wide * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        matrix[:3, 2] = (top - foot) / (crown.height * (1 - BARE_SHARE))
        matrix[:3, 3] = foot - matrix[:3, 2] * crown.height * BARE_SHARE
        self.kind.append(3 * number + shape)
        self.matrix.append(matrix)
        self.stem.append(index)
        self.ends.append(np.array([foot, top]))
        leaves = crown.leaves[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)
        for kind, corners in ((Material.FOLIAGE, leaves), (Material.WOOD, crown.wood)):
            self._faces.append(
                Faces.of(kind, corners @ matrix[:3, :3].T + matrix[:3, 3], np.zeros(corners.shape[:2]), 0)
            )
            self._owner += [index] * len(corners)
        return [dead_branches(rng, stem)]

    def colour(self, tones: list[np.ndarray]) -> None:
        """Give the kinds' leaves these linear colours, (3,) each, in turn."""
        self.kinds = [replace(crown, tone=tuple(tones[k // 3 % len(tones)])) for k, crown in enumerate(self.kinds)]

    def with_plants(self, plants: Faces) -> Faces:
        """The crowns and everything else that grows, as triangles that rays can hit."""
        self.plants = plants
        return replace(Faces.join([*self._faces, plants]), owner=np.concatenate([self._owner, plants.owner]))


def crown_reach(dbh_m: float, hardwood: bool) -> float:
    """Half the width of a crown, m."""
    return 1.2 + 7 * dbh_m if hardwood else 1.0 + 4.0 * dbh_m
