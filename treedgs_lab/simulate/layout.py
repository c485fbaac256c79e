"""Where the plots of a flight lie, and how much world its photos need."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from treedgs_geo.reconstruction.cameras import Camera

from .flight import Shot, rotation_from_angles
from .settings import SimulateSettings, Sizes

#: Gap between the circles of two plots of one flight, m.
PLOT_GAP_M = 8.0
#: Beyond the surveyed area photos show bare ground farther out than this, m.
FOREST_BEYOND_M = 60.0
GROUND_BEYOND_M = 150.0


@dataclass(frozen=True)
class Layout:
    """centres: (n, 2) of the plots, local m. reach_m: distance from the origin within which ground detail matters.
    stand_radius_m: of the trees. ground_half_m, survey_half_m: half sides of the terrain, and of DTM and LiDAR."""

    centres: np.ndarray
    reach_m: float
    stand_radius_m: float
    ground_half_m: float
    survey_half_m: float
    lidar_half_m: float

    def owner(self, xy: np.ndarray) -> int:
        """Number of the plot whose centre is nearest to ``xy`` (2,)."""
        return int(np.argmin(np.hypot(*(self.centres - xy).T)))

    def plot_ids(self, name: str) -> list[str]:
        """Names of the plots: the name itself where there is one."""
        count = len(self.centres)
        return [name] if count == 1 else [f"{name}_{k}" for k in range(1, count + 1)]


def plot_centres(rng: np.random.Generator, count: int, radius_m: float) -> np.ndarray:
    """(count, 2) centres on a jittered square grid about the origin; one plot lies at the origin."""
    if count == 1:
        return np.zeros((1, 2))
    side = int(np.ceil(np.sqrt(count)))
    step = 2 * radius_m + PLOT_GAP_M
    cells = np.array([(i, j) for i in range(side) for j in range(side)][:count], float)
    centres = (cells - cells.mean(axis=0)) * step
    return centres + rng.uniform(-0.4, 0.4, (count, 2)) * PLOT_GAP_M


def ring_layout(settings: SimulateSettings, sizes: Sizes) -> Layout:
    """One plot at the origin, photographed from rings about it."""
    footprint = np.hypot(sizes.image_width, sizes.image_height) / 2 * settings.gsd_cm / 100 * 1.5
    reach = footprint + sizes.target_off_m + 2
    stand = max(sizes.stand_radius_m, reach + 12)
    return Layout(np.zeros((1, 2)), reach, stand, sizes.stand_radius_m + 12, 20.0, sizes.lidar_half_m)


def grid_layout(centres: np.ndarray, shots: list[Shot], camera: Camera, sizes: Sizes) -> Layout:
    """World for photos of a grid flight: forest as far as they see it, within reason, bare ground behind."""
    extent = float(np.abs(centres).max() + sizes.radius_m)
    seen = seen_distance(shots, camera)
    reach = min(seen, float(np.hypot(*centres.T).max()) + sizes.radius_m + FOREST_BEYOND_M)
    stand = reach + 12
    beyond = sizes.lidar_half_m - sizes.radius_m
    return Layout(centres, reach, stand, min(seen, stand + GROUND_BEYOND_M) + 12, extent + 10, extent + beyond)


def seen_distance(shots: list[Shot], camera: Camera) -> float:
    """How far from the origin the photos' corners see level ground, m (at most 80 degrees off nadir)."""
    u, v = np.array([0, camera.width, 0, camera.width], float), np.array([0, 0, camera.height, camera.height], float)
    x, y = camera.undistort(u, v)
    farthest = 0.0
    for shot in shots:
        way = np.column_stack([x, y, np.ones(4)]) @ rotation_from_angles(shot.yaw_deg, shot.pitch_deg, shot.roll_deg)
        flat = np.hypot(way[:, 0], way[:, 1])
        down = np.maximum(-way[:, 2], flat / np.tan(np.radians(80)))
        spot = shot.xyz[:2] + way[:, :2] * (shot.xyz[2] / down)[:, None]
        farthest = max(farthest, float(np.hypot(*spot.T).max()))
    return farthest
