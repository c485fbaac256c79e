"""What happens to results on their way into the project: styles, companion layers, snapping for pairs."""

from __future__ import annotations

import os
from typing import Any, ClassVar

from qgis.core import (
    QgsEditorWidgetSetup,
    QgsMapLayer,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingLayerPostProcessorInterface,
    QgsProject,
    QgsSnappingConfig,
    QgsVectorLayer,
)

from . import compat
from .i18n import tr

#: Layers that come with the one that was asked for, bottom first: table in the GeoPackage -> name in the project.
COMPANIONS = {
    "Pairs": (
        ("plots", "Plots"),
        ("suggested", "Suggested pairs"),
        ("measured_trees", "Measured trees"),
        ("field_trees", "Field trees"),
    ),
    "Trees": (("slices", "Stem slices"), ("circles", "Stem circles")),
}
#: How near a line's end has to come to a tree to catch it.
SNAP_PIXELS = 12


def load_results(results: dict[str, Any], name: str, context: QgsProcessingContext) -> None:
    """Give each result that QGIS will load its name and style, and bring its companions along."""
    for value in list(results.values()):
        if not isinstance(value, str) or not context.willLoadLayerOnCompletion(value):
            continue
        details = context.layerToLoadOnCompletionDetails(value)
        details.setPostProcessor(DefaultStyle.make())
        if name and value.lower().endswith((".gpkg", ".shp", ".geojson", ".csv", ".tif")):
            details.name = name
        if not value.lower().endswith(".gpkg"):
            continue
        for kind, companions in COMPANIONS.items():
            if name == tr(kind):
                for table, title in companions:
                    _add_companion(f"{value}|layername={table}", tr(title), details.project, context)


def _add_companion(source: str, title: str, project: QgsProject | None, context: QgsProcessingContext) -> None:
    layer = QgsVectorLayer(source, title, "ogr")
    if not layer.isValid() or layer.featureCount() == 0:
        return
    details = QgsProcessingContext.LayerDetails(title, project or context.project(), title)
    details.setPostProcessor(DefaultStyle.make())
    context.addLayerToLoadOnCompletion(source, details)


class DefaultStyle(QgsProcessingLayerPostProcessorInterface):
    """Gives a loaded layer the style that came in its file: Processing itself opens layers without it."""

    #: QGIS does not own post-processors; without this they are gone before they are used.
    _kept: ClassVar[list[DefaultStyle]] = []

    @classmethod
    def make(cls) -> DefaultStyle:
        """A new one for each layer."""
        made = cls()
        cls._kept = [*cls._kept[-40:], made]
        return made

    def postProcessLayer(  # noqa: N802
        self, layer: QgsMapLayer, context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> None:
        """Apply the style; a pairs layer also gets its trees to snap to."""
        layer.loadDefaultStyle()
        if isinstance(layer, QgsVectorLayer):
            in_the_users_language(layer)
        layer.triggerRepaint()
        if os.path.basename(layer.source()).endswith("|layername=field_trees") or _is_pairs(layer):
            snap_to_trees(QgsProject.instance())


def in_the_users_language(layer: QgsVectorLayer) -> None:
    """Translate what a style shows in English: column titles, legend, choices. (Map tips carry their languages.)"""
    for index, field in enumerate(layer.fields()):
        if tr(field.alias()) != field.alias():
            layer.setFieldAlias(index, tr(field.alias()))
        setup = layer.editorWidgetSetup(index)
        if setup.type() == "ValueMap" and isinstance(setup.config().get("map"), list):
            choices = [{tr(text): value for text, value in entry.items()} for entry in setup.config()["map"]]
            layer.setEditorWidgetSetup(index, QgsEditorWidgetSetup("ValueMap", {"map": choices}))
    made = layer.renderer().clone() if layer.renderer() else None
    for entries, change in (("categories", "updateCategoryLabel"), ("ranges", "updateRangeLabel")):
        if hasattr(made, entries):
            for number, entry in enumerate(getattr(made, entries)()):
                getattr(made, change)(number, tr(entry.label()))
    if made is not None:
        layer.setRenderer(made)


def _is_pairs(layer: QgsMapLayer) -> bool:
    return isinstance(layer, QgsVectorLayer) and layer.fields().indexOf("pair_status") >= 0


def snap_to_trees(project: QgsProject) -> None:
    """Let lines catch the field and the measured trees; a project that already snaps is left as it is."""
    config = project.snappingConfig()
    if config.enabled():
        return
    tables = ("|layername=field_trees", "|layername=measured_trees")
    trees = [layer for layer in project.mapLayers().values() if layer.source().endswith(tables)]
    if len(trees) < 2:
        return
    config.setMode(compat.SNAP_ADVANCED)
    for layer in project.mapLayers().values():
        if isinstance(layer, QgsVectorLayer) and layer.isSpatial():
            on = layer in trees
            config.setIndividualLayerSettings(
                layer,
                QgsSnappingConfig.IndividualLayerSettings(on, compat.SNAP_VERTEX, SNAP_PIXELS, compat.UNIT_PIXELS),
            )
    config.setEnabled(True)
    project.setSnappingConfig(config)
