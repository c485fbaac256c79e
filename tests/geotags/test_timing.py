"""An antenna's path whose times are off: found by the positions at the exposures, corrected where it is certain."""

import re
from pathlib import Path

import numpy as np
import pytest
from small_flight import CRS, Flight, Listening, lines, write_photos, write_solution

from treedgs_geo.geotags import Stations, read_stations
from treedgs_geo.geotags.exposures import ROUGH_MIN_S, Shift, along_velocity, find_shift


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


def _navigation(seconds: float, speed_m_s: float, seed: int, sd_m: float = 2.0, lasting: float = 0.0) -> Shift | None:
    """What is found on 10 lines of 10 photos, 2 s apart, the path late by ``seconds``; sd_m, lasting: of the marks, and
    how much of an error is still in the next one."""
    rng = np.random.default_rng(seed)
    camera = lines(100, speed_m_s)[:, :2]
    at = 10.0 + 2.0 * np.arange(100)
    error = rng.normal(0, sd_m, (100, 2))
    for i in range(1, 100):
        error[i] = lasting * error[i - 1] + np.sqrt(1 - lasting**2) * error[i]
    times = np.arange(0.0, 220.0, 0.2)
    path = np.column_stack([np.interp(times, at, axis) for axis in camera.T])
    return find_shift(times + seconds, path, at, camera + error + rng.normal(0, 1.5, 2), ROUGH_MIN_S)


@pytest.mark.parametrize("lasting", [0.0, 0.9])
def test_navigation_that_scatters_or_drifts_says_nothing_of_a_path_in_time(lasting: float) -> None:
    assert not any(_navigation(0.0, 4.0, seed, lasting=lasting) for seed in range(15))


@pytest.mark.parametrize(("seconds", "speed_m_s", "lasting"), [(0.3, 8.0, 0.0), (-0.3, 4.0, 0.9), (0.5, 4.0, 0.0)])
def test_the_mean_of_scattering_navigation_shows_what_no_photo_does(
    seconds: float, speed_m_s: float, lasting: float
) -> None:
    for seed in range(3):
        shift = _navigation(seconds, speed_m_s, seed, lasting=lasting)
        assert shift is not None and abs(shift.seconds - seconds) < 4 * shift.sd_s < 0.4


@pytest.mark.parametrize("sd_m", [2.0, 0.02])
def test_a_straight_line_that_begins_and_ends_at_rest_tells_nothing(sd_m: float) -> None:
    rng = np.random.default_rng(6)
    times, at = np.arange(0.0, 130.0, 0.2), np.arange(3.0, 127.0, 2.0)
    along = np.clip(times - 2.0, 0, 120) * 5.0
    path = np.column_stack([along, 0 * along]) + rng.normal(0, 0.01, (len(times), 2))
    true = np.column_stack([np.clip(at - 2.0, 0, 120) * 5.0, 0 * at])
    for _ in range(6):
        assert find_shift(times, path, at, true + rng.normal(0, sd_m, true.shape), 0.02, 0.01) is None


def test_what_is_less_than_the_path_is_known_to_is_left() -> None:
    times, at = np.arange(0.0, 220.0, 0.2), 10.0 + 2.0 * np.arange(100)
    camera = lines(100)[:, :2]
    path = np.column_stack([np.interp(times, at, axis) for axis in camera.T])
    assert find_shift(times + 0.3, path, at, camera, ROUGH_MIN_S, least_m=0.2) is not None
    assert find_shift(times + 0.3, path, at, camera, ROUGH_MIN_S, least_m=1.5) is None


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
