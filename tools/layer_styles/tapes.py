"""Trees to tape, with the form in which the crew's values are typed, and what the tapes said of them."""

from __future__ import annotations

from qgis.core import (
    QgsCategorizedSymbolRenderer,
    QgsEditorWidgetSetup,
    QgsGraduatedSymbolRenderer,
    QgsRendererCategory,
    QgsRendererRange,
    QgsVectorLayer,
)

from .common import GREEN, GREY, RED, SKY, begin_with, labels, marker, memory_layer, only_editable, said, write_on_top
from .pairs import DELTAS

TAPES = {
    "walk": ("integer", "Place in the walk"),
    "tree_id": ("integer", "Tree"),
    "plot_id": ("string", "Plot"),
    "taped_cm": ("double", "Taped DBH [cm]"),
    "second_taped_cm": ("double", "Second tape [cm]"),
    "state": ("string", "State"),
    "tape_note": ("string", "Note"),
    "near_id": ("integer", "Drawn tree beside it"),
    "about_cm": ("double", "Measured DBH, about [cm]"),
    "qc_flag": ("string", "Quality"),
    "azim_deg": ("double", "Bearing from the centre [°]"),
    "dist_m": ("double", "Distance from the centre [m]"),
    "x": ("double", "Easting [m]"),
    "y": ("double", "Northing [m]"),
    "lon": ("double", "Longitude [°]"),
    "lat": ("double", "Latitude [°]"),
    "dbh_cm": ("double", "Measured DBH [cm]"),
    "stratum": ("string", "Stratum"),
    "prob": ("double", "Chance of being drawn"),
    "n_frame": ("integer", "Trees that were drawn from"),
    "design": ("string", "Design"),
    "frame": ("string", "Mark of the list"),
}
TAPE_CHECK = {
    "tree_id": ("integer", "Tree"),
    "plot_id": ("string", "Plot"),
    "qc_flag": ("string", "Quality"),
    "dbh_cm": ("double", "Measured DBH [cm]"),
    "dbh_lo_cm": ("double", "DBH, lower end of 90 % interval [cm]"),
    "dbh_hi_cm": ("double", "DBH, upper end of 90 % interval [cm]"),
    "taped_cm": ("double", "Taped DBH [cm]"),
    "error_cm": ("double", "Measured - taped DBH [cm]"),
    "inside": ("string", "Tape inside the interval"),
    "state": ("string", "State"),
    "outlier": ("string", "Look again"),
    "note": ("string", "Note"),
    "x": ("double", "Easting [m]"),
    "y": ("double", "Northing [m]"),
}
#: Stored value -> word in the form.
STATES = {"": "", "taped": "taped", "none": "none (no tree there)", "dead": "dead", "not reached": "not reached"}


def tapes() -> QgsVectorLayer:
    """Trees to tape: open ones sky blue, filled-in ones green, as diamonds, which the measured trees below are not; the
    crew's fields on top of the form."""
    layer = memory_layer(TAPES, "tapes", "Point")
    look = {"name": "diamond", "outline_width": "0.5", "size": "4.6"}
    looks = {
        "open": ("to tape", SKY, "#0b3c5d"),
        "taped": ("taped", GREEN, "#12401a"),
        "none": ("no tree there", "255,255,255,0", RED),
        "dead": ("dead", GREY, "#333333"),
        "not reached": ("not reached", "255,255,255,0", GREY),
    }
    layer.setRenderer(
        QgsCategorizedSymbolRenderer(
            """CASE WHEN coalesce("state", '') <> '' THEN "state" WHEN "taped_cm" > 0 THEN 'taped' ELSE 'open' END""",
            [
                QgsRendererCategory(value, marker(**look, color=fill, outline_color=edge), text)
                for value, (text, fill, edge) in looks.items()
            ],
        )
    )
    layer.setLabeling(labels('"tree_id"', "#0b3c5d", 2500))
    layer.setLabelsEnabled(True)
    layer.setDisplayExpression(f"""{said("Tree")} || ' ' || coalesce("tree_id", '-')""")
    layer.setMapTipTemplate(
        f"""<b>[% {said("Tree")} %] [% coalesce("tree_id", '-') %]"""
        f"""[% coalesce(', ' || {said("plot")} || ' ' || "plot_id", '') %]</b><br>"""
        f"""[% {said("taped")} %] [% coalesce(format_number("taped_cm", 1), '-') %] cm"""
        """[% coalesce('<br>' || "tape_note", '') %]"""
    )
    layer.setEditorWidgetSetup(
        list(TAPES).index("state"),
        QgsEditorWidgetSetup("ValueMap", {"map": [{text: value} for value, text in STATES.items()]}),
    )
    crew = ("taped_cm", "second_taped_cm", "state", "tape_note")
    begin_with(layer, ("walk", "plot_id", "tree_id", *crew), "walk")
    # Of a tree that the map lacks the crew says the plot, or the drawn tree beside it.
    only_editable(layer, (*crew, "plot_id", "near_id"))
    write_on_top(layer, list(TAPES), "Filled in by the crew", crew, "Drawn tree")
    return layer


def tape_check() -> QgsVectorLayer:
    """Taped trees by their error."""
    layer = memory_layer(TAPE_CHECK, "tape_check", "Point")
    layer.setRenderer(
        QgsGraduatedSymbolRenderer(
            "error_cm",
            [
                QgsRendererRange(low, high, marker(color=colour, outline_color="#333333", size="3.6"), text)
                for low, high, text, colour in DELTAS
            ],
        )
    )
    layer.setLabeling(labels("""if("error_cm" > 0, '+', '') || format_number("error_cm", 1)""", "#1b1b1b", 2500))
    layer.setLabelsEnabled(True)
    layer.setDisplayExpression(f"""{said("Tree")} || ' ' || "tree_id\"""")
    layer.setMapTipTemplate(
        f"""<b>[% {said("Tree")} %] [% "tree_id" %]</b><br>"""
        f"""[% {said("measured")} %] [% coalesce(format_number("dbh_cm", 1), '-') %] cm, """
        f"""[% {said("taped")} %] [% coalesce(format_number("taped_cm", 1), '-') %] cm"""
        """[% coalesce('<br>' || "outlier", '') %][% coalesce('<br>' || "note", '') %]"""
    )
    return layer
