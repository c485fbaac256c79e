"""From photos and geotags to stations: interpolation, lever arm, pairing, refusals, the layer."""

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from shared_data import needs_shared

from treedgs_geo.core.errors import CRSError, GeotagError, InputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags import read_stations, read_stations_layer, write_stations
from treedgs_geo.geotags.datum import place_of
from treedgs_geo.geotags.rtklib import Trajectory
from treedgs_geo.geotags.sharpness import find_defects
from treedgs_geo.geotags.sources import GeotagFiles, find_geotags
from treedgs_geo.geotags.trajectory import interpolate


class Listening(Reporter):
    """Keeps the warnings."""

    def __init__(self) -> None:
        super().__init__()
        self.warnings: list[str] = []

    def warn(self, message: str) -> None:
        self.warnings.append(message)


def _track(times: np.ndarray, quality: np.ndarray | None = None) -> Trajectory:
    count = len(times)
    return Trajectory(
        Path("a.pos"),
        times,
        np.zeros(count),
        np.zeros(count),
        np.zeros(count),
        np.ones(count, int) if quality is None else quality,
        np.full((count, 3), 0.01),
    )


def test_interpolation_follows_a_braking_drone() -> None:
    times = np.arange(0, 10, 0.2)
    path = np.column_stack([7 * times - times**2 / 2, 0.5 * times**2, 50 + 0 * times])
    wanted = np.arange(1.1, 8.0, 0.37)
    found = interpolate(_track(times), path, wanted)
    truth = np.column_stack([7 * wanted - wanted**2 / 2, 0.5 * wanted**2, 50 + 0 * wanted])
    assert np.abs(found.xyz - truth)[:, 0].max() < 0.002
    assert set(found.quality) == {"fix"}


def test_gaps_floats_and_the_outside() -> None:
    times = np.r_[np.arange(-6, 0.3, 0.2), 0.4, np.arange(3.4, 9.5, 0.2), np.arange(100, 106.1, 0.2), 150.0, 150.2]
    quality = np.where(np.abs(times - 0.4) < 0.01, 2, 1)
    path = np.column_stack([times, times, times])
    asked = np.array([-7.0, 0.1, 0.3, 2.0, 3.5, 50.0, 100.1, 150.1, 151.0])
    found = interpolate(_track(times, quality), path, asked)
    # the last fix was held for a moment only: it is not believed
    assert found.quality.tolist() == ["none", "fix", "float", "float", "fix", "none", "fix", "float", "none"]
    assert np.isnan(found.xyz[[0, 5, 8]]).all() and (found.sd[2] >= 0.2).all()
    assert found.sd[3].max() > found.sd[2].max(), "a gap costs more than a float epoch"
    np.testing.assert_allclose(found.xyz[[1, 4, 6], 0], asked[[1, 4, 6]], atol=1e-6)


@pytest.mark.parametrize("plot", ["plot_a", "plot_e"])
def test_camera_centres_against_truth(plot: str) -> None:
    folder = needs_shared(plot)
    stations = read_stations(folder / "images", folder, "EPSG:6344", check_photos=False)
    with open(folder / "truth" / "cameras.csv", newline="") as stream:
        truth = {row["image"]: row for row in csv.DictReader(stream)}
    true = np.array([[float(truth[name][key]) for key in "ENh"] for name in stations.names])
    fixed = np.array([quality == "fix" for quality in stations.quality])
    rms = np.sqrt(np.mean((stations.xyz - true)[fixed] ** 2, axis=0))
    assert rms[0] < 0.03 and rms[1] < 0.03 and rms[2] < 0.05
    spoilt = np.array([truth[name]["ppk_float"] == "1" for name in stations.names])
    assert not (spoilt & fixed).any(), "every float epoch is flagged"
    assert stations.flight.max() == 1
    raw = read_stations(folder / "images", None, "EPSG:6344", check_photos=False)
    assert np.sqrt(np.mean((raw.xyz - true)[:, :2] ** 2)) > 0.5 and set(raw.quality) == {"exif"}


def test_missing_first_photo_and_extra_mark(tmp_path: Path) -> None:
    folder = needs_shared("plot_a")
    whole = read_stations(folder / "images", folder, "EPSG:6344", check_photos=False)
    for path in sorted((folder / "images").iterdir())[2:20]:
        shutil.copy(path, tmp_path / path.name)
    part = read_stations(tmp_path, folder, "EPSG:6344", check_photos=False)
    np.testing.assert_allclose(part.xyz, whole.xyz[2:20])


def test_renamed_photos_pair_by_time(tmp_path: Path) -> None:
    folder = needs_shared("plot_a")
    whole = read_stations(folder / "images", folder, "EPSG:6344", check_photos=False)
    for number, path in enumerate(sorted((folder / "images").iterdir())[5:17]):
        shutil.copy(path, tmp_path / f"photo_{chr(97 + number)}.JPG")
    part = read_stations(tmp_path, folder, "EPSG:6344", check_photos=False)
    np.testing.assert_allclose(part.xyz, whole.xyz[5:17])


def test_without_a_crs_the_usual_one_is_taken_and_named() -> None:
    class Ears(Reporter):
        said = ""

        def info(self, message):
            self.said += message

    ears, folder = Ears(), needs_shared("plot_e")
    stations = read_stations(folder / "images", folder, None, check_photos=False, reporter=ears)
    assert stations.crs.to_epsg() == 6344 and "Project CRS: EPSG:6344, NAD83(2011) / UTM zone 15N" in ears.said


def test_the_usual_crs_by_the_geotags_where_photos_have_no_position(tmp_path: Path) -> None:
    folder = needs_shared("plot_e")
    for path in sorted((folder / "images").iterdir())[:4]:
        photo = Image.open(path)
        exif = photo.getexif()
        exif.pop(0x8825)
        photo.resize((64, 48)).save(tmp_path / path.name, exif=exif)
    with pytest.raises(CRSError, match="neither its photos nor the geotags say a longitude and latitude"):
        read_stations(tmp_path, None, None, check_photos=False)
    stations = read_stations(tmp_path, folder, None, check_photos=False)
    assert stations.crs.to_epsg() == 6344 and stations.is_placed.all()
    files = find_geotags(folder, tmp_path)
    for kept in (GeotagFiles(mrk=files.mrk), GeotagFiles(pos=files.pos)):
        assert place_of(kept)[0] == pytest.approx((-91.8, 33.6), abs=0.3)
    rover = find_geotags(needs_shared("ppk_matrtklib") / "static", tmp_path)
    assert len(rover.rinex) == 3 and place_of(GeotagFiles(rinex=rover.rinex))[0] is not None


def test_refusals(tmp_path: Path) -> None:
    folder, other = needs_shared("plot_a"), needs_shared("plot_e")
    with pytest.raises(GeotagError, match="belong to other photos"):
        read_stations(folder / "images", other, "EPSG:6344", check_photos=False)
    with pytest.raises(CRSError, match="EPSG:32615"):
        read_stations(folder / "images", folder, "EPSG:4326", check_photos=False)
    with pytest.raises(CRSError, match="made for"):
        read_stations(folder / "images", folder, "EPSG:32633", check_photos=False)
    (tmp_path / "empty").mkdir()
    (tmp_path / "empty" / "._DJI_0001.JPG").write_bytes(b"\0\5\x16\7")  # what a Mac leaves on a card, no photo
    with pytest.raises(InputError, match="holds no photos"):
        read_stations(tmp_path / "empty", None, "EPSG:6344")
    with pytest.raises(GeotagError, match="holds no geotags"):
        read_stations(folder / "images", tmp_path / "empty", "EPSG:6344", check_photos=False)
    from PIL import Image

    rng = np.random.default_rng(0)
    Image.fromarray(rng.integers(0, 255, (300, 400, 3), np.uint8)).save(tmp_path / "a.jpg")
    with pytest.raises(GeotagError, match="none of the 1 photos has a GPS position"):
        read_stations(tmp_path, None, "EPSG:6344")


def test_two_solutions_are_not_guessed_between(tmp_path: Path) -> None:
    folder = needs_shared("plot_a")
    for path in folder.glob("*.MRK"):
        shutil.copy(path, tmp_path)
    for name in ("one.pos", "two.pos"):
        shutil.copy(folder / "plot_a_ppk.pos", tmp_path / name)
    with pytest.raises(GeotagError, match="one.pos, two.pos"):
        read_stations(folder / "images", tmp_path, "EPSG:6344", check_photos=False)


def test_bad_frames_are_left_out() -> None:
    found = find_defects(sorted(needs_shared("drone_agung_badframes").glob("*.JPG")))
    reasons = {path.name[24:]: reason for path, reason in found.items()}
    assert "blurred" in reasons["D_POOR_SHARPNESS.JPG"] and "lens cap" in reasons["D_LENS_CAP.JPG"]
    good = sorted((needs_shared("drone_brighton_beach") / "images").glob("*.JPG"))[:4]
    assert not find_defects(good)


def test_layer_round_trip(tmp_path: Path) -> None:
    folder = needs_shared("plot_a")
    listening = Listening()
    stations = read_stations(folder / "images", folder, "EPSG:6344", check_photos=False, reporter=listening)
    assert not listening.warnings
    write_stations(tmp_path / "stations.gpkg", stations)
    again = read_stations_layer(tmp_path / "stations.gpkg")
    np.testing.assert_array_equal(again.xyz, stations.xyz)
    np.testing.assert_array_equal(again.sd, stations.sd)
    assert again.names == stations.names and again.quality == stations.quality and again.crs == stations.crs
    with pytest.raises(InputError, match="stations"):
        read_stations_layer(tmp_path / "missing.gpkg")


def _split_flights(folder: Path, tmp_path: Path, own_folders: bool) -> Path:
    """plot_a's two flights as a drone writes them: a MRK each, both counting from 1; photos numbered from 1 too."""
    lines = next(folder.glob("*.MRK")).read_text().splitlines(keepends=True)
    photos = sorted((folder / "images").iterdir())
    times = [float(line.split()[1]) for line in lines]
    cut = int(np.argmax(np.diff(times))) + 1
    for flight, part in enumerate((range(cut), range(cut, len(lines)))):
        place = tmp_path / f"DJI_2026_{flight + 1:03d}" if own_folders else tmp_path
        place.mkdir(exist_ok=True)
        text = "".join(f"{k}\t" + lines[i].split("\t", 1)[1] for k, i in enumerate(part, start=1))
        (place / f"DJI_2026_{flight + 1:03d}_Timestamp.MRK").write_text(text)
        for k, i in enumerate(part, start=1):
            stem = photos[i].stem.split("_")
            shutil.copy(photos[i], place / f"{stem[0]}_{stem[1]}_{k:04d}_V.JPG")
    shutil.copy(folder / "plot_a_ppk.pos", tmp_path)
    return tmp_path


@pytest.mark.parametrize("own_folders", [True, False])
def test_several_marks_that_all_count_from_one(tmp_path: Path, own_folders: bool) -> None:
    folder = needs_shared("plot_a")
    whole = read_stations(folder / "images", folder, "EPSG:6344", check_photos=False)
    flights = _split_flights(folder, tmp_path, own_folders)
    found = read_stations(flights, flights, "EPSG:6344", check_photos=False)
    assert len(found) == len(whole) and found.is_placed.all()
    # by time of exposure, whatever the names are now
    one, other = np.argsort(found.utc), np.argsort(whole.utc)
    np.testing.assert_allclose(found.xyz[one], whole.xyz[other], atol=1e-9)
    assert len(set(found.flight.tolist())) == 2


def test_events_file_of_rtklib(tmp_path: Path) -> None:
    """``_events.pos``: a row an exposure; without MRK the lever arm is unknown, and that is said."""
    folder = needs_shared("plot_a")
    whole = read_stations(folder / "images", folder, "EPSG:6344", check_photos=False)
    lon_lat = __import__("pyproj").Transformer.from_crs("EPSG:6344", "EPSG:6318", always_xy=True)
    lon, lat = lon_lat.transform(whole.xyz[:, 0], whole.xyz[:, 1])
    from treedgs_geo.geotags.gpstime import utc_to_gps

    gps = utc_to_gps(whole.utc)
    rows = "".join(
        f"{int(g // 604800)} {g % 604800:.4f} {la:.9f} {lo:.9f} {z:.4f} 1 16 0.011 0.010 0.027\n"
        for g, la, lo, z in zip(gps, lat, lon, whole.xyz[:, 2], strict=True)
    )
    (tmp_path / "f_events.pos").write_text(
        "% ref frame : NAD83(2011)\n%  GPST latitude(deg) longitude(deg) height(m)  Q  ns sdn(m) sde(m) sdu(m)\n" + rows
    )
    listening = Listening()
    found = read_stations(folder / "images", tmp_path, "EPSG:6344", check_photos=False, reporter=listening)
    np.testing.assert_allclose(found.xyz, whole.xyz, atol=2e-3)
    assert "offset from antenna to camera" in listening.warnings[0]
    read_stations(folder / "images", tmp_path, "EPSG:6344", check_photos=False, camera_delay_ms=50, reporter=listening)
    assert any("delay is not applied" in warning for warning in listening.warnings)


def test_delay_moves_the_camera_along_its_path() -> None:
    folder = needs_shared("plot_a")
    plain = read_stations(folder / "images", folder, "EPSG:6344", check_photos=False)
    late = read_stations(folder / "images", folder, "EPSG:6344", check_photos=False, camera_delay_ms=100)
    early = read_stations(folder / "images", folder, "EPSG:6344", check_photos=False, camera_delay_ms=-100)
    np.testing.assert_allclose(late.utc - plain.utc, 0.1, atol=1e-6)
    forward, back = late.xyz - plain.xyz, plain.xyz - early.xyz
    speed = np.linalg.norm(forward[:, :2], axis=1) / 0.1
    assert 1.0 < np.median(speed) < 8.0 and np.median(np.linalg.norm((forward - back)[:, :2], axis=1)) < 0.05


def test_photos_and_marks_that_differ_are_counted(tmp_path: Path) -> None:
    folder = needs_shared("plot_a")
    for path in sorted((folder / "images").iterdir())[1:30]:
        shutil.copy(path, tmp_path / path.name)
    listening = Listening()
    read_stations(tmp_path, folder, "EPSG:6344", check_photos=False, reporter=listening)
    assert any("33 of 62 exposures have no photo (number 1, " in warning for warning in listening.warnings)
    # and the other way: marks that begin one late
    marks = tmp_path / "late"
    marks.mkdir()
    lines = next(folder.glob("*.MRK")).read_text().splitlines(keepends=True)
    (marks / "a.MRK").write_text("".join(lines[1:]))
    shutil.copy(folder / "plot_a_ppk.pos", marks)
    listening = Listening()
    found = read_stations(folder / "images", marks, "EPSG:6344", check_photos=False, reporter=listening)
    assert found.is_placed.sum() == 61 and not found.is_placed[0]
    assert any("no exposure for 1 of 62 photos" in warning for warning in listening.warnings)
