"""Ground control: both formats as people write them, what is taken, and every refusal with its line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyproj
import pytest
from damaged import damage
from PIL import Image
from shared_data import needs_shared
from small_flight import Listening

from treedgs_geo.core.crs import lonlat_to_project
from treedgs_geo.core.errors import CRSError, InputError
from treedgs_geo.geotags.control import CONTROL_SD_M, project_of, read_control
from treedgs_geo.geotags.mrk import read_mrk
from treedgs_geo.geotags.stations import Stations

UTM = pyproj.CRS.from_epsg(32615)
NAD83 = pyproj.CRS.from_epsg(6344)
A, B = (500000.0, 3700000.0, 50.0), (500030.0, 3700010.0, 51.5)


@pytest.fixture
def stations(tmp_path: Path) -> Stations:
    """Four photos of 400 x 300 px in two folders, 70 m above ground."""
    names = ["a/DJI_0001.JPG", "a/DJI_0002.JPG", "b/DJI_0002.JPG", "b/DJI 0003.JPG"]
    paths = [tmp_path / "photos" / name for name in names]
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        Image.new("RGB", (400, 300)).save(path)
    xyz = np.array(A) + [[0, 0, 70], [10, 0, 70], [20, 0, 70], [30, 0, 70]]
    nan = np.full(4, np.nan)
    quality, flight = ["fix"] * 4, np.zeros(4, int)
    return Stations(
        names, paths, xyz, np.full((4, 3), 0.02), quality, nan, flight, nan, nan, nan, np.full(4, 70.0), UTM
    )


def _file(folder: Path, text: str, name: str = "gcp_list.txt") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def _list(*rows: str, crs: str = "EPSG:32615") -> str:
    return "\n".join([crs, *rows]) + "\n"


ONE = "500000 3700000 50 10.5 20.25 DJI_0001.JPG"
TWO = "500000 3700000 50 200 150 a/DJI_0002.JPG"


@pytest.mark.parametrize(
    "crs", ["EPSG:32615", "epsg:32615", "WGS84 UTM 15N", "+proj=utm +zone=15 +datum=WGS84 +units=m"]
)
def test_gcp_list(stations: Stations, tmp_path: Path, crs: str) -> None:
    text = "\ufeff" + _list(
        "# x y z px py photo label",
        f"{ONE} A",
        f"{TWO}\tA",
        "",
        "500030\t3700010\t51.5\t0\t300\tDJI 0003.JPG\tB",
        "500030 3700010 51.5 400 0 b/dji_0002.jpg B",
        crs=crs,
    )
    found = read_control(_file(tmp_path, text), stations)
    assert found.labels == ["A", "B"] and len(found) == 2 and not found.is_check.any()
    np.testing.assert_allclose(found.xyz, [A, B], atol=1e-6)
    np.testing.assert_array_equal(found.sd_m, [CONTROL_SD_M] * 2)
    # the upper-left corner is (0, 0) in the file as here: nothing is added
    assert found.pixels.tolist() == [[10.5, 20.25], [200, 150], [0, 300], [400, 0]]
    assert found.photo.tolist() == [0, 1, 3, 2] and found.point.tolist() == [0, 0, 1, 1]


def test_a_real_list_with_the_surveyors_own_table(tmp_path: Path) -> None:
    """Five points, 35 marks in photos of an Autel; the surveyor's table has the same points in UTM."""
    folder = needs_shared("ppk_helenenschacht")
    names = sorted({line.split()[5] for line in (folder / "gcp_list.txt").read_text().splitlines()[1:] if line.strip()})
    Image.new("L", (5472, 3648)).save(tmp_path / "blank.png")
    count, nan = len(names), np.full(len(names), np.nan)
    crs = pyproj.CRS.from_epsg(32633)
    mrk = read_mrk(folder / "101FTASK_Timestamp.mrk")
    xyz = lonlat_to_project(crs, mrk.lon_deg, mrk.lat_deg, mrk.height_m)[:count]
    flown = Stations(
        names,
        [tmp_path / "blank.png"] * count,
        xyz,
        np.full((count, 3), 0.02),
        ["fix"] * count,
        nan,
        np.zeros(count, int),
        nan,
        nan,
        nan,
        np.full(count, 50.0),
        crs,
    )
    listening = Listening()
    found = read_control(folder / "gcp_list.txt", flown, listening)
    assert found.labels == list("12345") and np.bincount(found.point).tolist() == [7] * 5 and not listening.warnings
    with open(folder / "latlon-easting_northing.csv", encoding="utf-8-sig") as stream:
        rows = [line.strip().split(";") for line in stream if line.strip()][1:]
    surveyed = {row[0]: [float(value) for value in row[1:4]] for row in rows}
    np.testing.assert_allclose(found.xyz, [surveyed[label] for label in found.labels], atol=0.01)


def test_the_project_crs_of_a_list(tmp_path: Path) -> None:
    assert project_of(_file(tmp_path, _list(ONE, TWO))) == UTM
    degrees = "-117.5 34.0 50 1 2 DJI_0001.JPG"
    found = project_of(_file(tmp_path, _list(degrees, crs="EPSG:4326")))
    assert found is not None and found.name == "NAD83(2011) / UTM zone 11N"
    table = "label,easting,northing,height,photo,u,v\nA,500000,3700000,50,DJI_0001.JPG,1,2\n"
    assert project_of(_file(tmp_path, table, "points.csv")) is None


def test_points_without_labels_are_known_by_their_coordinates(stations: Stations, tmp_path: Path) -> None:
    rows = [ONE, TWO, "500030 3700010 51.5 5 5 DJI_0001.JPG", "500030 3700010 51.5 6 6 a/DJI_0002.JPG named"]
    found = read_control(_file(tmp_path, _list(*rows)), stations)
    assert found.labels == ["point 1", "named"] and found.point.tolist() == [0, 0, 1, 1]


@pytest.mark.parametrize(("factor", "warned"), [(0.5, True), (1.0, False)])
def test_marks_made_in_reduced_photos(stations: Stations, tmp_path: Path, factor: float, warned: bool) -> None:
    photos = ("DJI_0001.JPG", "a/DJI_0002.JPG", "b/DJI_0002.JPG")
    places = np.random.default_rng(3).uniform((20, 20), (380, 280), (4, 3, 2)) * factor
    rows = [
        f"{500000 + 9 * k} 3700000 50 {u:.1f} {v:.1f} {photo}"
        for k, marks in enumerate(places)
        for photo, (u, v) in zip(photos, marks, strict=True)
    ]
    listening = Listening()
    read_control(_file(tmp_path, _list(*rows)), stations, listening)
    assert [line for line in listening.warnings if "400 x 300 px, as if" in line] == listening.warnings
    assert bool(listening.warnings) == warned


def test_csv_with_accuracies_and_check_points(stations: Stations, tmp_path: Path) -> None:
    lon, lat = pyproj.Transformer.from_crs(UTM, "EPSG:4326", always_xy=True).transform(*np.array([A, B])[:, :2].T)
    header = "Label;Lon;Lat;Height;Photo;U;V;sd_h_m;sd_v_m;Kind"
    rows = [
        f"A;{lon[0]:.12f};{lat[0]:.12f};50;DJI_0001;10;20;0.01;;control",
        f"A;{lon[0]:.12f};{lat[0]:.12f};50;DJI 0003;11;21;0.015;0.05;",
        f"B;{lon[1]:.12f};{lat[1]:.12f};51.5;DJI_0001.JPG;30;40;;;Check",
        f"B;{lon[1]:.12f};{lat[1]:.12f};51.5;DJI 0003.JPG;31;41;;;",
    ]
    found = read_control(_file(tmp_path, "\n".join([header, *rows]), "points.csv"), stations)
    np.testing.assert_allclose(found.xyz, [A, B], atol=1e-3)
    np.testing.assert_allclose(found.sd_m, [[0.015, 0.015, 0.05], CONTROL_SD_M])
    assert found.is_check.tolist() == [False, True]
    metric = "label,easting,northing,height,image,px,py\nA,500000,3700000,50,DJI_0001.JPG,1,2\n"
    metric += "A,500000,3700000,50,DJI 0003.JPG,1,2\nB_check,500030,3700010,51.5,DJI_0001.JPG,1,2\n"
    again = read_control(_file(tmp_path, metric + "B_check,500030,3700010,51.5,DJI 0003.JPG,1,2\n", "p.csv"), stations)
    assert again.xyz.tolist() == [list(A), list(B)] and again.is_check.tolist() == [False, True]
    assert again.digest() != replace(again, is_check=~again.is_check).digest()
    assert again.digest() != replace(again, pixels=again.pixels + 0.5).digest()


BARS = """label,photo,u,v,bar,length_m
left,DJI_0001.JPG,10,20,stick,1.5
left,a/DJI_0002.JPG,12,22,stick,1.5
right,DJI_0001.JPG,110,20,stick,1.5
right,a/DJI_0002.JPG,112,22,stick,1.5
A,DJI_0001.JPG,10,20,tape,12.25
A,a/DJI_0002.JPG,12,22,tape,12.25
B,DJI_0001.JPG,310,20,tape,12.25
"""


def test_known_lengths_between_marked_points(stations: Stations, tmp_path: Path) -> None:
    said = Listening()
    found = read_control(_file(tmp_path, BARS, "bars.csv"), stations, said)
    assert len(found) == 0 and found.bars.labels == ["stick"] and found.bars.length_m.tolist() == [1.5]
    assert found.bars.point.tolist() == [0, 0, 1, 1] and found.bars.photo.tolist() == [0, 1, 0, 1]
    assert found.bars.pixels.tolist() == [[10, 20], [12, 22], [110, 20], [112, 22]]
    assert len(said.warnings) == 1 and "fewer than two photos show are left out: tape" in said.warnings[0]
    # Beside points, one of which is an end.
    both = BARS.replace("label,", "easting,northing,height,label,").replace("\nleft,", "\n,,,left,")
    both = both.replace("\nright,", "\n500000,3700000,50,right,").replace("\nA,", "\n500030,3700010,51.5,A,")
    both = both.replace("\nB,", "\n,,,B,") + "500040,3700000,50,C,DJI_0001.JPG,1,1,,\n"
    together = read_control(_file(tmp_path, both, "both.csv"), stations)
    assert together.labels == ["right", "A"] and together.bars.point.tolist() == found.bars.point.tolist()
    longer = read_control(_file(tmp_path, BARS.replace(",1.5", ",1.6"), "longer.csv"), stations)
    assert longer.digest() != found.digest()


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "stick,1.5\nright",
            "stick,1.4\nright",
            "line 2: bar 'stick' has the ends left, right and the lengths 1.5, 1.4",
        ),
        ("B,DJI_0001.JPG,310,20,tape,12.25\n", "", "bar 'tape' has the ends A and the lengths 12.25 m, expected two"),
        ("right,DJI_0001.JPG,110", "middle,DJI_0001.JPG,110", "bar 'stick' has the ends left, middle, right and"),
        ("A,DJI_0001.JPG,10,20,tape,12.25", "A,DJI_0001.JPG,10,20,tape,", "the lengths nan, 12.25 m"),
        ("A,DJI_0001.JPG,10,20,tape", "A,DJI_0001.JPG,10,20,", "it lacks the easting"),
        ("A,DJI_0001.JPG,10,20", "A,DJI_0001.JPG,1000,20", "line 6: pixel 1000, 20 lies outside"),
        (BARS[BARS.index("left") : BARS.index("A,")], "", "none of its known lengths has two ends that two photos"),
    ],
)
def test_lengths_that_are_not_whole_are_refused(
    stations: Stations, tmp_path: Path, old: str, new: str, says: str
) -> None:
    assert old in BARS
    with pytest.raises(InputError, match=says):
        read_control(_file(tmp_path, BARS.replace(old, new), "bars.csv"), stations)


def test_check_points_of_a_gcp_list(stations: Stations, tmp_path: Path) -> None:
    rows = [
        f"{ONE} A check",
        f"{TWO} A",
        "500030 3700010 51.5 5 5 DJI_0001.JPG Check",
        "500030 3700010 51.5 6 6 a/DJI_0002.JPG Check",
    ]
    found = read_control(_file(tmp_path, _list(*rows)), stations)
    # a label that only is the word says nothing
    assert found.labels == ["A", "Check"] and found.is_check.tolist() == [True, False]
    many = [
        f"{500000 + i} 3700000 50 {u} 5 {photo} P{i}"
        for i in range(8)
        for u, photo in ((1, "DJI_0001.JPG"), (2, "DJI 0003"))
    ]
    many = [row.replace("DJI 0003", "a/DJI_0002.JPG") for row in many]
    assert not read_control(_file(tmp_path, _list(*many)), stations).is_check.any(), "no point is held back by itself"


def test_another_frame_is_transformed_and_an_uncertain_one_refused(stations: Stations, tmp_path: Path) -> None:
    there = replace(stations, crs=NAD83)
    itrf = pyproj.Transformer.from_crs(NAD83.to_3d(), "EPSG:7912", always_xy=True)
    lon, lat, height = itrf.transform(*A)
    rows = [
        f"{lon:.11f} {lat:.11f} {height:.4f} {u} 5 {photo} A"
        for u, photo in ((1, "DJI_0001.JPG"), (2, "a/DJI_0002.JPG"))
    ]
    found = read_control(_file(tmp_path, _list(*rows, crs="EPSG:7912")), there)
    np.testing.assert_allclose(found.xyz, [A], atol=2e-3)
    # WGS 84 names no frame: degrees are read on the project's datum, as geotags are ...
    plain = read_control(_file(tmp_path, _list(*rows, crs="EPSG:4326")), there)
    np.testing.assert_allclose(plain.xyz[0], lonlat_to_project(NAD83, [lon], [lat], [height])[0], atol=1e-4)
    assert 0.5 < np.linalg.norm(plain.xyz - found.xyz) < 3
    # ... and metres of one cannot become metres of the other
    with pytest.raises(CRSError, match="gcp_list.txt"):
        read_control(_file(tmp_path, _list(ONE, TWO)), there)


def test_heights_of_another_datum(stations: Stations, tmp_path: Path) -> None:
    listening = Listening()
    high = [row.replace(" 50 ", " 77 ") for row in (ONE, TWO)]
    read_control(_file(tmp_path, _list(*high)), stations, listening)
    assert len(listening.warnings) == 1 and "+27 m" in listening.warnings[0] and "sea level" in listening.warnings[0]
    # consumer positions say nothing about heights
    rough = replace(stations, quality=["exif"] * 4)
    listening = Listening()
    read_control(_file(tmp_path, _list(*high)), rough, listening)
    assert not listening.warnings
    with pytest.raises(CRSError, match="DHHN2016 height"):
        read_control(_file(tmp_path, _list(ONE, TWO, crs="EPSG:32615+7837")), stations)


def test_what_is_left_out_is_reported(stations: Stations, tmp_path: Path) -> None:
    listening = Listening()
    rows = [ONE, TWO, "500030 3700010 51.5 5 5 DJI_0001.JPG lonely", "500030 3700010 51.5 6 6 GONE.JPG lonely"]
    found = read_control(_file(tmp_path, _list(*rows)), stations, listening)
    assert found.labels == ["point 1"] and len(found.point) == 2
    assert "1 of 4 marks" in listening.warnings[0] and "GONE.JPG" in listening.warnings[0]
    assert "fewer than two photos" in listening.warnings[1] and "lonely" in listening.warnings[1]


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ((f"{ONE} A", TWO.replace(" 50 ", " 50.1 ") + " A"), "lines 2 and 3: point 'A' has two different coordinates"),
        ((f"{ONE} A", f"{TWO} B"), "lines 2 and 3: points 'A' and 'B' have the same"),
        ((f"{ONE} A", ONE.replace("10.5", "11") + " A"), "lines 2 and 3: point 'A' is marked twice"),
        ((ONE, TWO.replace("200 150", "200 300.5")), "line 3: pixel 200, 300.5 lies outside of a/DJI_0002.JPG"),
        ((ONE, TWO.replace("200 150", "-1 150")), "line 3: pixel -1"),
        ((ONE, TWO.replace("a/", "")), "line 3: photo 'DJI_0002.JPG' is both a/DJI_0002.JPG and b/DJI_0002.JPG"),
        ((ONE, "500000 3700000 200 150 a/DJI_0002.JPG A"), "line 3: found"),
        (("500000\t3700000\t\t10\t20\tDJI_0001.JPG",), "line 2: found"),
        (("500000 3700000 nan 10 20 DJI_0001.JPG",), "line 2: found"),
        ((ONE,), "none of its 1 points is marked in two photos"),
        ((ONE.replace("DJI_0001", "IMG_1"), TWO.replace("DJI_0002", "IMG_2")), "names none of the 4 photos"),
        ((ONE.replace("500000", "600000"), TWO), "line 2: point 'point 1' lies 100 km"),
        (
            ("3700000 500000 50 10 20 DJI_0001.JPG", "3700000 500000 50 1 2 a/DJI_0002.JPG"),
            "line 2: point 'point 1' lies",
        ),
        ((f"{ONE} A check", f"{TWO} A control"), ""),
        ((), "holds no control point"),
    ],
)
def test_refusals_name_the_line(stations: Stations, tmp_path: Path, rows: tuple[str, ...], says: str) -> None:
    path = _file(tmp_path, _list(*rows))
    if not says:  # an unknown word after the label is no statement
        assert read_control(path, stations).is_check.tolist() == [True]
        return
    with pytest.raises(InputError) as refused:
        read_control(path, stations)
    assert says in str(refused.value) and str(path) in str(refused.value)


CSV = "label,easting,northing,height,photo,u,v,sd_h_m,kind,epsg\n"


@pytest.mark.parametrize(
    ("text", "kind", "says"),
    [
        ("no CRS at all\n" + ONE, CRSError, "line 1: 'no CRS at all' is not a CRS"),
        ("", InputError, "holds no control point"),
        (CSV, InputError, "holds no row"),
        ("label,photo,u,v\nA,a.jpg,1,2\n", InputError, "found columns label, photo, u, v"),
        (CSV + "A,500000,3700000,,DJI_0001.JPG,1,2,,,\n", InputError, "line 2: height is empty"),
        (CSV + "A,500000,3700000,50,,1,2,,,\n", InputError, "line 2: has no photo"),
        (CSV + "A,500000,3700000,50,DJI_0001.JPG,1,2,0,,\n", InputError, "line 2: standard deviation sd_h_m is 0 m"),
        (CSV + "A,500000,3700000,50,DJI_0001.JPG,1,2,,maybe,\n", InputError, "line 2: kind 'maybe'"),
        (CSV + "A,500000,3700000,50,DJI_0001.JPG,1,2,,,9999999\n", CRSError, "line 2: epsg '9999999'"),
        (
            CSV + "A,500000,3700000,50,DJI_0001.JPG,1,2,,,32615\nA,500000,3700000,50,a/DJI_0002.JPG,1,2,,,32616\n",
            InputError,
            "lines 2 and 3: have different epsg",
        ),
        (
            CSV + "A,500000,3700000,50,DJI_0001.JPG,1,2,,check,\nA,500000,3700000,50,a/DJI_0002.JPG,1,2,,control,\n",
            InputError,
            "lines 2 and 3: point 'A' is control in one and check",
        ),
        ("lon,lat,h,photo,u,v\n500000,3700000,50,DJI_0001.JPG,1,2\n", InputError, "holds no degrees"),
        (
            "x,y,z,photo,u,v\n499000,500000,50,DJI_0001.JPG,1,2\n499000,500000,50,a/DJI_0002.JPG,1,2\n",
            InputError,
            "lies 3200 km from the nearest photo",
        ),
    ],
)
def test_files_that_cannot_be_read(stations: Stations, tmp_path: Path, text: str, kind: type, says: str) -> None:
    with pytest.raises(kind) as refused:
        read_control(_file(tmp_path, text, "points.csv"), stations)
    assert says in str(refused.value) and "points.csv" in str(refused.value)


def test_missing_files_and_workbooks(stations: Stations, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_control(tmp_path / "none.txt", stations)
    (tmp_path / "points.xlsx").write_bytes(b"PK\x03\x04 whatever")
    with pytest.raises(InputError, match="is an Excel workbook"):
        read_control(tmp_path / "points.xlsx", stations)


def test_points_of_the_neighbouring_zone_are_named(stations: Stations, tmp_path: Path) -> None:
    moved = pyproj.Transformer.from_crs(UTM, "EPSG:32616", always_xy=True).transform(*A[:2])
    text = "x,y,z,photo,u,v\n" + "".join(
        f"{moved[0]:.3f},{moved[1]:.3f},50,{photo},1,2\n" for photo in ("DJI_0001.JPG", "a/DJI_0002.JPG")
    )
    with pytest.raises(InputError, match="in EPSG:32616"):
        read_control(_file(tmp_path, text, "p.csv"), stations)


GCP_LIST = "EPSG:32615\n" + "".join(
    f"{500000 + 7 * k}.25 {3700000 + k} 5{k}.5 {11 + k}.5 {u} {photo} P{k}\n"
    for k in range(4)
    for u, photo in ((21, "DJI_0001.JPG"), (22, "a/DJI_0002.JPG"), (23, "b/DJI_0002.JPG"))
)
TABLE = "label,easting,northing,height,photo,u,v,sd_h_m,kind\n" + "".join(
    f"P{k},{500000 + 7 * k}.25,{3700000 + k},5{k}.5,{photo},{11 + k}.5,{u},0.0{k + 1},check\n"
    for k in range(4)
    for u, photo in ((21, "DJI_0001.JPG"), (22, "a/DJI_0002.JPG"))
)


@pytest.mark.parametrize("text", [GCP_LIST, TABLE])
def test_damaged_files_give_what_stands_in_them_or_a_sentence(stations: Stations, tmp_path: Path, text: str) -> None:
    # The first line stays: PROJ takes its time to say that a text is no CRS.
    (first, *rows), rng, read = text.splitlines(keepends=True), np.random.default_rng(5), 0
    for _ in range(200):
        path = _file(tmp_path, first + damage("".join(rows), rng))
        try:
            found = read_control(path, stations)
        except InputError as problem:
            assert str(path) in str(problem)
            continue
        read += 1
        count = len(found)
        assert len(found.labels) == len(set(found.labels)) == count == len(found.xyz) == len(found.sd_m)
        assert np.isfinite(found.xyz).all() and (found.sd_m > 0).all() and len(found.is_check) == count
        assert (np.bincount(found.point, minlength=count) >= 2).all()
        assert len({*zip(found.point.tolist(), found.photo.tolist(), strict=True)}) == len(found.photo)
        assert (found.pixels >= 0).all() and (found.pixels <= [400, 300]).all()
        held = path.read_text(encoding="utf-8")
        for value in found.xyz[:, 2]:  # every height stands in the file
            assert f"{value:.15g}" in held.replace("+", "")
    assert 10 < read < 190
