"""Species, status and notes that a person writes into the tree layer: the next run keeps them, the stand table too."""

from __future__ import annotations

import json

import geopandas as gpd
import pandas as pd
import pytest
from inventory.stand_helpers import CRS, EAST, NORTH, Ears, edit_in_qgis, figures, make_survey, report

from treedgs_geo.campaign.layer import write_layer
from treedgs_geo.core.errors import InputError
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.inventory.tree_reading import LAYER, read_trees
from treedgs_geo.pointcloud.file_crs import LOCAL_CRS
from treedgs_geo.stems.quality.tree import Tree

#: What a person does: opens the layer with its style, starts editing, fills in the form's fields, saves.
QGIS_WRITE = """
import json, sys
from qgis.core import QgsApplication, QgsVectorLayer
app = QgsApplication([], False)
app.initQgis()
layer = QgsVectorLayer(sys.argv[1] + "|layername=trees", "trees", "ogr")
assert layer.isValid() and layer.loadDefaultStyle()[1], "no style"
setup = layer.editorWidgetSetup(layer.fields().indexOf("status"))
print("STATUS", setup.type(), sorted(key for entry in setup.config()["map"] for key in entry))
print("FORM", [box.name() for box in layer.editFormConfig().tabs()])
assert layer.startEditing()
for feature in layer.getFeatures():
    for name, value in json.loads(sys.argv[2]).get(str(feature["tree_id"]), {}).items():
        assert layer.changeAttributeValue(feature.id(), layer.fields().indexOf(name), value)
assert layer.commitChanges(), layer.commitErrors()
del layer
app.exitQgis()
print("SAVED")
"""


def trees(moved=0.0, ids=1, gone=()):
    """Five trees five metres apart."""
    return [
        Tree(ids + k, EAST + 5 * k + moved, NORTH, dbh_cm=20.0 + k, dbh_se_cm=0.5, method="photos")
        for k in range(5)
        if k not in gone
    ]


def test_what_is_written_in_qgis_stays_with_its_tree_in_the_next_run(tmp_path):
    path = write_trees(tmp_path / "trees.gpkg", trees(), CRS)
    first = read_trees(path)
    assert first[["species", "status", "note"]].isna().all().all()
    said = edit_in_qgis(
        QGIS_WRITE, path, {"1": {"species": "PITA", "note": "ivy"}, "3": {"status": "dead"}, "5": {"species": "X"}}
    )
    assert "STATUS ValueMap ['dead', 'live', 'not said']" in said and "Yours to write" in said
    ears = Ears()
    # The next run has other numbers, moves the trees a little, and lacks the last one.
    write_trees(path, trees(moved=0.3, ids=11, gone=(4,)), CRS, reporter=ears)
    table = read_trees(path).set_index("tree_id")
    assert table.species[11] == "PITA" and table.note[11] == "ivy" and table.status[13] == "dead"
    assert table[["species", "status", "note"]].notna().sum().sum() == 3
    assert any("at 2 trees is kept" in text for text in ears.infos)
    (lost,) = ears.warnings
    assert "5 at 611320.0 3718400.0 (X)" in lost and "not in the new layer" in lost


@pytest.mark.parametrize("suffix", [".shp", ".geojson", ".csv"])
def test_every_format_keeps_it(tmp_path, suffix):
    path = write_trees(tmp_path / f"trees{suffix}", trees(), CRS)
    table = pd.read_csv(path) if suffix == ".csv" else gpd.read_file(path)
    for name in ("species", "status", "note"):
        table[name] = table[name].astype(object)
    table.loc[2, ["species", "status"]] = "Pinus taeda", "dead"
    table.to_csv(path, index=False) if suffix == ".csv" else table.to_file(path)
    write_trees(path, trees(moved=0.2), CRS)
    again = pd.read_csv(path) if suffix == ".csv" else read_trees(path)
    assert again.loc[2, ["species", "status"]].tolist() == ["Pinus taeda", "dead"]
    assert again.drop(index=2)[["species", "status", "note"]].isna().all().all()


def test_entries_follow_a_change_of_crs_and_never_two_trees(tmp_path):
    path = tmp_path / "trees.gpkg"
    write_trees(path, [Tree(1, EAST, NORTH, dbh_cm=20.0, species="PITA")], CRS)
    east, north = gpd.GeoSeries(gpd.points_from_xy([EAST], [NORTH]), crs=CRS).to_crs(26916).get_coordinates().iloc[0]
    near = [Tree(7, east + 0.1, north, dbh_cm=20.0), Tree(8, east - 0.3, north, dbh_cm=9.0)]
    write_trees(path, near, gpd.GeoSeries([], crs=26916).crs)
    assert read_trees(path).set_index("tree_id").species.dropna().to_dict() == {7: "PITA"}


def test_a_layer_in_local_metres_keeps_it(tmp_path):
    """Coordinates that are tied to nothing are taken as they are."""
    path = write_trees(tmp_path / "trees.gpkg", [Tree(1, 3.0, 4.0, dbh_cm=20.0, note="fork")], LOCAL_CRS)
    write_trees(path, [Tree(2, 3.1, 4.0, dbh_cm=20.0)], LOCAL_CRS)
    assert read_trees(path).note.tolist() == ["fork"]


def test_a_file_that_is_no_tree_layer_is_no_trouble(tmp_path):
    for name, content in (("a.csv", "x\n1\n"), ("b.geojson", "{}"), ("c.gpkg", "no database")):
        (tmp_path / name).write_text(content)
        write_trees(tmp_path / name, trees(), CRS)


def test_a_campaign_s_layer_keeps_it_too(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    write_trees(tmp_path / "a" / "trees.gpkg", trees(), CRS)
    write_trees(tmp_path / "b" / "trees.gpkg", trees(moved=50.0), CRS)
    plots = [
        {"plot_id": name, "number": k, "folder": tmp_path / name, "crs": "EPSG:6344", "table": False}
        for k, name in enumerate("ab")
    ]
    path = tmp_path / "all.gpkg"
    write_layer(path, plots, "EPSG:6344")
    edit_in_qgis(QGIS_WRITE, path, {"100002": {"species": "ACRU", "status": "dead"}})
    ears = Ears()
    assert write_layer(path, plots, "EPSG:6344", ears) == 10
    table = gpd.read_file(path, layer=LAYER).set_index("tree_id")
    assert table.species[100002] == "ACRU" and table.species.notna().sum() == table.status.notna().sum() == 1
    assert any("1 tree is kept" in text for text in ears.infos)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A survey whose tree layer says of three trees what they are."""
    folder = make_survey(tmp_path_factory.mktemp("stand"))
    table = read_trees(folder / "trees.gpkg")
    inside = table[(table.x - EAST - 40) ** 2 + (table.y - NORTH - 30) ** 2 < 90]
    one, two, three = inside[inside.dbh_cm.notna()].tree_id.head(3)
    fates = {int(one): ("ACRU", "live", "hollow"), int(two): (None, "dead", None), int(three): ("PINTA", None, None)}
    for number, entries in fates.items():
        table.loc[table.tree_id == number, ["species", "status", "note"]] = entries
    table.to_file(folder / "trees.gpkg", layer=LAYER)
    return folder, *fates


def test_the_stand_table_honours_what_is_written(written):
    folder, maple, dead, odd = written
    result, ears, out = report(folder)
    plain, _ = figures(folder)
    table = pd.read_csv(out / "stand_trees.csv").set_index("tree_id")
    assert table.species[maple] == "ACRU" and table.note[maple] == "hollow" and table.counts_as[dead] == "dead"
    assert table.species.value_counts().idxmax() == "PITA"
    summary = json.loads((out / "summary.json").read_text())
    assert summary["n_dead"] == 1 and summary["dead_per_ha"]["ba"] > 0
    assert dead not in plain.trees["tree_id"].to_numpy()[plain.rows["tree"].unique()]
    (said,) = [text for text in ears.warnings if "PINTA" in text and "is in no list" in text]
    assert "1 tree is in no list" in said and "nearest known: PITA (loblolly pine)" in said
    assert said in summary["warnings"]


def test_an_unknown_species_as_a_setting_is_refused(written, tmp_path):
    folder, *_ = written
    with pytest.raises(InputError, match=r"--species: .*'PTAI'.*nearest known"):
        figures(folder, species="PTAI")
    own = tmp_path / "own.csv"
    own.write_text(
        "id,quantity,species,origin,formula,dbh_unit,height_unit,result_unit,dbh_min,dbh_max,limits,source\n"
        "mine,volume,PTAI,any,0.0001*D**2*H,cm,m,m3,1,100,source,me\n"
    )
    _, ears = figures(folder, species="PTAI", equations=own)
    assert not any("'PTAI'" in text for text in ears.warnings)


def test_unknown_status_words_are_counted(tmp_path):
    folder = make_survey(tmp_path)
    table = read_trees(folder / "trees.gpkg")
    table.loc[table.index[:3], "status"] = "leaning"
    table.to_file(folder / "trees.gpkg", layer=LAYER)
    _, ears = figures(folder)
    assert any("'leaning' (3 trees): not known as live or dead" in text for text in ears.warnings)


@pytest.mark.parametrize("suffix", [".gpkg", ".shp", ".geojson", ".csv"])
def test_own_columns_and_drawn_trees_stay(tmp_path, suffix):
    path = write_trees(tmp_path / f"trees{suffix}", trees(), CRS)
    table = pd.read_csv(path) if suffix == ".csv" else read_trees(path)
    table["crew"] = ["Ana", None, None, None, "Bo"]
    table["class"] = [1, 2, None, None, None]
    drawn = table.iloc[[0]].assign(tree_id=None, dbh_cm=31.5, run_id=None, x=EAST + 40, crew="Cy")
    table = pd.concat([table, drawn], ignore_index=True)
    if suffix == ".csv":
        table.to_csv(path, index=False, sep=";", decimal=",")  # as Excel saves it in half of the world
    else:
        table.loc[5, "geometry"] = gpd.points_from_xy([EAST + 40], [NORTH])[0]
        table.to_file(path, **({"layer": LAYER} if suffix == ".gpkg" else {}))
    for _ in range(2):
        ears = Ears()
        write_trees(path, trees(moved=0.2, ids=11, gone=(4,)), CRS, reporter=ears)
    again = pd.read_csv(path) if suffix == ".csv" else read_trees(path)
    again = again.set_index("tree_id")
    assert again.crew.dropna().to_dict() == {11: "Ana", 15: "Cy"}
    assert pd.to_numeric(again["class"]).dropna().to_dict() == {11: 1, 12: 2, 15: 1}
    assert float(again.rev_dbh_cm[15]) == 31.5 and again.rev_flag[15] == "dbh" and pd.isna(again.dbh_cm[15])
    (lost,) = tmp_path.glob("trees.lost*.csv")
    assert pd.read_csv(lost).crew.tolist() == ["Bo"]


def test_a_table_that_can_no_longer_be_read_is_kept(tmp_path):
    path = write_trees(tmp_path / "trees.csv", trees(), CRS)
    path.write_text(path.read_text().replace("611300", "six hundred", 1))
    before, ears = path.read_bytes(), Ears()
    write_trees(path, trees(), CRS, reporter=ears)
    assert (tmp_path / "trees.before.csv").read_bytes() == before and "trees.before.csv" in ears.warnings[0]


def test_a_campaign_s_own_columns_stay(tmp_path):
    (tmp_path / "a").mkdir()
    write_trees(tmp_path / "a" / "trees.gpkg", trees(), CRS)
    plots = [{"plot_id": "a", "number": 1, "folder": tmp_path / "a", "crs": "EPSG:6344", "table": False}]
    path = tmp_path / "all.gpkg"
    write_layer(path, plots, "EPSG:6344")
    table = read_trees(path)
    table["crew"] = ["Ana", None, None, None, None]
    table.to_file(path, layer=LAYER)
    write_layer(path, plots, "EPSG:6344")
    again = read_trees(path)
    assert again.crew.tolist().count("Ana") == 1 and list(again.columns).count("camp_plot") == 1


def test_a_row_that_other_steps_refuse_costs_nothing_of_what_is_written(tmp_path):
    """No point, several points, a flag that means nothing: what was typed into them and the others stays."""
    from shapely import MultiPoint

    path = write_trees(tmp_path / "trees.gpkg", trees(), CRS)
    table = read_trees(path)
    table["species"], table["crew"] = [f"S{k}" for k in range(5)], "Ana"
    table["geometry"] = [MultiPoint([point]) for point in table.geometry]
    table.loc[1, "geometry"] = None
    table.loc[3, "qc_flag"] = "what?"
    table.to_file(path, layer=LAYER)
    ears = Ears()
    write_trees(path, trees(moved=0.1), CRS, reporter=ears)
    again = read_trees(path)
    assert again.species.tolist() == [f"S{k}" for k in range(5)] and again.crew.eq("Ana").all() and not ears.warnings
