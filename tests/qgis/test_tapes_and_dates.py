"""The tape verbs and two dates in real QGIS: drawn, filled in as in the layer's form, checked, corrected, compared."""

import ast
import json
import re
import subprocess

import geopandas as gpd
import numpy as np
import pytest

from tests.inventory.stand_helpers import edit_in_qgis, make_survey

#: Types every drawn tree's diameter, and that one of them is no tree, as the form does.
FILL_IN = """
import json, sys
from qgis.core import QgsApplication, QgsVectorLayer
application = QgsApplication([], False)
application.initQgis()
layer = QgsVectorLayer(sys.argv[1] + "|layername=tapes", "tapes", "ogr")
assert layer.isValid() and layer.startEditing()
given = json.loads(sys.argv[2])
names = layer.fields()
for feature in layer.getFeatures():
    value = given[str(feature["tree_id"])]
    if value is None:
        layer.changeAttributeValue(feature.id(), names.indexOf("state"), "none")
    else:
        layer.changeAttributeValue(feature.id(), names.indexOf("taped_cm"), value)
setup = layer.editorWidgetSetup(names.indexOf("state"))
assert layer.commitChanges(), layer.commitErrors()
print("SAVED", setup.type(), json.dumps(setup.config()))
table, form = layer.attributeTableConfig(), layer.editFormConfig()
print("HIDDEN", [column.name for column in table.columns() if column.name and column.hidden], table.sortExpression())
print("WRITTEN", sorted(names[i].name() for i in names.allAttributesList() if not form.readOnly(i)))
print("KEY", layer.editorWidgetSetup(names.indexOf("fid")).type())
print("WIDTH", next(column.width for column in table.columns() if column.name == "walk"))
"""


def test_from_the_draw_to_the_corrected_table(qgis, tmp_path):
    folder = make_survey(tmp_path)
    shared = {"TREES": folder / "trees.gpkg", "PLOTS": folder / "plots.csv"}
    done = qgis.run("tapesample", None, **shared, N=15, OUTPUT=folder / "tapes")
    assert done.returncode == 0, done.stdout
    table = gpd.read_file(folder / "tapes" / "tapes.gpkg", layer="tapes")
    rng = np.random.default_rng(1)
    typed = {
        str(row.tree_id): round(float(np.nan_to_num(row.dbh_cm, nan=16.0) - 0.6 + rng.normal(0, 0.3)), 1)
        for row in table.itertuples()
    }
    typed[next(iter(typed))] = None
    said = edit_in_qgis(FILL_IN, folder / "tapes" / "tapes.gpkg", typed)
    assert "ValueMap" in said and "not reached" in said
    assert """HIDDEN ['fid'] "walk\"""" in said and int(re.search(r"WIDTH (\d+)", said)[1]) > 120, said
    assert "KEY Hidden" in said, "in the form and in the table's filters"
    written = ast.literal_eval(re.search("WRITTEN (.*)", said)[1])
    assert written == ["near_id", "plot_id", "second_taped_cm", "state", "tape_note", "taped_cm"]
    taped = folder / "tapes" / "tapes.gpkg"
    done = qgis.run("tapecheck", None, **shared, TAPED=taped, OUTPUT=folder / "check")
    assert done.returncode == 0, done.stdout
    kept = json.loads((folder / "check" / "tape_check.json").read_text())
    assert kept["bias_cm"] == pytest.approx(0.6, abs=0.3) and kept["trees"]["corrected"] < kept["n_frame"]
    done = qgis.run("standtable", None, **shared, TAPED=taped, SPECIES="PITA", OUTPUT=folder / "stand")
    assert done.returncode == 0, done.stdout
    found = json.loads((folder / "stand" / "summary.json").read_text())["taped"]
    assert found["n"] == 15 and found["quantities"]["ba"]["corrected"] < found["quantities"]["ba"]["measured"]
    # The form as a page of paper.
    text = subprocess.run(["pdftotext", folder / "tapes" / "tape_form.pdf", "-"], capture_output=True, text=True).stdout
    assert "Trees that are not on the map" in text


def test_a_trial_is_sealed_and_opened(qgis, tmp_path):
    folder = make_survey(tmp_path)
    given = {"TREES": folder / "trees.gpkg", "PLOTS": folder / "plots.csv", "LIMIT_CM": 1, "OUTPUT": folder / "trial"}
    done = qgis.run("trial", None, **given, N=20)
    assert done.returncode == 0, done.stdout
    table = folder / "trial" / "tapes.gpkg"
    measured = gpd.read_file(folder / "trees.gpkg", layer="trees").set_index("tree_id")["dbh_cm"].fillna(16.0)
    drawn = gpd.read_file(table, layer="tapes")["tree_id"]
    edit_in_qgis(FILL_IN, table, {str(tree): round(float(measured[tree]) - 0.2, 1) for tree in drawn})
    done = qgis.run("trial", None, TAPED=table, OUTPUT=folder / "trial")
    assert done.returncode == 0 and "equivalent" in done.stdout, done.stdout
    assert json.loads((folder / "trial" / "bundle.json").read_text())["trial"]["bias_cm"] == pytest.approx(
        0.2, abs=0.05
    )


def test_two_dates(qgis, tmp_path):
    folder = make_survey(tmp_path)
    later = gpd.read_file(folder / "trees.gpkg", layer="trees")
    later["dbh_cm"] += 1.5
    later.to_file(folder / "later.gpkg", layer="trees")
    values = {"BEFORE": folder / "trees.gpkg", "AFTER": folder / "later.gpkg", "PLOTS": folder / "plots.csv"}
    done = qgis.run("compare", None, **values, YEARS=5, OUTPUT=folder / "change")
    assert done.returncode == 0, done.stdout
    kept = json.loads((folder / "change" / "change.json").read_text())
    assert kept["per_ha"]["growth_cm_a"]["mean"] == pytest.approx(0.3, abs=0.001)
