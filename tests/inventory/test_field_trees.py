"""The field tally: units, north, slope and face, and the mistakes that must be reported."""

from __future__ import annotations

from datetime import date

import numpy as np
import pyproj
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from treedgs_geo.core.errors import InputError
from treedgs_geo.core.plots import Plot
from treedgs_geo.inventory.declination import declination_deg
from treedgs_geo.inventory.field_trees import bearing_to_grid_deg, drop_unplaced, place, read_field_trees
from treedgs_geo.inventory.options import FieldProtocol
from treedgs_geo.inventory.stand.treelist import from_layer

UTM = pyproj.CRS.from_epsg(6344)
PLOT = Plot("a", 611337.0, 3718451.0, 10.0)
HEAD = "plot_id,tree_id,azimuth_deg,distance_m,dbh_cm\n"


def tally(tmp_path, text, **protocol):
    path = tmp_path / "field.csv"
    path.write_text(text, encoding="utf-8")
    return read_field_trees(path, FieldProtocol(**protocol))


def test_bearing_and_distance_by_every_north(tmp_path):
    trees = tally(tmp_path, HEAD + "a,1,90,10,20\n")
    grid = place(trees, [PLOT], UTM, FieldProtocol(north="grid"))
    assert grid.loc[0, ["x", "y"]].tolist() == pytest.approx([PLOT.x + 10, PLOT.y])
    # East of the central meridian true north lies to the left of grid north here: convergence +0.66 degrees.
    true = place(trees, [PLOT], UTM, FieldProtocol(north="true"))
    assert np.degrees(np.arctan2(true.y[0] - PLOT.y, true.x[0] - PLOT.x)) == pytest.approx(0.664, abs=0.01)
    magnetic = place(trees, [PLOT], UTM, FieldProtocol(north="magnetic", declination_deg=-8.29))
    turned = np.degrees(np.arctan2(magnetic.y[0] - PLOT.y, magnetic.x[0] - PLOT.x))
    assert turned == pytest.approx(0.664 + 8.29, abs=0.01)
    with pytest.raises(InputError, match="declination"):
        place(trees, [PLOT], UTM, FieldProtocol(north="magnetic"))


def test_convergence_agrees_with_a_point_due_north():
    """A target a little further north on the same meridian must get the grid bearing that ``place`` gives 0 degrees."""
    import pandas as pd

    to_degrees = pyproj.Transformer.from_crs(UTM, UTM.geodetic_crs.to_2d(), always_xy=True)
    lon, lat = to_degrees.transform(PLOT.x, PLOT.y)
    x, y = to_degrees.transform(lon, lat + 1e-4, direction="INVERSE")
    row = pd.DataFrame({"plot_id": ["a"], "field_id": ["1"], "azimuth_deg": [0.0], "distance_m": [10.0]})
    put = place(row, [PLOT], UTM, FieldProtocol())
    assert np.arctan2(put.x[0] - PLOT.x, put.y[0] - PLOT.y) == pytest.approx(
        np.arctan2(x - PLOT.x, y - PLOT.y), abs=1e-5
    )


def test_slope_face_feet_and_inches(tmp_path):
    trees = tally(
        tmp_path,
        "plot,tree,azimuth,dist_ft,dbh_in,slope_pct\na,1,0,50,10,100\n",
        distance="slope",
        to="face",
    )
    assert trees.dbh_cm[0] == pytest.approx(25.4)
    assert trees.distance_m[0] == pytest.approx(50 * 0.3048 * np.cos(np.pi / 4) + 0.127)


@pytest.mark.parametrize(
    ("text", "protocol", "message"),
    [
        (HEAD + "a,1,370,5,20\n", {}, "line 2: bearing 370.*name the column azimuth_gon"),
        (HEAD + "a,1,40,5,20\na,2,3200,5,20\n", {}, "line 3: bearing 3200.*name the column azimuth_mil"),
        (HEAD.replace("_deg", "_gon") + "a,1,401,5,20\n", {}, "line 2: bearing 401, expected 0 to 400 gon"),
        (HEAD + "a,1,-5,5,20\n", {}, "line 2: bearing -5, expected 0 to 360 degrees; correct it"),
        (HEAD + "a,1,,5,20\na,2,x,5,20\na,3,9,5,20\n", {}, "line 2: azimuth_deg is empty.*2 of 3 rows"),
        (HEAD + "a,1,10,5,312\na,2,20,5,290\n", {}, "290 to 312 cm"),
        (HEAD + "a,1,10,5,180\na,2,20,5,133\na,3,9,5,90\n", {}, "median 133, all whole.*--dbh-unit mm"),
        (HEAD + "a,1,10,5,91\na,2,20,5,66\na,3,9,5,55\n", {}, "--dbh-unit mm.*--dbh-unit cm"),
        (HEAD + "a,1,10,5,20\na,1,20,5,20\n", {}, "line 3: tree 1 appears twice"),
        (HEAD + "a,1,10,,20\n", {}, "line 2: distance_m"),
        (HEAD + "a,1,10,nan,20\n", {}, "distance_m"),
        (HEAD + "a,1,10,5,inf\n", {}, "dbh_cm"),
        (HEAD + "a,1,10,5,0.20\na,2,20,5,0.31\n", {}, "0.2 to 0.31 cm"),
        (HEAD.replace("dbh_cm", "DBH") + "a,1,10,5,0.20\n", {}, "--dbh-unit"),
        (HEAD.replace("distance_m", "Dist") + "a,1,10,5,20\n", {}, "--distance-unit"),
        (HEAD + "a,1,10,5,20\n", {"distance": "slope"}, "slope_deg or slope_pct"),
        (HEAD + "a,1,10,5,\n", {"to": "face"}, "--to pith"),
        (HEAD + "a,1,10,500,20\n", {}, "0 to 200 m"),
        (HEAD, {}, "holds no row"),
        ("", {}, "is empty"),
        ("plot_id,tree_id,dbh_cm\na,1,20\n", {}, "found columns"),
    ],
)
def test_mistakes_are_reported(tmp_path, text, protocol, message):
    with pytest.raises(InputError, match=message.replace("(", r"\(")):
        tally(tmp_path, text, **protocol)


def test_unknown_plot_is_reported(tmp_path):
    trees = tally(tmp_path, HEAD + "b,1,10,5,20\n")
    with pytest.raises(InputError, match="plot b is not in the plots table"):
        place(trees, [PLOT], UTM, FieldProtocol())


def test_a_tree_without_dbh_is_kept(tmp_path):
    trees = tally(tmp_path, HEAD + "a,1,10,5,\na,2,20,5,30\n")
    assert np.isnan(trees.dbh_cm[0]) and trees.dbh_cm[1] == 30


@given(st.text(max_size=200))
def test_any_text_is_parsed_or_refused(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("fuzz") / "field.csv"
    path.write_text(HEAD + text, encoding="utf-8", errors="replace")
    try:
        trees = read_field_trees(path, FieldProtocol())
    except InputError as problem:
        assert str(path) in str(problem)
    else:
        placed, said = drop_unplaced(trees, path)
        assert np.isfinite(placed[["azimuth_deg", "distance_m"]].to_numpy(float)).all()
        assert len(said) == (len(placed) < len(trees))


@pytest.mark.parametrize(
    ("lon", "lat", "year", "expected"),
    # Test values that NOAA publishes with WMM2025 and WMM2020 (height 0 km).
    [
        (0, 80, 2025, 1.28),
        (120, 0, 2025, -0.16),
        (240, -80, 2025, 68.78),
        (0, 80, 2020, -1.28),
        (120, 0, 2020, 0.16),
        (240, -80, 2020, 69.36),
    ],
)
def test_declination_against_the_model_s_own_test_values(lon, lat, year, expected):
    found = declination_deg(lon - 360 if lon > 180 else lon, lat, 0.0, date(year, 1, 1), "test")
    assert found == pytest.approx(expected, abs=0.02)


def test_magnetic_bearings_by_place_and_date(tmp_path):
    trees = tally(tmp_path, HEAD + "a,1,90,10,20\n")
    day = FieldProtocol(north="magnetic", field_date="2025-07-01")
    by_date = place(trees, [PLOT], UTM, day)
    declination = declination_deg(-91.8, 33.6, 0.0, date(2025, 7, 1), "test")
    by_hand = place(trees, [PLOT], UTM, FieldProtocol(north="magnetic", declination_deg=declination))
    assert abs(declination) > 0.2
    np.testing.assert_allclose(by_date[["x", "y"]], by_hand[["x", "y"]], atol=1e-4)
    # a date column, row by row, beats the option
    dated = tally(tmp_path, HEAD.strip() + ",date\na,1,90,10,20,2012-07-01\na,2,90,10,21,\n")
    rows = place(dated, [PLOT], UTM, day)
    assert rows.y[0] != pytest.approx(rows.y[1], abs=0.05) and rows.y[1] == pytest.approx(by_date.y[0])
    for bad, says in (("01/07/2025", "year-month-day"), ("2025-13-01", "year-month-day"), ("1999-01-01", "outside")):
        with pytest.raises(InputError, match=says):
            place(trees, [PLOT], UTM, FieldProtocol(north="magnetic", field_date=bad))


@settings(max_examples=25)
@given(
    st.floats(0, 360),
    st.floats(0.5, 30),
    st.floats(-60, 60),
    st.floats(0, 45),
    st.floats(5, 120),
    st.sampled_from(["horizontal", "slope"]),
    st.sampled_from(["pith", "face"]),
)
def test_what_the_crew_would_measure_leads_back_to_the_tree(bearing, level, declination, slope, dbh, distance, to):
    """Forward: a tree's place -> magnetic bearing, slope distance to its face; back: ``place`` finds the place."""
    import tempfile
    from pathlib import Path

    along = np.cos(np.radians(slope)) if distance == "slope" else 1.0
    measured = (level - (dbh / 200 if to == "face" else 0.0)) / along
    if measured < 0:
        return
    convergence = bearing_to_grid_deg(PLOT, UTM, FieldProtocol())
    read = (bearing + convergence - declination) % 360
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "t.csv"
        path.write_text(HEAD.strip() + f",slope_deg\na,1,{float(read)!r},{float(measured)!r},{dbh!r},{slope!r}\n")
        protocol = FieldProtocol(north="magnetic", declination_deg=declination, distance=distance, to=to)
        found = place(read_field_trees(path, protocol), [PLOT], UTM, protocol)
    angle = np.radians(bearing)
    assert found.x[0] == pytest.approx(PLOT.x + level * np.sin(angle), abs=1e-6)
    assert found.y[0] == pytest.approx(PLOT.y + level * np.cos(angle), abs=1e-6)


@pytest.mark.parametrize(("unit", "circle"), [("deg", 360), ("gon", 400), ("mil", 6400)])
def test_bearings_in_every_unit(tmp_path, unit, circle):
    trees = tally(tmp_path, HEAD.replace("azimuth_deg", f"Bearing_{unit}") + f"a,1,{circle / 4},10,20\n")
    assert trees.azimuth_deg[0] == pytest.approx(90.0)
    east = place(trees, [PLOT], UTM, FieldProtocol(north="grid"))
    assert east.loc[0, ["x", "y"]].tolist() == pytest.approx([PLOT.x + 10, PLOT.y])


def test_one_empty_bearing_leaves_out_that_row_alone(tmp_path):
    rows = "a,1,10,5,20\na,2,,6,30\na,3,30,7,25\na,4,40,?,22\na,5,50,9,21\n"
    trees = tally(tmp_path, HEAD + rows)
    assert len(trees) == 5 and trees.dbh_cm.tolist() == [20, 30, 25, 22, 21]
    placed, (said,) = drop_unplaced(trees, tmp_path / "field.csv")
    assert placed.field_id.tolist() == ["1", "3", "5"] and "2 of 5 field trees left out" in said
    assert "line 3 (tree 2: azimuth_deg is empty)" in said and "line 5 (tree 4: distance_m is '?')" in said
    face = tally(tmp_path, HEAD + "a,1,10,5,20\na,2,20,6,\na,3,30,7,25\n", to="face")
    assert "tree 2: no DBH" in drop_unplaced(face, tmp_path)[1][0]
    level = "a,1,10,5,20,10\na,2,20,6,30,\na,3,30,7,25,0\n"
    level = tally(tmp_path, HEAD.strip() + ",slope_deg\n" + level, distance="slope")
    assert "tree 2: slope_deg is empty" in drop_unplaced(level, tmp_path)[1][0]
    grid = tally(tmp_path, "plot_id,tree_id,easting,northing,dbh_cm\na,1,5,6,20\na,2,7,,30\na,3,8,9,30\n")
    assert drop_unplaced(grid, tmp_path)[0].field_id.tolist() == ["1", "3"] and np.isnan(grid.x[1])


def test_diameters_in_millimetres(tmp_path):
    """The name says centimetres, the values do not: the option decides either way."""
    thin = HEAD + "a,1,10,5,180\na,2,20,5,133\na,3,9,5,90\n"
    assert tally(tmp_path, thin, dbh_unit="mm").dbh_cm.tolist() == [18.0, 13.3, 9.0]
    assert tally(tmp_path, thin, dbh_unit="cm").dbh_cm.tolist() == [180, 133, 90]
    assert tally(tmp_path, thin.replace("dbh_cm", "dbh_mm")).dbh_cm.tolist() == [18.0, 13.3, 9.0]
    assert tally(tmp_path, thin.replace("dbh_cm", "dbh_in"), dbh_unit="mm").dbh_cm[2] == 9.0
    # Large trees are not taken for millimetres.
    old = "".join(f"a,{k},10,5,{d}\n" for k, d in enumerate((45, 58, 120, 38, 203, 66)))
    assert tally(tmp_path, HEAD + old).dbh_cm.max() == 203


@pytest.mark.parametrize("name", ["trees", "count", "anzahl", "numero_de_arboles", "stems"])
@pytest.mark.parametrize(
    ("values", "n"), [([1, 2, 3, 4, 5, 6, 7], 7), ([1, 2, 3, 4, 3, 2, 1], 16), ([1, 1, 2, 1, 1, 1, 1], 8)]
)
def test_a_running_number_is_no_count_whatever_its_name(tmp_path, name, values, n):
    rows = "".join(f"P1,{value},{dbh}\n" for value, dbh in zip(values, (12, 16, 20, 24, 28, 32, 36), strict=True))
    path = tmp_path / "tally.csv"
    path.write_text(f"plot_id,{name},dbh_cm\n{rows}")
    trees = read_field_trees(path, FieldProtocol(), placed=False)
    assert len(trees) == n
    assert ("taken for the trees' numbers" in " ".join(trees.attrs["said"])) == (n == 7)


@pytest.mark.parametrize(
    ("column", "word", "other", "speaks"),
    [
        ("remarks", "dead", "", True),
        ("stan", "martwe", "zdrowe", True),
        ("Tree Class", "Snag", "crop tree", True),
        ("species", "Totholz", "Fichte", True),
        ("remarks", "dead top", "", False),
        ("site", "seco", "fresco", False),
        ("treatment", "cut", "", False),
        ("top", "missing", "", False),
    ],
)
def test_a_column_that_is_not_read_and_says_that_trees_are_dead_is_named(tmp_path, column, word, other, speaks):
    rows = "".join(f"a,{k},{20 + k},{word if k == 2 else other}\n" for k in range(5))
    path = tmp_path / "tally.csv"
    path.write_text(f"plot_id,tree_id,dbh_cm,{column}\n{rows}")
    trees = read_field_trees(path, FieldProtocol(), placed=False)
    said = [text for text in trees.attrs["said"] if repr(word) in text and "of 1 of 5 trees" in text]
    assert len(trees.attrs["said"]) == len(said) == int(speaks)
    assert ("remarks" in trees.attrs["unread"]) == (column == "remarks")
    # What the crew says in its own column counts, whatever stands elsewhere.
    own = rows.replace("\n", ",live\n")
    path.write_text(f"plot_id,tree_id,dbh_cm,{column},status\n{own}")
    assert not read_field_trees(path, FieldProtocol(), placed=False).attrs["said"]


def test_it_is_named_in_a_list_of_measured_trees_too(tmp_path):
    path = tmp_path / "trees.csv"
    path.write_text("tree_id,x,y,dbh_cm,stan\n1,5,5,20,martwe\n2,9,9,30,\n")
    found = from_layer(path, UTM)
    assert sum("column 'stan' says 'martwe' of 1 of 2 trees" in text for text in found.warnings) == 1


def test_a_row_that_names_a_plot_and_no_tree_is_none(tmp_path):
    """So crews write that no tree stands there; in merged cells it is the heading of the trees below it."""
    path = tmp_path / "tally.csv"
    path.write_text("plot,dbh_cm,crew\na,20,\na,30,\nb,,\nc,,nobody\nd,25,\ne,,\n")
    assert read_field_trees(path, FieldProtocol(), placed=False).plot_id.tolist() == ["a", "a", "d"]
    with_places = HEAD + "a,1,10,5,20\na,2,20,5,22\nb,,,,\n"
    assert tally(tmp_path, with_places).field_id.tolist() == ["1", "2"]
    path.write_text("plot,height_m,dbh_cm\na,,\n,20,25\n,21,26\nb,,\n,22,27\n,23,28\n")
    assert len(read_field_trees(path, FieldProtocol(), placed=False)) == 6
    # A tree that was not taped has a number.
    path.write_text("plot,tree,dbh_cm\na,1,20\na,2,\nb,1,30\n")
    assert len(read_field_trees(path, FieldProtocol(), placed=False)) == 3
