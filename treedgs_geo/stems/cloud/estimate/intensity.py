"""Intensity as if every point had been at the same range: where the scanner flew is read from the pulses themselves
(:mod:`.track`)."""

from __future__ import annotations

import numpy as np

from ....core.errors import InputError
from ....pointcloud.cloud import PointCloud
from .track import SensorTrack


def range_normalised(cloud: PointCloud) -> np.ndarray:
    """(N,) intensity x (range / median range) squared, as for a target wider than the beam.

    Raises:
        InputError: no intensity, no GPS time, or too few pulses with two returns.
    """
    if "intensity" not in cloud.attributes:
        raise InputError("--weights range_intensity: the cloud has no intensity; use --weights none.")
    if "gps_time" not in cloud.attributes:
        raise InputError(
            "--weights range_intensity: the cloud has no gps_time, expected one a pulse; use --weights intensity."
        )
    track = SensorTrack.of(cloud.xyz, cloud.attributes)
    if track is None:
        raise InputError(
            "--weights range_intensity: too few pulses have two returns that lie apart, expected ten in half a second, "
            "to find where the scanner was; use --weights intensity."
        )
    distance = np.linalg.norm(cloud.xyz - track.at(track.seen), axis=1)
    return np.asarray(cloud.attributes["intensity"], float) * (distance / np.median(distance)) ** 2.0
