"""``treedgs:sampleflight``: a small simulated flight to try the plugin with."""

from __future__ import annotations

from pathlib import Path

from qgis.core import (
    QgsProcessingException,
    QgsProcessingOutputFolder,
    QgsProcessingOutputString,
    QgsProcessingParameterFile,
)

from ..treedgs_qgis import compat, engine, sample
from ..treedgs_qgis.algorithm import BaseAlgorithm

HELP = """<p><b>Copy the sample flight: photos of a small simulated plot, with geotags, terrain and field table.</b></p>
<p>Then run <b>Measure DBH from drone photos</b> on it; <i>Plugins ▸ TreeDGS ▸ Try it with a sample flight</i> opens
that with everything filled in. The photos are rendered, not taken: their trees are easier than yours.</p>"""


class Algorithm(BaseAlgorithm):
    """Copy the sample flight."""

    def name(self):
        """The id."""
        return "sampleflight"

    def displayName(self):
        """The title."""
        return self.tr("Get the sample flight")

    def group(self):
        """With the set-up: what one begins with."""
        return self.tr("Setup")

    def groupId(self):
        """With the set-up."""
        return "setup"

    def tags(self):
        """Search words."""
        return ["treedgs", "try", "sample", "demo", "example", "data"]

    def shortDescription(self):
        """One line."""
        return self.tr("Get a small flight to try the plugin with.")

    def shortHelpString(self):
        """The help panel."""
        return self.paragraphs(self.tr(HELP))

    def initAlgorithm(self, configuration=None):
        """Declare parameters."""
        folder = QgsProcessingParameterFile("FOLDER", self.tr("Copy into"), compat.FOLDER, "", None, True)
        folder.setHelp(self.tr("Left empty: into the plugin's data folder."))
        self.addParameter(folder)
        self.addOutput(QgsProcessingOutputFolder("SAMPLE_FOLDER", self.tr("The flight's folder")))
        self.addOutput(QgsProcessingOutputString("CRS", self.tr("Its coordinate reference system")))

    def processAlgorithm(self, parameters, context, feedback):
        """Copy it."""
        given = self.parameterAsString(parameters, "FOLDER", context)
        try:
            folder = sample.copy(Path(given) if given else sample.default_folder())
        except engine.EngineError as problem:
            raise QgsProcessingException(str(problem)) from None
        feedback.pushInfo(self.tr("The sample flight is there: {folder}").format(folder=folder))
        return {"SAMPLE_FOLDER": str(folder), "CRS": sample.CRS}
