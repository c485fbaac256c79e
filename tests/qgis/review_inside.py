"""Runs inside QGIS (``--code``) for ``test_review_panel.py``: a person at the panel, with mouse and keys.

The job is JSON in ``TREEDGS_REVIEW``: ``trees``, ``report``. What was seen goes to ``report``.
Not imported by anything.
"""

import json
import os

import qgis.utils
from inside import click as press
from inside import rest, seen, start
from qgis.core import QgsCoordinateReferenceSystem, QgsPointXY, QgsProject, QgsVectorLayer
from qgis.PyQt.QtCore import QPoint, Qt
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import QApplication, QDockWidget
from qgis.utils import iface

JOB = json.loads(os.environ["TREEDGS_REVIEW"])
plugin = qgis.utils.plugins["treedgs"]
FIND = Qt.MatchFlag.MatchRecursive | Qt.MatchFlag.MatchExactly
window, canvas = iface.mainWindow(), iface.mapCanvas()


def state():
    form = plugin.panel.form
    row = plugin.panel.row
    return {
        "tree": None if row is None else row.tree_id,
        "list": [entry.tree_id for entry in plugin.panel._list],
        "headline": form.headline.text(),
        "reasons": form.reasons.text(),
        "decision": form.decision.text(),
        "message": form.message.text(),
        "progress": form.progress.text(),
        "place": form.place.text(),
    }


def key(letter):
    plugin.panel.form.setFocus()
    QTest.keyClick(plugin.panel.form, getattr(Qt.Key, f"Key_{letter}"))
    rest()


def click(x, y):
    """A click on the map at a place in the layer's CRS."""
    from treedgs.treedgs_qgis.review.tools import on_map

    place = canvas.getCoordinateTransform().transform(on_map(QgsPointXY(x, y), canvas, plugin.panel.trees.layer))
    at = QPoint(round(place.x()), round(place.y()))
    press(canvas.viewport(), at)


def values(number):
    row = next(row for row in plugin.panel.trees.rows() if row.tree_id == number)
    return {name: row.values[name] for name in ("rev_flag", "rev_dbh_cm", "rev_note")}


def walking():
    window.showNormal()
    window.setGeometry(0, 0, 1200, 850)
    # Without a window manager nothing makes it the active one, which keys need.
    QApplication.setActiveWindow(window)
    layer = QgsVectorLayer(JOB["trees"] + "|layername=trees", "<b>Trees</b>", "ogr")
    layer.loadDefaultStyle()
    # As a double click in the toolbox does it.
    toolbox = window.findChild(QDockWidget, "ProcessingToolbox")
    toolbox.show()
    toolbox.searchBox.setText("review trees")
    rest()
    view = toolbox.algorithmTree
    found = view.model().match(view.model().index(0, 0), Qt.ItemDataRole.DisplayRole, "Review trees", 1, FIND)
    view.setCurrentIndex(found[0])
    toolbox.executeAlgorithm()
    rest()
    seen["height"] = [plugin.panel.isVisible(), plugin.panel.height() > 0.8 * toolbox.parent().centralWidget().height()]
    toolbox.hide()
    form = plugin.panel.form
    rest()
    seen["button"] = plugin.action.isChecked()
    seen["empty"] = state()
    QgsProject.instance().addMapLayer(layer)
    # The map in another CRS than the layer.
    QgsProject.instance().setCrs(QgsCoordinateReferenceSystem("EPSG:3857"))
    rest()
    seen["first"] = state()
    seen["title"] = form.layer.currentText()
    seen["formats"] = sorted(
        {
            int(label.textFormat())
            for label in (form.headline, form.numbers, form.reasons, form.decision, form.message, form.sheet)
        }
    )
    seen["plain"] = int(Qt.TextFormat.PlainText)
    form.zoom.click()
    rest(0.6)
    seen["scale"] = canvas.scale()
    key("N")
    seen["next"] = state()
    key("P")
    key("P")
    seen["round"] = state()
    return layer


def deciding():
    panel, form = plugin.panel, plugin.panel.form
    panel.show_tree(2)
    key("A")
    seen["accepted"] = [values(2), state()]
    key("X")
    seen["rejected"] = [values(3), state()]
    key("U")
    seen["undone"] = [values(3), state()]
    # Typing letters into the note presses no button.
    form.note.setFocus()
    QTest.keyClicks(form.note, "<i>Nana & X</i>")
    rest()
    seen["typed"] = [form.note.text(), values(3), state()["tree"]]
    key("D")
    seen["focus"] = QApplication.focusWidget() is form.taped
    QTest.keyClicks(form.taped, "31,5")
    QTest.keyClick(form.taped, Qt.Key.Key_Return)
    rest()
    seen["taped"] = [values(3), state()]
    form.taped.setText("2000")
    form.tape.click()
    rest()
    seen["too thick"] = [values(4), state()]
    measured = panel.row.values["dbh_cm"]
    form.taped.setText(f"{1.6 * measured:.1f}")
    form.tape.click()
    rest()
    seen["asked"] = [values(4), state(), form.taped.text() != ""]
    form.tape.click()
    rest()
    seen["sure"] = [values(4), state()]
    panel.show_tree(4)
    key("A")
    seen["replaced"] = [values(4), state()["message"]]
    key("U")
    key("U")
    rest()


def clicking():
    panel, form = plugin.panel, plugin.panel.form
    # The same tree as the one clicked on the map.
    panel.show_tree(6)
    form.zoom.click()
    rest(0.6)
    form.pick.click()
    rows = {row.tree_id: row for row in panel.trees.rows()}
    click(rows[6].x + 1.5, rows[6].y + 1.5)
    seen["missed"] = [values(6), state()["message"]]
    click(rows[5].x, rows[5].y)
    seen["merged"] = [values(6), state(), form.pick.isChecked()]
    # Here stands a stem.
    key("S")
    seen["tool"] = canvas.mapTool() is panel._tool
    click(rows[5].x + 1.0, rows[5].y + 1.2)
    seen["stem"] = [values(7), state(), form.stem.isChecked()]
    row = next(row for row in panel.trees.rows() if row.tree_id == 7)
    seen["stem at"] = [row.x - rows[5].x, row.y - rows[5].y]
    key("S")
    click(rows[5].x + 0.1, rows[5].y)
    seen["beside"] = [len(panel.trees.rows()), state()["message"]]


def listing(layer):
    """The list follows the map; a click in it leads the panel."""
    next(entry for entry in plugin.entries if entry.objectName() == "TreeDGS-stems").trigger()
    rest()
    rows = {row.tree_id: row for row in plugin.panel.trees.rows()}
    canvas.setExtent(canvas.mapSettings().layerExtentToOutputExtent(layer, layer.extent().buffered(5)))
    rest(0.6)
    seen["list all"] = sorted(plugin.stems.numbers())
    plugin.panel.show_tree(2)
    plugin.panel.zoom()
    rest(0.6)
    seen["list near"] = plugin.stems.numbers()
    plugin.stems.grab().save(JOB["report"] + ".list.png")
    table = plugin.stems.table
    index = table.model().index(0, 0)
    press(table.viewport(), table.visualRect(index).center())
    seen["list click"] = [plugin.panel.row.tree_id, len(rows)]


def leaving(layer):
    panel, form = plugin.panel, plugin.panel.form
    for which in ("open", "check", "reject", "ok", "decided", "all"):
        form.which.setCurrentIndex(form.which.findData(which))
        form.undecided.setChecked(False)
        rest()
        seen[f"list {which}"] = state()["list"]
    form.grab().save(JOB["report"] + ".png")
    # A layer without a workspace beside it cannot measure.
    panel._measure([(7, QgsPointXY(500000.0, 3450000.0))])
    seen["no workspace"] = state()["message"]
    QgsProject.instance().removeMapLayer(layer.id())
    rest()
    seen["gone"] = state()
    panel.close()
    rest()
    seen["closed"] = plugin.action.isChecked()
    plugin.action.setChecked(True)
    plugin.unload()
    rest()
    seen["unloaded"] = [plugin.panel is None and plugin.stems is None, plugin.action is None]


def main():
    layer = walking()
    deciding()
    clicking()
    listing(layer)
    leaving(layer)


start(main, JOB["report"])
