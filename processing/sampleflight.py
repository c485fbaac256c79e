"""``treedgs:sampleflight``: a small simulated flight to try the plugin with."""

from __future__ import annotations

import tempfile
from pathlib import Path

from qgis.core import (
    QgsBlockingNetworkRequest,
    QgsProcessingException,
    QgsProcessingOutputFolder,
    QgsProcessingOutputString,
    QgsProcessingParameterFile,
)
from qgis.PyQt.QtCore import QUrl
from qgis.PyQt.QtNetwork import QNetworkRequest

from ..treedgs_qgis import compat, engine, extras, sample
from ..treedgs_qgis.algorithm import BaseAlgorithm

HELP = """<p><b>Fetch a sample flight: {photos} photos of a small simulated plot, with geotags, terrain and field table
({size}).</b></p>
<p>Then run <b>Measure DBH from drone photos</b> on it; <i>Plugins ▸ TreeDGS ▸ Try it with a sample flight</i> opens
that with everything filled in. The photos are rendered, not taken: their trees are easier than yours.</p>
<p>It comes from {address}; without network give the file as SAMPLE.</p>"""


class Algorithm(BaseAlgorithm):
    """Fetch the sample flight."""

    def name(self):
        """The id."""
        return "sampleflight"

    def displayName(self):
        """The title."""
        return self.tr("Get the sample flight")

    def group(self):
        """With the simulator."""
        return self.tr("5 Steps and research")

    def groupId(self):
        """With the simulator."""
        return "5stepsandresearch"

    def tags(self):
        """Search words."""
        return ["treedgs", "try", "sample", "demo", "example", "data"]

    def shortDescription(self):
        """One line."""
        return self.tr("Get a small flight to try the plugin with.")

    def shortHelpString(self):
        """The help panel."""
        known = sample.known()
        size = extras.in_words(known["bytes"] / 1e6)
        return self.tr(HELP).format(photos=known["photos"], size=size, address=sample.address())

    def initAlgorithm(self, configuration=None):
        """Declare parameters."""
        file = QgsProcessingParameterFile(
            "SAMPLE", self.tr("The sample as a file (no network)"), compat.FILE, "zip", None, True
        )
        file.setHelp(self.tr("The zip of the sample flight, where this computer has no network."))
        folder = QgsProcessingParameterFile("FOLDER", self.tr("Unpack into"), compat.FOLDER, "", None, True)
        folder.setHelp(self.tr("Left empty: into the plugin's data folder."))
        for made in (file, folder):
            self.addParameter(made)
        self.addOutput(QgsProcessingOutputFolder("SAMPLE_FOLDER", self.tr("The flight's folder")))
        self.addOutput(QgsProcessingOutputString("CRS", self.tr("Its coordinate reference system")))

    def fetch(self, target: Path, feedback) -> str:
        """The sample from its address into a file; returns the address.

        Raises:
            EngineError: no such answer.
        """
        address = sample.address()
        size = extras.in_words(sample.known()["bytes"] / 1e6)
        feedback.setProgressText(self.tr("Fetching the sample flight ({size})").format(size=size))
        feedback.setProgress(5)
        # Its signal of progress is not used: it may come when this is over, to what is gone by then.
        request = QgsBlockingNetworkRequest()
        if request.get(QNetworkRequest(QUrl(address)), True, feedback) != compat.FETCHED:
            text = self.tr(
                "The sample flight cannot be fetched from {address} ({why}); get {name} by other means and give it as "
                "SAMPLE."
            )
            raise engine.EngineError(text.format(address=address, why=request.errorMessage(), name=sample.NAME))
        target.write_bytes(bytes(request.reply().content()))
        feedback.setProgress(90)
        return address

    def processAlgorithm(self, parameters, context, feedback):
        """Fetch it, unless it is there."""
        given = self.parameterAsString(parameters, "SAMPLE", context)
        folder = Path(self.parameterAsString(parameters, "FOLDER", context) or sample.default_folder())
        results = {"SAMPLE_FOLDER": str(folder), "CRS": sample.CRS}
        if sample.is_there(folder):
            feedback.pushInfo(self.tr("The sample flight is there: {folder}").format(folder=folder))
            return results
        local = Path(given) if given else sample.beside()
        try:
            if local is not None:
                sample.unpack(local, folder, str(local))
            else:
                with tempfile.TemporaryDirectory() as scratch:
                    file = Path(scratch) / sample.NAME
                    sample.unpack(file, folder, self.fetch(file, feedback))
        except (engine.EngineError, OSError) as problem:
            raise QgsProcessingException(str(problem)) from None
        feedback.pushInfo(self.tr("The sample flight is there: {folder}").format(folder=folder))
        return results
