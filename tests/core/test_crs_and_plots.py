"""Reference frames and plots: nothing is measured in degrees or feet."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from treedgs_geo.core.crs import LocalFrame, check_projected, lonlat_to_project, project_crs, suggest_utm
from treedgs_geo.core.errors import CRSError, InputError
from treedgs_geo.core.plots import read_plots


def test_geographic_crs_is_refused_with_the_utm_zone():
    with pytest.raises(CRSError, match="EPSG:32615"):
        check_projected(__import__("pyproj").CRS("EPSG:4326"), "--crs", (-91.8, 33.6))
    assert suggest_utm(151.2, -33.9).to_epsg() == 32756


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
        ("", "holds no plot"),
        ("plot_id,radius_m\np,10\n", "expected plot_id"),
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
