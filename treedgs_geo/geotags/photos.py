"""What a photo says about itself: EXIF and XMP (DJI's ``drone-dji`` fields and Pix4D's ``Camera`` fields, which
senseFly and others write too); and which photos are there twice. Originals are only ever read.

Pix4D's angles (its article "Yaw, Pitch, Roll and Omega, Phi, Kappa angles"): pitch 0 = straight down, 90 = forward;
yaw = where the top of the photo points, clockwise from north; turned in the order yaw, pitch, roll. senseFly's roll has
the other sign. Some drones write DJI's pitch (-90 = straight down) under the same name.
"""

from __future__ import annotations

import filecmp
import re
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from ..core.errors import InputError
from ..core.files import PHOTO_SUFFIXES
from ..core.number_cells import as_number
from ..core.progress import Reporter
from ..core.shown import shorten
from .gpstime import parse_datetime_unix

#: Pictures that are none of these; said when a folder holds nothing else.
_OTHER_PICTURES = {".dng", ".raw", ".arw", ".cr2", ".cr3", ".nef", ".heic", ".heif", ".webp", ".jp2", ".mp4", ".mov"}
_WRITE_8_BIT = "write 8-bit JPEGs that keep the EXIF and XMP (a raw converter does) and give their folder"
_SEQUENCE = re.compile(r"(\d{3,5})(?:_[A-Za-z]+)*$")


@dataclass(frozen=True)
class Photo:
    """One photo's metadata. Unknown numbers are NaN.

    name: path relative to the photo folder, with ``/``. sequence: the running number in the file name, -1 if none.
    local_time, utc: Unix seconds of the exposure, as the camera clock says and in UTC (when the zone is known).
    lon_deg, lat_deg, height_m: EXIF or XMP position. rtk_flag: DJI RtkFlag. sd: (3,) E, N, U metres from XMP RtkStd*.
    focal_mm, focal_35mm: EXIF. plane_px_mm: (K,) pixels a millimetre of the focal plane, as EXIF says and, where its
    unit is uncertain, as it may mean. exposure_s: exposure time. taken_px: (width, height) as the camera wrote it,
    before the file was reduced. dji: the XMP ``drone-dji`` fields as text. pix4d: the XMP ``Camera`` fields.
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
    pix4d: dict[str, str] = field(default_factory=dict)
    plane_px_mm: tuple[float, ...] = ()
    exposure_s: float = float("nan")
    taken_px: tuple[int, int] = (0, 0)

    @property
    def time_s(self) -> float:
        """Unix seconds of the exposure in UTC, or where its zone is unknown as the camera clock says."""
        return self.utc if np.isfinite(self.utc) else self.local_time

    @property
    def has_position(self) -> bool:
        """True when EXIF or XMP gives a longitude and latitude."""
        return bool(np.isfinite(self.lon_deg) and np.isfinite(self.lat_deg))


def read_photo(path: Path, name: str | None = None) -> Photo:
    """Read one photo's metadata.

    Raises:
        InputError: not an image, truncated before its header ends, or with more than 8 bits of grey.
    """
    try:
        with Image.open(path) as image:
            if image.mode.startswith(("I", "F")):
                bits = "32" if image.mode in ("I", "F") else "16"
                raise InputError(f"{path}: holds {bits}-bit grey values, expected an 8-bit photo; {_WRITE_8_BIT}.")
            width, height = image.size
            exif = image.getexif()
            details, gps = dict(exif.get_ifd(0x8769)), dict(exif.get_ifd(0x8825))
            model = _text(exif.get(272, ""))
            dji, pix4d = read_xmp(path, image)
    except Image.DecompressionBombError:
        raise InputError(
            f"{path}: claims more than {2 * (Image.MAX_IMAGE_PIXELS or 0) / 1e6:.0f} megapixels, expected a drone "
            "photo; remove it."
        ) from None
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as problem:
        raise InputError(_unreadable(path, problem)) from None
    local = parse_datetime_unix(_text(details.get(36867) or details.get(36868) or exif.get(306, "")))
    fraction = _text(details.get(37521) or details.get(37520) or "")
    if fraction.isdigit() and local == np.floor(local):
        local += float(f"0.{fraction}")
    utc = parse_datetime_unix(dji.get("UTCAtExposure", ""))
    if np.isnan(utc):
        utc = local - _zone_s(_text(details.get(36881) or details.get(36880) or ""))
    lon, lat, height_m = _position(gps, dji)
    yaw, pitch, roll = _angles(dji, pix4d, uses_dji_pitch([pix4d]))
    taken, number = _taken_px(details, width, height), _SEQUENCE.search(path.stem)
    return Photo(
        name=name or path.name,
        path=path,
        width=width,
        height=height,
        model=model,
        sequence=int(number[1]) if number else -1,
        local_time=local,
        utc=utc,
        lon_deg=lon,
        lat_deg=lat,
        height_m=height_m,
        rtk_flag=as_number(dji.get("RtkFlag")),
        sd=np.array([as_number(dji.get(key)) for key in ("RtkStdLon", "RtkStdLat", "RtkStdHgt")]),
        yaw_deg=yaw,
        pitch_deg=pitch,
        roll_deg=roll,
        relative_altitude_m=as_number(dji.get("RelativeAltitude")),
        focal_mm=as_number(details.get(37386)),
        focal_35mm=as_number(details.get(41989)),
        dji=dji,
        pix4d=pix4d,
        plane_px_mm=_plane_px_mm(details, max(width, height) / max(taken)),
        exposure_s=as_number(details.get(33434)),
        taken_px=taken,
    )


def list_photos(folder: Path) -> list[Path]:
    """Image files below ``folder``, sorted by relative path; not the pictures in a workspace that lies in it.

    Raises:
        InputError: no folder, or no photo in it.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: is not a folder; give the folder that holds the drone photos.")
    pictures = sorted(p for p in folder.rglob("*") if p.suffix.lower() in PHOTO_SUFFIXES and not p.name.startswith("."))
    ours = {record.parent for record in folder.rglob("run.json")} - {folder}
    found = [p for p in pictures if p.is_file() and ours.isdisjoint(p.parents)]
    if not found:
        others = Counter(p.suffix.lower() for p in folder.rglob("*") if p.suffix.lower() in _OTHER_PICTURES)
        if others:
            kind, count = others.most_common(1)[0]
            raise InputError(
                f"{folder}: holds {count} {kind} files and no {', '.join(sorted(PHOTO_SUFFIXES))}; {_WRITE_8_BIT}."
            )
        raise InputError(
            f"{folder}: holds no photos ({', '.join(sorted(PHOTO_SUFFIXES))}); give the folder of the drone photos."
        )
    return found


def read_photos(folder: Path, reporter: Reporter | None = None) -> list[Photo]:
    """Metadata of every usable photo in a folder; odd ones out (unreadable, another size or camera) and copies are left
    out with a warning.

    Raises:
        InputError: no folder, no photo, or none that can be read.
    """
    reporter = reporter or Reporter()
    photos: list[Photo] = []
    refused: list[InputError] = []
    for path in list_photos(folder):
        try:
            photos.append(read_photo(path, path.relative_to(folder).as_posix()))
        except InputError as problem:
            refused.append(problem)
    if not photos:
        raise InputError(f"None of the {len(refused)} photos can be used: {refused[0]}")
    for refusal in refused:
        reporter.warn(f"Left out {refusal}")
    copies = find_copies(photos)
    if copies:
        some = shorten([f"{name} of {used}" for name, used in copies.items()], 3)
        reporter.warn(
            f"{len(copies)} of {len(photos)} photos are copies and were left out, each exposure is used once: {some}."
        )
        photos = [photo for photo in photos if photo.name not in copies]
    kinds = Counter((photo.model, photo.width, photo.height) for photo in photos)
    usual, _ = kinds.most_common(1)[0]
    odd = [photo.name for photo in photos if (photo.model, photo.width, photo.height) != usual]
    if odd:
        reporter.warn(
            f"Left out {len(odd)} of {len(photos)} pictures that are not from the main camera "
            f"({usual[0] or 'unknown'}, {usual[1]} x {usual[2]} px): {shorten(odd)}."
        )
    photos = [photo for photo in photos if photo.name not in set(odd)]
    # What the Camera angles mean is decided for all photos together.
    as_dji = uses_dji_pitch([photo.pix4d for photo in photos])
    angles = [_angles(photo.dji, photo.pix4d, as_dji) for photo in photos]
    return [
        replace(photo, yaw_deg=yaw, pitch_deg=pitch, roll_deg=roll)
        for photo, (yaw, pitch, roll) in zip(photos, angles, strict=True)
    ]


def _angles(dji: dict[str, str], pix4d: dict[str, str], as_dji: bool) -> tuple[float, float, float]:
    """Yaw, pitch and roll of the gimbal, degrees: DJI's own, or by the ``Camera`` fields."""
    yaw, pitch, roll = (as_number(dji.get(f"Gimbal{angle}Degree")) for angle in ("Yaw", "Pitch", "Roll"))
    return gimbal_angles(pix4d, as_dji) if np.isnan(pitch) else (yaw, pitch, roll)


def _unreadable(path: Path, problem: Exception) -> str:
    """Why a file is no photo: what GDAL sees in a TIFF that Pillow cannot open, else Pillow's word."""
    import warnings

    import rasterio

    if path.suffix.lower() in (".tif", ".tiff"):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                with rasterio.open(path) as raster:
                    bands, bits = raster.count, 8 * np.dtype(raster.dtypes[0]).itemsize
            return (
                f"{path}: holds {bands} bands of {bits} bits, expected a photo of 3 bands (red, green, blue) of 8 "
                f"bits; {_WRITE_8_BIT}."
            )
        except rasterio.errors.RasterioIOError:
            pass
    return f"{path}: cannot be read as a photo ({problem}); copy it again or remove it."


def _position(gps: dict, dji: dict[str, str]) -> tuple[float, float, float]:
    """Longitude, latitude, height: XMP's decimal degrees where they are good, else EXIF; NaN without a possible one."""
    lat, lon = as_number(dji.get("GpsLatitude")), as_number(dji.get("GpsLongitude", dji.get("GpsLongtitude")))
    if not _plausible(lon, lat):
        lat, lon = _degrees(gps.get(2), gps.get(1), "S"), _degrees(gps.get(4), gps.get(3), "W")
    if not _plausible(lon, lat):
        return np.nan, np.nan, np.nan
    height = as_number(dji.get("AbsoluteAltitude"))
    if np.isnan(height):
        height = as_number(gps.get(6)) * (-1 if gps.get(5) in (b"\x01", 1) else 1)
    return lon, lat, height


def _plane_px_mm(details: dict, shrunk: float) -> tuple[float, ...]:
    """Pixels a millimetre from FocalPlaneXResolution; the unit is often written wrong, so the others follow.

    shrunk: pixels in the file for one that was taken; the tag belongs to the photo as it was taken.
    """
    resolution = as_number(details.get(41486))
    if not resolution > 0:
        return ()
    units = {2: 25.4, 3: 10.0, 4: 1.0, 5: 0.001}
    stated = units.get(int(np.nan_to_num(as_number(details.get(41488)), nan=2)), 25.4)
    return tuple(resolution / mm * shrunk for mm in (stated, *(mm for mm in units.values() if mm != stated)))


def _taken_px(details: dict, width: int, height: int) -> tuple[int, int]:
    """Width and height by the longer side that EXIF says; those of the file where it says none."""
    longer = np.nanmax([as_number(details.get(40962)), as_number(details.get(40963)), -1.0])
    grown = longer / max(width, height) if longer > 0 else 1.0
    return round(width * grown), round(height * grown)


def _plausible(lon: float, lat: float) -> bool:
    return bool(abs(lon) <= 180 and abs(lat) <= 90 and not (lon == 0 and lat == 0))


def _degrees(parts: object, hemisphere: object, negative: str) -> float:
    try:
        degrees, minutes, seconds = (float(part) for part in parts)  # type: ignore[attr-defined]
    except (TypeError, ValueError, ZeroDivisionError):
        return float("nan")
    return (degrees + minutes / 60 + seconds / 3600) * (-1 if _text(hemisphere).upper() == negative else 1)


def _text(value: object) -> str:
    if isinstance(value, bytes):
        value = value.decode("ascii", errors="replace")
    return str(value).replace("\x00", "").strip()


def _zone_s(text: str) -> float:
    match = re.fullmatch(r"([+-])(\d{2}):(\d{2})", text)
    if not match:
        return float("nan")
    return (1 if match[1] == "+" else -1) * (int(match[2]) * 3600 + int(match[3]) * 60)


#: Two pictures with the same name and time are one exposure when their thumbnails differ by less than this (median, of
#: 255, after equal brightness and contrast); rigs of several cameras expose at one time too, and look elsewhere.
_SAME_GREY = 6.0


def find_copies(photos: list[Photo]) -> dict[str, str]:
    """Name of each photo that is a copy -> name of the one that is used (the one least deep in the folders)."""
    order = sorted(photos, key=lambda photo: (photo.name.count("/"), len(photo.name), photo.name))
    by_content: dict[tuple, list[Photo]] = {}
    by_exposure: dict[tuple, list[Photo]] = {}
    copies: dict[str, str] = {}
    for photo in order:
        content = _glance(photo.path)
        exposure = (photo.path.stem.lower(), photo.local_time, photo.model)
        twin = next((other for other in by_content.get(content, []) if _same_bytes(photo.path, other.path)), None)
        if twin is None and np.isfinite(photo.local_time):
            twin = next((other for other in by_exposure.get(exposure, []) if _same_picture(photo, other)), None)
        if twin is not None:
            copies[photo.name] = twin.name
            continue
        by_content.setdefault(content, []).append(photo)
        by_exposure.setdefault(exposure, []).append(photo)
    return copies


def _glance(path: Path) -> tuple:
    """Size, first and middle bytes: quick to read, and rarely the same for two exposures."""
    with open(path, "rb") as stream:
        size = stream.seek(0, 2)
        stream.seek(0)
        first = stream.read(4096)
        stream.seek(size // 2)
        return size, hash(first), hash(stream.read(4096))


def _same_bytes(one: Path, other: Path) -> bool:
    try:
        return filecmp.cmp(one, other, shallow=False)
    except OSError:
        return False


def _same_picture(one: Photo, other: Photo) -> bool:
    try:
        first, second = _thumbnail(one.path), _thumbnail(other.path)
    except (OSError, SyntaxError, ValueError):
        return False
    return bool(np.median(np.abs(first - second)) < _SAME_GREY)


def _thumbnail(path: Path) -> np.ndarray:
    """(48, 48) grey, mean 128, standard deviation 50."""
    with Image.open(path) as image:
        image.draft("L", (192, 192))
        grey = np.asarray(image.convert("L").resize((48, 48), Image.Resampling.BOX), np.float32)
    return 128 + 50 * (grey - grey.mean()) / max(float(grey.std()), 1.0)


_VALUE = re.compile(
    r'(?<![\w-])(drone-dji|Camera):(\w+)\s*=\s*["\']([^"\']*)["\']'
    r"|<(drone-dji|Camera):(\w+)>([^<]*)</"
)
#: A pitch below this, in a set of photos, is DJI's: by Pix4D's rule the camera would look backwards at the horizon.
_DJI_PITCH_DEG = -60.0


def read_xmp(path: Path, image: Image.Image) -> tuple[dict[str, str], dict[str, str]]:
    """The ``drone-dji`` and the ``Camera`` fields, written as attributes or as elements; empty when there are none.

    ``Camera`` fields of a senseFly get the key ``_sensefly``.
    """
    with open(path, "rb") as stream:
        head = stream.read(1 << 19)
    if b"<x:xmpmeta" not in head:
        packet = image.info.get("xmp") or image.info.get("XML:com.adobe.xmp") or b""
        head = packet if isinstance(packet, bytes) else str(packet).encode()
    start, end = head.find(b"<x:xmpmeta"), head.find(b"</x:xmpmeta>")
    found: dict[str, dict[str, str]] = {"drone-dji": {}, "Camera": {}}
    if start < 0 or end < start:
        return found["drone-dji"], found["Camera"]
    text = head[start:end].decode("utf-8", errors="replace")
    for space, attribute, value, other, element, content in _VALUE.findall(text):
        found[space or other].setdefault(attribute or element, (value or content).strip())
    if found["Camera"] and "ns.sensefly.com" in text:
        found["Camera"]["_sensefly"] = "1"
    return found["drone-dji"], found["Camera"]


def uses_dji_pitch(sets: list[dict[str, str]]) -> bool:
    """True when ``Camera`` angles of a set of photos can only be meant as DJI means them."""
    return any(as_number(fields.get("Pitch")) < _DJI_PITCH_DEG for fields in sets)


def gimbal_angles(fields: dict[str, str], as_dji: bool) -> tuple[float, float, float]:
    """``Camera`` yaw, pitch, roll as DJI's gimbal angles (pitch -90 = straight down), degrees; NaN where absent."""
    yaw, pitch, roll = (as_number(fields.get(key)) for key in ("Yaw", "Pitch", "Roll"))
    roll = 0.0 if np.isnan(roll) else roll
    if not np.isfinite([yaw, pitch]).all() or abs(pitch) > 180:
        return np.nan, np.nan, np.nan
    if as_dji:
        return yaw, pitch, roll
    if "_sensefly" in fields:
        roll = -roll
    y, p, r = np.radians([yaw, pitch, roll])
    turn = np.array([[np.cos(y), -np.sin(y), 0], [np.sin(y), np.cos(y), 0], [0, 0, 1]])
    nod = np.array([[np.cos(p), 0, np.sin(p)], [0, 1, 0], [-np.sin(p), 0, np.cos(p)]])
    tilt = np.array([[1, 0, 0], [0, np.cos(r), -np.sin(r)], [0, np.sin(r), np.cos(r)]])
    # DJI's axes are forward along the lens, Pix4D's forward along the top of the photo: a quarter turn about the wing.
    body = turn @ nod @ tilt @ np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])
    down = float(np.clip(-body[2, 0], -1, 1))
    if abs(down) > 1 - 1e-9:  # straight down: yaw and roll are one angle
        turned = np.arctan2(-body[0, 1], body[1, 1]), np.arcsin(down), 0.0
    else:
        turned = np.arctan2(body[1, 0], body[0, 0]), np.arcsin(down), np.arctan2(body[2, 1], body[2, 2])
    yaw, pitch, roll = np.degrees(turned).tolist()
    return yaw, pitch, roll
