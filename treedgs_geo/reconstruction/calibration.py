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

    source: dewarp (factory calibration in XMP), xmp (nominal), pix4d (XMP Camera, millimetres), sensor (data sheet),
    exif35 (35 mm equivalent), plane (FocalPlaneXResolution).
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
    longer = max(width, height)
    guesses = {"sensor": _from_sensor(photo), "exif35": _from_35mm(photo)}
    guesses["pix4d"] = _from_pix4d(photo, guesses["exif35"])
    guesses["plane"] = _from_plane(photo)
    for source, tolerance in _TOLERANCES.items():
        focal = guesses[source]
        if 0.1 * longer < focal < 20 * longer:
            return Calibration(Camera(width, height, focal, focal, cx, cy), source, tolerance)
    raise ReconstructionError(_unknown_focal(photo))


#: Largest believable relative error of what EXIF and XMP say in millimetres, the most trustworthy first.
_TOLERANCES = {"pix4d": 0.05, "sensor": 0.05, "exif35": 0.10, "plane": 0.07}
#: No drone's sensor is smaller or wider, millimetres.
_SENSOR_MM = (2.0, 60.0)


def _from_sensor(photo: Photo) -> float:
    sensor = SENSOR_WIDTHS_MM.get(photo.model)
    if sensor and abs(photo.focal_mm / sensor[1] - 1) < 0.05:
        return photo.focal_mm / sensor[0] * max(photo.width, photo.height)
    return float("nan")


def _from_35mm(photo: Photo) -> float:
    if not photo.focal_35mm > 5:
        return float("nan")
    # The equivalent is defined by the diagonal of the whole sensor, which is 4:3 (or 3:2) where the photo is 16:9.
    long_side, short_side = max(photo.width, photo.height), min(photo.width, photo.height)
    diagonal = float(
        np.hypot(long_side, max(short_side, 0.75 * long_side if long_side / short_side > 1.6 else short_side))
    )
    return photo.focal_35mm / 43.267 * diagonal


def _from_plane(photo: Photo) -> float:
    """FocalLength times FocalPlaneXResolution, in the first unit that gives a sensor that exists."""
    return next((photo.focal_mm * px_mm for px_mm in photo.plane_px_mm if _is_sensor(photo, px_mm)), float("nan"))


def _from_pix4d(photo: Photo, exif35_px: float) -> float:
    """Pix4D's PerspectiveFocalLength (mm) in pixels: by the focal plane's resolution, the data sheet, the 35 mm
    equivalent, or twice the principal point."""
    focal = _number(photo.pix4d.get("PerspectiveFocalLength"))
    if not focal > 0 or "fisheye" in photo.pix4d.get("ModelType", "").lower():
        return float("nan")
    longer = max(photo.width, photo.height)
    sensor = SENSOR_WIDTHS_MM.get(photo.model)
    middle = max((_number(part) for part in photo.pix4d.get("PrincipalPoint", "").split(",")), default=float("nan"))
    scales = [
        *photo.plane_px_mm,
        longer / sensor[0] if sensor else np.nan,
        exif35_px / photo.focal_mm,
        longer / (2 * middle) if middle > 0 else np.nan,
    ]
    for px_mm in scales:
        # What contradicts the 35 mm equivalent grossly was written in another unit.
        if _is_sensor(photo, px_mm) and not abs(focal * px_mm / exif35_px - 1) > 0.15:
            return focal * px_mm
    return float("nan")


def _is_sensor(photo: Photo, px_mm: float) -> bool:
    return bool(px_mm > 0 and _SENSOR_MM[0] < max(photo.width, photo.height) / px_mm < _SENSOR_MM[1])


def _unknown_focal(photo: Photo) -> str:
    focal = photo.focal_mm if photo.focal_mm > 0 else _number(photo.pix4d.get("PerspectiveFocalLength"))
    if focal > 0:
        return (
            f"{photo.path}: says a focal length of {focal:g} mm and nothing about the sensor's size (no "
            f"FocalLengthIn35mmFilm or FocalPlaneXResolution; model {photo.model or 'unknown'!r} is not in the table); "
            "write the 35 mm equivalent into the photos, for example 'exiftool -FocalLengthIn35mmFormat=24 FOLDER'."
        )
    return (
        f"{photo.path}: neither EXIF nor XMP says the focal length (no CalibratedFocalLength, FocalLength or "
        f"FocalLengthIn35mmFilm; model {photo.model or 'unknown'!r}): an editor or messenger may have removed it; use "
        "the photos as the drone wrote them, or write it into them, for example 'exiftool "
        "-FocalLengthIn35mmFormat=24 FOLDER'."
    )


def _number(text: str | None) -> float:
    try:
        return float(text or "nan")
    except ValueError:
        return float("nan")
