"""Runs inside QGIS (``--code``): draws the pictures that ``tools/screenshot.py`` asks for. Buttons are clicked, and
after each step Python's garbage is collected: what nobody holds would be gone. Not imported by anything.
"""

import gc
import json
import os
import sys
import traceback

from qgis.core import (
    QgsApplication,
    QgsExpressionContextUtils,
    QgsPointXY,
    QgsProject,
    QgsRasterLayer,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QPoint, Qt, QTimer
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import QApplication, QDialog, QDockWidget, QLineEdit, QPushButton, QTreeView
from qgis.utils import iface, plugins

JOB = json.loads(os.environ["TREEDGS_SHOTS"])
PICTURES = JOB["pictures"]
window = iface.mainWindow()
provider = QgsApplication.processingRegistry().providerById("treedgs")
steps = []


def picture(name, widget):
    widget.grab().save(os.path.join(PICTURES, f"{name}.png"))


def step(wait_s):
    """The function runs this long after the one before it."""

    def keep(function):
        steps.append((wait_s, function))
        return function

    return keep


def go():
    if not steps:
        finish(0)
        return
    wait_s, function = steps.pop(0)

    def call():
        try:
            function()
            gc.collect()
        except Exception:
            traceback.print_exc()
            finish(1)
        go()

    QTimer.singleShot(int(1000 * wait_s), call)


def finish(code):
    sys.stdout.flush()
    QgsProject.instance().clear()
    os._exit(code)


def docks(*shown):
    for dock in window.findChildren(QDockWidget):
        dock.setVisible(dock.objectName() in shown)
        if dock.objectName() == "Layers":
            dock.setMinimumWidth(250)
        if dock.objectName() == "ProcessingToolbox" and "ProcessingToolbox" in shown:
            dock.setMinimumWidth(390)
            for line in dock.findChildren(QLineEdit):
                line.setText("treedgs")
            for view in dock.findChildren(QTreeView):
                view.expandAll()
                view.scrollToTop()


def windows(algorithm, name):
    """The dialog of an algorithm as Return in the toolbox opens it."""
    dock = window.findChild(QDockWidget, "ProcessingToolbox")
    dock.searchBox.setText(algorithm.displayName())
    QTest.qWait(300)
    view = dock.algorithmTree
    index = view.indexAt(QPoint(0, 0))
    while index.isValid() and (view.selectedAlgorithm() is None or view.selectedAlgorithm().id() != algorithm.id()):
        index = view.indexBelow(index)
        view.setCurrentIndex(index)

    def photograph():
        dialogs = [widget for widget in QApplication.topLevelWidgets() if isinstance(widget, QDialog)]
        opened = next((dialog for dialog in dialogs if dialog.isVisible()), None)
        if opened is None:
            QTimer.singleShot(500, photograph)
            return
        QTest.qWait(700)
        picture(name, opened)
        opened.close()

    QTimer.singleShot(500, photograph)
    QTest.keyClick(dock.searchBox, Qt.Key.Key_Return)


def button(dialog, text):
    """Click a button of a dialog."""
    found = (each for each in dialog.findChildren(QPushButton) if each.text().replace("&", "") == text)
    QTest.mouseClick(next(found), Qt.MouseButton.LeftButton)


def follow(algorithm, layer):
    """What a person does after the trees: an entry of the menu, filled in by the project, Run; the map afterwards."""
    next(entry for entry in plugins["treedgs"].entries if entry.objectName() == f"TreeDGS-{algorithm}").trigger()
    dialog = plugins["treedgs"].opened
    QTest.qWait(700)
    picture(f"window-{algorithm}-filled-in", dialog)
    button(dialog, "Run")
    for _ in range(600):
        QTest.qWait(200)
        gc.collect()
        if QgsProject.instance().mapLayersByName(layer):
            break
    QTest.qWait(3000)
    picture(f"window-{algorithm}-log", dialog)
    button(dialog, "Close")
    QTest.qWait(1000)
    picture(f"window-{algorithm}-map", window)


def add(source, name, kind="ogr", default=True):
    layer = QgsRasterLayer(source, name) if kind == "gdal" else QgsVectorLayer(source, name, kind)
    assert layer.isValid(), source
    layer.loadDefaultStyle()
    QgsProject.instance().addMapLayer(layer)
    return layer


def expand(name):
    """The legend of one layer. The view of a layer just added does not know what its node says: first the other way."""
    for node in QgsProject.instance().layerTreeRoot().findLayers():
        node.setExpanded(node.name() != name)
        node.setExpanded(node.name() == name)


def show_all():
    for node in QgsProject.instance().layerTreeRoot().findLayers():
        node.setItemVisibilityChecked(True)


def zoom(layer, factor=1.2):
    extent = layer.extent()
    extent.scale(factor)
    iface.mapCanvas().setExtent(extent)
    iface.mapCanvas().refreshAllLayers()


@step(4)
def layers():
    window.showNormal()
    window.setGeometry(0, 0, 1280, 800)
    QgsProject.instance().clear()
    add(JOB["dtm"], "Terrain model", "gdal")
    add(f"{JOB['stand']}|layername=stand_plots", "Plots")
    stations = add(f"{JOB['stations']}|layername=stations", "Camera stations")
    trees = add(f"{JOB['trees']}|layername=trees", "Trees")
    QgsProject.instance().setCrs(trees.crs())
    QgsProject.instance().layerTreeRoot().findLayer(stations.id()).setItemVisibilityChecked(False)
    expand("Trees")
    docks("Layers", "ProcessingToolbox")


@step(3)
def near():
    zoom(QgsProject.instance().mapLayersByName("Trees")[0], 1.3)


@step(5)
def toolbox():
    picture("toolbox", window)
    for number, algorithm in enumerate(provider.algorithms()):
        if algorithm.parameterDefinitions():
            windows(algorithm, f"window-{number:02d}-{algorithm.name()}")
    docks("Layers")
    expand("Trees")
    zoom(QgsProject.instance().mapLayersByName("Trees")[0], 1.12)


@step(5)
def map_of_the_plot():
    picture("map", window)
    show_all()
    expand("Camera stations")
    # From this far the diameters only cover each other.
    QgsProject.instance().mapLayersByName("Trees")[0].setLabelsEnabled(False)
    zoom(QgsProject.instance().mapLayersByName("Camera stations")[0], 1.1)


@step(6)
def map_of_the_flight():
    picture("flight", window)
    QgsProject.instance().mapLayersByName("Trees")[0].setLabelsEnabled(True)
    show_all()
    expand("Trees")
    trees = QgsProject.instance().mapLayersByName("Trees")[0]
    wanted = [feature for feature in trees.getFeatures() if feature["qc_flag"] != "ok"] or list(trees.getFeatures())
    point = wanted[0].geometry().asPoint()
    # The tip stands right of the tree.
    iface.mapCanvas().zoomScale(25)
    iface.mapCanvas().setCenter(QgsPointXY(point.x() + 0.3 * iface.mapCanvas().extent().width(), point.y()))
    QgsProject.instance().layerTreeRoot().findLayer(
        QgsProject.instance().mapLayersByName("Camera stations")[0].id()
    ).setItemVisibilityChecked(False)
    iface.setActiveLayer(trees)
    layers.point = point


@step(5)
def map_tip():
    from qgis.core import QgsExpression, QgsExpressionContext
    from qgis.PyQt.QtWidgets import QLabel

    trees = QgsProject.instance().mapLayersByName("Trees")[0]
    context = QgsExpressionContext(QgsExpressionContextUtils.globalProjectLayerScopes(trees))
    canvas = iface.mapCanvas()
    label = QLabel(canvas)
    nearest = min(trees.getFeatures(), key=lambda f: f.geometry().asPoint().distance(layers.point))
    context.setFeature(nearest)
    label.setText(QgsExpression.replaceExpressionText(trees.mapTipTemplate(), context))
    label.setWordWrap(True)
    label.setStyleSheet("background:#ffffe8;border:1px solid #555;padding:5px;font-size:12px")
    label.adjustSize()
    place = canvas.getCoordinateTransform().transform(layers.point)
    # As QGIS does it: whole, above the place where there is no room below.
    label.move(int(place.x()) + 14, min(int(place.y()) + 14, canvas.height() - label.height() - 4))
    label.show()
    layers.label = label


@step(1)
def map_tip_picture():
    picture("maptip", window)
    layers.label.deleteLater()
    docks()
    plugin = plugins["treedgs"]
    plugin.action.setChecked(True)
    plugin.panel.setMinimumWidth(470)
    plugin.panel.form.which.setCurrentIndex(plugin.panel.form.which.findData("all"))
    plugin.show_stems()
    plugin.stems.table.setMinimumHeight(190)


@step(2)
def review_near():
    zoom(QgsProject.instance().mapLayersByName("Trees")[0], 0.7)


@step(4)
def review_picture():
    picture("review", window)
    plugins["treedgs"].action.setChecked(False)
    plugins["treedgs"].stems.hide()
    docks("Layers")
    iface.setActiveLayer(QgsProject.instance().mapLayersByName("Trees")[0])
    follow("tapesample", "Trees to tape")
    follow("standtable", "Stand by plot")
    import processing

    values = {
        "PHOTOS": JOB["photos"],
        "GEOTAGS": JOB["geotags"],
        "CRS": "EPSG:6344",
        "PLOTS": JOB["plots"],
        "WORKSPACE": JOB["fresh"],
        "OUTPUT": os.path.join(JOB["fresh"], "trees.gpkg"),
        "DRY_RUN": False,
    }
    dialog = processing.createAlgorithmDialog("treedgs:photostodbh", values)
    dialog.show()
    dialog.setGeometry(40, 20, 1080, 740)
    layers.dialog = dialog


@step(3)
def dialog():
    picture("dialog", layers.dialog)
    button(layers.dialog, "Run")


@step(JOB["run_s"])
def running():
    picture("log", layers.dialog)
    button(layers.dialog, "Cancel")


@step(4)
def cancelled():
    picture("cancelled", layers.dialog)
    layers.dialog.close()
    QgsProject.instance().clear()
    iface.messageBar().clearWidgets()
    for table, name in (
        ("plots", "Plots"),
        ("suggested", "Suggested pairs"),
        ("measured_trees", "Measured trees"),
        ("field_trees", "Field trees"),
        ("pairs", "Pairs"),
    ):
        layer = add(f"{JOB['pairs']}|layername={table}", name)
    QgsProject.instance().setCrs(layer.crs())
    iface.setActiveLayer(layer)
    for node in QgsProject.instance().layerTreeRoot().findLayers():
        node.setExpanded(node.name() in ("Pairs", "Field trees"))
    first = max(layer.getFeatures(), key=lambda feature: feature["dist_m"] or 0)
    middle = first.geometry().centroid().asPoint()
    # The form covers the right: the pair stands left of the middle.
    iface.mapCanvas().zoomScale(10)
    middle.setX(middle.x() + 0.28 * iface.mapCanvas().extent().width())
    iface.mapCanvas().setCenter(middle)
    layer.startEditing()
    form = iface.getFeatureForm(layer, first)
    form.setParent(window, Qt.WindowType.Tool)
    form.setGeometry(720, 150, 540, 600)
    form.show()
    layers.form = form


@step(6)
def pairs():
    whole = window.grab()
    from qgis.PyQt.QtGui import QPainter

    painter = QPainter(whole)
    drawn = layers.form.grab()
    painter.drawPixmap(whole.width() - drawn.width() - 14, 140, drawn)
    painter.end()
    whole.save(os.path.join(PICTURES, "pairs.png"))
    QgsProject.instance().mapLayersByName("Pairs")[0].rollBack()


@step(0.5)
def report():
    from qgis.PyQt.QtCore import QUrl

    try:
        from qgis.PyQt.QtWebKitWidgets import QWebView as Page
    except ImportError:  # Qt 6
        from qgis.PyQt.QtWebEngineWidgets import QWebEngineView as Page

    view = Page()
    view.resize(1000, 1180)
    view.load(QUrl.fromLocalFile(JOB["report"]))
    view.show()
    layers.view = view


@step(3)
def report_picture():
    picture("report", layers.view)


go()
