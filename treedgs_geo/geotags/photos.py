"""What a photo says about itself: EXIF and DJI's XMP. Originals are only ever read."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from ..core.errors import InputError
from ..core.progress import Reporter
from .gpstime import parse_datetime_unix

SUFFIXES = {".jpg", ".jpeg", ".tif", ".tiff", ".png"}
_XMP_VALUE = re.compile(r'drone-dji:(\w+)\s*=\s*["\']([^"\']*)["\']|<drone-dji:(\w+)>([^<]*)</')
_SEQUENCE = re.compile(r"(\d{3,5})(?:_[A-Za-z]+)*$")


@dataclass(frozen=True)
class Photo:
    """One photo's metadata. Unknown numbers are NaN.

    name: path relative to the photo folder, with ``/``. sequence: the running number in the file name, -1 if none.
    local_time, utc: Unix seconds of the exposure, as the camera clock says and in UTC (when the zone is known).
    lon_deg, lat_deg, height_m: EXIF or XMP position. rtk_flag: DJI RtkFlag. sd: (3,) E, N, U metres from XMP RtkStd*.
    focal_mm, focal_35mm: EXIF. dji: the XMP ``drone-dji`` fields as text.
    """

    name: str
    path: Path
    width: int
    height: int
    model: str
    sequence: int
    local_time: float
    utc: float
    lon_deg: float
    lat_deg: float
    height_m: float
    rtk_flag: float
    sd: np.ndarray
    yaw_deg: float
    pitch_deg: float
    roll_deg: float
    relative_altitude_m: float
    focal_mm: float
    focal_35mm: float
    dji: dict[str, str]

    @property
    def has_position(self) -> bool:
        """True when EXIF or XMP gives a longitude and latitude."""
        return bool(np.isfinite(self.lon_deg) and np.isfinite(self.lat_deg))


def read_photo(path: Path, name: str | None = None) -> Photo:
    """Read one photo's metadata.

    Raises:
        InputError: not an image, or truncated before its header ends.
    """
    try:
        with Image.open(path) as image:
            width, height = image.size
            exif = image.getexif()
            details, gps = dict(exif.get_ifd(0x8769)), dict(exif.get_ifd(0x8825))
            model = _text(exif.get(272, ""))
    except Image.DecompressionBombError:
        raise InputError(
            f"{path}: claims more than {2 * (Image.MAX_IMAGE_PIXELS or 0) / 1e6:.0f} megapixels, expected a drone "
            "photo; remove it."
        ) from None
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as problem:
        raise InputError(f"{path}: cannot be read as a photo ({problem}); copy it again or remove it.") from None
    dji = _read_dji(path)
    local = parse_datetime_unix(_text(details.get(36867) or details.get(36868) or exif.get(306, "")))
    fraction = _text(details.get(37521) or details.get(37520) or "")
    if fraction.isdigit() and local == np.floor(local):
        local += float(f"0.{fraction}")
    utc = parse_datetime_unix(dji.get("UTCAtExposure", ""))
    if np.isnan(utc):
        utc = local - _zone_s(_text(details.get(36881) or details.get(36880) or ""))
    lon, lat, height_m = _position(gps, dji)
    return Photo(
        name=name or path.name,
        path=path,
        width=width,
        height=height,
        model=model,
        sequence=_sequence(path.stem),
        local_time=local,
        utc=utc,
        lon_deg=lon,
        lat_deg=lat,
        height_m=height_m,
        rtk_flag=_number(dji.get("RtkFlag")),
        sd=np.array([_number(dji.get(key)) for key in ("RtkStdLon", "RtkStdLat", "RtkStdHgt")]),
        yaw_deg=_number(dji.get("GimbalYawDegree")),
        pitch_deg=_number(dji.get("GimbalPitchDegree")),
        roll_deg=_number(dji.get("GimbalRollDegree")),
        relative_altitude_m=_number(dji.get("RelativeAltitude")),
        focal_mm=_number(details.get(37386)),
        focal_35mm=_number(details.get(41989)),
        dji=dji,
    )


def list_photos(folder: Path) -> list[Path]:
    """Image files below ``folder``, sorted by relative path.

    Raises:
        InputError: no folder, or no photo in it.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: is not a folder; give the folder that holds the drone photos.")
    found = sorted(
        p for p in folder.rglob("*") if p.suffix.lower() in SUFFIXES and p.is_file() and not p.name.startswith(".")
    )
    if not found:
        raise InputError(
            f"{folder}: holds no photos ({', '.join(sorted(SUFFIXES))}); give the folder of the drone photos."
        )
    return found


def read_photos(folder: Path, reporter: Reporter | None = None) -> list[Photo]:
    """Metadata of every usable photo in a folder; odd ones out (unreadable, another size or camera) are left out with
    a warning.

    Raises:
        InputError: no folder, no photo, or none that can be read.
    """
    reporter = reporter or Reporter()
    photos: list[Photo] = []
    for path in list_photos(folder):
        try:
            photos.append(read_photo(path, path.relative_to(folder).as_posix()))
        except InputError as problem:
            reporter.warn(f"Left out {problem}")
    if not photos:
        raise InputError(f"{folder}: none of its photos can be read; copy them again from the drone.")
    kinds = Counter((photo.model, photo.width, photo.height) for photo in photos)
    usual, count = kinds.most_common(1)[0]
    odd = [photo.name for photo in photos if (photo.model, photo.width, photo.height) != usual]
    if odd:
        reporter.warn(
            f"Left out {len(odd)} of {len(photos)} pictures that are not from the main camera "
            f"({usual[0] or 'unknown'}, {usual[1]} x {usual[2]} px): {shorten(odd)}."
        )
    return [photo for photo in photos if photo.name not in set(odd)]


def shorten(names: list[str], most: int = 5) -> str:
    """A few names for a message."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def _read_dji(path: Path) -> dict[str, str]:
    """XMP ``drone-dji`` fields, written as attributes or as elements; empty when there are none."""
    with open(path, "rb") as stream:
        head = stream.read(1 << 19)
    start, end = head.find(b"<x:xmpmeta"), head.find(b"</x:xmpmeta>")
    if start < 0 or end < start:
        return {}
    found: dict[str, str] = {}
    for attribute, value, element, content in _XMP_VALUE.findall(head[start:end].decode("utf-8", errors="replace")):
        found.setdefault(attribute or element, (value or content).strip())
    return found


def _position(gps: dict, dji: dict[str, str]) -> tuple[float, float, float]:
    """Longitude, latitude, height: XMP's decimal degrees where they are good, else EXIF. NaN where absent or
    impossible.
    """
    lat, lon = _number(dji.get("GpsLatitude")), _number(dji.get("GpsLongitude", dji.get("GpsLongtitude")))
    if not _plausible(lon, lat):
        lat, lon = _degrees(gps.get(2), gps.get(1), "S"), _degrees(gps.get(4), gps.get(3), "W")
    if not _plausible(lon, lat):
        return float("nan"), float("nan"), float("nan")
    height = _number(dji.get("AbsoluteAltitude"))
    if np.isnan(height):
        height = _number(gps.get(6)) * (-1 if gps.get(5) in (b"\x01", 1) else 1)
    return lon, lat, height


def _plausible(lon: float, lat: float) -> bool:
    return bool(abs(lon) <= 180 and abs(lat) <= 90 and not (lon == 0 and lat == 0))


def _degrees(parts: object, hemisphere: object, negative: str) -> float:
    try:
        degrees, minutes, seconds = (float(part) for part in parts)  # type: ignore[attr-defined]
    except (TypeError, ValueError, ZeroDivisionError):
        return float("nan")
    return (degrees + minutes / 60 + seconds / 3600) * (-1 if _text(hemisphere).upper() == negative else 1)


def _number(value: object) -> float:
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, ZeroDivisionError):
        return float("nan")
    return number if np.isfinite(number) else float("nan")


def _text(value: object) -> str:
    if isinstance(value, bytes):
        value = value.decode("ascii", errors="replace")
    return str(value).replace("\x00", "").strip()


def _zone_s(text: str) -> float:
    match = re.fullmatch(r"([+-])(\d{2}):(\d{2})", text)
    if not match:
        return float("nan")
    return (1 if match[1] == "+" else -1) * (int(match[2]) * 3600 + int(match[3]) * 60)


def _sequence(stem: str) -> int:
    match = _SEQUENCE.search(stem)
    return int(match[1]) if match else -1
