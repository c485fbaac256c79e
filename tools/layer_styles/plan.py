"""A flight plan: photos that point where they look, the way, footprints, plots with what they are expected to give."""

from __future__ import annotations

from qgis.core import (
    QgsCategorizedSymbolRenderer,
    QgsFillSymbol,
    QgsGraduatedSymbolRenderer,
    QgsLineSymbol,
    QgsProperty,
    QgsRendererCategory,
    QgsRendererRange,
    QgsSingleSymbolRenderer,
    QgsSymbolLayer,
    QgsVectorLayer,
)

from .common import AMBER, BLUE, GREEN, GREY, RED, labels, marker, memory_layer, said

PHOTOS = {
    "photo": ("integer", "Photo"),
    "leg": ("integer", "Line"),
    "pattern": ("string", "Pattern"),
    "yaw_deg": ("double", "Yaw, grid north [°]"),
    "yaw_true": ("double", "Yaw, true north [°]"),
    "pitch_deg": ("double", "Pitch [°]"),
    "h_m": ("double", "Height, datum of the terrain model [m]"),
    "over_m": ("double", "Height above take-off [m]"),
    "above_m": ("double", "Height above ground [m]"),
    "speed_m_s": ("double", "Speed to the next photo [m/s]"),
    "clear": ("double", "Stems it is expected to show clearly"),
    "camera": ("string", "Camera"),
    "width_px": ("integer", "Photo width [px]"),
    "height_px": ("integer", "Photo height [px]"),
    "focal_px": ("double", "Focal length [px]"),
}
PLOTS = {
    "plot_id": ("string", "Plot"),
    "radius_m": ("double", "Radius [m]"),
    "exp_stems": ("double", "Stems expected"),
    "exp_views": ("double", "Clear views a stem expected"),
    "exp_share": ("double", "Share of the stems with a DBH expected"),
    "exp_err_cm": ("double", "Standard error of DBH expected, median [cm]"),
    "n_photos": ("integer", "Photos that show it"),
}


def plan_photos() -> QgsVectorLayer:
    """Oblique photos as arrows along their yaw, photos straight down as squares."""
    layer = memory_layer(PHOTOS, "plan_photos")
    arrow = marker(name="filled_arrowhead", color=BLUE, outline_color="#ffffff", size="4", outline_width="0.2")
    # The arrowhead points right; yaw turns clockwise from the top.
    arrow.symbolLayer(0).setDataDefinedProperty(
        QgsSymbolLayer.PropertyAngle, QgsProperty.fromExpression('coalesce("yaw_deg", 0) - 90')
    )
    square = marker(name="square", color="#ffffff", outline_color=BLUE, size="2.6", outline_width="0.5")
    layer.setRenderer(
        QgsCategorizedSymbolRenderer(
            """if("pitch_deg" < -85, 'down', 'oblique')""",
            [QgsRendererCategory("oblique", arrow, "oblique"), QgsRendererCategory("down", square, "straight down")],
        )
    )
    layer.setLabeling(labels('"photo"', "#333333", 1200))
    layer.setLabelsEnabled(True)
    layer.setDisplayExpression(f"""{said("Photo")} || ' ' || "photo\"""")
    layer.setMapTipTemplate(
        f"""<b>[% {said("Photo")} %] [% "photo" %]</b><br>"""
        f"""[% {said("yaw")} %] [% round("yaw_deg") %]°, [% {said("pitch")} %] [% round("pitch_deg") %]°<br>"""
        f"""[% format_number("over_m", 1) %] m [% {said("over the take-off")} %], """
        f"""[% format_number("above_m", 1) %] m [% {said("over the ground")} %]"""
    )
    return layer


def plan_line() -> QgsVectorLayer:
    """The way, line by line."""
    layer = memory_layer({"leg": ("integer", "Line")}, "plan_line", "LineStringZ")
    layer.setRenderer(QgsSingleSymbolRenderer(QgsLineSymbol.createSimple({"color": GREY, "width": "0.4"})))
    return layer


def plan_footprints() -> QgsVectorLayer:
    """What each photo shows of the ground: nearly transparent, so that overlap shows as depth."""
    fields = {"photo": ("integer", "Photo"), "gsd_cm": ("double", "Ground sample distance in the middle [cm]")}
    layer = memory_layer(fields, "plan_footprints", "Polygon")
    style = {"color": "31,78,156,4", "outline_color": "31,78,156,45", "outline_width": "0.1"}
    layer.setRenderer(QgsSingleSymbolRenderer(QgsFillSymbol.createSimple(style)))
    layer.setDisplayExpression(f"""{said("Photo")} || ' ' || "photo\"""")
    return layer


def plan_plots() -> QgsVectorLayer:
    """Plots by the share of their stems that is expected to be measured."""
    layer = memory_layer(PLOTS, "plan_plots", "Polygon")
    ranges = [(0.0, 0.6, "below 60 %", RED), (0.6, 0.85, "60 to 85 %", AMBER), (0.85, 1.0, "85 % and more", GREEN)]
    layer.setRenderer(
        QgsGraduatedSymbolRenderer(
            "exp_share",
            [
                QgsRendererRange(
                    low, high, QgsFillSymbol.createSimple({"color": colour, "outline_color": "#333333"}), text
                )
                for low, high, text, colour in ranges
            ],
        )
    )
    layer.setOpacity(0.6)
    layer.setLabeling(labels('"plot_id"', "#1b1b1b", 5000))
    layer.setLabelsEnabled(True)
    layer.setDisplayExpression(f"""{said("Plot")} || ' ' || "plot_id\"""")
    layer.setMapTipTemplate(
        f"""<b>[% {said("Plot")} %] [% "plot_id" %]</b><br>"""
        f"""[% {said("expected")} %]: [% round(100 * "exp_share") %] %, [% format_number("exp_err_cm", 2) %] cm, """
        f"""[% format_number("exp_views", 1) %] [% {said("clear views a stem")} %]"""
    )
    return layer
