"""Velocities at the exposures: from the antenna's path, the drone's own word, the photos beside; and never invented."""

import csv
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyproj
import pytest
from shared_data import needs_shared

from treedgs_geo.core.crs import grid_convergence_deg, lonlat_to_project
from treedgs_geo.geotags import read_stations, read_stations_layer, write_stations
from treedgs_geo.geotags.gpstime import week_tow_to_gps
from treedgs_geo.geotags.photos import Photo
from treedgs_geo.geotags.rtklib import read_pos
from treedgs_geo.geotags.stations import Stations
from treedgs_geo.geotags.trajectory import interpolate
from treedgs_geo.geotags.velocity import path_velocities, turned_to_grid, with_velocities

UTM53 = pyproj.CRS.from_epsg(32653)
NOTHING = np.full((7, 3), np.nan)


def _stations(utc: np.ndarray, xyz: np.ndarray, sd: float = 0.02, crs: pyproj.CRS = UTM53) -> Stations:
    count = len(utc)
    nan = np.full(count, np.nan)
    names = [f"{i}.jpg" for i in range(count)]
    paths = [Path(name) for name in names]
    sds = np.full((count, 3), sd)
    return Stations(names, paths, xyz, sds, ["fix"] * count, utc, np.zeros(count, int), nan, nan, nan, nan, crs)


def _photo(name: str = "a.jpg", **dji: str) -> Photo:
    nan = float("nan")
    return Photo(
        name,
        Path(name),
        10,
        10,
        "",
        -1,
        nan,
        nan,
        136.88,
        35.16,
        40.0,
        nan,
        NOTHING[0],
        nan,
        nan,
        nan,
        nan,
        nan,
        nan,
        dji,
    )


def _flown(utc: np.ndarray) -> np.ndarray:
    return np.array([5e5, 3.89e6, 100.0]) + (utc - utc[0])[:, None] * [3.0, -4.0, 0.2]


def test_against_a_reference_trajectory() -> None:
    folder = needs_shared("ppk_matrtklib") / "kinematic"
    with open(folder / "reference.csv", newline="") as stream:
        reference = np.array([[float(value) for value in row] for row in list(csv.reader(stream))[1:]])
    times = week_tow_to_gps(reference[:, 1], reference[:, 0])
    convergence = grid_convergence_deg(UTM53, 136.88, 35.16)
    true = turned_to_grid(reference[:, [11, 12, 13]], convergence)
    asked = np.arange(times[0] + 0.05, times[-1], 0.31)
    wanted = np.column_stack([np.interp(asked, times, axis) for axis in true.T])

    def found(name: str, columns: bool = True) -> tuple[np.ndarray, np.ndarray]:
        track = read_pos(folder / name)
        xyz = lonlat_to_project(UTM53, track.lon_deg, track.lat_deg, track.height_m)
        own = turned_to_grid(track.velocity_enu, convergence) if columns else None
        solved = interpolate(track, xyz, asked, own=own)
        return solved.velocity, np.array(solved.quality) == "fix"

    dense, fixed = found("rover_rtk.pos")
    assert np.isfinite(dense[fixed]).all() and np.sqrt(np.mean((dense - wanted)[fixed] ** 2)) < 0.02
    # One epoch a second and less is too few for a slope; the columns vn, ve, vu are then all there is.
    assert np.isnan(found("rover_1Hz_rtk.pos", columns=False)[0]).all()
    sparse, fixed = found("rover_1Hz_rtk.pos")
    assert np.sqrt(np.mean((sparse - wanted)[fixed] ** 2)) < 0.08 and fixed.sum() > 100


def test_steps_between_qualities_and_wandering_paths() -> None:
    times = np.arange(0.0, 4.0, 0.2)
    path = np.column_stack([3 * times, -times + 0.5 * times**2, 0 * times])
    quality, segment = np.where(times > 1.9, 2, 1), np.zeros(len(times), int)
    stepped = path + np.where(times > 1.9, 0.4, 0.0)[:, None]
    at = np.array([0.9, 1.8, 2.0, 2.9])
    true = np.column_stack([0 * at + 3, at - 1, 0 * at])
    np.testing.assert_allclose(path_velocities(times, stepped, quality, segment, at), true, atol=1e-6)
    # the same step inside one quality is no velocity, nor is what single-point epochs do
    assert np.isnan(path_velocities(times, stepped, np.ones_like(quality), segment, at)[1:3]).all()
    assert np.isnan(path_velocities(times, path, np.full_like(quality, 5), segment, at)).all()
    # the other side of a cut does not count
    cut = path_velocities(times, stepped, np.ones_like(quality), (times > 1.9).astype(int), at)
    np.testing.assert_allclose(cut, true, atol=1e-6)


@pytest.mark.parametrize(("plot", "usual"), [("plot_h", 4.0), ("plot_a", 4.8)])
def test_rendered_flights_have_the_track_s_velocity(plot: str, usual: float, tmp_path: Path) -> None:
    folder = needs_shared(plot)
    stations = read_stations(folder / "images", folder, "EPSG:6344", check_photos=False)
    assert Counter(stations.velocity_source) == {"track": len(stations)}
    assert abs(np.median(np.linalg.norm(stations.velocity_m_s, axis=1)) - usual) < 0.3
    write_stations(tmp_path / "stations.gpkg", stations)
    again = read_stations_layer(tmp_path / "stations.gpkg")
    np.testing.assert_allclose(again.velocity_m_s, stations.velocity_m_s, atol=1e-9)
    assert again.velocity_source == stations.velocity_source and again.digest() == stations.digest()
    assert replace(again, velocity_m_s=again.velocity_m_s + 1).digest() != again.digest()
    # photos 2 s apart of a drone that turns in between do not tell its velocity, navigation-grade ones never
    raw = read_stations(folder / "images", None, "EPSG:6344", check_photos=False)
    assert set(raw.velocity_source) == {"unknown"} and np.isnan(raw.velocity_m_s).all()


def test_the_drones_own_word_is_north_east_down() -> None:
    utc = 1.7e9 + 5.3 * np.arange(7)
    photos = [_photo(FlightXSpeed="+3.00", FlightYSpeed="-4.00", FlightZSpeed="-0.50")] * 7
    found = with_velocities(_stations(utc, _flown(utc)), photos, NOTHING)
    angle = np.radians(grid_convergence_deg(UTM53, 136.88, 35.16))
    true = [-4 * np.cos(angle) - 3 * np.sin(angle), 3 * np.cos(angle) - 4 * np.sin(angle), 0.5]
    np.testing.assert_allclose(found.velocity_m_s, [true] * 7, atol=1e-9)
    assert set(found.velocity_source) == {"xmp"} and angle > 0.01
    # the path is better known
    along = NOTHING.copy()
    along[2] = [1.0, 2.0, 3.0]
    both = with_velocities(_stations(utc, _flown(utc)), photos, along)
    assert both.velocity_source == ["xmp"] * 2 + ["track"] + ["xmp"] * 4 and both.velocity_m_s[2].tolist() == [1, 2, 3]
    lost = _stations(utc, _flown(utc))
    lost.xyz[2] = np.nan  # its geotag was refused: so is what the same path says of its velocity
    assert with_velocities(lost, photos, along).velocity_source[2] == "xmp"


def test_what_a_drone_did_not_write() -> None:
    utc = 1.7e9 + 5.3 * np.arange(7)
    zeros = [_photo(FlightXSpeed="+0.00", FlightYSpeed="+0.00", FlightZSpeed="+0.00")] * 7
    broken = [_photo(FlightXSpeed="fast", FlightYSpeed="+0.00", FlightZSpeed="+0.00")] * 7
    wild = [_photo(FlightXSpeed="700", FlightYSpeed="+0.00", FlightZSpeed="+0.00")] * 7
    for photos in (zeros, broken, wild, [_photo()] * 7):
        assert with_velocities(_stations(utc, _flown(utc)), photos, NOTHING).velocity_source == ["unknown"] * 7


def test_photos_close_together_on_a_straight_line() -> None:
    photos = [_photo()] * 7
    utc = 1.7e9 + 0.13 + 1.9 * np.arange(7)
    found = with_velocities(_stations(utc, _flown(utc)), photos, NOTHING)
    assert found.velocity_source == ["unknown"] * 2 + ["photos"] * 3 + ["unknown"] * 2
    np.testing.assert_allclose(found.velocity_m_s[2:5], [[3.0, -4.0, 0.2]] * 3, atol=1e-6)
    turned = _flown(utc)
    turned[5:] = turned[4]
    unsure = (
        _stations(1.7e9 + 0.13 + 3.1 * np.arange(7), _flown(utc)),  # it may have stopped in between
        _stations(np.round(utc), _flown(utc)),  # whole seconds
        _stations(utc, _flown(utc), sd=1.0),
    )
    for stations in unsure:
        assert with_velocities(stations, photos, NOTHING).velocity_source == ["unknown"] * 7
    assert with_velocities(_stations(utc, turned), photos, NOTHING).velocity_source.count("photos") == 1


def test_stations_made_by_hand_and_layers_without_velocities(tmp_path: Path) -> None:
    utc = 1.7e9 + np.arange(3.0)
    stations = _stations(utc, _flown(utc))
    assert stations.velocity_m_s.shape == (3, 3) and np.isnan(stations.velocity_m_s).all()
    write_stations(tmp_path / "a.gpkg", stations)
    import geopandas

    frame = geopandas.read_file(tmp_path / "a.gpkg", layer="stations")
    frame.drop(columns=["v_e_m_s", "v_n_m_s", "v_u_m_s", "v_source"]).to_file(
        tmp_path / "b.gpkg", layer="stations", driver="GPKG"
    )
    for name in ("a.gpkg", "b.gpkg"):
        assert np.isnan(read_stations_layer(tmp_path / name).velocity_m_s).all()
    assert read_stations_layer(tmp_path / "b.gpkg").velocity_source == []
