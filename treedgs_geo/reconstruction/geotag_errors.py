"""Geotags that the photos contradict: a flight's that are those of another instant, and those worse than they state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .adjustment import Adjusted, Known
from .cameras import Sensor
from .covariance import Posterior

#: By how much a flight's geotags may be those of another instant than its exposures, seconds: what few positions of
#: metres do not show where the geotags are made (:func:`treedgs_geo.geotags.exposures.find_shift`).
LATE_SD_S = 0.3
#: When a flight's geotags were taken is left to the photos where these tell it to so many metres along the flight, or
#: where it is so many standard errors from the exposures ...
TOLD_M, CERTAIN_SD = 0.05, 6.0
#: ... and where those of all such flights together are so many standard errors from theirs; else clocks are believed.
SHOWN_SD = 4.0
#: Geotags are moved along the velocities by this at least, metres; so large a share of it may be wrong, as the speed
#: changes meanwhile.
MIN_M, MOVED_SHARE = 0.02, 0.1
#: A geotag counts less where its photo stands so many times as far off as it states, and so many metres.
CONTRADICTED_TIMES, CONTRADICTED_M = 3.0, 0.05


def usual_speed_m_s(sensor: Sensor) -> np.ndarray:
    """(F,) median speed of each flight at its exposures."""
    speed = np.linalg.norm(sensor.velocity_m_s, axis=1)
    return np.array([np.median(speed[sensor.flight == flight]) for flight in range(len(sensor.drift))])


def lateness(known: Known, adjusted: Adjusted, posterior: Posterior) -> tuple[np.ndarray, np.ndarray]:
    """(F,) seconds by which the geotags of each flight come late, 0 where clocks are believed; (F,) bool: whether its
    own photos tell that, or those of the other flights, whose clocks are the same.

    Where lines are flown both ways or cross, geotags of another instant lie behind their cameras on one line and before
    them on the next. Flown one way only they move the block as a whole, which nothing in the photos tells.
    """
    late_s, looked = known.late_s + posterior.late_s, posterior.late_sd_s > 0
    sd_s = np.where(looked, posterior.late_sd_s, np.inf)
    told = posterior.late_sd_s * usual_speed_m_s(adjusted.problem.sensor) < TOLD_M
    told |= np.abs(late_s) > CERTAIN_SD * sd_s
    told &= looked
    if np.sqrt(np.sum((late_s / sd_s)[told] ** 2)) <= SHOWN_SD:
        return np.zeros_like(late_s), np.zeros_like(told)
    usual = np.average(late_s, weights=1 / sd_s**2)
    return np.where(told, late_s, np.where(looked, usual, 0.0)), told


def in_time(known: Known, given: Known, adjusted: Adjusted, posterior: Posterior) -> Known:
    """What is known, with the geotags of each flight moved from where they were ``given`` along its velocities to when
    its photos were taken."""
    sensor = adjusted.problem.sensor
    speed, late_s = usual_speed_m_s(sensor), lateness(known, adjusted, posterior)[0]
    late_s[np.abs(late_s) * speed < MIN_M] = 0.0
    if (np.abs(late_s - known.late_s) * speed < MIN_M).all():
        return known
    moved = late_s[sensor.flight, None] * sensor.velocity_m_s
    return replace(known, xyz=given.xyz + moved, sd=np.hypot(given.sd, MOVED_SHARE * np.abs(moved)), late_s=late_s)


def settle_time(known: Known, given: Known, adjusted: Adjusted, posterior: Posterior) -> Known:
    """:func:`in_time` for the last adjustment: held where a flight's own photos do not tell."""
    told = lateness(known, adjusted, posterior)[1]
    return replace(in_time(known, given, adjusted, posterior), late_sd_s=np.where(told, known.late_sd_s, 0.0))


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
