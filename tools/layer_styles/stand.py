"""Plots and trees of a stand table."""

from __future__ import annotations

from qgis.core import (
    QgsCategorizedSymbolRenderer,
    QgsFillSymbol,
    QgsRendererCategory,
    QgsSingleSymbolRenderer,
    QgsVectorLayer,
)

from .common import GREEN, GREY, RED, TREE_SIZE, labels, marker, memory_layer, said

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
    "note": ("string", "Note"),
}


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
        f"""<b>[% {said("Plot")} %] [% "plot_id" %]</b> ([% "shape" %], [% format_number("area_ha", 4) %] ha)<br>"""
        f"""[% "n_trees" %] [% {said("trees")} %], [% "n_missing" %] [% {said("without a DBH")} %]<br>"""
        f"""[% format_number("trees_ha", 0) %] [% {said("trees/ha")} %], """
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
                QgsRendererCategory(value, marker(TREE_SIZE, color=fill, outline_color=edge, outline_width="0.4"), text)
                for value, (text, fill, edge) in looks.items()
            ],
        )
    )
    layer.setDisplayExpression(
        f"""{said("Tree")} || ' ' || "tree_id" || coalesce(': ' || format_number("dbh_cm", 1) || ' cm', '')"""
    )
    layer.setMapTipTemplate(
        f"""<b>[% {said("Tree")} %] [% "tree_id" %]"""
        f"""[% coalesce(', ' || {said("plot")} || ' ' || "plot_id", '') %]</b> """
        """[% coalesce("species", '') %]<br>"""
        f"""[% {said("DBH")} %] [% coalesce(format_number("dbh_cm", 1), '-') %] cm, """
        f"""[% {said("height")} %] [% coalesce(format_number("height_m", 1), '-') %] m"""
        f"""[% coalesce(' (' || "height_src" || ')', '') %]<br>"""
        f"""[% {said("counts as")} %] [% coalesce("counts_as", '-') %]"""
        f"""[% coalesce(', ' || format_number("tph", 1) || ' ' || {said("trees/ha")}, '') %]"""
    )
    return layer
