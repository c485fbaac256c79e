"""Photos and exposures of which some are missing: by clock, place and number together, never shifted in silence."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from small_flight import CRS, Flight, Listening, lines, write_photos, write_solution

from treedgs_geo.core.errors import GeotagError
from treedgs_geo.geotags import Stations, read_stations


def _renumbered(rows: list[str]) -> str:
    return "".join(f"{number}\t" + row.split("\t", 1)[1] for number, row in enumerate(rows, start=1))


def _without_mark(folder: Path, lost: int) -> None:
    mrk = folder / "flight_Timestamp.MRK"
    rows = mrk.read_text().splitlines(keepends=True)
    mrk.write_text(_renumbered(rows[:lost] + rows[lost + 1 :]))


def _without_photo(images: Path, lost: int) -> None:
    photos = sorted(images.iterdir())
    photos[lost].unlink()
    for number, path in enumerate(photos[:lost] + photos[lost + 1 :], start=1):
        path.rename(images / f"DJI_{number:04d}.JPG")


def _read(flight: Flight, folder: Path) -> tuple[Stations, list[str]]:
    listening = Listening()
    found = read_stations(folder / "images", folder / "ppk", CRS, check_photos=False, reporter=listening)
    return found, listening.warnings


def _written(flight: Flight, folder: Path) -> None:
    write_photos(flight, folder / "images")
    write_solution(flight, folder / "ppk", mark_error=0.0)


def _worst_m(found: Stations, truth: np.ndarray) -> float:
    return float(np.nanmax(np.linalg.norm(found.xyz - truth, axis=1)))


@pytest.mark.parametrize("gps", [True, False])
@pytest.mark.parametrize("lost", [0, 6, 13])
def test_a_mark_is_missing_and_the_others_are_renumbered(tmp_path: Path, lost: int, gps: bool) -> None:
    flight = Flight(lines(14), gps=gps)
    _written(flight, tmp_path)
    _without_mark(tmp_path / "ppk", lost)
    found, warnings = _read(flight, tmp_path)
    assert np.flatnonzero(~found.is_placed).tolist() == [lost]
    assert _worst_m(found, flight.camera) < 0.3
    assert any("no exposure for 1 of 14 photos" in text and found.names[lost] in text for text in warnings)
    assert set(found.flight.tolist()) == {0}, "the photo without an exposure is of the same flight"


@pytest.mark.parametrize("gps", [True, False])
@pytest.mark.parametrize("lost", [0, 6, 13])
def test_a_photo_is_deleted_and_the_others_are_renumbered(tmp_path: Path, lost: int, gps: bool) -> None:
    flight = Flight(lines(14), gps=gps)
    _written(flight, tmp_path)
    _without_photo(tmp_path / "images", lost)
    found, warnings = _read(flight, tmp_path)
    assert found.is_placed.all() and _worst_m(found, np.delete(flight.camera, lost, axis=0)) < 0.3
    assert any(f"exposures have no photo (number {lost + 1})" in text for text in warnings)


def test_one_shot_lost_by_the_receiver_and_another_by_the_card(tmp_path: Path) -> None:
    flight = Flight(lines(30), every_s=1.0)
    _written(flight, tmp_path)
    _without_mark(tmp_path / "ppk", 8)
    _without_photo(tmp_path / "images", 20)
    found, _ = _read(flight, tmp_path)
    assert np.flatnonzero(~found.is_placed).tolist() == [8]
    assert _worst_m(found, np.delete(flight.camera, 20, axis=0)) < 0.3


def test_events_that_lack_a_row(tmp_path: Path) -> None:
    """Two shots within one epoch of the receiver leave one row in the ``_events.pos``."""
    flight = Flight(lines(20))
    _written(flight, tmp_path)
    whole, _ = _read(flight, tmp_path)
    from small_flight import write_pos

    events = tmp_path / "events"
    events.mkdir()
    write_pos(events / "flight_events.pos", np.delete(whole.utc, 11), np.delete(whole.xyz, 11, axis=0))
    shutil.rmtree(tmp_path / "ppk")
    events.rename(tmp_path / "ppk")
    found, _ = _read(flight, tmp_path)
    assert np.flatnonzero(~found.is_placed).tolist() == [11] and _worst_m(found, flight.camera) < 0.3


def test_a_clock_that_was_set_back_in_flight(tmp_path: Path) -> None:
    flight = Flight(lines(28))
    _written(flight, tmp_path)
    for path in sorted((tmp_path / "images").iterdir())[14:]:
        path.write_bytes(path.read_bytes().replace(b"2026:03:12", b"2020:01:01"))
    found, warnings = _read(flight, tmp_path)
    assert found.is_placed.all() and _worst_m(found, flight.camera) < 0.3, "their own positions say which is which"
    assert len(warnings) == 1 and "the clock of 14 of 28 photos is -195436800 s off" in warnings[0], "and it is said"
    assert "DJI_0015.JPG" in warnings[0]


def test_photos_of_another_day_by_the_same_plan_get_no_geotag_of_this_one(tmp_path: Path) -> None:
    flight = Flight(lines(20))
    _written(flight, tmp_path)
    (tmp_path / "images" / "before").mkdir()
    for path in sorted((tmp_path / "images").glob("*.JPG"))[:9]:
        old = (
            path.read_bytes()
            .replace(b"2026:03:12", b"2026:03:11")
            .replace(b'GimbalYawDegree="0', b'GimbalYawDegree="1')
        )
        (tmp_path / "images" / "before" / path.name).write_bytes(old + b"x")
        if path.name in ("DJI_0003.JPG", "DJI_0004.JPG", "DJI_0005.JPG"):
            path.unlink()
    found, warnings = _read(flight, tmp_path)
    old = np.array([name.startswith("before") for name in found.names])
    assert not found.is_placed[old].any() and found.is_placed[~old].all()
    assert any("before/DJI_0001.JPG" in text and "no exposure" in text for text in warnings)


def test_what_nothing_tells_apart_is_refused(tmp_path: Path) -> None:
    """A straight line at even speed, two exposures more than photos, no numbers, no place, a clock that is off."""
    flight = Flight(
        np.column_stack([425000.0 + 4 * np.arange(16), np.full(16, 3718000.0), np.full(16, 120.0)]), gps=False
    )
    _written(flight, tmp_path)
    for path in sorted((tmp_path / "images").iterdir()):
        path.write_bytes(path.read_bytes().replace(b"15:15:", b"15:16:").replace(b"15:17:", b"15:18:"))
        path.rename(path.with_name(f"photo_{chr(97 + int(path.stem[-4:]))}.JPG"))
    for path in [*sorted((tmp_path / "images").iterdir())[:1], *sorted((tmp_path / "images").iterdir())[-1:]]:
        path.unlink()
    with pytest.raises(GeotagError, match="without doubt"):
        _read(flight, tmp_path)
