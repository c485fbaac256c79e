"""XMP of drone photos: DJI's ``drone-dji`` fields and Pix4D's ``Camera`` fields, which senseFly and others write too.

Pix4D's angles (its article "Yaw, Pitch, Roll and Omega, Phi, Kappa angles"): pitch 0 = straight down, 90 = forward;
yaw = where the top of the photo points, clockwise from north; turned in the order yaw, pitch, roll. senseFly's roll has
the other sign. Some drones write DJI's pitch (-90 = straight down) under the same name.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from PIL import Image

from ..core.number_cells import as_number

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
        return float("nan"), float("nan"), float("nan")
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
        return float(np.degrees(np.arctan2(-body[0, 1], body[1, 1]))), float(np.degrees(np.arcsin(down))), 0.0
    return (
        float(np.degrees(np.arctan2(body[1, 0], body[0, 0]))),
        float(np.degrees(np.arcsin(down))),
        float(np.degrees(np.arctan2(body[2, 1], body[2, 2]))),
    )
