"""Write the layers' styles (``treedgs_geo/inventory/styles/*.qml``) with PyQGIS: ``make styles``.

Run with the system's Python, which has ``qgis``. Written with QGIS 3.22, so that every later version reads them.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from osgeo import gdal  # noqa: E402
from qgis.core import (  # noqa: E402
    QgsApplication,
    QgsAttributeEditorContainer,
    QgsAttributeEditorField,
    QgsBilinearRasterResampler,
    QgsCategorizedSymbolRenderer,
    QgsDefaultValue,
    QgsEditFormConfig,
    QgsEditorWidgetSetup,
    QgsFillSymbol,
    QgsGraduatedSymbolRenderer,
    QgsHillshadeRenderer,
    QgsLineSymbol,
    QgsMapLayer,
    QgsMarkerLineSymbolLayer,
    QgsMarkerSymbol,
    QgsPalLayerSettings,
    QgsProperty,
    QgsRasterLayer,
    QgsRendererCategory,
    QgsRendererRange,
    QgsSingleSymbolRenderer,
    QgsSymbolLayer,
    QgsTemplatedLineSymbolLayerBase,
    QgsTextBufferSettings,
    QgsTextFormat,
    QgsUnitTypes,
    QgsVectorLayer,
    QgsVectorLayerSimpleLabeling,
    QgsWkbTypes,
)
from qgis.PyQt.QtGui import QColor, QFont  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
STYLES = ROOT / "treedgs_geo" / "inventory" / "styles"

#: field -> (type in a memory layer, alias with its unit)
TREES = {
    "tree_id": ("integer", "Tree"),
    "plot_id": ("string", "Plot"),
    "x": ("double", "Easting at breast height [m]"),
    "y": ("double", "Northing at breast height [m]"),
    "z_ground": ("double", "Ground height [m]"),
    "dbh_cm": ("double", "DBH [cm]"),
    "dbh_se_cm": ("double", "DBH standard error [cm]"),
    "dbh_lo_cm": ("double", "DBH, lower end of 90 % interval [cm]"),
    "dbh_hi_cm": ("double", "DBH, upper end of 90 % interval [cm]"),
    "bh_m": ("double", "Breast height used [m]"),
    "height_m": ("double", "Tree height [m]"),
    "ba_m2": ("double", "Basal area [m²]"),
    "lean_deg": ("double", "Lean [°]"),
    "arc_deg": ("double", "Stem circumference seen [°]"),
    "n_pts": ("integer", "Stem points"),
    "n_views": ("integer", "Photos that see the stem"),
    "n_slices": ("integer", "Slices fitted"),
    "opac_mean": ("double", "Mean opacity (0-1)"),
    "taper_cm_m": ("double", "Taper [cm/m]"),
    "method": ("string", "Method"),
    "qc_flag": ("string", "Quality"),
    "qc_reason": ("string", "Reasons"),
    "run_id": ("string", "Run"),
}
STATIONS = {
    "name": ("string", "Photo"),
    "path": ("string", "File"),
    "quality": ("string", "Position quality"),
    "sd_e_m": ("double", "Standard deviation east [m]"),
    "sd_n_m": ("double", "Standard deviation north [m]"),
    "sd_u_m": ("double", "Standard deviation up [m]"),
    "utc": ("string", "Exposure (UTC)"),
    "utc_unix": ("double", "Exposure (UTC) [s since 1970]"),
    "flight": ("integer", "Flight"),
    "yaw_deg": ("double", "Yaw [°]"),
    "pitch_deg": ("double", "Pitch [°]"),
    "roll_deg": ("double", "Roll [°]"),
    "rel_alt_m": ("double", "Height above take-off [m]"),
}
#: Also the layer of suggestions.
PAIRS = {
    "plot_id": ("string", "Plot"),
    "field_id": ("string", "Field tree"),
    "tree_id": ("integer", "Measured tree"),
    "field_cm": ("double", "Field DBH [cm]"),
    "dbh_cm": ("double", "Measured DBH [cm]"),
    "delta_cm": ("double", "Measured - field DBH [cm]"),
    "dbh_lo_cm": ("double", "DBH, lower end of 90 % interval [cm]"),
    "dbh_hi_cm": ("double", "DBH, upper end of 90 % interval [cm]"),
    "qc_flag": ("string", "Quality"),
    "dist_m": ("double", "Distance after co-registration [m]"),
    "margin": ("double", "Log-odds against the next best pairing"),
    "pair_status": ("string", "Pair status"),
    "note": ("string", "Note"),
}
FIELD_TREES = {
    "plot_id": ("string", "Plot"),
    "field_id": ("string", "Field tree"),
    "dbh_cm": ("double", "Field DBH [cm]"),
    "status": ("string", "Status"),
    "species": ("string", "Species"),
    "x": ("double", "Easting, co-registered [m]"),
    "y": ("double", "Northing, co-registered [m]"),
    "x_field": ("double", "Easting as surveyed [m]"),
    "y_field": ("double", "Northing as surveyed [m]"),
    "paired": ("string", "Paired"),
    "tree_id": ("integer", "Measured tree"),
}
MEASURED_TREES = {
    "tree_id": ("integer", "Measured tree"),
    "plot_id": ("string", "Plot"),
    "field_id": ("string", "Field tree"),
    "x": ("double", "Easting [m]"),
    "y": ("double", "Northing [m]"),
    "dbh_cm": ("double", "Measured DBH [cm]"),
    "qc_flag": ("string", "Quality"),
    "paired": ("string", "Paired"),
    "in_plot": ("string", "In the plot's circle"),
}
PLOTS = {
    "plot_id": ("string", "Plot"),
    "status": ("string", "Status"),
    "reason": ("string", "Reason"),
    "offset_e_m": ("double", "Moved east [m]"),
    "offset_n_m": ("double", "Moved north [m]"),
    "rot_deg": ("double", "Turned clockwise [°]"),
    "ratio": ("double", "Score over the next best placing"),
    "margin": ("double", "Log-likelihood over the next best placing"),
    "residual_m": ("double", "Residual of the pairs [m]"),
    "share": ("double", "Share of trees with a partner within 1 m"),
    "n_field": ("integer", "Field trees"),
    "n_measured": ("integer", "Measured trees in the circle"),
    "n_pairs": ("integer", "Pairs"),
    "n_sugg": ("integer", "Suggestions"),
    "radius_m": ("double", "Radius [m]"),
    "x": ("double", "Easting of the centre, co-registered [m]"),
    "y": ("double", "Northing of the centre, co-registered [m]"),
}
CIRCLES = {
    "tree_id": ("integer", "Tree"),
    "dbh_cm": ("double", "DBH [cm]"),
    "dbh_se_cm": ("double", "DBH standard error [cm]"),
    "qc_flag": ("string", "Quality"),
}
SLICES = {
    "tree_id": ("integer", "Tree"),
    "height_m": ("double", "Height above ground [m]"),
    "d_cm": ("double", "Diameter [cm]"),
    "rms_cm": ("double", "Roughness, rms [cm]"),
    "n_pts": ("integer", "Points"),
    "arc_deg": ("double", "Circumference seen [°]"),
}
#: Layers of stand.gpkg.
STAND_PLOTS = {
    "plot_id": ("string", "Plot"),
    "shape": ("string", "Shape"),
    "edge": ("string", "Edge of the stand"),
    "area_ha": ("double", "Area [ha]"),
    "expansion": ("double", "Trees per hectare that one tree stands for"),
    "n_trees": ("integer", "Trees"),
    "n_missing": ("integer", "Stems without a DBH"),
    "n_dead": ("integer", "Dead trees"),
    "trees_ha": ("double", "Trees per hectare"),
    "ba_m2_ha": ("double", "Basal area [m²/ha]"),
    "qmd_cm": ("double", "Quadratic mean diameter [cm]"),
    "lorey_m": ("double", "Lorey's mean height [m]"),
    "dominant_m": ("double", "Dominant height [m]"),
    "vol_m3_ha": ("double", "Volume [m³/ha]"),
    "bio_t_ha": ("double", "Biomass above ground [t/ha]"),
}
STAND_TREES = {
    "plot_id": ("string", "Plot"),
    "tree_id": ("string", "Tree"),
    "species": ("string", "Species"),
    "counts_as": ("string", "Counts as"),
    "dbh_cm": ("double", "DBH [cm]"),
    "dbh_se_cm": ("double", "DBH standard error [cm]"),
    "height_m": ("double", "Height [m]"),
    "height_src": ("string", "Height from"),
    "weight": ("double", "Weight"),
    "tph": ("double", "Trees per hectare it stands for"),
    "ba_m2": ("double", "Basal area [m²]"),
    "volume_m3": ("double", "Volume [m³]"),
    "biomass_kg": ("double", "Biomass above ground [kg]"),
    "qc_flag": ("string", "Quality"),
    "qc_reason": ("string", "Reasons"),
}
#: Measured - field DBH in cm: vermilion is too thick, blue too thin; told apart by colour-blind readers.
DELTAS = (
    (-1000, -4, "below -4 cm", "#0b3c6e"),
    (-4, -2, "-4 to -2 cm", "#4f95cf"),
    (-2, 2, "within 2 cm", "#9a9a9a"),
    (2, 4, "2 to 4 cm", "#e9a06b"),
    (4, 1000, "above 4 cm", "#b5420c"),
)
GREEN, AMBER, RED, GREY = "#2e8b3d", "#f2a10d", "#c62828", "#7a7a7a"

#: True size on the map (1 cm of DBH = 10 / scale mm), never smaller than what can be told apart on a screen.
TREE_SIZE = 'max(coalesce("dbh_cm", 0) * 10 / @map_scale, 1.4 + coalesce("dbh_cm", 15) * 0.05)'


def reasons() -> dict[str, tuple[str, str]]:
    """The one list of reasons, from the library's file (which needs nothing but Python)."""
    file = ROOT / "treedgs_geo" / "measure" / "quality.py"
    spec = importlib.util.spec_from_file_location("treedgs_quality", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.REASONS


def memory_layer(fields: dict[str, tuple[str, str]], name: str, geometry: str = "PointZ") -> QgsVectorLayer:
    """An empty layer with the fields and their aliases."""
    columns = "&".join(f"field={field}:{kind}" for field, (kind, _) in fields.items())
    layer = QgsVectorLayer(f"{geometry}?crs=EPSG:32615&{columns}", name, "memory")
    for index, (_, alias) in enumerate(fields.values()):
        layer.setFieldAlias(index, alias)
    return layer


def marker(size_property: str | None = None, **properties: str) -> QgsMarkerSymbol:
    """A simple marker, its size optionally by expression (millimetres)."""
    symbol = QgsMarkerSymbol.createSimple({"size_unit": "MM", "outline_width": "0.3", **properties})
    if size_property:
        symbol.symbolLayer(0).setDataDefinedProperty(
            QgsSymbolLayer.PropertySize, QgsProperty.fromExpression(size_property)
        )
    return symbol


def labels(expression: str, colour: str, least_scale: int, middle: bool = False) -> QgsVectorLayerSimpleLabeling:
    """Labels with a white halo, from ``1:least_scale`` inwards; ``middle``: under the middle of a line."""
    text = QgsTextFormat()
    text.setFont(QFont("Sans"))
    text.setSize(8)
    text.setSizeUnit(QgsUnitTypes.RenderPoints)
    text.setColor(QColor(colour))
    halo = QgsTextBufferSettings()
    halo.setEnabled(True)
    halo.setSize(0.7)
    halo.setColor(QColor("white"))
    text.setBuffer(halo)
    settings = QgsPalLayerSettings()
    settings.fieldName = expression
    settings.isExpression = True
    settings.placement = QgsPalLayerSettings.OrderedPositionsAroundPoint
    if middle:
        # Most lines are shorter than their label.
        settings.geometryGenerator = "centroid($geometry)"
        settings.geometryGeneratorEnabled = True
        settings.geometryGeneratorType = QgsWkbTypes.PointGeometry
        settings.placement = QgsPalLayerSettings.OverPoint
        settings.quadOffset = QgsPalLayerSettings.QuadrantBelow
        settings.yOffset = -1.6
    settings.dist = 0.6
    settings.offsetType = QgsPalLayerSettings.FromSymbolBounds
    settings.scaleVisibility = True
    settings.minimumScale = least_scale
    settings.maximumScale = 0
    settings.setFormat(text)
    return QgsVectorLayerSimpleLabeling(settings)


def reason_expression() -> str:
    """``qc_reason`` (comma-separated keys) in words, as a QGIS expression."""

    def quoted(text: str) -> str:
        return "'" + text.replace("'", "''") + "'"

    words = {key: f"{meaning}: {action}" for key, (meaning, action) in reasons().items()}
    table = ", ".join(f"{quoted(key)}, {quoted(text)}" for key, text in words.items())
    return (
        f"array_to_string(array_foreach(string_to_array(coalesce(\"qc_reason\", '')), "
        f"coalesce(map_get(map({table}), trim(@element)), trim(@element))), '<br>')"
    )


def trees() -> QgsVectorLayer:
    """Trees: size by DBH, colour by quality, hollow when rejected."""
    layer = memory_layer(TREES, "trees")
    looks = {
        "ok": ("measured", marker(TREE_SIZE, color=GREEN, outline_color="#12401a")),
        "check": ("measured, to be checked", marker(TREE_SIZE, color=AMBER, outline_color="#7a4b00")),
        "reject": (
            "seen, no DBH",
            marker("2.6", color="255,255,255,0", outline_color=RED, outline_width="0.5"),
        ),
    }
    layer.setRenderer(
        QgsCategorizedSymbolRenderer(
            "qc_flag", [QgsRendererCategory(value, symbol, text) for value, (text, symbol) in looks.items()]
        )
    )
    layer.setLabeling(labels("""CASE WHEN "dbh_cm" IS NOT NULL THEN format_number("dbh_cm", 1) END""", "#1b1b1b", 3000))
    layer.setLabelsEnabled(True)
    layer.setDisplayExpression(
        """'Tree ' || "tree_id" || coalesce(': ' || format_number("dbh_cm", 1) || ' cm', ', no DBH')"""
    )
    layer.setMapTipTemplate(
        """<b>Tree [% "tree_id" %][% coalesce(' in plot ' || "plot_id", '') %]</b><br>"""
        """[% CASE WHEN "dbh_cm" IS NULL THEN 'No DBH' ELSE 'DBH <b>' || format_number("dbh_cm", 1) || '</b>' """
        """|| coalesce(' ± ' || format_number("dbh_se_cm", 1), '') || ' cm at ' || format_number("bh_m", 2) || ' m' """
        """|| coalesce('<br>90 %: ' || format_number("dbh_lo_cm", 1) || ' to ' """
        """|| format_number("dbh_hi_cm", 1) || ' cm', '') END %]"""
        """[% coalesce('<br>height ' || format_number("height_m", 1) || ' m', '') %]"""
        """[% CASE WHEN coalesce("qc_reason", '') <> '' THEN '<br><i>' || """
        f"""{reason_expression()} || '</i>' ELSE '' END %]"""
    )
    quality = {"measured": "ok", "measured, to be checked": "check", "seen, no DBH": "reject"}
    layer.setEditorWidgetSetup(
        list(TREES).index("qc_flag"), QgsEditorWidgetSetup("ValueMap", {"map": [{k: v} for k, v in quality.items()]})
    )
    return layer


def circles() -> QgsVectorLayer:
    """Stems at true scale: a thin filled ring in the colour of the tree's quality."""
    layer = memory_layer(CIRCLES, "circles", "Polygon")
    looks = {"ok": ("measured", "46,139,61", GREEN), "check": ("measured, to be checked", "242,161,13", AMBER)}
    layer.setRenderer(
        QgsCategorizedSymbolRenderer(
            "qc_flag",
            [
                QgsRendererCategory(
                    value,
                    QgsFillSymbol.createSimple(
                        {"color": f"{fill},70", "outline_color": edge, "outline_width": "0.35"}
                    ),
                    text,
                )
                for value, (text, fill, edge) in looks.items()
            ],
        )
    )
    layer.setDisplayExpression("""'Tree ' || "tree_id" || ': ' || format_number("dbh_cm", 1) || ' cm'""")
    layer.setMapTipTemplate(
        """<b>Tree [% "tree_id" %]</b><br>DBH [% format_number("dbh_cm", 1) %]"""
        """[% coalesce(' ± ' || format_number("dbh_se_cm", 1), '') %] cm, drawn at true scale"""
    )
    return layer


def slices() -> QgsVectorLayer:
    """Measured slices of a stem: outlines from brown (foot) to yellow (4 m), shown when zoomed in."""
    layer = memory_layer(SLICES, "slices", "Polygon")
    steps = ((0, 1, "#5b2c06"), (1, 2, "#98511a"), (2, 3, "#cf8a35"), (3, 4, "#e7b85c"), (4, 5, "#f4dd9a"))
    layer.setRenderer(
        QgsGraduatedSymbolRenderer(
            "height_m",
            [
                QgsRendererRange(
                    low,
                    high,
                    QgsFillSymbol.createSimple({"style": "no", "outline_color": colour, "outline_width": "0.3"}),
                    f"{low} to {high} m above ground",
                )
                for low, high, colour in steps
            ],
        )
    )
    layer.setScaleBasedVisibility(True)
    layer.setMinimumScale(400)
    layer.setDisplayExpression("""'Tree ' || "tree_id" || ' at ' || format_number("height_m", 1) || ' m'""")
    layer.setMapTipTemplate(
        """<b>Tree [% "tree_id" %] at [% format_number("height_m", 1) %] m</b><br>"""
        """[% format_number("d_cm", 1) %] cm, [% "n_pts" %] points round [% round("arc_deg") %]° """
        """(rms [% format_number("rms_cm", 1) %] cm)"""
    )
    return layer


def stations() -> QgsVectorLayer:
    """Camera stations: a triangle that points where the camera looked, coloured by how well the place is known."""
    layer = memory_layer(STATIONS, "stations")
    looks = {
        "fix": ("fixed (centimetres)", "#1565c0"),
        "float": ("float (decimetres)", "#00a0b0"),
        "single": ("single (metres)", AMBER),
        "exif": ("from the photo (metres)", "#8e44ad"),
        "none": ("unknown", GREY),
    }
    categories = []
    for value, (text, colour) in looks.items():
        symbol = marker(name="triangle", color=colour, outline_color="#ffffff", size="3.6", outline_width="0.2")
        # The triangle points north; yaw turns clockwise from there.
        symbol.symbolLayer(0).setDataDefinedProperty(
            QgsSymbolLayer.PropertyAngle, QgsProperty.fromExpression('coalesce("yaw_deg", 0)')
        )
        categories.append(QgsRendererCategory(value, symbol, text))
    layer.setRenderer(QgsCategorizedSymbolRenderer("quality", categories))
    layer.setLabeling(labels('"name"', "#333333", 250))
    layer.setLabelsEnabled(True)
    layer.setDisplayExpression('"name"')
    layer.setMapTipTemplate(
        """<b>[% "name" %]</b><br>[% "quality" %]"""
        """[% coalesce(' ± ' || format_number(sqrt("sd_e_m"^2 + "sd_n_m"^2), 3) || ' m', '') %]<br>"""
        """yaw [% round("yaw_deg") %]°, pitch [% round("pitch_deg") %]°"""
    )
    return layer


def pairs() -> QgsVectorLayer:
    """Pairs: lines from the field tree to the measured one, coloured by the DBH difference, status editable."""
    layer = memory_layer(PAIRS, "pairs", "LineString")
    ranges = []
    for low, high, text, colour in DELTAS:
        symbol = QgsLineSymbol.createSimple({"line_color": colour, "line_width": "0.9", "capstyle": "round"})
        dot = QgsMarkerLineSymbolLayer()
        dot.setPlacement(QgsTemplatedLineSymbolLayerBase.CentralPoint)
        dot.setSubSymbol(marker(color=colour, outline_color="#ffffff", outline_width="0.2", size="3"))
        symbol.appendSymbolLayer(dot)
        # Rejected pairs stay visible, thin and dotted.
        symbol.symbolLayer(0).setDataDefinedProperty(
            QgsSymbolLayer.PropertyStrokeStyle,
            QgsProperty.fromExpression("if(\"pair_status\" = 'rejected', 'dot', 'solid')"),
        )
        ranges.append(QgsRendererRange(low, high, symbol, text))
    # A pair without a difference (no DBH on one side) is drawn as no difference; its label says so.
    layer.setRenderer(QgsGraduatedSymbolRenderer('coalesce("delta_cm", 0)', ranges))
    layer.setLabeling(
        labels(
            """CASE WHEN "pair_status" = 'rejected' THEN 'rejected' WHEN "delta_cm" IS NULL THEN 'no DBH' """
            """ELSE if("delta_cm" > 0, '+', '') || format_number("delta_cm", 1) END""",
            "#1b1b1b",
            1000,
            middle=True,
        )
    )
    layer.setLabelsEnabled(True)
    layer.setDisplayExpression('"plot_id" || \': \' || "field_id" || \' - \' || "tree_id"')
    layer.setMapTipTemplate(
        """<b>Field tree [% "field_id" %], measured tree [% "tree_id" %]</b> ([% "pair_status" %])<br>"""
        """field [% coalesce(format_number("field_cm", 1), '-') %] cm, """
        """measured [% coalesce(format_number("dbh_cm", 1), '-') %] cm<br>"""
        """[% format_number("dist_m", 2) %] m apart[% coalesce('<br>' || "note", '') %]"""
    )
    # A line that is drawn, or whose end is dragged to another tree, is a person's decision.
    layer.setDefaultValueDefinition(
        list(PAIRS).index("pair_status"),
        QgsDefaultValue(
            """CASE WHEN "pair_status" IS NULL THEN 'moved' """
            """WHEN "pair_status" = 'auto' AND abs(length($geometry) - coalesce("dist_m", -1)) > 0.02 THEN 'moved' """
            """ELSE "pair_status" END""",
            True,
        ),
    )
    form = layer.editFormConfig()
    for index, name in enumerate(PAIRS):
        form.setReadOnly(index, name not in ("pair_status", "note"))
    # What a person decides stands on top.
    form.setLayout(QgsEditFormConfig.TabLayout)
    form.clearTabs()
    for title, names in (
        ("Your decision", ("pair_status", "note")),
        ("The two trees", [name for name in PAIRS if name not in ("pair_status", "note")]),
    ):
        box = QgsAttributeEditorContainer(title, form.invisibleRootContainer())
        box.setIsGroupBox(True)
        for name in names:
            box.addChildElement(QgsAttributeEditorField(name, list(PAIRS).index(name), box))
        form.addTab(box)
    layer.setEditFormConfig(form)
    layer.setEditorWidgetSetup(
        list(PAIRS).index("note"), QgsEditorWidgetSetup("TextEdit", {"IsMultiline": True, "UseHtml": False})
    )
    words = {"automatic": "auto", "confirmed": "ok", "moved by hand": "moved", "rejected": "rejected"}
    layer.setEditorWidgetSetup(
        list(PAIRS).index("pair_status"),
        QgsEditorWidgetSetup("ValueMap", {"map": [{k: v} for k, v in words.items()]}),
    )
    return layer


def suggested() -> QgsVectorLayer:
    """Suggestions that were left to a person: dashed."""
    layer = memory_layer(PAIRS, "suggested", "LineString")
    symbol = QgsLineSymbol.createSimple({"line_color": "#6a3d9a", "line_width": "0.6", "line_style": "dash"})
    layer.setRenderer(QgsSingleSymbolRenderer(symbol))
    layer.setDisplayExpression('"plot_id" || \': \' || "field_id" || \' - \' || "tree_id"')
    layer.setMapTipTemplate("""Field tree [% "field_id" %], measured tree [% "tree_id" %]?<br>[% "note" %]""")
    return layer


def field_trees() -> QgsVectorLayer:
    """Field trees where they stand after co-registration: squares, hollow without a partner."""
    layer = memory_layer(FIELD_TREES, "field_trees", "Point")
    looks = {
        "yes": ("paired", "#333333", "#333333"),
        "no": ("not paired", "255,255,255,0", RED),
        "check": ("plot needs a hand check", "255,255,255,0", "#6a3d9a"),
        "rejected": ("pair rejected", "255,255,255,0", GREY),
    }
    layer.setRenderer(
        QgsCategorizedSymbolRenderer(
            "paired",
            [
                QgsRendererCategory(
                    value, marker(name="square", color=fill, outline_color=edge, outline_width="0.5", size="2.2"), text
                )
                for value, (text, fill, edge) in looks.items()
            ],
        )
    )
    layer.setLabeling(labels('"field_id"', "#333333", 500))
    layer.setLabelsEnabled(True)
    layer.setDisplayExpression('"plot_id" || \': \' || "field_id"')
    return layer


def measured_trees() -> QgsVectorLayer:
    """Measured trees: discs, hollow without a partner."""
    layer = memory_layer(MEASURED_TREES, "measured_trees", "PointZ")
    looks = {"yes": ("paired", GREEN, "#12401a"), "no": ("not paired", "255,255,255,0", AMBER)}
    layer.setRenderer(
        QgsCategorizedSymbolRenderer(
            "paired",
            [
                QgsRendererCategory(
                    value, marker(color=fill, outline_color=edge, outline_width="0.5", size="2.4"), text
                )
                for value, (text, fill, edge) in looks.items()
            ],
        )
    )
    layer.setDisplayExpression('"tree_id"')
    return layer


def plots() -> QgsVectorLayer:
    """Plot circles at their co-registered centres; those left to a person stand out."""
    layer = memory_layer(PLOTS, "plots", "Polygon")
    looks = {
        "auto": ("placed", "#555555", "0.4"),
        "ok": ("confirmed by hand", GREEN, "0.6"),
        "check": ("needs a hand check", "#6a3d9a", "0.9"),
    }
    layer.setRenderer(
        QgsCategorizedSymbolRenderer(
            "status",
            [
                QgsRendererCategory(
                    value,
                    QgsFillSymbol.createSimple({"style": "no", "outline_color": colour, "outline_width": width}),
                    text,
                )
                for value, (text, colour, width) in looks.items()
            ],
        )
    )
    layer.setDisplayExpression('"plot_id"')
    layer.setMapTipTemplate(
        """<b>Plot [% "plot_id" %]</b> ([% "status" %])<br>[% "n_pairs" %] of [% "n_field" %] field trees paired<br>"""
        """moved [% format_number("offset_e_m", 2) %] m east, [% format_number("offset_n_m", 2) %] m north, """
        """turned [% format_number("rot_deg", 1) %]°[% coalesce('<br>' || "reason", '') %]"""
    )
    layer.setEditorWidgetSetup(
        list(PLOTS).index("status"),
        QgsEditorWidgetSetup("ValueMap", {"map": [{text: value} for value, (text, *_) in looks.items()]}),
    )
    return layer


def stand_plots() -> QgsVectorLayer:
    """Plots of a stand table: outline and basal area."""
    layer = memory_layer(STAND_PLOTS, "stand_plots", "Polygon")
    layer.setRenderer(
        QgsSingleSymbolRenderer(
            QgsFillSymbol.createSimple({"color": "23,117,60,25", "outline_color": "#17753c", "outline_width": "0.6"})
        )
    )
    expression = """"plot_id" || '\\n' || coalesce(format_number("ba_m2_ha", 1) || ' m²/ha', '')"""
    layer.setLabeling(labels(expression, "#12401a", 20000, middle=True))
    layer.setLabelsEnabled(False)
    layer.setDisplayExpression('"plot_id"')
    layer.setMapTipTemplate(
        """<b>Plot [% "plot_id" %]</b> ([% "shape" %], [% format_number("area_ha", 4) %] ha)<br>"""
        """[% "n_trees" %] trees, [% "n_missing" %] without a DBH<br>[% format_number("trees_ha", 0) %] trees/ha, """
        """[% coalesce(format_number("ba_m2_ha", 1) || ' m²/ha', '') %]"""
        """[% coalesce(', ' || format_number("vol_m3_ha", 0) || ' m³/ha', '') %]<br>[% "edge" %]"""
    )
    return layer


def stand_trees() -> QgsVectorLayer:
    """Trees of a stand table: what each counts as."""
    layer = memory_layer(STAND_TREES, "stand_trees", "Point")
    looks = {
        "measured": ("measured", GREEN, "#12401a"),
        "missing": ("no DBH", "255,255,255,0", RED),
        "small": ("too small", "255,255,255,0", GREY),
        "dead": ("dead", GREY, "#333333"),
    }
    layer.setRenderer(
        QgsCategorizedSymbolRenderer(
            "counts_as",
            [
                QgsRendererCategory(
                    value, marker(TREE_SIZE, color=fill, outline_color=edge, outline_width="0.4"), text
                )
                for value, (text, fill, edge) in looks.items()
            ],
        )
    )
    layer.setDisplayExpression("""'Tree ' || "tree_id" || coalesce(': ' || format_number("dbh_cm", 1) || ' cm', '')""")
    layer.setMapTipTemplate(
        """<b>Tree [% "tree_id" %] in plot [% "plot_id" %]</b> [% coalesce("species", '') %]<br>"""
        """DBH [% coalesce(format_number("dbh_cm", 1), '-') %] cm, """
        """height [% coalesce(format_number("height_m", 1), '-') %] m"""
        """[% coalesce(' (' || "height_src" || ')', '') %]<br>counts as [% coalesce("counts_as", 'nothing') %], """
        """[% format_number("tph", 1) %] trees/ha"""
    )
    return layer


def terrain(folder: Path) -> None:
    """The terrain raster as a hillshade."""
    driver = gdal.GetDriverByName("GTiff")
    raster = driver.Create("/vsimem/dtm.tif", 8, 8, 1, gdal.GDT_Float32)
    raster.SetGeoTransform([500000, 1, 0, 4000000, 0, -1])
    raster.FlushCache()
    layer = QgsRasterLayer("/vsimem/dtm.tif", "dtm", "gdal")
    renderer = QgsHillshadeRenderer(layer.dataProvider(), 1, 315, 45)
    renderer.setMultiDirectional(True)
    renderer.setZFactor(1.0)
    layer.setRenderer(renderer)
    layer.resampleFilter().setZoomedInResampler(QgsBilinearRasterResampler())
    message, ok = layer.saveNamedStyle(str(folder / "dtm.qml"), QgsMapLayer.Symbology)
    if not ok:
        raise RuntimeError(message)


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
        trees, circles, slices, stations, pairs, suggested, field_trees, measured_trees, plots,
        stand_plots, stand_trees,
    )  # fmt: skip
    for layer in (make() for make in made):
        path = STYLES / f"{layer.name()}.qml"
        message, ok = layer.saveNamedStyle(str(path), categories)
        if not ok:
            print(f"error: {path}: {message}", file=sys.stderr)
            return 1
    terrain(STYLES)
    application.exitQgis()
    return 0


if __name__ == "__main__":
    sys.exit(main())
