"""**3D view of this plot**: QGIS' own 3D map view on the stems of a plot, from the side; before 3.36, which cannot be
asked for one, the page of the run that shows the same."""

from __future__ import annotations

import os
from typing import Any

import qgis.gui
from qgis.core import QgsMapLayer, QgsPointCloudLayer, QgsProject, QgsRasterLayer, QgsVector3D, QgsVectorLayer
from qgis.PyQt.QtCore import QSignalBlocker, QUrl
from qgis.PyQt.QtGui import QDesktopServices

from .compat import LOG_WARNING, first_attr
from .i18n import tr
from .review.measuring import workspace_of
from .review.trees import TreeLayer, tree_layers

try:  # first: QGIS crashes when it hands out a view whose class Python does not know yet
    import qgis._3d
except ImportError:  # a QGIS without 3D
    HAS_VIEWS = False
else:
    HAS_VIEWS = hasattr(qgis.gui.QgisInterface, "createNewMapCanvas3D")

#: Height where none is known, m, as in the layer's style; how far away one looks from, in sizes of the plot; how many
#: degrees from straight above.
LOW_M, AWAY, PITCH = 5.0, 2.0, 75.0


def show(iface: Any, *_: Any) -> None:
    """The menu entry: the plot of the active layer, or of the first layer of trees."""
    active = iface.activeLayer()
    chosen = active.source().partition("|")[0] if active is not None else ""
    layer = min(tree_layers(), key=lambda one: TreeLayer(one).path() != chosen, default=None)
    if layer is None:
        iface.messageBar().pushMessage("TreeDGS", tr("No tree layer in the project: add trees.gpkg."), LOG_WARNING)
        return
    workspace = workspace_of(TreeLayer(layer))
    if HAS_VIEWS and open_view(iface, layer, workspace):
        return
    page = os.path.join(workspace, "report_3d.html")
    if os.path.isfile(page):
        QDesktopServices.openUrl(QUrl.fromLocalFile(page))
        return
    text = tr(
        "{layer}: this QGIS opens no 3D view by itself; take View ▸ New 3D Map View, and there give Configure ▸ "
        "Terrain the terrain model."
    )
    iface.messageBar().pushMessage("TreeDGS", text.format(layer=layer.name()), LOG_WARNING)


def open_view(iface: Any, layer: QgsVectorLayer, workspace: str) -> bool:
    """QGIS' view of the stems of a layer of trees, on the terrain of its run, else the project's; whether it opened."""
    project = QgsProject.instance()
    # Terrain first: what is added is put at the bottom, and the stems above it.
    ground = shown(QgsRasterLayer(os.path.join(workspace, "dtm.tif"), tr("Ground")), -1) if workspace else None
    stems = shown(QgsVectorLayer(f"{TreeLayer(layer).path()}|layername=circles", tr("Stems at true scale"), "ogr"), 0)
    if stems is None:
        return False
    for points in project.mapLayers().values():
        if isinstance(points, QgsPointCloudLayer) and points.renderer3D() is None:  # else drawn on the terrain
            points.setRenderer3D(qgis._3d.QgsPointCloudLayer3DRenderer())
            points.convertRenderer3DFromRenderer2D()
    name, crs = f"{tr('3D view of this plot')}: {layer.name()}", project.crs()
    # The view of an earlier click makes room: QGIS would give this one another name.
    iface.closeMapCanvas3D(name)
    project.viewsManager().remove3DView(name)
    # A new view takes the project's terrain and CRS over; QGIS clamps stems to a terrain only in their own CRS.
    heights = project.elevationProperties()
    before = heights.terrainProvider().clone()
    with QSignalBlocker(project):
        project.setCrs(stems.crs())
        if ground is not None:
            terrain = first_attr("QgsRasterDemTerrainProvider")()
            terrain.setLayer(ground)
            heights.setTerrainProvider(terrain)
        flat = heights.terrainProvider().type() == "flat"
        canvas = iface.createNewMapCanvas3D(name)
        heights.setTerrainProvider(before)
        project.setCrs(crs)
    if canvas is None:
        return False
    tall = stems.maximumValue(stems.fields().indexOf("height_m")) or LOW_M
    foot = 0.0 if flat else layer.minimumValue(layer.fields().indexOf("z_ground")) or 0.0
    extent = stems.extent().buffered(tall / 4)
    canvas.mapSettings().setExtent(extent)
    middle = QgsVector3D(extent.center().x(), extent.center().y(), foot + tall / 2)
    size = max(extent.width(), extent.height(), tall)
    at = canvas.mapSettings().mapToWorldCoordinates(middle)
    canvas.cameraController().setLookingAtPoint(at, AWAY * size, PITCH, 0.0)
    return True


def shown(layer: Any, place: int) -> Any:
    """The project's layer of the same source, else this one at a place of the map; ticked. ``None``: there is none."""

    def source(one: QgsMapLayer) -> tuple[str, str]:
        file, _, table = one.source().partition("|")
        return os.path.realpath(file), table

    project = QgsProject.instance()
    found = next((one for one in project.mapLayers().values() if source(one) == source(layer)), None)
    if found is None:
        if not layer.isValid():
            return None
        found = project.addMapLayer(layer, False)
        project.layerTreeRoot().insertLayer(place, found)
    node = project.layerTreeRoot().findLayer(found)
    if node is not None:
        node.setItemVisibilityCheckedParentRecursive(True)
    return found
