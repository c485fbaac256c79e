"""Candidate flights: where each photo is taken and where it looks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..core.plots import short_way
from .drones import DroneCamera

#: Tilts of oblique photos from straight down, degrees.
TILTS_DEG = (30.0, 38.0)
#: Overlaps along and between lines, %, from dense to sparse: below these neighbours no longer tie.
OVERLAPS_PCT = ((92, 84), (90, 80), (88, 76), (85, 72), (82, 68), (80, 64), (76, 60))
#: Photos a ring: neighbours look at most 20 degrees apart, or they no longer tie.
RING_PHOTOS = (18, 22, 27, 33, 40, 48, 60)
#: Plots whose circles are nearer than this share one grid, m.
_BLOCK_GAP_M = 80.0
#: Nadir photos that tie the rings of one plot.
_TIES = ((0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))

Ground = Callable[[np.ndarray], np.ndarray]


def axes(heading_deg: float) -> np.ndarray:
    """(2, 2) unit vectors along the heading and to its right, x and y."""
    turn = np.radians(heading_deg)
    return np.array([[np.sin(turn), np.cos(turn)], [np.cos(turn), -np.sin(turn)]])


def compass(step_deg: float) -> np.ndarray:
    """(N, 2) unit vectors all around, from north."""
    turn = np.radians(np.arange(0, 360, step_deg))
    return np.column_stack([np.sin(turn), np.cos(turn)])


@dataclass(frozen=True)
class Target:
    """A plot as the flight sees it. centre: (2,) m, planning frame; radius_m: of the circle around it."""

    plot_id: str
    centre: np.ndarray
    radius_m: float

    def rim(self, step_deg: float) -> np.ndarray:
        """(N, 2) places on the circle."""
        return self.centre + self.radius_m * compass(step_deg)


@dataclass(frozen=True)
class PlanFlight:
    """Photos in the order they are taken. xy: (P, 2) planning frame. above_m: (P,) over the ground below. ground_m:
    (P,) its height (datum of the terrain model). yaw_deg: grid, clockwise from north; pitch_deg: -90 = down. leg:
    (P,) number of the line or ring. pattern, heights_m, tilt_deg, density: how it was made."""

    xy: np.ndarray
    above_m: np.ndarray
    ground_m: np.ndarray
    yaw_deg: np.ndarray
    pitch_deg: np.ndarray
    leg: np.ndarray
    pattern: str
    heights_m: tuple[float, ...]
    tilt_deg: float
    density: str

    def __len__(self) -> int:
        return len(self.xy)

    @property
    def xyz(self) -> np.ndarray:
        """(P, 3) with heights in the terrain model's datum."""
        return np.column_stack([self.xy, self.ground_m + self.above_m])

    @property
    def rotations(self) -> np.ndarray:
        """(P, 3, 3) world -> camera, OpenCV axes, roll 0."""
        yaw, pitch = np.radians(self.yaw_deg), np.radians(self.pitch_deg)
        flat = np.cos(pitch)
        forward = np.column_stack([np.sin(yaw) * flat, np.cos(yaw) * flat, np.sin(pitch)])
        right = np.column_stack([np.cos(yaw), -np.sin(yaw), np.zeros(len(yaw))])
        return np.stack([right, np.cross(forward, right), forward], axis=1)

    def beyond_m(self, targets: list[Target]) -> float:
        """How far from the nearest plot's circle the farthest photo is taken, m."""
        away = [np.hypot(*(self.xy - target.centre).T) - target.radius_m for target in targets]
        return float(np.min(away, axis=0).max())


def _flight(
    rows: list[tuple], ground: Ground, pattern: str, heights: tuple[float, ...], tilt: float, density: str
) -> PlanFlight:
    """rows: x, y, height, yaw, pitch, leg."""
    table = np.array(rows, float).reshape(-1, 6)
    xy, (above, yaw, pitch, leg) = table[:, :2], table[:, 2:].T
    return PlanFlight(xy, above, ground(xy), yaw % 360, pitch, leg.astype(int), pattern, heights, tilt, density)


def orbits(
    targets: list[Target], ground: Ground, heights: tuple[float, ...], tilt_deg: float, photos: int, heading_deg: float
) -> PlanFlight:
    """Rings about every plot, each photo aimed at its middle, and a cross of nadir photos that ties them.

    photos: of a ring at one height; rings of several heights share 1.5 times as many, turned against each other.
    """
    rows: list[tuple] = []
    leg = 0
    each = photos if len(heights) == 1 else max(RING_PHOTOS[0], int(np.ceil(0.75 * photos)))
    centres = np.array([target.centre for target in targets])
    outermost = int(np.hypot(*(centres - centres.mean(axis=0)).T).argmax())
    for target in (targets[k] for k in short_way(centres, outermost)):
        for level, height in enumerate(heights):
            reach = height * np.tan(np.radians(tilt_deg))
            turn = heading_deg + 360 * (np.arange(each) + level / max(len(heights), 1)) / each
            for angle in turn:
                rows.append((*(target.centre - reach * axes(angle)[0]), height, angle, tilt_deg - 90, leg))
            leg += 1
        for tie in _TIES:
            place = target.centre + 0.7 * target.radius_m * np.array(tie) @ axes(heading_deg)
            rows.append((*place, heights[0], heading_deg, -90.0, leg))
        leg += 1
    return _flight(rows, ground, "orbits", heights, tilt_deg, f"{each} photos a ring")


def grid(
    targets: list[Target], ground: Ground, camera: DroneCamera, pattern: str, heights: tuple[float, ...], tilt_deg:
    float, overlap_pct: tuple[int, int], heading_deg: float,
) -> PlanFlight:  # fmt: skip
    """Oblique lines along and across the heading, there and back (``crosshatch``), with nadir lines for
    ``nadir-oblique``; of two heights, one for each direction. Photos that show no plot are left out."""
    rows: list[tuple] = []
    leg = 0
    for block in _blocks(targets):
        passes = [(heights[0], tilt_deg, 0), (heights[-1], tilt_deg, 1)]
        if pattern == "nadir-oblique":
            passes.append((heights[0], 0.0, 0))
        for height, tilt, across in passes:
            step = 2.0 if pattern == "nadir-oblique" and tilt else 1.0
            made = _lines(block, camera, height, tilt, (heading_deg + 90 * across) % 360, overlap_pct, step)
            for line in made:
                rows += [(*place, height, yaw, tilt - 90, leg) for place, yaw in line]
                leg += 1
    flight = _flight(rows, ground, pattern, heights, tilt_deg, f"{overlap_pct[0]}/{overlap_pct[1]} % overlap")
    useful = sees(flight, targets, ground, camera).any(axis=1)
    rows_of = ("xy", "above_m", "ground_m", "yaw_deg", "pitch_deg", "leg")
    return replace(flight, **{name: getattr(flight, name)[useful] for name in rows_of})


def _lines(
    block: list[Target], camera: DroneCamera, height: float, tilt: float, heading: float, overlap_pct: tuple[int, int],
    step: float,
) -> list[list[tuple[np.ndarray, float]]]:  # fmt: skip
    """Lines over a block: (2,) places and yaw of their photos. step: lines that far apart of what overlap asks for."""
    slant = height / np.cos(np.radians(tilt))
    front = slant / np.cos(np.radians(tilt)) * camera.height_px / camera.focal_px * (1 - overlap_pct[0] / 100)
    side = step * slant * camera.width_px / camera.focal_px * (1 - overlap_pct[1] / 100)
    turn = axes(heading)
    centres = np.array([target.centre for target in block]) @ turn.T
    radius = np.array([target.radius_m for target in block])[:, None]
    # As far as a photo's middle may lie from a plot and still show it.
    reach = 0.35 * np.array([front / (1 - overlap_pct[0] / 100), side / step / (1 - overlap_pct[1] / 100)])
    low, high = (centres - radius).min(axis=0) - reach, (centres + radius).max(axis=0) + reach
    # At most a step apart, evenly about the middle.
    steps = np.maximum(1, np.ceil((high - low) / [front, side]).astype(int))
    stops, lines = (low[k] + np.linspace(0, high[k] - low[k], steps[k] + 1) for k in range(2))
    back = height * np.tan(np.radians(tilt))
    found = []
    for number, line in enumerate(lines):
        away = number % 2 == 1
        yaw, along = (heading + 180 * away) % 360, stops[::-1] + back if away else stops - back
        found.append([(np.array([place, line]) @ turn, yaw) for place in along])
    return found


def sees(flight: PlanFlight, targets: list[Target], ground: Ground, camera: DroneCamera) -> np.ndarray:
    """(P, T) bool: the photo shows the middle or a part of the rim of the plot at breast height."""
    size = np.array([camera.width_px, camera.height_px]) / 2
    seen = np.zeros((len(flight), len(targets)), bool)
    for k, target in enumerate(targets):
        xy = np.vstack([target.centre, target.rim(45)])
        points = np.column_stack([xy, ground(xy) + 1.37])
        local = np.einsum("pij,psj->psi", flight.rotations, points[None] - flight.xyz[:, None])
        depth = np.maximum(local[..., 2], 1e-6)
        inside = (local[..., 2] > 1) & (np.abs(camera.focal_px * local[..., :2] / depth[..., None]) < size).all(axis=-1)
        seen[:, k] = inside.sum(axis=1) >= 3
    return seen


def _blocks(targets: list[Target]) -> list[list[Target]]:
    """Plots that lie near enough together to be flown in one grid."""
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial.distance import cdist

    centres = np.array([target.centre for target in targets])
    radius = np.array([target.radius_m for target in targets])
    near = cdist(centres, centres) - radius[:, None] - radius[None] < _BLOCK_GAP_M
    count, label = connected_components(near)
    return [[target for target, own in zip(targets, label, strict=True) if own == k] for k in range(count)]
