"""Terrain: queries, files, ground classification, ground from sparse points, refusals."""

from __future__ import annotations

import numpy as np
import pyproj
import pytest
import rasterio
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from shared_data import needs_shared
from synthetic_cloud import plot_cloud

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.errors import CRSError, InputError
from treedgs_geo.pointcloud.files import read_cloud
from treedgs_geo.terrain import ground
from treedgs_geo.terrain.cloud_ground import require_same_heights
from treedgs_geo.terrain.dtm import Dtm, read_dtm, require_coverage, write_dtm
from treedgs_geo.terrain.ground import classify_ground, dtm_from_cloud, flat_ground
from treedgs_geo.terrain.sparse_ground import dtm_from_sparse

UTM = pyproj.CRS.from_epsg(32615)


def tilted(rows=40, cols=50, cell=0.5, west=611300.0, north=3718500.0, crs=UTM):
    x, y = np.meshgrid(west + (np.arange(cols) + 0.5) * cell, north - (np.arange(rows) + 0.5) * cell)
    return Dtm(100 + 0.1 * (x - west) - 0.05 * (y - north), Affine(cell, 0, west, 0, -cell, north), crs)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.3, 24.6), st.floats(-19.6, -0.3))
def test_bilinear_is_exact_on_a_plane(dx, dy):
    dtm = tilted()
    assert dtm.height(611300 + dx, 3718500 + dy) == pytest.approx(100 + 0.1 * dx - 0.05 * dy, abs=1e-9)


def test_outside_is_nan_and_missing_cells_stay_missing():
    dtm = tilted()
    assert np.isnan(dtm.height([611299.9, 611326.0, np.nan], [3718499.0, 3718499.0, 3718499.0])).all()
    dtm.heights[10, 10] = np.nan
    x, y = 611300 + 10.5 * 0.5, 3718500 - 10.5 * 0.5
    assert np.isnan(dtm.height(x, y)) and np.isfinite(dtm.height(x + 0.5, y))
    assert not dtm.covers([[x, y]])[0]


def test_shifted_and_slope():
    dtm = tilted()
    frame = LocalFrame(UTM, np.array([611310.0, 3718490.0, 100.0]))
    assert dtm.local(frame)(2.0, 1.0) == pytest.approx(dtm.height(611312.0, 3718491.0) - 100)
    assert dtm.slope_deg(611312.0, 3718491.0) == pytest.approx(np.degrees(np.arctan(np.hypot(0.1, 0.05))))


def test_file_round_trip_and_reprojected_queries(tmp_path):
    dtm = tilted()
    dtm.heights[0, 0] = np.nan
    write_dtm(tmp_path / "d.tif", Dtm(dtm.heights, dtm.transform, UTM, np.full(dtm.heights.shape, 0.3)))
    back = read_dtm(tmp_path / "d.tif", UTM)
    np.testing.assert_allclose(back.heights, dtm.heights, atol=2e-5)
    assert back.crs.to_epsg() == 32615 and back.support_m(611310.0, 3718490.0) == pytest.approx(0.3)
    other = pyproj.CRS.from_epsg(32616)
    x, y = pyproj.Transformer.from_crs(UTM, other, always_xy=True).transform(611310.0, 3718490.0)
    assert read_dtm(tmp_path / "d.tif", other).height(x, y) == pytest.approx(dtm.height(611310.0, 3718490.0), abs=1e-4)


def test_traps_of_raster_files(tmp_path):
    def write(name, values, nodata=None, crs="EPSG:32615"):
        with rasterio.open(
            tmp_path / name,
            "w",
            driver="GTiff",
            width=4,
            height=4,
            count=1,
            dtype="float32",
            crs=crs,
            nodata=nodata,
            transform=Affine(1, 0, 0, 0, -1, 4),
        ) as target:
            target.write(np.asarray(values, np.float32).reshape(4, 4), 1)
        return tmp_path / name

    silent = read_dtm(write("silent.tif", [-9999.0] + [5.0] * 15))
    assert np.isnan(silent.heights[0, 0]) and silent.heights[0, 1] == 5
    with pytest.raises(InputError, match="no ground height"):
        read_dtm(write("empty.tif", [0.0] * 16, nodata=0.0))
    with pytest.raises(CRSError, match="geographic"):
        read_dtm(write("deg.tif", [5.0] * 16, crs="EPSG:4326"))
    with pytest.raises(CRSError, match="metres"):
        read_dtm(write("feet.tif", [5.0] * 16, crs="EPSG:2277"))
    (tmp_path / "no.tif").write_text("hello")
    with pytest.raises(InputError, match="not a raster"):
        read_dtm(tmp_path / "no.tif")
    with pytest.raises(InputError, match="not found"):
        read_dtm(tmp_path / "absent.tif")


def test_coverage_and_datum_are_checked():
    rng = np.random.default_rng(0)
    xyz = plot_cloud(rng, [(3, 3, 20.0)])
    dtm = dtm_from_cloud(xyz)
    require_coverage(dtm, xyz[:, :2], "dtm")
    require_same_heights(dtm, xyz, "dtm")
    with pytest.raises(InputError, match="covers the plot"):
        require_coverage(dtm, xyz[:, :2] + 500, "dtm")
    with pytest.raises(InputError, match="vertical datum"):
        require_same_heights(dtm, xyz + (0, 0, 28.0), "dtm")


def test_ground_of_a_synthetic_plot():
    rng = np.random.default_rng(1)
    xyz = plot_cloud(rng, [(3, 3, 20.0), (8, 5, 30.0)])
    truth = 100 + 0.05 * xyz[:, 0] + 0.1 * np.sin(xyz[:, 1] / 3)
    ground = classify_ground(xyz)
    is_ground = np.abs(xyz[:, 2] - truth) < 0.05
    assert ground[is_ground].mean() > 0.99 and ground[xyz[:, 2] - truth > 0.4].mean() == 0
    dtm = dtm_from_cloud(xyz)
    error = dtm.height(xyz[:, 0], xyz[:, 1]) - truth
    assert abs(np.nanmean(error)) < 0.01 and np.nanstd(error) < 0.015 and np.isfinite(error).all()
    assert np.nanmax(dtm.support) < 1.5


def test_one_deep_outlier_makes_no_pit():
    rng = np.random.default_rng(2)
    xyz = plot_cloud(rng, [(3, 3, 20.0)])
    dtm = dtm_from_cloud(np.vstack([xyz, [[6.0, 6.0, 92.0]]]))
    assert dtm.height(6.0, 6.0) == pytest.approx(100 + 0.3 + 0.1 * np.sin(2.0), abs=0.05)


def test_sparse_ground_under_trees_and_outliers():
    """SfM-like points: ground with 3 cm noise and gaps, stems and crowns above, a few points far below."""
    rng = np.random.default_rng(4)
    xy = rng.uniform(-15, 15, (4000, 2))
    xy = xy[np.hypot(xy[:, 0] - 4, xy[:, 1] + 3) > 1.5]

    def ground(p):
        return 0.08 * p[:, 0] + 0.5 * np.sin(p[:, 0] / 6) * np.cos(p[:, 1] / 7)

    points = np.column_stack([xy, ground(xy) + rng.normal(0, 0.03, len(xy))])
    above = rng.choice(len(points), 1200, replace=False)
    points[above, 2] += rng.uniform(0.5, 15, 1200)
    points = np.vstack([points, np.column_stack([rng.uniform(-15, 15, (12, 2)), np.full(12, -9.0)])])
    dtm = dtm_from_sparse(points + (611300, 3718400, 40), crs=UTM)
    probe = rng.uniform(-13, 13, (500, 2))
    error = dtm.height(probe[:, 0] + 611300, probe[:, 1] + 3718400) - 40 - ground(probe)
    assert np.nanpercentile(np.abs(error), 95) < 0.05 and abs(np.nanmean(error)) < 0.02
    with pytest.raises(InputError, match="3-D points"):
        dtm_from_sparse(points[:10])


@pytest.mark.parametrize("slope", [0.0, 0.5])
def test_wrong_matches_below_the_ground_are_no_ground(slope):
    """As in a dense stand in wind: as many wrong points as right ones, at all heights and metres below the ground."""
    rng = np.random.default_rng(5)
    xy = rng.uniform(-15, 15, (2400, 2))
    height = np.where(np.arange(2400) < 1200, rng.normal(0, 0.1, 2400), rng.uniform(-7, 25, 2400))
    dtm = dtm_from_sparse(np.column_stack([xy, slope * xy[:, 0] + height]))
    probe = rng.uniform(-12, 12, (500, 2))
    error = dtm.height(*probe.T) - slope * probe[:, 0]
    assert abs(np.nanmedian(error)) < 0.1 and np.nanpercentile(np.abs(error), 95) < 0.35


def test_no_ground_is_said():
    with pytest.raises(InputError, match="Terrain"):
        dtm_from_cloud(np.random.default_rng(0).uniform(0, 0.3, (50, 3)))
    level = flat_ground(np.random.default_rng(0).uniform(0, 5, (1000, 3)))
    assert level.height(2.0, 2.0) < 0.1


@pytest.mark.parametrize("plot", ["plot_a", "plot_e"])
def test_rendered_lidar_ground_against_truth(plot):
    folder = needs_shared(plot)
    cloud = read_cloud(next((folder / "lidar").glob("*.laz")), attributes=())
    truth = read_dtm(folder / "dtm.tif", cloud.crs)
    dtm = dtm_from_cloud(cloud.xyz, crs=cloud.crs)
    x, y = dtm.centres()
    error = dtm.heights - truth.height(x, y)
    assert abs(np.nanmean(error)) < 0.01 and np.sqrt(np.nanmean(error**2)) < 0.02


def test_pycrown_dtm_against_its_normalised_cloud():
    """The cloud is height-normalised, the DTM is not: that has to be reported, not used."""
    folder = needs_shared("als_pycrown_dtm")
    cloud = read_cloud(folder / "POINTS.laz", attributes=())
    dtm = read_dtm(folder / "DTM.tif", cloud.crs)
    assert np.nanmin(dtm.heights) > 400
    outside = ~dtm.covers(cloud.xyz[:, :2])
    assert np.isnan(dtm.height(cloud.xyz[outside, 0], cloud.xyz[outside, 1])).all()
    with pytest.raises(InputError, match="vertical datum"):
        require_same_heights(dtm, cloud.xyz, "DTM.tif")


def test_heights_above_another_datum_are_converted_or_refused(tmp_path):
    """EGM96 lies 27 m below the ellipsoid here; NAVD88 needs a grid that is seldom installed."""
    flat = tilted()
    above_geoid = pyproj.CRS.from_user_input("EPSG:32615+5773")
    write_dtm(tmp_path / "egm.tif", Dtm(flat.heights, flat.transform, above_geoid))
    unsaid = read_dtm(tmp_path / "egm.tif", UTM)  # the project does not say its heights: nothing to convert to
    np.testing.assert_allclose(unsaid.heights, flat.heights, atol=1e-4)
    if __import__("pathlib").Path("/usr/share/proj/egm96_15.gtx").exists():
        ellipsoidal = read_dtm(tmp_path / "egm.tif", UTM.to_3d())
        np.testing.assert_allclose(ellipsoidal.heights - flat.heights, -27.06, atol=0.05)
        expected = flat.height(611310.0, 3718490.0) - 27.06
        assert ellipsoidal.height(611310.0, 3718490.0) == pytest.approx(expected, abs=0.05)
    else:
        with pytest.raises(CRSError, match="egm96"):
            read_dtm(tmp_path / "egm.tif", UTM.to_3d())
    write_dtm(tmp_path / "navd.tif", Dtm(flat.heights, flat.transform, pyproj.CRS.from_user_input("EPSG:6344+5703")))
    with pytest.raises(CRSError, match="us_noaa_g2018u0"):
        read_dtm(tmp_path / "navd.tif", pyproj.CRS.from_epsg(6344).to_3d())
    with pytest.raises(CRSError, match="US survey foot"):
        write_dtm(tmp_path / "ft.tif", Dtm(flat.heights, flat.transform, pyproj.CRS.from_user_input("EPSG:6344+6360")))
        read_dtm(tmp_path / "ft.tif", UTM)


def test_support_shows_where_the_model_is_a_guess():
    """A hole without ground points: the support band grows into it, and beyond the reach nothing is claimed."""
    rng = np.random.default_rng(8)
    xyz = plot_cloud(rng, [(3, 3, 20.0)])
    around = np.hypot(xyz[:, 0] - 6, xyz[:, 1] - 6)
    dtm = dtm_from_cloud(xyz[around > 4.0], reach_m=2.5)
    assert dtm.support_m(6.0, 1.0) < 0.5
    assert 1.5 < dtm.support_m(6.0, 8.0) < 2.5 and np.isfinite(dtm.height(6.0, 8.0))
    assert np.isnan(dtm.height(6.0, 6.0))


RELIEFS = {
    "slope": lambda xy: xy[:, 0],
    "ridge": lambda xy: -np.abs(xy[:, 0] - 6.0),
    "gorge": lambda xy: np.abs(xy[:, 0] - 6.0),
    "below a bench": lambda xy: np.maximum(xy[:, 0] - 6.0, 0.0),
    "hills": lambda xy: 2.0 * np.sin(xy[:, 0] / 2.0),
}


@pytest.mark.parametrize("steep", [0.45, 0.7, 1.0])
@pytest.mark.parametrize("relief", RELIEFS)
@pytest.mark.parametrize("large", [False, True])
def test_steep_ground_is_found(relief, steep, large, monkeypatch):
    """A cloth does not lie on slopes of 45 degrees; from where it lies the ground is followed up them; of a
    large cloud, whose lowest points are asked on coarser grids, as well."""
    if large:
        monkeypatch.setattr(ground, "MANY_LOWS", 100)

    def rise(xy):
        return steep * RELIEFS[relief](xy)

    xyz = plot_cloud(np.random.default_rng(3), [(3.0, 3.0, 25.0), (8.0, 8.0, 40.0)], relief=rise)
    xy = np.random.default_rng(4).uniform(1, 11, (200, 2))
    off = dtm_from_cloud(xyz).height(*xy.T) - (100 + rise(xy) + 0.1 * np.sin(xy[:, 1] / 3))
    # A sharp edge is rounded.
    assert np.abs(off[np.abs(xy[:, 0] - 6.0) > 1.0]).max() < 0.12 and np.abs(off).max() < 0.6
