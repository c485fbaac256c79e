"""Is the block true? A registered-photo count proves nothing; geotags, calibration and flying height do."""

from __future__ import annotations

from dataclasses import dataclass
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


@dataclass(frozen=True)
class _Geotags:
    """How far the cameras stand from their geotags.

    quality: the best kind of geotag that three photos have. chosen: (N,) bool, photos of that kind; rms: (3,) of them,
    m; median_m: their median distance; stated_m: the median of what they claim. away_m: (N,) distance, 0 elsewhere.
    """

    quality: str | None
    chosen: np.ndarray
    rms: np.ndarray
    median_m: float
    stated_m: float
    away_m: np.ndarray


@dataclass(frozen=True)
class _Ties:
    """How the photos hold together. track: photos a point is seen in (mean). per_photo: (registered,) points."""

    track: float
    per_photo: np.ndarray
    rms_px: float


def check_block(
    block: Block,
    stations: Stations,
    xyz: np.ndarray,
    calibration: Calibration,
    free: dict[str, bool],
    reporter: Reporter,
) -> dict[str, Any]:
    """The report of a block, with warnings.

    Args:
        xyz: (N, 3) local geotags. free: which parts of the camera were determined: ``focal``.

    Raises:
        ReconstructionError: too few photos, geotags contradicted, focal length or height that cannot be.
    """
    warnings: list[str] = []
    _check_registered(block, stations, warnings)
    geotags = _against_geotags(block, stations, xyz)
    _check_geotags(geotags, stations, warnings)
    focal = 0.5 * (block.camera.fx + block.camera.fy)
    _check_focal(focal, calibration, free["focal"], warnings)
    height_ratio = _height_ratio(block, stations)
    _check_height(height_ratio, warnings)
    ties = _ties(block, len(stations))
    _check_ties(ties, warnings)
    scale = _scale_of(block, stations, xyz, geotags)
    if scale > SCALE_WARN:
        warnings.append(
            f"The geotags fix the scale of the block, and so every diameter, to {scale:.1%} only (standard error); the "
            f"trees' intervals are widened by it: use RTK or PPK positions."
        )
    for warning in warnings:
        reporter.warn(warning)
    camera, posed = block.camera, block.is_posed
    report = {
        "photos": len(stations),
        "registered": int(posed.sum()),
        "left_out": _left_out(block, stations),
        "points": len(block.points),
        "track_length": round(ties.track, 2),
        "points_per_photo_median": float(np.median(ties.per_photo)),
        "points_per_photo_min": int(ties.per_photo.min()),
        "reprojection_rms_px": round(ties.rms_px, 3),
        "geotag_quality": stations.counts(),
        "geotag_residual_quality": geotags.quality,
        "geotag_rms_e_n_u_m": [round(float(v), 4) for v in geotags.rms],
        "geotag_median_m": round(geotags.median_m, 4),
        "geotag_stated_sd_m": round(float(geotags.stated_m), 4),
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
    e, n, u = geotags.rms * 100
    reporter.info(
        f"{report['registered']} of {len(stations)} photos registered, reprojection {ties.rms_px:.2f} px, "
        f"focal {focal:.0f} px (metadata {calibration.focal_px:.0f}), geotag residuals E/N/U "
        f"{e:.1f}/{n:.1f}/{u:.1f} cm ({geotags.quality})."
    )
    return report


def _left_out(block: Block, stations: Stations) -> list[str]:
    return [stations.names[i] for i in np.flatnonzero(~block.is_posed)]


def _check_registered(block: Block, stations: Stations, warnings: list[str]) -> None:
    count, registered = len(stations), int(block.is_posed.sum())
    if registered < 3 or registered < REGISTERED_REFUSE * count:
        raise ReconstructionError(
            f"{registered} of {count} photos could be registered, expected {REGISTERED_REFUSE:.0%} or more; the "
            f"photos overlap too little, are "
            "blurred, or the forest moved in the wind: fly with 80 % overlap, obliques and less wind."
        )
    if registered < REGISTERED_WARN * count:
        left_out = shorten(_left_out(block, stations))
        warnings.append(f"{registered} of {count} photos registered; left out: {left_out}.")


def _known(block: Block, xyz: np.ndarray) -> np.ndarray:
    """(N,) bool: registered photos with a geotag."""
    return block.is_posed & np.isfinite(block.centres - xyz).all(axis=1)


def _against_geotags(block: Block, stations: Stations, xyz: np.ndarray) -> _Geotags:
    residual, known = block.centres - xyz, _known(block, xyz)
    best = next(
        (
            q
            for q in ("fix", "float", "exif", "single")
            if sum(known[i] for i in range(len(stations)) if stations.quality[i] == q) >= 3
        ),
        None,
    )
    chosen = known & np.array([quality == best for quality in stations.quality])
    rms = np.sqrt(np.mean(residual[chosen] ** 2, axis=0)) if chosen.any() else np.full(3, np.nan)
    stated = np.median(np.linalg.norm(stations.sd[chosen], axis=1)) if chosen.any() else np.nan
    median = float(np.median(np.linalg.norm(residual[chosen], axis=1))) if chosen.any() else float("nan")
    away = np.where(chosen, np.linalg.norm(residual, axis=1), 0)
    return _Geotags(best, chosen, rms, median, float(stated), away)


def _check_geotags(geotags: _Geotags, stations: Stations, warnings: list[str]) -> None:
    median, stated, precise = geotags.median_m, geotags.stated_m, geotags.quality in ("fix", "float")
    if median > RESIDUAL_REFUSE_SD * stated + RESIDUAL_SLACK_M:
        raise ReconstructionError(
            f"The cameras are {median:.2f} m (median) from their geotags, which claim {stated:.2f} m; the block is "
            f"bent or the geotags are "
            "wrong: check datum, lever arm and that the geotags belong to these photos."
        )
    if precise and median > 2.5 * stated + 0.03:
        warnings.append(f"Cameras are {median * 100:.0f} cm (median) from geotags that claim {stated * 100:.0f} cm.")
    stray = np.flatnonzero((geotags.away_m > max(10 * stated, 0.5)) & precise)
    if len(stray):
        warnings.append(
            f"{len(stray)} photos stand up to {geotags.away_m.max():.1f} m from geotags that claim "
            f"{stated * 100:.0f} cm ({shorten([stations.names[i] for i in stray])}): they may be placed wrong, and "
            "stems seen in them too."
        )


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
            f"Nadir photos from one height do not determine the focal length; it was kept at {focal:.0f} px "
            f"({calibration.source})."
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


def _ties(block: Block, count: int) -> _Ties:
    error = np.linalg.norm(block.residuals(), axis=1)
    per_photo = np.bincount(block.image, minlength=count)[block.is_posed]
    return _Ties(len(block.point) / max(len(block.points), 1), per_photo, float(np.sqrt(np.mean(error**2))))


def _check_ties(ties: _Ties, warnings: list[str]) -> None:
    if ties.track < 3:
        warnings.append(
            f"Points are seen in {ties.track:.1f} photos on average (4 or more is healthy); overlap is low."
        )
    if ties.rms_px > 1.5:
        warnings.append(
            f"Reprojection error {ties.rms_px:.1f} px (below 1.2 is healthy); wind, rolling shutter or blur."
        )
    if np.median(ties.per_photo) < 100:
        warnings.append(f"Photos are tied by {np.median(ties.per_photo):.0f} points (median); 300 or more is healthy.")


def _scale_of(block: Block, stations: Stations, xyz: np.ndarray, geotags: _Geotags) -> float:
    """:func:`scale_error` by the geotags' own claim, or by what they were found to be off where that is more."""
    centres = np.where(_known(block, xyz)[:, None], block.centres, np.nan)
    return scale_error(centres, np.maximum(stations.sd, np.where(geotags.chosen[:, None], geotags.rms, 0.0)))


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
