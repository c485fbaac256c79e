"""The flights: camera stations, shutter times, and what the PPK solution and the single-point tags say of them."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from ..reconstruction.cameras import Camera
from .settings import Sizes

#: GPST - UTC in the year of the simulated flights, s.
LEAP_SECONDS = 18
#: Camera -> antenna in the aircraft: forward, right, up, m.
LEVER_ARM = np.array([-0.060, -0.004, 0.188])


@dataclass(frozen=True)
class Station:
    """One photo. centre: (3,) local camera centre, m. rotation: (3, 3) world -> camera. lever: (3,) antenna -> camera
    as the MRK states it: E, N and V (down), whole millimetres. seconds: UTC shutter time after the start."""

    name: str
    flight: int
    kind: str
    centre: np.ndarray
    rotation: np.ndarray
    yaw_deg: float
    pitch_deg: float
    roll_deg: float
    seconds: float
    utc: dt.datetime
    lever_mm: np.ndarray

    @property
    def antenna(self) -> np.ndarray:
        """(3,) local antenna phase centre."""
        return self.centre - self.lever_mm / 1000 * np.array([1, 1, -1])


def rotation_from_angles(yaw_deg: float, pitch_deg: float, roll_deg: float) -> np.ndarray:
    """Grid yaw (clockwise from +y), gimbal pitch (-90 = down), roll -> (3, 3) world -> camera, OpenCV axes."""
    yaw, pitch, roll = np.radians([yaw_deg, pitch_deg, roll_deg])
    forward = np.array([np.sin(yaw) * np.cos(pitch), np.cos(yaw) * np.cos(pitch), np.sin(pitch)])
    right = np.array([np.cos(yaw), -np.sin(yaw), 0.0])
    down = np.cross(forward, right)
    return np.stack([np.cos(roll) * right + np.sin(roll) * down, np.cos(roll) * down - np.sin(roll) * right, forward])


def make_camera(gsd_cm: float, sizes: Sizes) -> Camera:
    """The lens: f from the GSD at 70 m, principal point off centre, mild barrel distortion."""
    focal = float(round(7000 / gsd_cm))
    return Camera(
        sizes.image_width,
        sizes.image_height,
        focal,
        focal,
        sizes.image_width / 2 + 5.3,
        sizes.image_height / 2 - 3.7,
        k1=-0.02,
        k2=0.01,
    )


def plan(
    rng: np.random.Generator, sun_shift_min: float, sizes: Sizes, start_utc: dt.datetime, utc_offset_h: int = -5
) -> list[Station]:
    """Nadir grid and rings around the plot.

    The second flight begins 5 min after the first ends, or ``sun_shift_min`` after its start if that is later.
    """
    shots: list[tuple] = []
    side = int(round(np.sqrt(sizes.nadir)))
    heading = rng.uniform(0, 360)
    turn = np.radians(heading)
    for i in range(side):
        for j in range(side):
            k = j if i % 2 == 0 else side - 1 - j
            a, b = (i - (side - 1) / 2) * sizes.nadir_step_m, (k - (side - 1) / 2) * sizes.nadir_step_m
            xy = np.array([a * np.cos(turn) + b * np.sin(turn), -a * np.sin(turn) + b * np.cos(turn)])
            xy = xy + rng.normal(0, 0.7, 2)
            shots.append(
                (
                    0,
                    "nadir",
                    [*xy, 70 + rng.normal(0, 0.3)],
                    heading + 180 * (i % 2) + rng.normal(0, 0.3),
                    -90 + abs(rng.normal(0, 0.4)),
                    rng.normal(0, 0.3),
                )
            )
    left = sizes.photos - len(shots)
    counts = _split(left, [ring[2] for ring in sizes.rings])
    for (height, pitch, _, flight), count in zip(sizes.rings, counts, strict=True):
        phase = rng.uniform(0, 360)
        for k in range(count):
            yaw = phase + 360 * k / count + rng.normal(0, 1.5)
            tilt = pitch + rng.normal(0, 1.0)
            reach, bearing = sizes.target_off_m * np.sqrt(rng.random()), rng.uniform(0, 2 * np.pi)
            target = reach * np.array([np.cos(bearing), np.sin(bearing)])
            up = height + rng.normal(0, 0.3)
            reach = up / np.tan(np.radians(-tilt))
            xy = target - reach * np.array([np.sin(np.radians(yaw)), np.cos(np.radians(yaw))])
            shots.append((flight, "oblique", [*xy, up], yaw + rng.normal(0, 0.4), tilt, rng.normal(0, 0.3)))
    stations: list[Station] = []
    clock = 0.0
    previous: tuple[int, np.ndarray] | None = None
    for number, (flight, kind, centre, yaw, pitch, roll) in enumerate(shots, start=1):
        position = np.array(centre, float)
        if previous is not None:
            leg = float(np.linalg.norm(position - previous[1]))
            clock += max(2.0, leg / rng.uniform(5.0, 6.5)) + rng.uniform(0, 0.2)
            if flight != previous[0]:
                clock = max(clock + 300, sun_shift_min * 60)
        previous = flight, position
        utc = start_utc + dt.timedelta(seconds=round(clock, 6))
        local = utc + dt.timedelta(hours=utc_offset_h)
        body = np.radians(yaw + rng.normal(0, 2))
        tilted = LEVER_ARM + rng.normal(0, 0.006, 3)
        antenna = np.array(
            [
                tilted[0] * np.sin(body) + tilted[1] * np.cos(body),
                tilted[0] * np.cos(body) - tilted[1] * np.sin(body),
                tilted[2],
            ]
        )
        # MRK: vector antenna -> camera, north and east positive, vertical positive down.
        lever = np.round(np.array([-antenna[0], -antenna[1], antenna[2]]) * 1000)
        stations.append(
            Station(
                f"DJI_{local:%Y%m%d%H%M%S}_{number:04d}_V.JPG",
                flight,
                kind,
                position,
                rotation_from_angles(yaw, pitch, roll),
                yaw % 360,
                pitch,
                roll,
                clock,
                utc,
                lever,
            )
        )
    return stations


def _split(total: int, shares: list[float]) -> list[int]:
    """Whole numbers proportional to the shares that add up to the total."""
    exact = np.array(shares) / sum(shares) * total
    counts = np.floor(exact).astype(int)
    for index in np.argsort(counts - exact)[: total - counts.sum()]:
        counts[index] += 1
    return counts.tolist()


@dataclass(frozen=True)
class Track:
    """PPK solution at 5 Hz. seconds: (M,) UTC after the start. position: (M, 3) local antenna. quality: (M,) 1 or 2.
    floating: (P,) bool a photo: shutter inside a float burst."""

    seconds: np.ndarray
    position: np.ndarray
    quality: np.ndarray
    floating: np.ndarray


def ppk_track(rng: np.random.Generator, stations: list[Station], start_utc: dt.datetime, float_epochs: int) -> Track:
    """Antenna path through the stations, with correlated noise (1.5 cm level, 3 cm vertical) and float bursts."""
    times = np.array([station.seconds for station in stations])
    antenna = np.array([station.antenna for station in stations])
    flights = np.array([station.flight for station in stations])
    chosen = rng.choice(len(stations), min(float_epochs, len(stations)), replace=False)
    bursts = [
        (times[k] - rng.uniform(0.8, 1.6), times[k] + rng.uniform(0.8, 1.6), rng.normal(0, 0.3, 3)) for k in chosen
    ]
    # Epochs lie on whole 0.2 s of GPS time, which differs from UTC by whole seconds.
    fraction = start_utc.microsecond / 1e6
    parts = []
    for flight in np.unique(flights):
        here = flights == flight
        path = CubicSpline(times[here], antenna[here], bc_type="natural")
        first = np.ceil((times[here][0] - 6 + fraction) * 5) / 5 - fraction
        t = np.arange(first, times[here][-1] + 6, 0.2)
        inside = np.clip(t, times[here][0], times[here][-1])
        position = path(inside) + path(inside, 1) * np.clip(t - inside, -2, 2)[:, None]
        drive = rng.standard_normal((len(t), 3))
        noise, keep = np.zeros_like(drive), np.exp(-0.2 / 3.0)
        noise[0] = drive[0]
        for k in range(1, len(t)):
            noise[k] = keep * noise[k - 1] + np.sqrt(1 - keep**2) * drive[k]
        position = position + noise * [0.015, 0.015, 0.03]
        quality = np.ones(len(t), int)
        for begin, end, shift in bursts:
            bad = (t >= begin) & (t <= end)
            position[bad] += shift
            quality[bad] = 2
        parts.append((t, position, quality))
    seconds, position, quality = (np.concatenate([part[k] for part in parts]) for k in range(3))
    floating = np.array([any(a <= t <= b for a, b, _ in bursts) for t in times])
    return Track(seconds, position, quality, floating)
