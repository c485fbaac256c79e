"""The Processing provider ``treedgs``: every algorithm, always registered, with or without an engine."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

from qgis.core import QgsProcessingProvider, QgsSettings
from qgis.PyQt.QtGui import QIcon

from . import engine, models
from .algorithm import ICON
from .words import declarations

#: Modules of ``processing/``, in the order of the work.
ALGORITHMS = (
    "planflight",
    "photostodbh",
    "pointcloudtodbh",
    "campaign",
    "geotag",
    "reconstruct",
    "terrain",
    "fitgaussians",
    "samplesurface",
    "segmentstems",
    "measuredbh",
    "reviewtrees",
    "review",
    "matchplots",
    "evaluate",
    "tapesample",
    "tapecheck",
    "trial",
    "standtable",
    "compare",
    "benchmark",
    "simulateplot",
    "sampleflight",
    "checkengine",
    "setupengine",
    "removeengine",
)


class TreeDGSProvider(QgsProcessingProvider):
    """Tree diameters from drone photos or LiDAR clouds."""

    #: What offers to set up the engine (:class:`.offer.Offer`): the plugin gives it where there are windows.
    offer: Any = None
    #: Opens the panel *Review trees*; the plugin gives it too.
    open_panel: Callable[[], Any] = staticmethod(lambda: None)

    def id(self) -> str:
        """Never translated, never changed."""
        return "treedgs"

    def name(self) -> str:
        """In the toolbox."""
        return "TreeDGS"

    def longName(self) -> str:
        """With what it does."""
        return "TreeDGS: tree diameters from drone photos or LiDAR"

    def icon(self) -> QIcon:
        """A stem's cross-section with its diameter."""
        return QIcon(str(ICON))

    def svgIconPath(self) -> str:
        """The same icon as a file."""
        return str(ICON)

    def supportsNonFileBasedOutput(self) -> bool:
        """The engine writes files."""
        return False

    def supportedOutputVectorLayerExtensions(self) -> list[str]:
        """GeoPackage first: it keeps the style; the others are what the engine can write too."""
        return ["gpkg", "shp", "geojson", "csv"]

    def supportedOutputRasterLayerExtensions(self) -> list[str]:
        """GeoTIFF."""
        return ["tif"]

    def defaultVectorFileExtension(self, hasGeometry: bool = True) -> str:
        """GeoPackage."""
        return "gpkg"

    def warningMessage(self) -> str:
        """Shown above the toolbox's algorithms when the engine is missing."""
        try:
            needs = declarations()["pointcloud-to-dbh"]["needs"]
            engine.find_engine(str(QgsSettings().value("treedgs/python", "") or ""), needs)
        except engine.EngineError as problem:
            return str(problem)
        return ""

    def loadAlgorithms(self) -> None:
        """Make and add the algorithms; QGIS owns them."""
        plugin = __package__.rpartition(".")[0]
        for module in ALGORITHMS:
            made = importlib.import_module(f"{plugin}.processing.{module}").Algorithm()
            if getattr(made, "COMMAND", None) is None or made.COMMAND in declarations():
                self.addAlgorithm(made)
        for model in models.load():
            self.addAlgorithm(model)
