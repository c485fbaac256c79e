"""Scans or flight lines of a cloud that lie beside one another: moved together by what their stems agree on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ....core.progress import Reporter
from ....pointcloud.cloud import PointCloud
from ...quality.priors import BREAST_HEIGHT_M
from ..propose.nearby import Nearby
from ..propose.segment import StemMap
from ..propose.sensors import SENSORS
from .passes import REACH_M, Passes, PassFit, common_shifts, fit_passes
from .track import SensorTrack

#: Points of the stem band that are looked at, at most.
MAX_POINTS = 3_000_000
#: Shifts beyond this are a warning, m: flight lines always lie a centimetre or two apart.
SAID_M = 0.02


def fitted_together(
    cloud: PointCloud, tree_id: np.ndarray, height: np.ndarray, stems: StemMap, reporter: Reporter
) -> PointCloud | None:
    """The cloud, its scans moved onto one another; ``None`` where they fit, where nothing tells them apart, or where
    the stems do not agree. tree_id, height: (N,) of the points."""
    owned = np.flatnonzero(tree_id > 0)
    order = owned[np.argsort(tree_id[owned], kind="stable")]
    groups = np.split(order, np.flatnonzero(np.diff(tree_id[order])) + 1) if len(order) else []
    passes = Passes(cloud.attributes, len(cloud), groups)
    if not groups or not np.ptp(passes.keys(order)):
        return None
    with np.errstate(invalid="ignore"):
        band = np.flatnonzero((height > 0.3) & (height < 4.5))
    band = band[:: max(len(band) // MAX_POINTS, 1)]
    around = Nearby(np.column_stack([cloud.xyz[band, :2] - stems.origin, height[band]]))
    sensor = SENSORS[stems.sensor]
    track = SensorTrack.of(cloud.xyz, cloud.attributes) if sensor.calibrated else None
    fits: list[PassFit] = []
    for stem in stems.stems:
        if stem.refused:
            continue
        near = around.within(
            stem.cone.centre(BREAST_HEIGHT_M), float(stem.cone.radius(BREAST_HEIGHT_M)) + 2 * REACH_M + 0.1
        )
        label = passes.of(band[near])
        if label.any():
            key, towards = passes.keys(band[near]), None if track is None else track.towards(band[near])
            fits.append(
                fit_passes(around.points[near], label, key, stem.cone, BREAST_HEIGHT_M, sensor.floor_m, towards)
            )
    shifts = common_shifts(fits)
    if not shifts:
        return None
    names = np.array(sorted(shifts))
    table = np.vstack([[shifts[name] for name in names], np.zeros(2)])
    key = passes.keys(np.arange(len(cloud)))
    place = np.minimum(np.searchsorted(names, key), len(names) - 1)
    place = np.where(names[place] == key, place, len(names))
    xyz = cloud.xyz.copy()
    xyz[:, :2] -= table[place]
    far = np.hypot(*table.T).max()
    say = reporter.warn if far > SAID_M else reporter.info
    say(f"The scans or flight lines do not fit together: {len(names)} were moved by up to {100 * far:.1f} cm.")
    return replace(cloud, xyz=xyz)
