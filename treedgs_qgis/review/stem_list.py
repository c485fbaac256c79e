"""The dock **Stem list**: the stems that the map shows, by the columns of the layer; a click leads to the tree."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from qgis.core import QgsProject, QgsVectorLayerCache
from qgis.gui import QgsAttributeTableFilterModel, QgsAttributeTableModel, QgsAttributeTableView
from qgis.PyQt.QtWidgets import QDockWidget

from .. import compat
from ..i18n import tr
from .tools import on_map
from .trees import is_tree_layer, tree_layers

#: Rows that are kept in memory.
CACHED = 100_000


class StemList(QDockWidget):
    """See the module. iface: of QGIS. chosen: called with the number of a tree that was clicked."""

    def __init__(self, iface: Any, chosen: Callable[[int], Any]) -> None:
        super().__init__(tr("Stem list"), iface.mainWindow())
        self.setObjectName("TreeDGSStemList")
        self.iface, self._chosen = iface, chosen
        self.layer: Any = None
        # The views of QGIS own none of these.
        self._kept: tuple[Any, ...] = ()
        self.table = QgsAttributeTableView(self)
        self.setWidget(self.table)
        self.table.clicked.connect(self._clicked)
        self.table.doubleClicked.connect(self._zoom)
        iface.currentLayerChanged.connect(self._follow)
        QgsProject.instance().layersAdded.connect(self._follow)
        QgsProject.instance().layersRemoved.connect(self._follow)
        self._follow()

    def close_for_good(self) -> None:
        """The plugin is unloaded."""
        self.iface.currentLayerChanged.disconnect(self._follow)
        QgsProject.instance().layersAdded.disconnect(self._follow)
        QgsProject.instance().layersRemoved.disconnect(self._follow)

    def numbers(self) -> list[int]:
        """The trees in the list, from above."""
        rows = self._kept[2] if self._kept else None
        ids = [rows.rowToId(rows.index(row, 0)) for row in range(rows.rowCount())] if rows is not None else []
        return [int(self.layer.getFeature(fid)["tree_id"]) for fid in ids]

    def _follow(self, *_: Any) -> None:
        """The active layer where it holds trees, else the one that is shown, else the first."""
        active, found = self.iface.activeLayer(), tree_layers()
        if active not in found:
            active = self.layer if self.layer in found else (found or [None])[0]
        if active is self.layer:
            return
        self.layer = active
        if active is None or not is_tree_layer(active):
            self.table.setModel(None)
            self._kept = ()
            return
        cache = QgsVectorLayerCache(active, CACHED)
        model = QgsAttributeTableModel(cache)
        model.loadLayer()
        rows = QgsAttributeTableFilterModel(self.iface.mapCanvas(), model)
        rows.setAttributeTableConfig(active.attributeTableConfig())
        rows.setFilterMode(compat.SHOW_VISIBLE)
        rows.sort('"tree_id"')
        self.table.setModel(rows)
        self.table.setAttributeTableConfig(active.attributeTableConfig())
        self.table.resizeColumnsToContents()
        self._kept = (cache, model, rows)

    def _clicked(self, index: Any) -> None:
        fid = self._kept[2].rowToId(index)
        self.iface.mapCanvas().flashFeatureIds(self.layer, [fid])
        self._chosen(int(self.layer.getFeature(fid)["tree_id"]))

    def _zoom(self, index: Any) -> None:
        canvas, feature = self.iface.mapCanvas(), self.layer.getFeature(self._kept[2].rowToId(index))
        canvas.setCenter(on_map(feature.geometry().centroid().asPoint(), canvas, self.layer))
        canvas.zoomScale(min(canvas.scale(), 120.0))
        canvas.refresh()
