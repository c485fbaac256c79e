"""How long a camera takes to read its sensor from the first row to the last (rolling shutter)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.shown import shorten
from .photos import Photo

#: Standard deviation of a figure of the table: most were read off one photo of a blinking light, to whole milliseconds,
#: and firmwares differ.
TABLE_SD = 0.2
#: What an electronic shutter of a camera that also has a mechanical one takes, seconds: the standard deviation where
#: only the model speaks for the mechanical one, which the pilot may have switched off.
_ELECTRONIC_S = 0.02

#: Milliseconds by EXIF model (lower case), for photos of at least so many megapixels as they were taken. Figures of
#: OpenDroneMap's public table (github.com/OpenDroneMap/ODM, opendm/rollingshutter.py, July 2026), measured by its users
#: as github.com/OpenDroneMap/RSCalibration describes.
_MILLISECONDS: dict[str, tuple[tuple[float, float], ...]] = {
    "phantom vision fc200": ((0, 74),), "fc300s": ((0, 33),), "fc300c": ((0, 33),), "fc300x": ((0, 33),),
    "fc330": ((0, 33),), "fc350": ((0, 30),), "fc220": ((0, 64),), "fc2103": ((0, 32),), "fc3170": ((0, 27),),
    "fc3411": ((0, 32),), "fc7203": ((0, 19), (10, 25)), "fc3682": ((0, 23),), "fc3582": ((0, 26), (48, 60)),
    "fc8482": ((0, 16), (12, 21), (20, 43), (45, 58)), "l1d-20c": ((0, 47), (17, 56)), "l2d-20c": ((0, 16.6),),
    "mavic2-enterprise-advanced": ((0, 31),), "zenmuse z30": ((0, 8),), "xt701": ((0, 25),), "xt705": ((0, 30),),
    "xl724": ((0, 29),), "anafi": ((0, 39),), "e90": ((0, 44),), "hero4 black": ((0, 30),), "hero8 black": ((0, 17),),
}  # fmt: skip
#: Cameras with a mechanical shutter that closes over all rows (makers' data sheets), and the focal length of the camera
#: that has it, mm: the tele cameras of the same drones have none. NaN: any lens.
_MECHANICAL_MM = {
    "fc6310": 8.8, "fc6310s": 8.8, "fc6310r": 8.8, "m3e": 12.29, "m3m": 12.29, "m4e": 12.29, "zenmusep1": np.nan,
}  # fmt: skip
#: The shortest exposure that these shutters can make, seconds; shorter ones are electronic. 1/2000 s is often written
#: as 0.0005 or 1/2016.
_MECHANICAL_S = 0.95 / 2000
#: The same cameras with the electronic shutter, milliseconds, where it was measured (OpenDroneMap's table).
_ELECTRONIC_MS = {"fc6310": 33, "fc6310s": 33, "fc6310r": 33}
#: Cameras whose sensor is exposed all at once (makers' data sheets).
_GLOBAL = {"fc6360": "Phantom 4 Multispectral"}


@dataclass(frozen=True)
class Readout:
    """Readout time of a whole photo.

    seconds: first row to last, 0 = all rows at once, NaN = unknown. sd_s: its standard deviation, NaN where unknown.
    source: where it comes from, as a report says it.
    """

    seconds: float
    sd_s: float
    source: str

    @property
    def is_known(self) -> bool:
        """False where neither the photos nor a table say it."""
        return bool(np.isfinite(self.seconds))


def readout_of(photos: list[Photo]) -> Readout:
    """The readout time of the camera that took the photos (one camera).

    The photos' own word comes first (XMP ``drone-dji:ShutterType``), then what is known of the camera's model. Where
    photos of one set disagree, as with a shutter that was electronic for some of them, nothing is claimed.
    """
    found = [_readout(photo) for photo in photos]
    differing = [photo.name for photo, each in zip(photos, found, strict=True) if each.source != found[0].source]
    if not differing and len({each.seconds for each in found if each.is_known}) <= 1:
        return found[0]
    return Readout(np.nan, np.nan, f"unknown: the photos disagree ({photos[0].name} and {shorten(differing, 3)})")


def _readout(photo: Photo) -> Readout:
    model = photo.model.lower().strip()
    shutter = photo.dji.get("ShutterType", "").strip()
    if shutter.lower().startswith(("mechanical", "global")):
        return Readout(0.0, 0.0, f"XMP ShutterType {shutter}")
    if model in _GLOBAL:
        return Readout(0.0, 0.0, f"global shutter of the {_GLOBAL[model]} (data sheet)")
    rolling = "electronic" in shutter.lower() or "rolling" in shutter.lower()
    is_tele = abs(photo.focal_mm / _MECHANICAL_MM.get(model, np.nan) - 1) > 0.05
    if model in _MECHANICAL_MM and not (rolling or is_tele or photo.exposure_s < _MECHANICAL_S):
        return Readout(0.0, _ELECTRONIC_S, f"mechanical shutter of the {photo.model} (data sheet)")
    megapixels = photo.taken_px[0] * photo.taken_px[1] / 1e6
    steps = _MILLISECONDS.get(model, ((0, _ELECTRONIC_MS[model]),) if model in _ELECTRONIC_MS else ())
    figures = [ms for least, ms in steps if megapixels >= least]
    if not figures:
        return Readout(np.nan, np.nan, f"unknown: no figure for {photo.model or 'a camera without a name'}")
    seconds = figures[-1] / 1000
    return Readout(seconds, TABLE_SD * seconds, f"OpenDroneMap's table of readout times ({photo.model})")
