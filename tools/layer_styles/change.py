"""Two dates: what became of each tree."""

from __future__ import annotations

from qgis.core import QgsCategorizedSymbolRenderer, QgsRendererCategory, QgsVectorLayer

from .common import GREY, labels, marker, memory_layer, said

CHANGE = {
    "plot_id": ("string", "Plot"),
    "before_id": ("integer", "Number at the first date"),
    "after_id": ("integer", "Number at the second date"),
    "fate": ("string", "Fate"),
    "dbh1_cm": ("double", "DBH at the first date [cm]"),
    "dbh2_cm": ("double", "DBH at the second date [cm]"),
    "growth_cm": ("double", "Growth [cm]"),
    "growth_se": ("double", "Growth, standard error [cm]"),
    "grow_lo": ("double", "Growth, lower end of the interval [cm]"),
    "grow_hi": ("double", "Growth, upper end of the interval [cm]"),
    "grow_cm_a": ("double", "Growth [cm a year]"),
    "ba_growth": ("double", "Growth of basal area [m²]"),
    "dist_m": ("double", "Distance after co-registration [m]"),
    "x": ("double", "Easting [m]"),
    "y": ("double", "Northing [m]"),
}
#: Fate -> legend, fill, outline; distinguished by colour-blind readers.
LOOKS = {
    "survivor": ("survivor", "#0072b2", "#00334f"),
    "ingrowth": ("ingrowth", "#009e73", "#00402e"),
    "mortality": ("mortality", "#d55e00", "#5c2900"),
    "missed before": ("missed before", "#56b4e9", "#1f5a80"),
    "no growth": ("no growth known", "255,255,255,0", "#0072b2"),
    "unsure": ("unsure", "255,255,255,0", "#cc79a7"),
    "small": ("too small", "255,255,255,0", GREY),
    "dead": ("dead", GREY, "#333333"),
}


def change() -> QgsVectorLayer:
    """Trees of both dates by their fate, labelled with their growth."""
    layer = memory_layer(CHANGE, "change", "Point")
    layer.setRenderer(
        QgsCategorizedSymbolRenderer(
            "fate",
            [
                QgsRendererCategory(
                    value, marker(color=fill, outline_color=edge, outline_width="0.4", size="3.4"), text
                )
                for value, (text, fill, edge) in LOOKS.items()
            ],
        )
    )
    layer.setLabeling(labels("""if("growth_cm" > 0, '+', '') || format_number("growth_cm", 1)""", "#1b1b1b", 1500))
    layer.setLabelsEnabled(True)
    layer.setDisplayExpression(f"""{said("Tree")} || ' ' || coalesce("after_id", "before_id")""")
    layer.setMapTipTemplate(
        f"""<b>[% {said("Tree")} %] [% coalesce("after_id", "before_id") %]</b> ([% "fate" %])<br>"""
        """[% coalesce(format_number("dbh1_cm", 1), '-') %] cm → [% coalesce(format_number("dbh2_cm", 1), '-') %] cm"""
        f"""[% coalesce('<br>' || {said("growth")} || ' ' || format_number("growth_cm", 1) || ' cm (' || """
        """format_number("grow_lo", 1) || ' – ' || format_number("grow_hi", 1) || ')', '') %]"""
    )
    return layer
