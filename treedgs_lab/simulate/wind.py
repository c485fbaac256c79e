"""Wind: the world at each photo's own moment."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from .foliage import ROOTED
from .scene import PlantedStem
from .settings import SimulateSettings
from .world import World, scene_of

#: Shadows are those of so many moments of a windy flight, in turn.
SHADOW_MOMENTS = 3
#: Height from which a tree sways by the full ``wind_sway_cm``, m; below, by the square of the height's share of it.
SWAY_HEIGHT_M = 18.0
#: Gusts: seconds from one to the next, and metres between them.
GUST_S, GUST_M = 11.0, 60.0
#: Height above ground from which shrubs and grass flutter by the full length, m.
FULL_FLUTTER_M = 0.5


class Wind:
    """The world photo by photo."""

    def __init__(
        self, world: World, stems: list[PlantedStem], settings: SimulateSettings, rng: np.random.Generator
    ) -> None:
        self._world, self._flutter_m = world, settings.wind_flutter_cm / 100
        self.blows = bool(settings.wind_sway_cm or settings.wind_flutter_cm)
        self.phases = SHADOW_MOMENTS if self.blows else 1
        self.trees = Sway(stems, settings.wind_sway_cm, rng)
        self._seed = int(rng.integers(2**31))

    def at(self, number: int, seconds: float) -> World:
        """The world of photo ``number``, taken ``seconds`` after the start."""
        world = self._world
        if not self.blows:
            return world
        top = self.trees.tops(seconds)
        mesh, faces = world.mesh, world.faces
        vertices = mesh.vertices + self.trees.shift(mesh.vertices, mesh.vertex_owner, top)
        # Twigs and leaves are moved as they are, not bent.
        moved = self.trees.shift(self._centres, faces.owner, top)
        if self._flutter_m:
            rng = np.random.default_rng([self._seed, number])
            moved[:, :2] += self._flutter_m * self._loose[:, None] * flutter(self._centres, rng)
        corners = (faces.corners + moved[:, None]).astype(np.float32)
        mesh, faces = replace(mesh, vertices=vertices), replace(faces, corners=corners)
        return replace(world, mesh=mesh, faces=faces, scene=scene_of(world.ground, mesh, faces))

    @cached_property
    def _centres(self) -> np.ndarray:
        """(F, 3) middles of the faces at rest."""
        return self._world.faces.corners.mean(axis=1, dtype=np.float64)

    @cached_property
    def _loose(self) -> np.ndarray:
        """(F,) share of the flutter that each face takes part in."""
        owner = self._world.faces.owner
        above = self._centres[:, 2] - self._world.ground.height(self._centres[:, :2])
        return np.where(owner == ROOTED, np.clip(above / FULL_FLUTTER_M, 0, 1), owner >= 0)


class Sway:
    """Trees as cantilevers: the top moves by ``sway_cm`` (standard deviation along the wind, half of it across), the
    rest by the square of its share of the height; each tree has its own period and phase. Trees below
    :data:`SWAY_HEIGHT_M` stand in the shelter of the others: the square of their share of it.

    Frequency: 0.0948 + 3.4317 DBH / height^2 Hz, cm and m (after Moore and Maguire 2004, Trees 18: 195-203).
    """

    def __init__(self, stems: list[PlantedStem], sway_cm: float, rng: np.random.Generator) -> None:
        whole = {stem.tree_id: stem for stem in reversed(stems) if stem.kind != "branch"}
        # A second leader moves with the tree that it is part of.
        trees = [whole[stem.tree_id] for stem in stems]
        index = {tree_id: k for k, tree_id in enumerate(whole)}
        self._number = np.array([index[stem.tree_id] for stem in stems])
        self._foot = np.array([tree.axis[0] for tree in trees])
        self._height = np.array([tree.height_m for tree in trees])
        hertz = 0.0948 + 3.4317 * np.array([100 * tree.dbh_m for tree in trees]) / np.maximum(self._height, 2.0) ** 2
        self._hertz = np.minimum(hertz, 2.0)
        self._phase = rng.uniform(0, 2 * np.pi, (len(whole), 2))[self._number]
        turn = rng.uniform(0, 2 * np.pi)
        self._along = np.array([np.cos(turn), np.sin(turn)])
        self._sway_m = sway_cm / 100 * np.minimum(self._height / SWAY_HEIGHT_M, 1.0) ** 2

    def tops(self, seconds: float) -> np.ndarray:
        """(S, 2) where the tops are at that time, m from rest: their own swing, and gusts that pass over the stand."""
        swing = np.sqrt(2) * np.sin(2 * np.pi * self._hertz[:, None] * seconds + self._phase)
        gust = np.sqrt(2) * np.sin(2 * np.pi * (seconds / GUST_S - self._foot[:, :2] @ self._along / GUST_M))
        across = np.array([-self._along[1], self._along[0]])
        own = 0.8 * swing[:, :1] * self._along + 0.5 * swing[:, 1:] * across
        return self._sway_m[:, None] * (own + 0.6 * gust[:, None] * self._along)

    def share(self, points: np.ndarray, owner: np.ndarray) -> np.ndarray:
        """(N,) share of the top's displacement that (N, 3) points of stems ``owner`` (N,) take; 0 for other owners."""
        height = (points[:, 2] - self._foot[owner, 2]) / self._height[owner]
        return np.where(owner >= 0, np.clip(height, 0, 1.05) ** 2, 0.0)

    def shift(self, points: np.ndarray, owner: np.ndarray, top: np.ndarray) -> np.ndarray:
        """(N, 3) displacement of points; top: (S, 2) of every stem's top."""
        return np.pad(self.share(points, owner)[:, None] * top[owner], ((0, 0), (0, 1)))


def flutter(points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(N, 2) sideways displacement of unit spread: twigs move with their neighbours (waves of 0.4-1.5 m)."""
    field = np.zeros((len(points), 2))
    for axis in (0, 1):
        for _ in range(4):
            way = rng.standard_normal(3)
            wave = 2 * np.pi / rng.uniform(0.4, 1.5) * way / np.linalg.norm(way)
            field[:, axis] += np.sin(points @ wave + rng.uniform(0, 2 * np.pi)) / np.sqrt(2)
    return field
