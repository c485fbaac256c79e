"""Photos enlarged to see what many megapixels cost (not how accurate they are: nothing is added to them), and reduced
ones.

EXIF and XMP of enlarged ones stay, with the pixel dimensions and the calibrated focal length scaled: an ordinary input.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from treedgs_geo.core.errors import InputError
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.reconstruction.images import load_image


def segments(data: bytes) -> list[bytes]:
    """The APP1 segments (EXIF, XMP) of a JPEG."""
    found, place = [], 2
    while data[place] == 0xFF and data[place + 1] != 0xDA:
        size = int.from_bytes(data[place + 2 : place + 4], "big") + 2
        if data[place + 1] == 0xE1:
            found.append(data[place : place + size])
        place += size
    return found


def scaled_xmp(segment: bytes, factor: float) -> bytes:
    """Calibrated focal length and optical centre times ``factor``."""

    def times(match: re.Match[bytes]) -> bytes:
        return match.group(1) + f"{float(match.group(2)) * factor:.6f}".encode() + match.group(3)

    body = re.sub(rb'((?:CalibratedFocalLength|CalibratedOpticalCenter[XY])=")([\d.]+)(")', times, segment[4:])
    return b"\xff\xe1" + (len(body) + 2).to_bytes(2, "big") + body


def enlarge(source: Path, target: Path, width: int) -> float:
    """Write one photo enlarged to ``width`` pixels across; returns its megapixels.

    Raises:
        InputError: unreadable.
    """
    image = cv2.imread(str(source), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if image is None:
        raise InputError(f"{source}: is no readable picture, expected a JPEG photo; leave it out.")
    factor = width / image.shape[1]
    large = cv2.resize(image, (width, round(image.shape[0] * factor)), interpolation=cv2.INTER_CUBIC)
    # Sensor noise of the large photo: without it JPEG files would be unusually small and quick to read.
    grain = np.random.default_rng(int.from_bytes(source.name.encode()[-12:-8], "big")).integers(-4, 5, (512, 512, 1))
    tiles = np.tile(grain, (large.shape[0] // 512 + 1, width // 512 + 1, 1))[: large.shape[0], :width]
    large = np.clip(large.astype(np.int16) + tiles, 0, 255).astype(np.uint8)
    data = cv2.imencode(".jpg", large, [cv2.IMWRITE_JPEG_QUALITY, 88])[1].tobytes()
    kept = b"".join(scaled_xmp(s, factor) if b"adobe" in s[:40] else s for s in segments(source.read_bytes()))
    target.write_bytes(data[:2] + kept + data[2:])
    return large.shape[0] * width / 1e6


def reduced(views: list[View], scale: float, folder: Path) -> list[View]:
    """The photos at a share of their size, with cameras that fit (not timed: a drone would store them so)."""
    folder.mkdir(parents=True, exist_ok=True)
    made = []
    for view in views:
        image = load_image(view)[..., ::-1]
        height, width = round(image.shape[0] * scale), round(image.shape[1] * scale)
        path = folder / view.path.name
        cv2.imwrite(
            str(path), cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), [cv2.IMWRITE_JPEG_QUALITY, 95]
        )
        sx, sy = width / image.shape[1], height / image.shape[0]
        c = view.camera
        camera = replace(c, width=width, height=height, fx=c.fx * sx, fy=c.fy * sy, cx=c.cx * sx, cy=c.cy * sy)
        made.append(replace(view, path=path, camera=camera))
    return made
