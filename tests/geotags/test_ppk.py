"""RINEX to trajectory with RTKLIB itself, every layout that RTKLIB writes, and frames that do not match."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pyproj
import pytest
from shared_data import needs_shared

from treedgs_geo.core.crs import lonlat_to_project
from treedgs_geo.core.errors import CRSError, GeotagError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags import read_stations
from treedgs_geo.geotags.ppk import read_rinex_header, solve
from treedgs_geo.geotags.rtklib import read_pos
from treedgs_geo.geotags.sources import find_geotags
from treedgs_geo.geotags.trajectory import interpolate

UTM53 = pyproj.CRS.from_epsg(32653)


class Listening(Reporter):
    def __init__(self) -> None:
        super().__init__()
        self.warnings: list[str] = []

    def warn(self, message: str) -> None:
        self.warnings.append(message)


def _truth(folder: Path, name: str) -> np.ndarray:
    return np.array([float(v) for v in (folder / f"{name}_position.txt").read_text().replace(",", " ").split()[:3]])


@pytest.fixture(scope="module")
def rinex() -> Path:
    if shutil.which("rnx2rtkp") is None:
        pytest.skip("rnx2rtkp (Debian package rtklib) is not installed")
    return needs_shared("ppk_matrtklib") / "static"


def _base_text(folder: Path) -> str:
    text = (folder / "base_position.txt").read_text()
    # latitude and longitude run into the height without a blank in this file
    return "35.134707705, 136.977577939, 104.85" if text.startswith("35.134707705") else text


def test_rinex_of_a_known_point(rinex: Path, tmp_path: Path) -> None:
    files = [rinex / "rover.obs", rinex / "base.obs", rinex / "base.nav"]
    listening = Listening()
    track = read_pos(solve(files, None, _base_text(rinex), tmp_path, listening))
    assert len(track.gps_s) == 301 and (track.quality == 1).mean() > 0.9 and not listening.warnings
    true = lonlat_to_project(UTM53, [136.97757549], [35.13469901], [104.8626])[0]
    error = lonlat_to_project(UTM53, track.lon_deg, track.lat_deg, track.height_m) - true
    rms = np.sqrt(np.mean(error**2, axis=0))
    assert rms[0] < 0.01 and rms[1] < 0.01 and rms[2] < 0.02
    # the header's approximate base position is metres off, and that is said
    shifted = read_pos(solve(files, None, None, tmp_path, listening))
    away = lonlat_to_project(UTM53, shifted.lon_deg, shifted.lat_deg, shifted.height_m) - true
    assert "--base-position" in listening.warnings[0] and np.linalg.norm(away.mean(axis=0)) > 0.1


def test_rinex_is_distinguished_from_other_files(rinex: Path, tmp_path: Path) -> None:
    assert read_rinex_header(rinex / "rover.obs").kind == "observation"
    assert read_rinex_header(rinex / "base.nav").kind == "navigation"
    assert read_rinex_header(rinex / "rover_rtk.pos") is None
    for name in ("rover.obs", "base.obs", "base.nav"):
        shutil.copy(rinex / name, tmp_path)
    assert len(find_geotags(tmp_path, tmp_path).rinex) == 3
    (tmp_path / "x.24d").write_text(f"{'1.0':<20}{'COMPACT RINEX FORMAT':<40}{'CRINEX VERS   / TYPE':<20}\n")
    with pytest.raises(GeotagError, match="crx2rnx"):
        find_geotags(tmp_path, tmp_path)


@pytest.mark.parametrize(
    ("names", "base", "position", "says"),
    [
        (("rover.obs",), None, None, "--base"),
        (("rover.obs", "base.obs"), None, "35.1, 136.9, 104", "navigation"),
        (("rover.obs", "base.obs", "base.nav"), None, "35.1, 136.9", "--base-position"),
        (("rover.obs", "base.obs", "base.nav"), None, "135.1, 136.9, 3", "--base-position"),
        (("rover.obs", "base.obs", "base.nav"), "base.nav", None, "no RINEX observation"),
    ],
)
def test_rinex_refusals(rinex: Path, tmp_path: Path, names, base, position, says) -> None:
    for name in names:
        shutil.copy(rinex / name, tmp_path)
    with pytest.raises(GeotagError, match=says):
        solve([tmp_path / n for n in names], tmp_path / base if base else None, position, tmp_path, Listening())


def test_every_layout_that_rtklib_writes_means_the_same(rinex: Path, tmp_path: Path) -> None:
    """lat/lon/height in degrees and d'm's, ECEF and baselines; week + seconds, dates, UTC; other separators."""
    command = [
        "rnx2rtkp",
        "-p",
        "2",
        "-m",
        "15",
        "-f",
        "2",
        "-te",
        "2024/6/24",
        "8:21:00",
        "-l",
        "35.134707705",
        "136.977577939",
        "104.85",
    ]
    tracks = {}
    for name, options in {
        "plain": [],
        "dms": ["-g"],
        "ecef": ["-e"],
        "enu": ["-a"],
        "date": ["-t"],
        "utc": ["-u", "-t"],
        "comma": ["-s", ","],
        "semicolon": ["-s", ";", "-t"],
    }.items():
        out = tmp_path / f"{name}.pos"
        subprocess.run(
            [
                *command,
                *options,
                "-o",
                str(out),
                str(rinex / "rover.obs"),
                str(rinex / "base.obs"),
                str(rinex / "base.nav"),
            ],
            check=True,
            capture_output=True,
        )
        tracks[name] = read_pos(out)
    first = tracks["plain"]
    assert len(first.gps_s) == 61
    there = lonlat_to_project(UTM53, first.lon_deg, first.lat_deg, first.height_m)
    for name, track in tracks.items():
        np.testing.assert_allclose(track.gps_s, first.gps_s, atol=1e-3, err_msg=name)
        same = lonlat_to_project(UTM53, track.lon_deg, track.lat_deg, track.height_m)
        # RTKLIB prints 1e-9 degrees, 1e-4 m and, in d'm's, 1e-5 seconds
        np.testing.assert_allclose(same, there, atol=5e-4, err_msg=name)
        assert (track.quality == first.quality).all()
        np.testing.assert_allclose(track.sd, first.sd, atol=3e-4, err_msg=name)


def _pos(path: Path, header: str, rows: str = "") -> Path:
    rows = rows or (
        "2026/03/12 15:15:14.200   33.599840069  -91.800149874   108.2814   1  16   0.0110   0.0105   0.0270\n"
        "2026/03/12 15:15:14.400   33.599844264  -91.800148401   108.2887   1  14   0.0110   0.0105   0.0270\n"
    )
    columns = "%  GPST  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)\n"
    path.write_text(header + columns + rows)
    return path


def test_geodetic_heights_and_lonely_baselines_are_refused(tmp_path: Path) -> None:
    with pytest.raises(GeotagError, match="ellipsoidal"):
        read_pos(_pos(tmp_path / "a.pos", "% (lat/lon/height=WGS84/geodetic,Q=1:fix,2:float)\n"))
    (tmp_path / "b.pos").write_text(
        "%  GPST  e-baseline(m)  n-baseline(m)  u-baseline(m)   Q  ns\n2026/03/12 15:15:14 1 2 3 1 9\n"
    )
    with pytest.raises(GeotagError, match="ref pos"):
        read_pos(tmp_path / "b.pos")


def _as_frame(folder: Path, tmp_path: Path, label: str) -> Path:
    for path in folder.glob("*.MRK"):
        shutil.copy(path, tmp_path)
    text = (folder / "plot_a_ppk.pos").read_text()
    (tmp_path / "flight.pos").write_text(text.replace("NAD83(2011) epoch 2010.0", label).replace("NAD83(2011)", label))
    return tmp_path


def test_a_frame_other_than_the_project_s_is_refused_or_transformed(tmp_path: Path) -> None:
    folder = needs_shared("plot_a")
    plain = read_stations(folder / "images", folder, "EPSG:6344", check_photos=False)
    other = _as_frame(folder, tmp_path, "ITRF2014")
    with pytest.raises(CRSError, match="--geotags-crs EPSG:7912"):
        read_stations(folder / "images", other, "EPSG:6344", check_photos=False)
    moved = read_stations(folder / "images", other, "EPSG:6344", check_photos=False, frame="EPSG:7912")
    shift = (moved.xyz - plain.xyz)[plain.is_placed]
    assert 1.0 < np.linalg.norm(shift[0, :2]) < 1.6 and np.ptp(shift, axis=0).max() < 0.002
    with pytest.raises(CRSError, match="not geographic"):
        read_stations(folder / "images", other, "EPSG:6344", check_photos=False, frame="EPSG:32615")


def test_wgs84_as_a_label_is_reported(tmp_path: Path) -> None:
    folder = needs_shared("plot_a")
    listening = Listening()
    read_stations(
        folder / "images", _as_frame(folder, tmp_path, "WGS84"), "EPSG:6344", check_photos=False, reporter=listening
    )
    assert len(listening.warnings) == 1 and "m off" in listening.warnings[0]
    with pytest.raises(CRSError, match="2 m only"):
        read_stations(folder / "images", tmp_path, "EPSG:6344", check_photos=False, frame="EPSG:4979")
    quiet = Listening()
    read_stations(folder / "images", tmp_path, "EPSG:6344", check_photos=False, frame="EPSG:6319", reporter=quiet)
    assert not quiet.warnings


def test_orthometric_project_heights_need_the_geoid(tmp_path: Path) -> None:
    folder = needs_shared("plot_a")
    with pytest.raises(CRSError, match="us_noaa_g2018u0"):
        read_stations(folder / "images", folder, "EPSG:6344+5703", check_photos=False)
    with pytest.raises(CRSError, match="heights of .* are in US survey foot"):
        read_stations(folder / "images", folder, "EPSG:6344+6360", check_photos=False)


def test_stations_on_a_geoid_where_its_grid_is_installed(tmp_path: Path) -> None:
    if not Path("/usr/share/proj/egm96_15.gtx").exists():
        pytest.skip("the EGM96 grid (Debian package proj-data) is not installed")
    folder = _as_frame(needs_shared("plot_a"), tmp_path, "WGS84")
    photos = needs_shared("plot_a") / "images"
    ellipsoidal = read_stations(photos, folder, "EPSG:32615", check_photos=False)
    above_geoid = read_stations(photos, folder, "EPSG:32615+5773", check_photos=False)
    # EGM96 lies 27 m below the ellipsoid in southern Arkansas
    difference = (above_geoid.xyz - ellipsoidal.xyz)[ellipsoidal.is_placed]
    np.testing.assert_allclose(difference[:, 2], 27.06, atol=0.1)
    np.testing.assert_allclose(difference[:, :2], 0, atol=1e-6)


@pytest.mark.parametrize("name", ["rover_rtk.pos", "rover_1Hz_rtk.pos"])
def test_a_real_drive_through_a_town(name: str) -> None:
    """Antenna between the epochs against a reference trajectory: what is called fixed is within two decimetres.

    RTKLIB calls wrong what it fixed for a moment only; a tenth of its fixes on this drive are such. The 5 Hz solution
    served to choose how long a fix has to be held, the 1 Hz one did not.
    """
    folder = needs_shared("ppk_matrtklib") / "kinematic"
    track = read_pos(folder / name)
    reference = np.genfromtxt(folder / "reference.csv", delimiter=",", skip_header=1)
    truth = lonlat_to_project(UTM53, reference[:, 3], reference[:, 2], reference[:, 4])
    # every third reference instant, half of which fall between 1 Hz epochs
    asked = reference[::3, 0] + 2270 * 604800
    found = interpolate(track, lonlat_to_project(UTM53, track.lon_deg, track.lat_deg, track.height_m), asked)
    error = found.xyz - truth[::3]
    fixed = np.array([quality == "fix" for quality in found.quality])
    assert fixed.sum() > 80
    # the antenna and the reference point are a few centimetres apart in this set
    horizontal = np.linalg.norm((error - np.median(error[fixed], axis=0))[fixed, :2], axis=1)
    assert np.sqrt(np.mean(horizontal**2)) < 0.10 and np.mean(horizontal > 0.2) < 0.01
    plain = np.isin(np.searchsorted(track.gps_s, asked), np.flatnonzero(track.quality == 1))
    wrong = np.linalg.norm((error - np.median(error[fixed], axis=0))[:, :2], axis=1) > 0.2
    assert (wrong & plain).sum() > 5 * (wrong & fixed).sum()
