"""Is the block true? A registered-photo count proves nothing; geotags, calibration and flying height do."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.errors import ReconstructionError
from ..core.progress import Reporter
from ..geotags.photos import shorten
from ..geotags.stations import Stations
from .calibration import Calibration
from .tracks import Block

#: Refused below this share of registered photos; warned below the second.
REGISTERED_REFUSE, REGISTERED_WARN = 0.60, 0.95
#: Refused when the median distance to the geotags exceeds this many stated standard deviations (plus the slack in
#: metres).
RESIDUAL_REFUSE_SD, RESIDUAL_SLACK_M = 5.0, 0.10
#: Height above ground over the flying height that the drone reports: refused outside, warned outside the second.
HEIGHT_REFUSE, HEIGHT_WARN = 0.30, 0.08
#: Warned when the standard error of the block's scale exceeds this (1.5 mm in 30 cm).
SCALE_WARN = 0.005


def check_block(
    block: Block,
    stations: Stations,
    xyz: np.ndarray,
    calibration: Calibration,
    ground_z: float,
    free: dict[str, bool],
    reporter: Reporter,
) -> dict[str, Any]:
    """The report of a block, with warnings.

    Args:
        xyz: (N, 3) local geotags. ground_z: local take-off height, NaN unknown.

    Raises:
        ReconstructionError: too few photos, geotags contradicted, focal length or height that cannot be.
    """
    count, posed = len(stations), block.is_posed
    warnings: list[str] = []
    registered = int(posed.sum())
    left_out = [stations.names[i] for i in np.flatnonzero(~posed)]
    if registered < 3 or registered < REGISTERED_REFUSE * count:
        raise ReconstructionError(
            f"{registered} of {count} photos could be registered, expected {REGISTERED_REFUSE:.0%} or more; the "
            f"photos overlap too little, are "
            "blurred, or the forest moved in the wind: fly with 80 % overlap, obliques and less wind."
        )
    if registered < REGISTERED_WARN * count:
        warnings.append(f"{registered} of {count} photos registered; left out: {shorten(left_out)}.")
    residual = block.centres - xyz
    known = posed & np.isfinite(residual).all(axis=1)
    best = next(
        (
            q
            for q in ("fix", "float", "exif", "single")
            if sum(known[i] for i in range(count) if stations.quality[i] == q) >= 3
        ),
        None,
    )
    chosen = known & np.array([quality == best for quality in stations.quality])
    rms = np.sqrt(np.mean(residual[chosen] ** 2, axis=0)) if chosen.any() else np.full(3, np.nan)
    stated = np.median(np.linalg.norm(stations.sd[chosen], axis=1)) if chosen.any() else np.nan
    median = float(np.median(np.linalg.norm(residual[chosen], axis=1))) if chosen.any() else float("nan")
    if median > RESIDUAL_REFUSE_SD * stated + RESIDUAL_SLACK_M:
        raise ReconstructionError(
            f"The cameras are {median:.2f} m (median) from their geotags, which claim {stated:.2f} m; the block is "
            f"bent or the geotags are "
            "wrong: check datum, lever arm and that the geotags belong to these photos."
        )
    if best in ("fix", "float") and median > 2.5 * stated + 0.03:
        warnings.append(f"Cameras are {median * 100:.0f} cm (median) from geotags that claim {stated * 100:.0f} cm.")
    away = np.where(chosen, np.linalg.norm(residual, axis=1), 0)
    stray = np.flatnonzero((away > max(10 * stated, 0.5)) & (best in ("fix", "float")))
    if len(stray):
        warnings.append(
            f"{len(stray)} photos stand up to {away.max():.1f} m from geotags that claim {stated * 100:.0f} cm "
            f"({shorten([stations.names[i] for i in stray])}): they may be placed wrong, and stems seen in them too."
        )
    focal = 0.5 * (block.camera.fx + block.camera.fy)
    ratio = focal / calibration.focal_px
    if abs(ratio - 1) > calibration.tolerance:
        raise ReconstructionError(
            f"The focal length came out as {focal:.0f} px, {abs(ratio - 1):.1%} from the {calibration.focal_px:.0f} "
            f"px of the photos' "
            f"metadata ({calibration.source}); such a block has wrong diameters: add oblique photos or check that "
            f"the photos are not cropped."
        )
    if abs(ratio - 1) > calibration.tolerance / 3 and free["focal"]:
        warnings.append(
            f"Focal length {focal:.0f} px is {abs(ratio - 1):.1%} from the metadata's {calibration.focal_px:.0f} px."
        )
    if not free["focal"]:
        warnings.append(
            f"Nadir photos from one height do not determine the focal length; it was kept at {focal:.0f} px "
            f"({calibration.source})."
        )
    height_ratio = _height_ratio(block, stations)
    if np.isfinite(height_ratio) and abs(height_ratio - 1) > HEIGHT_REFUSE:
        raise ReconstructionError(
            f"The cameras are {height_ratio:.0%} of the flying height (XMP RelativeAltitude) above the ground "
            f"points; the scale is wrong or the "
            "drone took off far above or below the plot: check the geotags' heights."
        )
    if np.isfinite(height_ratio) and abs(height_ratio - 1) > HEIGHT_WARN:
        warnings.append(
            f"The cameras are {height_ratio:.0%} of the reported flying height above the ground points (slope, or "
            f"scale)."
        )
    error = np.linalg.norm(block.residuals(), axis=1)
    per_photo = np.bincount(block.image, minlength=count)[posed]
    track = len(block.point) / max(len(block.points), 1)
    rms_px = float(np.sqrt(np.mean(error**2)))
    if track < 3:
        warnings.append(f"Points are seen in {track:.1f} photos on average (4 or more is healthy); overlap is low.")
    if rms_px > 1.5:
        warnings.append(f"Reprojection error {rms_px:.1f} px (below 1.2 is healthy); wind, rolling shutter or blur.")
    if np.median(per_photo) < 100:
        warnings.append(f"Photos are tied by {np.median(per_photo):.0f} points (median); 300 or more is healthy.")
    # The geotags' own claim, or what they were found to be off where that is more.
    scale = scale_error(
        np.where(known[:, None], block.centres, np.nan), np.maximum(stations.sd, np.where(chosen[:, None], rms, 0.0))
    )
    if scale > SCALE_WARN:
        warnings.append(
            f"The geotags fix the scale of the block, and so every diameter, to {scale:.1%} only (standard error); the "
            f"trees' intervals are widened by it: use RTK or PPK positions."
        )
    for warning in warnings:
        reporter.warn(warning)
    camera = block.camera
    report = {
        "photos": count,
        "registered": registered,
        "left_out": left_out,
        "points": len(block.points),
        "track_length": round(track, 2),
        "points_per_photo_median": float(np.median(per_photo)),
        "points_per_photo_min": int(per_photo.min()),
        "reprojection_rms_px": round(rms_px, 3),
        "geotag_quality": stations.counts(),
        "geotag_residual_quality": best,
        "geotag_rms_e_n_u_m": [round(float(v), 4) for v in rms],
        "geotag_median_m": round(median, 4),
        "geotag_stated_sd_m": round(float(stated), 4),
        "focal_px": round(focal, 2),
        "focal_metadata_px": round(calibration.focal_px, 2),
        "focal_source": calibration.source,
        "focal_free": free["focal"],
        "principal_point_px": [round(camera.cx, 2), round(camera.cy, 2)],
        "scale_sd": round(scale, 6) if np.isfinite(scale) else None,
        "height_over_relative_altitude": round(height_ratio, 4) if np.isfinite(height_ratio) else None,
        "flights_registered": {str(f): int((posed & (stations.flight == f)).sum()) for f in np.unique(stations.flight)},
        "warnings": warnings,
    }
    e, n, u = rms * 100
    reporter.info(
        f"{registered} of {count} photos registered, reprojection {rms_px:.2f} px, focal {focal:.0f} px "
        f"(metadata {calibration.focal_px:.0f}), geotag residuals E/N/U {e:.1f}/{n:.1f}/{u:.1f} cm ({best})."
    )
    return report


def scale_error(centres: np.ndarray, sd: np.ndarray) -> float:
    """Relative standard error of the scale of a block that geotags alone fix, and so of every length in it.

    centres: (N, 3) projection centres, m. sd: (N, 3) standard errors of their geotags, m. Least squares of one factor
    about the mean position, geotags independent of each other: sqrt(1 / sum(d^2 / sd^2)). An error that all of them
    share moves the block and does not scale it. NaN without two geotags.
    """
    known = np.isfinite(centres).all(axis=1) & np.isfinite(sd).all(axis=1)
    if known.sum() < 2:
        return float("nan")
    weight = 1 / np.maximum(sd[known], 1e-3) ** 2
    middle = (weight * centres[known]).sum(axis=0) / weight.sum(axis=0)
    return float(1 / np.sqrt((weight * (centres[known] - middle) ** 2).sum()))


def _height_ratio(block: Block, stations: Stations) -> float:
    """Camera height above the low points over RelativeAltitude (median of photos); NaN where that is unknown."""
    relative = stations.relative_altitude_m
    usable = block.is_posed & np.isfinite(relative) & (relative > 10)
    if usable.sum() < 3 or len(block.points) < 50:
        return float("nan")
    ground = np.percentile(block.points[:, 2], 20)
    return float(np.median((block.centres[usable, 2] - ground) / relative[usable]))
