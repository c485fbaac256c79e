"""``treedgs:removeengine``: frees the disk that the engine takes."""

from __future__ import annotations

import shutil

from qgis.core import QgsProcessingException, QgsProcessingOutputNumber, QgsProcessingParameterBoolean

from ..treedgs_qgis import engine, extras, leftovers
from ..treedgs_qgis.algorithm import BaseAlgorithm

HELP = """<p><b>Remove the engine: its libraries, and the Python that was fetched for it.</b></p>
<p>Do this before you uninstall the plugin, which QGIS removes without it. Engines of former versions go too. Your
results, workspaces and the logs of former jobs stay (these only if you do not tick them), and so does an engine that
the plugin in another QGIS profile uses. <b>Set up the engine</b> brings it back.</p>"""


class Algorithm(BaseAlgorithm):
    """Remove the engine."""

    def name(self):
        """The id."""
        return "removeengine"

    def displayName(self):
        """The title."""
        return self.tr("Remove the engine")

    def group(self):
        """With the set-up."""
        return self.tr("Setup")

    def groupId(self):
        """With the set-up."""
        return "setup"

    def tags(self):
        """Search words."""
        return ["treedgs", "uninstall", "remove", "disk", "space", "environment"]

    def shortDescription(self):
        """One line."""
        return self.tr("Free the disk that the engine takes.")

    def shortHelpString(self):
        """The help panel."""
        return self.paragraphs(self.tr(HELP))

    def initAlgorithm(self, configuration=None):
        """Declare parameters."""
        jobs = QgsProcessingParameterBoolean("JOBS", self.tr("Logs of former jobs too"), False)
        jobs.setHelp(self.tr("The logs of the last 20 jobs; results lie where you wrote them and always stay."))
        self.addParameter(jobs)
        self.addOutput(QgsProcessingOutputNumber("FREED_GB", self.tr("Disk that became free, GB")))

    def processAlgorithm(self, parameters, context, feedback):
        """Remove it, and say how much that freed."""
        freed, kept = leftovers.remove_all()
        jobs = engine.data_dir() / "jobs"
        if self.parameterAsBoolean(parameters, "JOBS", context) and jobs.is_dir():
            before = leftovers.size_bytes(jobs)
            shutil.rmtree(jobs, ignore_errors=True)
            freed += before - leftovers.size_bytes(jobs)
        text = self.tr("Removed from {folder}: {size} are free again.")
        feedback.pushInfo(text.format(folder=engine.data_dir(), size=extras.in_words(freed / 1e6)))
        for name, plugin in leftovers.used_elsewhere().items():
            text = self.tr("{folder} stays: the plugin in {plugin} uses it; run this there too if it is not needed.")
            feedback.pushWarning(text.format(folder=engine.data_dir() / name, plugin=plugin))
        if kept:
            raise QgsProcessingException(
                self.tr(
                    "{folder} is in use and was not removed; let its jobs end, or stop them, and run this again."
                ).format(folder=", ".join(map(str, kept)))
            )
        return {"FREED_GB": round(freed / 1e9, 3)}
