"""Write the ready-made models (``treedgs_qgis/models/*.model3``) with PyQGIS: ``make models``.

Run with the system's Python under QGIS 3.22, so that every later version reads them. A model is a chain of our own
algorithms with the few parameters that a user has to think about; everything else keeps its default.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
# The order of XML attributes follows Qt's hash: without a fixed seed every run writes another file.
os.environ["QT_HASH_SEED"] = "0"

from qgis.core import (
    QgsApplication,
    QgsProcessingModelAlgorithm,
    QgsProcessingModelChildAlgorithm,
    QgsProcessingModelChildParameterSource,
    QgsProcessingModelOutput,
    QgsProcessingModelParameter,
)
from qgis.PyQt.QtCore import QPointF

ROOT = Path(__file__).resolve().parents[1]
MODELS = ROOT / "treedgs_qgis" / "models"
GROUP = "Ready-made models"

#: file -> (title, help, {model input: (child, its parameter)}, [(child, algorithm, {parameter: input or (child,
#: output)}, {output parameter: title})]). An input is declared as the child's own parameter is.
CHAINS = {
    "photostostandtable": (
        "From drone photos to a stand table",
        "Measures the trees of your plots in drone photos, then makes the stand table and the report. Give the photos, "
        "the PPK files, the CRS and the plots; a second run in the same workspace goes on where it ended.",
        [
            ("measure", "photostodbh", {}, {"OUTPUT": "Trees"}),
            ("table", "standtable", {"TREES": ("measure", "OUTPUT")}, {"OUTPUT": "Tables"}),
        ],
        {
            "PHOTOS": ("measure", "PHOTOS"),
            "GEOTAGS": ("measure", "GEOTAGS"),
            "CRS": ("measure", "CRS"),
            "PLOTS": ("measure", "PLOTS"),
            "SPECIES": ("table", "SPECIES"),
            "PRESET": ("measure", "PRESET"),
            "WORKSPACE": ("measure", "WORKSPACE"),
        },
        {"PLOTS": [("table", "PLOTS")]},
    ),
    "cloudtostandtable": (
        "From a point cloud to a stand table",
        "Measures the trees in a LiDAR cloud, then makes the stand table and the report.",
        [
            ("measure", "pointcloudtodbh", {}, {"OUTPUT": "Trees"}),
            ("table", "standtable", {"TREES": ("measure", "OUTPUT")}, {"OUTPUT": "Tables"}),
        ],
        {
            "INPUT": ("measure", "INPUT"),
            "PLOTS": ("measure", "PLOTS"),
            "DTM": ("measure", "DTM"),
            "SPECIES": ("table", "SPECIES"),
        },
        {"PLOTS": [("table", "PLOTS")]},
    ),
    "photostoaccuracy": (
        "From drone photos to accuracy against field trees",
        "Measures the trees in drone photos, pairs them with your field tally, and shows how well they agree. Look at "
        "the pairs before you believe the figures.",
        [
            ("measure", "photostodbh", {}, {"OUTPUT": "Trees"}),
            ("pair", "matchplots", {"TREES": ("measure", "OUTPUT")}, {"OUTPUT": "Pairs"}),
            ("score", "evaluate", {"PAIRS": ("pair", "OUTPUT")}, {"OUTPUT": "Accuracy"}),
        ],
        {
            "PHOTOS": ("measure", "PHOTOS"),
            "GEOTAGS": ("measure", "GEOTAGS"),
            "CRS": ("measure", "CRS"),
            "PLOTS": ("measure", "PLOTS"),
            "FIELD": ("pair", "FIELD"),
            "PRESET": ("measure", "PRESET"),
            "WORKSPACE": ("measure", "WORKSPACE"),
        },
        {"PLOTS": [("pair", "PLOTS")]},
    ),
}


def load_plugin() -> None:
    """The provider of this checkout, in this process."""
    import importlib.util

    spec = importlib.util.spec_from_file_location(
        "treedgs", ROOT / "__init__.py", submodule_search_locations=[str(ROOT)]
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules["treedgs"] = module
    spec.loader.exec_module(module)
    plugin = module.classFactory(None)
    plugin.initProcessing()
    # QGIS does not own the plugin object, and without it the provider is gone.
    load_plugin.kept = plugin


def build(name: str) -> QgsProcessingModelAlgorithm | None:
    """One model; ``None`` while one of its algorithms does not exist."""
    title, text, steps, inputs, more = CHAINS[name]
    registry = QgsApplication.processingRegistry()
    algorithms = {child: registry.algorithmById(f"treedgs:{algorithm}") for child, algorithm, _, _ in steps}
    if None in algorithms.values():
        return None
    # The name is the id; the title is shown by treedgs_qgis/models.
    model = QgsProcessingModelAlgorithm(name, GROUP)
    model.setName(name)
    model.setGroup(GROUP)
    for number, (parameter, (child, own)) in enumerate(inputs.items()):
        declared = algorithms[child].parameterDefinition(own)
        if declared.isDestination():
            # A model takes folders as plain parameters.
            from qgis.core import QgsProcessingParameterFile

            definition = QgsProcessingParameterFile(
                parameter, declared.description(), QgsProcessingParameterFile.Folder, "", None, False
            )
        else:
            definition = declared.clone()
            definition.setName(parameter)
        if parameter in more or parameter == "PLOTS":
            definition.setFlags(definition.flags() & ~definition.FlagOptional)
        definition.setHelp(declared.help())
        place = QgsProcessingModelParameter(parameter)
        place.setPosition(QPointF(120 + 220 * number, 60))
        model.addModelParameter(definition, place)
    for number, (child, algorithm, sources, outputs) in enumerate(steps):
        part = QgsProcessingModelChildAlgorithm(f"treedgs:{algorithm}")
        part.setChildId(child)
        part.setDescription(algorithms[child].displayName())
        part.setPosition(QPointF(200 + 320 * number, 240))
        wanted = {own: parameter for parameter, (which, own) in inputs.items() if which == child}
        for parameter, places in more.items():
            wanted.update({own: parameter for which, own in places if which == child})
        for own, parameter in wanted.items():
            part.addParameterSources(own, [QgsProcessingModelChildParameterSource.fromModelParameter(parameter)])
        for own, (earlier, result) in sources.items():
            part.addParameterSources(own, [QgsProcessingModelChildParameterSource.fromChildOutput(earlier, result)])
        for definition in algorithms[child].parameterDefinitions():
            known = definition.name() in wanted or definition.name() in sources
            if not known and not definition.isDestination() and definition.defaultValue() is not None:
                value = QgsProcessingModelChildParameterSource.fromStaticValue(definition.defaultValue())
                part.addParameterSources(definition.name(), [value])
        made = {}
        for own, label in outputs.items():
            output = QgsProcessingModelOutput(label)
            output.setChildId(child)
            output.setChildOutputName(own)
            output.setDescription(label)
            output.setPosition(QPointF(320 + 320 * number, 420))
            made[label] = output
        part.setModelOutputs(made)
        model.addChildAlgorithm(part)
    model.updateDestinationParameters()
    model.setHelpContent({"ALG_DESC": f"{title}. {text}", "ALG_CREATOR": "TreeDGS"})
    return model


def main() -> int:
    """Write every model whose algorithms exist."""
    application = QgsApplication([], False)
    application.initQgis()
    load_plugin()
    MODELS.mkdir(exist_ok=True)
    for name in CHAINS:
        model = build(name)
        if model is None:
            print(f"{name}: left out, an algorithm it needs does not exist yet")
            continue
        good, problems = model.validate()
        if not good or not model.toFile(str(MODELS / f"{name}.model3")):
            print(f"error: {name}: {problems}", file=sys.stderr)
            return 1
        print(f"{name}: written")
    sys.stdout.flush()
    # QGIS 3.22 may crash while Python tears it down.
    os._exit(0)


if __name__ == "__main__":
    sys.exit(main())
