"""**Try it with a sample flight**: puts it where it can be written, shows it, and opens the dialog filled in; what was
measured before is shown instead."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from qgis.core import QgsApplication, QgsProject, QgsRasterLayer, QgsVectorLayer
from qgis.PyQt.QtCore import QUrl

from . import sample
from .compat import LOG_WARNING
from .engine import PLUGIN_ROOT, EngineError
from .i18n import tr
from .loading import load_again, show_on_map, tell_apart

MEASURE = "treedgs:photostodbh"
HILLSHADE = PLUGIN_ROOT / "treedgs_geo" / "core" / "styles" / "dtm.qml"


def begin(iface: Any, open_dialog: Any, offer: Any) -> None:
    """The menu entry. open_dialog: shows an algorithm's dialog with values; offer: the plugin's."""
    try:
        folder = sample.copy(sample.default_folder())
    except EngineError as problem:
        iface.messageBar().pushMessage("TreeDGS", str(problem), LOG_WARNING, 0)
        return
    _show(iface, folder)
    results = sample.results(folder)
    if "OUTPUT" not in results:
        open_dialog(MEASURE, sample.job_values(folder))
        return
    layers = QgsProject.instance().mapLayers().values()
    loaded = [layer for layer in layers if layer.source().partition("|")[0] == results["OUTPUT"]]
    for layer in loaded:
        show_on_map(layer)
    if not loaded:
        load_again(QgsApplication.processingRegistry().createAlgorithmById(MEASURE), results)
    if "REPORT" in results:
        offer.page(results["REPORT"], tr("The sample flight was measured before."), str(folder))


def _show(iface: Any, folder: Path) -> None:
    """Terrain and plots on the map."""
    project = QgsProject.instance()
    there = {layer.source() for layer in project.mapLayers().values()}
    terrain = QgsRasterLayer(str(folder / "dtm.tif"), tr("Terrain model"))
    terrain.loadNamedStyle(str(HILLSHADE))
    # Encoded: the provider reads no spaces or accents.
    table = bytes(QUrl.fromLocalFile(str(folder / "plots.csv")).toEncoded()).decode()
    source = f"{table}?type=csv&xField=easting&yField=northing&crs={sample.CRS}&detectTypes=yes"
    plots = QgsVectorLayer(source, tr("Plots"), "delimitedtext")
    fresh = [layer for layer in (terrain, plots) if layer.isValid() and layer.source() not in there]
    for layer in fresh:
        tell_apart(layer)
        project.addMapLayer(layer)
    if fresh and terrain.isValid():
        if len(project.mapLayers()) == len(fresh):
            project.setCrs(terrain.crs())
        iface.setActiveLayer(terrain)
        iface.zoomToActiveLayer()
        iface.setActiveLayer(fresh[-1])  # QGIS puts the trees above it
