"""``match-plots`` end to end: layers, styles, what a person locked, and mistakes."""

from __future__ import annotations

import re
import sqlite3
import subprocess
import sys

import geopandas as gpd
import numpy as np
import pandas as pd
import pyproj
import pytest
from shapely.geometry import LineString, Point
from shared_data import needs_shared

from tests.simulated_tallies import simulate
from treedgs_geo.core.errors import InputError, OutputError
from treedgs_geo.core.progress import Reporter
from treedgs_geo.inventory.accuracy.tables import evidence_from_pairs
from treedgs_geo.inventory.pairs_layer import FIELD, MEASURED, PAIR_COLUMNS, PAIRS, PLOTS, SUGGESTED
from treedgs_geo.inventory.searched import SEARCHED, searched_table
from treedgs_geo.inventory.side_layers import add_tables
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.verbs.match_plots import MatchPlotsSettings, run

CENTRE = np.array([611337.0, 3718451.0])
OFFSET = np.array([2.1, -1.3])


class Ears(Reporter):
    """Remembers warnings."""

    def __init__(self):
        super().__init__()
        self.warnings: list[str] = []

    def warn(self, message):
        self.warnings.append(message)


@pytest.fixture
def survey(tmp_path):
    """15 field trees whose plot centre is 2.5 m off; tree 3 was missed, one measured tree is false, one has no DBH."""
    rng = np.random.default_rng(4)
    xy = np.array([[0.0, 0.0]])
    while len(xy) < 15:
        point = rng.uniform(-8, 8, 2)
        if np.hypot(*point) < 8 and np.hypot(*(xy - point).T).min() > 1.5:
            xy = np.vstack([xy, point])
    dbh = rng.uniform(12, 40, 15)
    azimuth = np.degrees(np.arctan2(*xy.T)) % 360
    pd.DataFrame(
        {
            "plot_id": "p",
            "tree_id": range(1, 16),
            "azimuth_deg": azimuth.round(2),
            "distance_m": np.hypot(*xy.T).round(3),
            "dbh_cm": dbh.round(1),
        }
    ).to_csv(tmp_path / "field.csv", index=False)
    pd.DataFrame({"plot_id": ["p"], "easting": CENTRE[0], "northing": CENTRE[1], "epsg": 6344, "radius_m": 9.0}).to_csv(
        tmp_path / "plots.csv", index=False
    )
    stand = xy + CENTRE + OFFSET + rng.normal(0, 0.05, (15, 2))
    trees = [
        Tree(100 + k, *stand[k], z_ground=38.0, dbh_cm=dbh[k] + 0.5, dbh_se_cm=0.4, method="photos")
        for k in range(15)
        if k != 2
    ]
    trees[5] = Tree(105 + 1, *stand[6], qc_flag="reject", qc_reason="few_points", method="photos")
    free = np.array([9.0, 0.0]) / 2 + CENTRE + OFFSET
    assert np.hypot(*(stand - free).T).min() > 1.0
    trees.append(Tree(200, *free, z_ground=38.0, dbh_cm=20.0, dbh_se_cm=0.4, method="photos"))
    write_trees(tmp_path / "trees.gpkg", trees, pyproj.CRS.from_epsg(6344))
    return tmp_path


def match(folder, **more):
    ears = Ears()
    settings = MatchPlotsSettings(
        **{
            "trees": folder / "trees.gpkg",
            "field": folder / "field.csv",
            "plots": folder / "plots.csv",
            "output": folder / "pairs.gpkg",
            "north": "grid",
            **more,
        }
    )
    return run(settings, ears), ears.warnings


def edit(path, change):
    """What a person does in QGIS: change the pairs layer in place."""
    layers = {name: gpd.read_file(path, layer=name) for name in (PAIRS, SUGGESTED, FIELD, MEASURED, PLOTS)}
    change(layers)
    path.unlink()
    for name, table in layers.items():
        table.to_file(path, layer=name, driver="GPKG", mode="a" if path.exists() else "w")


def test_pairs_are_found_and_every_tree_is_kept(survey):
    result, _ = match(survey)
    pairs = gpd.read_file(survey / "pairs.gpkg", layer=PAIRS)
    assert result["n_pairs"] == len(pairs) == 14 and list(pairs.columns) == [*PAIR_COLUMNS, "geometry"]
    assert (pairs.tree_id == pairs.field_id.astype(int) + 99).all() and set(pairs.pair_status) == {"auto"}
    done = pairs[pairs.dbh_cm.notna()]
    assert len(done) == 13 and done.delta_cm.to_numpy() == pytest.approx(0.5, abs=0.06)
    field = gpd.read_file(survey / "pairs.gpkg", layer=FIELD)
    assert len(field) == 15 and field.loc[field.paired == "no", "field_id"].tolist() == ["3"]
    measured = gpd.read_file(survey / "pairs.gpkg", layer=MEASURED)
    assert measured.loc[measured.paired == "no", "tree_id"].tolist() == [200]
    plot = gpd.read_file(survey / "pairs.gpkg", layer=PLOTS).iloc[0]
    assert [plot.offset_e_m, plot.offset_n_m] == pytest.approx(OFFSET, abs=0.08) and plot.status == "auto"
    with sqlite3.connect(survey / "pairs.gpkg") as connection:
        styled = {name for (name,) in connection.execute("SELECT f_table_name FROM layer_styles")}
    assert styled == {PAIRS, SUGGESTED, FIELD, MEASURED, PLOTS}


def test_the_documented_fields_are_the_real_ones():
    from pathlib import Path

    page = (Path(__file__).parents[2] / "docs" / "technician" / "pairing.md").read_text(encoding="utf-8")
    words = {word for part in page.split("`")[1::2] for word in part.replace(",", " ").split()}
    assert set(PAIR_COLUMNS) <= words and {PAIRS, SUGGESTED, FIELD, MEASURED, PLOTS} <= words


def test_dbh_never_decides(survey):
    match(survey)
    first = gpd.read_file(survey / "pairs.gpkg", layer=PAIRS)
    field = pd.read_csv(survey / "field.csv")
    field["dbh_cm"] = field.dbh_cm.to_numpy()[::-1]
    field.to_csv(survey / "field.csv", index=False)
    match(survey, output=survey / "other.gpkg")
    second = gpd.read_file(survey / "other.gpkg", layer=PAIRS)
    assert first[["field_id", "tree_id", "margin"]].equals(second[["field_id", "tree_id", "margin"]])


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda d: np.roll(d, 1), "plot p: from tree .* has slipped down; hold the DBHs"),
        (np.sort, "plot p: .* the column was sorted alone; hold the DBHs"),
    ],
)
def test_dbhs_of_other_trees_are_refused(survey, change, says):
    field = pd.read_csv(survey / "field.csv")
    field["dbh_cm"] = change(field["dbh_cm"].to_numpy())
    field.to_csv(survey / "field.csv", index=False)
    with pytest.raises(InputError, match=says):
        match(survey)
    assert not (survey / "pairs.gpkg").exists()


def test_a_tally_in_the_order_of_its_dbhs_is_paired(survey):
    field = pd.read_csv(survey / "field.csv").sort_values("dbh_cm")
    field.to_csv(survey / "field.csv", index=False)
    assert match(survey)[0]["n_pairs"] >= 13


def test_what_a_person_locked_survives(survey):
    match(survey)
    path = survey / "pairs.gpkg"

    def change(layers):
        pairs, measured = layers[PAIRS], layers[MEASURED].set_index("tree_id")
        pairs.loc[pairs.field_id == "1", "pair_status"] = "ok"
        pairs.loc[pairs.field_id == "4", "pair_status"] = "rejected"
        row = pairs.index[pairs.field_id == "8"][0]
        start = pairs.geometry[row].coords[0]
        end = measured.geometry[200]
        pairs.loc[row, "geometry"] = LineString([start, (end.x + 0.1, end.y)])
        pairs.loc[row, "pair_status"] = "moved"

    edit(path, change)
    for _ in range(2):  # and once more: locking does not wear off
        match(survey)
        pairs = gpd.read_file(path, layer=PAIRS).set_index("field_id")
        assert pairs.pair_status[["1", "4", "8"]].tolist() == ["ok", "rejected", "moved"]
        assert pairs.tree_id["8"] == 200 and pairs.dbh_cm["8"] == 20.0
        assert set(pairs.pair_status.drop(["1", "4", "8"])) == {"auto"} and len(pairs) == 14
        field = gpd.read_file(path, layer=FIELD).set_index("field_id")
        assert field.paired["4"] == "rejected" and field.paired["1"] == "yes"


def test_locked_pairs_follow_a_new_measurement(survey):
    """Measured again, the trees have other numbers: a locked pair means the tree at its end."""
    match(survey)
    edit(survey / "pairs.gpkg", lambda layers: layers[PAIRS].__setitem__("pair_status", "ok"))
    before = gpd.read_file(survey / "pairs.gpkg", layer=PAIRS).set_index("field_id")
    trees = gpd.read_file(survey / "trees.gpkg", layer="trees")
    trees["tree_id"] = 500 - trees.tree_id
    trees[trees.tree_id != 500 - 101].to_file(survey / "trees.gpkg", layer="trees", driver="GPKG")
    _, warnings = match(survey)
    after = gpd.read_file(survey / "pairs.gpkg", layer=PAIRS).set_index("field_id")
    rest = after.index.drop("2")
    assert (after.tree_id[rest] == 500 - before.tree_id[rest]).all()
    assert pd.isna(after.tree_id["2"]) and after.pair_status["2"] == "ok"
    assert any("no measured tree within" in text for text in warnings)


def test_a_line_drawn_by_hand_is_a_pair(survey):
    match(survey)

    def change(layers):
        field, measured = layers[FIELD].set_index("field_id"), layers[MEASURED].set_index("tree_id")
        start, end = field.geometry["3"], measured.geometry[200]
        line = LineString([(start.x, start.y), (end.x, end.y)])
        layers[PAIRS] = pd.concat(
            [layers[PAIRS], gpd.GeoDataFrame({"plot_id": [None]}, geometry=[line], crs=field.crs)]
        )

    edit(survey / "pairs.gpkg", change)
    match(survey)
    pairs = gpd.read_file(survey / "pairs.gpkg", layer=PAIRS).set_index("field_id")
    assert pairs.tree_id["3"] == 200 and pairs.pair_status["3"] == "moved"


@pytest.mark.parametrize(
    ("shift", "says"),
    [
        ({}, None),
        (
            {2: (5.0, -3.4)},
            r"plot p2: its trees stand -[45].* m east and \+3.* m north of.* apart from.*, the others 0",
        ),
        (dict.fromkeys(range(5), (-4.0, 2.0)), r"5 plots are moved alike, \+4.* m east and -[12].* m north"),
    ],
)
def test_a_centre_that_lies_elsewhere_and_a_shift_of_all_are_said(tmp_path, shift, says):
    """The trees are paired all the same; a stand table would look for them around the wrong centre."""
    rng = np.random.default_rng(7)
    field, stems, centres = [], [], []
    for k in range(5):
        one = simulate(40 + k, "random", 0.0)
        middle = CENTRE + [100.0 * k, 0.0]
        bearing, away = np.degrees(np.arctan2(*one.field.T)) % 360, np.hypot(*one.field.T)
        dbh = rng.uniform(12, 45, len(one.measured) + 1)  # the last: of trees that were missed
        field += [(f"p{k}", n + 1, bearing[n], away[n], dbh[one.truth[n]]) for n in range(len(away))]
        stems += [(*(middle + xy), dbh[n]) for n, xy in enumerate(one.measured)]
        centres.append((f"p{k}", *(middle + rng.normal(0, 0.3, 2) + shift.get(k, (0.0, 0.0))), 6344, 12.0))
    for name, rows, heads in (
        ("field", field, "plot_id tree_id azimuth_deg distance_m dbh_cm"),
        ("trees", [(n + 1, *row) for n, row in enumerate(stems)], "tree_id x y dbh_cm"),
        ("plots", centres, "plot_id easting northing epsg radius_m"),
    ):
        pd.DataFrame(rows, columns=heads.split()).to_csv(tmp_path / f"{name}.csv", index=False)
    result, warnings = match(tmp_path, trees=tmp_path / "trees.csv", crs="EPSG:6344")
    said = [text for text in warnings if str(tmp_path / "plots.csv") in text]
    assert result["n_plots_to_check"] == 0 and result["n_pairs"] > 80
    assert not said if says is None else len(said) == 1 and re.search(says, said[0])


def test_a_plot_left_to_a_person_is_paired_once_confirmed(survey):
    result, warnings = match(survey, min_ratio=10.0)
    assert result["n_pairs"] == 0 and result["n_plots_to_check"] == 1 and result["n_suggested"] == 14
    assert any("hand check" in text for text in warnings)
    edit(survey / "pairs.gpkg", lambda layers: layers[PLOTS].__setitem__("status", "ok"))
    result, _ = match(survey, min_ratio=10.0)
    assert result["n_pairs"] == 14 and result["n_plots_to_check"] == 0
    result, _ = match(survey, min_ratio=10.0)
    assert result["n_pairs"] == 14


QGIS = """
import sqlite3, sys
file = sqlite3.connect(sys.argv[1], isolation_level=None)
assert file.execute("PRAGMA journal_mode = WAL").fetchone() == ("wal",)
for (name,) in file.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'").fetchall():
    if "update" in name:  # they call functions that only GDAL and QGIS have
        file.execute(f'DROP TRIGGER "{name}"')
for line in sys.stdin:
    print(file.execute(line).fetchone(), flush=True)
"""


def test_the_file_may_be_open_in_qgis(survey):
    """QGIS keeps a write-ahead log beside the file: edits in it are read, and it is never replayed into new content."""
    match(survey)
    path = survey / "pairs.gpkg"
    # A process of its own, as QGIS is: SQLite's locks do not work between two libraries in one process.
    with subprocess.Popen(
        [sys.executable, "-c", QGIS, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as qgis:

        def ask(line):
            qgis.stdin.write(line + "\n")
            qgis.stdin.flush()
            return qgis.stdout.readline().strip()

        ask("UPDATE pairs SET pair_status = 'ok' WHERE field_id = '1'")
        assert (survey / "pairs.gpkg-wal").stat().st_size > 0
        match(survey)
        assert ask("SELECT pair_status FROM pairs WHERE field_id = '1'") == "('ok',)"
        assert ask("PRAGMA integrity_check") == "('ok',)"
        ask("BEGIN IMMEDIATE")
        with pytest.raises(OutputError, match="save or drop the edits"):
            match(survey)
        ask("ROLLBACK")
    pairs = gpd.read_file(path, layer=PAIRS).set_index("field_id")
    assert pairs.pair_status["1"] == "ok" and len(pairs) == 14
    assert sorted(p.name for p in survey.iterdir()) == ["field.csv", "pairs.gpkg", "plots.csv", "trees.gpkg"]


def test_an_unknown_status_and_a_foreign_file_are_reported_and_kept(survey):
    match(survey)
    path = survey / "pairs.gpkg"
    edit(path, lambda layers: layers[PAIRS].__setitem__("pair_status", "yes"))
    before = path.read_bytes()
    with pytest.raises(InputError, match="pair_status 'yes' is unknown"):
        match(survey)
    assert path.read_bytes() == before
    with pytest.raises(InputError, match="holds no layer pairs .* expected the output of match-plots"):
        match(survey, output=survey / "trees.gpkg")
    with pytest.raises(InputError, match="expected .gpkg"):
        match(survey, output=survey / "pairs.shp")
    assert not list(survey.glob(".*"))


def test_csv_of_measured_trees_needs_a_unit(survey):
    trees = gpd.read_file(survey / "trees.gpkg", layer="trees")
    table = pd.DataFrame({"tree_id": trees.tree_id, "X": trees.x, "Y": trees.y, "DBH": trees.dbh_cm / 100})
    table.to_csv(survey / "trees.csv", index=False)
    more = {"trees": survey / "trees.csv", "crs": "EPSG:6344"}
    for unit, message in (("auto", "--trees-dbh-unit"), ("cm", "expected trees of about")):
        with pytest.raises(InputError, match=message):
            match(survey, **more, trees_dbh_unit=unit)
    assert match(survey, **more, trees_dbh_unit="m")[0]["n_pairs"] == 14


def test_no_measured_tree_at_all(survey):
    write_trees(survey / "trees.gpkg", [], pyproj.CRS.from_epsg(6344))
    result, warnings = match(survey)
    assert result["n_pairs"] == 0 and result["n_plots_to_check"] == 1 and "no measured tree" in warnings[0]
    assert len(gpd.read_file(survey / "pairs.gpkg", layer=FIELD)) == 15


def test_a_row_without_a_bearing_is_left_out_alone(survey):
    table = pd.read_csv(survey / "field.csv")
    table.loc[4, "azimuth_deg"] = np.nan
    table.to_csv(survey / "field.csv", index=False)
    result, warnings = match(survey)
    assert result["n_field"] == 14 and result["n_pairs"] == 13
    assert any("line 6 (tree 5: azimuth_deg is empty)" in text for text in warnings)


def test_plots_at_the_turn_s_limit_are_reported_with_what_to_change(survey):
    """A compass read as true north where the declination is large: 14 degrees, where 8 are searched."""
    table = pd.read_csv(survey / "field.csv")
    table["azimuth_deg"] = (table["azimuth_deg"] - 14.0) % 360
    table.to_csv(survey / "field.csv", index=False)
    result, warnings = match(survey, north="true")
    (plot,) = gpd.read_file(survey / "pairs.gpkg", layer=PLOTS).to_dict("records")
    assert (result["n_plots_at_turn_limit"], result["n_plots_to_check"], result["n_pairs"]) == (1, 1, 0)
    assert plot["status"] == "check" and abs(plot["rot_deg"]) >= 7.9
    (said,) = [text for text in warnings if "largest turn searched" in text and "Change" in text]
    # True bearings are turned by the convergence of -0.7 degrees already.
    found = float(said.split("fit clearly, at ")[1].split(".  ")[0].split(". ")[0])
    assert found == pytest.approx(14.7, abs=0.5)
    for word in ("--north (now true", "--declination-deg (there ", "azimuth_gon", "--rotation-deg"):
        assert word in said
    again, warnings = match(survey, north="true", rotation_deg=20.0)
    assert again["n_pairs"] == 14 and again["n_plots_at_turn_limit"] == 0
    as_said, _ = match(survey, north="magnetic", declination_deg=14.0)
    assert as_said["n_pairs"] == 14


@pytest.mark.parametrize("name", ["plot_a", "plot_e"])
def test_rendered_plots(name, tmp_path):
    """Real noise of tape and compass: true stems as measured trees, the tally and the centre as surveyed."""
    import json

    folder = needs_shared(name)
    truth = pd.read_csv(folder / "truth" / "trees.csv")
    trees = [Tree(k, r.E_bh, r.N_bh, dbh_cm=r.dbh_cm, dbh_se_cm=0.5, method="photos") for k, r in truth.iterrows()]
    write_trees(tmp_path / "trees.gpkg", trees, pyproj.CRS.from_epsg(6344))
    result, _ = match(tmp_path, field=folder / "field_trees.csv", plots=folder / "plots.csv", north="true")
    key = json.loads((folder / "truth" / "field_key.json").read_text())["field_tree_id_to_truth"]
    pairs = gpd.read_file(tmp_path / "pairs.gpkg", layer=PAIRS)
    assert len(pairs) == len(key) == result["n_field"]
    assert all(truth.tree_id[row.tree_id] == key[row.field_id] for row in pairs.itertuples())
    assert abs(gpd.read_file(tmp_path / "pairs.gpkg", layer=PLOTS).rot_deg[0]) < 1


def test_a_real_plot_pairs(tmp_path):
    """Petawawa PRF025: 62 tallied stems, a mobile-LiDAR map with DBH in metres; 58 pair by a shift alone."""
    folder = needs_shared("field_prf025")
    (tmp_path / "plots.csv").write_text(
        "plot_id,easting,northing,epsg,radius_m\nPRF025,312029.5177,5096039.418,2959,11.28\n"
    )
    result, _ = match(
        tmp_path,
        trees=folder / "PRF025_mls_treemap.csv",
        field=folder / "PRF025_field.csv",
        crs="EPSG:2959",
        dbh_unit="cm",
        distance_unit="m",
        trees_dbh_unit="m",
    )
    assert result["n_pairs"] >= 52 and result["n_pairs"] + result["n_suggested"] >= 56
    pairs = gpd.read_file(tmp_path / "pairs.gpkg", layer=PAIRS)
    assert np.sqrt((pairs.delta_cm**2).mean()) < 1.2 and pairs.delta_cm.abs().max() < 4
    plot = gpd.read_file(tmp_path / "pairs.gpkg", layer=PLOTS).iloc[0]
    assert plot.offset_e_m == pytest.approx(-0.59, abs=0.3) and plot.offset_n_m == pytest.approx(0.18, abs=0.3)


def test_field_trees_on_ground_that_was_not_searched_are_not_missed(survey):
    field = pd.read_csv(survey / "field.csv")
    beyond = field.assign(tree_id=field.tree_id + 100, distance_m=11.0 + 0.1 * np.arange(len(field)), dbh_cm=25.0)
    pd.concat([field, beyond]).to_csv(survey / "field.csv", index=False)
    pd.read_csv(survey / "plots.csv").assign(radius_m=12.62).to_csv(survey / "plots.csv", index=False)
    before = evidence_from_pairs(match(survey) and survey / "pairs.gpkg")
    crs = pyproj.CRS.from_epsg(6344)
    searched = searched_table(Point(CENTRE + OFFSET).buffer(9.5), [], crs)
    add_tables(survey / "trees.gpkg", {SEARCHED: searched})
    _, warnings = match(survey, output=survey / "searched.gpkg")
    after = evidence_from_pairs(survey / "searched.gpkg")
    assert any("15 of 30 field trees stand where stems were not searched for" in text for text in warnings)
    assert (len(before.trees), len(after.trees)) == (30, 15)
    assert any("15 field trees on ground that was not searched" in note for note in after.notes)
