"""Runs inside QGIS (``--code``) for ``test_map_after_run.py``: a cloud is measured and a stand table made as the dialog
does it; what the map and the message bar then show goes to ``TREEDGS_MAP/seen.json``, with pictures beside it.
Not imported by anything.
"""

import os
import sys
from pathlib import Path

from inside import click, rest, seen, start, wait
from processing.core.ProcessingResults import resultsList
from processing.tools.general import createAlgorithmDialog
from qgis.core import (
    QgsApplication,
    QgsExpressionContext,
    QgsExpressionContextUtils,
    QgsProcessingContext,
    QgsProject,
    QgsRectangle,
    QgsSymbol,
)
from qgis.PyQt.QtCore import QObject, QUrl, pyqtSlot
from qgis.PyQt.QtGui import QDesktopServices
from qgis.PyQt.QtWidgets import QPushButton
from qgis.utils import iface, plugins

import processing

seen |= {"opened": [], "opacity": []}
folder = os.environ["TREEDGS_MAP"]


class Browser(QObject):
    @pyqtSlot(QUrl)
    def opened(self, url):
        seen["opened"].append(url.toLocalFile())


def names():
    return [node.name() for node in QgsProject.instance().layerTreeRoot().findLayers()]


def layer(name):
    return QgsProject.instance().mapLayersByName(name)[0]


def buttons():
    """Of the message on top; QGIS's own, of a font that it cannot fetch, is taken away."""
    bar = iface.messageBar()
    while bar.currentItem() is not None and "font" in bar.currentItem().text():
        bar.popWidget()
    return {found.text(): found for found in bar.findChildren(QPushButton) if found.isVisible()}


def plot_in_view():
    extent, plot = iface.mapCanvas().extent(), layer("Plots searched").extent()
    return QgsRectangle(extent).contains(plot) and extent.width() < 4 * plot.width()


def main():
    browser = Browser()
    QDesktopServices.setUrlHandler("file", browser.opened)
    iface.mainWindow().showMaximized()
    given = {"INPUT": f"{folder}/cloud.laz", "PLOTS": f"{folder}/plots.csv", "CRS": "EPSG:32617"}
    processing.runAndLoadResults(
        "treedgs:pointcloudtodbh", {**given, "OUTPUT": f"{folder}/trees.gpkg", "REPORT": f"{folder}/run.html"}
    )
    wait(lambda: "Open the report" in buttons())
    rest()
    seen["trees"] = names()
    trees = layer("Trees")
    seen["columns"] = [column.name for column in trees.attributeTableConfig().columns()][:7]
    categories = trees.renderer().categories()
    opacity = categories[0].symbol().dataDefinedProperties().property(QgsSymbol.PropertyOpacity)
    context = QgsExpressionContext(QgsExpressionContextUtils.globalProjectLayerScopes(trees))
    tree = next(trees.getFeatures())
    for plot in ("A", None):
        tree["plot_id"] = plot
        context.setFeature(tree)
        seen["opacity"].append(opacity.value(context)[0])
    seen["active"] = iface.activeLayer().name()
    given = createAlgorithmDialog("treedgs:standtable").createProcessingParameters()
    seen["filled_in"] = [given["TREES"] == trees.id(), given["OUTPUT"]]
    seen["in_view"] = [plot_in_view()]
    iface.mapCanvas().saveAsImage(f"{folder}/map.png")
    iface.mainWindow().grab().save(f"{folder}/window.png")
    click(buttons()["Open the report"])
    iface.messageBar().clearWidgets()
    for name in ("stand", "stand 2"):
        given = {"TREES": f"{folder}/trees.gpkg", "PLOTS": f"{folder}/plots.csv", "OUTPUT": f"{folder}/{name}"}
        dialog = createAlgorithmDialog("treedgs:standtable", given)
        dialog.show()
        rest()
        click(dialog.runButton())
        wait(dialog.results)
        dialog.close()
        rest()
        seen[name] = [layer for layer in names() if layer not in seen["trees"]]
        iface.mainWindow().grab().save(f"{folder}/{name}.png")
    seen["viewer"] = [[result.name, result.filename] for result in resultsList.getResults()]
    given["TAPED"] = f"{folder}/TAPED.csv"
    made = QgsApplication.processingRegistry().createAlgorithmById("treedgs:standtable")
    seen["refused"] = made.checkParameterValues(given, QgsProcessingContext())[1]
    # The sample flight, once it was measured.
    QgsProject.instance().clear()
    iface.messageBar().clearWidgets()
    sample = sys.modules["treedgs.treedgs_qgis.sample"]
    sample.SOURCE, sample.default_folder = Path(folder, "flight"), lambda: Path(folder)
    plugins["treedgs"].opened = None
    for _ in range(2):
        next(entry for entry in plugins["treedgs"].entries if entry.objectName() == "TreeDGS-tryit").trigger()
        wait(lambda: "Open the report" in buttons())
        rest()
        seen["in_view"].append(plot_in_view())
        iface.mainWindow().grab().save(f"{folder}/sample.png")
        iface.mapCanvas().zoomToFullExtent()
    seen["sample"] = [names(), iface.messageBar().currentItem().text(), plugins["treedgs"].opened]
    iface.messageBar().popWidget()
    click(buttons()["Open the report"])


start(main, f"{folder}/seen.json")
