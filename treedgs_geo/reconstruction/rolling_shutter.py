"""What a block's photos say of lens and shutter: which parts they determine, and which they do not ask for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..geotags.readout import Readout
from ..geotags.stations import Stations
from .adjustment import Known, adjust
from .bundle import GOOD, PARTS, PIXEL_LOSS
from .bundle_kernels import FIRST_FLIGHT, READOUT
from .calibration import Calibration
from .cameras import Camera, Sensor
from .covariance import Posterior
from .tracks import Block, intersect

#: Readout time of a shutter that nothing is known of: an electronic one takes 10 to 40 ms.
UNKNOWN_READOUT_SD_S = 0.02
#: A camera that moves slower has no rolling shutter to speak of, m/s.
_HOVER_M_S = 0.3
#: Photos that must have moved for their readout time to show.
_MIN_MOVING = 8
#: What a gimbal turns by itself, degrees a second: adds to the readout travel as a shift of the ground.
_GIMBAL_RATE_DEG_S = 0.4
#: Speed of a drone whose speed is unknown, m/s.
_SPEED_SD_M_S = 3.0
#: A readout time is kept when it is this many standard errors from none, and at least so long.
_KEPT_SD, _KEPT_S = 3.0, 0.001
#: A part of the lens is freed when the photos that were held out fit better by this many standard errors.
_ASKED_SD = 4.0
#: A flight has a focal length of its own when that differs from the first flight's by this many standard errors.
_DRIFT_SD = 5.0
#: Square pixels, to this: the standard deviation of log(fy / fx).
_ASPECT_SD = 2e-4


def lens_sd(calibration: Calibration) -> np.ndarray:
    """(9,) ``Known.lens_sd`` of a calibration's standard deviations."""
    sd = calibration.sd
    rest = [sd[name] for name in ("cx", "cy", "k1", "k2", "p1", "p2", "k3")]
    return np.array([sd["fx"] / calibration.camera.fx, _ASPECT_SD, *rest])


def sensor_of(stations: Stations, camera: Camera) -> Sensor:
    """Lens and shutter to begin with: flights from 0, velocities of the geotags (0 where unknown), no readout time."""
    count = len(stations)
    flight = np.unique(stations.flight, return_inverse=True)[1]
    velocity = np.nan_to_num(stations.velocity_m_s)
    return Sensor(camera, flight, np.zeros(flight.max(initial=0) + 1), velocity, 0.0, np.zeros((count, 3)))


def free_shutter(
    known: Known, sensor: Sensor, stations: Stations, readout: Readout, height_m: float
) -> tuple[Known, Sensor, frozenset[str]]:
    """What is known of the shutter, and the parts of it that the photos can determine.

    Where speeds are known one number is sought, the readout time; where they are not, and the shutter may roll, each
    photo has a movement of its own, if geotags are good enough to hold the block against those.
    """
    seconds = readout.seconds if readout.is_known else 0.0
    sd = readout.sd_s if readout.is_known else UNKNOWN_READOUT_SD_S
    if seconds == 0 and sd == 0:
        return known, sensor, frozenset()
    has_speed = np.isfinite(stations.velocity_m_s).all(axis=1)
    moving = has_speed & (np.linalg.norm(sensor.velocity_m_s, axis=1) > _HOVER_M_S)
    likely = max(seconds, 0.5 * sd)
    turn_m = np.radians(_GIMBAL_RATE_DEG_S) * likely * height_m
    if moving.sum() >= max(_MIN_MOVING, 0.3 * len(stations)):
        known = replace(known, readout_s=seconds, readout_sd_s=sd, travel_sd_m=turn_m)
        return known, replace(sensor, readout_s=seconds), frozenset({"readout", "travel"})
    if has_speed.mean() > 0.7:
        # It hovered: whatever the readout takes, the camera stood still meanwhile.
        return known, replace(sensor, readout_s=seconds), frozenset()
    if not known.is_precise:
        # Movements of nadir photos and the bend of their block look alike: two metres on ``drone_brighton_beach``.
        return known, sensor, frozenset()
    return replace(known, travel_sd_m=float(np.hypot(turn_m, likely * _SPEED_SD_M_S))), sensor, frozenset({"travel"})


def settle_shutter(
    block: Block, known: Known, free: frozenset[str], posterior: Posterior
) -> tuple[Known, frozenset[str]]:
    """Give up a readout time that is not clearly more than none, and movements that the held-out points do not ask
    for.
    """
    if "readout" in free:
        if abs(block.sensor.readout_s) >= max(_KEPT_SD * posterior.shared_sd[READOUT], _KEPT_S):
            return known, free
        known = replace(known, readout_s=0.0, readout_sd_s=0.0)
    elif "travel" not in free or asks_for(block, known, free - {"travel"}, "travel"):
        return known, free
    block.sensor = replace(_still(block.sensor), readout_s=known.readout_s)
    return known, free - {"readout", "travel"}


def settle_lens(block: Block, known: Known, free: frozenset[str], posterior: Posterior) -> frozenset[str]:
    """Free k3 where points that were held out ask for it, and keep the flights' focal lengths apart where they clearly
    differ.

    A flight whose geotags are centimetres too high, tied to the others through moved shadows, wants a focal length of
    its own that it does not have: three standard errors of it on ``plot_e``. Held-out points do not tell, geotags do.
    p1 and p2 are always free, held by their prior: with a narrow field the principal point takes them up and held-out
    points hardly differ, but without them the focal length went 0.25 % off (``plot_h``).
    """
    if known.lens_sd[list(PARTS["k3"])].all() and asks_for(block, known, free, "k3"):
        free |= {"k3"}
    drift, sd = block.sensor.drift[1:], posterior.shared_sd[FIRST_FLIGHT:]
    if "drift" in free and not (np.abs(drift) > _DRIFT_SD * sd).any():
        block.sensor = replace(block.sensor, drift=np.zeros_like(block.sensor.drift))
        free -= {"drift"}
    return free


def _still(sensor: Sensor) -> Sensor:
    """Lens and shutter without the movements that were estimated photo by photo."""
    return replace(sensor, extra_travel_m=np.zeros_like(sensor.extra_travel_m))


def asks_for(block: Block, known: Known, free: frozenset[str], part: str) -> bool:
    """Whether a fifth of the points, held out of the adjustment, fit better with a part freed than without it."""
    held = np.arange(len(block.points)) % 5 == 0
    losses, sigma = [], 0.0
    for parts in (free, free | {part}):
        fitted, probe = block.part(~held), block.part(held)
        if not len(fitted.points):
            return False
        if part == "travel" and part not in parts:
            fitted.sensor = _still(fitted.sensor)
        found = adjust(fitted, known, parts, final=True, iterations=20, tolerance=GOOD)
        sigma = sigma or found.sigma_px
        probe.sensor, probe.rotations, probe.translations = fitted.sensor, fitted.rotations, fitted.translations
        intersect(probe)
        losses.append(np.log1p(np.sum(probe.residuals() ** 2, axis=1) / (PIXEL_LOSS * sigma) ** 2))
    gain = losses[0] - losses[1]
    gain = gain[np.isfinite(gain)]
    return bool(len(gain) > 50 and gain.mean() > _ASKED_SD * gain.std() / np.sqrt(len(gain)))
