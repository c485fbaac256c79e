"""Geotags that the photos contradict: a flight's that are those of another instant, and those worse than they state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .adjustment import Adjusted, Known
from .camera_model import Sensor
from .covariance import Posterior

#: When a flight's geotags were taken is left to the photos where these tell it to so many metres along the flight, or
#: where it is so many standard errors from the exposures ...
TOLD_M, CERTAIN_SD = 0.05, 6.0
#: ... and where those of all such flights together are so many standard errors from theirs; else clocks are believed.
SHOWN_SD = 3.0
#: Geotags are moved along the velocities by this at least, metres; so large a share of it may be wrong, as the speed
#: changes meanwhile.
MIN_M, MOVED_SHARE = 0.02, 0.1
#: A geotag counts less where its photo stands so many times as far off as it states, and so many metres.
CONTRADICTED_TIMES, CONTRADICTED_M = 3.0, 0.05


def usual_speed_m_s(sensor: Sensor) -> np.ndarray:
    """(F,) median speed of each flight at its exposures."""
    speed = np.linalg.norm(sensor.velocity_m_s, axis=1)
    return np.array([np.median(speed[sensor.flight == flight]) for flight in range(len(sensor.drift))])


def tell_the_time(known: Known, adjusted: Adjusted, posterior: Posterior) -> np.ndarray:
    """(F,) bool: flights whose photos tell that their geotags were taken at another time.

    Where lines are flown both ways or cross, geotags of another instant lie behind their cameras on one line and before
    them on the next. Flown one way only they move the block as a whole, which nothing in the photos tells.
    """
    looked = posterior.late_sd_s > 0
    times = np.abs(known.late_s + posterior.late_s) / np.where(looked, posterior.late_sd_s, np.inf)
    told = posterior.late_sd_s * usual_speed_m_s(adjusted.problem.sensor) < TOLD_M
    told = looked & (told | (times > CERTAIN_SD))
    return told & (np.sqrt(np.sum(times[told] ** 2)) > SHOWN_SD)


def in_time(known: Known, adjusted: Adjusted, posterior: Posterior) -> Known:
    """What is known, with the geotags of each flight moved along its velocities to when its photos were taken."""
    sensor = adjusted.problem.sensor
    late_s = np.where(tell_the_time(known, adjusted, posterior), posterior.late_s, 0.0)
    late_s[np.abs(late_s) * usual_speed_m_s(sensor) < MIN_M] = 0.0
    if not late_s.any():
        return known
    moved = late_s[sensor.flight, None] * sensor.velocity_m_s
    return replace(
        known, xyz=known.xyz + moved, sd=np.hypot(known.sd, MOVED_SHARE * np.abs(moved)), late_s=known.late_s + late_s
    )


def settle_time(known: Known, adjusted: Adjusted, posterior: Posterior, given: Known) -> Known:
    """What is known for the last adjustment: geotags of flights whose photos do not tell the time are as they were
    given, and held there, for clocks are right unless they show otherwise.
    """
    told = tell_the_time(known, adjusted, posterior)
    of_told = told[adjusted.problem.sensor.flight, None]
    known = in_time(known, adjusted, posterior)
    return replace(
        known,
        xyz=np.where(of_told, known.xyz, given.xyz),
        sd=np.where(of_told, known.sd, given.sd),
        late_s=np.where(told, known.late_s, 0.0),
        late_sd_s=np.where(told, known.late_sd_s, 0.0),
    )


def as_photos_say(known: Known, adjusted: Adjusted) -> Known:
    """What is known, with standard errors of geotags as large as their distance from where the photos hold the camera,
    where that is far more than they state (float solutions that are labelled fixed)."""
    off = adjusted.off_geotags_m
    times = np.linalg.norm(off / known.sd, axis=1) / np.sqrt(3)
    with np.errstate(invalid="ignore"):
        contradicted = (times > CONTRADICTED_TIMES) & (np.linalg.norm(off, axis=1) > CONTRADICTED_M)
    if not contradicted.any():
        return known
    sd = np.where(contradicted[:, None], known.sd * times[:, None], known.sd)
    return replace(known, sd=sd, contradicted=known.contradicted | contradicted)
