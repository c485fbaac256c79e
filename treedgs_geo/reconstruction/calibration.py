"""What is known about the lens before any photo is matched."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.errors import ReconstructionError
from ..geotags.photos import Photo
from .cameras import Camera

#: Sensor widths in mm (maker's data sheets) and the nominal focal length that the entry holds for.
SENSOR_WIDTHS_MM = {
    "FC300S": (6.16, 3.61),
    "FC300X": (6.16, 3.61),
    "FC300C": (6.16, 3.61),
    "FC330": (6.17, 3.61),
    "FC220": (6.17, 4.73),
    "FC6310": (13.2, 8.8),
    "FC6310R": (13.2, 8.8),
    "FC6310S": (13.2, 8.8),
    "L1D-20c": (13.2, 10.26),
    "L2D-20c": (17.3, 12.29),
    "M3E": (17.3, 12.29),
    "M4E": (17.3, 12.29),
    "ZenmuseP1": (35.9, 35.0),
    "FC6520": (17.3, 15.0),
    "FC7203": (6.3, 4.49),
}


@dataclass(frozen=True)
class Calibration:
    """First guess of the intrinsics.

    source: dewarp (factory calibration in XMP), xmp (nominal), sensor (data sheet), exif35 (35 mm equivalent).
    tolerance: largest believable relative error of the focal length.
    """

    camera: Camera
    source: str
    tolerance: float

    @property
    def focal_px(self) -> float:
        """Mean focal length, pixels."""
        return 0.5 * (self.camera.fx + self.camera.fy)


def calibration_of(photos: list[Photo]) -> Calibration:
    """The most trustworthy calibration that the photos' metadata hold.

    Raises:
        ReconstructionError: no hint at the focal length at all.
    """
    photo = photos[0]
    width, height = photo.width, photo.height
    cx, cy = width / 2, height / 2
    dewarp = photo.dji.get("DewarpData", "").split(";")[-1].split(",")
    if len(dewarp) == 9 and photo.dji.get("DewarpFlag", "0").strip() != "1":
        try:
            fx, fy, dx, dy, k1, k2, p1, p2, _ = (float(value) for value in dewarp)
        except ValueError:
            fx = 0.0
        if 0.3 * width < fx < 20 * width:
            return Calibration(Camera(width, height, fx, fy, cx + dx, cy + dy, k1, k2, p1, p2), "dewarp", 0.03)
    focal = _number(photo.dji.get("CalibratedFocalLength"))
    if 0.3 * width < focal < 20 * width:
        return Calibration(Camera(width, height, focal, focal, cx, cy), "xmp", 0.04)
    sensor = SENSOR_WIDTHS_MM.get(photo.model)
    if sensor and abs(photo.focal_mm / sensor[1] - 1) < 0.05:
        focal = photo.focal_mm / sensor[0] * max(width, height)
        return Calibration(Camera(width, height, focal, focal, cx, cy), "sensor", 0.05)
    if photo.focal_35mm > 5:
        # The equivalent is defined by the diagonal of the whole sensor, which is 4:3 (or 3:2) where the photo is 16:9.
        long_side, short_side = max(width, height), min(width, height)
        diagonal = float(
            np.hypot(long_side, max(short_side, 0.75 * long_side if long_side / short_side > 1.6 else short_side))
        )
        focal = photo.focal_35mm / 43.267 * diagonal
        return Calibration(Camera(width, height, focal, focal, cx, cy), "exif35", 0.10)
    raise ReconstructionError(
        f"{photo.path}: neither EXIF nor XMP tells the focal length (no CalibratedFocalLength, "
        f"FocalLengthIn35mmFilm or known camera; "
        f"model {photo.model or 'unknown'!r}); use the photos as the drone wrote them."
    )


def _number(text: str | None) -> float:
    try:
        return float(text or "nan")
    except ValueError:
        return float("nan")
