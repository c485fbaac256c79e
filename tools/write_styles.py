"""Write the layers' styles (``treedgs_geo/core/styles/*.qml``) with PyQGIS: ``make styles``.

Run with the system's Python, which has ``qgis``. Written with QGIS 3.22, so that every later version reads them.
"""

from __future__ import annotations

import os
import sys

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
# The order of XML attributes follows Qt's hash: without a fixed seed every run writes other files.
os.environ["QT_HASH_SEED"] = "0"

from layer_styles import change, flight, pairs, plan, stand, tapes, trees
from layer_styles.common import ROOT, show_texts_as_text
from qgis.core import QgsApplication, QgsMapLayer

STYLES = ROOT / "treedgs_geo" / "core" / "styles"


def main() -> int:
    """Write every style."""
    application = QgsApplication([], False)
    application.initQgis()
    STYLES.mkdir(parents=True, exist_ok=True)
    categories = (
        QgsMapLayer.Symbology
        | QgsMapLayer.Labeling
        | QgsMapLayer.MapTips
        | QgsMapLayer.Fields
        | QgsMapLayer.Forms
        | QgsMapLayer.AttributeTable
        | QgsMapLayer.LayerConfiguration
        | QgsMapLayer.Rendering
    )
    made = (
        trees.trees, trees.circles, trees.sections, trees.searched, trees.crowns, flight.stations, pairs.pairs,
        pairs.suggested, pairs.field_trees, pairs.measured_trees, pairs.plots, stand.stand_plots, stand.stand_trees,
        tapes.tapes, tapes.tape_check, change.change, plan.plan_photos, plan.plan_line, plan.plan_footprints,
        plan.plan_plots,
    )  # fmt: skip
    for layer in (make() for make in made):
        show_texts_as_text(layer)
        path = STYLES / f"{layer.name()}.qml"
        more = QgsMapLayer.Symbology3D if layer.renderer3D() else categories
        message, ok = layer.saveNamedStyle(str(path), categories | more)
        if not ok:
            print(f"error: {path}: {message}", file=sys.stderr)
            return 1
    flight.terrain(STYLES)
    flight.canopy(STYLES)
    application.exitQgis()
    return 0


if __name__ == "__main__":
    sys.exit(main())
