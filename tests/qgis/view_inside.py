"""Runs inside QGIS (``--code``) for ``test_view_3d.py``: the entry *3D view of this plot* is triggered, without trees,
twice each with the layer of a photo run and of a cloud, and in a project in degrees; what was seen goes to
``TREEDGS_VIEW/seen.json``, with pictures beside it. Not imported by anything.
"""

import os

from inside import rest, seen, start, wait
from qgis.core import QgsCoordinateReferenceSystem, QgsPointCloudLayer, QgsProject, QgsRectangle, QgsVectorLayer
from qgis.PyQt.QtCore import QObject, QUrl, pyqtSlot
from qgis.PyQt.QtGui import QDesktopServices
from qgis.utils import iface, plugins

folder = os.environ["TREEDGS_VIEW"]
project = QgsProject.instance()
seen |= {"pages": [], "said": [], "views": []}


class Browser(QObject):
    @pyqtSlot(QUrl)
    def opened(self, url):
        seen["pages"].append(url.toLocalFile())


def trigger():
    bar = iface.messageBar()
    bar.clearWidgets()
    next(entry for entry in plugins["treedgs"].entries if entry.objectName() == "TreeDGS-view3d").trigger()
    rest()
    # QGIS's own, of a font that it cannot fetch, is taken away.
    while bar.currentItem() is not None and "font" in bar.currentItem().text():
        bar.popWidget()
    seen["said"].append(getattr(bar.currentItem(), "text", str)())


def add(name, crs):
    project.clear()
    project.addMapLayer(QgsVectorLayer(f"{folder}/{name}.gpkg|layername=trees", name, "ogr"))
    if name == "photos":
        project.addMapLayer(QgsPointCloudLayer(f"{folder}/points/ept.json", "points", "ept"))
    rest()
    project.setCrs(QgsCoordinateReferenceSystem(crs))
    rest()


def picture(canvas, name):
    """Of the view, once it is drawn; how many of its points are as green as stems."""
    wait(lambda: canvas.scene().totalPendingJobsCount() == 0)
    rest(1)
    image = canvas.screen().grabWindow(canvas.winId()).toImage()
    image.save(f"{folder}/{name}.png")
    points = (image.pixelColor(x, y) for x in range(image.width()) for y in range(image.height()))
    return sum(point.green() > 1.5 * max(point.red(), point.blue()) for point in points)


def view(name):
    """What the only view that is open shows."""
    (canvas,) = iface.mapCanvases3D()
    stems = project.mapLayersByName("Stems at true scale")[0]
    wait(lambda: stems in canvas.mapSettings().layers())
    at = canvas.mapSettings().worldToMapCoordinates(canvas.cameraController().lookingAtPoint())
    return {
        "green": picture(canvas, name),
        "inside": QgsRectangle(canvas.mapSettings().extent()).contains(stems.extent()),
        "at": [at.x(), at.y(), at.z()],
        "pitch": canvas.cameraController().pitch(),
        "heights": [canvas.scene().elevationRange().lower(), canvas.scene().elevationRange().upper()],
        "project": [project.crs().authid(), project.elevationProperties().terrainProvider().type()],
    }


def main():
    browser = Browser()
    QDesktopServices.setUrlHandler("file", browser.opened)
    iface.mainWindow().showNormal()
    trigger()
    for name, crs in (("photos", "EPSG:32617"), ("cloud", "EPSG:32617"), ("photos", "EPSG:4326")):
        add(name, crs)
        for _ in range(2):
            trigger()
            if hasattr(iface, "createNewMapCanvas3D"):
                seen["views"].append([name, view(name)])
        seen[name] = [node.name() for node in project.layerTreeRoot().findLayers()]
        if seen["views"]:
            iface.closeMapCanvas3D(f"3D view of this plot: {name}")
            rest()


start(main, f"{folder}/seen.json")
