"""Is the block true? A registered-photo count proves nothing; geotags, calibration and flying height do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.errors import ReconstructionError
from ..core.progress import Reporter
from ..core.shown import shorten
from ..geotags.control import ControlPoints, are_spread
from ..geotags.readout import Readout
from ..geotags.stations import Stations
from .bundle_kernels import CX, CY, READOUT
from .calibration import Calibration, lens_sd_of
from .control import bar_lengths, control_residuals, rms_of
from .covariance import posterior_of
from .geotag_errors import usual_speed_m_s
from .incremental_block import Joined, groups_of
from .options import CONFIRMED_SHARE
from .tracks import Block

#: Refused below this share of registered photos; warned below the second.
REGISTERED_REFUSE, REGISTERED_WARN = 0.50, 0.95
#: Refused when the median distance to the geotags exceeds this many stated standard deviations (plus the slack in
#: metres).
RESIDUAL_REFUSE_SD, RESIDUAL_SLACK_M = 5.0, 0.10
#: Refused when the block lies further from a control or check point than this many of its standard deviations.
CONTROL_REFUSE_SD = 6.0
#: Refused when control points that alone hold a block are less sure than this share of the distance across them.
CONTROL_REFUSE_SHARE = 0.1
#: Height above ground over the flying height that the drone reports: refused outside, warned outside the second.
HEIGHT_REFUSE, HEIGHT_WARN = 0.30, 0.08
#: Warned when a flight's geotags lie so far from its exposures along the flight, metres.
LATE_WARN_M = 0.03
#: Warned when the standard error of the block's scale exceeds this (1.5 mm in 30 cm).
SCALE_WARN = 0.005


@dataclass(frozen=True)
class _Geotags:
    """How far the cameras stand from their geotags.

    quality: the best kind of geotag that three photos have. rms: (3,) of the photos of that kind,
    m; median_m: their median distance; stated_m: the median of what they claim.
    """

    quality: str | None
    rms: np.ndarray
    median_m: float
    stated_m: float

    @property
    def factor(self) -> float:
        """How many times worse the geotags are than they state, by what the photos left of them; at least 1.

        By the median, which a photo that is placed wrong does not move: of a normal error in three axes it is 0.89 of
        the root of the summed variances.
        """
        found = self.median_m / (0.89 * self.stated_m) if self.stated_m > 0 else 1.0
        return max(found, 1.0) if np.isfinite(found) else 1.0


def check_block(
    joined: Joined, stations: Stations, calibration: Calibration, readout: Readout, reporter: Reporter
) -> dict[str, Any]:
    """The report of a block, with warnings.

    Args:
        readout: what was known of the readout time.

    Raises:
        ReconstructionError: too few photos, geotags or control points contradicted, focal length or height that cannot
            be.
    """
    block, xyz, warnings = joined.block, joined.known.xyz, list[str]()
    left_out = [stations.names[i] for i in np.flatnonzero(~block.is_posed)]
    _check_registered(block, stations, left_out, warnings)
    groups = groups_of(block)
    _note_groups(groups, block, stations, warnings)
    geotags = _against_geotags(block, stations, xyz)
    _check_geotags(geotags, warnings)
    focal = 0.5 * (block.camera.fx + block.camera.fy)
    _check_focal(focal, calibration, "focal" in joined.free, warnings)
    height_ratio = _height_ratio(block, stations)
    _check_height(height_ratio, warnings)
    per_photo = np.bincount(block.image, minlength=len(stations))[block.is_posed]
    track = len(block.point) / max(len(block.points), 1)
    rms_px = float(np.sqrt(np.mean(np.sum(block.residuals() ** 2, axis=1))))
    _check_ties(track, per_photo, rms_px, warnings)
    confirmed = int(joined.confirmed.sum())
    if confirmed < CONFIRMED_SHARE * block.is_posed.sum():
        warnings.append(
            f"Only {confirmed} of {block.is_posed.sum()} placed photos show the points of the others where these must "
            "be: their poses are not sure, and every tree is marked for checking (weak_block); fly with more overlap, "
            "in less wind, or with RTK or PPK."
        )
    posterior = posterior_of(joined.adjusted, geotags.factor)
    late_s = joined.known.late_s + posterior.late_s
    late_sd_s = np.where(joined.known.late_sd_s > 0, posterior.late_sd_s, np.nan)
    _note_late(late_s, late_sd_s, usual_speed_m_s(block.sensor), warnings)
    contradicted = _note_contradicted(joined, stations, warnings)
    sure_px = posterior.poses_px[np.isfinite(posterior.poses_px)]
    # Where all flights have one focal length, half of what may lie between them.
    several = len(block.sensor.drift) > 1 and "focal" in joined.free and "drift" not in joined.free
    scale = float(np.hypot(posterior.scale, 0.5 * joined.known.drift_sd if several else 0.0))
    control = _check_control(joined, warnings)
    if joined.known.bars is not None:
        scale, control["bars"] = _check_bars(joined, scale, warnings)
    if readout.is_known and readout.seconds > 0 and not joined.tested_shutter and not block.sensor.readout_s:
        warnings.append(
            f"The rolling shutter ({1000 * readout.seconds:.0f} ms, {readout.source}) is not taken into account: "
            "neither the drone's speed nor precise geotags say how the camera moved; hover for the photos, or use RTK "
            "or PPK."
        )
    if scale > SCALE_WARN:
        warnings.append(
            f"{'Geotags' if geotags.quality else 'Control points'} and photos fix the scale of the block, and so every "
            f"diameter, to {scale:.1%} only (standard error); "
            "the trees' intervals are widened by it: use RTK or PPK positions, control points or known lengths (--gcp)."
        )
    reporter.tell(warnings)
    camera, posed = block.camera, block.is_posed
    report = {
        "photos": len(stations),
        "registered": int(posed.sum()),
        "left_out": left_out,
        "confirmed": confirmed,
        "placed_by_ground": joined.placed_by_ground,
        "left_out_by_ground": joined.left_out_by_ground,
        "groups": [len(group) for group in groups],
        "points": len(block.points),
        "track_length": round(track, 2),
        "points_per_photo_median": float(np.median(per_photo)),
        "points_per_photo_min": int(per_photo.min()),
        "reprojection_rms_px": round(rms_px, 3),
        "geotag_quality": stations.counts(),
        "geotag_residual_quality": geotags.quality,
        "geotag_rms_e_n_u_m": [round(float(v), 4) for v in geotags.rms] if geotags.quality else None,
        "geotag_median_m": _rounded(geotags.median_m, 4),
        "geotag_stated_sd_m": _rounded(geotags.stated_m, 4),
        "geotag_late_s": [round(float(value), 4) for value in late_s],
        "geotag_late_sd_s": [_rounded(float(value), 4) for value in late_sd_s],
        "geotag_contradicted": contradicted,
        "focal_px": round(focal, 2),
        "focal_metadata_px": round(calibration.focal_px, 2),
        "focal_source": calibration.source,
        "focal_free": "focal" in joined.free,
        "focal_sd_px": _rounded(posterior.focal * focal, 2),
        "focal_drift": [round(float(value), 6) for value in np.expm1(block.sensor.drift)],
        "lens_free": sorted(joined.free),
        "lens_sd": lens_sd_of(posterior.shared_sd),
        "principal_point_px": [round(camera.cx, 2), round(camera.cy, 2)],
        "principal_point_sd_px": [_rounded(float(value), 2) for value in posterior.shared_sd[[CX, CY]]],
        "distortion_k1_k2_p1_p2_k3": [round(float(value), 6) for value in camera.distortion],
        "readout_s": round(block.sensor.readout_s, 5),
        "readout_sd_s": _rounded(float(posterior.shared_sd[READOUT]), 5),
        "readout_source": _readout_source(joined, readout),
        "poses_px_median": _rounded(np.median(sure_px) if len(sure_px) else np.nan, 3),
        "poses_px_worst": _rounded(sure_px.max(initial=-np.inf), 3),
        **control,
        "scale_sd": _rounded(scale, 6),
        "height_over_relative_altitude": _rounded(height_ratio, 4),
        "flights_registered": {str(f): int((posed & (stations.flight == f)).sum()) for f in np.unique(stations.flight)},
        "warnings": warnings,
    }
    left = [(f"geotags ({geotags.quality})", report["geotag_rms_e_n_u_m"])]
    left += [(f"{kind} points", control.get(f"{kind}_rms_e_n_u_m")) for kind in ("control", "check")]
    residuals = "".join(f", {of} {'/'.join(f'{100 * v:.1f}' for v in rms)} cm E/N/U" for of, rms in left if rms)
    reporter.info(
        f"{report['registered']} of {len(stations)} photos registered, reprojection {rms_px:.2f} px, "
        f"focal {focal:.0f} px (metadata {calibration.focal_px:.0f}){residuals}."
    )
    return report


def _check_registered(block: Block, stations: Stations, left_out: list[str], warnings: list[str]) -> None:
    # Photos without a geotag beside others were named when they were read: they may be of another flight.
    counted = stations.is_placed if stations.is_placed.any() else np.ones(len(stations), bool)
    count, registered = int(counted.sum()), int((block.is_posed & counted).sum())
    if registered < 3 or registered < REGISTERED_REFUSE * count:
        raise ReconstructionError(
            f"{registered} of {count} photos could be registered, expected {REGISTERED_REFUSE:.0%} or more; the "
            f"photos overlap too little, are "
            "blurred, or the forest moved in the wind: fly with 80 % overlap, obliques and less wind."
        )
    count, registered = len(stations), len(stations) - len(left_out)
    if registered < REGISTERED_WARN * count:
        warnings.append(f"{registered} of {count} photos registered; left out: {shorten(left_out)}.")


def _note_groups(groups: list[np.ndarray], block: Block, stations: Stations, warnings: list[str]) -> None:
    if len(groups) < 2:
        return
    middles = np.array([block.centres[group].mean(axis=0) for group in groups])
    apart_m = np.linalg.norm(middles - middles[0], axis=1).max()
    told = [f"{len(group)} ({shorten([stations.names[i] for i in group], 2)})" for group in groups]
    warnings.append(
        f"The photos form {len(groups)} groups that share no points: {', '.join(told[:3])}"
        f"{' and more' if len(told) > 3 else ''}, up to {apart_m:.0f} m apart."
    )
    warnings.append(
        "Each group is held by its own geotags alone, so what lies between them is not sure: measure them as "
        "jobs of their own, or add photos that overlap both."
    )


def _against_geotags(block: Block, stations: Stations, xyz: np.ndarray) -> _Geotags:
    residual, quality = block.centres - xyz, np.array(stations.quality)
    known = block.is_posed & np.isfinite(residual).all(axis=1)
    best = next((q for q in ("fix", "float", "exif", "single") if (known & (quality == q)).sum() >= 3), None)
    if best is None:
        return _Geotags(None, np.full(3, np.nan), np.nan, np.nan)
    off, sd = residual[known & (quality == best)], stations.sd[known & (quality == best)]
    median, stated = (float(np.median(np.linalg.norm(each, axis=1))) for each in (off, sd))
    return _Geotags(best, np.sqrt(np.mean(off**2, axis=0)), median, stated)


def _check_geotags(geotags: _Geotags, warnings: list[str]) -> None:
    median, stated, precise = geotags.median_m, geotags.stated_m, geotags.quality in ("fix", "float")
    if median > RESIDUAL_REFUSE_SD * stated + RESIDUAL_SLACK_M:
        raise ReconstructionError(
            f"The cameras are {median:.2f} m (median) from their geotags, which claim {stated:.2f} m; the block is "
            f"bent or the geotags are "
            "wrong: check datum, lever arm and that the geotags belong to these photos."
        )
    if precise and median > 2.5 * stated + 0.03:
        warnings.append(f"Cameras are {median * 100:.0f} cm (median) from geotags that claim {stated * 100:.0f} cm.")


def _note_late(late_s: np.ndarray, late_sd_s: np.ndarray, speed_m_s: np.ndarray, warnings: list[str]) -> None:
    """Say by how much the geotags of each flight, (F,), were taken before or after its photos; NaN: its own
    photos do not tell it."""
    along_m = np.abs(late_s) * speed_m_s
    for flight in np.flatnonzero(along_m > LATE_WARN_M):
        sure = (
            f"standard error {1000 * late_sd_s[flight]:.0f} ms" if np.isfinite(late_sd_s[flight]) else "as the others"
        )
        warnings.append(
            f"The geotags of flight {flight} belong to places {1000 * abs(late_s[flight]):.0f} ms "
            f"{'before' if late_s[flight] > 0 else 'after'} its photos ({sure}), "
            f"{along_m[flight]:.2f} m along the flight: lines flown in several "
            "directions show it, and the block was corrected; look at the times of the PPK solution, or give the "
            "camera's delay (--camera-delay-ms)."
        )


def _note_contradicted(joined: Joined, stations: Stations, warnings: list[str]) -> list[str]:
    """Say which geotags count less than they state; their photos' names."""
    known = joined.known
    off = np.linalg.norm(joined.adjusted.off_geotags_m, axis=1)
    rows = np.flatnonzero(joined.block.is_posed & known.contradicted)
    names = [stations.names[i] for i in rows]
    if names:
        stated = np.median(np.linalg.norm(stations.sd[rows], axis=1))
        warnings.append(
            f"{len(rows)} photos stand {off[rows].min():.2f} to {off[rows].max():.2f} m from geotags that claim "
            f"{100 * stated:.0f} cm ({shorten(names)}): the other photos and their geotags contradict these, which "
            "count less; they may be float solutions that are labelled fixed: process the PPK again."
        )
    return names


def _check_focal(focal: float, calibration: Calibration, free: bool, warnings: list[str]) -> None:
    ratio = focal / calibration.focal_px
    if abs(ratio - 1) > calibration.tolerance:
        raise ReconstructionError(
            f"The focal length came out as {focal:.0f} px, {abs(ratio - 1):.1%} from the {calibration.focal_px:.0f} "
            f"px of the photos' "
            f"metadata ({calibration.source}); such a block has wrong diameters: add oblique photos or check that "
            f"the photos are not cropped."
        )
    if abs(ratio - 1) > calibration.tolerance / 3 and free:
        warnings.append(
            f"Focal length {focal:.0f} px is {abs(ratio - 1):.1%} from the metadata's {calibration.focal_px:.0f} px."
        )
    if not free:
        warnings.append(
            "The photos do not determine the focal length (nadir photos from one height, or angles that are not "
            f"known); it was kept at {focal:.0f} px ({calibration.source})."
        )


def _check_height(ratio: float, warnings: list[str]) -> None:
    if np.isfinite(ratio) and abs(ratio - 1) > HEIGHT_REFUSE:
        raise ReconstructionError(
            f"The cameras are {ratio:.0%} of the flying height (XMP RelativeAltitude) above the ground "
            f"points; the scale is wrong or the "
            "drone took off far above or below the plot: check the geotags' heights."
        )
    if np.isfinite(ratio) and abs(ratio - 1) > HEIGHT_WARN:
        warnings.append(
            f"The cameras are {ratio:.0%} of the reported flying height above the ground points (slope, or scale)."
        )


def _check_ties(track: float, per_photo: np.ndarray, rms_px: float, warnings: list[str]) -> None:
    """track: photos that a point is seen in (mean). per_photo: points of each registered photo."""
    if track < 3:
        warnings.append(f"Points are seen in {track:.1f} photos on average (4 or more is healthy); overlap is low.")
    if rms_px > 1.5:
        warnings.append(f"Reprojection error {rms_px:.1f} px (below 1.2 is healthy); wind, rolling shutter or blur.")
    if np.median(per_photo) < 100:
        warnings.append(f"Photos are tied by {np.median(per_photo):.0f} points (median); 300 or more is healthy.")


def _check_control(joined: Joined, warnings: list[str]) -> dict[str, Any]:
    """What is left at control and check points, for the report.

    Raises:
        ReconstructionError: control points contradict the block.
    """
    points = joined.known.control
    if points is None:
        return {}
    rows = control_residuals(joined.block, points)
    if joined.known.is_by_control:
        _check_alone(points, ~points.is_check & [("px" in row) for row in rows], warnings)
    found = {"control": rows, "control_rms_e_n_u_m": rms_of(rows, False), "check_rms_e_n_u_m": rms_of(rows, True)}
    for k, row in enumerate(rows):
        if "px" not in row:
            why = "its marks do not meet" if row["photos"] > 1 else "fewer than two of its photos were registered"
            warnings.append(f"Point {row['label']} is left out: {why}; look at its marks.")
            continue
        off, sd = np.array([row["e_m"], row["n_m"], row["u_m"]]), points.sd_m[k]
        if np.linalg.norm(off) > CONTROL_REFUSE_SD * np.linalg.norm(sd) + RESIDUAL_SLACK_M:
            kind = "check" if row["is_check"] else "control"
            raise ReconstructionError(
                f"The block is {np.linalg.norm(off):.2f} m from {kind} point {row['label']}, which claims "
                f"{np.linalg.norm(sd):.2f} m: check its coordinates, their datum and height, and its marks."
            )
        if np.linalg.norm(off) > 3 * np.linalg.norm(sd) + 0.02:
            warnings.append(f"The block is {100 * np.linalg.norm(off):.0f} cm from point {row['label']}.")
    return found


def _check_bars(joined: Joined, scale: float, warnings: list[str]) -> tuple[float, list[dict[str, Any]]]:
    """The standard error of the scale with known lengths, and what the block makes of them, for the report."""
    bars = joined.known.bars
    assert bars is not None
    lengths = bar_lengths(joined.block, bars)
    log, sd = lengths.scale
    if lengths.contradict(scale):
        warnings.append(
            f"The known lengths are {np.exp(log):.3f} times what they are in the block, whose geotags and control "
            f"points tell its scale to {scale:.1%}: they are not used, and every tree's interval is widened by the "
            "difference; check the lengths, the marks of their ends, and the geotags."
        )
        scale = abs(log)
    elif not np.isfinite(sd):
        warnings.append("No known length has two ends that two placed photos show: mark them in more photos.")
    else:
        scale = float((scale**-2 + sd**-2) ** -0.5)
    told = zip(bars.labels, bars.length_m, bars.length_m / lengths.times, lengths.sd, strict=True)
    return scale, [
        {"label": label, "length_m": float(length), "block_m": _rounded(found, 4), "sd": _rounded(own_sd, 5)}
        for label, length, found, own_sd in told
    ]


def _check_alone(points: ControlPoints, used: np.ndarray, warnings: list[str]) -> None:
    """Control points that alone hold a block. used: (K,) bool, those that two placed photos show.

    Raises:
        ReconstructionError: they do not hold it, or contradict each other.
    """
    if not are_spread(points.xyz[used]):
        raise ReconstructionError(
            f"{used.sum()} of {np.sum(~points.is_check)} control points lie in two or more of the placed photos, "
            "expected three or more, not in a line, as nothing else holds the block: mark points in more photos."
        )
    sd_m = float(np.linalg.norm(points.sd_m[used], axis=1).max())
    across_m = float(np.linalg.norm(np.ptp(points.xyz[used], axis=0)))
    if sd_m > CONTROL_REFUSE_SHARE * across_m:
        raise ReconstructionError(
            f"The control points contradict each other by {sd_m:.2f} m over {across_m:.0f} m, and nothing else holds "
            "the block: check their coordinates, their datum and height, and their marks."
        )
    if not points.is_check.any():
        warnings.append(
            "Control points alone hold the block and none checks it: mark a fourth or more, and name some as check "
            "points (kind check)."
        )


def _readout_source(joined: Joined, readout: Readout) -> str:
    """How the readout time in use was found."""
    if "readout" in joined.free:
        return f"estimated from the photos ({readout.source})"
    if "travel" in joined.free:
        return "each photo's own movement, estimated"
    if joined.block.sensor.readout_s:
        return readout.source
    return "none: the photos show no rolling shutter" if joined.tested_shutter else f"none ({readout.source})"


def _rounded(value: float, digits: int) -> float | None:
    return round(float(value), digits) if np.isfinite(value) else None


def _height_ratio(block: Block, stations: Stations) -> float:
    """Camera height above the low points over RelativeAltitude (median of photos); NaN where that is unknown."""
    relative = stations.relative_altitude_m
    usable = block.is_posed & np.isfinite(relative) & (relative > 10)
    if usable.sum() < 3 or len(block.points) < 50:
        return float("nan")
    ground = np.percentile(block.points[:, 2], 20)
    return float(np.median((block.centres[usable, 2] - ground) / relative[usable]))
