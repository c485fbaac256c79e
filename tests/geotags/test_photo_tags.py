"""What photos of other makers say about lens and angles, copies of photos, and pictures that are no 8-bit photos."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import rasterio
from PIL import Image
from shared_data import needs_shared
from small_flight import CRS, Flight, Listening, lines, write_photos

from treedgs_geo.cli import main
from treedgs_geo.core.errors import InputError, ReconstructionError
from treedgs_geo.geotags import read_stations
from treedgs_geo.geotags.photos import read_photo, read_photos
from treedgs_geo.reconstruction.calibration import calibration_of
from treedgs_geo.reconstruction.poses import rotation_from_gimbal

_PIX4D = """%Image::ExifTool::UserDefined = ('Image::ExifTool::XMP::Main' => {
  Camera => { SubDirectory => { TagTable => 'Image::ExifTool::UserDefined::Camera' } } });
%Image::ExifTool::UserDefined::Camera = (GROUPS => { 0 => 'XMP', 1 => 'XMP-Camera', 2 => 'Camera' },
  NAMESPACE => { 'Camera' => 'http://pix4d.com/camera/1.0/' }, WRITABLE => 'string',
  Yaw => { Writable => 'real' }, Pitch => { Writable => 'real' }, Roll => { Writable => 'real' },
  PerspectiveFocalLength => { Writable => 'real' }, PrincipalPoint => { }, ModelType => { });
1;
"""


def _photo(path: Path, *tags: str, size: tuple[int, int] = (4000, 3000)) -> Path:
    """A photo tagged by ExifTool itself."""
    if shutil.which("exiftool") is None:
        pytest.skip("ExifTool (Debian package libimage-exiftool-perl) is not installed")
    Image.new("RGB", size, (90, 120, 60)).save(path)
    if tags:
        config = path.parent / "pix4d.config"
        config.write_text(_PIX4D)
        subprocess.run(["exiftool", "-config", str(config), "-q", "-overwrite_original", *tags, str(path)], check=True)
    return path


@pytest.mark.parametrize(
    ("tags", "size", "source", "focal"),
    [
        # 1/2.3 inch sensor of 6.17 mm: 648.3 px/mm
        (
            ("-FocalLength=4.31", "-FocalPlaneXResolution=648.298", "-FocalPlaneResolutionUnit=mm"),
            (4000, 3000),
            "plane",
            2794.2,
        ),
        (
            ("-FocalLength=4.31", "-FocalPlaneXResolution=16466.77", "-FocalPlaneResolutionUnit=inches"),
            (4000, 3000),
            "plane",
            2794.2,
        ),
        (
            ("-FocalLength=4.31", "-FocalPlaneXResolution=6482.98", "-FocalPlaneResolutionUnit=cm"),
            (4000, 3000),
            "plane",
            2794.2,
        ),
        # the unit is written wrong: no sensor is 0.24 mm or 157 mm wide
        (
            ("-FocalLength=4.31", "-FocalPlaneXResolution=648.298", "-FocalPlaneResolutionUnit=inches"),
            (4000, 3000),
            "plane",
            2794.2,
        ),
        # reduced to half after the photo was taken
        (
            (
                "-FocalLength=4.31",
                "-FocalPlaneXResolution=648.298",
                "-FocalPlaneResolutionUnit=mm",
                "-ExifImageWidth=4000",
                "-ExifImageHeight=3000",
            ),
            (2000, 1500),
            "plane",
            1397.1,
        ),
        # both: the 35 mm equivalent goes first, as it did
        (
            (
                "-FocalLength=4.31",
                "-FocalPlaneXResolution=648.298",
                "-FocalPlaneResolutionUnit=mm",
                "-FocalLengthIn35mmFormat=25",
            ),
            (4000, 3000),
            "exif35",
            2889.0,
        ),
        (
            (
                "-XMP-Camera:PerspectiveFocalLength=4.5",
                "-FocalPlaneXResolution=648.298",
                "-FocalPlaneResolutionUnit=mm",
            ),
            (4000, 3000),
            "pix4d",
            2917.3,
        ),
        (
            ("-XMP-Camera:PerspectiveFocalLength=4.5", "-XMP-Camera:PrincipalPoint=3.08,2.31"),
            (4000, 3000),
            "pix4d",
            2922.1,
        ),
        (("-XMP-Camera:PerspectiveFocalLength=8.6", "-Model=FC6310"), (4000, 3000), "pix4d", 2606.1),
        (
            ("-XMP-Camera:PerspectiveFocalLength=4.2", "-FocalLength=4.31", "-FocalLengthIn35mmFormat=25"),
            (4000, 3000),
            "pix4d",
            2815.3,
        ),
        # metres for millimetres: contradicts the 35 mm equivalent
        (
            ("-XMP-Camera:PerspectiveFocalLength=0.0042", "-FocalLength=4.31", "-FocalLengthIn35mmFormat=25"),
            (4000, 3000),
            "exif35",
            2889.0,
        ),
        (
            ("-FocalLength=8.8", "-Model=FC6310", "-FocalPlaneXResolution=100", "-FocalPlaneResolutionUnit=mm"),
            (4000, 3000),
            "sensor",
            2666.7,
        ),
    ],
)
def test_focal_length_of_other_makers(tmp_path: Path, tags, size, source: str, focal: float) -> None:
    found = calibration_of([read_photo(_photo(tmp_path / "a.jpg", *tags, size=size))])
    assert found.source == source and found.focal_px == pytest.approx(focal, rel=2e-3)


def test_an_unknown_focal_length_says_what_is_missing(tmp_path: Path) -> None:
    with pytest.raises(ReconstructionError, match="4.31 mm and nothing about the sensor's size.*exiftool"):
        calibration_of([read_photo(_photo(tmp_path / "a.jpg", "-FocalLength=4.31"))])
    with pytest.raises(ReconstructionError, match="4.31 mm and nothing about the sensor's size"):
        calibration_of([read_photo(_photo(tmp_path / "b.jpg", "-FocalLength=4.31", "-FocalPlaneXResolution=0.001"))])
    with pytest.raises(ReconstructionError, match="as the drone wrote them"):
        calibration_of([read_photo(_photo(tmp_path / "c.jpg"))])


def test_the_dry_run_asks_for_the_focal_length(tmp_path: Path, capsys) -> None:
    write_photos(Flight(lines(12), model="", details={37386: 8.8}), tmp_path / "photos")
    words = [
        "photos-to-dbh",
        "--photos",
        tmp_path / "photos",
        "--crs",
        CRS,
        "--workspace",
        tmp_path / "work",
        "--output",
        tmp_path / "trees.gpkg",
    ]
    for more in (["--dry-run"], []):
        assert main([str(word) for word in [*words, *more]]) == 2
        assert "8.8 mm and nothing about the sensor's size" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("yaw", "pitch", "roll", "same_as"),
    [
        (0, 0, 0, (0, -90, 0)),
        (90, 0, 0, (90, -90, 0)),
        (30, 90, 0, (30, 0, 0)),
        (200, 35, 0, (200, -55, 0)),
        # a nadir camera banked by 10 degrees to the right looks to the left, the top of the photo ahead
        (0, 0, 10, (-90, -80, 90)),
        (0, -45, 0, (180, -45, 180)),
    ],
)
def test_pix4d_angles(tmp_path: Path, yaw: float, pitch: float, roll: float, same_as: tuple) -> None:
    photo = read_photo(
        _photo(
            tmp_path / "a.jpg",
            f"-XMP-Camera:Yaw={yaw}",
            f"-XMP-Camera:Pitch={pitch}",
            f"-XMP-Camera:Roll={roll}",
            size=(200, 150),
        )
    )
    found = rotation_from_gimbal(photo.yaw_deg, photo.pitch_deg, photo.roll_deg)
    np.testing.assert_allclose(found, rotation_from_gimbal(*same_as), atol=1e-6)
    axes = found.T  # columns: right and down of the photo, and where it looks; east, north, up
    if (yaw, pitch, roll) == (90, 0, 0):
        np.testing.assert_allclose(-axes[:, 1], [1, 0, 0], atol=1e-6)  # the top of the photo points east
        np.testing.assert_allclose(axes[:, 2], [0, 0, -1], atol=1e-6)
    if (yaw, pitch, roll) == (0, 0, 10):
        assert axes[0, 2] < -0.17 and abs(axes[1, 2]) < 1e-6 and -axes[1, 1] > 0.99


def test_gimbal_angles_go_before_pix4d_s_and_a_set_is_read_in_one_way(tmp_path: Path) -> None:
    photo = read_photo(
        _photo(
            tmp_path / "a.jpg",
            "-XMP-Camera:Yaw=10",
            "-XMP-Camera:Pitch=5",
            "-XMP-drone-dji:GimbalYawDegree=77",
            "-XMP-drone-dji:GimbalPitchDegree=-60",
            "-XMP-drone-dji:GimbalRollDegree=0",
            size=(200, 150),
        )
    )
    assert (photo.yaw_deg, photo.pitch_deg) == (77, -60)
    # -90 is straight down in DJI's way only, and then -45 is meant so too
    folder = tmp_path / "set"
    folder.mkdir()
    for number, pitch in enumerate((-90, -45, -45)):
        _photo(
            folder / f"{number}.jpg",
            "-XMP-Camera:Yaw=20",
            f"-XMP-Camera:Pitch={pitch}",
            f"-ISO={100 + number}",
            size=(200, 150),
        )
    assert [photo.pitch_deg for photo in read_photos(folder)] == [-90, -45, -45]
    assert read_photo(folder / "1.jpg").yaw_deg == pytest.approx(-160)


def test_real_xmp_packets_read_as_before() -> None:
    photos = sorted((needs_shared("drone_brighton_beach") / "images").glob("*.JPG"))
    found = [read_photo(path) for path in photos]
    assert {round(photo.pitch_deg) for photo in found} == {-90} and all(np.isfinite(p.yaw_deg) for p in found)
    assert all(calibration_of([photo]).source == "sensor" for photo in found)


def _folder(tmp_path: Path, count: int = 6) -> Path:
    return write_photos(Flight(lines(count)), tmp_path / "photos")


def test_a_backup_in_a_sub_folder_is_used_once(tmp_path: Path) -> None:
    folder = _folder(tmp_path)
    alone = read_stations(folder, None, CRS, check_photos=False)
    (folder / "backup").mkdir()
    for path in sorted(folder.glob("*.JPG"))[:4]:
        shutil.copy(path, folder / "backup" / path.name)
    shutil.copy(folder / "DJI_0001.JPG", folder / "DJI_0001 (Kopie).JPG")
    listening = Listening()
    stations = read_stations(folder, None, CRS, check_photos=False, reporter=listening)
    assert stations.names == alone.names
    text = next(text for text in listening.warnings if "copies" in text)
    assert text.startswith("5 of 11 photos are copies") and "used once" in text and " of DJI_0001.JPG" in text


def test_an_edited_export_of_the_same_exposure_is_a_copy_a_second_camera_is_not(tmp_path: Path) -> None:
    folder = _folder(tmp_path)
    for name in ("export", "left"):
        (folder / name).mkdir()
    rng = np.random.default_rng(9)
    for path in sorted(folder.glob("*.JPG")):
        with Image.open(path) as image:
            exif = image.getexif().tobytes()
            brighter = Image.fromarray((np.asarray(image) * 0.7 + 60).astype(np.uint8))
        brighter.save(folder / "export" / f"{path.stem}.tif", exif=exif)
        other = Image.fromarray(rng.integers(0, 255, (300, 400, 3), np.uint8))
        other.save(folder / "left" / path.name, exif=exif)
    names = [photo.name for photo in read_photos(folder)]
    assert sum("/" not in name for name in names) == 6 and sum(name.startswith("left/") for name in names) == 6
    assert not any(name.startswith("export/") for name in names)


def _raster(path: Path, bands: np.ndarray) -> None:
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        width=bands.shape[2],
        height=bands.shape[1],
        count=len(bands),
        dtype=bands.dtype,
        photometric="RGB" if len(bands) == 3 else "MINISBLACK",
    ) as target:
        target.write(bands)


@pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")
def test_pictures_that_are_no_8_bit_photos(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    wide = rng.integers(0, 65535, (1, 60, 80), np.uint16)
    cases = {
        "grey": (wide, "16-bit grey.*8-bit JPEG"),
        "float": (wide.astype(np.float32), "32-bit grey.*8-bit JPEG"),
        "bands": (rng.integers(0, 255, (5, 60, 80), np.uint8), "5 bands of 8 bits.*8-bit JPEG"),
        "dark": (np.repeat(wide // 100, 3, axis=0), "16 bits of which the upper 8 show nothing.*8-bit JPEG"),
    }
    for name, (bands, says) in cases.items():
        folder = tmp_path / name
        folder.mkdir()
        for number in range(3):
            _raster(folder / f"{number}.tif", bands + np.array(number, bands.dtype))
        with pytest.raises(InputError, match=says) as refusal:
            read_stations(folder, None, CRS)
        assert "fly again" not in str(refusal.value) and "from the drone" not in str(refusal.value)
    (tmp_path / "raw").mkdir()
    (tmp_path / "raw" / "a.DNG").write_bytes(b"II*\0")
    with pytest.raises(InputError, match="1 .dng files"):
        read_photos(tmp_path / "raw")


def test_a_16_bit_picture_among_photos_is_named(tmp_path: Path) -> None:
    folder = _folder(tmp_path)
    Image.fromarray(np.random.default_rng(1).integers(0, 65535, (300, 400), np.uint16)).save(folder / "ortho.png")
    listening = Listening()
    assert len(read_photos(folder, listening)) == 6
    assert "ortho.png: holds 16-bit grey values" in listening.warnings[0]
