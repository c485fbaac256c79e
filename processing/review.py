"""``treedgs:review``: a person's decisions on trees, from a table into the tree layer."""

from __future__ import annotations

from ..treedgs_qgis import layers
from ..treedgs_qgis.algorithm import EngineAlgorithm


class Algorithm(EngineAlgorithm):
    """The verb ``review``."""

    COMMAND = "review"
    TAGS = ("review", "accept", "reject", "tape", "merge", "check")

    def needs(self, parameters, context):
        """The file itself: decisions in a copy of the layer would be lost."""
        given = layers.Given(self, "TREES", parameters, context)
        if given.path() or given.layer is None:
            return ""
        text = self.tr("TREES: the layer '{layer}' is filtered or no file; remove the filter, or give its file.")
        return text.format(layer=given.layer.name())

    def processAlgorithm(self, parameters, context, feedback):
        """Run the verb; a layer that shows the file is drawn again."""
        path = layers.Given(self, "TREES", parameters, context).path()
        results = super().processAlgorithm(parameters, context, feedback)
        self._changed = path
        return results

    def postProcessAlgorithm(self, context, feedback):
        """In the main thread: what the project shows of the file is read again."""
        layers.reload_file(getattr(self, "_changed", ""))
        return {}
