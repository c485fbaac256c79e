"""The flights: camera stations, shutter times, and what the PPK solution and the single-point tags say of them."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from .settings import Sizes

#: GPST - UTC in the year of the simulated flights, s.
LEAP_SECONDS = 18
#: Shortest time between two photos of a drone that does not stop, s.
MIN_INTERVAL_S = 0.5
#: Camera -> antenna in the aircraft: forward, right, up, m.
LEVER_ARM = np.array([-0.060, -0.004, 0.188])


@dataclass(frozen=True)
class Station:
    """One photo. centre: (3,) local camera centre, m. rotation: (3, 3) world -> camera. lever: (3,) antenna -> camera
    as the MRK states it: E, N and V (down), whole millimetres. seconds: UTC shutter time after the start. velocity:
    (3,) m/s in the local frame at the shutter; zero when the drone hovers."""

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
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))

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


class Shot(NamedTuple):
    """One photo as planned. xyz: (3,) local camera centre, m; angles in degrees."""

    flight: int
    kind: str
    xyz: np.ndarray
    yaw_deg: float
    pitch_deg: float
    roll_deg: float


def planned_shots(photos: np.ndarray) -> list[Shot]:
    """Photos as planned, (P, 5): x, y, height, yaw, pitch."""
    return [
        Shot(0, "nadir" if pitch < -85 else "oblique", np.array([x, y, up]), float(yaw), float(pitch), 0.0)
        for x, y, up, yaw, pitch in photos
    ]


def ring_shots(rng: np.random.Generator, sizes: Sizes) -> list[Shot]:
    """Nadir grid and rings around the plot."""
    shots: list[Shot] = []
    side = int(round(np.sqrt(sizes.nadir)))
    heading = rng.uniform(0, 360)
    turn = np.radians(heading)
    for i in range(side):
        for j in range(side):
            k = j if i % 2 == 0 else side - 1 - j
            a, b = (i - (side - 1) / 2) * sizes.nadir_step_m, (k - (side - 1) / 2) * sizes.nadir_step_m
            xy = np.array([a * np.cos(turn) + b * np.sin(turn), -a * np.sin(turn) + b * np.cos(turn)])
            xy = xy + rng.normal(0, 0.7, 2)
            xyz = np.array([*xy, 70 + rng.normal(0, 0.3)])
            yaw = heading + 180 * (i % 2) + rng.normal(0, 0.3)
            shots.append(Shot(0, "nadir", xyz, yaw, -90 + abs(rng.normal(0, 0.4)), rng.normal(0, 0.3)))
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
            shots.append(
                Shot(flight, "oblique", np.array([*xy, up]), yaw + rng.normal(0, 0.4), tilt, rng.normal(0, 0.3))
            )
    return shots


def level_shots(rng: np.random.Generator, kind: str, radius_m: float) -> list[Shot]:
    """Photos from among the stems: ``walk``, at eye level round the plot and along two lines through it, ahead and to
    both sides; ``low``, two rings below the crowns. Heights over the ground below."""
    if kind == "walk":
        turn = np.linspace(0, 2 * np.pi, 36, endpoint=False)
        rows = [(radius_m + 4.0, a, 1.65, 2.0) for a in turn]
    else:
        rings = (radius_m + 5.0, 4.5, -12.0, 30), (radius_m + 1.0, 6.0, -20.0, 24)
        rows = [(far, 2 * np.pi * k / n, up, pitch) for far, up, pitch, n in rings for k in range(n)]
    shots = []
    for far, angle, up, pitch in rows:
        xy = (far + rng.normal(0, 0.5)) * np.array([np.cos(angle), np.sin(angle)])
        aim = rng.uniform(-0.4, 0.4, 2) * radius_m - xy
        shots.append((*xy, up, np.degrees(np.arctan2(*aim)), pitch))
    if kind == "walk":
        for heading in (0.0, 90.0):
            way = np.array([np.sin(np.radians(heading)), np.cos(np.radians(heading))])
            for along in np.arange(-radius_m - 3.0, radius_m + 3.0, 1.6):
                for side in (-55.0, 0.0, 55.0):
                    xy = along * way + rng.normal(0, 0.3, 2)
                    shots.append((*xy, 1.65, heading + side + rng.normal(0, 4.0), 2.0))
    return [
        Shot(0, "level", np.array([x, y, up + rng.normal(0, 0.06)]), float(yaw), pitch + rng.normal(0, 1.5), 0.0)
        for x, y, up, yaw, pitch in shots
    ]


def fly(
    rng: np.random.Generator,
    shots: list[Shot],
    start_utc: dt.datetime,
    sun_shift_min: float = 0.0,
    speed_m_s: float = 0.0,
    utc_offset_h: int = -5,
) -> list[Station]:
    """Shutter times, names and lever arms of the planned photos.

    A later flight begins 5 min after the one before ends, or ``sun_shift_min`` after the start if that is later.
    speed_m_s: of the drone at every photo, along the way from the photo before to the next; 0 = it hovers.
    """
    stations: list[Station] = []
    clock = 0.0
    previous: Shot | None = None
    for number, shot in enumerate(shots, start=1):
        if previous is not None:
            leg = float(np.linalg.norm(shot.xyz - previous.xyz))
            pause = max(2.0, leg / rng.uniform(5.0, 6.5)) + rng.uniform(0, 0.2)
            clock += max(MIN_INTERVAL_S, leg / speed_m_s) if speed_m_s else pause
            if shot.flight != previous.flight:
                clock = max(clock + 300, sun_shift_min * 60)
        previous = shot
        utc = start_utc + dt.timedelta(seconds=round(clock, 6))
        local = utc + dt.timedelta(hours=utc_offset_h)
        body = np.radians(shot.yaw_deg + rng.normal(0, 2))
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
                shot.flight,
                shot.kind,
                shot.xyz,
                rotation_from_angles(shot.yaw_deg, shot.pitch_deg, shot.roll_deg),
                shot.yaw_deg % 360,
                shot.pitch_deg,
                shot.roll_deg,
                clock,
                utc,
                lever,
            )
        )
    if not speed_m_s:
        return stations
    velocity = speed_m_s * _headings(stations)
    return [replace(station, velocity=v) for station, v in zip(stations, velocity, strict=True)]


def _headings(stations: list[Station]) -> np.ndarray:
    """(P, 3) unit vectors along the way from the photo before to the next of the same flight, by the antenna's path."""
    place, flights = np.array([s.antenna for s in stations]), np.array([s.flight for s in stations])
    way = np.zeros_like(place)
    for flight in np.unique(flights):
        own = np.flatnonzero(flights == flight)
        if len(own) > 1:
            legs = np.diff(place[own], axis=0)
            legs /= np.maximum(np.linalg.norm(legs, axis=1, keepdims=True), 1e-9)
            # Where the drone turns back on the spot the leg that it came by counts.
            both = 1.001 * legs[:-1] + legs[1:]
            way[own] = np.concatenate([legs[:1], both, legs[-1:]])
    return way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)


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
        if any(station.velocity.any() for station in stations):
            velocity = np.array([station.velocity for station in stations])
            path = CubicHermiteSpline(times[here], antenna[here], velocity[here])
        else:
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
