"""Readout times: what a photo says of its shutter, what is known of its camera, and nothing else."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from shared_data import needs_shared

from treedgs_geo.geotags.photos import Photo, read_photo
from treedgs_geo.geotags.readout import Readout, readout_of

_XMP = '<x:xmpmeta><rdf:Description tiff:Model="{}" {}></rdf:Description></x:xmpmeta>'


def _photo(
    path: Path, model: str, exposure_s: float | None = 0.001, packet: str = "", taken: tuple[int, int] | None = None
) -> Photo:
    """A photo with this EXIF and XMP, written and read again; ``taken``: as large as EXIF says that it was."""
    image = Image.new("RGB", (40, 30) if taken is None else (taken[0] // 100, taken[1] // 100))
    exif = Image.Exif()
    exif[272] = model
    details = exif.get_ifd(0x8769)
    if exposure_s is not None:
        details[33434] = exposure_s
    if taken is not None:
        details[40962], details[40963] = taken
    image.save(path, exif=exif, xmp=packet.encode())
    return read_photo(path)


def _of(photo: Photo) -> tuple[float, float]:
    found = readout_of([photo])
    return found.seconds, found.sd_s


@pytest.mark.parametrize(
    ("name", "seconds", "sd", "says"),
    [
        ("bb_DJI_0018", 0.033, 0.0066, "FC300S"),
        ("mavicmini_0561", 0.025, 0.005, "FC7203"),
        ("p4m_DJI_0010", 0.0, 0.0, "global shutter"),
        ("p4rtk_100_0005_0018", 0.0, 0.02, "mechanical shutter of the FC6310R"),
    ],
)
def test_real_packets(tmp_path: Path, name: str, seconds: float, sd: float, says: str) -> None:
    packet = (needs_shared("xmp_samples") / f"{name}.xmp").read_text()
    model = re.search(r'tiff:Model="([^"]+)"', packet)
    assert model
    photo = _photo(tmp_path / "a.jpg", model[1], packet=packet, taken=(4000, 3000))
    found = readout_of([photo])
    assert photo.dji and (found.seconds, found.sd_s) == pytest.approx((seconds, sd)) and says in found.source


def test_the_shutter_that_the_photo_names_decides(tmp_path: Path) -> None:
    packet = _XMP.format("M3E", 'drone-dji:ShutterType="{}"')
    found = [
        readout_of([_photo(tmp_path / "a.jpg", "M3E", packet=packet.format(word))]) for word in ("Mechanical", "Global")
    ]
    assert [(each.seconds, each.sd_s) for each in found] == [(0.0, 0.0)] * 2 and "ShutterType" in found[0].source
    # an electronic shutter of a camera whose figure nobody measured is unknown, never zero
    assert not readout_of([_photo(tmp_path / "a.jpg", "M3E", packet=packet.format("Electronic"))]).is_known
    assert _of(_photo(tmp_path / "a.jpg", "FC6310", packet=packet.format("Electronic"))) == (0.033, 0.2 * 0.033)


@pytest.mark.parametrize(
    ("exposure_s", "seconds"), [(0.001, 0.0), (1 / 2016, 0.0), (None, 0.0), (1 / 2500, np.nan), (1 / 8000, np.nan)]
)
def test_a_mechanical_shutter_is_not_that_fast(tmp_path: Path, exposure_s: float | None, seconds: float) -> None:
    found = readout_of([_photo(tmp_path / "a.jpg", "M3E", exposure_s)])
    np.testing.assert_equal(found.seconds, seconds)
    assert found.is_known == np.isfinite(seconds)
    # the pilot may have switched the mechanical one off: the model alone is no proof
    np.testing.assert_equal(found.sd_s, 0.02 if found.is_known else np.nan)


def test_the_tele_camera_of_the_same_drone_has_no_mechanical_shutter(tmp_path: Path) -> None:
    wide, tele = (replace(_photo(tmp_path / "a.jpg", "M3E"), focal_mm=focal) for focal in (12.3, 29.9))
    assert readout_of([wide]).seconds == 0 and not readout_of([tele]).is_known


def test_figures_by_size_as_taken(tmp_path: Path) -> None:
    sizes = [(4032, 2268), (4032, 3024), (8064, 4536), (8064, 6048)]
    found = [_of(_photo(tmp_path / "a.jpg", "FC8482", taken=size))[0] for size in sizes]
    assert found == [0.016, 0.021, 0.043, 0.058]
    real = sorted((needs_shared("drone_brighton_beach") / "images").glob("*.JPG"))[:3]
    assert readout_of([read_photo(path) for path in real]) == Readout(
        0.033, 0.2 * 0.033, "OpenDroneMap's table of readout times (FC300S)"
    )


def test_unknown_cameras_and_photos_that_disagree(tmp_path: Path) -> None:
    unknown = [_photo(tmp_path / f"{i}.jpg", "ILCE-7RM4") for i in range(2)]
    found = readout_of(unknown)
    assert not found.is_known and np.isnan(found.sd_s) and found.source == "unknown: no figure for ILCE-7RM4"
    slow, fast = _photo(tmp_path / "slow.jpg", "FC6310"), _photo(tmp_path / "fast.jpg", "FC6310", 1 / 5000)
    mixed = readout_of([slow, slow, fast])
    assert not mixed.is_known and "fast.jpg" in mixed.source and _of(fast)[0] == 0.033
