"""The scale of the map, and coordinates that cannot lie in their CRS."""

from __future__ import annotations

import numpy as np
import pyproj
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.errors import CRSError
from treedgs_geo.core.map_scale import check_lon_lat, check_place, ground_scale, local_scale, zone_hint
from treedgs_geo.core.progress import Reporter
from treedgs_geo.terrain.dtm import Dtm

ARKANSAS = (-91.8, 33.6)
#: Web Mercator as other programs write it: no EPSG code.
WEB = (
    "+proj=merc +a=6378137 +b=6378137 +lat_ts=0 +lon_0=0 +x_0=0 +y_0=0 +k=1 +units=m +nadgrids=@null +wktext "
    "+no_defs +type=crs"
)
#: A UTM zone by its parameters, on a datum that nobody knows.
UNKNOWN_UTM = (
    'PROJCS["field",GEOGCS["field",DATUM["unknown",SPHEROID["GRS80",6378137,298.257222101]],'
    'PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],'
    'PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",-93],PARAMETER["scale_factor",0.9996],'
    'PARAMETER["false_easting",500000],PARAMETER["false_northing",0],UNIT["metre",1]]'
)
#: A code that is none, and one of another country.
MADE_UP = UNKNOWN_UTM[:-1] + ',AUTHORITY["EPSG","999999"]]'
STOLEN = UNKNOWN_UTM[:-1] + ',AUTHORITY["EPSG","2154"]]'
LOCAL = 'LOCAL_CS["local metres",UNIT["metre",1]]'


class Ears(Reporter):
    def __init__(self):
        super().__init__()
        self.heard = []

    def warn(self, message):
        self.heard.append(message)


def on_map(crs, lon, lat):
    flat = crs.sub_crs_list[0] if crs.is_compound else crs
    return np.array([[*pyproj.Transformer.from_crs("EPSG:4326", flat, always_xy=True).transform(lon, lat), 100.0]])


@pytest.mark.parametrize(
    ("code", "place"),
    [
        ("EPSG:32615", ARKANSAS),
        ("EPSG:2154", (2.3, 44.0)),
        ("EPSG:27572", (2.3, 47.0)),
        ("EPSG:27700", (-3.0, 57.0)),
        ("EPSG:3006", (23.5, 66.0)),
        ("EPSG:3035", ARKANSAS),
        ("EPSG:5070", ARKANSAS),
        ("EPSG:3031", (10.0, -75.0)),
        ("EPSG:2193", (175.0, -39.0)),
        ("EPSG:28992", (5.5, 52.0)),
        ("EPSG:26951", ARKANSAS),
        ("EPSG:5514", (15.0, 49.5)),
    ],
)
def test_the_scale_is_that_of_the_projection(code, place):
    """PROJ's own factors, in every direction; false ones of spheres and grids in grads are not asked of it."""
    crs = pyproj.CRS(code)
    scale = local_scale(crs, *on_map(crs, *place)[0, :2])
    known = pyproj.Proj(crs).get_factors(*place)
    assert scale.smallest == pytest.approx(known.tissot_semiminor, abs=2e-6)
    assert scale.largest == pytest.approx(known.tissot_semimajor, abs=2e-6)
    assert (scale.lon_deg, scale.lat_deg) == pytest.approx(place, abs=1e-3)


@pytest.mark.parametrize("text", ["EPSG:3857", WEB])
def test_web_mercator_stretches_on_the_ellipsoid(text):
    """By the formulas: a / (N cos lat) from west to east, a / (M) / cos lat from south to north."""
    crs = pyproj.CRS.from_user_input(text)
    lat, e2 = np.radians(33.6), 0.00669437999
    n = 1 / np.sqrt(1 - e2 * np.sin(lat) ** 2)
    wanted = sorted([1 / (n * np.cos(lat)), 1 / ((1 - e2) * n**3 * np.cos(lat))])
    scale = local_scale(crs, *on_map(crs, *ARKANSAS)[0, :2])
    assert [scale.smallest, scale.largest] == pytest.approx(wanted, abs=2e-5)


def test_height_shortens_the_map():
    """R / (R + h): a valley 1,500 m up loses 0.024 %."""
    crs = pyproj.CRS.from_epsg(32615)
    x, y = on_map(crs, *ARKANSAS)[0, :2]
    low, high = ground_scale(crs, x, y), ground_scale(crs, x, y, 1500.0)
    assert low == pytest.approx(0.999753, abs=1e-6) and low / high == pytest.approx(1.000235, abs=1e-6)
    assert ground_scale(crs, x, y, float("nan")) == low


def test_what_has_no_place_has_no_scale():
    assert ground_scale(None, 1.0, 2.0) == 1.0
    assert ground_scale(pyproj.CRS.from_wkt(LOCAL), 1.0, 2.0) == 1.0
    for crs in (None, pyproj.CRS.from_wkt(LOCAL)):
        check_place(crs, np.array([[-190.0, 30.0, 1.0]]), "a.laz")
    check_place(pyproj.CRS.from_epsg(32615), np.full((3, 3), np.nan), "a.laz")
    check_place(pyproj.CRS.from_epsg(32615), np.empty((0, 3)), "a.laz")


@settings(max_examples=60)
@given(st.integers(1, 60), st.floats(-2.999, 2.999), st.floats(-79.9, 83.9), st.floats(-100, 5000))
def test_every_place_of_a_utm_zone_is_taken_without_a_word(zone, off_deg, lat, height):
    crs = pyproj.CRS.from_epsg((32600 if lat >= 0 else 32700) + zone)
    point = on_map(crs, -183 + 6 * zone + off_deg, lat)
    point[:, 2] = height
    ears = Ears()
    check_place(crs, np.repeat(point, 5, axis=0), "a.laz", ears)
    assert not ears.heard
    assert 0.9987 < ground_scale(crs, *point[0]) < 1.0011


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("EPSG:6344+5703", ARKANSAS),
        ("EPSG:2154", (2.3, 44.0)),
        ("EPSG:27572", (2.3, 47.0)),
        ("EPSG:27700", (-3.0, 57.0)),
        ("EPSG:3006", (23.5, 66.0)),
        ("EPSG:25832+7837", (9.0, 50.0)),
        ("EPSG:26951", (-91.8, 35.6)),
        ("EPSG:2193", (175.0, -39.0)),
        ("EPSG:28992", (5.5, 52.0)),
        ("EPSG:31254", (10.5, 47.2)),
        ("EPSG:32756", (151.2, -33.9)),
        ("EPSG:3067", (30.0, 62.0)),
        ("EPSG:2056", (8.0, 47.0)),
        ("EPSG:3031", (0.0, -71.0)),
        ("EPSG:32701", (-179.5, -17.0)),
        ("EPSG:3035", (10.0, 51.0)),
        ("EPSG:31983", (-45.0, -22.0)),
        ("EPSG:6677", (139.8, 36.0)),
        ("EPSG:5514", (15.0, 49.5)),
        (UNKNOWN_UTM, ARKANSAS),
        (MADE_UP, ARKANSAS),
        (STOLEN, ARKANSAS),
        ("+proj=utm +zone=33 +ellps=bessel +towgs84=577,90,464,5.1,1.5,5.3,2.4 +type=crs", (15.0, 48.0)),
    ],
)
def test_what_is_made_for_a_place_is_taken_there_without_a_word(text, place):
    crs = pyproj.CRS.from_user_input(text)
    ears = Ears()
    # As old LAS files and shapefiles hold it, without its area.
    for wanted in (crs, pyproj.CRS.from_wkt(crs.to_wkt("WKT1_GDAL"))):
        check_place(wanted, on_map(wanted, *place), "a.laz", ears)
        check_lon_lat(wanted, *place, "--crs")
    assert not ears.heard


@pytest.mark.parametrize("text", ["EPSG:3857", WEB, "EPSG:32662", "EPSG:5070", "EPSG:3035", "EPSG:32613", "EPSG:32614"])
def test_a_map_that_stretches_names_the_scale_and_the_zone(text):
    crs = pyproj.CRS.from_user_input(text)
    point = on_map(crs, *ARKANSAS)
    with pytest.raises(CRSError, match=r"^a\.laz: .*EPSG:32615 \(WGS 84 / UTM zone 15N\)\.$") as found:
        check_place(crs, point, "a.laz")
    assert "m on the map" in str(found.value) or "made for" in str(found.value) or "easting" in str(found.value)
    with pytest.raises(CRSError, match=r"^--crs: .*give --crs EPSG:32615"):
        check_lon_lat(crs, *ARKANSAS, "--crs")
    if text in ("EPSG:3857", WEB):
        with pytest.raises(CRSError, match="1.1994 to 1.2050 m on the map"):
            ground_scale(crs, *point[0, :2])


@pytest.mark.parametrize(
    ("text", "xy", "words"),
    [
        ("EPSG:32615", (-190.0, 30.0), "local metres by their size"),
        ("EPSG:32615", (-190.0, 3_718_451.0), "easting from 0 to 1000000"),
        ("EPSG:32715", (-190.0, 30.0), "local metres"),
        (UNKNOWN_UTM, (-190.0, 30.0), "local metres"),
        ("EPSG:32615", ARKANSAS, "have to be projected, "),
        ("EPSG:2154", (2.3, 44.0), "have to be projected, "),
        ("EPSG:32662", ARKANSAS, "degrees"),
        ("EPSG:3857", (0.0, 0.0), "degrees or local"),
        ("EPSG:32615", (3_718_451.0, 611_337.0), "exchanged"),
        ("EPSG:2154", (6_500_000.0, 650_000.0), "exchanged"),
        ("EPSG:2193", (5_427_000.0, 1_749_000.0), "exchanged"),
        ("EPSG:32615", (1e9, 1e9), "cannot lie"),
        ("EPSG:2154", (611_300.0, 3_718_400.0), "made for longitudes"),
        ("EPSG:32615", (611_337.0, 13_718_451.0), "."),
        ("EPSG:32615", (1e300, -1e300), r"x 1e\+300, y -1e\+300\) cannot lie"),
        ("+proj=airy +ellps=WGS84 +units=m +type=crs", (611_337.0, 371_845.0), "cannot lie"),
    ],
)
def test_coordinates_that_cannot_lie_in_the_crs(text, xy, words):
    with pytest.raises(CRSError, match=words) as found:
        check_place(pyproj.CRS.from_user_input(text), np.array([[*xy, 100.0]] * 3), "a.laz")
    assert str(found.value).startswith("a.laz: ") and "inf" not in str(found.value) and "nan" not in str(found.value)


def test_a_neighbouring_zone_is_reported_and_the_far_north_is_not_refused():
    """Norway measures in zone 33 from coast to border, and Bergen's eastings are negative there."""
    for code, place, better in (
        (32615, (-89.0, 33.6), "32616"),
        (25832, (14.9, 55.1), "32633"),
        (25833, (5.3, 60.4), "32631"),
        (32760, (-179.9, -17.0), "32701"),
    ):
        crs, ears = pyproj.CRS.from_epsg(code), Ears()
        check_place(crs, on_map(crs, *place), "a.laz", ears)
        assert len(ears.heard) == 1 and f"EPSG:{better}" in ears.heard[0] and "outside of the area" in ears.heard[0]
    ears, crs = Ears(), pyproj.CRS.from_epsg(3347)
    check_place(crs, on_map(crs, -100.0, 50.0), "a.laz", ears)
    assert "0.9962 m on the map" in ears.heard[0], "a scale that plots feel is reported inside the area too"


def test_one_stray_point_decides_nothing():
    crs = pyproj.CRS.from_epsg(32615)
    points = np.repeat(on_map(crs, *ARKANSAS), 100, axis=0)
    points[7] = (1e9, -1e9, 0.0)
    points[8] = np.nan
    check_place(crs, points, "a.laz")


def test_the_zone_that_fits():
    crs, other = pyproj.CRS.from_epsg(6344), pyproj.CRS.from_epsg(32614)
    there = on_map(crs, *ARKANSAS)[:, :2]
    numbers = on_map(other, *ARKANSAS)[:, :2]

    def near(xy):
        return bool(np.hypot(*(xy - there).T).max() < 5)

    assert zone_hint("in {zone}", crs, numbers, near) == "in EPSG:32614, WGS 84 / UTM zone 14N"
    assert zone_hint("in {zone}", crs, there + 5000, near) == ""
    for no_zone in (pyproj.CRS.from_epsg(2154), None):
        assert zone_hint("in {zone}", no_zone, numbers, near) == ""


@pytest.mark.parametrize("code", [32615, 26951, 32616])
def test_the_local_frame_is_ground(code, tmp_path):
    """A hundred metres on the ellipsoid are a hundred metres in the frame, whatever the map makes of them."""
    crs = pyproj.CRS.from_epsg(code)
    lon, lat = (-91.8, 33.6) if code != 32616 else (-91.0, 33.6)
    ends = pyproj.Geod(ellps="WGS84").fwd(np.full(8, lon), np.full(8, lat), np.arange(0, 360, 45), np.full(8, 100.0))
    flat = pyproj.Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True)
    middle, ring = np.array(flat.transform(lon, lat)), np.column_stack(flat.transform(*ends[:2]))
    frame = LocalFrame.around(crs, np.array([[*middle, 0.0]]))
    local = frame.to_local(np.column_stack([ring, np.full(8, 20.0)]))
    centre = frame.to_local(np.array([[*middle, 20.0]]))
    np.testing.assert_allclose(np.hypot(*(local - centre)[:, :2].T), 100.0, atol=1e-3)
    np.testing.assert_allclose(local[:, 2], 20.0)
    np.testing.assert_allclose(frame.to_project(local)[:, :2], ring, atol=1e-6)
    frame.save(tmp_path / "frame.json")
    again = LocalFrame.load(tmp_path / "frame.json")
    assert again.scale == frame.scale != 1.0
    np.testing.assert_allclose(again.to_local(ring @ np.eye(2, 3)), frame.to_local(ring @ np.eye(2, 3)))


def test_a_terrain_model_is_asked_in_the_same_ground_metres():
    """Ten kilometres from the origin a scale of 1.004 is 40 m: a slope shows it."""
    heights = np.broadcast_to(100.0 + 0.5 * np.arange(400), (4, 400))
    dtm = Dtm(heights.copy(), Affine(50.0, 0, 500_000.0, 0, -50.0, 3_700_100.0))
    frame = LocalFrame(pyproj.CRS.from_epsg(32615), np.array([501_000.0, 3_700_000.0, 90.0]), 1.004)
    local = np.array([[10_000.0, 5.0, 0.0], [-400.0, 20.0, 0.0]])
    there = frame.to_project(local)
    np.testing.assert_allclose(there[:, 0], [511_040.0, 500_598.4])
    np.testing.assert_allclose(dtm.local(frame)(*local.T[:2]), dtm.height(*there.T[:2]) - 90.0)
    assert dtm.local(frame)(10_000.0, 5.0) - dtm.shifted(frame.origin)(10_000.0, 5.0) == pytest.approx(0.4, abs=1e-6)


def test_a_map_that_cannot_be_turned_back_or_of_another_planet_ends_with_a_sentence():
    for text in (
        "+proj=airy +ellps=WGS84 +units=m +type=crs",
        "IAU_2015:49910",
        "+proj=gnom +lat_0=-40 +lon_0=90 +type=crs",
    ):
        with pytest.raises(CRSError, match=r"does not reach longitude -91.800, .*EPSG:32615"):
            check_lon_lat(pyproj.CRS.from_user_input(text), *ARKANSAS, "--crs")
