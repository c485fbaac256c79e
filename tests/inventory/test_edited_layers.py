"""Layers and tables as people leave them: numbers as text, flags in their words, other units, one thing twice."""

from __future__ import annotations

import re
from dataclasses import replace

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely

from tests.inventory.stand_helpers import CRS, EAST, NORTH, Ears, figures, make_survey
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.plausible import odd_diameters, refuse_odd_heights
from treedgs_geo.inventory.change.run import compare_dates
from treedgs_geo.inventory.field_trees import read_field_trees
from treedgs_geo.inventory.measured import read_measured
from treedgs_geo.inventory.options import FieldProtocol
from treedgs_geo.inventory.review.apply import review_trees
from treedgs_geo.inventory.stand.treelist import from_layer, from_tally, read_tally
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.inventory.written import read_written
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.verbs.compare import CompareSettings


@pytest.fixture
def survey(tmp_path):
    return make_survey(tmp_path)


def edited(folder, change, name="edited.gpkg"):
    """The survey's layer after a change by ``change(table)``, which may return another table."""
    table = gpd.read_file(folder / "trees.gpkg", layer="trees")
    made = change(table)
    table = table if made is None else made
    table.to_file(folder / name, layer="trees", engine="pyogrio")
    return folder / name


def basal_area(folder, path):
    stand, ears = figures(folder, trees=path)
    return stand.estimates["ba"].mean, ears


def as_text(table):
    table["dbh_cm"] = [None if pd.isna(v) else f"{v:.2f}".replace(".", ",") for v in table.dbh_cm]
    table["tree_id"] = table.tree_id.astype(str)


def as_multipoints(table):
    return table.set_geometry([shapely.MultiPoint([point]) for point in table.geometry], crs=table.crs)


def without_some_points(table):
    table.loc[table.index[:40], "geometry"] = None


def in_other_words(table):
    words = {"ok": ["OK ", "Good", "ok"], "reject": ["Rejected", "REJECT ", "refused"], "check": ["Check"]}
    table["qc_flag"] = [words[flag][k % len(words[flag])] for k, flag in enumerate(table.qc_flag)]


@pytest.mark.parametrize("change", [as_text, as_multipoints, without_some_points, in_other_words])
def test_what_an_edit_leaves_otherwise_reads_the_same(survey, change):
    right, _ = basal_area(survey, survey / "trees.gpkg")
    assert basal_area(survey, edited(survey, change))[0] == pytest.approx(right, rel=1e-4)


def test_no_tree_counts_nowhere_and_an_empty_flag_is_refused(survey):
    def gone(table):
        table.loc[table.index[1:15], "qc_flag"] = np.resize(["no tree", "No Tree", "kein Baum"], 14)

    path = edited(survey, gone)
    found = from_layer(path, CRS)
    assert found.review.rejected == 14 and len(found.trees) == 586
    by_hand = from_layer(edited(survey, lambda table: table.assign(qc_flag="reject"), "r.gpkg"), CRS)
    assert by_hand.trees["dbh_cm"].isna().all() and "with a DBH have qc_flag reject" in by_hand.warnings[0]
    for word, says in ((None, "have no word as qc_flag"), ("maybe later", "have 'maybe later' as qc_flag")):

        def odd(table, word=word):
            table.loc[table.index[1:4], "qc_flag"] = word

        with pytest.raises(InputError, match=f"3 of 600 trees .tree 1, 2, 3. {says}"):
            from_layer(edited(survey, odd, "odd.gpkg"), CRS)
    # A layer of another program without any flag is measured.
    assert (
        from_layer(edited(survey, lambda table: table.assign(qc_flag=None), "none.gpkg"), CRS)
        .trees["dbh_cm"]
        .notna()
        .sum()
    )


def test_a_tree_without_any_place_is_named(survey):
    def lost(table):
        table.loc[table.index[[3, 5]], ["geometry", "x"]] = None

    with pytest.raises(InputError, match="2 of 600 trees have no point .tree 3, 5"):
        from_layer(edited(survey, lost), CRS)
    with pytest.raises(InputError, match="tree 7 has dbh_cm 'thick', expected a number"):
        from_layer(edited(survey, lambda t: t.assign(dbh_cm=[*["20"] * 7, "thick", *["20"] * 592])), CRS)


def test_a_review_keeps_what_it_does_not_decide(survey):
    path = edited(survey, lambda table: table.assign(qc_flag=table.qc_flag.replace("ok", "Good"), mine="x"))
    decisions = survey / "d.csv"
    decisions.write_text("Baum;decision;BHD cm\n4;dbh;29,3\n")
    review_trees(path, decisions)
    table = gpd.read_file(path, layer="trees")
    assert table.qc_flag.value_counts()["Good"] > 500 and set(table.mine) == {"x"}
    assert table.rev_dbh_cm.dropna().tolist() == [29.3]
    assert len(read_written(path).entries) >= 1
    measured = float(table.dbh_cm[4])
    for text, line in ((f"4,dbh,{10 * measured:.0f}", 2), (f"6,dbh,20\n4,dbh,{measured / 10:.2f}", 3)):
        decisions.write_text(f"tree_id,decision,dbh_cm\n{text}\n")
        with pytest.raises(InputError, match=f"line {line}: a DBH of .* were measured at tree 4"):
            review_trees(path, decisions)
    review_trees(path, decisions, dbh_unit="cm")


@pytest.mark.parametrize("times", [10.0, 1 / 2.54, 0.1])
def test_diameters_edited_in_another_unit_are_refused(survey, times):
    def change(table):
        table.loc[table.index[1:4], "dbh_cm"] *= times

    with pytest.raises(InputError, match="that somebody edited .tree 1, 2, 3.: 3 of 3"):
        from_layer(edited(survey, change), CRS)


def test_a_veteran_is_a_tree(tmp_path):
    """Measured as such it counts; in a table of another program a person accepts it."""
    trees = [Tree(k, EAST + 3 * k, NORTH, dbh_cm=20.0 + k, method="photos") for k in range(9)]
    path = write_trees(tmp_path / "t.gpkg", [*trees, Tree(9, EAST - 9, NORTH, dbh_cm=251.0, method="photos")], CRS)
    assert from_layer(path, CRS).trees["dbh_cm"].max() == 251.0
    rows = "".join(
        f"{t.tree_id},{t.x},{t.y},{t.dbh_cm}," + "\n" for t in [*trees, Tree(9, EAST - 9, NORTH, dbh_cm=251.0)]
    )
    table = tmp_path / "t.csv"
    table.write_text("tree_id,x,y,dbh_cm,rev_flag\n" + rows)
    with pytest.raises(InputError, match="line 11: a DBH of 251 cm: the others are 20.0 to 28.0 cm"):
        from_layer(table, CRS)


@pytest.mark.parametrize("away", [0.05, 0.25])
def test_every_tree_twice_is_refused_and_one_pair_is_said(survey, away):
    def twice(table, n=600):
        more = table.iloc[:n].copy()
        more["tree_id"] += 1000
        more["x"] += away
        more = more.set_geometry(shapely.points(more.x, more.y, more.z_ground), crs=table.crs)
        return gpd.GeoDataFrame(pd.concat([table, more], ignore_index=True), crs=table.crs)

    with pytest.raises(InputError, match="counts? (twice|double)"):
        from_layer(edited(survey, twice), CRS)
    if away == 0.05:
        found = from_layer(edited(survey, lambda table: twice(table, 3), "few.gpkg"), CRS)
        assert "1 and 1001" in found.warnings[0] and "stand in one another" in found.warnings[0]


def test_one_layer_is_not_two_dates(survey):
    settings = CompareSettings(
        before=survey / "trees.gpkg",
        after=edited(survey, lambda table: table.to_crs(32615), "moved.gpkg"),
        years=5,
        plots=None,
        output=survey / "change",
    )
    with pytest.raises(InputError, match="it is the same measurement"):
        compare_dates(settings, Ears())

    def grown(table):
        return table.assign(dbh_cm=table["dbh_cm"] + np.where(np.arange(len(table)) % 3 > 0, 1.1, 0.0))

    ears = Ears()
    compare_dates(replace(settings, after=edited(survey, grown, "part.gpkg")), ears)
    assert any("to the digit" in text for text in ears.warnings)


def _tally(tmp_path, text, read=read_tally, **protocol):
    path = tmp_path / "tally.csv"
    path.write_text(text)
    return read(path, FieldProtocol(**protocol))


def test_fia_s_table_and_two_readings_of_callipers(tmp_path):
    fia = "PLT_CN,SUBP,TREE,AZIMUTH,DIST,DIA,HT,SPCD,STATUSCD\n1,1,1,12,14.2,9.8,55,131,1\n1,1,2,95,20.1,,48,131,2\n"
    found = _tally(tmp_path, fia)
    assert found.dbh_cm[0] == pytest.approx(24.892) and found.height_m[0] == pytest.approx(16.764)
    assert found.distance_m[0] == pytest.approx(14.2 * 0.3048) and found.plot_id.tolist() == ["1", "1"]
    two = "Plot;Baum;dbh1_cm;dbh2_cm\n1;1;24,1;25,3\n1;2;31,0;\n"
    assert _tally(tmp_path, two).dbh_cm.tolist() == pytest.approx([24.7, 31.0])
    with pytest.raises(InputError, match="line 3: dbh1_cm and dbh2_cm are .* two readings of one stem"):
        _tally(tmp_path, "Plot;Baum;dbh1_cm;dbh2_cm\n1;1;24,1;25,3\n1;2;31,0;13\n")
    girth = _tally(tmp_path, "plot_id,tree_id,Umfang cm\n1,1,78.5\n")
    assert girth.dbh_cm[0] == pytest.approx(78.5 / np.pi)


def test_fia_s_subplots_of_several_plots_and_trees_of_several_sizes(tmp_path):
    head = "PLT_CN,PLOT,SUBP,TREE,DIA,SPCD,TPA_UNADJ\n"
    rows = "11,7,1,1,9.8,131,6.018046\n11,7,2,1,9.1,131,6.018046\n12,8,1,1,8.8,131,6.018046\n"
    assert from_tally(*_table(tmp_path, head + rows)).trees["plot_id"].tolist() == ["7-1", "7-2", "8-1"]
    with pytest.raises(InputError, match="tpa_unadj is 6.01805 and 74.9653: its trees are of plots of several sizes"):
        from_tally(*_table(tmp_path, head + rows + "12,8,1,2,2.2,131,74.965282\n"))


def _table(tmp_path, text):
    path = tmp_path / "tally.csv"
    path.write_text(text)
    return path, FieldProtocol()


CLASSES = "A,12,8\nA,16,4\nA,20,12\nA,24,0\nB,12,8\nB,16,4\nB,20,12\nB,24,0\n"


@pytest.mark.parametrize(
    "name", ["n", "No.", "count", "Anzahl", "Stückzahl", "number of trees", "stems", "Nº de árboles"]
)
def test_a_row_of_a_class_counts_as_its_trees(tmp_path, name):
    found = from_tally(*_table(tmp_path, f"plot,dbh_cm,{name}\n" + CLASSES))
    assert found.trees.groupby(["plot_id", "dbh_cm"]).size().tolist() == [8, 4, 12] * 2
    assert found.trees["tree_id"].is_unique and "its 8 rows stand for 48 trees" in found.warnings[0]


@pytest.mark.parametrize(
    "numbers",
    [(1, 2, 3, 1, 2, 3), (1, 2, 3, 4, 5, 6), (1, 2, 4, 5, 6, 7), (6, 5, 3, 1, 2, 4), ("T1", 2, 3, 4, 5, "T6")],
)
def test_what_numbers_trees_is_no_count(tmp_path, numbers):
    plots = "AAABBB" if numbers[0] == numbers[3] else "AAAAAA"
    rows = [f"{plot},{k},{20 + row}\n" for row, (plot, k) in enumerate(zip(plots, numbers, strict=True))]
    found = from_tally(*_table(tmp_path, "plot,n,dbh_cm\n" + "".join(rows)))
    assert found.trees["tree_id"].tolist() == [str(k) for k in numbers] and not found.warnings


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("plot,dbh_cm,count\nA,12,2\nA,16,2.5\n", "line 3: count is 2.5, expected a whole number of trees"),
        ("plot,dbh_cm,count\nA,12,-2\n", "line 2: count is -2, expected a whole number"),
        ("plot,dbh_cm,count\nA,12,\n", "line 2: count is empty, expected a number"),
        ("plot,x,y,dbh_cm,n\nA,5,5,12,8\nA,5,5,16,4\n", "line 2: n is 8, expected one row a tree"),
    ],
)
def test_counts_that_are_none(tmp_path, text, says):
    with pytest.raises(InputError, match=says):
        _tally(tmp_path, text)


def test_a_tree_of_several_stems_is_one_tree(tmp_path):
    found = from_tally(
        *_table(tmp_path, "plot,tree,azimuth_deg,distance_m,dbh_cm,stems\nA,1,9,3,20,2\nA,2,50,4,30,1\n")
    )
    assert len(found.trees) == 2 and "'stems' was not used" in found.warnings[0]
    # Tags without order, of trees in no order, are no counts.
    tags = from_tally(*_table(tmp_path, "plot,no,dbh_cm\nA,311,30.1\nA,207,18.4\nA,502,25.0\n"))
    assert tags.trees["tree_id"].tolist() == ["311", "207", "502"] and not tags.warnings


def test_counts_and_words_of_dead_trees_in_a_list_of_measured_ones(tmp_path):
    path = tmp_path / "trees.csv"
    path.write_text("tree_id,x,y,dbh_cm,count\n1,5,5,20,1\n2,5,5,21,3\n")
    with pytest.raises(InputError, match="line 3: count is 3, expected one row a tree"):
        read_measured(path, None)
    path.write_text("tree_id,x,y,dbh_cm,dead\n1,5,5,20,no\n2,9,9,21,yes\n")
    assert read_measured(path, None)["status"].tolist() == ["live", "dead"]


@pytest.mark.parametrize(
    ("name", "cells", "dead"),
    [
        ("Dead", ["yes", "no", "", "X"], [True, False, False, True]),
        ("tot", ["ja", "nein", "1", "0"], [True, False, True, False]),
        ("muerto", ["sí", "no", "si", ""], [True, False, True, False]),
        ("Alive?", ["TRUE", "FALSE", "no", "dead"], [False, True, True, True]),
        ("condition", ["live", "Dead", "snag", "D"], [False, True, True, False]),
        ("condition", ["L", "D", "L", "D"], [False, True, False, True]),
        ("Vitalität", ["1", "2", "3", "2"], [False] * 4),
        ("status,dead", ["live,yes", "dead,no", "ok,", ",yes"], [True, True, False, True]),
    ],
)
def test_dead_trees_by_the_names_of_other_columns(tmp_path, name, cells, dead):
    rows = "".join(f"A,{k},{20 + k},{cell}\n" for k, cell in enumerate(cells))
    found = from_tally(*_table(tmp_path, f"plot,tree,dbh_cm,{name}\n" + rows))
    assert found.trees["dead"].tolist() == dead
    assert bool(found.warnings) == (name == "Vitalität" or "snag" in cells)  # numbers and grades are said


def test_a_number_of_dead_trees_is_not_yes_or_no(tmp_path):
    with pytest.raises(InputError, match="line 3: dead is 4, expected yes or no of one tree"):
        _tally(tmp_path, "plot,tree,dbh_cm,dead\nA,1,20,1\nA,2,22,4\n")


def test_trees_that_are_gone_leave_the_others_their_places(tmp_path):
    rows = "A,1,10,3,20,cut\nA,2,20,4,22,live\n"
    found = from_tally(*_table(tmp_path, "plot,tree,azimuth_deg,distance_m,dbh_cm,status\n" + rows))
    assert found.trees[["azimuth_deg", "distance_m", "line"]].to_numpy().tolist() == [[20, 4, 3]]


def test_merged_cells_of_plots_are_filled_down_and_other_gaps_are_not(tmp_path):
    found = from_tally(*_table(tmp_path, "plot,tree,dbh_cm\nA,1,20\n,2,22\n,3,21\nB,1,30\n,2,31\n"))
    assert found.trees["plot_id"].tolist() == [*"AAABB"] and "first row of each plot alone (A, B)" in found.warnings[0]
    path, protocol = _table(tmp_path, "plot,tree,dbh_cm\nA,1,20\n,2,22\nB,1,30\nB,2,31\n")
    assert from_tally(path, protocol).trees["plot_id"].isna().tolist() == [False, True, False, False]


def test_a_tree_without_a_plot_is_named_by_its_line(survey, tmp_path):
    head = "plot_id,tree_id,azimuth_deg,distance_m,dbh_cm\n"
    path, _ = _table(tmp_path, head + "P1,1,10,3,20\n,2,20,4,22\nP1,3,30,5,24\nP2,1,10,3,20\n")
    plots = tmp_path / "two.csv"
    plots.write_text(f"plot_id,x,y,epsg,radius_m\nP1,{EAST},{NORTH},6344,10\nP2,{EAST + 60},{NORTH},6344,10\n")
    with pytest.raises(InputError, match="Line 3 of the field table has no plot_id"):
        figures(survey, trees=None, field=path, plots=plots, north="grid")


HEAD = "plot_id,tree_id,dbh_cm,height_m\n"
GOOD = "1,1,24.1,17.2\n1,2,31,19\n1,3,18.2,14.1\n1,4,22.6,16\n1,5,12.2,12\n1,6,27.3,18.5\n"


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ("1,7,5005,15", "line 8: dbh_cm is 5005 cm, expected 0.5 to 500"),
        ("1,7,-9,15", "line 8: dbh_cm is -9 cm"),
        ("1,7,0,15", "line 8: dbh_cm is 0 cm"),
        ("1,7,99.9,15", "line 8: a DBH of 99.9 cm: .*a mark for 'not measured'"),
        ("1,7,241,15", "line 8: a DBH of 241 cm: the others are 12.2 to 31.0 cm"),
        ("1,7,18.2,1.1", "line 8: a height of 1.1 m .DBH 18.2 cm., so low that it has no DBH"),
        ("1,7,18.2,171", "line 8: a height of 171 m"),
        ("1,7,18.2,90", "line 8: a height of 90 m .DBH 18.2 cm., too much for its DBH"),
        ("1,7,18.2,17,4", "line 8: has more cells"),
    ],
)
def test_values_that_no_tree_has_are_refused_by_row(tmp_path, row, says):
    assert len(_tally(tmp_path, HEAD + GOOD)) == 6
    with pytest.raises(InputError, match=says):
        _tally(tmp_path, HEAD + GOOD + row + "\n")


def test_heights_in_feet_are_seen_by_the_stand(tmp_path):
    rows = "".join(
        f"1,{k},{d},{h / 0.3048:.1f}\n" for k, (d, h) in enumerate(((24, 17), (31, 19), (18, 14), (22, 16), (12, 12)))
    )
    with pytest.raises(InputError, match="the heights look like feet in metres"):
        _tally(tmp_path, HEAD + rows)
    with pytest.raises(InputError, match="expected up to 120"):
        refuse_odd_heights(np.array([150.0]), np.array([np.nan]), lambda bad: "t", "correct it")


def test_thick_trees_of_mixed_stands_are_trees():
    rng = np.random.default_rng(1)
    for relic in (80.0, 110.0, 145.0):
        assert not odd_diameters([*rng.normal(25, 6, 30), relic])[0].any()
    assert not odd_diameters([180, 220, 15, 250, 160, 240])[0].any()
    assert not odd_diameters([20.0, 241.0])[0].any() and not odd_diameters([])[0].any()
    assert odd_diameters([22, 25, 31, 18, 27, 24, 293])[0].tolist() == [False] * 6 + [True]


def test_distances_in_feet_are_seen_by_the_plots(tmp_path):
    from treedgs_geo.core.plots import Plot
    from treedgs_geo.inventory.field_trees import place

    rows = "".join(f"a,{k},{40 * k},{d / 0.3048:.1f},20\n" for k, d in enumerate((4.2, 9.1, 8.4, 7.7, 9.6)))
    trees = _tally(tmp_path, "plot_id,tree_id,azimuth_deg,distance_m,dbh_cm\n" + rows, read_field_trees)
    plots = [Plot("a", EAST, NORTH, 10.0)]
    with pytest.raises(InputError, match="as feet read as metres do"):
        place(trees, plots, CRS, FieldProtocol())
    assert len(place(trees, plots, CRS, FieldProtocol(distance_unit="m"))) == 5


LIST = "plot_id,tree_id,azimuth_deg,distance_m,dbh_cm,height_m,species\n"


def _crew(n=26, seed=2):
    """Rows of a tally of one plot: number, bearing, distance, DBH, height."""
    rng = np.random.default_rng(seed)
    d = rng.uniform(14, 38, n).round(1)
    h = (1.37 + (d / (1.5 + 0.19 * d)) ** 2).round(1)
    return [[k + 1, round(a, 1), round(r, 2), *dh] for k, (a, r, *dh) in enumerate(
        zip(rng.uniform(0, 360, n), rng.uniform(1, 10, n), d, h, strict=True))]  # fmt: skip


def _text(rows):
    return LIST + "".join(f"p,{','.join(map(str, row))},PITA\n" for row in rows)


def _stand_of(folder, rows, **settings):
    (folder / "tally.csv").write_text(_text(rows))
    (folder / "one.csv").write_text("plot_id,x,y,radius_m\np,611300,3718400,10\n")
    return figures(folder, trees=None, field=folder / "tally.csv", plots=folder / "one.csv", boundary=None, **settings)


def test_some_heights_in_feet_are_refused_and_stubs_said(tmp_path):
    rows = _crew()
    for row in rows[:5]:
        row[-1] = round(row[-1] / 0.3048, 1)
    with pytest.raises(InputError, match=r"line 2: heights: [45] of 26 values are 3.* as feet read as metres"):
        _stand_of(tmp_path, rows)
    rows = _crew()
    rows[3][-2:] = [36.0, 2.0]
    assert any("tree 4 (2.0 m)): look whether the height" in text for text in _stand_of(tmp_path, rows)[1].warnings)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda row: [*row[:3], round(row[3] * np.pi, 1), row[4]], "expected up to 120: look whether DBHs are girths"),
        (lambda row: [*row[:3], round(row[3] / 2.54, 1), row[4]], "as high as they are thick .median., expected 35 to"),
        (
            lambda row: [*row[:3], 120 if row[0] == 1 else row[3], row[4]],
            "tree 1 .120 cm, PITA..: look whether the DBH",
        ),
    ],
)
def test_what_hardly_a_forest_has_is_said(tmp_path, change, says):
    assert not any("look whether" in text for text in _stand_of(tmp_path, _crew())[1].warnings)
    warnings = _stand_of(tmp_path, [change(row) for row in _crew()])[1].warnings
    assert any(re.search(says, text) for text in warnings)


def test_a_tree_or_a_list_twice_is_refused(tmp_path):
    rows = _crew()
    with pytest.raises(InputError, match="line 28: is line 4 again .place and DBH."):
        _stand_of(tmp_path, [*rows, [99, *rows[2][1:]]])
    _stand_of(tmp_path, [*rows, [99, *rows[2][1:3], rows[2][3] + 4.0, rows[2][4]]])  # a fork
    bare = "dbh_cm,height_m\n" + "".join(f"{row[3]},{row[4]}\n" for row in 2 * rows)
    with pytest.raises(InputError, match="from line 28 on the list of DBHs stands there a second time"):
        _tally(tmp_path, bare)


def test_status_in_three_languages(tmp_path):
    rows = _crew()
    words = ["tot", "dürr", "Muerto", "gefällt", "talado", "3", "lebend", "vivo"]
    text = _text(rows).splitlines()
    lines = [f"{text[0]},status"] + [f"{line},{(words + [''] * 99)[k]}" for k, line in enumerate(text[1:])]
    (tmp_path / "tally.csv").write_text("\n".join(lines), encoding="utf-8")
    (tmp_path / "one.csv").write_text("plot_id,x,y,radius_m\np,611300,3718400,10\n")
    stand, _ = figures(tmp_path, trees=None, field=tmp_path / "tally.csv", plots=tmp_path / "one.csv", boundary=None)
    assert (len(stand.dead), stand.plot_rows["n_trees"].sum()) == (3, 20)
    assert any("3 trees no longer there, counted nowhere" in note for note in stand.notes)


def test_layers_in_degrees_and_layers_that_were_moved(survey):
    right, _ = basal_area(survey, survey / "trees.gpkg")
    assert basal_area(survey, edited(survey, lambda table: table.to_crs(4326)))[0] == pytest.approx(right, rel=1e-3)

    def moved(table):
        return table.set_geometry(table.geometry.translate(6.0, 0.0))

    def typed_over(table):
        table.loc[table.index[1], "dbh_cm"] *= 1.2

    for change, says in ((moved, "lie 6.0 m from their rows' x, y"), (typed_over, "is not that of the basal area")):
        assert any(says in text for text in basal_area(survey, edited(survey, change))[1].warnings), says


@pytest.mark.parametrize(("column", "times"), [("height_m", 1 / 0.3048), ("bh_m", 1 / 0.3048)])
def test_metres_edited_in_feet_are_refused(survey, column, times):
    def change(table):
        table[column] *= times

    with pytest.raises(InputError, match="feet"):
        basal_area(survey, edited(survey, change))


PLOTS = ("p", "q", "r", "s")


def _four(folder, change=lambda plot, row: row, radius="radius_m,10", seeds=(2, 3, 4, 5), more=()):
    """The stand of a tally of four plots, each row changed; the reporter, too."""
    rows = [(plot, row) for plot, seed in zip(PLOTS, seeds, strict=True) for row in _crew(16, seed)]
    lines = [f"{plot},{','.join(map(str, change(plot, row)))},PITA\n" for plot, row in (*rows, *more)]
    (folder / "tally.csv").write_text(LIST + "".join(lines))
    size, value = radius.split(",")
    places = "".join(f"{plot},{611300 + 90 * k},3718400,6344,{value}\n" for k, plot in enumerate(PLOTS))
    (folder / "four.csv").write_text(f"plot_id,easting,northing,epsg,{size}\n{places}")
    settings = {"trees": None, "field": folder / "tally.csv", "plots": folder / "four.csv", "boundary": None}
    return settings | {"north": "grid"}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda plot, row: [*row[:3], round(row[3] * (np.pi if plot == "q" else 1), 1), row[4]], "as girths read as"),
        (lambda plot, row: [*row[:3], round(row[3] / (2.54 if plot == "q" else 1), 1), row[4]], "as inches read as"),
        (lambda plot, row: [*row[:4], round(row[4] / (0.3048 if plot in "ps" else 1), 1)], "as feet read as metres"),
        (lambda plot, row: [*row[:4], round(row[4] / (0.3048 if row[0] % 2 else 1), 1)], "as feet read as metres"),
    ],
)
def test_plots_and_trees_in_another_unit_are_refused_or_said(tmp_path, change, says):
    given = _four(tmp_path, change)
    if "feet" in says:
        with pytest.raises(InputError, match=says):
            figures(tmp_path, **given)
    else:  # trees that grew in the open may be as thick
        assert any(says in text for text in figures(tmp_path, **given)[1].warnings)


def test_old_trees_skewed_stands_and_coppice_are_no_other_unit(tmp_path):
    def curve(d):
        return round(1.37 + (d / (1.5 + 0.19 * d)) ** 2, 1)

    def old(plot, row):
        return [*row[:3], row[3] + 45, curve(row[3] + 45)] if plot == "q" else row

    def skewed(plot, row):
        d = round(6 + row[3] ** 2 / 40, 1)
        return [*row[:3], d, curve(d)]

    def standards(plot, row):
        d = row[3] + 30 if row[0] % 5 == 0 else round(row[3] / 3, 1)
        return [*row[:3], d, curve(d)]

    for change in (old, skewed, standards):
        warnings = figures(tmp_path, **_four(tmp_path, change))[1].warnings
        assert not any("read as" in text or "there twice" in text for text in warnings), warnings


def test_a_tally_s_empty_rim_is_said(tmp_path):
    for radius in ("radius_m,20", "radius_m,25"):
        warnings = figures(tmp_path, **_four(tmp_path, radius=radius))[1].warnings
        assert any("tally.csv: of 64 trees none stands in their outer" in text for text in warnings)
    assert not any("outer" in text for text in figures(tmp_path, **_four(tmp_path))[1].warnings)

    def half(plot, row):
        return [*row[:2], round(row[2] / 2, 2), *row[3:]] if plot == "r" else row

    assert any("16 trees of plot r none" in text for text in figures(tmp_path, **_four(tmp_path, half))[1].warnings)


def test_trees_of_a_tally_measured_twice_are_refused_and_stools_are_not(tmp_path):
    rows = _crew(16, 2)
    twice = [("p", [row[0] + 900, row[1], round(row[2] + 0.05, 2), round(row[3] + 0.3, 1), row[4]]) for row in rows[:6]]
    with pytest.raises(InputError, match="6 pairs of trees stand in one another"):
        figures(tmp_path, **_four(tmp_path, more=twice))
    warnings = figures(tmp_path, **_four(tmp_path, more=twice[:4]))[1].warnings
    assert any("4 pairs of trees stand in one another" in text for text in warnings)
    stools = [("p", [row[0] + 900, *row[1:3], round(row[3] * 0.6 + row[0] % 3, 1), row[4]]) for row in rows]
    assert not any("in one another" in text for text in figures(tmp_path, **_four(tmp_path, more=stools))[1].warnings)


def test_plots_of_an_area_alone_are_drawn(tmp_path):
    from treedgs_geo.inventory.stand.document import draw_overview, draw_plots

    stand, _ = figures(tmp_path, **_four(tmp_path, radius="area_ha,0.0314"))
    assert all(plot.outline is None for plot in stand.plots) and stand.design.n == 4
    assert draw_plots(stand)[:4] == draw_overview(stand)[:4] == b"\x89PNG"


def test_bearings_stay_with_their_trees_where_one_is_gone(tmp_path):
    rows = _crew(10)
    lines = [f"{line},{'felled' if k == 0 else ''}" for k, line in enumerate(_text(rows).splitlines()[1:])]
    path = tmp_path / "gone.csv"
    path.write_text("\n".join([LIST.strip() + ",status", *lines]))
    trees = from_tally(path, FieldProtocol()).trees
    assert trees["distance_m"].tolist() == [row[2] for row in rows[1:]]
