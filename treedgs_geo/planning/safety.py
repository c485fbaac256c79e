"""What may be flown: height over the canopy, speed, blur, gimbal (what cannot is refused, with what would do); and what
it costs: minutes, batteries, gigabytes, and the time to process it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..core.costs import CostModel
from .drones import DroneCamera
from .missions import PlanFlight, compass
from .settings import FlyingSettings

#: Blur within an exposure and travel within a rolling shutter's readout, pixels on the ground.
MAX_BLUR_PX, MAX_READOUT_PX = 0.5, 3.0
#: The way between two photos is checked every so many metres.
CHECK_M = 3.0

Canopy = Callable[[np.ndarray], np.ndarray]


class Unsafe(Exception):
    """A flight that may not be flown; the text says why. option: the setting that stands against it. needed: the value
    of it that this flight asks for (highest_m: m over the ground; dtm: see :func:`.choose.safe_flights`; infinite:
    unknown)."""

    def __init__(self, text: str, option: str, needed: float = np.inf) -> None:
        super().__init__(text)
        self.option, self.needed = option, needed


def made_safe(flight: PlanFlight, canopy: Canopy, camera: DroneCamera, limits: FlyingSettings) -> PlanFlight:
    """The flight with photos raised until every way between them clears the canopy.

    canopy: (N, 2) -> height of the canopy's top, datum of the terrain model, NaN where the ground is unknown.

    Raises:
        Unsafe: the ground under the flight is unknown, the clearance asks for more height than is allowed, or the
            gimbal does not reach the angle.
    """
    if not np.isfinite(flight.ground_m).all():
        unknown = int((~np.isfinite(flight.ground_m)).sum())
        raise Unsafe(f"the terrain model does not cover {unknown} of {len(flight)} photo positions", "dtm")
    low, high = camera.gimbal_deg
    if flight.pitch_deg.min() < low or flight.pitch_deg.max() > high:
        why = f"the gimbal turns from {low:g} to {high:g} degrees, the flight needs {flight.pitch_deg.min():g}"
        raise Unsafe(why, "camera")
    for _ in range(4):
        short = _shortfall(flight, canopy, limits.clearance_m)
        if short.max() <= 0.01:
            break
        flight = replace(flight, above_m=flight.above_m + short)
    else:
        raise Unsafe(f"no height keeps {limits.clearance_m:g} m over the canopy between its photos", "highest_m")
    if (needed := float(flight.above_m.max())) > limits.highest_m + 0.01:
        why = f"{limits.clearance_m:g} m from the canopy takes {np.ceil(needed):.0f} m over the ground here"
        raise Unsafe(f"{why}, expected at most {limits.highest_m:g} m", "highest_m", needed)
    return flight


def ways(flight: PlanFlight) -> tuple[np.ndarray, np.ndarray]:
    """Points along the way: (M, 3) every :data:`CHECK_M`, and (M,) number of the photo at the way's begin."""
    xyz = flight.xyz
    length = np.hypot(*np.diff(xyz[:, :2], axis=0).T)
    count = np.maximum(np.ceil(length / CHECK_M).astype(int), 1)
    start = np.repeat(np.arange(len(count)), count)
    share = np.concatenate([np.arange(n) / n for n in count]) if len(count) else np.zeros(0)
    points = xyz[start] + share[:, None] * (xyz[start + 1] - xyz[start]) if len(start) else xyz[:0]
    return np.vstack([points, xyz[-1:]]), np.append(start, len(xyz) - 1)


def needed_height(canopy: Canopy, xy: np.ndarray, clearance_m: float) -> np.ndarray:
    """(N,) lowest height at places (N, 2) that is ``clearance_m`` away from every canopy top around: a sphere of that
    radius rests on the canopy, on slopes on the uphill side. NaN where the ground below is unknown."""
    highest = canopy(xy) + clearance_m
    for share in (0.45, 0.9):
        tops = canopy((xy[:, None] + share * clearance_m * compass(45)).reshape(-1, 2)).reshape(len(xy), -1)
        beside = np.where(np.isfinite(tops), tops, -np.inf).max(axis=1)
        highest = np.maximum(highest, beside + clearance_m * np.sqrt(1 - share**2))
    return highest


def lowest_clearance(flight: PlanFlight, canopy: Canopy, wanted_m: float) -> float:
    """Least distance to the canopy along the whole way, m: what :func:`needed_height` leaves, more than
    ``wanted_m``."""
    points, _ = ways(flight)
    return wanted_m + float(np.nanmin(points[:, 2] - needed_height(canopy, points[:, :2], wanted_m)))


def _shortfall(flight: PlanFlight, canopy: Canopy, clearance_m: float) -> np.ndarray:
    """(P,) by how much each photo has to rise so that the ways to and from it are clear."""
    points, start = ways(flight)
    lowest = needed_height(canopy, points[:, :2], clearance_m)
    if not np.isfinite(lowest).all():
        raise Unsafe("the terrain model does not cover the way between its photos", "dtm")
    lack = np.maximum(lowest - points[:, 2], 0.0)
    short = np.zeros(len(flight))
    np.maximum.at(short, start, lack)
    np.maximum.at(short, np.minimum(start + 1, len(flight) - 1), lack)
    return short


def speed_of(flight: PlanFlight, camera: DroneCamera, limits: FlyingSettings) -> tuple[float, str]:
    """Speed that keeps trigger, blur and readout within limits, m/s, and what sets it."""
    gsd_m = float(flight.above_m.min()) / camera.focal_px
    same = np.diff(flight.leg) == 0
    gaps = np.linalg.norm(np.diff(flight.xyz, axis=0), axis=1)[same]
    options = [(limits.speed_m_s, "the most that was allowed")]
    if len(gaps):
        options.append((float(gaps.min()) / camera.interval_s, f"one photo every {camera.interval_s:g} s"))
    if limits.exposure_ms > 0:
        blur = f"blur below {MAX_BLUR_PX:g} px at 1/{1000 / limits.exposure_ms:.0f} s"
        options.append((MAX_BLUR_PX * gsd_m / (limits.exposure_ms / 1000), blur))
    if camera.readout_ms > 0:
        shutter = f"rolling shutter of {camera.readout_ms:g} ms"
        options.append((MAX_READOUT_PX * gsd_m / (camera.readout_ms / 1000), shutter))
    return min(options)


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
    megapixels = len(flight) * (camera.width_px * camera.height_px / 1e6)
    need = costs.predict("photos", {"photos": len(flight), "megapixels": megapixels})
    return Budget(
        len(flight), speed[0], speed[1], float(gaps.sum()) + out + home, total / 60, batteries,
        len(flight) * camera.photo_mb / 1000, need.seconds, need.outside,
    )  # fmt: skip
