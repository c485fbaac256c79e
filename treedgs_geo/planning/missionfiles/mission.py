"""What every mission file says: waypoints over the take-off, one photo each."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass

import numpy as np

from ..budget import TRANSIT_M_S
from ..choose import JudgedFlight
from ..drones import DroneCamera
from ..safety import Limits
from ..site import PlanSite


@dataclass(frozen=True)
class Mission:
    """lon, lat (P,) degrees WGS 84. over_m: (P,) height over the take-off. yaw_deg: (P,) clockwise from true north,
    -180 to 180. pitch_deg: (P,). speed_m_s: (P,) from this waypoint to the next. leg: (P,). home: longitude,
    latitude, height of the take-off in the terrain model's datum. safe_m: height over the take-off to climb to first.
    title, made: name and day."""

    title: str
    made: dt.datetime
    camera: DroneCamera
    lon: np.ndarray
    lat: np.ndarray
    over_m: np.ndarray
    yaw_deg: np.ndarray
    pitch_deg: np.ndarray
    speed_m_s: np.ndarray
    leg: np.ndarray
    home: tuple[float, float, float]
    safe_m: float
    seconds: float
    length_m: float

    def __len__(self) -> int:
        return len(self.lon)


def mission_of(
    plan: JudgedFlight,
    site: PlanSite,
    camera: DroneCamera,
    limits: Limits,
    take_off: np.ndarray,
    title: str,
    made: dt.datetime,
) -> Mission:
    """take_off: (3,) planning frame, terrain model's datum."""
    flight, budget = plan.flight, plan.budget
    place, home = site.lonlat(flight.xy), site.lonlat(take_off[:2])[0]
    over = flight.xyz[:, 2] - take_off[2]
    same = np.append(np.diff(flight.leg) == 0, False)
    speed = np.where(same, budget.speed_m_s, min(TRANSIT_M_S, limits.speed_m_s))
    yaw = (flight.yaw_deg + site.convergence_deg + 180) % 360 - 180
    around = flight.xy[[0, -1]]
    ways = np.linspace(0, 1, 30)[:, None, None] * (around - take_off[:2]) + take_off[:2]
    top = site.canopy_top(ways.reshape(-1, 2))
    # Beyond the terrain model nothing is known of the way home: as high as the flight itself.
    safe = float(np.nanmax(top)) + limits.clearance_m - take_off[2]
    safe = float(np.clip(max(safe, over.min()), 20.0, max(over.max(), 20.0)))
    return Mission(
        title, made, camera, place[:, 0], place[:, 1], over, yaw, flight.pitch_deg, speed, flight.leg,
        (float(home[0]), float(home[1]), float(take_off[2])), safe, 60 * budget.minutes, budget.length_m,
    )  # fmt: skip
