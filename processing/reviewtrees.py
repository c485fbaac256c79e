"""``treedgs:reviewtrees``: the panel *Review trees*, where people look for algorithms."""

from __future__ import annotations

from ..treedgs_qgis import compat
from ..treedgs_qgis.algorithm import BaseAlgorithm


class Algorithm(BaseAlgorithm):
    """Opens the panel; without parameters QGIS shows no dialog."""

    def name(self):
        """The id."""
        return "reviewtrees"

    def displayName(self):
        """The title."""
        return self.tr("Review trees")

    def group(self):
        """With what checks trees."""
        return self.tr("3 Check")

    def groupId(self):
        """With what checks trees."""
        return "3check"

    def tags(self):
        """Search words."""
        return ["treedgs", "panel", "review", "decision", "accept", "reject", "tape", "merge", "check"]

    def shortDescription(self):
        """One line."""
        return self.tr("Open the panel in which a person decides about trees on the map.")

    def flags(self):
        """Only where there are windows, in their thread."""
        return super().flags() | compat.NEEDS_WINDOWS

    def initAlgorithm(self, configuration=None):
        """No parameters."""

    def processAlgorithm(self, parameters, context, feedback):
        """Show it."""
        self.provider().open_panel()
        return {}
