"""The map tip of a tree: its evidence sheet where it lies, and any text as text."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import unquote

import pytest

from treedgs_geo.inventory.evidence.canvas import Canvas
from treedgs_geo.inventory.evidence.files import sheets_folder, write_sheet
from treedgs_geo.inventory.evidence.parts import dbh_words
from treedgs_geo.inventory.report import _row
from treedgs_geo.inventory.tree_layer import tree_table, write_trees
from treedgs_geo.stems.quality.tree import Tree

RUN = "0123456789abcdef"
TIP = """
from qgis.core import *
layer = QgsVectorLayer(sys.argv[1] + "|layername=trees", "trees", "ogr")
QgsProject.instance().addMapLayer(layer)
for feature in layer.getFeatures():
    context = QgsExpressionContext(QgsExpressionContextUtils.globalProjectLayerScopes(layer))
    context.setFeature(feature)
    print("TIP", QgsExpression.replaceExpressionText(layer.mapTipTemplate(), context).replace("\\n", "~"), "END")
"""


@pytest.mark.parametrize("place", ["work/trees.gpkg", "else where/O'Brien #1 & 50% <b>.gpkg"])
def test_the_tip_shows_the_sheet_and_text_as_text(qgis, tmp_path, place):
    hostile = "<img src=x onerror=alert(1)>\n\"'&amp;"
    about = {"plot_id": hostile, "note": hostile, "dbh_cm": 30.0, "method": "photos", "run_id": RUN}
    trees = [Tree(number, 5e5 + number, 3.45e6, **about).finish() for number in (1, 2)]
    sheets = tmp_path / "work" / "sheets"
    with sheets_folder(sheets, RUN) as made:
        write_sheet(made, trees[0], Canvas(60, 40))
    write_trees(tmp_path / place, trees, "EPSG:32617", sheets=sheets)
    done = qgis.python(TIP, tmp_path / place)
    tips = re.findall(r"TIP (.*?) END", done.stdout)
    assert len(tips) == 2, done.stdout + done.stderr
    shown = [re.findall(r"<img [^>]*>", tip) for tip in tips]
    assert len(shown[0]) == 1 and shown[1] == [], "the first tree has a sheet, the second none"
    address = re.search(r'src="file:///([^"]*)"', shown[0][0])[1]

    assert Path("/" + unquote(address)).resolve() == sheets / RUN / "1.jpg" and not set(address) & set("#? '<>\"")
    for tip in tips:
        assert "&lt;img src=x onerror=alert(1)&gt;" in tip and "&amp;amp;" in tip


def test_one_rounding_everywhere(qgis, tmp_path):
    """Ties, and errors that two roundings in a row would round up in one place only."""
    sizes = [(31.25, 0.25), (30.05, 0.346), (28.149, 0.35), (26.7, 0.449)]
    about = {"method": "photos", "run_id": RUN}
    trees = [Tree(n, 5e5 + n, 3.45e6, dbh_cm=dbh, dbh_se_cm=se, **about).finish() for n, (dbh, se) in enumerate(sizes)]
    write_trees(tmp_path / "trees.gpkg", trees, "EPSG:32617")
    panel = "from treedgs.treedgs_qgis.review import trees, words\n"
    panel += 'for row in trees.TreeLayer(layer).rows(): print("PANEL", words.numbers(row).replace("\\n", "~"), "END")\n'
    done = qgis.python(TIP + panel, tmp_path / "trees.gpkg")
    tips = [re.sub("<.*?>", "", tip) for tip in re.findall(r"TIP (.*?) END", done.stdout)]
    rows = re.findall(r"PANEL (.*?) END", done.stdout)
    page = [[cell[0] for cell in _row(row, "")["cells"]] for _, row in tree_table(trees, "EPSG:32617").iterrows()]
    assert len(tips) == len(rows) == 4, done.stdout + done.stderr
    for tree, tip, row, cells in zip(trees, tips, rows, page, strict=True):
        sheet = dbh_words(tree)
        assert sheet in tip and row.startswith(sheet) and f"DBH {cells[2]} ± {cells[3]} cm" == sheet, (tip, row, cells)


def test_a_layer_of_another_run_shows_no_sheet(qgis, tmp_path):
    """The sheets of the new run lie there; the old layer's trees are not those."""
    old = Tree(1, 5e5, 3.45e6, dbh_cm=30.0, method="photos", run_id="f" * 16).finish()
    new = Tree(1, 5e5, 3.45e6, dbh_cm=20.0, method="photos", run_id=RUN).finish()
    with sheets_folder(tmp_path / "sheets", RUN) as made:
        write_sheet(made, new, Canvas(60, 40))
    write_trees(tmp_path / "old.gpkg", [old], "EPSG:32617", sheets=tmp_path / "sheets")
    done = qgis.python(TIP, tmp_path / "old.gpkg")
    assert "30.0" in done.stdout and "<img" not in done.stdout, done.stdout + done.stderr


def test_a_layer_written_again_keeps_its_sheets(tmp_path):
    """A review rewrites the layer, into the same file or another: the map tips still find the sheets."""
    from treedgs_geo.inventory.tree_layer import sheets_of_layer, write_table
    from treedgs_geo.inventory.tree_reading import read_trees

    tree = Tree(1, 5e5, 3.45e6, dbh_cm=30.0, method="photos", run_id=RUN).finish()
    sheets = tmp_path / "it's <work>" / "sheets"
    path = write_trees(tmp_path / "trees.gpkg", [tree], "EPSG:32617", sheets=sheets)
    assert sheets_of_layer(path) == sheets
    write_table(path, read_trees(path))
    assert sheets_of_layer(path) == sheets
    other = tmp_path / "other" / "trees.gpkg"
    write_table(other, read_trees(path), sheets=sheets_of_layer(path))
    assert sheets_of_layer(other) == sheets
    assert sheets_of_layer(tmp_path / "none.gpkg") is None
    bare = write_trees(tmp_path / "bare.gpkg", [tree], "EPSG:32617")
    assert sheets_of_layer(bare) is None
