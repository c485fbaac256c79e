"""A path that jumps, a solution in another place or height: fewer fixed photos and a sentence, never a silent fix."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from shared_data import needs_shared
from small_flight import CRS, Flight, Listening, lines, move_epochs, write_photos, write_solution

from treedgs_geo.core.crs import lonlat_to_project
from treedgs_geo.core.errors import GeotagError
from treedgs_geo.core.frames import suggest_utm
from treedgs_geo.geotags import read_stations, read_stations_layer, write_stations
from treedgs_geo.geotags.rtklib import read_pos
from treedgs_geo.geotags.trajectory import trusted_quality
from treedgs_geo.geotags.velocity import path_offsets


def _read(folder: Path, warnings: list[str] | None = None, geotags: Path | None = None):
    listening = Listening()
    stations = read_stations(folder / "photos", geotags or folder / "ppk", CRS, check_photos=False, reporter=listening)
    if warnings is not None:
        warnings += [text for text in listening.warnings if "names no frame" not in text]
    return stations


def _flight(folder: Path, hz: float = 5.0, **given) -> tuple[Flight, Path]:
    flight = Flight(lines(40), **given)
    write_photos(flight, folder / "photos")
    return flight, write_solution(flight, folder / "ppk", hz)


def test_a_good_flight_stays_as_it_was(tmp_path: Path) -> None:
    flight, _ = _flight(tmp_path)
    warnings: list[str] = []
    stations = _read(tmp_path, warnings)
    assert stations.counts() == {"fix": 40} and not warnings and not any(stations.notes)
    assert np.abs(stations.xyz - flight.camera).max() < 0.1


@pytest.mark.parametrize("shift", [(100.0, 0.0, 0.0), (0.0, 0.0, 100.0), (0.0, -8.0, 0.0), (1.2, 0.0, 0.0)])
def test_a_jump_out_and_back_is_not_fixed(tmp_path: Path, shift: tuple[float, float, float]) -> None:
    flight, pos = _flight(tmp_path, exif_error=np.tile([1.0, -2.0, 27.0], (40, 1)))
    move_epochs(pos, flight.utc[12] - 0.9, flight.utc[15] + 0.9, shift)
    warnings: list[str] = []
    stations = _read(tmp_path, warnings)
    bad = np.zeros(40, bool)
    bad[12:16] = True
    assert not any(stations.quality[i] == "fix" for i in np.flatnonzero(bad))
    assert all(stations.quality[i] == "fix" for i in np.flatnonzero(~bad))
    error = np.linalg.norm(stations.xyz - flight.camera, axis=1)
    # what is wrong by metres says so
    assert (error <= 1.5 * np.linalg.norm(stations.sd, axis=1) + 0.15).all() and error[~bad].max() < 0.15
    assert len(warnings) == 1 and "DJI_0013.JPG" in warnings[0] and "2026-03-12 15:15:34" in warnings[0]
    write_stations(tmp_path / "stations.gpkg", stations)
    again = read_stations_layer(tmp_path / "stations.gpkg")
    assert again.notes == stations.notes and "jumps by" in again.notes[12] and not again.notes[11]


def test_a_step_that_lasts_keeps_the_longer_part(tmp_path: Path) -> None:
    flight, pos = _flight(tmp_path)
    move_epochs(pos, flight.utc[30] - 0.5, flight.utc[-1] + 99, (60.0, 80.0, 0.0))
    warnings: list[str] = []
    stations = _read(tmp_path, warnings)
    assert stations.quality == ["fix"] * 30 + ["exif"] * 10
    assert np.abs(stations.xyz - flight.camera).max() < 0.5 and "their own GPS position" in warnings[0]


@pytest.mark.parametrize("shift", [(12.0, 0.0, 0.0), (40.0, 30.0, 0.0), (0.0, 0.0, 100.0)])
def test_the_longer_part_is_not_believed_against_the_photos(tmp_path: Path, shift: tuple[float, float, float]) -> None:
    rng = np.random.default_rng(8)
    flight, pos = _flight(tmp_path, exif_error=rng.normal([1.0, -1.5, 0.0], [0.3, 0.3, 1.0], (40, 3)))
    move_epochs(pos, flight.utc[13] - 0.9, flight.utc[-1] + 99, shift)
    stations = _read(tmp_path)
    assert stations.quality == ["fix"] * 13 + ["exif"] * 27
    assert np.linalg.norm(stations.xyz - flight.camera, axis=1).max() < 5


def test_a_mrk_without_positions(tmp_path: Path) -> None:
    flight, _ = _flight(tmp_path)
    mrk = tmp_path / "ppk" / "flight_Timestamp.MRK"
    mrk.write_text(re.sub(r"[-\d.]+,Lat\t[-\d.]+,Lon\t[-\d.]+,Ellh", "0.0,Lat\t0.0,Lon\t0.0,Ellh", mrk.read_text()))
    warnings: list[str] = []
    assert _read(tmp_path, warnings).counts() == {"fix": 40} and not warnings


def test_a_jump_without_any_gps_in_the_photos(tmp_path: Path) -> None:
    flight, pos = _flight(tmp_path, gps=False)
    move_epochs(pos, flight.utc[12] - 0.9, flight.utc[13] + 0.9, (30.0, 0.0, 0.0))
    move_epochs(pos, flight.utc[20] - 0.9, flight.utc[21] + 0.9, (0.0, 400.0, 0.0))
    stations = _read(tmp_path)
    assert [stations.quality[i] for i in (12, 13, 20, 21)] == ["single", "single", "none", "none"]
    assert stations.sd[12].min() >= 29 and np.isnan(stations.xyz[20]).all() and stations.counts()["fix"] == 36


def test_a_step_behind_a_gap_is_seen_by_the_photos(tmp_path: Path) -> None:
    """Ten seconds without epochs: physics allows it, the photos' own GPS and the barometer do not."""
    flight, pos = _flight(tmp_path, exif_error=np.tile([2.0, 1.0, 0.0], (40, 1)))
    move_epochs(pos, flight.utc[33] - 0.9, flight.utc[-1] + 99, (0.0, 0.0, 30.0))
    rows = [line for line in pos.read_text().splitlines()]
    gone = [
        k
        for k, line in enumerate(rows)
        if not line.startswith("%")
        and abs(float(line.split()[1]) - float(rows[4].split()[1]) - (flight.utc[33] - flight.utc[0] + 5)) < 5.0
    ]
    pos.write_text("\n".join(line for k, line in enumerate(rows) if k not in set(gone)) + "\n")
    warnings: list[str] = []
    stations = _read(tmp_path, warnings)
    assert stations.quality[36:] == ["single"] * 4 and stations.quality[:27] == ["fix"] * 27
    assert any("not fixed any more" in text for text in warnings)


def test_a_whole_solution_elsewhere(tmp_path: Path) -> None:
    flight, pos = _flight(tmp_path)
    move_epochs(pos, 0, 9e9, (0.0, 0.0, 100.0))
    warnings: list[str] = []
    _read(tmp_path, warnings)
    assert len(warnings) == 1 and "+99 m" in warnings[0] and "MRK" in warnings[0]
    move_epochs(pos, 0, 9e9, (100.0, 0.0, -100.0))
    with pytest.raises(GeotagError, match="100 m .median. from the GPS positions in the photos"):
        _read(tmp_path)


@pytest.mark.parametrize("shift", [(12.0, 0.0, 0.0), (-6.0, 8.0, 0.0), (0.0, 0.0, 14.0), (0.0, 0.0, -14.0)])
@pytest.mark.parametrize("exif", [True, False])
def test_a_base_station_with_a_wrong_place(tmp_path: Path, shift: tuple[float, float, float], exif: bool) -> None:
    _, pos = _flight(tmp_path, gps=exif)
    move_epochs(pos, 0, 9e9, shift)
    warnings: list[str] = []
    assert _read(tmp_path, warnings).counts() == {"fix": 40}, "photos agree with one another"
    # The marks of these flights are 1 m off in each axis.
    east, north, up = np.array(shift) - 1.0
    assert len(warnings) == 1 and "base station" in warnings[0] and "40 of 40 photos" in warnings[0]
    assert f"{east:+.0f} m east, {north:+.0f} m north and {up:+.0f} m up" in warnings[0]


def test_a_wrong_base_station_against_the_photos_own_gps(tmp_path: Path) -> None:
    flight, pos = _flight(tmp_path)
    mrk = tmp_path / "ppk" / "flight_Timestamp.MRK"
    mrk.write_text(re.sub(r"[-\d.]+,Lat\t[-\d.]+,Lon\t[-\d.]+,Ellh", "0.0,Lat\t0.0,Lon\t0.0,Ellh", mrk.read_text()))
    move_epochs(pos, 0, 9e9, (0.0, -12.0, 20.0))
    warnings: list[str] = []
    _read(tmp_path, warnings)
    assert len(warnings) == 1 and "-12 m north" in warnings[0] and "EXIF" in warnings[0]


@pytest.mark.parametrize("shift", [(3.0, -3.0, 5.0), (-2.5, 0.0, -8.0)])
def test_marks_of_a_receiver_without_corrections_are_no_witness_of_metres(
    tmp_path: Path, shift: tuple[float, float, float]
) -> None:
    _, pos = _flight(tmp_path)
    move_epochs(pos, 0, 9e9, shift)
    warnings: list[str] = []
    assert _read(tmp_path, warnings).counts() == {"fix": 40} and not warnings


def test_a_table_in_another_height(tmp_path: Path) -> None:
    flight, _ = _flight(tmp_path)
    rows = "".join(
        f"DJI_{i + 1:04d}.JPG,{x:.3f},{y:.3f},{z + 160:.3f},0.02,0.02,0.03\n"
        for i, (x, y, z) in enumerate(flight.camera)
    )
    (tmp_path / "places.csv").write_text("name,x,y,z,sd_e,sd_n,sd_u\n" + rows)
    warnings: list[str] = []
    _read(tmp_path, warnings, tmp_path / "places.csv")
    assert len(warnings) == 1 and "+160 m" in warnings[0]


def _flown(hz: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Harsh flying: 12 m/s across, 5 m/s up and down, a new course every 12 s with 8 m/s2."""
    times = np.arange(0, 150, 1 / hz)
    velocity = np.zeros((len(times), 3))
    course = np.zeros(3)
    for i in range(1, len(times)):
        if i % int(hz * 12) == 1:
            angle = rng.uniform(0, 2 * np.pi)
            course = np.array([12 * np.cos(angle), 12 * np.sin(angle), rng.uniform(-5, 5)])
        change = course - velocity[i - 1]
        size = np.linalg.norm(change)
        velocity[i] = velocity[i - 1] + (change if size < 8 / hz else change / size * 8 / hz)
    path = np.cumsum(velocity / hz, axis=0) + [425000, 3718000, 100]
    return times, path + rng.normal(0, 1, path.shape) * [0.011, 0.011, 0.027]


@pytest.mark.parametrize("hz", [1.0, 5.0, 10.0, 20.0])
def test_no_alarm_from_harsh_flying_hovering_gaps_and_doubled_epochs(hz: float) -> None:
    rng = np.random.default_rng(5)
    times, path = _flown(hz, rng)
    cases = [(times, path), (times, path[:1] + rng.normal(0, 0.02, path.shape))]
    kept = rng.uniform(size=len(times)) > 0.3
    kept[300:360] = False
    cases.append((times[kept], path[kept]))
    cases.append((np.sort(np.r_[times, times + 0.001]), np.repeat(path, 2, axis=0)))
    for some_times, some_path in cases:
        assert not path_offsets(some_times, some_path, np.ones(len(some_times), bool)).any()


@pytest.mark.parametrize(("hz", "size"), [(1.0, 30.0), (2.0, 8.0), (5.0, 1.5), (10.0, 0.8), (20.0, 0.6)])
def test_jumps_in_harsh_flying_are_found_exactly(hz: float, size: float) -> None:
    times, path = _flown(hz, np.random.default_rng(6))
    for first, last in ((40, 41), (50, 80), (60, 75)):
        for axis in range(3):
            moved = path.copy()
            moved[first:last, axis] += size
            found = (path_offsets(times, moved, np.ones(len(times), bool)) != 0).any(axis=1)
            assert found[first:last].all() and found.sum() == last - first


def test_real_solutions_are_left_alone() -> None:
    """Every real ``.pos`` at hand: a drive through a town, a boat, drones, known points."""
    count = 0
    for name in ("ppk_matrtklib", "ppk_pos_samples", "plot_a", "plot_e", "plot_h"):
        for path in sorted(needs_shared(name).rglob("*.pos")):
            if "Invalid" in path.name:
                continue
            track = read_pos(path)
            crs = suggest_utm(float(np.median(track.lon_deg)), float(np.median(track.lat_deg)))
            xyz = lonlat_to_project(crs, track.lon_deg, track.lat_deg, track.height_m)
            fixed = trusted_quality(track.gps_s, track.quality) == 1
            assert not path_offsets(track.gps_s, xyz, fixed).any(), path.name
            count += int(fixed.sum())
    assert count > 8000
