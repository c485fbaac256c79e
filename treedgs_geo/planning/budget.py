"""What a flight costs: minutes, batteries, gigabytes, and the time to process it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.costs import CostModel
from .drones import DroneCamera
from .missions import PlanFlight

#: Climb and descent, m/s; transit, m/s; seconds to turn at the end of a line, and for start and landing.
VERTICAL_M_S, TRANSIT_M_S, TURN_S, START_S = 3.0, 10.0, 4.0, 60.0


@dataclass(frozen=True)
class Budget:
    """speed_m_s and what limits it. minutes: in the air, with climb, transit and landing. length_m: of the way.
    processing_s: photos-to-dbh on one thread by the cost model; outside: larger than the runs it rests on."""

    photos: int
    speed_m_s: float
    speed_limit: str
    length_m: float
    minutes: float
    batteries: int
    gigabytes: float
    processing_s: float
    outside: bool


def budget_of(
    flight: PlanFlight, camera: DroneCamera, speed: tuple[float, str], take_off: np.ndarray, costs: CostModel
) -> Budget:
    """take_off: (3,) planning frame, datum of the terrain model."""
    xyz = flight.xyz
    gaps = np.linalg.norm(np.diff(xyz, axis=0), axis=1)
    same = np.diff(flight.leg) == 0
    # Between lines nothing is photographed: as fast as a transit.
    seconds = np.where(same, np.maximum(gaps / speed[0], camera.interval_s), gaps / TRANSIT_M_S + TURN_S)
    out, home = (float(np.hypot(*(end[:2] - take_off[:2]))) for end in (xyz[0], xyz[-1]))
    climb = max(0.0, float(max(xyz[0, 2], xyz[-1, 2]) - take_off[2]))
    trip = (out + home) / TRANSIT_M_S + 2 * climb / VERTICAL_M_S + START_S
    flown = float(seconds.sum())
    batteries = max(1, int(np.ceil(flown / max(60 * camera.usable_min - trip, 60.0))))
    total = flown + batteries * trip
    need = costs.predict("photos", {"photos": len(flight), "megapixels": len(flight) * camera.megapixels})
    return Budget(
        len(flight), speed[0], speed[1], float(gaps.sum()) + out + home, total / 60, batteries,
        len(flight) * camera.photo_mb / 1000, need.seconds, need.outside,
    )  # fmt: skip
