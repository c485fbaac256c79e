"""How fast the camera moved at each exposure: what a rolling shutter turns into a shift between rows; and steps in an
antenna's path that no drone can fly.

A wrong ambiguity, a spliced file or an edited one moves the path at once and leaves every epoch marked as fixed. What
gives it away is physics: the displacement between two epochs against the velocity around them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pyproj

from ..core.crs import grid_convergence_deg, horizontal
from ..core.number_cells import as_number
from .photos import Photo
from .stations import Stations

#: Faster than this between two epochs is no drone (m/s): fixed wings with the wind behind them; climbs and descents.
MAX_SPEED_M_S, MAX_CLIMB_M_S = 40.0, 15.0
#: Harder than this no mapping drone brakes or turns (m/s2): full tilt of 45 degrees is 10.
MAX_ACCELERATION_M_S2 = 15.0
#: Epochs further apart than this (s) say nothing about each other's velocity: speed alone is asked there.
NEAR_S = 3.0
#: What noise and a swaying antenna may do to a displacement between fixed epochs, metres.
NOISE_M = 0.3
#: Velocity before and after a displacement: this many displacements on each side.
_BESIDE = 2
#: Epochs this far on both sides of an exposure give its velocity, seconds: long enough to average the epochs' noise
#: (1 cm at 5 Hz: 1 cm/s), short enough that a drone's acceleration is constant in it.
HALF_WINDOW_S = 0.5
#: Epochs further apart say nothing about the velocity between them, seconds.
MAX_GAP_S = 1.0
#: Epochs that a velocity needs, and the qualities (RTKLIB's Q: fix, float, PPP) whose errors change slowly enough.
_MIN_EPOCHS, _SMOOTH = 4, (1, 2, 6)
#: Epochs that lie further (RMS) beside a parabola wander: an ambiguity changed, or nothing is fixed, metres.
MAX_MISFIT_M = 0.1
#: Photos further apart say nothing about the velocity between them: the drone may stop for each, seconds.
MAX_PHOTO_GAP_S = 3.0
#: Positions worse than this (E, N) are too rough for a velocity over seconds, metres.
MAX_PHOTO_SD_M = 0.1
#: Where the velocities between the photos around one differ by more, the drone turned or stopped: m/s, or share of the
#: speed. Two intervals that agree are not enough: on ``plot_h`` they did by chance and were 1.4 m/s wrong.
MAX_CHANGE_M_S, MAX_CHANGE = 0.3, 0.1


def turned_to_grid(enu: np.ndarray, convergence_deg: float) -> np.ndarray:
    """(N, 3) vectors in true east, north, up -> the axes of the project grid, turned by the meridian convergence."""
    (east, north, up), c, s = enu.T, np.cos(np.radians(convergence_deg)), np.sin(np.radians(convergence_deg))
    return np.column_stack([east * c - north * s, north * c + east * s, up])


def path_velocities(
    times: np.ndarray,
    xyz: np.ndarray,
    quality: np.ndarray,
    segment: np.ndarray,
    at: np.ndarray,
    own: np.ndarray | None = None,
) -> np.ndarray:
    """Velocity of the antenna at N instants within the path, from its epochs; the solution's own where those are few.

    Args:
        times: (T,) seconds, rising. xyz: (T, 3) metres. quality: (T,) int RTKLIB Q. segment: (T,) int, the number of
            the uninterrupted piece of the path. at: (N,) seconds, none in a gap. own: (T, 3) the solution's own
            velocities (Doppler) on the axes of xyz, m/s.

    Returns:
        (N, 3) m/s on the axes of xyz, NaN unknown.
    """
    velocity = np.array([_slope(times, xyz, quality, segment, instant) for instant in at]).reshape(-1, 3)
    if own is not None and len(own) and own.any():
        doppler = np.column_stack([np.interp(at, times, axis) for axis in own.T])
        right = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
        change = np.linalg.norm(own[right] - own[right - 1], axis=1)
        doppler[change > MAX_ACCELERATION_M_S2 * (times[right] - times[right - 1])] = np.nan
        velocity = np.where(np.isfinite(velocity), velocity, doppler)
    return velocity


def _slope(times: np.ndarray, xyz: np.ndarray, quality: np.ndarray, segment: np.ndarray, at: float) -> np.ndarray:
    """(3,) m/s: a parabola by least squares through the epochs around ``at``; NaN with too few of them.

    Epochs of another quality may lie beside it by a constant, as a float solution does beside a fixed one. The slope of
    the interpolating curve would be noisier, and zero at every small peak.
    """
    piece = segment[np.argmin(np.abs(times - at))]
    for half in (HALF_WINDOW_S, MAX_GAP_S):
        first, last = np.searchsorted(times, [at - half - 1e-6, at + half + 1e-6])
        near = np.arange(first, last)
        near = near[(segment[near] == piece) & np.isin(quality[near], _SMOOTH)]
        if len(near) >= _MIN_EPOCHS:
            break
    else:
        return np.full(3, np.nan)
    t = times[near] - at
    kinds = np.unique(quality[near])
    design = np.column_stack([t, t * t, quality[near][:, None] == kinds])
    found, _, rank, _ = np.linalg.lstsq(design, xyz[near], rcond=None)
    misfit = np.sqrt(np.mean(np.sum((design @ found - xyz[near]) ** 2, axis=1)))
    hard = np.linalg.norm(2 * found[1]) > MAX_ACCELERATION_M_S2
    return np.full(3, np.nan) if rank < design.shape[1] or misfit > MAX_MISFIT_M or hard else found[0]


def with_velocities(stations: Stations, photos: list[Photo], track: np.ndarray) -> Stations:
    """The stations with their velocities: by the antenna's path, else the drone's own (XMP), else neighbouring photos.

    Args:
        photos: those of the stations, in their order. track: (N, 3) from the antenna's path, m/s on the project's axes,
            NaN unknown.
    """
    velocity, source = np.full((len(stations), 3), np.nan), ["unknown"] * len(stations)
    believed = np.where(stations.is_placed[:, None], track, np.nan)
    ways = {"track": believed, "xmp": _of_drone(photos, stations.crs), "photos": _of_neighbours(stations)}
    for name, found in ways.items():
        new = np.isfinite(found).all(axis=1) & ~np.isfinite(velocity).all(axis=1)
        velocity[new] = found[new]
        source = [name if use else old for use, old in zip(new, source, strict=True)]
    return replace(stations, velocity_m_s=velocity, velocity_source=source)


def _of_drone(photos: list[Photo], crs: pyproj.CRS) -> np.ndarray:
    """(N, 3) DJI's FlightXSpeed (north), FlightYSpeed (east), FlightZSpeed (down) on the project's axes, NaN unknown.

    All zero in several photos means that nobody wrote them: a drone that stands in the air reads tenths.
    """
    ned = np.array([[as_number(photo.dji.get(f"Flight{axis}Speed")) for axis in "XYZ"] for photo in photos])
    ned = ned.reshape(-1, 3)
    ned[np.linalg.norm(ned, axis=1) > MAX_SPEED_M_S] = np.nan
    known = np.isfinite(ned).all(axis=1)
    placed = np.array([photo.has_position for photo in photos], bool)
    if not placed.any() or known.sum() >= 3 and not ned[known].any():
        return np.full_like(ned, np.nan)
    lon, lat = np.median([(p.lon_deg, p.lat_deg) for p in photos if p.has_position], axis=0)
    return turned_to_grid(ned[:, [1, 0, 2]] * [1.0, 1.0, -1.0], grid_convergence_deg(horizontal(crs), lon, lat))


def _of_neighbours(stations: Stations) -> np.ndarray:
    """(N, 3) velocity from the two photos before and after, NaN where they are far in time or rough, or the
    drone did not fly straight on."""
    velocity = np.full((len(stations), 3), np.nan)
    # Times of whole seconds are no times: at 5 m/s they are metres.
    sharp = np.isfinite(stations.utc) & (np.abs(stations.utc - np.round(stations.utc)) > 1e-6)
    precise = stations.is_placed & (stations.sd[:, :2].max(axis=1) <= MAX_PHOTO_SD_M)
    for flight in np.unique(stations.flight):
        own = np.flatnonzero((stations.flight == flight) & np.isfinite(stations.utc))
        if np.mean(sharp[own]) < 0.5:
            continue
        own = own[np.argsort(stations.utc[own], kind="stable")]
        for middle in range(2, len(own) - 2):
            five = own[middle - 2 : middle + 3]
            dt = np.diff(stations.utc[five])
            if not precise[five].all() or dt.min() < 0.1 or dt.max() >= MAX_PHOTO_GAP_S:
                continue
            between = np.diff(stations.xyz[five], axis=0) / dt[:, None]
            mean = (between[1] * dt[2] + between[2] * dt[1]) / (dt[1] + dt[2])
            away = np.linalg.norm(between - mean, axis=1).max()
            if away <= max(MAX_CHANGE_M_S, MAX_CHANGE * np.linalg.norm(mean)):
                velocity[own[middle]] = mean
    return velocity


def path_offsets(times: np.ndarray, xyz: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """How far each fixed epoch lies off the path that most of them belong to.

    The path is cut where a step cannot be flown. Steps are added up, so that a jump out and back harms only what lies
    between. The longest part counts as right: which side of a lasting step is wrong cannot be seen from the path.
    Float and single epochs wander by themselves; only the photos' own positions judge them.

    Args:
        times: (T,) seconds, rising. xyz: (T, 3) metres. fixed: (T,) bool.

    Returns:
        (T, 3) metres, zero for every epoch that is believed or not fixed.
    """
    offset = np.zeros((len(times), 3))
    own = np.flatnonzero(fixed)
    if len(own) < 3:
        return offset
    chosen = _thinned(times[own])
    jump = _jumps(times[own][chosen], xyz[own][chosen])
    summed = np.vstack([np.zeros(3), np.cumsum(jump, axis=0)])
    number = np.concatenate([[0], np.cumsum((jump != 0).any(axis=1))])
    member = np.searchsorted(chosen, np.arange(len(own)), side="right") - 1
    part, place = number[member], summed[member]
    longest = int(np.argmax(np.bincount(part)))
    place = place - place[np.flatnonzero(part == longest)[0]]
    # Back to within what cannot be distinguished from flying is back.
    sizes = np.linalg.norm(jump, axis=1)
    usual = min(float(np.median(np.diff(times[own][chosen]))), NEAR_S)
    least = 0.5 * float(sizes[sizes > 0].min(initial=np.inf))
    place[np.linalg.norm(place, axis=1) <= min(least, MAX_ACCELERATION_M_S2 * usual**2 + NOISE_M)] = 0.0
    offset[own] = place
    return offset


def _thinned(times: np.ndarray) -> np.ndarray:
    """Numbers of the epochs that are apart: doubled ones a moment later have no velocity and go with the one before."""
    least = 0.5 * min(float(np.percentile(np.diff(times), 75)), NEAR_S)
    kept = [0]
    for i in range(1, len(times)):
        if times[i] - times[kept[-1]] >= least:
            kept.append(i)
    return np.array(kept)


def _jumps(times: np.ndarray, xyz: np.ndarray) -> np.ndarray:
    """(T - 1, 3) the part of each displacement that cannot have been flown, zero where all of it can."""
    dt = np.diff(times)
    moved = np.diff(xyz, axis=0)
    velocity = moved / dt[:, None]
    beside = np.full((2 * _BESIDE, len(dt), 3), np.nan)
    longest = dt.copy()
    for row, shift in enumerate(s for s in range(-_BESIDE, _BESIDE + 1) if s):
        source = np.arange(len(dt)) + shift
        inside = (source >= 0) & (source < len(dt))
        inside[inside] &= dt[source[inside]] <= NEAR_S
        beside[row, inside] = velocity[source[inside]]
        longest[inside] = np.maximum(longest[inside], dt[source[inside]])
    usual = np.zeros_like(velocity)
    known = np.isfinite(beside).any(axis=0).all(axis=1)
    usual[known] = np.nanmedian(beside[:, known], axis=0)
    excess = moved - usual * dt[:, None]
    fast = np.linalg.norm(moved[:, :2], axis=1) > MAX_SPEED_M_S * dt + NOISE_M
    fast |= np.abs(moved[:, 2]) > MAX_CLIMB_M_S * dt + NOISE_M
    near = known & (longest <= NEAR_S)
    hard = near & (np.linalg.norm(excess, axis=1) > MAX_ACCELERATION_M_S2 * longest**2 + NOISE_M)
    bad, noisy = fast | hard, np.linalg.norm(excess, axis=1) > NOISE_M
    # The way back of a jump may hide half behind a manoeuvre.
    for jump in excess[bad]:
        bad |= near & noisy & (np.linalg.norm(excess + jump, axis=1) < 0.5 * np.linalg.norm(jump))
    return np.where(bad[:, None], excess, 0.0)
