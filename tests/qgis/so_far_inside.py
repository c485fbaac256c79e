"""Runs inside QGIS (``--code``) for ``test_stems_so_far.py``: photos are measured from the dialog; what the map shows
meanwhile and in the end goes to ``TREEDGS_MAP/seen.json``, with pictures beside it. Not imported by anything.
"""

import json
import os

import qgis.utils
from inside import click, rest, seen, start, wait
from processing.tools.general import createAlgorithmDialog
from qgis.core import QgsPointXY, QgsProject
from qgis.PyQt.QtCore import QPoint
from qgis.PyQt.QtWidgets import QDialogButtonBox, QPushButton
from qgis.utils import iface

seen["stems"] = []
folder = os.environ["TREEDGS_MAP"]


def names():
    return [node.name() for node in QgsProject.instance().layerTreeRoot().findLayers()]


def look(*_):
    """At the map, after each stem."""
    layer = QgsProject.instance().mapLayersByName("Stems so far")[0]
    seen["meanwhile"], seen["crs"] = names(), layer.crs().authid()
    seen["stems"] = [[f.geometry().asPoint().x(), f.geometry().asPoint().y(), f["dbh_cm"]] for f in layer.getFeatures()]


def on_top():
    item = iface.messageBar().currentItem()
    return [button.text() for button in item.findChildren(QPushButton)] if item else []


def main():
    iface.mainWindow().showMaximized()
    qgis.utils.plugins["treedgs"].offer.so_far.found.connect(look)
    dialog = createAlgorithmDialog("treedgs:photostodbh", json.loads(os.environ["TREEDGS_VALUES"]))
    dialog.show()
    buttons = dialog.findChild(QDialogButtonBox).buttons()
    click(next(b for b in buttons if b.text().replace("&", "") == "Run"))
    wait(lambda: len(seen["stems"]) >= 2)
    dialog.hide()
    rest(1.0)
    iface.mainWindow().grab().save(f"{folder}/meanwhile.png")
    wait(lambda: "Trees" in names() and on_top() == ["Open the report"])
    rest()
    seen["after"], seen["on_top"] = names(), on_top()
    seen["tapes"] = createAlgorithmDialog("treedgs:tapesample").createProcessingParameters()["PLOTS"]
    iface.mainWindow().grab().save(f"{folder}/after.png")
    look_again()


def given():
    """Stems of the workspace that were measured at given places."""
    with open(f"{folder}/work/given.json", encoding="utf-8") as file:
        return len(json.load(file)["stems"])


def look_again():
    """One measured tree at the panel: its foot moved by a click on the map, then taken back by its button."""
    plugin = qgis.utils.plugins["treedgs"]
    plugin.action.setChecked(True)
    panel = plugin.panel
    panel.form.which.setCurrentIndex(panel.form.which.findData("all"))
    wait(lambda: panel.row is not None)
    panel.show_any(next(row.tree_id for row in panel.trees.rows() if row.flag == "ok"))
    panel.zoom()
    rest()
    row = panel.row
    seen["before"] = [row.tree_id, row.values["dbh_cm"], row.x]
    click(panel.form.again)
    place = iface.mapCanvas().getCoordinateTransform().transform(QgsPointXY(row.x + 0.04, row.y))
    at = QPoint(round(place.x()), round(place.y()))
    click(iface.mapCanvas().viewport(), at)
    seen["said"] = panel.form.message.text()
    wait(lambda: panel._measuring is None)
    rest()
    seen["given"] = [given()]
    seen["again"] = [panel.row.tree_id, panel.row.values["dbh_cm"], panel.row.x, panel.form.message.text()]
    iface.mainWindow().grab().save(f"{folder}/again.png")
    click(panel.form.former)
    wait(lambda: panel._measuring is None)
    rest()
    seen["given"].append(given())
    seen["former"] = [panel.row.tree_id, panel.row.values["dbh_cm"], panel.row.x]
    seen["can_go_back"] = panel.form.former.isEnabled()


start(main, f"{folder}/seen.json")
