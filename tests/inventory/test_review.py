"""A person's decisions on trees: kept beside the measured values, used by every later verb, never lost in silence."""

from __future__ import annotations

import json
import sqlite3
import subprocess
import sys

import geopandas as gpd
import pandas as pd
import pytest
from inventory.stand_helpers import CRS, EAST, NORTH, Ears
from shapely.geometry import Point

import treedgs_geo as tg
from treedgs_geo.campaign.layer import write_layer
from treedgs_geo.cli import main
from treedgs_geo.core.errors import InputError
from treedgs_geo.inventory.review.apply import Decision, read_decisions
from treedgs_geo.inventory.reviewed import DECISIONS
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.stems.quality.tree import Tree

DECIDED = ["rev_flag", "rev_dbh_cm", "rev_note", "rev_by", "rev_at"]
MEASURED = [name for name in tg.tree_table([], CRS) if name not in (*DECIDED, "geometry")]
HOSTILE = "<img src=x onerror=alert(1)> \"quoted\", 'it', ; ünïcode"


def trees(moved=0.0, ids=1, gone=(), dbh=20.0):
    """Six trees five metres apart; the sixth was refused, the third is to check."""
    made = [
        Tree(ids + k, EAST + 5 * k + moved, NORTH, dbh_cm=dbh + k, dbh_se_cm=0.5, method="photos", z_ground=210.0)
        for k in range(5)
        if k not in gone
    ]
    for tree in made:
        if tree.tree_id == ids + 2:
            tree.add_reason("disagree")
    if 5 not in gone:
        made.append(Tree(ids + 5, EAST + 25 + moved, NORTH, qc_flag="reject", qc_reason="few_views", method="photos"))
    return made


def table(path, text):
    """A CSV with these lines."""
    path.write_text(text, encoding="utf-8")
    return path


ALL = (
    "tree_id,decision,dbh_cm,same_as,x,y,note,by,at\n"
    f"1,accept,,,,,looked at it,Anna,2026-05-01T10:00:00Z\n2,reject,,,,,,,\n3,dbh,24.4,,,,,,\n4,merge,,5,,,twin,,\n"
    f"6,stem,,,,,,,\n,stem,,,{EAST + 40},{NORTH},behind the oak,,\n,dbh,31,,{EAST + 45},{NORTH},,,\n"
)


@pytest.mark.parametrize("suffix", [".gpkg", ".shp", ".geojson", ".csv"])
def test_decisions_go_into_columns_of_their_own_and_no_measured_value_changes(tmp_path, suffix):
    path = write_trees(tmp_path / f"trees{suffix}", trees(), CRS)
    before = pd.read_csv(path) if suffix == ".csv" else pd.DataFrame(read_trees(path))
    outcome = tg.review_trees(path, table(tmp_path / "d.csv", ALL), by="Bea")
    assert outcome.counts == {"accept": 1, "reject": 1, "dbh": 2, "merge": 1, "stem": 2} and outcome.added == [7, 8]
    after = pd.read_csv(path) if suffix == ".csv" else pd.DataFrame(read_trees(path))
    pd.testing.assert_frame_equal(after.loc[:5, MEASURED], before[MEASURED], check_dtype=False)
    decided = after.set_index("tree_id")[DECIDED]
    assert decided.rev_flag.tolist() == ["accept", "reject", "dbh", "merge", None, "stem", "stem", "dbh"] or (
        decided.rev_flag.fillna("").tolist() == ["accept", "reject", "dbh", "merge", "", "stem", "stem", "dbh"]
    )
    assert decided.rev_dbh_cm.dropna().to_dict() == {3: 24.4, 8: 31.0}
    assert decided.loc[1, ["rev_note", "rev_by", "rev_at"]].tolist() == ["looked at it", "Anna", "2026-05-01T10:00:00Z"]
    assert decided.loc[4, "rev_note"] == "same tree as 5; twin" and decided.loc[2, "rev_by"] == "Bea"
    assert after.set_index("tree_id").loc[7, "qc_reason"] == "not_found"
    # The same table once more changes nothing: the added stems are known again.
    tg.review_trees(path, tmp_path / "d.csv", by="Bea")
    again = pd.read_csv(path) if suffix == ".csv" else pd.DataFrame(read_trees(path))
    pd.testing.assert_frame_equal(again.drop(columns="rev_at"), after.drop(columns="rev_at"))


def test_the_values_that_count(tmp_path):
    path = write_trees(tmp_path / "trees.gpkg", trees(), CRS)
    tg.review_trees(path, table(tmp_path / "d.csv", ALL))
    counted, review = tg.reviewed(read_trees(path))
    found = counted.set_index("tree_id")
    assert found.index.tolist() == [1, 3, 5, 6, 7, 8] and review.left_out == {2, 4}
    assert found.loc[3, ["dbh_cm", "meas_cm", "dbh_se_cm", "qc_flag", "qc_reason"]].tolist() == [
        24.4,
        22.0,
        0.3,
        "ok",
        "",
    ]
    assert found.loc[3, "ba_m2"] == pytest.approx(3.14159265 / 4 * 0.244**2)
    assert found.loc[3, "dbh_lo_cm"] < 24.4 < found.loc[3, "dbh_hi_cm"]
    assert found.loc[8, "dbh_cm"] == 31.0 and pd.isna(found.loc[8, "meas_cm"])
    assert found.loc[[6, 7], "dbh_cm"].isna().all() and found.loc[[1, 3, 6, 7, 8], "sure"].all()
    assert not found.loc[5, "sure"]
    (sentence,) = review.sentences("trees.gpkg")
    assert "8 trees" not in sentence and "7 trees" in sentence and "1 rejected; 1 merged into another" in sentence
    # A layer from before there were decisions is taken as it is.
    old = read_trees(path).drop(columns=DECIDED)
    same, none = tg.reviewed(old)
    assert len(same) == 8 and not none.total and not none.sentences("x")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"rev_flag": "maybe"}, "rev_flag 'maybe'"),
        ({"rev_flag": "dbh"}, "no rev_dbh_cm"),
        ({"rev_flag": "reject", "rev_dbh_cm": 20.0}, "clear one of them"),
        ({"rev_dbh_cm": -3.0}, "expected 0.5 to 500 cm"),
        ({"rev_dbh_cm": 0.0}, "expected 0.5 to 500 cm"),
        ({"rev_dbh_cm": float("inf")}, "expected 0.5 to 500 cm"),
        ({"rev_dbh_cm": 2440.0}, "expected 0.5 to 500 cm"),
    ],
)
def test_what_was_typed_into_the_layer_and_cannot_be_is_refused(change, words):
    made = tg.tree_table(trees(), CRS)
    for name, value in change.items():
        made.loc[1, name] = value
    with pytest.raises(InputError, match=r"here\.gpkg: tree 2 .*") as refused:
        tg.reviewed(made, "here.gpkg")
    assert words in str(refused.value)


def test_a_dbh_typed_into_the_layer_without_a_word_counts():
    made = tg.tree_table(trees(), CRS)
    made.loc[0, "rev_dbh_cm"], made.loc[1, "rev_flag"] = 33.0, " ACCEPT "
    counted, review = tg.reviewed(made)
    assert counted.dbh_cm.tolist()[:2] == [33.0, 21.0] and (review.taped, review.accepted) == (1, 1)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("tree_id,decision\n1,keep\n", "line 2: the decision is 'keep'"),
        ("tree_id,decision\n1,accept\n1,reject\n", "line 3: tree 1 is decided on line 2"),
        ("tree_id,decision\n99,accept\n", "tree 99 is not in"),
        ("tree_id,decision\n1.5,accept\n", "whole number"),
        ("tree_id,decision\nx,accept\n", "expected a number"),
        ("tree_id,decision,same_as\n1,merge,\n", "needs same_as"),
        ("tree_id,decision,same_as\n1,merge,1\n", "needs same_as"),
        ("tree_id,decision,same_as\n1,merge,77\n", "same_as is 77"),
        ("tree_id,decision,same_as\n1,merge,2\n2,merge,1\n", "one of the two has to count"),
        ("tree_id,decision,same_as\n1,merge,2\n2,reject,\n", "one of the two has to count"),
        ("tree_id,decision\n1,dbh\n", "needs the taped diameter"),
        ("tree_id,decision,dbh\n1,dbh,30\n", "does not say its unit"),
        ("tree_id,decision,dbh_cm\n1,reject,30\n", "has a DBH but the decision 'reject'"),
        ("tree_id,decision,dbh_cm\n1,dbh,nan\n", "needs the taped diameter"),
        ("tree_id,decision,dbh_cm\n1,dbh,0.3\n", "expected trees of about 5 to 100 cm"),
        ("tree_id,decision\n,accept\n", "has no tree_id"),
        ("tree_id,decision,x,y\n,stem,1,\n", "has no tree_id"),
        (f"tree_id,decision,x,y\n,stem,{EAST + 0.1},{NORTH}\n", "tree 1 of"),
        ("tree_id,decision,x,y\n,stem,12.3,45.6\n", "metres of the layer's CRS"),
        ("number,what\n1,accept\n", "expected tree_id"),
        ("", "is empty"),
    ],
)
def test_a_table_that_cannot_be_is_refused_and_nothing_of_it_is_written(tmp_path, rows, words):
    path = write_trees(tmp_path / "trees.gpkg", trees(), CRS)
    before = path.read_bytes()
    with pytest.raises(InputError) as refused:
        tg.review_trees(path, table(tmp_path / "d.csv", rows))
    assert words in str(refused.value) and "d.csv" in str(refused.value)
    assert path.read_bytes() == before


def test_inches_by_the_columns_name(tmp_path):
    (decision,) = read_decisions(table(tmp_path / "d.csv", "tree,decision,dbh_in\n4,tape,10\n"))
    assert decision.tree == 4 and decision.word == "dbh" and decision.dbh_cm == pytest.approx(25.4)


def test_other_layers_a_persons_columns_and_hostile_text_stay(tmp_path):
    path = write_trees(tmp_path / "trees.gpkg", trees(), CRS)
    layer = read_trees(path)
    layer["vigour"] = pd.array([1, None, 3, None, 5, 6], dtype="Int64")
    layer["seen"] = pd.to_datetime("2026-05-01T10:00:00Z")
    layer.to_file(path, layer="trees", driver="GPKG", engine="pyogrio")
    gpd.GeoDataFrame({"a": [1]}, geometry=[Point(EAST, NORTH)], crs=CRS).to_file(path, layer="mine", driver="GPKG")
    tg.review_trees(path, [Decision(0, "dbh", 2, 25.0, note=HOSTILE), Decision(0, "stem", x=EAST + 60, y=NORTH)])
    after = read_trees(path).set_index("tree_id")
    assert after.vigour.fillna(-1).tolist() == [1, -1, 3, -1, 5, 6, -1]
    assert after.loc[1, "seen"] == layer["seen"][0] and pd.isna(after.loc[7, "seen"])
    assert after.loc[2, "rev_note"] == HOSTILE
    with sqlite3.connect(path) as connection:
        names = {name for (name,) in connection.execute("SELECT table_name FROM gpkg_contents")}
        kinds = dict(connection.execute("SELECT name, type FROM pragma_table_info('trees')").fetchall())
    assert {"trees", "circles", "mine"} <= names
    assert kinds["vigour"].upper().startswith(("INT", "MEDIUMINT")) and kinds["tree_id"].upper().startswith(
        ("INT", "MED")
    )


def test_undo_takes_a_decision_back(tmp_path):
    path = write_trees(tmp_path / "trees.gpkg", trees(), CRS)
    tg.review_trees(path, [Decision(0, "reject", 2)])
    tg.review_trees(path, [Decision(0, "undo", 2)])
    counted, review = tg.reviewed(read_trees(path))
    assert len(counted) == 6 and not review.total


def test_a_taped_dbh_far_from_the_measured_one_and_an_accepted_stem_without_dbh_are_reported(tmp_path, capsys):
    path = write_trees(tmp_path / "trees.gpkg", trees(), CRS)
    csv = table(tmp_path / "d.csv", "tree_id,decision,dbh_cm\n2,dbh,35\n6,accept,\n")
    assert main(["review", "--trees", str(path), "--decisions", str(csv), "--log-format", "plain"]) == 0
    said = "".join(capsys.readouterr())
    assert "Tree 2: taped 35.0 cm, measured 21.0 cm" in said and "Tree 6 has no DBH" in said
    assert "n_open: 1" in said and "n_reviewed: 2" in said  # tree 3 is still to check


def test_a_layer_that_qgis_edits_is_left_alone(tmp_path, monkeypatch):
    path = write_trees(tmp_path / "trees.gpkg", trees(), CRS)
    monkeypatch.setattr("treedgs_geo.core.geopackage.WAIT_S", 0.2)
    with sqlite3.connect(path, isolation_level=None) as connection:
        connection.execute("BEGIN IMMEDIATE")
        with pytest.raises(tg.TreeDGSError, match="another program reads or edits it"):
            tg.review_trees(path, [Decision(0, "reject", 2)])
        connection.rollback()
    assert read_trees(path).rev_flag.isna().all()


# What a new run into the same layer makes of the decisions.


def test_decisions_go_on_with_their_trees(tmp_path):
    path = write_trees(tmp_path / "trees.gpkg", trees(), CRS)
    tg.review_trees(path, table(tmp_path / "d.csv", ALL))
    ears = Ears()
    write_trees(path, trees(moved=0.2, ids=11, dbh=20.3), CRS, reporter=ears)
    found = read_trees(path).set_index("tree_id")
    assert found.rev_flag.fillna("").to_dict() == {
        11: "accept", 12: "reject", 13: "dbh", 14: "merge", 15: "", 16: "stem", 7: "stem", 8: "dbh",
    }  # fmt: skip
    assert found.loc[14, "rev_note"] == "same tree as 15; twin" and found.loc[13, "rev_dbh_cm"] == 24.4
    assert found.loc[8, "rev_dbh_cm"] == 31.0 and found.loc[7, "rev_note"] == "behind the oak"
    assert found.loc[13, "dbh_cm"] == 22.3
    assert any("2 places where a person says that a tree stands gave no tree" in text for text in ears.warnings)
    assert any("at 7 trees is kept" in text for text in ears.infos)


def test_a_decision_about_another_diameter_is_withdrawn_aloud(tmp_path):
    path = write_trees(tmp_path / "trees.gpkg", trees(), CRS)
    rows = [Decision(0, "accept", 1), Decision(0, "stem", 2), Decision(0, "accept", 3), Decision(0, "stem", 6)]
    tg.review_trees(path, rows)
    ears, again = Ears(), trees(dbh=23.0)
    again[2] = Tree(3, again[2].x, NORTH, qc_flag="reject", qc_reason="occluded")
    again[5] = Tree(6, again[5].x, NORTH, dbh_cm=18.0, dbh_se_cm=0.4)
    write_trees(path, again, CRS, reporter=ears)
    found = read_trees(path).set_index("tree_id")
    assert found.rev_flag.fillna("").to_dict() == {1: "", 2: "", 3: "accept", 4: "", 5: "", 6: ""}
    said = "\n".join(ears.warnings)
    assert "tree 1 was accepted with 20.0 cm and reads 23.0 cm now" in said
    assert "tree 2 was set aside with 21.0 cm and reads 24.0 cm now" in said
    assert "tree 3 was accepted with 22.0 cm and is without a DBH now (occluded)" in said
    assert "tree 6 was set aside with no DBH and reads 18.0 cm now" in said


def test_a_tree_that_is_gone_stays_where_a_person_saw_it_and_a_rejected_one_is_named(tmp_path):
    path = write_trees(tmp_path / "trees.gpkg", trees(), CRS)
    tg.review_trees(path, [Decision(0, "dbh", 1, 20.5), Decision(0, "reject", 2), Decision(0, "merge", 4, same_as=5)])
    ears = Ears()
    write_trees(path, trees(gone=(0, 1, 4), ids=21), CRS, reporter=ears)
    found = read_trees(path).set_index("tree_id")
    assert found.index.tolist() == [23, 24, 26, 1] and found.loc[1, "qc_reason"] == "not_found"
    assert found.loc[1, "rev_dbh_cm"] == 20.5 and pd.isna(found.loc[24, "rev_flag"])
    said = "\n".join(ears.warnings)
    assert "tree 24 was merged into tree 5, which is gone" in said and "2 at" in said and "(reject)" in said


def test_a_copy_of_the_layer_takes_the_decisions_too(tmp_path):
    path = write_trees(tmp_path / "trees.gpkg", trees(), CRS)
    tg.review_trees(path, [Decision(0, "reject", 2)])
    copy = write_trees(tmp_path / "copy.gpkg", trees(), CRS, copies=(path,))
    assert read_trees(copy).rev_flag.fillna("").tolist() == ["", "reject", "", "", "", ""]


def test_a_campaign_merges_decisions_and_keeps_the_newer_one(tmp_path):
    plots = []
    for number, name in enumerate(("a", "b"), start=1):
        folder = tmp_path / name
        folder.mkdir()
        write_trees(folder / "trees.gpkg", [tree for tree in trees(moved=1000.0 * number)], CRS)
        plots.append({"plot_id": name, "number": number, "folder": str(folder), "crs": CRS, "table": False})
    tg.review_trees(tmp_path / "a" / "trees.gpkg", [Decision(0, "dbh", 1, 20.5, at="2026-05-01T10:00:00Z")])
    merged = tmp_path / "all.gpkg"
    assert write_layer(merged, plots, CRS) == 12
    assert read_trees(merged).set_index("tree_id").rev_dbh_cm.dropna().to_dict() == {100001: 20.5}
    # In the merged layer: another tree, and a stem of its own. In the plot: a newer value.
    rows = [Decision(0, "reject", 200002), Decision(0, "stem", x=EAST + 1050, y=NORTH)]
    tg.review_trees(merged, rows)
    tg.review_trees(tmp_path / "a" / "trees.gpkg", [Decision(0, "dbh", 1, 20.9, at="2026-06-01T10:00:00Z")])
    assert write_layer(merged, plots, CRS) == 13
    found = read_trees(merged).set_index("tree_id")
    assert found.rev_dbh_cm.dropna().to_dict() == {100001: 20.9}
    assert found.rev_flag.dropna().to_dict() == {100001: "dbh", 200002: "reject", 200007: "stem"}
    assert write_layer(merged, plots, CRS) == 13


def test_the_style_knows_every_decision(tmp_path):
    style = json.dumps((tg_styles() / "trees.qml").read_text(encoding="utf-8"))
    for word in DECISIONS:
        assert f"'{word}'" in style or f'\\"{word}\\"' in style, word


def tg_styles():
    """Folder of the styles."""
    from importlib.resources import files

    return files("treedgs_geo.core") / "styles"


def test_two_reviews_at_once_keep_both_decisions(tmp_path):
    path = write_trees(tmp_path / "t.gpkg", [Tree(k, EAST + 3 * k, NORTH, dbh_cm=20.0 + k) for k in range(1, 6)], CRS)
    started = []
    for k in (2, 4):
        decisions = table(tmp_path / f"d{k}.csv", f"tree_id,decision\n{k},reject\n")
        command = ["-m", "treedgs_geo", "review", "--trees", path, "--decisions", decisions]
        started.append(subprocess.Popen([sys.executable, *map(str, command)], stdout=subprocess.DEVNULL))
    assert [process.wait() for process in started] == [0, 0]
    assert read_trees(path)["rev_flag"].notna().tolist() == [False, True, False, True, False]


def test_decisions_that_slipped_by_a_row_are_refused(tmp_path):
    measured = [18.0, 31.0, 24.0, 40.0, 12.0, 28.0, 35.0, 21.0]
    path = write_trees(
        tmp_path / "t.gpkg", [Tree(k + 1, EAST + 3 * k, NORTH, dbh_cm=d) for k, d in enumerate(measured)], CRS
    )
    rows = [f"{k + 2},dbh,{d + 0.3}" for k, d in enumerate(measured[:-1])]
    with pytest.raises(InputError, match=r"from line 2 on .* 1 row above theirs .* has slipped down; hold the DBHs"):
        tg.review_trees(path, table(tmp_path / "d.csv", "tree_id,decision,dbh_cm\n" + "\n".join(rows)))
    assert "rev_flag" not in gpd.read_file(path) or gpd.read_file(path)["rev_flag"].isna().all()
