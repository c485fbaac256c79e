"""Intensity as if every point had been at the same range: where the scanner flew is read from the pulses themselves.

A pulse with two returns is a line through the scanner; the lines of half a second nearly meet in one point. No
trajectory file is needed. (The idea is that of Gatziolis & McGaughey 2019 and of ``track_sensor`` in lidR.)
"""

from __future__ import annotations

import numpy as np

from ....core.errors import InputError
from ....pointcloud.cloud import PointCloud

#: Returns of one pulse nearer than this do not give its direction, metres; seconds of flight that count as one place.
MIN_SPAN_M, STEP_S = 1.0, 0.5
#: Pulses that one place needs, and how far their lines may pass it (median), metres.
MIN_PULSES, WORST_MISS_M = 12, 2.0


def scanner_track(cloud: PointCloud) -> tuple[np.ndarray, np.ndarray]:
    """``(times (T,) s, places (T, 3))`` of the scanner in project coordinates, from pulses with several returns.

    Raises:
        InputError: no GPS time, or too few such pulses.
    """
    if "gps_time" not in cloud.attributes:
        raise InputError(
            "--weights range_intensity: the cloud has no gps_time, expected one a pulse; use --weights intensity."
        )
    time = np.asarray(cloud.attributes["gps_time"], float)
    origin = cloud.xyz.mean(axis=0)
    order = np.lexsort((cloud.xyz[:, 2], time))
    t, p = time[order], (cloud.xyz - origin)[order]
    # Neighbours with the same time are one pulse: its lowest and its highest return.
    starts = np.flatnonzero(np.r_[True, np.diff(t) > 0])
    ends = np.r_[starts[1:], len(t)] - 1
    low, high = p[starts], p[ends]
    ray = high - low
    length = np.linalg.norm(ray, axis=1)
    good = (length > MIN_SPAN_M) & (ray[:, 2] > 0.5 * length)
    low, ray, when = low[good], ray[good] / length[good, None], t[starts][good]
    bins = np.floor((when - when.min()) / STEP_S).astype(np.int64) if len(when) else np.empty(0, np.int64)
    times, places = [], []
    for number in np.unique(bins):
        mine = bins == number
        if mine.sum() < MIN_PULSES:
            continue
        place = _meet(low[mine], ray[mine])
        if place is not None:
            times.append(float(when[mine].mean()))
            places.append(place)
    if not times:
        raise InputError(
            f"--weights range_intensity: only {len(when)} pulses have two returns a metre apart, too few "
            "to find where the scanner was; use --weights intensity."
        )
    return np.array(times), np.array(places) + origin


def _meet(through: np.ndarray, along: np.ndarray) -> np.ndarray | None:
    """The point nearest to (N, 3) lines, with far ones weighed down; ``None`` where they do not meet."""
    weight = np.ones(len(through))
    for _ in range(8):
        across = np.eye(3) - along[:, :, None] * along[:, None, :]
        normal = (weight[:, None, None] * across).sum(axis=0)
        if np.linalg.cond(normal) > 1e4:
            return None
        point = np.linalg.solve(normal, (weight[:, None, None] * across @ through[:, :, None]).sum(axis=0)[:, 0])
        miss = np.linalg.norm((across @ (through - point)[:, :, None])[:, :, 0], axis=1)
        scale = max(float(np.median(miss)), 0.05)
        weight = 1.0 / (1.0 + (miss / (2 * scale)) ** 2)
    return point if np.median(miss) < WORST_MISS_M and point[2] > through[:, 2].max() else None


def range_normalised(cloud: PointCloud, power: float = 2.0) -> np.ndarray:
    """(N,) intensity x (range / median range) ^ power; 2 is right for a target wider than the beam."""
    if "intensity" not in cloud.attributes:
        raise InputError("--weights range_intensity: the cloud has no intensity; use --weights none.")
    times, places = scanner_track(cloud)
    time = np.asarray(cloud.attributes["gps_time"], float)
    # A point belongs to the place nearest in time; between places of one line it is interpolated.
    right = np.clip(np.searchsorted(times, time), 1, max(len(times) - 1, 1))
    if len(times) == 1:
        at = np.repeat(places, len(time), axis=0)
    else:
        left = right - 1
        gap = times[right] - times[left]
        share = np.clip((time - times[left]) / np.maximum(gap, 1e-9), 0.0, 1.0)
        share = np.where(gap > 4 * STEP_S, np.round(share), share)
        at = places[left] * (1 - share)[:, None] + places[right] * share[:, None]
    distance = np.linalg.norm(cloud.xyz - at, axis=1)
    return np.asarray(cloud.attributes["intensity"], float) * (distance / np.median(distance)) ** power
