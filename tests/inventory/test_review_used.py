"""What every later verb makes of a person's decisions: it uses them and says how many."""

from __future__ import annotations

import json

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from inventory.stand_helpers import EAST, NORTH, Ears, figures, make_survey, report
from inventory.test_match import match, survey  # noqa: F401  (a fixture)

import treedgs_geo as tg
from treedgs_geo.inventory.pairs_layer import MEASURED, PAIRS
from treedgs_geo.inventory.review.apply import Decision
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.verbs.evaluate import EvaluateSettings, run


def near(folder, column, value, n=1):
    """Numbers of the ``n`` trees inside plot B (its middle 8 m) whose column equals the value."""
    table = read_trees(folder / "trees.gpkg")
    away = np.hypot(table.x - EAST - 40, table.y - NORTH - 30)
    chosen = table[(away < 8) & (table[column] == value)]
    return chosen.tree_id.astype(int).tolist()[:n]


def test_the_stand_table_counts_what_a_person_decided(tmp_path):
    folder = make_survey(tmp_path)
    before, _ = figures(folder, boundary=None)
    gone, taped, other = near(folder, "qc_flag", "ok", 3)
    tg.review_trees(
        folder / "trees.gpkg",
        [Decision(0, "reject", gone), Decision(0, "dbh", taped, 40.0), Decision(0, "merge", other, same_as=taped)],
    )
    after, ears = figures(folder, boundary=None)
    measured = read_trees(folder / "trees.gpkg").set_index("tree_id").dbh_cm
    area_ha = len(before.plots) * np.pi * 11.28**2 / 1e4
    by_hand = (40.0**2 - measured[[gone, taped, other]].pow(2).sum()) * np.pi / 4e4 / area_ha
    # Stems without a DBH count as the mean of their plot's measured trees, so they follow a little.
    assert after.estimates["ba"].mean - before.estimates["ba"].mean == pytest.approx(
        by_hand, abs=0.1 * abs(by_hand) + 0.15
    )
    assert len(after.trees) == len(before.trees) - 2
    assert after.estimates["trees"].mean < before.estimates["trees"].mean
    row = after.trees[after.trees.tree_id == taped].iloc[0]
    assert (row.dbh_cm, row.dbh_se_cm, row.note) == (40.0, 0.3, "DBH by tape")
    (said,) = [text for text in ears.infos if "A person decided" in text]
    assert "3 trees of trees.gpkg" in said and "1 with a taped DBH" in said and "1 rejected; 1 merged" in said


def test_a_stem_that_a_person_confirms_counts_for_certain(tmp_path):
    folder = make_survey(tmp_path)
    table = read_trees(folder / "trees.gpkg")
    thin = table[table.qc_reason == "too_small"].tree_id.astype(int).tolist()
    before, _ = figures(folder, boundary=None)
    tg.review_trees(folder / "trees.gpkg", [Decision(0, "accept", tree) for tree in thin])
    after, _ = figures(folder, boundary=None)
    # Stems refused as too thin are left out, unless a person says that they are trees.
    assert before.n_thin > 0 and after.n_thin == 0 and len(after.missing) == len(before.missing) + before.n_thin
    assert after.estimates["trees"].mean > before.estimates["trees"].mean


def test_the_files_of_the_stand_table_say_how_many(tmp_path):
    folder = make_survey(tmp_path)
    (tree,) = near(folder, "qc_flag", "ok")
    tg.review_trees(folder / "trees.gpkg", [Decision(0, "dbh", tree, 33.3, note='<b>bold</b> & "quoted"')])
    result, _, out = report(folder)
    assert result["n_reviewed"] == 1
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["reviewed"] == {"accepted": 0, "rejected": 0, "taped": 1, "merged": 0, "stems": 0}
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "A person decided on 1 tree of trees.gpkg: 1 with a taped DBH" in page and "<b>bold</b>" not in page


def test_a_csv_of_trees_brings_its_decisions_and_its_other_columns(tmp_path):
    folder = make_survey(tmp_path)
    table = pd.DataFrame(read_trees(folder / "trees.gpkg").drop(columns="geometry"))
    table["note"] = table.tree_id.map(str)
    (tree, other) = near(folder, "qc_flag", "ok", 2)
    table["rev_flag"] = table.tree_id.map({tree: "reject"})
    table["rev_dbh_cm"] = table.tree_id.map({other: 35.0})
    table.to_csv(folder / "trees.csv", index=False)
    stand, _ = figures(folder, trees=folder / "trees.csv", crs="EPSG:6344", boundary=None)
    notes = dict(zip(stand.trees.tree_id.astype(int), stand.trees.note, strict=True))
    # Every row kept its own columns, although one was taken out.
    assert tree not in notes and notes.pop(other) == f"DBH by tape; {other}"
    assert all(note == str(number) for number, note in notes.items())


def evaluate(folder, **more):
    """metrics.json, and what was said."""
    ears = Ears()
    run(EvaluateSettings(**{"pairs": folder / "pairs.gpkg", "output": folder / "out", **more}), ears)
    return json.loads((folder / "out" / "metrics.json").read_text(encoding="utf-8")), ears


def test_pairs_take_the_value_that_counts_and_keep_the_measured_one(survey):  # noqa: F811
    rows = [Decision(0, "dbh", 101, 30.0), Decision(0, "reject", 103), Decision(0, "accept", 104)]
    tg.review_trees(survey / "trees.gpkg", rows)
    result, _ = match(survey)
    pairs = gpd.read_file(survey / "pairs.gpkg", layer=PAIRS).set_index("tree_id")
    measured = read_trees(survey / "trees.gpkg").set_index("tree_id")
    assert result["n_reviewed"] == 3 and 103 not in pairs.index
    assert pairs.loc[101, ["dbh_cm", "rev_flag"]].tolist() == [30.0, "dbh"]
    assert pairs.loc[101, "meas_cm"] == pytest.approx(measured.loc[101, "dbh_cm"], abs=0.006)
    assert pairs.loc[104, "rev_flag"] == "accept" and pd.isna(pairs.loc[100, "rev_flag"])
    assert 103 not in gpd.read_file(survey / "pairs.gpkg", layer=MEASURED).tree_id.tolist()


def test_the_evaluation_says_what_is_by_tape_and_what_is_measured(survey):  # noqa: F811
    match(survey)
    plain, _ = evaluate(survey)
    assert "as_measured" not in plain and plain["rmse_cm"] == pytest.approx(0.5, abs=0.05)
    # A person tapes every tree exactly as the crew did: the accuracy of the product is perfect, the method's is not.
    pairs = gpd.read_file(survey / "pairs.gpkg", layer=PAIRS)
    done = pairs[pairs.dbh_cm.notna()]
    tg.review_trees(
        survey / "trees.gpkg",
        [Decision(0, "dbh", int(p.tree_id), float(p.field_cm)) for p in done.itertuples()],
    )
    match(survey)
    metrics, ears = evaluate(survey)
    assert metrics["rmse_cm"] == pytest.approx(0.0, abs=0.006)
    assert metrics["as_measured"]["rmse_cm"] == pytest.approx(plain["rmse_cm"], abs=0.006)
    assert metrics["as_measured"]["n"] == plain["n"]
    (note,) = [text for text in ears.warnings if "A person decided" in text]
    assert f"{len(done)} of the diameters are by tape" in note and "RMSE of 0.5" in note
    page = (survey / "out" / "evaluation.html").read_text(encoding="utf-8")
    assert "pooled, as measured" in page


def test_a_pairs_layer_from_before_a_tree_was_rejected_is_refused_by_the_stand_table(tmp_path):
    folder = make_survey(tmp_path)
    table = read_trees(folder / "trees.gpkg")
    chosen = table[(np.hypot(table.x - EAST - 40, table.y - NORTH - 30) < 11) & table.dbh_cm.notna()]
    field = pd.DataFrame(
        {"plot_id": "B", "tree_id": chosen.tree_id, "easting": chosen.x, "northing": chosen.y, "dbh_cm": chosen.dbh_cm}
    )
    field.to_csv(folder / "field.csv", index=False)
    match(folder)
    tg.review_trees(folder / "trees.gpkg", [Decision(0, "reject", int(chosen.tree_id.iloc[0]))])
    with pytest.raises(tg.TreeDGSError, match="which a person rejected or merged since; run match-plots again"):
        figures(folder, pairs=folder / "pairs.gpkg")
    match(folder)
    stand, _ = figures(folder, pairs=folder / "pairs.gpkg")
    assert int(chosen.tree_id.iloc[0]) not in stand.trees.tree_id.tolist()
