"""What happens to results on their way into the project: styles, companion layers, snapping for pairs."""

from __future__ import annotations

import importlib
import os
from collections.abc import Sequence
from typing import Any, ClassVar

import qgis.utils
from qgis.core import (
    QgsEditorWidgetSetup,
    QgsLayerTreeGroup,
    QgsLayerTreeNode,
    QgsMapLayer,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingLayerPostProcessorInterface,
    QgsProcessingUtils,
    QgsProject,
    QgsSnappingConfig,
    QgsVectorLayer,
)

from . import compat, layers
from .i18n import tr

#: Stands for the layer that was asked for, among its companions.
ITSELF = ("", "")
#: Layers that come with the one that was asked for, bottom first: table in the GeoPackage -> name in the project.
COMPANIONS = {
    "Pairs": (
        ("plots", "Plots"),
        ("suggested", "Suggested pairs"),
        ITSELF,
        ("measured_trees", "Measured trees"),
        ("field_trees", "Field trees"),
    ),
    "Trees": (
        ("searched", "Plots searched"),
        ("crowns", "Crowns"),
        ("circles", "Stems at true scale"),
        ("sections", "Stem sections"),
        ITSELF,
    ),
}
#: Layers of files that verbs write into a folder, bottom first: table -> name in the project.
IN_FOLDERS = (
    ("plan_footprints", "Ground in the photos"),
    ("plan_plots", "Plots of the flight plan"),
    ("plan_line", "Flight line"),
    ("plan_photos", "Planned photos"),
    ("stand_plots", "Stand by plot"),
    ("stand_trees", "Trees of the stand table"),
    ("change", "Trees at two dates"),
    ("tape_check", "Taped trees"),
    ("tapes", "Trees to tape"),
)
#: Rasters of a workspace that lie beneath its trees, bottom first: file -> name in the project.
GROUND = (("dtm.tif", "Ground"), ("ortho.tif", "Orthophoto of the ground"))
#: Of these (tables, or the layer asked for) the map shows the extent once they are loaded.
IN_VIEW = ("searched", "plan_photos", "stand_plots", "change", "tape_check", "tapes", "stations")
#: How near a line's end has to come to a tree to catch it.
SNAP_PIXELS = 12


def is_temporary(path: str) -> bool:
    """Whether a file lies where QGIS deletes it when it is closed."""
    folder = os.path.realpath(QgsProcessingUtils.tempFolder())
    return os.path.realpath(path.split("|")[0]).startswith(folder + os.sep)


def load_results(results: dict[str, Any], name: str, context: QgsProcessingContext) -> None:
    """Give each result that QGIS will load its name and style, and bring its companions along."""
    for value in list(results.values()):
        if not isinstance(value, str) or not context.willLoadLayerOnCompletion(value):
            continue
        details = context.layerToLoadOnCompletionDetails(value)
        details.setPostProcessor(DefaultStyle.make())
        if name and value.lower().endswith((".gpkg", ".shp", ".geojson", ".csv", ".tif")):
            details.name = f"{name} ({tr('temporary')})" if is_temporary(value) else name
            # QGIS prefers the names of files and tables otherwise.
            details.forceName = True
        if not value.lower().endswith(".gpkg"):
            continue
        for kind, companions in COMPANIONS.items():
            if name == tr(kind):
                sources = [f"{value}|layername={table}" if table else value for table, _ in companions]
                for rank, (table, title) in enumerate(companions):
                    if table:
                        _add_companion(sources[rank], tr(title), details.project, context, sources, rank)
                _in_order(details, sources, companions.index(ITSELF))
                context.addLayerToLoadOnCompletion(value, details)


def load_folder(results: dict[str, Any], context: QgsProcessingContext) -> None:
    """Bring the layers of a GeoPackage that a verb wrote into its output folder, and the ground of a workspace beneath
    its trees."""
    project = context.project()
    if project is None:
        return
    for value in results.values():
        if not isinstance(value, str) or context.willLoadLayerOnCompletion(value) or not os.path.exists(value):
            continue
        if value.lower().endswith(".gpkg"):
            sources = [f"{value}|layername={table}" for table, _ in IN_FOLDERS]
            for rank, (_, title) in enumerate(IN_FOLDERS):
                _add_companion(sources[rank], tr(title), project, context, sources, rank)
        if os.path.isfile(os.path.join(value, "run.json")):
            trees = str(results.get("OUTPUT", ""))
            above = [f"{trees}|layername={table}" if table else trees for table, _ in COMPANIONS["Trees"]]
            sources = [*(os.path.join(value, name) for name, _ in GROUND), *above]
            for rank, (_, title) in enumerate(GROUND):
                if os.path.isfile(sources[rank]):
                    details = QgsProcessingContext.LayerDetails(tr(title), project, tr(title))
                    _in_order(details, sources, rank - len(GROUND))
                    context.addLayerToLoadOnCompletion(sources[rank], details)


def load_again(algorithm: Any, results: dict[str, Any]) -> None:
    """Bring the results of a former run of an algorithm (of :mod:`.algorithm`) into the project, as the run did."""
    project, context, name = QgsProject.instance(), QgsProcessingContext(), tr(algorithm.LAYER_NAME)
    context.setProject(project)
    context.addLayerToLoadOnCompletion(results["OUTPUT"], QgsProcessingContext.LayerDetails(name, project, "OUTPUT"))
    load_results(results, name, context)
    load_folder(results, context)
    # QGIS' own package, which has the name of our own folder.
    importlib.import_module("processing.gui.Postprocessing").handleAlgorithmResults(algorithm, context)


def _add_companion(
    source: str, title: str, project: QgsProject | None, context: QgsProcessingContext, sources: list[str], rank: int
) -> None:
    layer = QgsVectorLayer(source, title, "ogr")
    if not layer.isValid() or layer.featureCount() == 0:
        return
    details = QgsProcessingContext.LayerDetails(title, project or context.project(), title)
    _in_order(details, sources, rank)
    context.addLayerToLoadOnCompletion(source, details)


def _in_order(details: QgsProcessingContext.LayerDetails, sources: list[str], rank: int) -> None:
    """QGIS loads by name, the last on top: stem sections would hide the trees' colours."""
    details.setPostProcessor(DefaultStyle.make(sources))
    details.forceName = True
    if hasattr(details, "layerSortKey"):  # 3.32: puts layers into the tree after they are styled
        details.layerSortKey = rank


def stack(project: QgsProject, sources: Sequence[str]) -> None:
    """Put the layers of ``sources`` (bottom first) into this order, each group of the layer tree by itself."""
    rank = {source: number for number, source in enumerate(sources)}
    groups: dict[int, tuple[QgsLayerTreeGroup, list[QgsLayerTreeNode]]] = {}
    for node in project.layerTreeRoot().findLayers():
        if node.layer() is not None and node.layer().source() in rank:
            group = node.parent()
            key = next((key for key, (known, _) in groups.items() if known == group), len(groups))
            groups.setdefault(key, (group, []))[1].append(node)
    for group, nodes in groups.values():
        wanted = sorted(nodes, key=lambda node: -rank[node.layer().source()])
        if wanted == nodes:
            continue
        # Below the topmost of them, in order; a layer stays in the project while one node shows it.
        place = group.children().index(nodes[0])
        for number, node in enumerate(wanted):
            group.insertChildNode(place + number, node.clone())
        for node in nodes:
            group.removeChildNode(node)


class DefaultStyle(QgsProcessingLayerPostProcessorInterface):
    """Gives a loaded layer the style that came in its file: Processing itself opens layers without it."""

    #: QGIS does not own post-processors; without this they are gone before they are used.
    _kept: ClassVar[list[DefaultStyle]] = []

    #: The layers it belongs to, bottom first.
    sources: tuple[str, ...] = ()

    @classmethod
    def make(cls, sources: list[str] | None = None) -> DefaultStyle:
        """A new one for each layer."""
        made = cls()
        made.sources = tuple(sources or ())
        cls._kept = [*cls._kept[-40:], made]
        return made

    def postProcessLayer(
        self, layer: QgsMapLayer, context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> None:
        """Apply the style; a pairs layer also gets its trees to snap to.

        Of layers that come together the topmost is then active: map tips and the list of stems follow it, and QGIS puts
        the next results above it.
        """
        tell_apart(layer)
        layer.loadDefaultStyle()
        if isinstance(layer, QgsVectorLayer):
            in_the_users_language(layer)
        layer.triggerRepaint()
        stack(QgsProject.instance(), self.sources)
        loaded = {known.source(): known for known in QgsProject.instance().mapLayers().values()}
        top = next((loaded[source] for source in reversed(self.sources) if source in loaded), None)
        if top is not None and qgis.utils.iface is not None:
            qgis.utils.iface.setActiveLayer(top)
        show_on_map(layer)
        if os.path.basename(layer.source()).endswith("|layername=field_trees") or layers.holds_pairs(layer):
            snap_to_trees(QgsProject.instance())


def tell_apart(layer: QgsMapLayer) -> None:
    """Where the project has that name of a layer from another file: add in brackets the folder's name, or the file's
    where the folder is the same."""

    def place(one: QgsMapLayer) -> tuple[str, str]:
        return os.path.split(one.source().partition("|")[0])

    others = [one for one in QgsProject.instance().mapLayers().values() if place(one) != place(layer)]
    alike = [place(one)[0] for one in others if one.name().partition(" (")[0] == layer.name()]
    if alike:
        folder, file = place(layer)
        layer.setName(f"{layer.name()} ({file if folder in alike else os.path.basename(folder)})")


def show_on_map(layer: QgsMapLayer) -> None:
    """Zoom the map, where there is one, to a layer of :data:`IN_VIEW` and what stands about it."""
    wanted = layer.source().partition("|layername=")[2] in IN_VIEW
    if not wanted or qgis.utils.iface is None or layer.extent().isEmpty():
        return
    canvas = qgis.utils.iface.mapCanvas()
    extent = canvas.mapSettings().layerExtentToOutputExtent(layer, layer.extent())
    canvas.setExtent(extent.buffered(0.1 * max(extent.width(), extent.height())))
    canvas.refresh()


def in_the_users_language(layer: QgsVectorLayer) -> None:
    """Translate what a style shows in English: column titles, legend, choices; map tips carry their languages."""
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
