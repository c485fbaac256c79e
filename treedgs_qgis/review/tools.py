"""Map clicks of the panel: one place, or one tree."""

from __future__ import annotations

from collections.abc import Callable

from qgis.core import QgsCoordinateTransform, QgsPointXY, QgsProject, QgsVectorLayer
from qgis.gui import QgsMapCanvas, QgsMapToolEmitPoint
from qgis.PyQt.QtCore import Qt


class PlaceTool(QgsMapToolEmitPoint):
    """Hands over each clicked place in the CRS of a layer; the right button or Esc ends it."""

    def __init__(
        self,
        canvas: QgsMapCanvas,
        layer: QgsVectorLayer,
        clicked: Callable[[QgsPointXY], None],
        ended: Callable[[], None],
    ) -> None:
        super().__init__(canvas)
        self._layer, self._clicked, self._ended = layer, clicked, ended
        self.setCursor(Qt.CursorShape.CrossCursor)

    def canvasReleaseEvent(self, event) -> None:
        """A click."""
        if event.button() != Qt.MouseButton.LeftButton:
            self._ended()
            return
        self._clicked(in_layer(self.toMapCoordinates(event.pos()), self.canvas(), self._layer))

    def keyReleaseEvent(self, event) -> None:
        """Esc ends it."""
        if event.key() == Qt.Key.Key_Escape:
            self._ended()


def in_layer(point: QgsPointXY, canvas: QgsMapCanvas, layer: QgsVectorLayer) -> QgsPointXY:
    """A place of the map in the CRS of the layer."""
    return _moved(canvas, layer).transform(point)


def on_map(point: QgsPointXY, canvas: QgsMapCanvas, layer: QgsVectorLayer) -> QgsPointXY:
    """A place of the layer in the CRS of the map."""
    return QgsCoordinateTransform(layer.crs(), canvas.mapSettings().destinationCrs(), QgsProject.instance()).transform(
        point
    )


def _moved(canvas: QgsMapCanvas, layer: QgsVectorLayer) -> QgsCoordinateTransform:
    return QgsCoordinateTransform(canvas.mapSettings().destinationCrs(), layer.crs(), QgsProject.instance())
