"""**Try it with a sample flight**: fetches it, shows it, and opens the dialog with everything filled in."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from qgis.core import QgsProject, QgsRasterLayer, QgsVectorLayer
from qgis.PyQt.QtCore import QObject, QUrl
from qgis.PyQt.QtWidgets import QFileDialog, QPushButton

from . import sample
from .compat import LOG_INFO, LOG_WARNING
from .i18n import tr
from .offer import Controls, Job

MEASURE = "treedgs:photostodbh"


class TryIt(QObject):
    """The menu entry. open_dialog: shows an algorithm's dialog with values."""

    def __init__(self, iface: Any, open_dialog: Any) -> None:
        super().__init__()
        self.iface, self.open_dialog = iface, open_dialog
        self.job = Job("treedgs:sampleflight", tr("The sample flight is there: press Run."))
        self.job.ended.connect(self.ended)

    def begin(self, values: dict[str, Any] | None = None) -> None:
        """Fetch it with a progress bar, or open it at once when it is there."""
        bar = self.iface.messageBar()
        item = bar.createMessage("TreeDGS", tr("Fetching the sample flight"))
        item.layout().addWidget(Controls(self.job, item, tr("Try again"), values or {}))
        bar.pushWidget(item, LOG_INFO)
        self.job.start(values or {})

    def ended(self, successful: bool, words: str, results: dict[str, Any]) -> None:
        """Show it; where it could not be fetched, a file will do."""
        bar = self.iface.messageBar()
        if successful:
            bar.clearWidgets()
            self.show(Path(results["SAMPLE_FOLDER"]))
            return
        bar.clearWidgets()
        item = bar.createMessage("TreeDGS", words)
        button = QPushButton(tr("Choose the file …"))
        button.clicked.connect(self.choose)
        item.layout().addWidget(button)
        bar.pushWidget(item, LOG_WARNING)

    def choose(self) -> None:
        """A zip from this computer."""
        title = tr("The sample flight")
        file, _ = QFileDialog.getOpenFileName(self.iface.mainWindow(), title, "", f"{sample.NAME} (*.zip)")
        if file:
            self.begin({"SAMPLE": file})

    def show(self, folder: Path) -> None:
        """Terrain and plots on the map, and the dialog."""
        project = QgsProject.instance()
        there = {layer.source() for layer in project.mapLayers().values()}
        terrain = QgsRasterLayer(str(folder / "dtm.tif"), tr("Terrain model"))
        # Encoded: the provider reads no spaces or accents.
        table = bytes(QUrl.fromLocalFile(str(folder / "plots.csv")).toEncoded()).decode()
        source = f"{table}?type=csv&xField=easting&yField=northing&crs={sample.CRS}&detectTypes=yes"
        plots = QgsVectorLayer(source, tr("Plots"), "delimitedtext")
        fresh = [layer for layer in (terrain, plots) if layer.isValid() and layer.source() not in there]
        for layer in fresh:
            project.addMapLayer(layer)
        if fresh and terrain.isValid():
            if len(project.mapLayers()) == len(fresh):
                project.setCrs(terrain.crs())
            self.iface.setActiveLayer(terrain)
            self.iface.zoomToActiveLayer()
        self.open_dialog(MEASURE, sample.job_values(folder))
