"""Photos whose own tags cannot be meant: each fault has its sentence, and is corrected where that is certain."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from shared_data import needs_shared
from small_flight import Flight, Listening, lines, write_photos, write_solution

from treedgs_geo.core.errors import GeotagError
from treedgs_geo.geotags import Stations, read_stations

CRS = "EPSG:6346"


def _photos(kind: str, folder: Path) -> Path:
    script = needs_shared("failing") / "photos_exif.py"
    subprocess.run([sys.executable, str(script), kind, str(folder / kind)], check=True, timeout=120)
    return folder / kind


def _read(kind: str, folder: Path, geotags: Path | None = None) -> tuple[Stations, list[str]]:
    listening = Listening()
    found = read_stations(_photos(kind, folder), geotags, CRS, check_photos=False, reporter=listening)
    return found, listening.warnings


def test_good_tags_and_empty_exif_beside_xmp_give_no_word(tmp_path: Path) -> None:
    for kind in ("good", "emptyexif"):
        found, warnings = _read(kind, tmp_path)
        assert found.is_placed.all() and not warnings


def test_all_photos_at_one_place_are_refused_or_take_their_geotags(tmp_path: Path) -> None:
    with pytest.raises(GeotagError, match="none of the 14 photos has a GPS position of its own"):
        _read("sameexif", tmp_path)
    found, warnings = _read("sameexif", tmp_path, needs_shared("failing") / "mrk_photo_deleted")
    assert found.counts() == {"fix": 14} and np.ptp(found.xyz[:, 1]) > 40
    assert any("one and the same GPS position" in text for text in warnings)


def test_the_sign_of_altitudes_is_one_for_all(tmp_path: Path) -> None:
    found, warnings = _read("altref", tmp_path)
    assert np.allclose(found.xyz[:, 2], 10.1) and any("GPSAltitudeRef" in text for text in warnings)


def test_photos_of_another_place_are_left_out_and_named(tmp_path: Path) -> None:
    flight = Flight(lines(28))
    write_photos(flight, tmp_path / "images")
    write_solution(flight, tmp_path / "ppk")
    write_photos(Flight(lines(20) + [0.0, 11000.0, 0.0]), tmp_path / "images" / "old")
    for path in (tmp_path / "images" / "old").iterdir():
        path.write_bytes(path.read_bytes().replace(b"2026:03:12", b"2026:03:11"))
    for geotags in (tmp_path / "ppk", None):
        listening = Listening()
        found = read_stations(tmp_path / "images", geotags, "EPSG:6344", check_photos=False, reporter=listening)
        assert len(found) == 28 and found.is_placed.all()
        assert any("Left out 20 of 48 photos, taken 11 km" in text and "old/" in text for text in listening.warnings)


def test_no_altitude_keeps_the_places_and_says_that_heights_are_unknown(tmp_path: Path) -> None:
    found, warnings = _read("noalt", tmp_path)
    assert found.is_placed.all() and (found.sd[:, 2] >= 30).all() and (found.sd[:, 0] == 2).all()
    assert any("altitude 0" in text for text in warnings)


def test_angles_that_nobody_wrote_are_unknown(tmp_path: Path) -> None:
    found, warnings = _read("gimbal0", tmp_path)
    assert np.isnan(found.pitch_deg).all() and any("gimbal angles 0, 0, 0" in text for text in warnings)


def test_a_gimbal_past_straight_down_is_reported(tmp_path: Path) -> None:
    found, warnings = _read("roll180", tmp_path)
    assert (found.roll_deg == 180).all() and any("gimbal roll near 180" in text for text in warnings)


@pytest.mark.parametrize("kind", ["sameexif", "noalt"])
def test_the_dry_run_says_it_too(kind: str, tmp_path: Path) -> None:
    photos = _photos(kind, tmp_path)
    words = ["photos-to-dbh", "--photos", photos, "--crs", CRS, "--workspace", tmp_path / "w", "--output"]
    done = subprocess.run(
        [sys.executable, "-m", "treedgs_geo", *map(str, words), str(tmp_path / "t.gpkg"), "--dry-run", "true"],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).resolve().parents[2],
        timeout=300,
    )
    expected = {"sameexif": "one and the same GPS position", "noalt": "altitude 0"}[kind]
    assert expected in done.stdout + done.stderr
    assert (done.returncode != 0) == (kind == "sameexif"), done.stdout + done.stderr
