"""Layers of the project as inputs: the engine reads files, so each is turned into the file it lies in or a copy."""

from __future__ import annotations

import os
from typing import Any

from qgis.core import (
    QgsMapLayer,
    QgsProcessingContext,
    QgsProcessingUtils,
    QgsProject,
    QgsProviderRegistry,
    QgsRasterLayer,
    QgsVectorFileWriter,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QUrl

from . import compat
from .i18n import tr

_VECTORS, _RASTERS = {".gpkg", ".shp", ".geojson"}, {".tif", ".tiff"}
#: Tables that the engine looks for in a GeoPackage of ours; they come with others that it reads too.
OWN_TABLES = ("trees", "pairs", "plan_photos", "plan_plots", "plan_line", "plan_footprints")


def kind_of(entry: dict[str, Any]) -> str:
    """``vector`` or ``raster`` when a parameter takes a layer of the project, else ''.

    Clouds are given as files: QGIS would first build an index of them, and Debian 12's cannot read them.
    """
    suffixes = set(entry.get("suffixes", []))
    if entry["kind"] != "file":
        return ""
    return "vector" if suffixes & _VECTORS else "raster" if suffixes & _RASTERS else ""


class Given:
    """What was given for a layer parameter. ``layer``: of the project, or None for a plain path (``text``)."""

    def __init__(self, algorithm: Any, name: str, parameters: dict[str, Any], context: QgsProcessingContext) -> None:
        value = parameters.get(name)
        self.name, self._context = name, context
        self.text = "" if isinstance(value, QgsMapLayer) else algorithm.parameterAsString(parameters, name, context)
        self.layer: QgsMapLayer | None = value if isinstance(value, QgsMapLayer) else None
        if self.layer is None and self.text:
            if context.project() is None:
                context.setProject(QgsProject.instance())
            self.layer = QgsProcessingUtils.mapLayerFromString(self.text, context, False)

    def path(self) -> str:
        """The file the layer lies in, as the engine would read it; '' when there is none and a copy is needed."""
        if self.layer is None:
            return self.text.split("|")[0]
        path, _, rest = self.layer.source().partition("|")
        if isinstance(self.layer, QgsRasterLayer):
            return path if os.path.exists(path) else ""
        if self.layer.subsetString():
            return ""
        if self.layer.providerType() == "delimitedtext":
            if self.layer.isSpatial() and self.layer.crs().isValid():
                return ""  # a text file does not say its CRS, the layer does
            path, rest = QUrl(self.layer.source()).toLocalFile(), ""
        if not os.path.isfile(path):
            return ""
        table = rest.partition("layername=")[2].partition("|")[0]
        alone = table in ("", *OWN_TABLES) or len(QgsProviderRegistry.instance().querySublayers(path)) < 2
        return path if alone else ""

    def problem(self) -> str:
        """Why the layer, or the file that exists, cannot be an input, or ''."""
        if self.layer is None:
            path = self.path()
            if not os.path.isfile(path) or QgsProcessingUtils.mapLayerFromString(self.text, self._context):
                return ""
            text = tr("{name}: {path} cannot be read as a layer; give a file that QGIS opens.")
            return text.format(name=self.name, path=path)
        words = {"name": self.name, "layer": self.layer.name()}
        if isinstance(self.layer, QgsVectorLayer) and self.layer.isModified():
            text = tr("{name}: the layer '{layer}' has edits that are not saved; save or drop them first.")
        elif not self.layer.isValid():
            text = tr("{name}: the layer '{layer}' cannot be read; correct its source.")
        elif isinstance(self.layer, QgsRasterLayer) and not self.path():
            text = tr("{name}: the layer '{layer}' is no file on this computer; save it as a GeoTIFF first.")
        elif holds_pairs(self.layer) and not self.path():
            text = tr("{name}: the layer '{layer}' is filtered, or a copy without its trees; give the pairs' file.")
        else:
            return ""
        return text.format(**words)

    def file(self, context: QgsProcessingContext, feedback: Any) -> str:
        """The path for the engine; a layer in memory, in a database, filtered, or one of many in its file is copied.

        Raises:
            OSError: the copy cannot be written.
        """
        path = self.path()
        if path or self.layer is None:
            self._tell_selection(feedback)
            return os.path.abspath(os.path.expanduser(path)) if path else ""
        target = QgsProcessingUtils.generateTempFilename(f"{self.name.lower()}.gpkg")
        options = QgsVectorFileWriter.SaveVectorOptions()
        options.driverName, options.layerName = "GPKG", self.name.lower()
        code, why, *_ = QgsVectorFileWriter.writeAsVectorFormatV3(
            self.layer, target, context.transformContext(), options
        )
        if code != compat.WRITTEN:
            raise OSError(
                tr("{name}: the layer '{layer}' cannot be copied for the engine ({why}).").format(
                    name=self.name, layer=self.layer.name(), why=why
                )
            )
        text = tr("{name}: the engine gets a copy of the layer '{layer}' as it shows it (features: {count}).")
        feedback.pushInfo(text.format(name=self.name, layer=self.layer.name(), count=self.layer.featureCount()))
        self._tell_selection(feedback)
        return target

    def _tell_selection(self, feedback: Any) -> None:
        if isinstance(self.layer, QgsVectorLayer) and self.layer.selectedFeatureCount():
            text = tr("{name}: all {count} features of '{layer}' are used, not only the {chosen} selected.")
            feedback.pushWarning(
                text.format(
                    name=self.name,
                    layer=self.layer.name(),
                    count=self.layer.featureCount(),
                    chosen=self.layer.selectedFeatureCount(),
                )
            )


def holds_pairs(layer: QgsMapLayer) -> bool:
    """A layer of pairs of field and measured trees."""
    return isinstance(layer, QgsVectorLayer) and layer.fields().indexOf("pair_status") >= 0


def reload_file(path: str) -> None:
    """Read again what the project shows of a vector file, columns included. Main thread only."""
    if not path:
        return
    for layer in QgsProject.instance().mapLayers().values():
        if not isinstance(layer, QgsVectorLayer) or not layer.isValid():
            continue
        source = layer.source().partition("|")[0]
        if os.path.exists(source) and os.path.samefile(source, path) and not layer.isEditable():
            layer.dataProvider().reloadData()
            layer.updateFields()
            layer.triggerRepaint()
