"""A UAV LiDAR flight over the same meshes: cross-hatched lines, diverging pulses, up to two returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .world import World

ALTITUDE_M = 50.0
#: Half the beam's 1/e2 divergence, rad: 0.5 mrad full angle.
HALF_DIVERGENCE = 0.00025
SUB_RAYS = 7
SEPARATION_M = 0.6
RANGE_NOISE_M = 0.01
#: Error of the trajectory, constant over a flight line, standard deviation in E, N and height.
LINE_OFFSET_SD_M = (0.01, 0.01, 0.01)


@dataclass(frozen=True)
class Returns:
    """points: (N, 3) local. intensity: (N,) uint16. number, count: (N,) return number and returns of the pulse.
    angle_deg: (N,) scan angle. line: (N,) 1-based flight line. seconds: (N,) after the first pulse."""

    points: np.ndarray
    intensity: np.ndarray
    number: np.ndarray
    count: np.ndarray
    angle_deg: np.ndarray
    line: np.ndarray
    seconds: np.ndarray


def scan(world: World, rng: np.random.Generator, half_m: float, pulses_per_m2: float, lines: int = 12) -> Returns:
    """Pulses aimed uniformly at the square of ``half_m``; returns outside it are dropped.

    A pulse is seven rays within its footprint; hits nearer than 0.6 m along the beam merge into one return.
    """
    total = int(pulses_per_m2 * (2 * half_m) ** 2)
    each = max(1, total // lines)
    parts = []
    for line in range(lines):
        along = np.array([1.0, 0.0]) if line % 2 == 0 else np.array([0.0, 1.0])
        across = along[::-1]
        offset = (line // 2 - (lines / 2 - 1) / 2) * 2 * half_m / (lines / 2 - 1 or 1) * 1.2
        target = rng.uniform(-half_m, half_m, (each, 2))
        position = np.sort(target @ along)
        order = np.argsort(target @ along)
        target = target[order]
        origin = np.column_stack(
            [position[:, None] * along + offset * across + rng.normal(0, 0.05, (each, 2)), np.full(each, ALTITUDE_M)]
        )
        beam = np.column_stack([target, world.ground.height(target)]) - origin
        beam /= np.linalg.norm(beam, axis=1, keepdims=True)
        angle = np.degrees(np.arctan2(beam[:, :2] @ across, -beam[:, 2]))
        parts.append(_pulses(world, rng, origin, beam, angle, line + 1, 30.0 * line + (position + half_m) / 5.0))
    fields = [np.concatenate([part[k] for part in parts]) for k in range(7)]
    # After post-processing the trajectory is still off by a centimetre or so, other on every line: seen from several
    # lines, bark is a band wider than the range noise says.
    drift = rng.normal(0, LINE_OFFSET_SD_M, (lines, 3))
    points = fields[0] = fields[0] + drift[fields[5] - 1]
    inside = (np.abs(points[:, :2]) <= half_m).all(axis=1)
    return Returns(*(field[inside] for field in fields))


def _pulses(
    world: World,
    rng: np.random.Generator,
    origin: np.ndarray,
    beam: np.ndarray,
    angle: np.ndarray,
    line: int,
    seconds: np.ndarray,
) -> tuple:
    count = len(beam)
    side = np.cross(beam, [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(beam, side)
    ranges, shine = np.empty((count, SUB_RAYS)), np.empty((count, SUB_RAYS))
    for k in range(SUB_RAYS):
        turn = 2 * np.pi * (k - 1) / (SUB_RAYS - 1)
        radius = 0.0 if k == 0 else 0.7 * HALF_DIVERGENCE
        way = beam + radius * (np.cos(turn) * side + np.sin(turn) * other)
        distance, primitive = world.first_hits(origin, way)
        ranges[:, k] = distance
        kind = np.digitize(primitive, [world.ground_faces, world.ground_faces + world.stem_faces])
        shine[:, k] = np.where(primitive < 0, 0, np.array([0.35, 0.30, 0.42])[kind])
    first = ranges.min(axis=1)
    near = ranges < first[:, None] + SEPARATION_M
    rest = np.where(near | ~np.isfinite(ranges), np.inf, ranges)
    second = rest.min(axis=1)
    near_second = np.isfinite(rest) & (rest < second[:, None] + SEPARATION_M)
    both = np.isfinite(second)
    out = []
    for number, members, exists in ((1, near, np.isfinite(first)), (2, near_second, both)):
        weight = np.where(members & np.isfinite(ranges), shine, 0)
        energy = weight.sum(axis=1)
        mean = (np.where(weight > 0, ranges, 0) * weight).sum(axis=1) / np.maximum(energy, 1e-9)
        mean += rng.normal(0, RANGE_NOISE_M, count)
        strength = 52000 * energy / SUB_RAYS / 0.42 * rng.gamma(9, 1 / 9, count) * 0.6
        point = origin + beam * mean[:, None]
        keep = exists & (energy > 0.03)
        out.append(
            (
                point[keep],
                np.clip(strength[keep], 1, 65535).astype(np.uint16),
                np.full(keep.sum(), number, np.uint8),
                (1 + both[keep]).astype(np.uint8),
                angle[keep],
                np.full(keep.sum(), line, np.uint16),
                seconds[keep],
            )
        )
    merged = [np.concatenate([part[k] for part in out]) for k in range(7)]
    order = np.lexsort((merged[2], merged[6]))
    return tuple(field[order] for field in merged)
