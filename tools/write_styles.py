"""Write the layers' styles (``treedgs_geo/inventory/styles/*.qml``) with PyQGIS: ``make styles``.

Run with the system's Python, which has ``qgis``. Written with QGIS 3.22, so that every later version reads them.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from qgis.core import (  # noqa: E402
    QgsApplication,
    QgsCategorizedSymbolRenderer,
    QgsEditorWidgetSetup,
    QgsMapLayer,
    QgsMarkerSymbol,
    QgsPalLayerSettings,
    QgsProperty,
    QgsRendererCategory,
    QgsSymbolLayer,
    QgsTextBufferSettings,
    QgsTextFormat,
    QgsUnitTypes,
    QgsVectorLayer,
    QgsVectorLayerSimpleLabeling,
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


def memory_layer(fields: dict[str, tuple[str, str]], name: str) -> QgsVectorLayer:
    """An empty layer with the fields and their aliases."""
    columns = "&".join(f"field={field}:{kind}" for field, (kind, _) in fields.items())
    layer = QgsVectorLayer(f"PointZ?crs=EPSG:32615&{columns}", name, "memory")
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


def labels(expression: str, colour: str, least_scale: int) -> QgsVectorLayerSimpleLabeling:
    """Labels with a white halo, from ``1:least_scale`` inwards."""
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
    )
    for layer in (trees(), stations()):
        path = STYLES / f"{layer.name()}.qml"
        message, ok = layer.saveNamedStyle(str(path), categories)
        if not ok:
            print(f"error: {path}: {message}", file=sys.stderr)
            return 1
    application.exitQgis()
    return 0


if __name__ == "__main__":
    sys.exit(main())
