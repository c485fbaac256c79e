"""An antenna's path whose times are off: found by the positions at the exposures, corrected where it is certain."""

import re
from pathlib import Path

import numpy as np
import pytest
from small_flight import CRS, Flight, Listening, lines, write_photos, write_solution

from treedgs_geo.geotags import Stations, read_stations
from treedgs_geo.geotags.exposures import along_velocity, find_shift


def _later(pos: Path, seconds: float) -> None:
    rows = pos.read_text().splitlines(keepends=True)
    moved = [
        row if row.startswith("%") else re.sub(r"^(\S+ )(\S+)", lambda m: f"{m[1]}{float(m[2]) + seconds:.3f}", row)
        for row in rows
    ]
    pos.write_text("".join(moved))


def _read(folder: Path, flight: Flight, seconds: float, precise: bool = False) -> tuple[Stations, list[str]]:
    write_photos(flight, folder / "images")
    pos = write_solution(flight, folder / "ppk", mark_error=0.0 if precise else 1.0)
    if precise:
        mrk = folder / "ppk" / "flight_Timestamp.MRK"
        mrk.write_text(mrk.read_text().replace("1.0, 1.0, 2.0\t16,Q", "0.012, 0.011, 0.030\t50,Q"))
    _later(pos, seconds)
    listening = Listening()
    found = read_stations(folder / "images", folder / "ppk", CRS, check_photos=False, reporter=listening)
    return found, [text for text in listening.warnings if "its times are" in text]


@pytest.mark.parametrize("seconds", [1.0, -2.0, 18.0, -18.0])
def test_a_late_path_is_put_in_time(tmp_path: Path, seconds: float) -> None:
    flight = Flight(lines(40))
    found, said = _read(tmp_path, flight, seconds)
    assert np.sqrt(np.mean(np.sum((found.xyz - flight.camera)[:, :2] ** 2, axis=1))) < 0.2
    assert len(said) == 1 and f"{abs(seconds):.1f}" in said[0] and ("late" if seconds > 0 else "early") in said[0]


def test_a_twentieth_of_a_second_shows_beside_precise_marks(tmp_path: Path) -> None:
    flight = Flight(lines(40))
    found, said = _read(tmp_path, flight, 0.05, precise=True)
    assert len(said) == 1 and "0.05 s too late" in said[0] and set(found.quality) == {"fix"}
    assert np.sqrt(np.mean(np.sum((found.xyz - flight.camera)[:, :2] ** 2, axis=1))) < 0.06


@pytest.mark.parametrize("precise", [True, False])
def test_a_path_in_time_is_left_as_it_is(tmp_path: Path, precise: bool) -> None:
    found, said = _read(tmp_path, Flight(lines(40)), 0.0, precise)
    assert not said and set(found.quality) == {"fix"}


def test_navigation_that_drifts_is_no_proof_of_a_fifth_of_a_second(tmp_path: Path) -> None:
    flight = Flight(lines(40))
    _, said = _read(tmp_path, flight, 0.2)
    assert not said, "the block will tell"


def test_a_straight_line_at_one_speed_tells_nothing() -> None:
    times = np.arange(0.0, 120.0, 0.2)
    path = np.column_stack([4.0 * times, 0 * times])
    at = np.arange(20.0, 90.0, 2.0)
    assert find_shift(times, path, at, np.column_stack([4.0 * at + 3.0, 0 * at]), 0.02) is None


def test_the_share_along_the_velocity_is_robust() -> None:
    rng = np.random.default_rng(2)
    velocity = np.tile([[5.0, 0, 0], [-5.0, 0, 0], [0, 4.0, 0]], (10, 1))
    away = 0.017 * velocity + [0.05, -0.02, 0.1] + rng.normal(0, 0.01, velocity.shape)
    away[4] += 3.0
    seconds, sd_s, offset = along_velocity(away, velocity)
    assert abs(seconds - 0.017) < 3 * sd_s < 0.003 and np.allclose(offset, [0.05, -0.02, 0.1], atol=0.01)
