"""Scans or flight lines of a cloud that lie beside one another: moved together by what their stems agree on."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from ....core.machine import in_threads
from ....core.progress import Reporter
from ....pointcloud.cloud import PointCloud, grouped, slices
from ...geometry.cone import Cone
from ...quality.priors import BREAST_HEIGHT_M
from ..propose.nearby import Nearby
from ..propose.segment import StemMap
from ..propose.sensors import SENSORS, Sensor
from .passes import REACH_M, Passes, PassFit, common_shifts, fit_passes
from .track import SensorTrack

#: Points of the stem band that are looked at, at most.
MAX_POINTS = 3_000_000
#: Shifts beyond this are a warning, m: flight lines always lie a centimetre or two apart.
SAID_M = 0.02


class Scanned:
    """What a cloud's stems were seen with, each found where it is asked for first. ids: (K,) of the stems. groups: the
    points of each."""

    def __init__(self, cloud: PointCloud, tree_id: np.ndarray, sensor: Sensor) -> None:
        self._cloud, self._sensor = cloud, sensor
        self.ids, self.groups = grouped(tree_id)

    @cached_property
    def passes(self) -> Passes:
        """Which pass each point belongs to."""
        return Passes(self._cloud.attributes, len(self._cloud), self.groups)

    @cached_property
    def track(self) -> SensorTrack | None:
        """Where the scanner was; ``None`` where that is not known, or tells nothing about the error."""
        return SensorTrack.of(self._cloud.xyz, self._cloud.attributes) if self._sensor.calibrated else None


def fitted_together(
    cloud: PointCloud, scanned: Scanned, height: np.ndarray, stems: StemMap, reporter: Reporter
) -> PointCloud | None:
    """The cloud, its scans moved onto one another; ``None`` where they fit, where nothing tells them apart, or where
    the stems do not agree. height: (N,) of the points."""
    passes = scanned.passes
    if not scanned.groups or not np.ptp(passes.keys(np.concatenate(scanned.groups))):
        return None
    band = np.flatnonzero((height > 0.3) & (height < 4.5))
    band = band[:: max(len(band) // MAX_POINTS, 1)].copy()  # the rest is let go of
    around = Nearby(np.column_stack([cloud.xyz[band, :2] - stems.origin, height[band]]))
    track, floor_m = scanned.track, SENSORS[stems.sensor].floor_m

    def passes_at(cone: Cone) -> PassFit | None:
        reach = float(cone.radius(BREAST_HEIGHT_M)) + 2 * REACH_M + 0.1
        near = around.within(cone.centre(BREAST_HEIGHT_M), reach)
        label = passes.of(band[near])
        if not label.any():
            return None
        key, towards = passes.keys(band[near]), None if track is None else track.towards(band[near])
        return fit_passes(around.points[near], label, key, cone, BREAST_HEIGHT_M, floor_m, towards)

    fits = in_threads(passes_at, [stem.cone for stem in stems.stems if not stem.refused])
    shifts = common_shifts([fit for fit in fits if fit is not None])
    if not shifts:
        return None
    names = np.array(sorted(shifts))
    table = np.vstack([[shifts[name] for name in names], np.zeros(2)])
    xyz = cloud.xyz.copy()
    for part in slices(len(xyz)):
        key = passes.keys(np.arange(part.start, part.stop))
        place = np.minimum(np.searchsorted(names, key), len(names) - 1)
        xyz[part, :2] -= table[np.where(names[place] == key, place, len(names))]
    far = np.hypot(*table.T).max()
    say = reporter.warn if far > SAID_M else reporter.info
    say(f"The scans or flight lines do not fit together: {len(names)} were moved by up to {100 * far:.1f} cm.")
    return replace(cloud, xyz=xyz)
