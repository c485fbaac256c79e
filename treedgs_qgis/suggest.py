"""What the project already says of an algorithm's inputs: its dialog opens with that filled in."""

from __future__ import annotations

import os
from typing import Any

from qgis.core import QgsMapLayer, QgsProject, QgsVectorLayer
from qgis.PyQt.QtCore import QUrl

from .review.measuring import parameters_of, workspace_of
from .review.rules import Refused
from .review.trees import TreeLayer, tree_layers

#: Algorithm that begins with a layer of plots, of trees, or of trees at two dates -> its result, beside that layer.
RESULTS = {
    "planflight": "plan",
    "tapesample": "tapes",
    "tapecheck": "tape_check",
    "trial": "trial",
    "standtable": "stand",
    "matchplots": "pairs.gpkg",
    "compare": "change",
}


def values(algorithm: str, active: QgsMapLayer | None) -> dict[str, Any]:
    """Parameters by name: the tree layer, or both dates', or the last one of a stand to fly over; the plots of its run
    or of the project; the tapes that were filled in; where results go. Empty for other algorithms, and where it is not
    clear which layer is meant.

    active: the layer that is active in the project.
    """
    if algorithm not in RESULTS:
        return {}
    trees, everything = sorted(tree_layers(), key=flown), QgsProject.instance().mapLayers().values()
    plots = next(filter(is_of_plots, everything), None)
    found: dict[str, Any] = {}
    if algorithm == "planflight" and plots is not None:
        found["STAND"] = trees[-1] if trees else None
        found["PLOTS"] = plots
    elif algorithm == "compare" and len(trees) == 2:
        found["BEFORE"], found["AFTER"] = trees
    elif algorithm not in ("planflight", "compare") and (active in trees or len(trees) == 1):
        found["TREES"] = active if active in trees else trees[0]
    else:
        return {}
    layer = list(found.values())[-1]
    path = QUrl(layer.source()).toLocalFile() if layer.providerType() == "delimitedtext" else TreeLayer(layer).path()
    if os.path.isfile(path):
        found["OUTPUT"] = os.path.join(os.path.dirname(path), RESULTS[algorithm])
    found["PLOTS"] = plots_of_run(TreeLayer(layer)) or plots
    if algorithm in ("tapecheck", "standtable"):
        found["TAPED"] = next(filter(has_tapes, everything), None)
    return found


def plots_of_run(trees: TreeLayer) -> str:
    """The file of plots that a tree layer was measured with, or ''."""
    try:
        plots = parameters_of(workspace_of(trees)).get("PLOTS", "") if workspace_of(trees) else ""
    except Refused:
        return ""
    return plots if os.path.isfile(plots) else ""


def is_of_plots(layer: QgsMapLayer) -> bool:
    """A layer of plots that somebody gave; not one of ours, which say where was searched."""
    names = {field.name() for field in layer.fields()} if isinstance(layer, QgsVectorLayer) else set()
    return {"plot_id", "radius_m"} <= names and "|layername=" not in layer.source()


def flown(layer: QgsVectorLayer) -> str:
    """The day of a tree layer's photos or points, from the table beside it; '' where it is not known."""
    searched = QgsVectorLayer(f"{TreeLayer(layer).path()}|layername=searched", "searched", "ogr")
    days = [str(feature["flown"] or "") for feature in searched.getFeatures()] if searched.isValid() else []
    return max(days, default="")


def has_tapes(layer: QgsMapLayer) -> bool:
    """A layer of drawn trees of which at least one was taped."""
    names = [field.name() for field in layer.fields()] if isinstance(layer, QgsVectorLayer) else []
    if not {"taped_cm", "prob"}.issubset(names):
        return False
    return any(layer.uniqueValues(names.index("taped_cm"), 2))
