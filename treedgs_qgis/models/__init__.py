"""Ready-made models: chains of our algorithms as ``.model3`` files, shown in the toolbox like an algorithm.

Written by ``make models``. They can also be opened in the model designer, changed and saved under another name.
"""

from __future__ import annotations

from pathlib import Path

from qgis.core import QgsProcessingAlgorithm, QgsProcessingContext, QgsProcessingModelAlgorithm
from qgis.PyQt.QtGui import QIcon

from ..algorithm import unknown_name
from ..i18n import tr

FOLDER = Path(__file__).parent
ICON = FOLDER.parent / "icons" / "model.svg"
#: File name -> title in the toolbox.
TITLES = {
    "photostostandtable": "From drone photos to a stand table",
    "cloudtostandtable": "From a point cloud to a stand table",
    "photostoaccuracy": "From drone photos to accuracy against field trees",
}


class Model(QgsProcessingModelAlgorithm):
    """A model with a plain id and a translated title."""

    def displayName(self) -> str:
        """The title in the toolbox."""
        return tr(TITLES.get(self.name(), self.name()))

    def group(self) -> str:
        """One group for all of them."""
        return tr("Ready-made models")

    def groupId(self) -> str:
        """The group's id."""
        return "readymademodels"

    def tags(self) -> list[str]:
        """Search words."""
        return ["treedgs", "model", "chain", "workflow", "dbh", "inventory"]

    def shortDescription(self) -> str:
        """One line."""
        return self.displayName()

    def createInstance(self) -> QgsProcessingAlgorithm:
        """A copy that checks its values as this one does."""
        made = type(self)()
        made.loadVariant(self.toVariant())
        return made

    def checkParameterValues(self, parameters: dict, context: QgsProcessingContext) -> tuple[bool, str]:
        """Refuse unknown names, and what the algorithm that takes a value would refuse, before anything starts."""
        problem = unknown_name(self, parameters) or self._value_problem(parameters, context)
        return (False, problem) if problem else super().checkParameterValues(parameters, context)

    def _value_problem(self, parameters: dict, context: QgsProcessingContext) -> str:
        for child in self.childAlgorithms().values():
            algorithm, given = child.algorithm(), {}
            sources = child.parameterSources()
            for own in sources:
                names = [source.parameterName() for source in sources[own] if source.parameterName()]
                if names and parameters.get(names[0]) not in (None, ""):
                    given[own] = parameters[names[0]]
            if not hasattr(algorithm, "values_problem"):
                continue
            # What a later step needs is partly made by the earlier ones, and looked at when it is there.
            first = not any(source.outputChildId() for several in sources.values() for source in several)
            problem = (algorithm.problem if first else algorithm.values_problem)(given, context)
            if problem:
                return problem
        return ""

    def icon(self) -> QIcon:
        """A chain."""
        return QIcon(self.svgIconPath())

    def svgIconPath(self) -> str:
        """The same icon as a file."""
        return str(ICON)


def load() -> list[Model]:
    """Every model of the folder that this QGIS can read."""
    found = []
    for name in TITLES:
        file = FOLDER / f"{name}.model3"
        model = Model()
        if file.exists() and model.fromFile(str(file)):
            found.append(model)
    return found
