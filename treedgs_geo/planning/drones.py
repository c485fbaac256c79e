"""Cameras that flights are planned for: a documented table, or numbers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..core.errors import InputError, ReconstructionError
from ..core.files import read_json
from ..geotags.photos import read_photo
from ..reconstruction.calibration import calibration_of

#: Batteries are not flown below this share.
RESERVE = 0.3
#: Least and most of the numbers of a camera: width, height, focal length (pixels), trigger (s), rolling shutter (ms).
_LIMITS = ((200, 30000), (200, 30000), (100, 60000), (0.2, 30), (0, 200))
#: Photos of a camera of the table have its focal length but for this share: lenses differ so much.
SAME_FOCAL = 0.05


@dataclass(frozen=True)
class DroneCamera:
    """A camera on its drone. width_px, height_px: of a photo. focal_px: focal length. interval_s: fastest trigger.
    readout_ms: rolling shutter, first row to last (0: none). gimbal_deg: lowest and highest pitch. flight_min: rated
    minutes in the air. photo_mb: of a JPEG. wpml: drone, its sub-type, payload, its position as DJI's WPML numbers them
    (``None``: the drone takes no such file). source: where the figures are from."""

    key: str
    name: str
    width_px: int
    height_px: int
    focal_px: float
    interval_s: float
    readout_ms: float
    gimbal_deg: tuple[float, float]
    flight_min: float
    photo_mb: float
    wpml: tuple[int, int, int, int] | None
    source: str

    @property
    def usable_min(self) -> float:
        """Minutes of one battery that may be planned."""
        return self.flight_min * (1 - RESERVE)


def known_cameras() -> dict[str, DroneCamera]:
    """The table (``treedgs_geo/planning/cameras.json``)."""
    found = {}
    for key, row in read_json(Path(__file__).with_name("cameras.json"))["cameras"].items():
        focal_px = row.pop("focal_mm") / row.pop("sensor_mm") * row["width_px"]
        found[key] = DroneCamera(key=key, focal_px=focal_px, **{"wpml": None, **row})
    return found


def camera_of(text: str) -> DroneCamera:
    """The camera of a name of the table, of a photo that it took, or of numbers: ``width_px,height_px,focal_px``, and
    where known the shortest time between two photos (s, else 2) and the rolling shutter (ms, else 0).

    Raises:
        InputError: none of these, or a photo that does not say its focal length.

    Examples:
        >>> from treedgs_geo.planning.drones import camera_of
        >>> round(camera_of("m3e").focal_px)
        3751
    """
    known = known_cameras()
    key = text.strip().lower()
    if key in known:
        return known[key]
    if Path(text.strip()).is_file():
        return _of_photo(Path(text.strip()), known)
    try:
        numbers = [float(part) for part in key.split(",")]
        if not 3 <= len(numbers) <= 5 or not all(
            low <= number <= high for number, (low, high) in zip(numbers, _LIMITS, strict=False)
        ):
            raise ValueError
    except ValueError:
        raise InputError(
            f"--camera: {text!r} is unknown, expected one of {', '.join(known)}, a photo of the drone, or "
            "width,height,focal length in pixels like 4000,3000,2800 (focal length in mm / sensor width in mm x "
            "width in pixels)."
        ) from None
    width, height, focal, *more = numbers
    return _own(int(width), int(height), focal, "given by the user", *more)


def _own(
    width: int, height: int, focal_px: float, source: str, interval_s: float = 2.0, readout_ms: float = 0.0
) -> DroneCamera:
    return DroneCamera(
        "own", f"own camera {width} x {height} px, f = {focal_px:.0f} px", width, height, focal_px, interval_s,
        readout_ms, (-90.0, 0.0), 25.0, 0.5 * width * height / 1e6, None, source,
    )  # fmt: skip


def _of_photo(path: Path, known: dict[str, DroneCamera]) -> DroneCamera:
    """The camera of the table that takes such photos (of several the one that the photo names), or an own one."""
    photo = read_photo(path)
    try:
        focal_px = calibration_of([photo]).camera.fx
    except ReconstructionError as problem:
        raise InputError(f"--camera: {problem}") from None
    alike = [
        camera
        for camera in known.values()
        if (camera.width_px, camera.height_px) == (photo.width, photo.height)
        and abs(camera.focal_px / focal_px - 1) < SAME_FOCAL
    ]
    named = [camera for camera in alike if camera.key in photo.model.lower()]
    return next(iter([*named, *alike]), _own(photo.width, photo.height, focal_px, f"read from {path.name}"))
