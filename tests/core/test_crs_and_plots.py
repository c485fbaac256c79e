"""Reference frames and plots: nothing is measured in degrees or feet."""

from __future__ import annotations

import numpy as np
import pyproj
import pytest
import rasterio
from hypothesis import given, settings
from hypothesis import strategies as st
from rasterio.transform import from_origin

from treedgs_geo.core.crs import LocalFrame, check_projected, lonlat_to_project, project_crs
from treedgs_geo.core.errors import CRSError, InputError
from treedgs_geo.core.frames import frame_named, heights_named, suggest_utm, transform, usual_crs
from treedgs_geo.core.plots import read_plots
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.pointcloud.files import read_cloud, write_cloud
from treedgs_geo.terrain.dtm import read_dtm


def test_geographic_crs_is_refused_with_the_utm_zone():
    with pytest.raises(CRSError, match="EPSG:32615"):
        check_projected(pyproj.CRS("EPSG:4326"), "--crs", (-91.8, 33.6))
    assert suggest_utm(151.2, -33.9).to_epsg() == 32756


def test_advice_names_the_zone_of_the_file_or_none(tmp_path):
    degrees = pyproj.CRS.from_epsg(4326)
    for middle in (None, (611_300.0, 3_718_400.0)):
        with pytest.raises(CRSError, match=r"use the UTM zone of your plot\.$"):
            check_projected(degrees, "--crs", middle)
    with pytest.raises(CRSError, match="give one like EPSG:CODE"):
        project_crs("nonsense")
    write_cloud(tmp_path / "a.laz", PointCloud(np.array([[11.57, 48.14, 520.0], [11.58, 48.15, 530.0]]), degrees), 1e-7)
    with pytest.raises(CRSError, match=r"your plot, EPSG:32632 \(WGS 84 / UTM zone 32N\)\.$"):
        read_cloud(tmp_path / "a.laz")
    grid = {"crs": degrees, "transform": from_origin(11.57, 48.15, 0.001, 0.001)}
    with rasterio.open(tmp_path / "a.tif", "w", width=9, height=9, count=1, dtype="float32", **grid) as raster:
        raster.write(np.arange(500, 581, dtype="float32").reshape(1, 9, 9))
    with pytest.raises(CRSError, match=r"your plot, EPSG:32632 "):
        read_dtm(tmp_path / "a.tif")


@pytest.mark.parametrize(
    ("text", "words"), [("EPSG:2246", "US survey foot"), ("EPSG:4326", "geographic"), ("nonsense", "not a")]
)
def test_unusable_crs_is_refused(text, words):
    with pytest.raises(CRSError, match=words):
        project_crs(text)


@given(st.floats(-400, 400), st.floats(-400, 400), st.floats(-50, 50))
def test_local_frame_loses_no_tenth_of_a_millimetre(dx, dy, dz):
    frame = LocalFrame.around(project_crs("EPSG:6344"), np.array([[611337.2, 3718451.6, 38.2]]))
    point = np.array([[611337.172 + dx, 3718451.614 + dy, 38.0 + dz]])
    local = frame.to_local(point).astype(np.float32)
    assert np.abs(frame.to_project(local) - point).max() < 1e-4


def test_lonlat_matches_the_known_plot_centre():
    centre = lonlat_to_project(project_crs("EPSG:6344"), [-91.80000135], [33.60000122], [40.0])
    assert np.allclose(centre, [[611337.172, 3718451.614, 40.0]], atol=0.02)


def test_plots_in_lonlat_and_in_metres_agree(tmp_path):
    table = tmp_path / "plots.csv"
    table.write_text(
        "plot_id,lon,lat,easting,northing,epsg,radius_m\np,-91.80000135,33.60000122,611337.172,3718451.614,6344,10\n"
    )
    metric = read_plots(table, project_crs("EPSG:6344"))[0]
    table.write_text("plot_id,lon,lat,radius_m\np,-91.80000135,33.60000122,10\n")
    geographic = read_plots(table, project_crs("EPSG:6344"))[0]
    assert np.hypot(metric.x - geographic.x, metric.y - geographic.y) < 0.02
    table.write_text("plot_id,easting,northing,epsg,radius_m\np,611337.172,3718451.614,6344,10\n")
    other_zone = read_plots(table, project_crs("EPSG:6343"))[0]
    assert abs(other_zone.x - metric.x) > 1e5


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("plot_id,radius_m\np,10\n", "lacks the easting .* the northing"),
        ("plot_id,easting,northing,radius_m\np,x,1,10\n", "line 2"),
        ("plot_id,easting,northing,radius_m\np,1,1,-10\n", "radius_m is -10"),
        ("plot_id,easting,northing,radius_m\np,1,1,5\np,2,2,5\n", "appears twice"),
        ("plot_id,easting,northing,epsg,radius_m\np,1,1,99,5\n", "epsg '99' is unknown"),
    ],
)
def test_bad_plot_tables_are_refused(tmp_path, text, words):
    table = tmp_path / "plots.csv"
    table.write_text(text)
    with pytest.raises(InputError, match=words):
        read_plots(table, project_crs("EPSG:6344"))


@settings(max_examples=30)
@given(st.floats(-96.0, -90.1), st.floats(29, 48), st.floats(-100, 4000))
def test_there_and_back_through_frames_loses_no_millimetre(lon, lat, height):
    there = transform(pyproj.CRS("EPSG:7912"), pyproj.CRS("EPSG:6344"), np.array([[lon, lat, height]]), "x", 2026.3)
    back = transform(pyproj.CRS("EPSG:6344"), pyproj.CRS("EPSG:7912"), there, "x", 2026.3)
    assert np.abs(back[0, :2] - (lon, lat)).max() < 1e-8 and abs(back[0, 2] - height) < 1e-3
    same = lonlat_to_project(pyproj.CRS("EPSG:6344"), [lon], [lat], [height])
    # NAD83 lies 1 to 2 m from ITRF2014 over the conterminous US
    assert 0.8 < np.linalg.norm(there - same) < 2.5


@settings(max_examples=20)
@given(st.floats(0, 600), st.floats(-5, 5), st.floats(-5, 5))
def test_a_plot_in_feet_is_a_plot_in_metres(depth, dx, dy):
    """State plane feet of a plots table become the project's metres (EPSG:6411: Arkansas North)."""
    import tempfile
    from pathlib import Path

    east, north = 611337.0 + dx + depth, 3718451.0 + dy
    feet = pyproj.Transformer.from_crs("EPSG:6344", "EPSG:6411", always_xy=True).transform(east, north)
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "plots.csv"
        table.write_text(f"plot_id,easting,northing,epsg,radius_m\np,{feet[0]!r},{feet[1]!r},6411,10\n")
        found = read_plots(table, project_crs("EPSG:6344"))[0]
    assert abs(found.x - east) < 1e-3 and abs(found.y - north) < 1e-3


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("EPSG:6344+6360", "US survey foot"),
        ("EPSG:4979", "geographic"),
        ("EPSG:4978", "degrees|geographic"),
        ("EPSG:2277", "US survey foot"),
        ("EPSG:2222", "foot"),
        ('LOCAL_CS["local feet",UNIT["foot",0.3048]]', "foot"),
    ],
)
def test_every_unusable_crs_says_why(text, words):
    with pytest.raises(CRSError, match=words):
        project_crs(text)


def test_an_engineering_crs_has_no_place_on_the_map():
    local = project_crs('LOCAL_CS["local metres",UNIT["metre",1]]')
    with pytest.raises(CRSError, match="not tied to a datum"):
        lonlat_to_project(local, [1.0], [2.0], [3.0])


def test_vertical_datums_are_named():
    assert heights_named(pyproj.CRS("EPSG:6344")) == ""
    assert heights_named(pyproj.CRS("EPSG:6344").to_3d()) == "ellipsoid"
    assert heights_named(pyproj.CRS("EPSG:6344+5703")) == "NAVD88 height"
    assert frame_named("WGS84") is None and frame_named("NAD83(2011) epoch 2010.0").to_epsg() == 6319
    assert frame_named("IGb14 / ITRF2014").to_epsg() == 7912


def test_a_missing_geoid_is_named_and_no_ballpark_is_taken():
    point = np.array([[-91.8, 33.6, 100.0]])
    with pytest.raises(CRSError, match=r"us_noaa_g2018u0\.tif"):
        transform(pyproj.CRS("EPSG:6319"), pyproj.CRS("EPSG:6344+5703"), point, "geotags")
    with pytest.raises(CRSError, match="2 m only"):
        transform(pyproj.CRS("EPSG:4979"), pyproj.CRS("EPSG:6344"), point, "geotags")
    # the drift of ten years in Europe is a quarter of a metre: the date counts
    rome = np.array([[12.5, 41.9, 100.0]])
    then, now = (transform(pyproj.CRS("EPSG:7912"), pyproj.CRS("EPSG:25833"), rome, "x", year) for year in (2016, 2026))
    assert 0.15 < np.linalg.norm(now - then) < 0.35


def test_nothing_known_stays_nothing_known():
    points = np.array([[np.nan, 33.6, 1.0], [-91.8, 33.6, 1.0]])
    moved = transform(pyproj.CRS("EPSG:6319"), pyproj.CRS("EPSG:6344"), points, "x")
    assert np.isnan(moved[0]).all() and np.isfinite(moved[1]).all()


USUAL = [
    (-91.8, 33.6, 6344, "United States"),  # Arkansas
    (-155.5, 19.7, 6635, "Hawaii"),
    (-123.5, 50.5, 3157, "Canada"),  # British Columbia
    (-71.2, 46.8, 2960, "Canada"),  # Québec, within the box of the zone of Maine
    (-69.0, 45.5, 6348, "United States"),  # Maine
    (146.3, -37.5, 7855, "Australia"),  # Victoria: MGA zone 55
    (176.2, -38.3, 2193, "New Zealand"),
    (8.4, 48.1, 25832, "Europe"),  # Black Forest
    (6.96, 50.94, 25832, "Europe"),  # Cologne, within the Dutch box
    (14.5, 47.5, 25833, "Europe"),  # Styria
    (5.8, 52.1, 28992, "Netherlands"),
    (7.45, 46.95, 2056, "Switzerland"),
    (-8.2, 53.2, 2157, "Ireland"),
    (15.2, 60.6, 3006, "Sweden"),
    (25.8, 62.2, 3067, "Finland"),
    (-48.6, -25.4, 31982, "Latin America"),  # Paraná: SIRGAS 2000
    (36.9, -0.4, 32737, "UTM zone"),  # Kenya: WGS 84
]


@pytest.mark.parametrize(("lon", "lat", "epsg", "why"), USUAL)
def test_the_usual_crs_of_a_place(lon, lat, epsg, why):
    crs, said = usual_crs(lon, lat)
    assert crs.to_epsg() == epsg and why in said
    assert check_projected(crs, "--crs") == crs


def test_the_british_grid_is_usual_where_its_transformation_is_installed():
    """Else UTM, and the sentence names the file that lacks."""
    crs, said = usual_crs(-0.5, 51.3)
    lacks = "not EPSG:27700, OSGB36 / British National Grid, as" in said and "uk_os_OSTN15" in said
    assert (crs.to_epsg() == 25830 and lacks) or (crs.to_epsg() == 27700 and "United Kingdom" in said)


def test_the_frame_that_a_solution_names_decides_with_the_place():
    itrf = pyproj.CRS("EPSG:7912")
    assert usual_crs(15.2, 50.6, itrf)[0].to_epsg() == 25833, "ETRS89 can be reached from ITRF2014"
    assert usual_crs(-71.2, 46.8, pyproj.CRS("EPSG:6319"))[0].to_epsg() == 6348, "no way from NAD83(2011) to (CSRS)"
    with pytest.raises(CRSError, match=r"none is known for longitude 174\.000.*not EPSG:2193.*no way from ETRS89"):
        usual_crs(174.0, -40.0, pyproj.CRS("EPSG:4937"))


@pytest.mark.parametrize(("epsg", "lon", "lat"), [(28992, 5.8, 52.1), (2056, 8.2, 46.9), (31287, 14.5, 47.5)])
def test_positions_by_satellite_are_on_no_datum_that_was_surveyed_on_the_ground(epsg, lon, lat):
    """Before: Dutch, Swiss and Austrian grids were 86 to 167 m off, without a word."""
    crs = pyproj.CRS(epsg)
    east, north, height = lonlat_to_project(crs, np.array([lon]), np.array([lat]), np.array([321.0]))[0]
    back = pyproj.Transformer.from_crs(crs, 4326, always_xy=True).transform(east, north)
    assert back == pytest.approx((lon, lat), abs=1e-6) and height == 321.0
    # The grid's own degrees are still its own.
    own = lonlat_to_project(crs, np.array([lon]), np.array([lat]), np.array([0.0]), crs.geodetic_crs.to_3d())[0]
    assert 50 < np.hypot(*(own - (east, north, 0))[:2]) < 200
