"""Runs inside QGIS (``--code``) for ``test_stems_so_far.py``: photos are measured from the dialog; what the map shows
meanwhile and in the end goes to ``TREEDGS_MAP/seen.json``, with pictures beside it. Not imported by anything.
"""

import gc
import json
import os
import time
import traceback

from processing.tools.general import createAlgorithmDialog
from qgis.core import QgsProject
from qgis.PyQt.QtCore import Qt, QTimer
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import QApplication, QDialogButtonBox, QPushButton
from qgis.utils import iface

seen = {}
folder = os.environ["TREEDGS_MAP"]


def names():
    return [node.name() for node in QgsProject.instance().layerTreeRoot().findLayers()]


def wait(condition, seconds=300.0):
    until = time.monotonic() + seconds
    while time.monotonic() < until and not condition():
        QApplication.processEvents()
        QTest.qWait(50)
        gc.collect()
    return bool(condition())


def stems():
    found = QgsProject.instance().mapLayersByName("Stems so far")
    return found[0].featureCount() if found else 0


def main():
    iface.mainWindow().showMaximized()
    dialog = createAlgorithmDialog("treedgs:photostodbh", json.loads(os.environ["TREEDGS_VALUES"]))
    dialog.show()
    buttons = dialog.findChild(QDialogButtonBox).buttons()
    QTest.mouseClick(next(b for b in buttons if b.text().replace("&", "") == "Run"), Qt.MouseButton.LeftButton)
    seen["began"] = wait(lambda: stems() >= 2)
    seen["meanwhile"] = names()
    layer = QgsProject.instance().mapLayersByName("Stems so far")[0]
    seen["crs"] = layer.crs().authid()
    seen["stems"] = [[f.geometry().asPoint().x(), f.geometry().asPoint().y(), f["dbh_cm"]] for f in layer.getFeatures()]
    dialog.hide()
    wait(lambda: False, 1.0)
    iface.mainWindow().grab().save(f"{folder}/meanwhile.png")
    seen["ended"] = wait(lambda: "Trees" in names())
    wait(lambda: False, 3.0)
    seen["after"] = names()
    item = iface.messageBar().currentItem()
    seen["on_top"] = [button.text() for button in item.findChildren(QPushButton)] if item else []
    iface.mainWindow().grab().save(f"{folder}/after.png")


def run():
    try:
        main()
    except Exception:
        seen["error"] = traceback.format_exc()
    with open(f"{folder}/seen.json", "w", encoding="utf-8") as out:
        json.dump(seen, out)
    QgsProject.instance().clear()
    os._exit(0)


QTimer.singleShot(3000, run)
