"""Flights as survey crews fly them: parallel lines over an area, not aimed at any plot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from treedgs_geo.core.errors import InputError
from treedgs_geo.planning.missions import axes
from treedgs_geo.reconstruction.cameras import Camera

from .flight import Shot
from .settings import SimulateSettings
from .terrain import Ground

MAX_PHOTOS = 2000
#: How far the surveyed area reaches beyond the plots' circles on each side, m.
MARGIN_M = (4.0, 14.0)


@dataclass(frozen=True)
class Area:
    """Rectangle to survey. heading_deg: grid azimuth of its long axis ``along``. low, high: (2,) along and across, m
    from the origin."""

    heading_deg: float
    low: np.ndarray
    high: np.ndarray


def survey_area(rng: np.random.Generator, centres: np.ndarray, radius_m: float) -> Area:
    """A rectangle of any heading around all the plots, with a margin of its own on every side."""
    heading = rng.uniform(0, 360)
    place = centres @ axes(heading).T
    margin = rng.uniform(*MARGIN_M, (2, 2)) + radius_m
    return Area(heading, place.min(axis=0) - margin[0], place.max(axis=0) + margin[1])


def grid_shots(rng: np.random.Generator, settings: SimulateSettings, camera: Camera, area: Area) -> list[Shot]:
    """Nadir lines along the area (first flight), then oblique ones along and across it (second flight).

    The photos' middles cover the area: oblique lines begin before it. Heights are above the origin.

    Raises:
        InputError: more photos than ``MAX_PHOTOS``.
    """
    passes = [(0, "nadir", 0.0, 0.0)]
    if settings.oblique_deg > 0:
        passes += [(1, "oblique", settings.oblique_deg, 0.0), (1, "oblique", settings.oblique_deg, 90.0)]
    plan = [
        (number, kind, tilt, yaw, spot)
        for number, kind, tilt, turn in passes
        for yaw, spot in _middles(settings, camera, area, tilt, turn)
    ]
    if len(plan) > MAX_PHOTOS:
        raise InputError(
            f"--grid front_overlap_pct, side_overlap_pct, height_m: ask for {len(plan)} photos, expected at most "
            f"{MAX_PHOTOS}; give less overlap, a greater height or larger photos (--camera image_width, image_height)."
        )
    shots = []
    for number, kind, tilt, yaw, spot in plan:
        height = settings.height_m
        middle = spot - height * np.tan(np.radians(tilt)) * axes(yaw)[0]
        xyz = np.array([*(middle + rng.normal(0, 0.3, 2)), height + rng.normal(0, 0.2)])
        pitch = -90 + tilt + rng.normal(0, 0.3)
        if not tilt:
            pitch = max(pitch, -180 - pitch)
        shots.append(Shot(number, kind, xyz, yaw + rng.normal(0, 0.5), pitch, rng.normal(0, 0.3)))
    return shots


def _middles(
    settings: SimulateSettings, camera: Camera, area: Area, tilt_deg: float, turn_deg: float
) -> list[tuple[float, np.ndarray]]:
    """Yaw and (2,) ground point in the middle of every photo of one set of parallel lines, there and back."""
    slant = settings.height_m / np.cos(np.radians(tilt_deg))
    front_m = slant / np.cos(np.radians(tilt_deg)) * camera.height / camera.fy * (1 - settings.front_overlap_pct / 100)
    side_m = slant * camera.width / camera.fx * (1 - settings.side_overlap_pct / 100)
    along, across = (0, 1) if turn_deg == 0 else (1, 0)
    lines, stops = _spaced(area, across, side_m), _spaced(area, along, front_m)
    found = []
    for number, line in enumerate(lines):
        back = number % 2 == 1
        for stop in stops[::-1] if back else stops:
            place = np.zeros(2)
            place[along], place[across] = stop, line
            found.append((area.heading_deg + turn_deg + 180 * back, place @ axes(area.heading_deg)))
    return found


def _spaced(area: Area, axis: int, step_m: float) -> np.ndarray:
    """Places no more than ``step_m`` apart from one end of the area's axis to the other."""
    low, high = area.low[axis], area.high[axis]
    return np.linspace(low, high, int(np.ceil((high - low) / step_m)) + 1)


def follow_terrain(shots: list[Shot], ground: Ground) -> list[Shot]:
    """The same shots at their height above the ground below (mean of 5 m around)."""
    around = 5.0 * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    return [shot._replace(xyz=shot.xyz + [0, 0, float(ground.height(shot.xyz[:2] + around).mean())]) for shot in shots]
