"""Pairs of field and measured trees, with the form in which a person decides."""

from __future__ import annotations

from qgis.core import (
    QgsCategorizedSymbolRenderer,
    QgsDefaultValue,
    QgsEditorWidgetSetup,
    QgsFillSymbol,
    QgsGraduatedSymbolRenderer,
    QgsLineSymbol,
    QgsMarkerLineSymbolLayer,
    QgsProperty,
    QgsRendererCategory,
    QgsRendererRange,
    QgsSingleSymbolRenderer,
    QgsSymbolLayer,
    QgsTemplatedLineSymbolLayerBase,
    QgsVectorLayer,
)

from .common import AMBER, GREEN, GREY, RED, labels, marker, memory_layer, only_editable, said, write_on_top

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
    "meas_cm": ("double", "DBH as measured [cm]"),
    "rev_flag": ("string", "Decision"),
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
    "meas_cm": ("double", "DBH as measured [cm]"),
    "rev_flag": ("string", "Decision"),
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
#: Measured - field DBH in cm: vermilion is too thick, blue too thin; distinguished by colour-blind readers.
DELTAS = (
    (-1000, -4, "below -4 cm", "#0b3c6e"),
    (-4, -2, "-4 to -2 cm", "#4f95cf"),
    (-2, 2, "within 2 cm", "#9a9a9a"),
    (2, 4, "2 to 4 cm", "#e9a06b"),
    (4, 1000, "above 4 cm", "#b5420c"),
)


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
            f"""CASE WHEN "pair_status" = 'rejected' THEN {said("rejected")} """
            f"""WHEN "delta_cm" IS NULL THEN {said("no DBH")} """
            """ELSE if("delta_cm" > 0, '+', '') || format_number("delta_cm", 1) END""",
            "#1b1b1b",
            1000,
            middle=True,
        )
    )
    layer.setLabelsEnabled(True)
    layer.setDisplayExpression('"plot_id" || \': \' || "field_id" || \' - \' || "tree_id"')
    layer.setMapTipTemplate(
        f"""<b>[% {said("Field tree")} %] [% "field_id" %], [% {said("measured tree")} %] [% "tree_id" %]</b> """
        """([% "pair_status" %])<br>"""
        f"""[% {said("field")} %] [% coalesce(format_number("field_cm", 1), '-') %] cm, """
        f"""[% {said("measured")} %] [% coalesce(format_number("dbh_cm", 1), '-') %] cm"""
        f"""[% coalesce('<br>' || {said("distance")} || ' ' || format_number("dist_m", 2) || ' m', '') %]"""
        """[% coalesce('<br>' || "note", '') %]"""
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
    only_editable(layer, ("pair_status", "note"))
    write_on_top(layer, list(PAIRS), "Your decision", ("pair_status", "note"), "The two trees")
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
    layer.setMapTipTemplate(
        f"""[% {said("Field tree")} %] [% "field_id" %], [% {said("measured tree")} %] [% "tree_id" %]?"""
        """[% coalesce('<br>' || "note", '') %]"""
    )
    return layer


def field_trees() -> QgsVectorLayer:
    """Field trees where they stand after co-registration: squares, hollow without a partner."""
    layer = memory_layer(FIELD_TREES, "field_trees", "Point")
    looks = {
        "yes": ("paired", "#333333", "#333333"),
        "no": ("not paired", "255,255,255,0", RED),
        "check": ("plot needs a hand check", "255,255,255,0", "#6a3d9a"),
        "rejected": ("pair rejected", "255,255,255,0", GREY),
        "unsearched": ("not searched there", "255,255,255,0", AMBER),
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
        f"""<b>[% {said("Plot")} %] [% "plot_id" %]</b> ([% "status" %])<br>"""
        f"""[% {said("field trees paired")} %]: [% "n_pairs" %] / [% "n_field" %]"""
        f"""[% coalesce('<br>' || {said("moved east, north")} || ': ' || format_number("offset_e_m", 2) || ' m, ' """
        f"""|| format_number("offset_n_m", 2) || ' m; ' || {said("turned")} || ' ' || format_number("rot_deg", 1) """
        """|| '°', '') %][% coalesce('<br>' || "reason", '') %]"""
    )
    layer.setEditorWidgetSetup(
        list(PLOTS).index("status"),
        QgsEditorWidgetSetup("ValueMap", {"map": [{text: value} for value, (text, *_) in looks.items()]}),
    )
    return layer
