"""MRK, .pos, tables and photo metadata: real files parse without loss, broken ones say what is wrong."""

from pathlib import Path

import numpy as np
import pyproj
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shared_data import needs_shared

from treedgs_geo.core.errors import GeotagError, InputError
from treedgs_geo.geotags import read_stations
from treedgs_geo.geotags.gpstime import gps_to_utc, parse_datetime_unix, utc_to_gps, week_tow_to_gps
from treedgs_geo.geotags.mrk import read_mrk
from treedgs_geo.geotags.photos import read_photo
from treedgs_geo.geotags.rtklib import read_pos
from treedgs_geo.geotags.tables import is_position_table, read_position_table

LINE = (
    "7\t267313.996873\t[2164]\t    17,N\t   -10,E\t   193,V\t35.93017039,Lat\t139.97336529,Lon\t84.704,Ellh\t"
    "1.021122, 1.216043, 2.734893\t16,Q\n"
)


def test_mrk_line(tmp_path: Path) -> None:
    path = tmp_path / "a.MRK"
    path.write_text(LINE + "\n" + LINE.replace("7\t2673", "8\t2674", 1) + "9\t267515.9\t[21")
    marks = read_mrk(path)
    assert marks.index.tolist() == [7, 8] and len(marks.notes) == 1
    np.testing.assert_allclose(marks.offset_enu[0], [-0.010, 0.017, -0.193])
    np.testing.assert_allclose(marks.sd[0], [1.216043, 1.021122, 2.734893])
    assert marks.flag.tolist() == [16, 16]
    assert marks.gps_s[0] == pytest.approx(2164 * 604800 + 267313.996873, abs=1e-6)


def test_mrk_reordered_and_missing_columns(tmp_path: Path) -> None:
    path = tmp_path / "a.MRK"
    path.write_text("1 267313.9 [116] 139.97,Lon 35.93,Lat 84.7,Ellh 17,N -10,E 193,V\n")
    marks = read_mrk(path)
    assert (marks.lon_deg[0], marks.lat_deg[0], marks.flag[0]) == (139.97, 35.93, -1)
    assert np.isnan(marks.sd).all()
    assert marks.gps_s[0] // 604800 == 116 + 2048, "a 10-bit week is lifted over its roll-overs"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("35.93017039,Lat", "95.9,Lat"), "impossible position"),
        (("    17,N\t", ""), "no N value"),
        (("267313.996873", "967313.99"), "seconds of week"),
        (("[2164]\t", ""), "GPS week"),
    ],
)
def test_mrk_refuses(tmp_path: Path, change: tuple[str, str], says: str) -> None:
    path = tmp_path / "a.MRK"
    path.write_text(LINE.replace(*change) + ("" if "week" in says and "seconds" not in says else LINE))
    with pytest.raises(GeotagError, match=says):
        read_mrk(path)


def test_real_mrk_files() -> None:
    folder = needs_shared("ppk_helenenschacht")
    marks = read_mrk(folder / "101FTASK_Timestamp.mrk")
    assert len(marks.index) == 176 and marks.index[0] == 2 and (marks.flag == 50).all()
    assert not marks.notes and np.isfinite(marks.sd).all()


def test_real_pos_files() -> None:
    for path in sorted(needs_shared("ppk_pos_samples").glob("*_Valid*.pos")):
        track = read_pos(path)
        rows = [line for line in path.read_text().splitlines() if line.strip() and not line.startswith("%")]
        assert len(track.gps_s) == len(rows)
    kinematic = needs_shared("ppk_matrtklib") / "kinematic" / "rover_rtk.pos"
    assert (np.diff(read_pos(kinematic).gps_s) > 0).all()


HEAD = "%  {system}                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)\n"
ROWS = (
    "2026/03/12 15:15:14.200   33.599840069  -91.800149874   108.2814   1  16   0.0110   0.0105   0.0270\n"
    "2026/03/12 15:15:14.400   33.599844264  -91.800148401   108.2887   2  14   0.0110   0.0105   0.0270\n"
)


def test_pos_time_systems_agree(tmp_path: Path) -> None:
    found = []
    for system, rows in (
        ("GPST", ROWS),
        ("UTC ", ROWS.replace("15:15:14", "15:14:56")),
        (
            "GPST",
            ROWS.replace("2026/03/12 15:15:14.2", "2409 400514.2").replace("2026/03/12 15:15:14.4", "2409 400514.4"),
        ),
    ):
        path = tmp_path / "a.pos"
        path.write_text(HEAD.format(system=system) + rows)
        found.append(read_pos(path))
    for track in found[1:]:
        np.testing.assert_allclose(track.gps_s, found[0].gps_s, atol=1e-6)
    np.testing.assert_allclose(found[0].sd[0], [0.0105, 0.0110, 0.0270])


def test_pos_layouts(tmp_path: Path) -> None:
    path = tmp_path / "a.pos"
    path.write_text(
        HEAD.format(system="GPST").replace("(deg)", "(d'\")", 2)
        + ROWS.replace("33.599840069  -91.800149874", "33 35 59.4242484 -91 48 00.5395464").replace(
            "33.599844264  -91.800148401", "33 36 0 -0 30 0.0"
        )
    )
    track = read_pos(path)
    assert track.lat_deg[0] == pytest.approx(33.599840069, abs=1e-9) and track.lon_deg[0] == pytest.approx(
        -91.800149874, abs=1e-9
    )
    assert track.lon_deg[1] == -0.5
    ecef = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True).transform(-91.8, 33.6, 108.0)
    row = "2026/03/12 15:15:1{}.0 {:.4f} {:.4f} {:.4f} 1 16 0.01 0.01 0.02\n"
    path.write_text(
        "%  GPST  x-ecef(m)  y-ecef(m)  z-ecef(m)   Q  ns   sdx(m)   sdy(m)   sdz(m)\n"
        + "".join(row.format(i, *ecef) for i in (1, 2))
    )
    track = read_pos(path)
    np.testing.assert_allclose([track.lon_deg[0], track.lat_deg[0], track.height_m[0]], [-91.8, 33.6, 108.0], atol=1e-3)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (ROWS, "column header"),
        ("%  GPST  e-baseline(m)  n-baseline(m)  u-baseline(m)   Q  ns\n" + ROWS, "baseline.*line 1|line 1.*baseline"),
        (HEAD.format(system="GPST"), "0 epochs"),
        (HEAD.format(system="GPST") + "garbage here\n" + ROWS, "line 2"),
        (HEAD.format(system="GPST") + ROWS.replace("33.599", "133.599", 1), "line 2"),
    ],
)
def test_pos_refuses(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "a.pos"
    path.write_text(text)
    with pytest.raises(GeotagError, match=says):
        read_pos(path)


@settings(max_examples=150, deadline=None)
@given(st.text(alphabet="0123456789.,-+%[] \tNEVLatonElhQGPSTUC/:\n", max_size=300))
def test_parsers_never_crash(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.mktemp("fuzz") / "x"
    path.write_text(HEAD.format(system="GPST") + text)
    for read in (read_pos, read_mrk):
        try:
            read(path)
        except GeotagError:
            pass


def test_gps_time() -> None:
    utc = parse_datetime_unix("2026:03:12 15:15:02.25")
    assert utc_to_gps(utc) == pytest.approx(float(week_tow_to_gps(2409, 400520.25)))
    for moment in (utc, parse_datetime_unix("1994-01-01T00:00:00"), parse_datetime_unix("2016/12/31 23:59:58")):
        assert gps_to_utc(utc_to_gps(moment)) == moment
    assert np.isnan(parse_datetime_unix("0000:00:00 00:00:00"))


def test_tables(tmp_path: Path) -> None:
    crs = pyproj.CRS.from_epsg(32615)
    table = tmp_path / "tags.csv"
    table.write_text("Name;Latitude;Longitude;Height\na.jpg;33.6;-91.8;100\nsub\\b.jpg;33.6001;-91.8;101\n")
    read = read_position_table(table, crs)
    assert read.names == ["a.jpg", "b.jpg"] and read.xyz[1, 1] - read.xyz[0, 1] == pytest.approx(11.09, abs=0.02)
    geo = tmp_path / "geo.txt"
    geo.write_text("EPSG:4326\n# x\na.jpg -91.8 33.6 100\n")
    np.testing.assert_allclose(read_position_table(geo, crs).xyz[0], read.xyz[0])
    assert is_position_table(table) and is_position_table(geo)
    metashape = tmp_path / "reference.csv"
    metashape.write_text(
        '# CoordinateSystem: GEOGCS["WGS 84",DATUM["World Geodetic System 1984"]]\n'
        "#Label,X/Longitude,Y/Latitude,Z/Altitude,Accuracy_X/Y_(m)\na.jpg,-91.8,33.6,100,0.02\n"
    )
    assert is_position_table(metashape)
    np.testing.assert_allclose(read_position_table(metashape, crs).xyz[0], read.xyz[0])
    plots = tmp_path / "plots.csv"
    plots.write_text("plot_id,lon,lat,radius_m\n1,2,3,4\n")
    assert not is_position_table(plots)
    table.write_text("name,lat,lon,h\na.jpg,33.6,-91.8,x\n")
    with pytest.raises(GeotagError, match="line 2"):
        read_position_table(table, crs)


def test_xmp_variants(tmp_path: Path) -> None:
    from PIL import Image

    folder = needs_shared("xmp_samples")
    Image.new("RGB", (64, 48), 90).save(tmp_path / "plain.jpg")
    plain = (tmp_path / "plain.jpg").read_bytes()
    seen = {}
    for sample in sorted(folder.glob("*.xmp")):
        photo = tmp_path / f"{sample.stem}.jpg"
        photo.write_bytes(plain + sample.read_bytes())
        seen[sample.stem] = read_photo(photo)
    rtk = seen["p4rtk_100_0005_0018"]
    assert (rtk.lon_deg, rtk.lat_deg, rtk.rtk_flag, rtk.pitch_deg) == (120.95170160, 24.68027804, 50, -60)
    np.testing.assert_allclose(rtk.sd, [0.00970, 0.00935, 0.02382])
    assert seen["p4m_DJI_0220"].rtk_flag == 34
    assert seen["mini4_0008"].pitch_deg == -80 and not seen["mini4_0008"].has_position
    broken = tmp_path / "broken.jpg"
    broken.write_bytes(b"not a photo")
    with pytest.raises(InputError, match="broken.jpg"):
        read_photo(broken)


def test_epochs_that_are_twice_or_out_of_order(tmp_path: Path) -> None:
    from small_flight import START_UTC, write_pos

    times = START_UTC + np.arange(0.0, 20.0, 0.2)
    xyz = np.column_stack([425000.0 + 4 * (times - times[0]), np.full(100, 3718000.0), np.full(100, 120.0)])
    write_pos(tmp_path / "a.pos", times, xyz)
    whole = read_pos(tmp_path / "a.pos")
    lines = (tmp_path / "a.pos").read_text().splitlines(keepends=True)
    # The same epoch again, and two exchanged: as good as the whole file.
    (tmp_path / "b.pos").write_text("".join([*lines[:40], lines[39], lines[41], lines[40], *lines[42:]]))
    mixed = read_pos(tmp_path / "b.pos")
    np.testing.assert_array_equal(mixed.gps_s, whole.gps_s)
    np.testing.assert_array_equal(mixed.lon_deg, whole.lon_deg)
    assert set(mixed.quality) == {1} and "backwards in 1 place" in mixed.notes[0] and not whole.notes
    # Another processing of some epochs, half a metre away: nobody knows which is right.
    write_pos(tmp_path / "c.pos", times[50:60], xyz[50:60] + [0.5, 0, 0])
    (tmp_path / "d.pos").write_text("".join([*lines, *(tmp_path / "c.pos").read_text().splitlines(keepends=True)[2:]]))
    spliced = read_pos(tmp_path / "d.pos")
    assert (spliced.quality[50:60] == 2).all() and (spliced.sd[50:60, 0] > 0.45).all()
    assert any("10 of its epochs are there twice" in note for note in spliced.notes)


def test_a_table_without_accuracies_is_navigation_and_says_how_to_say_more(tmp_path: Path) -> None:
    from small_flight import CRS, Flight, Listening, lines, write_photos

    flight = Flight(lines(10))
    write_photos(flight, tmp_path / "images")
    rows = [f"DJI_{i + 1:04d}.JPG,{x:.3f},{y:.3f},{z:.3f}" for i, (x, y, z) in enumerate(flight.camera)]
    (tmp_path / "plain.csv").write_text("name,x,y,z\n" + "\n".join(rows) + "\n")
    (tmp_path / "sd.csv").write_text("name,x,y,z,sd_e,sd_n\n" + "".join(f"{row},0.02,0.02\n" for row in rows))
    listening = Listening()
    found = read_stations(tmp_path / "images", tmp_path / "plain.csv", CRS, check_photos=False, reporter=listening)
    assert set(found.quality) == {"single"} and any("sd_e, sd_n, sd_u" in text for text in listening.warnings)
    found = read_stations(tmp_path / "images", tmp_path / "sd.csv", CRS, check_photos=False)
    assert set(found.quality) == {"fix"} and np.allclose(found.sd, [0.02, 0.02, 0.04])
