"""Wind: the world in several positions of its crowns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .render import World, scene_of

#: Positions of the crowns between which the photos of a windy flight alternate.
WIND_PHASES = 3
#: Height at which a crown sways by the full ``wind_sway_cm``, m; below, by the square of the height's share of it.
SWAY_HEIGHT_M = 18.0


def sway(points: np.ndarray, sway_cm: float, rng: np.random.Generator) -> np.ndarray:
    """(N, 3) points moved sideways by one gust: neighbours move alike (waves of 12-25 m), the foot stays."""
    share = np.clip(points[:, 2] / SWAY_HEIGHT_M, 0, 1.5) ** 2
    moved = np.array(points, float)
    for axis in (0, 1):
        field = np.zeros(len(points))
        for _ in range(4):
            turn, wavelength, phase = rng.uniform(0, 2 * np.pi), rng.uniform(12, 25), rng.uniform(0, 2 * np.pi)
            along = points[:, 0] * np.cos(turn) + points[:, 1] * np.sin(turn)
            field += np.sin(2 * np.pi * along / wavelength + phase) / np.sqrt(2)
        moved[:, axis] += sway_cm / 100 * share * field
    return moved


def windy_worlds(world: World, sway_cm: float, rng: np.random.Generator) -> list[World]:
    """The world in :data:`WIND_PHASES` positions of its crowns (and, less, of its stems); only itself without wind."""
    if sway_cm <= 0:
        return [world]
    worlds = []
    for seed in rng.integers(0, 2**31, WIND_PHASES):
        # Stems and leaves draw the same waves, so that a crown stays on its stem.
        vertices = sway(world.mesh.vertices, sway_cm, np.random.default_rng(seed))
        corners = sway(world.faces.corners.reshape(-1, 3), sway_cm, np.random.default_rng(seed))
        mesh = replace(world.mesh, vertices=vertices)
        faces = replace(world.faces, corners=corners.reshape(world.faces.corners.shape).astype(np.float32))
        worlds.append(replace(world, mesh=mesh, faces=faces, scene=scene_of(world.ground, mesh, faces)))
    return worlds
