"""tape-sample and tape-check on files: what is drawn, printed, filled in, refused and found."""

import json
import subprocess
import xml.etree.ElementTree as ET

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest

from tests.inventory.stand_helpers import CRS, EAST, NORTH, Ears, make_survey
from treedgs_geo.core.errors import InputError
from treedgs_geo.inventory.double_sampling.tapes import read_taped
from treedgs_geo.inventory.stand.run import read_stand
from treedgs_geo.inventory.taping.check import check_tape_table as check
from treedgs_geo.inventory.taping.sample import sample_tapes as sample
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.verbs.stand_table import StandTableSettings
from treedgs_geo.verbs.tape_check import TapeCheckSettings
from treedgs_geo.verbs.tape_sample import TapeSampleSettings


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """A survey of four plots and 20 trees to tape."""
    folder = make_survey(tmp_path_factory.mktemp("taping"))
    settings = TapeSampleSettings(
        trees=folder / "trees.gpkg", plots=folder / "plots.csv", n=20, output=folder / "tapes"
    )
    found = sample(settings, Ears())
    assert found["n"] == 20
    return folder


def filled(folder, tmp_path, change=None, bias=0.5):
    """The tape table with values: ``bias`` cm below the measured ones."""
    table = pd.read_csv(folder / "tapes" / "tapes.csv")
    rng = np.random.default_rng(2)
    table["taped_cm"] = (table["dbh_cm"] - bias + rng.normal(0, 0.3, len(table))).round(1).fillna(15.0)
    table["state"] = table["state"].astype(object)
    if change is not None:
        table = change(table)
    path = tmp_path / "filled.csv"
    table.to_csv(path, index=False)
    return path


def checked(folder, path, out, **more):
    ears = Ears()
    settings = TapeCheckSettings(
        trees=more.pop("trees", folder / "trees.gpkg"), plots=folder / "plots.csv", taped=path, output=out, **more
    )
    return check(settings, ears), json.loads((out / "tape_check.json").read_text()), ears


def test_the_files_for_the_field(drawn):
    tapes = drawn / "tapes"
    table = gpd.read_file(tapes / "tapes.gpkg", layer="tapes")
    assert len(table) == 20 and table.crs == CRS and table["taped_cm"].isna().all()
    assert table["prob"].between(0, 1).all() and (1 / table["prob"]).sum() == pytest.approx(table["n_frame"].iloc[0])
    trees = gpd.read_file(drawn / "trees.gpkg", layer="trees").set_index("tree_id")
    plots = pd.read_csv(drawn / "plots.csv").set_index("plot_id")
    for row in table.itertuples():
        tree, plot = trees.loc[row.tree_id], plots.loc[row.plot_id]
        away = np.hypot(tree.x - plot.easting, tree.y - plot.northing)
        assert away <= 11.28 and row.dist_m == pytest.approx(away, abs=0.01)
        # Grid bearing, and the meridians' convergence here of some tenths of a degree.
        grid = np.degrees(np.arctan2(tree.x - plot.easting, tree.y - plot.northing))
        assert abs((row.azim_deg - grid + 180) % 360 - 180) < 1.0
    points = ET.parse(tapes / "tapes.gpx").getroot().findall("{*}wpt")
    assert [p.findtext("{*}name") for p in points] == [f"T{tree}" for tree in table["tree_id"]]
    assert float(points[0].get("lat")) == pytest.approx(table.to_crs(4326).geometry.y.iloc[0], abs=1e-6)
    text = subprocess.run(["pdftotext", "-layout", tapes / "tape_form.pdf", "-"], capture_output=True, text=True).stdout
    page = (tapes / "tape_form.html").read_text(encoding="utf-8")
    for tree in table["tree_id"]:
        assert f"<td>{tree}</td>" in page and str(tree) in text
    assert "Plot D &amp; é" in page and "Plot D & é" in text and "not on the map" in text
    # Nobody shall read the tape towards the measured value.
    assert (table["about_cm"].dropna() % 5 == 0).all() and "23." not in " ".join(
        row.split("</td>")[3] for row in page.split("<tr>") if row.count("<td") == 9
    )


def test_a_bias_is_found_and_the_totals_are_corrected(drawn, tmp_path):
    found, figures, ears = checked(drawn, filled(drawn, tmp_path), tmp_path / "out")
    assert found["bias_lo_cm"] < 0.5 < found["bias_hi_cm"] and 0.3 < found["bias_cm"] < 0.7
    assert any("too thick by" in w for w in ears.warnings)
    ba = figures["ba_m2"]
    assert ba["corrected"] < ba["measured"] and ba["low"] < ba["corrected"] < ba["high"]
    assert figures["trees"]["se"] == 0 and figures["n_frame"] == 91
    layer = gpd.read_file(tmp_path / "out" / "tape_check.gpkg", layer="tape_check")
    assert len(layer) == 20 and "no" in set(layer["inside"]) | {"no"}
    assert "Särndal" in (tmp_path / "out" / "tape_check.html").read_text(encoding="utf-8")


def test_everything_that_a_crew_may_write(drawn, tmp_path):
    def change(table):
        open_ = table.index[table["dbh_cm"].notna()]
        table.loc[open_[0], ["taped_cm", "state"]] = [np.nan, "none"]
        table.loc[open_[1], "state"] = "dead"
        table.loc[open_[2], "taped_cm"] = np.nan
        extra = {"plot_id": table["plot_id"].iloc[0], "taped_cm": 30.0, "tape_note": "=1+1 <b>&"}
        return pd.concat([table, pd.DataFrame([extra])])

    found, figures, ears = checked(drawn, filled(drawn, tmp_path, change), tmp_path / "out")
    assert figures["n_extra"] == 1 and figures["trees"]["corrected"] != 91
    assert any("Not taped: 1 drawn tree" in w for w in ears.warnings)
    table = pd.read_csv(tmp_path / "out" / "tape_check.csv")
    assert sorted(table["state"].unique()) == ["dead", "none", "not reached", "taped"]


def test_exchanged_numbers_are_noticed(drawn, tmp_path):
    def change(table):
        order = table["taped_cm"][table["dbh_cm"].notna()].sort_values().index
        thin, thick = order[2], order[-1]
        a, b = table.loc[thin, "taped_cm"], table.loc[thick, "taped_cm"]
        table.loc[thin, "taped_cm"], table.loc[thick, "taped_cm"] = b, a
        return table

    found, _, ears = checked(drawn, filled(drawn, tmp_path, change), tmp_path / "out")
    assert found["n_outliers"] == 2 and any("perhaps exchanged with tree" in w for w in ears.warnings)


@pytest.mark.parametrize(
    ("name", "factor"), [("taped_in", 1 / 2.54), ("taped_mm", 10.0), ("girth_cm", np.pi), ("girth_in", np.pi / 2.54)]
)
def test_units_by_name_and_values_that_contradict_them(drawn, tmp_path, name, factor):
    def right(table):
        table[name] = table.pop("taped_cm") * factor
        return table

    found, _, _ = checked(drawn, filled(drawn, tmp_path, right), tmp_path / "out")
    assert 0.3 < found["bias_cm"] < 0.7

    def wrong(table):
        table["taped_cm"] *= factor
        return table

    if name != "girth_in":  # girths in inches are no multiple that could not be a diameter
        with pytest.raises(InputError, match="read as|expected 0.5 to 500"):
            checked(drawn, filled(drawn, tmp_path, wrong), tmp_path / "no")


def test_a_spreadsheet_with_semicolons_and_decimal_commas(drawn, tmp_path):
    path = filled(drawn, tmp_path)
    same, _, _ = checked(drawn, path, tmp_path / "a")
    table = pd.read_csv(path)
    table.to_csv(path, index=False, sep=";", decimal=",")
    found, _, _ = checked(drawn, path, tmp_path / "b")
    assert {k: v for k, v in found.items() if k.startswith("bias")} == {
        k: v for k, v in same.items() if k.startswith("bias")
    }


def test_tapes_typed_with_commas_beside_what_the_tool_wrote_with_points(drawn, tmp_path):
    path = filled(drawn, tmp_path)
    same, _, _ = checked(drawn, path, tmp_path / "a")
    table = pd.read_csv(path, dtype=str)
    table["taped_cm"] = table["taped_cm"].str.replace(".", ",")
    table.to_csv(path, index=False, sep=";")
    found, _, _ = checked(drawn, path, tmp_path / "b")
    assert found["bias_cm"] == same["bias_cm"]
    assert "." not in "".join(pd.read_csv(drawn / "tapes" / "tapes.csv", dtype=str)["about_cm"].dropna())


def column(change):
    return lambda t: t.assign(taped_cm=change(t["taped_cm"].to_numpy(float)))


OTHER_TREES = [
    (column(lambda tape: np.roll(tape, 1)), "fit the trees 1 row above theirs .* has slipped down"),
    (column(lambda tape: np.r_[np.nan, tape[:-1]]), "fit the trees 1 row above theirs .* has slipped down"),
    (column(lambda tape: np.r_[tape[2:], np.nan, np.nan]), "fit the trees 2 rows below theirs .* has slipped up"),
    (
        column(lambda tape: np.r_[tape[:4], np.full(9, np.nanmax(tape)), tape[13:]]),
        "rows in turn, .* the cell was filled down",
    ),
    (column(np.sort), "go from the smallest on, those measured do not: the column was sorted alone"),
]


@pytest.mark.parametrize(("change", "sentence"), OTHER_TREES)
def test_tapes_of_other_trees_correct_nothing(drawn, tmp_path, change, sentence):
    path = filled(drawn, tmp_path, change)
    with pytest.raises(InputError, match=sentence):
        checked(drawn, path, tmp_path / "no")
    settings = StandTableSettings(
        trees=drawn / "trees.gpkg", plots=drawn / "plots.csv", taped=path, species="PITA", output=tmp_path / "s"
    )
    with pytest.raises(InputError, match=sentence):
        read_stand(settings, Ears())


def test_shuffled_tapes_blame_no_layer(drawn, tmp_path):
    path = filled(drawn, tmp_path, column(np.random.default_rng(5).permutation))
    _, figures, ears = checked(drawn, path, tmp_path / "out")
    assert "fit no better than exchanged ones" in ears.warnings[0] and "ba_m2" in figures
    assert not any("too thick" in text or "too narrow" in text for text in ears.warnings)
    # A layer with a large bias, or large errors that it states, is compared as before.
    for wrong in (lambda t: t * 1.18, lambda t: t + np.random.default_rng(1).normal(0, 2.5, len(t))):
        _, _, ears = checked(drawn, filled(drawn, tmp_path, column(wrong)), tmp_path / "fine")
        assert not any("exchanged ones" in text for text in ears.warnings)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda t: t.assign(taped_cm=np.nan), "no tree is filled in"),
        (lambda t: t.assign(state="perhaps"), "state 'perhaps', expected taped, none"),
        (lambda t: t.assign(state="none"), "a diameter, and a state that says"),
        (lambda t: t.assign(taped_cm=-3), "expected 0.5 to 500"),
        (lambda t: t.assign(taped_cm="thick"), "expected a number"),
        (lambda t: pd.concat([t, t.iloc[:1]]), "appears twice"),
        (lambda t: t.drop(columns="taped_cm"), "expected tree_id and taped_cm"),
        (lambda t: pd.concat([t, pd.DataFrame([{"taped_cm": 20.0}])]), "no plot_id and no near_id"),
        (lambda t: pd.concat([t, pd.DataFrame([{"taped_cm": 20.0, "plot_id": "Z"}])]), "plot Z, where no tree"),
        (lambda t: t.drop(index=[1, 4, 7]), "rows were deleted or chances changed"),
        (lambda t: t.assign(prob=t["prob"] * 1.5), "rows were deleted or chances changed"),
        (lambda t: t.assign(x=t["x"] + 3), "stands 3.0 m from tree"),
        (lambda t: t.assign(dbh_cm=t["dbh_cm"] + 1), "have another DBH than when they were drawn"),
        (lambda t: t.assign(tree_id=t["tree_id"] + 5000), "not among the living trees"),
    ],
)
def test_refusals(drawn, tmp_path, change, sentence):
    with pytest.raises(InputError, match=sentence) as refused:
        checked(drawn, filled(drawn, tmp_path, change), tmp_path / "out")
    assert "filled.csv" in str(refused.value) or "trees.gpkg" in str(refused.value) or "plot Z" in str(refused.value)
    assert not (tmp_path / "out" / "tape_check.json").exists()


def test_tapes_written_into_the_layer_do_not_hide_the_bias(drawn, tmp_path):
    path = filled(drawn, tmp_path)
    straight, _, _ = checked(drawn, path, tmp_path / "a")
    layer = gpd.read_file(drawn / "trees.gpkg", layer="trees")
    taped = read_taped(path).trees.set_index("tree_id")["taped_cm"]
    some = layer["tree_id"].isin(taped.index[:8]) & layer["dbh_cm"].notna()
    layer.loc[some, "dbh_cm"] = layer.loc[some, "tree_id"].map(taped)
    layer.to_file(tmp_path / "trees.gpkg", layer="trees")
    found, _, ears = checked(drawn, path, tmp_path / "b", trees=tmp_path / "trees.gpkg")
    assert found["bias_cm"] == straight["bias_cm"]
    assert any("stand in the tree layer too" in note for note in ears.infos)


def test_a_dbh_typed_before_the_draw_is_no_measured_one(drawn, tmp_path):
    layer = gpd.read_file(drawn / "trees.gpkg", layer="trees")
    trees = pd.read_csv(drawn / "tapes" / "tapes.csv").dropna(subset="dbh_cm")["tree_id"].head(3)
    typed = layer["tree_id"].isin(trees)
    # Within the interval of what was measured, as a good tape is.
    layer["rev_dbh_cm"] = (layer["dbh_cm"] + 0.2).where(typed)
    layer["rev_flag"] = pd.Series("dbh", layer.index).where(typed, None)
    layer.to_file(tmp_path / "trees.gpkg", layer="trees")
    settings = TapeSampleSettings(
        trees=tmp_path / "trees.gpkg", plots=drawn / "plots.csv", n=len(layer), output=tmp_path / "tapes"
    )
    sample(settings, Ears())
    path = filled(tmp_path, tmp_path)
    found, _, ears = checked(drawn, path, tmp_path / "out", trees=tmp_path / "trees.gpkg")
    table = pd.read_csv(tmp_path / "out" / "tape_check.csv").set_index("tree_id")
    measured = layer.set_index("tree_id")["dbh_cm"]
    assert table.loc[trees, "dbh_cm"].to_numpy() == pytest.approx(measured[trees].to_numpy())
    assert found["n_intervals"] == table["dbh_lo_cm"].notna().sum() == found["n_taped"]
    assert any("3 drawn trees had a DBH typed by a person" in note for note in ears.infos)


def test_two_tapes_of_one_tree_are_said(drawn, tmp_path):
    layer = gpd.read_file(drawn / "trees.gpkg", layer="trees")
    tree = int(pd.read_csv(drawn / "tapes" / "tapes.csv").dropna(subset="dbh_cm")["tree_id"].iloc[0])
    typed = layer["tree_id"] == tree
    layer["rev_dbh_cm"] = (layer["dbh_cm"] + 2.0).where(typed)
    layer["rev_flag"] = pd.Series("dbh", layer.index).where(typed, None)
    layer.to_file(tmp_path / "trees.gpkg", layer="trees")
    settings = TapeSampleSettings(
        trees=tmp_path / "trees.gpkg", plots=drawn / "plots.csv", n=len(layer), output=tmp_path / "tapes"
    )
    sample(settings, Ears())
    table = pd.read_csv(filled(tmp_path, tmp_path))
    table.loc[table["tree_id"] == tree, "taped_cm"] = (layer["dbh_cm"] + 0.3)[typed].round(1).iloc[0]
    table.to_csv(tmp_path / "other.csv", index=False)
    _, _, ears = checked(drawn, tmp_path / "other.csv", tmp_path / "out", trees=tmp_path / "trees.gpkg")
    assert any("another typed into the layer" in note and f"tree {tree}:" in note for note in ears.infos)


def test_four_tapes_that_slipped_blame_no_layer(drawn, tmp_path):
    settings = TapeSampleSettings(trees=drawn / "trees.gpkg", plots=drawn / "plots.csv", n=6, output=tmp_path / "tapes")
    sample(settings, Ears())
    table = pd.read_csv(filled(tmp_path, tmp_path))
    measured = table.index[table["dbh_cm"].notna()]
    assert len(measured) == 4
    table.loc[measured, "taped_cm"] = np.roll(table["taped_cm"][measured], 1)
    table.to_csv(tmp_path / "slipped.csv", index=False)
    _, _, ears = checked(drawn, tmp_path / "slipped.csv", tmp_path / "out")
    assert any("no better than exchanged ones" in said for said in ears.warnings)
    assert not any("too narrow" in said for said in ears.warnings)


def test_a_filled_in_table_is_not_written_over(drawn, tmp_path):
    (tmp_path / "tapes").mkdir()
    filled(drawn, tmp_path).rename(tmp_path / "tapes" / "tapes.csv")
    settings = TapeSampleSettings(trees=drawn / "trees.gpkg", plots=drawn / "plots.csv", output=tmp_path / "tapes")
    with pytest.raises(InputError, match="20 trees of it are filled in; give another folder"):
        sample(settings, Ears())


def test_without_plots_and_with_few_trees(tmp_path):
    trees = [Tree(k, EAST + 7.0 * k, NORTH, dbh_cm=20.0 + k, dbh_se_cm=0.5, method="photos") for k in range(40)]
    write_trees(tmp_path / "trees.gpkg", trees, CRS)
    found = sample(TapeSampleSettings(trees=tmp_path / "trees.gpkg", n=30, output=tmp_path / "t"), Ears())
    page = (tmp_path / "t" / "tape_form.html").read_text(encoding="utf-8")
    assert found["n_frame"] == 40 and page.count("<h2") == 3 and "near_id" in page
    table = pd.read_csv(tmp_path / "t" / "tapes.csv")
    # The trees stand in a row: so does the walk.
    assert (np.diff(table["x"]) > 0).all()
    ears = Ears()
    write_trees(tmp_path / "one.gpkg", trees[:1], CRS)
    found = sample(TapeSampleSettings(trees=tmp_path / "one.gpkg", n=5, output=tmp_path / "o"), ears)
    assert found["n"] == 1 and any("5 tapes asked for (--n), 1 trees are there" in w for w in ears.warnings)
    write_trees(tmp_path / "none.gpkg", [], CRS)
    with pytest.raises(InputError, match="none of its 0 trees"):
        sample(TapeSampleSettings(trees=tmp_path / "none.gpkg", output=tmp_path / "n"), Ears())
