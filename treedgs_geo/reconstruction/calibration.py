"""What is known about the lens before any photo is matched."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError, ReconstructionError
from ..core.number_cells import as_number
from ..geotags.photos import Photo
from .cameras import Camera, Sensor

#: Sensor widths in mm (maker's data sheets) and the nominal focal length that the entry holds for.
SENSOR_WIDTHS_MM = {
    **dict.fromkeys(("FC300S", "FC300X", "FC300C"), (6.16, 3.61)),
    "FC330": (6.17, 3.61),
    "FC220": (6.17, 4.73),
    **dict.fromkeys(("FC6310", "FC6310R", "FC6310S"), (13.2, 8.8)),
    "L1D-20c": (13.2, 10.26),
    **dict.fromkeys(("L2D-20c", "M3E", "M4E"), (17.3, 12.29)),
    "ZenmuseP1": (35.9, 35.0),
    "FC6520": (17.3, 15.0),
    "FC7203": (6.3, 4.49),
    "Canon PowerShot A3300 IS": (6.17, 5.0),
}


#: What a calibration consists of, as the fields of :class:`~.cameras.Camera`.
PARAMETERS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
#: Prior standard deviations by source: focal length (share of it), principal point (share of the longer side), k1, k2,
#: k3, p1 and p2. Chosen, not fitted: a factory calibration is of this very lens, but at another temperature and focus;
#: nominal figures are of the design (those of real drones are 0.3 to 1.6 % from their factory calibration,
#: ``xmp_samples``); a distortion that nobody stated may be that of any drone's lens.
_UNKNOWN_LENS = (0.3, 0.5, 1.0, 0.002)
_PRIOR_SD = {
    "dewarp": (0.005, 0.002, 0.02, 0.05, 0.1, 0.0005),
    # What an earlier flight could not determine was taken over from metadata: it is not worth more for standing there.
    **dict.fromkeys(("file", "xmp", "pix4d", "sensor"), (0.03, 0.01, *_UNKNOWN_LENS)),
    "plane": (0.04, 0.01, *_UNKNOWN_LENS),
    "exif35": (0.05, 0.015, *_UNKNOWN_LENS),
}
#: How much a lens changes from flight to flight (temperature, focus), beside what its own calibration is worth, in the
#: same order. A focal length drifts by some 0.05 % (``plot_h`` is rendered with 0.06 % between two flights).
_FLIGHT_DRIFT = (0.001, 0.0002, 0.002, 0.005, 0.01, 0.0002)


@dataclass(frozen=True)
class Calibration:
    """First guess of the intrinsics.

    source: file (an earlier reconstruction with this camera), dewarp (factory calibration in XMP), xmp (nominal), pix4d
    (XMP Camera, millimetres), sensor (data sheet), exif35 (35 mm equivalent), plane (FocalPlaneXResolution).
    tolerance: largest believable relative error of the focal length.
    sd: prior standard deviation of each of :data:`PARAMETERS`; fx, fy, cx, cy in pixels, the others dimensionless; what
    is not given is filled in by the source. readout_s, readout_sd_s: readout time of the photo that the file names, and
    its standard deviation, NaN unknown.
    """

    camera: Camera
    source: str
    tolerance: float
    sd: dict[str, float] = field(default_factory=dict)
    readout_s: float = float("nan")
    readout_sd_s: float = float("nan")

    def __post_init__(self) -> None:
        object.__setattr__(self, "sd", {**_scaled(self.camera, _PRIOR_SD[self.source]), **self.sd})

    @property
    def focal_px(self) -> float:
        """Mean focal length, pixels."""
        return 0.5 * (self.camera.fx + self.camera.fy)


def _scaled(camera: Camera, shares: tuple[float, ...]) -> dict[str, float]:
    """Standard deviations of the parameters from shares of the focal length and of the longer side."""
    focal, centre, k1, k2, k3, tangential = shares
    middle = centre * max(camera.width, camera.height)
    values = focal * camera.fx, focal * camera.fy, middle, middle, k1, k2, tangential, tangential, k3
    return dict(zip(PARAMETERS, values, strict=True))


def calibration_of(photos: list[Photo], file: Path | None = None) -> Calibration:
    """The most trustworthy calibration that a file or the photos' metadata hold.

    file: ``camera.json`` of an earlier reconstruction with the same camera; it goes before the metadata.

    Raises:
        ReconstructionError: no hint at the focal length at all. InputError: a file that cannot be used.
    """
    photo = photos[0]
    if file is not None:
        return _from_file(Path(file), photo)
    width, height = photo.width, photo.height
    cx, cy = width / 2, height / 2
    dewarp = photo.dji.get("DewarpData", "").split(";")[-1].split(",")
    if len(dewarp) == 9 and photo.dji.get("DewarpFlag", "0").strip() != "1":
        try:
            fx, fy, dx, dy, k1, k2, p1, p2, k3 = (float(value) for value in dewarp)
        except ValueError:
            fx = 0.0
        if 0.3 * width < fx < 20 * width:
            return Calibration(Camera(width, height, fx, fy, cx + dx, cy + dy, k1, k2, p1, p2, k3), "dewarp", 0.03)
    focal = as_number(photo.dji.get("CalibratedFocalLength"))
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
#: The same of the same camera in another flight, at least.
_FILE_TOLERANCE = 0.02
_EXPECTED_FILE = (
    "expected camera.json as reconstruct writes it (model, width, height, fx, fy, cx, cy, k1, k2, p1, p2, k3)"
)
#: No drone's sensor is smaller or wider, millimetres.
_SENSOR_MM = (2.0, 60.0)


def _from_file(path: Path, photo: Photo) -> Calibration:
    """What an earlier reconstruction found, with its standard deviations widened by the drift between flights."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, ValueError) as problem:
        raise InputError(f"{path}: cannot be read ({problem}); {_EXPECTED_FILE}.") from None
    found = found if isinstance(found, dict) else {}
    numbers = {name: _finite(found.get(name)) for name in ("width", "height", *PARAMETERS)}
    lacking = [name for name, value in numbers.items() if np.isnan(value)]
    if lacking:
        raise InputError(f"{path}: has no {', '.join(lacking)}; {_EXPECTED_FILE}.")
    width, height = int(numbers["width"]), int(numbers["height"])
    if (width, height) != (photo.width, photo.height):
        raise InputError(
            f"{path}: is of photos of {width} x {height} px, these have {photo.width} x {photo.height} px; give the "
            "calibration of the same camera with the same photo size."
        )
    model = str(found.get("model") or "")
    if model.strip().lower() != photo.model.strip().lower():
        raise InputError(
            f"{path}: is of the camera {model or 'unknown'!r}, these photos are of {photo.model or 'unknown'!r}; give "
            "the calibration of the same camera."
        )
    camera = Camera(width, height, *(numbers[name] for name in PARAMETERS))
    longer = max(width, height)
    if not (0.1 * longer < min(camera.fx, camera.fy) and max(camera.fx, camera.fy) < 20 * longer):
        raise InputError(f"{path}: focal length {camera.fx:g}, {camera.fy:g} px cannot be; {_EXPECTED_FILE}.")
    given = {name: _finite(found.get(f"{name}_sd")) for name in PARAMETERS}
    drift = _scaled(camera, _FLIGHT_DRIFT)
    own = {name: float(np.hypot(sd, drift[name])) for name, sd in given.items() if sd > 0}
    readout, sd = _finite(found.get("readout_s")), _finite(found.get("readout_s_sd"))
    focal_sd = own.get("fx", _PRIOR_SD["file"][0] * camera.fx) / camera.fx
    return Calibration(camera, "file", max(_FILE_TOLERANCE, 3 * focal_sd), own, readout, sd)


def lens_sd_of(shared_sd: np.ndarray) -> dict[str, float]:
    """Standard deviations of the estimated parameters by name, as a report states them (``fx``: relative).

    shared_sd: (S,) of the shared parameters (:mod:`.bundle_kernels`), NaN where held.
    """
    named = zip(("fx", "", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "readout_s"), shared_sd.tolist(), strict=False)
    return {name: round(sd, 8) for name, sd in named if name and np.isfinite(sd)}


def calibration_record(model: str, sensor: Sensor, lens_sd: dict[str, float]) -> dict[str, Any]:
    """``camera.json`` of an adjusted camera: its numbers and, where they were estimated, their standard deviations.

    lens_sd: :func:`lens_sd_of`.
    """
    camera, sd = sensor.camera, dict(lens_sd)
    if "fx" in sd:
        sd |= {"fx": lens_sd["fx"] * camera.fx, "fy": lens_sd["fx"] * camera.fy}
    numbers: dict[str, Any] = {name: float(getattr(camera, name)) for name in ("width", "height", *PARAMETERS)}
    record = {"model": model, **numbers, "readout_s": sensor.readout_s}
    return record | {f"{name}_sd": value for name, value in sd.items()}


def _finite(value: object) -> float:
    """A JSON number, NaN for anything else."""
    known = isinstance(value, (int, float)) and not isinstance(value, bool) and np.isfinite(value)
    return float(value) if known else float("nan")  # type: ignore[arg-type]


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
    focal = as_number(photo.pix4d.get("PerspectiveFocalLength"))
    if not focal > 0 or "fisheye" in photo.pix4d.get("ModelType", "").lower():
        return float("nan")
    longer = max(photo.width, photo.height)
    sensor = SENSOR_WIDTHS_MM.get(photo.model)
    middle = max((as_number(part) for part in photo.pix4d.get("PrincipalPoint", "").split(",")), default=float("nan"))
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
    focal = photo.focal_mm if photo.focal_mm > 0 else as_number(photo.pix4d.get("PerspectiveFocalLength"))
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
