"""``photos-to-dbh --at``: stems at given places from a finished run, merged into its layer; all else stays."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from chain_runs import chain_arguments

import treedgs_geo as tg
from treedgs_geo.cli import main
from treedgs_geo.core.field_stems import read_field_stems
from treedgs_geo.inventory.review.apply import read_whole, review_trees
from treedgs_geo.inventory.tree_layer import write_table
from treedgs_geo.inventory.tree_reading import read_trees


@pytest.fixture
def run(finished, tmp_path) -> Path:
    """A copy of the finished run that a test may change."""
    shutil.copytree(finished, tmp_path / "run")
    return tmp_path / "run"


def points(path: Path, places, crs: str = "EPSG:6344", **columns) -> Path:
    x, y = np.array(places, float).T
    table = gpd.GeoDataFrame(columns, geometry=gpd.points_from_xy(x, y), crs="EPSG:6344").to_crs(crs)
    table.to_file(path)
    return path


def at(plot: Path, run: Path, given: Path, **more: str) -> int:
    return main(chain_arguments(plot, run, at=str(given), **more))


def without(layer: Path, numbers: list[int]) -> gpd.GeoDataFrame:
    """Take trees out of a layer, as a person deletes rows; returns those."""
    table = read_whole(layer)
    gone = table["tree_id"].isin(numbers)
    write_table(layer, table[~gone].reset_index(drop=True))
    return table[gone]


def test_removed_stems_come_back_and_nothing_else_changes(run, simulated_plot, capsys) -> None:
    layer = run / "trees.gpkg"
    measured = read_trees(layer).dropna(subset=["dbh_cm"])
    mine, other = (int(number) for number in measured["tree_id"].iloc[:2])
    review_trees(layer, csv_of(run / "d.csv", [(other, "dbh", "33.3")]), by="Ada")
    (gone,) = without(layer, [mine]).itertuples()
    before = read_trees(layer).set_index("tree_id")
    # Another CRS, and another layer in the file.
    given = points(run / "points.gpkg", [(gone.x + 0.1, gone.y)], "EPSG:4326", tree_id=["north one"])
    gpd.GeoDataFrame({"a": [1]}, geometry=gpd.points_from_xy([0], [0])).to_file(given, layer="other")
    assert at(simulated_plot, run, given) == 2 and "2 layers of points" in capsys.readouterr().err
    assert at(simulated_plot, run, Path(f"{given}|layername=points")) == 0
    said = capsys.readouterr().err
    assert f"point north one: tree {mine} of the run is in the layer again: {gone.dbh_cm:.1f}" in said
    after = read_trees(layer).set_index("tree_id")
    assert len(after) == len(before) + 1 and after.loc[mine, "dbh_cm"] == gone.dbh_cm
    assert (after.loc[before.index, "dbh_cm"].fillna(0) == before["dbh_cm"].fillna(0)).all()
    assert after.loc[other, "rev_dbh_cm"] == 33.3 and after.loc[other, "rev_by"] == "Ada"
    assert after.loc[mine, "run_id"] == after["run_id"].dropna().iloc[0]
    # Once more: it is there.
    assert at(simulated_plot, run, Path(f"{given}|layername=points")) == 0
    assert f"tree {mine} (" in (said := capsys.readouterr().err) and "which the layer holds already" in said
    assert read_trees(layer).set_index("tree_id").equals(after)


def test_the_layer_is_written_elsewhere_where_every_point_is_at_a_tree(run, simulated_plot, tmp_path) -> None:
    before = read_trees(run / "trees.gpkg")
    first, second = before.dropna(subset=["dbh_cm"])[["x", "y"]].to_numpy()[:2]
    given = {"geotags": simulated_plot, "crs": "EPSG:6344", "plots": simulated_plot / "plots.csv"}
    given |= {"at": points(run / "points.gpkg", [first, second]), "output": tmp_path / "elsewhere" / "trees.gpkg"}
    trees = tg.measure_photos(simulated_plot / "images", run / "work", **given)
    assert trees["tree_id"].tolist() == before["tree_id"].tolist() and given["output"].is_file()
    assert trees["dbh_cm"].equals(before["dbh_cm"])
    # A tree taken out of that layer is measured into it again; the run's own layer stays.
    (gone,) = without(given["output"], [int(trees["tree_id"][trees["dbh_cm"].notna()].iloc[0])]).itertuples()
    again = tg.measure_photos(simulated_plot / "images", run / "work", **given)
    assert again.set_index("tree_id").loc[gone.tree_id, "dbh_cm"] == gone.dbh_cm and len(again) == len(before)
    assert read_trees(run / "trees.gpkg").equals(before)


def test_a_measured_tree_is_measured_again_where_its_name_asks_for_it_and_taken_back(
    run, simulated_plot, capsys
) -> None:
    layer = run / "trees.gpkg"
    before = read_trees(layer).set_index("tree_id")
    mine = int(before.index[before["qc_flag"] == "ok"][0])
    x, y = before.loc[mine, ["x", "y"]]
    given = points(run / "points.gpkg", [(x + 0.03, y)], tree_id=[f"again {mine}"])
    assert at(simulated_plot, run, given) == 0
    assert f"point again {mine}: tree {mine}: " in (said := capsys.readouterr().err)
    assert f"before {before.loc[mine, 'dbh_cm']:.1f} cm" in said
    after = read_trees(layer).set_index("tree_id")
    assert set(after.index) == set(before.index) and after.drop(mine).equals(
        before.drop(mine).reindex(after.drop(mine).index)
    )
    assert abs(after.loc[mine, "dbh_cm"] - before.loc[mine, "dbh_cm"]) < 1.0 and after.loc[mine, "qc_flag"] == "ok"
    assert after.loc[mine, "height_m"] == before.loc[mine, "height_m"] or np.isnan(before.loc[mine, "height_m"])
    assert (after.loc[mine, ["x", "y"]] != before.loc[mine, ["x", "y"]]).any()
    # The whole run once more keeps it.
    assert main(chain_arguments(simulated_plot, run)) == 0
    assert read_trees(layer).set_index("tree_id").loc[mine, "dbh_cm"] == after.loc[mine, "dbh_cm"]
    names = [f"former {mine}", "again 999", f"again {mine}"]
    back = points(run / "back.gpkg", [(x, y), (x, y), (x - 2.5, y)], tree_id=names)
    assert at(simulated_plot, run, back) == 0
    said = capsys.readouterr().err
    assert "tree 999 is none that this run measured" in said and f"tree {mine} stands 2.5 m away" in said
    assert read_trees(layer).set_index("tree_id").loc[mine, "dbh_cm"] == before.loc[mine, "dbh_cm"]
    assert main(chain_arguments(simulated_plot, run)) == 0
    assert read_trees(layer).set_index("tree_id").loc[mine, "dbh_cm"] == before.loc[mine, "dbh_cm"]


def csv_of(path: Path, rows: list[tuple]) -> Path:
    with open(path, "w", newline="") as stream:
        csv.writer(stream).writerows([("tree_id", "decision", "dbh_cm"), *rows])
    return path


def test_a_place_without_a_stem_is_a_tree_without_a_dbh_that_a_new_run_keeps(run, simulated_plot, capsys) -> None:
    layer = run / "trees.gpkg"
    trees = read_trees(layer)
    place = empty_place(trees, simulated_plot)
    given = run / "points.csv"
    given.write_text(f"tree_id,easting,northing,epsg\n7,{place[0]:.3f},{place[1]:.3f},6344\n")
    assert at(simulated_plot, run, given) == 0
    assert "without a DBH, each with its reason" in capsys.readouterr().out
    after = read_trees(layer)
    (new,) = after[~after["tree_id"].isin(trees["tree_id"])].itertuples()
    assert new.qc_flag == "reject" and np.isnan(new.dbh_cm)
    assert {"not_found", "few_views"} & set(new.qc_reason.split(","))
    # Where something is refused close by, that is the place.
    assert np.hypot(new.x - place[0], new.y - place[1]) < 0.3 and new.tree_id == trees["tree_id"].max() + 1
    # Its top was looked for, as those of the run's trees were.
    assert (run / "work" / "heights.json").exists() and new.height_why == "unclear"
    sheet = run / "work" / "sheets" / new.run_id / f"{new.tree_id}.jpg"
    assert sheet.stat().st_size > 5000
    assert f"{new.tree_id}.jpg" in (run / "work" / "report.html").read_text(encoding="utf-8")
    record = json.loads((run / "work" / "run.json").read_text(encoding="utf-8"))
    assert record["stages"]["given"]["result"]["refused"] == 1 and record["parameters"]["at"] is None
    # Resumed: the run writes it as well, measures nothing.
    assert main(chain_arguments(simulated_plot, run)) == 0
    said = capsys.readouterr().err
    assert "measure: unchanged since the last run, kept" in said
    assert sorted(read_trees(layer)["tree_id"]) == sorted(after["tree_id"])


def empty_place(trees: gpd.GeoDataFrame, plot: Path) -> np.ndarray:
    """The place of the plot that is farthest from every stem."""
    (row,) = csv.DictReader(open(plot / "plots.csv", encoding="utf-8"))
    centre, radius = np.array([float(row["easting"]), float(row["northing"])]), float(row["radius_m"])
    grid = np.stack(np.meshgrid(*[np.linspace(-radius, radius, 41)] * 2), axis=-1).reshape(-1, 2)
    grid = centre + grid[np.hypot(*grid.T) < 0.8 * radius]
    gap = np.linalg.norm(grid[:, None] - trees[["x", "y"]].to_numpy()[None], axis=2).min(axis=1)
    return grid[gap.argmax()]


def test_points_outside_are_one_sentence_and_nothing_is_written(run, simulated_plot, capsys) -> None:
    layer = run / "trees.gpkg"
    before, centre = layer.read_bytes(), read_trees(layer)[["x", "y"]].mean().to_numpy()
    given = points(run / "far.shp", [centre + [300, 0], centre + [0, 400]])
    assert at(simulated_plot, run, given) == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert "2 of 2 points cannot be measured: 1 lies" in error and "m outside the measured plots" in error
    assert layer.read_bytes() == before and not (run / "work" / "given.json").exists()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"bh_m": "1.3"}, "its run had --bh-m 1.37, now it is 1.3"),
        ({"preset": "fast"}, "its run had --preset balanced, now it is fast"),
        ({"dtm": "dtm.tif"}, "its run had --dtm"),
        ({"workspace": "nowhere"}, "holds no finished run of photos-to-dbh"),
    ],
)
def test_other_settings_than_the_run_s_are_refused(run, simulated_plot, capsys, more, words) -> None:
    shutil.copy(run / "work" / "dtm.tif", run)
    more = {name: str(run / value) if name in ("dtm", "workspace") else value for name, value in more.items()}
    x, y = read_trees(run / "trees.gpkg")[["x", "y"]].to_numpy()[0]
    assert at(simulated_plot, run, points(run / "p.gpkg", [(x, y)]), **more) == 2
    assert words in capsys.readouterr().err


def test_a_layer_of_another_run_is_not_touched(run, simulated_plot, capsys) -> None:
    layer = run / "trees.gpkg"
    table = read_whole(layer)
    table["run_id"] = "0123456789abcdef"
    write_table(layer, table)
    before = layer.read_bytes()
    x, y = table[["x", "y"]].to_numpy()[0]
    assert at(simulated_plot, run, points(run / "p.gpkg", [(x, y)])) == 2
    assert "holds trees of another run (0123456789abcdef)" in capsys.readouterr().err
    assert layer.read_bytes() == before


def test_a_stem_that_a_person_put_there_is_measured_in_its_row(run, simulated_plot, capsys) -> None:
    """A stem that the layer lost, set on the map again by a person, then measured: one row, and the decision that its
    DBH is not known is a question again."""
    layer = run / "trees.gpkg"
    measured = read_trees(layer).dropna(subset=["dbh_cm"])
    tree = measured.iloc[0]
    without(layer, [int(tree.tree_id)])
    given = run / "stem.csv"
    given.write_text(f"x,y,decision\n{tree.x:.3f},{tree.y:.3f},stem\n")
    (number,) = review_trees(layer, given, by="Ada").added
    rows = len(read_trees(layer))
    assert at(simulated_plot, run, points(run / "p.gpkg", [(tree.x, tree.y)])) == 0
    after = read_trees(layer)
    assert len(after) == rows and number not in after["tree_id"].tolist()
    (row,) = after[np.hypot(after.x - tree.x, after.y - tree.y) < 0.2].itertuples()
    assert (row.tree_id, row.dbh_cm) == (tree.tree_id, tree.dbh_cm), "one stem, one diameter"
    assert row.rev_flag is None and row.rev_by == "Ada"
    assert "the decision is withdrawn" in capsys.readouterr().err
    # Not a second time where the run is taken up again.
    assert main(chain_arguments(simulated_plot, run)) == 0
    assert len(read_trees(layer)) == rows


@pytest.mark.parametrize("ending", ["csv", "shp", "geojson"])
def test_a_layer_of_any_kind_takes_a_tree_back_and_another_in(run, simulated_plot, capsys, ending) -> None:
    layer = run / f"trees.{ending}"
    whole = read_whole(run / "trees.gpkg")
    tree = whole.dropna(subset=["dbh_cm"]).iloc[0]
    write_table(layer, whole[whole["tree_id"] != tree.tree_id].reset_index(drop=True))
    empty = empty_place(whole, simulated_plot)
    given = run / "p.csv"
    given.write_text(f'tree_id,x,y\n"a\n<b>x</b>",{tree.x:.3f},{tree.y:.3f}\nb,{empty[0]:.3f},{empty[1]:.3f}\n')
    assert at(simulated_plot, run, given, output=str(layer)) == 0
    assert f"point a <b>x</b>: tree {tree.tree_id} of the run is in the layer again" in capsys.readouterr().err
    after = pd.read_csv(layer) if ending == "csv" else gpd.read_file(layer)
    assert len(after) == len(whole) + 1
    numbers = after.set_index("tree_id")
    assert numbers["dbh_cm"][tree.tree_id] == tree.dbh_cm and numbers["n_views"][tree.tree_id] == tree.n_views
    assert np.isnan(numbers["dbh_cm"].iloc[-1]) and numbers["qc_flag"].iloc[-1] == "reject"
    # The workspace's own layer is the same.
    assert sorted(read_trees(run / "work" / "trees.gpkg")["tree_id"]) == sorted(after["tree_id"])


def test_points_of_every_kind_are_read_alike(tmp_path) -> None:
    import pyproj

    crs, places = pyproj.CRS("EPSG:6344"), [(611337.2, 3718451.6), (611340.0, 3718455.0)]
    files = [points(tmp_path / f"p.{end}", places, "EPSG:4326") for end in ("gpkg", "shp", "geojson")]
    lonlat = gpd.read_file(files[2]).geometry
    table = tmp_path / "p.csv"
    table.write_text("lon,lat\n" + "".join(f"{p.x:.9f},{p.y:.9f}\n" for p in lonlat))
    for file in (*files, table):
        assert np.allclose(read_field_stems(file, crs).xy, places, atol=0.01), file


def test_a_stem_map_guides_the_search_and_every_stem_of_it_is_answered(run, simulated_plot, capsys) -> None:
    trees = read_trees(run / "trees.gpkg")
    measured = trees.dropna(subset=["dbh_cm"])
    rows = [(f"s{tree.tree_id}", tree.x + 0.2, tree.y) for tree in measured.itertuples()]
    rows += [("=1+1", *empty_place(trees, simulated_plot)), ("far", rows[0][1] + 200, rows[0][2])]
    table = run / "map.csv"
    table.write_text("tree_id,x,y\n" + "".join(f"{name},{x:.3f},{y:.3f}\n" for name, x, y in rows))
    assert main(chain_arguments(simulated_plot, run, field_stems=str(table), stem_network="off")) == 0
    said = capsys.readouterr().err
    assert "1 of" in said and "lie outside the measured plots and are not looked for: far" in said
    with open(run / "work" / "field_stems.csv", newline="", encoding="utf-8") as stream:
        answers = list(csv.DictReader(stream))
    given = [row["answer"] for row in answers]
    # A stem that the network decided on may be refused without it.
    assert given[-2:] == ["refused", "outside"] and set(given[:-2]) <= {"measured", "refused"}
    assert given.count("measured") >= len(measured) - 1
    assert answers[-2]["field_id"] == "'=1+1", "no formula in a spreadsheet"
    after = read_trees(run / "trees.gpkg").set_index("tree_id")
    for row in answers[:-1]:
        tree = after.loc[int(row["tree_id"])]
        assert tree.qc_flag == row["qc_flag"] and tree.qc_reason == row["qc_reason"]
        assert (row["answer"] == "measured") == (tree.dbh_cm > 0)
    assert answers[-2]["qc_flag"] == "reject" and answers[-2]["qc_reason"] in ("not_found", "few_views")
