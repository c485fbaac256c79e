"""Decisions as the panel writes them: the engine's words and rules, columns of their own, every step taken back."""

from __future__ import annotations

import ast
import json
from pathlib import Path

import pytest
from qgis_driver import ROOT
from qgis_helpers import HOSTILE, review_trees_layer

from treedgs_geo.core import plausible, wrong_units
from treedgs_geo.inventory import reviewed as engine
from treedgs_geo.inventory.review.apply import BESIDE_M, FAR_M
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.inventory.written import merge_note, merged_into
from treedgs_geo.stems.quality.reasons import REASONS
from treedgs_geo.stems.quality.tree import Tree

LAYER = """
import json
from qgis.core import *
from treedgs.treedgs_qgis.review import rules, words
from treedgs.treedgs_qgis.review.trees import TreeLayer, tree_layers
layer = QgsVectorLayer(sys.argv[1] + "|layername=trees" * sys.argv[1].endswith(".gpkg"), "trees", "ogr")
assert layer.isValid()
trees = TreeLayer(layer)
def row(number):
    return next(row for row in trees.rows() if row.tree_id == number)
def refused(action, *words):
    try:
        action()
    except rules.Refused as problem:
        print("REFUSED", str(problem).replace("\\n", " "))
    else:
        print("DONE")
"""


def flags(table) -> list[str | None]:
    """Decisions, ``None`` where there is none."""
    return [value if isinstance(value, str) else None for value in table["rev_flag"]]


def said(done) -> list[str]:
    assert done.returncode == 0, done.stdout + done.stderr
    return [line for line in done.stdout.splitlines() if line.startswith(("REFUSED", "DONE", "SAID"))]


def test_words_and_limits_are_the_engine_s():
    """``parameters.json`` is written from the engine; here it is held against it, and so is what the plugin repeats."""
    known = json.loads((ROOT / "treedgs_qgis" / "parameters.json").read_text(encoding="utf-8"))["review"]
    assert known["decisions"] == engine.DECISIONS and list(known["decisions"]) == list(engine.DECISIONS)
    assert {key: tuple(pair) for key, pair in known["reasons"].items()} == REASONS
    assert (known["least_taped_cm"], known["most_taped_cm"]) == (engine.MIN_TAPED_CM, engine.MAX_TAPED_CM)
    assert (known["near"], known["single_cm"]) == (wrong_units.NEAR, list(wrong_units.ONE_CM))
    assert (known["large_cm"], known["gap"]) == (plausible.LARGE_CM, plausible.GAP)
    assert (known["beside_m"], known["far_m"]) == (BESIDE_M, FAR_M)
    words = constants(ROOT / "treedgs_qgis" / "review" / "words.py")
    assert list(words["DECISIONS"]) == list(engine.DECISIONS)
    rules = constants(ROOT / "treedgs_qgis" / "review" / "rules.py")
    assert rules["COLUMNS"] == engine.COLUMNS and rules["NO_TREE"] == engine.NO_TREE


def constants(path: Path) -> dict[str, object]:
    """Names that a module gives plain values to."""
    found = {}
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and isinstance(node.value, (ast.Tuple, ast.Constant, ast.Dict)):
            found[node.targets[0].id] = ast.literal_eval(node.value)
    return found


@pytest.mark.parametrize("ending", ["gpkg", "shp"])
def test_decisions_are_what_the_engine_reads_and_nothing_else_changes(qgis, tmp_path, ending):
    path = review_trees_layer(tmp_path / f"trees.{ending}")
    before = read_trees(path)
    code = (
        LAYER
        + f"""
print("SAID", trees.accept(row(1)), "|", trees.accept(row(3), "a gap"))
trees.reject(row(2), {HOSTILE!r})
print("SAID", trees.tape(row(4), rules.taped_cm("38,5 cm"), "twice"))
trees.merge(row(6), 5, "one stem")
"""
    )
    first, second = said(qgis.python(code, path))
    assert first.startswith("SAID  | Tree 3 has no DBH") and "taped 38.5 cm, measured 24.0 cm" in second
    after = read_trees(path)
    own = [name for name in before if name not in engine.COLUMNS and name != "geometry"]
    assert after[own].astype(str).equals(before[own].astype(str)) and after.geometry.equals(before.geometry)
    assert flags(after) == ["accept", "reject", "accept", "dbh", None, "merge"]
    assert merged_into(after["rev_note"][5]) == 5 and after["rev_note"][5] == merge_note(5, "one stem")
    assert after["rev_by"][0] and after["rev_at"][0].endswith("Z") and len(after["rev_at"][0]) == 20
    assert after["rev_note"][1] == HOSTILE
    counted, review = engine.reviewed(after)
    assert review.counts() == {"accepted": 2, "rejected": 1, "taped": 1, "merged": 1, "stems": 0}
    assert counted.set_index("tree_id")["dbh_cm"][4] == 38.5


def test_every_step_is_taken_back(qgis, tmp_path):
    path = review_trees_layer(tmp_path / "trees.gpkg")
    before = read_trees(path)
    code = (
        LAYER
        + """
trees.accept(row(1), "yes")
trees.reject(row(1))
trees.note(row(2), "look again")
number = trees.add_stem(QgsPointXY(500010.0, 3450005.0), "behind the oak")
print("SAID", number, row(number).decision, row(number).values["qc_reason"], len(trees.rows()))
steps = []
while trees.can_undo:
    steps.append(trees.undo())
    if len(steps) == 3:
        print("SAID", row(1).decision, row(1).note)
print("SAID", steps, len(trees.rows()))
"""
    )
    assert said(qgis.python(code, path)) == ["SAID 7 stem not_found 7", "SAID accept yes", "SAID [None, 2, 1, 1] 6"]
    after = read_trees(path)
    assert after.drop(columns="geometry").astype(str).equals(before.drop(columns="geometry").astype(str))


def test_a_stem_is_the_row_that_the_engine_adds(qgis, tmp_path):
    """The same place, by the panel and by ``treedgs review``."""
    from treedgs_geo.inventory.review.apply import review_trees

    mine, other = review_trees_layer(tmp_path / "a.gpkg"), review_trees_layer(tmp_path / "b.gpkg")
    qgis.python(LAYER + "trees.add_stem(QgsPointXY(500010.0, 3450005.0))", mine)
    (tmp_path / "d.csv").write_text("x,y,decision\n500010,3450005,stem\n")
    review_trees(other, tmp_path / "d.csv")
    one, two = (read_trees(path).iloc[-1].drop(["geometry", "rev_at"]).astype(str) for path in (mine, other))
    assert one.replace("nan", "None").to_dict() == two.replace("nan", "None").to_dict()


def test_what_cannot_be_is_one_sentence_and_writes_nothing(qgis, tmp_path):
    path = review_trees_layer(tmp_path / "trees.gpkg")
    code = (
        LAYER
        + """
trees.reject(row(2))
trees.merge(row(6), 5)
refused(lambda: trees.merge(row(1), 2))
refused(lambda: trees.merge(row(1), 1))
refused(lambda: trees.merge(row(1), 99))
refused(lambda: trees.reject(row(5)))
refused(lambda: trees.add_stem(QgsPointXY(500004.1, 3450000.1)))
refused(lambda: trees.add_stem(QgsPointXY(500004.1, 3451000.1)))
for cm in (240.0, 2.4):
    refused(lambda: trees.tape(row(4), cm))
refused(lambda: trees.tape(row(3), 385.0))
for text in ("", "thirty", "0", "-3", "1e9", "nan"):
    refused(lambda: rules.taped_cm(text))
"""
    )
    lines = said(qgis.python(code, path))
    assert len(lines) == 15 and all(line.startswith("REFUSED") for line in lines), lines
    for line, words in zip(
        lines,
        ["counts nowhere", "same as 1", "same as 99", "Tree 6 is merged into tree 5", "0.14 m", "1,000 m"],
        strict=False,
    ):
        assert words in line
    assert all("expected 0.5 to 500 cm" in line for line in lines[9:]) and all(
        "look like millimetres" in line for line in lines[6:9]
    )
    assert flags(read_trees(path)) == [None, "reject", None, None, None, "merge"]


def test_old_layers_get_the_columns_and_a_file_that_cannot_change_is_said(qgis, tmp_path):
    import geopandas as gpd

    path = review_trees_layer(tmp_path / "old.gpkg")
    table = read_trees(path).drop(columns=list(engine.COLUMNS))
    old = tmp_path / "older.gpkg"
    table.to_file(old, layer="trees", driver="GPKG")
    assert said(qgis.python(LAYER + 'trees.tape(row(1), 30.0)\nprint("SAID", row(1).decision)', old)) == ["SAID dbh"]
    assert gpd.read_file(old)["rev_dbh_cm"][0] == 30.0
    text = tmp_path / "trees.csv"
    text.write_text("tree_id,dbh_cm,qc_flag,x,y\n1,30,ok,500000,3450000\n")
    code = LAYER.replace(
        '"ogr")',
        '"ogr") if False else QgsVectorLayer("file://" + sys.argv[1] + '
        '"?xField=x&yField=y&crs=EPSG:32617", "trees", "delimitedtext")',
    )
    (line,) = said(qgis.python(code + "refused(lambda: trees.accept(row(1)))", text))
    assert "nothing was written" in line


def test_a_layer_that_the_user_edits_gets_the_decision_into_the_edits(qgis, tmp_path):
    path = review_trees_layer(tmp_path / "trees.gpkg")
    code = (
        LAYER
        + """
layer.startEditing()
trees.accept(row(1))
print("SAID", row(1).decision, layer.isModified())
layer.rollBack()
print("SAID", repr(row(1).decision))
"""
    )
    assert said(qgis.python(code, path)) == ["SAID accept True", "SAID ''"]
    assert read_trees(path)["rev_flag"].isna().all()


def test_the_sheet_and_the_run_of_a_layer_are_found(qgis, tmp_path):
    """From the layer's style; relative paths of the run count from where it was started."""
    from treedgs_geo.inventory.evidence.canvas import Canvas
    from treedgs_geo.inventory.evidence.files import sheets_folder, write_sheet

    run = "0123456789abcdef"
    sheets = tmp_path / "it's <work>" / "sheets"
    tree = Tree(1, 5e5, 3.45e6, dbh_cm=30.0, method="photos", run_id=run).finish()
    with sheets_folder(sheets, run) as made:
        write_sheet(made, tree, Canvas(60, 40))
    path = write_trees(tmp_path / "trees.gpkg", [tree], "EPSG:32617", sheets=sheets)
    record = {
        "stages": {},
        "folder": "/somewhere",
        "parameters": {"photos": "flight/images", "geotags": None, "crs": "EPSG:32617", "preset": "fast", "at": None},
    }
    (sheets.parent / "run.json").write_text(
        json.dumps(record | {"parameters": {**record["parameters"], "output": "x"}})
    )
    code = (
        LAYER
        + """
from treedgs.treedgs_qgis.review import measuring
layer.loadDefaultStyle()
work = measuring.workspace_of(trees)
print("SAID", trees.sheet(row(1)))
print("SAID", work)
print("SAID", json.dumps(measuring.parameters_of(work)))
print("SAID", measuring.points_file(sys.argv[2], [(7, QgsPointXY(500000.5, 3450000.25))], layer.crs()))
"""
    )
    lines = [line[5:] for line in said(qgis.python(code, path, tmp_path))]
    assert lines[0] == str(sheets / run / "1.jpg") and lines[1] == str(sheets.parent)
    assert json.loads(lines[2]) == {"PHOTOS": "/somewhere/flight/images", "CRS": "EPSG:32617", "PRESET": "fast"}
    import pyproj

    from treedgs_geo.core.field_stems import read_field_stems

    points = read_field_stems(Path(lines[3]), pyproj.CRS("EPSG:32617"))
    assert points.xy.tolist() == [[500000.5, 3450000.25]] and points.names == ("7",)
