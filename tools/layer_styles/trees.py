"""Trees, their circles at true scale, and the sections of a cloud's stems."""

from __future__ import annotations

import importlib.util

from qgis._3d import Qgs3DTypes, QgsPhongMaterialSettings, QgsPolygon3DSymbol, QgsRuleBased3DRenderer
from qgis.core import (
    QgsAbstract3DSymbol,
    QgsCategorizedSymbolRenderer,
    QgsEditorWidgetSetup,
    QgsFillSymbol,
    QgsGraduatedSymbolRenderer,
    QgsPalLayerSettings,
    QgsProperty,
    QgsPropertyCollection,
    QgsRendererCategory,
    QgsRendererRange,
    QgsSingleSymbolRenderer,
    QgsSymbol,
    QgsSymbolLayer,
    QgsSymbolLayerUtils,
    QgsVectorLayer,
    QgsVectorLayerSimpleLabeling,
)
from qgis.PyQt.QtGui import QColor

from .common import (
    AMBER,
    BLUE,
    GREEN,
    GREY,
    LANGUAGES,
    RED,
    ROOT,
    TREE_SIZE,
    begin_with,
    cased,
    file_url,
    in_language,
    labels,
    marker,
    memory_layer,
    quoted,
    said,
    translations,
    write_on_top,
)

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
    "height_se_m": ("double", "Tree height, standard error [m]"),
    "height_why": ("string", "Why there is no height"),
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
    "species": ("string", "Species"),
    "status": ("string", "Live or dead"),
    "note": ("string", "Note"),
    "rev_flag": ("string", "Decision"),
    "rev_dbh_cm": ("double", "Taped DBH [cm]"),
    "rev_note": ("string", "Why"),
    "rev_by": ("string", "Decided by"),
    "rev_at": ("string", "Decided at (UTC)"),
}
#: Folder of the evidence sheets from the layer on: ``treedgs_geo.inventory.tree_layer.SHEETS_FOLDER``, which is
#: replaced when a layer is written; and how wide a sheet is shown, pixels.
SHEETS_FOLDER, SHEET_WIDTH = "folder-of-the-sheets", 500
#: What a person writes; the rest is measured.
WRITTEN = ("rev_flag", "rev_dbh_cm", "rev_note", "rev_by", "rev_at", "species", "status", "note")
#: decision -> how the form says it; the keys are those of treedgs_geo/inventory/reviewed.py
DECISIONS = {
    "accept": "accepted",
    "reject": "no tree stands here",
    "dbh": "taped",
    "merge": "the same tree as another",
    "stem": "a stem stands here, DBH unknown",
}
#: The DBH that counts, as an expression: a person's before the measured one.
COUNTED = """CASE WHEN "rev_flag" IN ('reject', 'merge', 'stem') THEN NULL ELSE coalesce("rev_dbh_cm", "dbh_cm") END"""
COUNTED_SIZE = TREE_SIZE.replace('"dbh_cm"', 'coalesce("rev_dbh_cm", "dbh_cm")')


def one(expression: str) -> str:
    """A number with one decimal, rounded as panel, sheets and pages do it (``treedgs_geo.core.shown``)."""
    return f"format_number(round({expression}, 1), 1)"


#: Columns that the attribute table begins with.
FIRST_COLUMNS = ("tree_id", "plot_id", "dbh_cm", "dbh_se_cm", "height_m", "qc_flag", "qc_reason", "species", "status")
#: Trees outside the plots, where there are plots, are pale: white, edged in the colour of their quality, and of this
#: opacity, per cent.
OUTSIDE = """(coalesce("plot_id", '') = '' AND coalesce(maximum("plot_id"), '') <> '')"""
PALE_PCT = 65
#: How a tree is drawn: by its quality, or by what a person decided.
DRAWN_AS = (
    """CASE WHEN "rev_flag" IN ('reject', 'merge') THEN 'out' WHEN "rev_dbh_cm" IS NOT NULL THEN 'decided' """
    """WHEN "rev_flag" = 'accept' AND "dbh_cm" IS NOT NULL THEN 'decided' """
    """WHEN "rev_flag" IN ('accept', 'stem') THEN 'stem' ELSE "qc_flag" END"""
)
CIRCLES = {
    "tree_id": ("integer", "Tree"),
    "dbh_cm": ("double", "DBH [cm]"),
    "dbh_se_cm": ("double", "DBH standard error [cm]"),
    "qc_flag": ("string", "Quality"),
    "height_m": ("double", "Tree height [m]"),
}
CROWNS = {
    "tree_id": ("integer", "Tree"),
    "crown_m2": ("double", "Crown area [m²]"),
    "height_m": ("double", "Tree height [m]"),
    "qc_flag": ("string", "Quality"),
}
SEARCHED = {
    "plot_id": ("string", "Plot"),
    "x": ("double", "Easting of the middle [m]"),
    "y": ("double", "Northing of the middle [m]"),
    "radius_m": ("double", "Radius [m]"),
    "area_m2": ("double", "Area searched [m²]"),
    "share": ("double", "Share of the plot searched"),
    "flown": ("string", "Day of the photos or points"),
}
SECTIONS = {
    "tree_id": ("integer", "Tree"),
    "height_m": ("double", "Height above ground [m]"),
    "d_cm": ("double", "Diameter [cm]"),
    "d_se_cm": ("double", "Diameter standard error [cm]"),
    "rms_cm": ("double", "Roughness, rms [cm]"),
    "n_pts": ("integer", "Points"),
    "arc_deg": ("double", "Circumference seen [°]"),
}


def reasons() -> dict[str, tuple[str, str]]:
    """The one list of reasons, from the library's file (which needs nothing but Python)."""
    file = ROOT / "treedgs_geo" / "stems" / "quality" / "reasons.py"
    spec = importlib.util.spec_from_file_location("treedgs_reasons", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.REASONS


def reason_expression() -> str:
    """``qc_reason`` (comma-separated keys) in words, as a QGIS expression."""

    def table(known: dict[str, str]) -> str:
        pairs = (
            f"{quoted(key)}, {quoted(f'{known.get(meaning) or meaning}: {known.get(action) or action}')}"
            for key, (meaning, action) in reasons().items()
        )
        return f"map({', '.join(pairs)})"

    tables = {"en": table({}), **{language: table(translations(language)) for language in LANGUAGES}}
    return (
        f"array_to_string(array_foreach(string_to_array(coalesce(\"qc_reason\", '')), "
        f"coalesce(map_get({in_language(tables)}, trim(@element)), trim(@element))), '<br>')"
    )


def sheet_tip() -> str:
    """The evidence sheet of the tree, where it lies: ``SHEETS/RUN_ID/TREE_ID.jpg``."""
    path = (
        f"file_path(decode_uri(@layer_id, 'path')) || '/' || {quoted(SHEETS_FOLDER)} || '/' || \"run_id\" || '/' || "
        "\"tree_id\" || '.jpg'"
    )
    picture = f"""'<br><img width="{SHEET_WIDTH}" src="' || {file_url("@sheet")} || '">'"""
    shown = f"CASE WHEN file_exists(@sheet) THEN {picture} ELSE '' END"
    return f"[% coalesce(with_variable('sheet', {path}, {shown}), '') %]"


def pale_outside(symbol: QgsSymbol) -> None:
    """Let a tree outside the plots be pale; a dark edge, as filled ones have it, takes the fill's colour there."""
    layer = symbol.symbolLayer(0)
    filled, edge = layer.fillColor(), layer.strokeColor()
    pale_edge = filled if filled.alpha() and edge.lightness() < 80 and edge.name() != BLUE else edge
    for target, where, pale, usual in (
        (layer, QgsSymbolLayer.PropertyFillColor, "'#ffffff'", quoted(QgsSymbolLayerUtils.encodeColor(filled))),
        (layer, QgsSymbolLayer.PropertyStrokeColor, quoted(pale_edge.name()), quoted(edge.name())),
        (symbol, QgsSymbol.PropertyOpacity, PALE_PCT, 100),
    ):
        target.setDataDefinedProperty(where, QgsProperty.fromExpression(f"if({OUTSIDE}, {pale}, {usual})"))


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
        "decided": (
            "by hand: accepted, taped",
            marker(COUNTED_SIZE, color=GREEN, outline_color=BLUE, outline_width="0.7"),
        ),
        "stem": (
            "by hand: no DBH",
            marker("2.6", color="255,255,255,0", outline_color=BLUE, outline_width="0.7"),
        ),
        "out": ("by hand: no tree", cased(marker("2.6", name="cross2", outline_color=GREY, outline_width="0.5"))),
    }
    # Before a renderer has them: what it hands out are copies.
    for _, symbol in looks.values():
        pale_outside(symbol)
    pale = marker("2.6", color="#ffffff", outline_color=GREEN)
    pale.setOpacity(PALE_PCT / 100)
    # No tree is drawn as this: it is a line of the legend.
    looks["outside"] = ("pale: outside the plots", pale)
    layer.setRenderer(
        QgsCategorizedSymbolRenderer(
            DRAWN_AS, [QgsRendererCategory(value, symbol, text) for value, (text, symbol) in looks.items()]
        )
    )
    begin_with(layer, FIRST_COLUMNS)
    # A DBH goes before the labels of all other layers; a tree without one has its number, pale, which gives way.
    labelled = labels(f"""coalesce({one(COUNTED)}, "tree_id")""", "#1b1b1b", 3000)
    settings = labelled.settings()
    own = settings.dataDefinedProperties()
    for where, with_dbh, without in (
        (QgsPalLayerSettings.Color, "'#1b1b1b'", quoted(GREY)),
        (QgsPalLayerSettings.Priority, 10, 2),
    ):
        own.setProperty(where, QgsProperty.fromExpression(f"if(({COUNTED}) IS NULL, {without}, {with_dbh})"))
    settings.setDataDefinedProperties(own)
    layer.setLabeling(QgsVectorLayerSimpleLabeling(settings))
    layer.setLabelsEnabled(True)
    layer.setDisplayExpression(
        f"""{said("Tree")} || ' ' || "tree_id" || coalesce(': ' || {one(COUNTED)} || ' cm', """
        f"""', ' || {said("no DBH")})"""
    )
    layer.setMapTipTemplate(
        f"""<b>[% {said("Tree")} %] [% "tree_id" %]"""
        f"""[% coalesce(', ' || {said("plot")} || ' ' || "plot_id", '') %]</b><br>"""
        f"""[% CASE WHEN "dbh_cm" IS NULL THEN {said("No DBH")} ELSE """
        f"""{said("DBH")} || ' <b>' || {one('"dbh_cm"')} || '</b>' """
        f"""|| coalesce(' ± ' || {one('"dbh_se_cm"')}, '') || ' cm' """
        f"""|| coalesce(' ' || {said("at")} || ' ' || format_number("bh_m", 2) || ' m', '') """
        f"""|| coalesce('<br>90 %: ' || {one('"dbh_lo_cm"')} || ' – ' """
        f"""|| {one('"dbh_hi_cm"')} || ' cm', '') END %]"""
        f"""[% coalesce('<br>' || {said("height")} || ' ' || {one('"height_m"')} || """
        f"""coalesce(' ± ' || {one('"height_se_m"')}, '') || ' m', '') %]"""
        """[% CASE WHEN coalesce("qc_reason", '') <> '' THEN '<br><i>' || """
        f"""{reason_expression()} || '</i>' ELSE '' END %]"""
        """[% coalesce('<br>' || "species", '') %][% coalesce('<br>' || "status", '') %]"""
        """[% coalesce('<br>' || "note", '') %]""" + sheet_tip()
    )
    quality = {"measured": "ok", "measured, to be checked": "check", "seen, no DBH": "reject"}
    layer.setEditorWidgetSetup(
        list(TREES).index("qc_flag"), QgsEditorWidgetSetup("ValueMap", {"map": [{k: v} for k, v in quality.items()]})
    )
    # QGIS writes NULL for this entry.
    null = "{2839923C-8B7D-419E-B84B-CA2FE9B80EC7}"
    states = {"not said": null, "live": "live", "dead": "dead"}
    layer.setEditorWidgetSetup(
        list(TREES).index("status"), QgsEditorWidgetSetup("ValueMap", {"map": [{k: v} for k, v in states.items()]})
    )
    layer.setEditorWidgetSetup(
        list(TREES).index("note"), QgsEditorWidgetSetup("TextEdit", {"IsMultiline": True, "UseHtml": False})
    )
    decisions = {"not decided": null, **{text: word for word, text in DECISIONS.items()}}
    layer.setEditorWidgetSetup(
        list(TREES).index("rev_flag"), QgsEditorWidgetSetup("ValueMap", {"map": [{k: v} for k, v in decisions.items()]})
    )
    write_on_top(layer, list(TREES), "Yours to write", WRITTEN, "Measured")
    return layer


def circles() -> QgsVectorLayer:
    """Stems at true scale, as they were measured: rings without a colour, as they do not know what a person decided; in
    the 3D view cylinders up to the trees' heights."""
    layer = memory_layer(CIRCLES, "circles", "Polygon")
    ring = {"style": "no", "outline_color": GREY, "outline_width": "0.35"}
    layer.setRenderer(QgsSingleSymbolRenderer(QgsFillSymbol.createSimple(ring)))
    layer.setDisplayExpression(f"""{said("Tree")} || ' ' || "tree_id" || ': ' || {one('"dbh_cm"')} || ' cm'""")
    layer.setMapTipTemplate(
        f"""<b>[% {said("Tree")} %] [% "tree_id" %]</b><br>[% {said("DBH")} %] [% {one('"dbh_cm"')} %]"""
        f"""[% coalesce(' ± ' || {one('"dbh_se_cm"')}, '') %] cm, [% {said("drawn at true scale")} %]"""
    )
    # In QGIS' 3D view each stands on the terrain; one without a height up to where diameters are measured.
    root = QgsRuleBased3DRenderer.Rule(None)
    for rule, colour in (("\"qc_flag\" = 'ok'", GREEN), ("ELSE", AMBER)):
        symbol, material, own = QgsPolygon3DSymbol(), QgsPhongMaterialSettings(), QgsPropertyCollection()
        material.setDiffuse(QColor(colour))
        material.setAmbient(QColor(colour).darker(250))
        symbol.setMaterial(material)
        symbol.setAltitudeClamping(Qgs3DTypes.AltClampRelative)
        symbol.setAltitudeBinding(Qgs3DTypes.AltBindCentroid)
        tall = QgsProperty.fromExpression('coalesce("height_m", 5)')
        own.setProperty(QgsAbstract3DSymbol.PropertyExtrusionHeight, tall)
        symbol.setDataDefinedProperties(own)
        root.appendChild(QgsRuleBased3DRenderer.Rule(symbol, rule))
    # The keys are random otherwise, and the file another one every time.
    for number, rule in enumerate((root, *root.children())):
        rule.setRuleKey(str(number))
    layer.setRenderer3D(QgsRuleBased3DRenderer(root))
    return layer


def crowns() -> QgsVectorLayer:
    """Crowns from above: pale green, outlined, below everything else."""
    layer = memory_layer(CROWNS, "crowns", "Polygon")
    fill = {"color": "93,155,76,46", "outline_color": "#5d9b4c", "outline_width": "0.3"}
    layer.setRenderer(QgsSingleSymbolRenderer(QgsFillSymbol.createSimple(fill)))
    layer.setDisplayExpression(f"""{said("Crown of tree")} || ' ' || "tree_id\"""")
    layer.setMapTipTemplate(f"""<b>[% {said("Crown of tree")} %] [% "tree_id" %]</b><br>[% {one('"crown_m2"')} %] m²""")
    return layer


def searched() -> QgsVectorLayer:
    """Where stems were looked for: the plots' outlines, dashed, with nothing inside."""
    layer = memory_layer(SEARCHED, "searched", "MultiPolygon")
    outline = {"style": "no", "outline_color": GREY, "outline_style": "dash", "outline_width": "0.5"}
    layer.setRenderer(QgsSingleSymbolRenderer(cased(QgsFillSymbol.createSimple(outline))))
    layer.setDisplayExpression(f"""{said("Plot")} || ' ' || "plot_id\"""")
    layer.setMapTipTemplate(
        f"""<b>[% {said("Plot")} %] [% "plot_id" %]</b>"""
        f"""[% coalesce('<br>' || {said("searched")} || ' ' || round(100 * "share") || ' %', '') %]"""
    )
    return layer


def sections() -> QgsVectorLayer:
    """Measured sections of a stem: outlines from brown (foot) to yellow (crown), shown when zoomed in."""
    layer = memory_layer(SECTIONS, "sections", "Polygon")
    steps = ((0, 2, "#5b2c06"), (2, 5, "#98511a"), (5, 10, "#cf8a35"), (10, 15, "#e7b85c"), (15, 60, "#f4dd9a"))
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
    layer.setDisplayExpression(
        f"""{said("Tree")} || ' ' || "tree_id" || ' ' || {said("at")} || ' ' || format_number("height_m", 1) || ' m'"""
    )
    layer.setMapTipTemplate(
        f"""<b>[% {said("Tree")} %] [% "tree_id" %] [% {said("at")} %] [% format_number("height_m", 1) %] m</b><br>"""
        f"""[% {one('"d_cm"')} %][% coalesce(' ± ' || {one('"d_se_cm"')}, '') %] cm, """
        f"""[% "n_pts" %] [% {said("points round")} %] [% round("arc_deg") %]° """
        """(rms [% format_number("rms_cm", 1) %] cm)"""
    )
    return layer
