"""Stems on the map while the rest is still being measured: a layer that leaves when the run ends."""

from __future__ import annotations

from typing import Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsGeometry,
    QgsMarkerSymbol,
    QgsPalLayerSettings,
    QgsPointXY,
    QgsProject,
    QgsSingleSymbolRenderer,
    QgsVectorLayer,
    QgsVectorLayerSimpleLabeling,
)
from qgis.PyQt.QtCore import QObject, pyqtSignal

from .i18n import tr

#: A stem this close to another one is that one measured anew, m.
SAME_M = 0.3
#: About the stems, on a map that shows nothing else, m.
MARGIN_M = 10.0


class StemsSoFar(QObject):
    """The layers of the runs that go on, by the run. Runs work in threads of their own: they send the signals, and the
    windows' thread draws."""

    #: The run, and a stem as the engine reports it.
    found = pyqtSignal(str, dict)
    over = pyqtSignal(str)

    def __init__(self, iface: Any) -> None:
        super().__init__()
        self.iface = iface
        self.layers: dict[str, str] = {}
        self.found.connect(self.add)
        self.over.connect(self.remove)

    def add(self, run: str, stem: dict[str, Any]) -> None:
        """Draw a stem; one that was there already moves."""
        name = self.layers.get(run) or self.layers.setdefault(run, _new_layer(stem["crs"]))
        layer = QgsProject.instance().mapLayer(name)
        if layer is None:
            return
        place = QgsPointXY(stem["x"], stem["y"])
        former = [f.id() for f in layer.getFeatures() if f.geometry().asPoint().distance(place) < SAME_M]
        feature = QgsFeature(layer.fields())
        feature.setAttribute("dbh_cm", stem["dbh_cm"])
        feature.setGeometry(QgsGeometry.fromPointXY(place))
        layer.dataProvider().deleteFeatures(former)
        layer.dataProvider().addFeatures([feature])
        layer.updateExtents()
        layer.triggerRepaint()
        if len(QgsProject.instance().mapLayers()) == 1:
            self.iface.mapCanvas().setExtent(layer.extent().buffered(MARGIN_M))
            self.iface.mapCanvas().refresh()

    def remove(self, run: str) -> None:
        """The run has ended: its layer of trees is there, or none will be."""
        name = self.layers.pop(run, "")
        if QgsProject.instance().mapLayer(name) is not None:
            QgsProject.instance().removeMapLayer(name)


def _new_layer(crs: str) -> str:
    """The id of a new layer in the project."""
    layer = QgsVectorLayer("Point?field=dbh_cm:double(6,1)", tr("Stems so far"), "memory")
    layer.setCrs(QgsCoordinateReferenceSystem.fromWkt(crs))
    # QGIS would ask whether to lose it.
    layer.setCustomProperty("skipMemoryLayersCheck", 1)
    layer.setRenderer(QgsSingleSymbolRenderer(QgsMarkerSymbol.createSimple({"color": "#1b7837", "size": "3"})))
    label = QgsPalLayerSettings()
    label.fieldName, label.isExpression = "format_number(dbh_cm, 1)", True
    layer.setLabeling(QgsVectorLayerSimpleLabeling(label))
    layer.setLabelsEnabled(True)
    QgsProject.instance().addMapLayer(layer)
    return layer.id()
