"""What is known of a flight before its photos are looked at: frame, geotags, gimbals, lens, shutter, ground."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..core.crs import LocalFrame, grid_convergence_deg
from ..geotags.control import ControlPoints
from ..geotags.photos import read_photo
from ..geotags.readout import Readout, readout_of
from ..geotags.stations import Stations
from .adjustment import Known
from .calibration import Calibration, calibration_of
from .cameras import OBLIQUE_DEG, Sensor
from .geotag_errors import LATE_SD_S
from .pairs import ground_below
from .poses import rotation_from_gimbal
from .rolling_shutter import free_shutter, lens_sd, sensor_of

#: Parts of the lens that are adjusted where the photos tell the focal length.
WHOLE_LENS = frozenset({"focal", "aspect", "principal_point", "radial", "tangential", "drift"})
#: Share of the photos that must have geotag and gimbal angles for those to say where features are looked for.
GUIDED_SHARE = 0.9


@dataclass(frozen=True)
class Survey:
    """What is known before a photo is looked at, in the local frame. ground: its height, NaN unknown. height: of the
    cameras above it, metres. free: parts of lens and shutter that are adjusted."""

    frame: LocalFrame
    calibration: Calibration
    rotations: np.ndarray
    ground: float
    height: float
    known: Known
    sensor: Sensor
    free: frozenset[str]
    readout: Readout

    @property
    def can_guide(self) -> bool:
        """Whether geotags and gimbals say where to look for a feature of one photo in another."""
        return can_guide(self.known.xyz, self.rotations, self.ground)


def survey_of(stations: Stations, control: ControlPoints | None, calibration_file: Path | None) -> Survey:
    """The survey of camera stations, with control points and an earlier calibration file where there are any."""
    calibration = calibration_of([read_photo(stations.paths[0])], calibration_file)
    bars = None if control is None else control.bars
    control = control if control is not None and len(control) else None
    places = stations.xyz[stations.is_placed]
    frame = LocalFrame.around(stations.crs, places if len(places) or control is None else control.xyz)
    ground = ground_below(stations.xyz, stations.relative_altitude_m)
    if np.isfinite(ground):
        frame = replace(frame, origin=np.array([*frame.origin[:2], np.round(ground)]))
        ground -= frame.origin[2]
    xyz = frame.to_local(stations.xyz)
    rotations = gimbal_rotations(stations)
    free = _free_lens(rotations, xyz, stations, control)
    readout = _readout(stations, calibration)
    known = Known(
        xyz,
        stations.sd,
        calibration.camera,
        lens_sd(calibration),
        control=None if control is None else replace(control, xyz=frame.to_local(control.xyz)),
        bars=bars,
        gimbal=rotations,
        taken_s=stations.utc,
    )
    if known.is_precise:
        flights = len(np.unique(stations.flight))
        known = replace(known, late_s=np.zeros(flights), late_sd_s=np.full(flights, LATE_SD_S))
    height = float(np.nanmedian(xyz[:, 2]) - ground) if np.isfinite(ground) else 80.0
    known, sensor, shutter = free_shutter(known, sensor_of(stations, calibration.camera), stations, readout, height)
    return Survey(frame, calibration, rotations, ground, height, known, sensor, free | shutter, readout)


def gimbal_rotations(stations: Stations) -> np.ndarray:
    """(N, 3, 3) world -> camera from the gimbal angles, NaN where they are unknown. Where no photo has a position the
    meridian convergence is left out: a compass errs as much."""
    import pyproj

    rotations = np.full((len(stations), 3, 3), np.nan)
    placed = stations.xyz[stations.is_placed]
    to_degrees = pyproj.Transformer.from_crs(
        stations.crs, pyproj.CRS(stations.crs.geodetic_crs).to_2d(), always_xy=True
    )
    convergence = 0.0
    if len(placed):
        convergence = grid_convergence_deg(stations.crs, *to_degrees.transform(*placed[:, :2].mean(axis=0)))
    for i in range(len(stations)):
        angles = stations.yaw_deg[i] - convergence, stations.pitch_deg[i], stations.roll_deg[i]
        if np.isfinite(angles).all():
            rotations[i] = rotation_from_gimbal(*angles)
    return rotations


def _free_lens(
    rotations: np.ndarray, xyz: np.ndarray, stations: Stations, control: ControlPoints | None
) -> frozenset[str]:
    """Which intrinsics the flight can determine (:data:`.bundle.PARTS`).

    Nadir photos from one height cannot tell focal length from height (a 19 % error hid in 1 % of reprojection error,
    ``docs/analyst/reconstruction.md``); obliques can, and with precise geotags two heights or control points. Photos
    that say nothing of how they were taken get their say, and the lens's prior holds what they do not tell.
    """
    if not (np.isfinite(rotations).any() or stations.is_placed.any()):
        return WHOLE_LENS
    precise = np.nanmedian(stations.sd, axis=0).max() < 0.5 if stations.is_placed.any() else False
    heights = np.nanpercentile(xyz[:, 2], [5, 95]) if stations.is_placed.any() else np.zeros(2)
    two_heights = (
        bool(heights[1] - heights[0] > 0.15 * max(np.nanmedian(stations.relative_altitude_m), 20))
        if np.isfinite(stations.relative_altitude_m).any()
        else False
    )
    surveyed = control is not None and int((~control.is_check).sum()) >= 3 and precise
    enough = tell_focal(rotations) or (precise and two_heights) or surveyed
    return WHOLE_LENS if enough else frozenset({"radial", "tangential"})


def tell_focal(rotations: np.ndarray) -> bool:
    """Whether enough of the photos, (N, 3, 3) world -> camera, NaN unknown, look obliquely to tell the focal length."""
    with np.errstate(invalid="ignore"):
        return bool((np.degrees(np.arccos(np.clip(-rotations[:, 2, 2], -1, 1))) > OBLIQUE_DEG).sum() >= 8)


def _readout(stations: Stations, calibration: Calibration) -> Readout:
    """Readout time by the camera's own calibration file, or by metadata and tables."""
    if np.isfinite(calibration.readout_s) and calibration.readout_sd_s > 0:
        return Readout(calibration.readout_s, calibration.readout_sd_s, "calibration file")
    return readout_of([read_photo(path) for path in stations.paths[:: max(len(stations) // 5, 1)]])


def can_guide(xyz: np.ndarray, rotations: np.ndarray, ground: float) -> bool:
    """Whether geotags and gimbals say where to look for a feature of one photo in another.

    xyz: (N, 3) geotags, metres. rotations: (N, 3, 3) of the gimbals. ground: height, metres. NaN is unknown.
    """
    known = np.isfinite(rotations).all(axis=(1, 2)) & np.isfinite(xyz).all(axis=1)
    return bool(known.mean() >= GUIDED_SHARE and np.isfinite(ground))
