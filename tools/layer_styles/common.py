"""What the layers' styles share: empty layers with aliases, markers, labels, colours, words in three languages."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

from qgis.core import (
    QgsAttributeEditorContainer,
    QgsAttributeEditorField,
    QgsAttributeTableConfig,
    QgsEditFormConfig,
    QgsEditorWidgetSetup,
    QgsMarkerSymbol,
    QgsPalLayerSettings,
    QgsProperty,
    QgsSymbol,
    QgsSymbolLayer,
    QgsTextBufferSettings,
    QgsTextFormat,
    QgsUnitTypes,
    QgsVectorLayer,
    QgsVectorLayerSimpleLabeling,
    QgsWkbTypes,
)
from qgis.PyQt.QtCore import Qt
from qgis.PyQt.QtGui import QColor, QFont

ROOT = Path(__file__).resolve().parents[2]

GREEN, AMBER, RED, GREY, BLUE = "#2e8b3d", "#f2a10d", "#c62828", "#7a7a7a", "#1f4e9c"
#: Trees to tape: apart from the colours of quality for colour-blind eyes too (Okabe and Ito).
SKY = "#56b4e9"
#: Wider than a line by this, mm: its white casing, which dark ground needs.
CASING_MM = 0.8
#: True size on the map (1 cm of DBH = 10 / scale mm), never smaller than what can be distinguished on a screen.
TREE_SIZE = 'max(coalesce("dbh_cm", 0) * 10 / @map_scale, 1.4 + coalesce("dbh_cm", 15) * 0.05)'
#: A GeoPackage's own key.
KEY = "fid"
#: Of headings in attribute tables: a letter's width, and the least that a column has, pixels.
LETTER_PX, MIN_COLUMN_PX = 8, 70
#: Languages of the map tips; the catalogues are the plugin's.
LANGUAGES = ("de", "es")


def translations(language: str) -> dict[str, str]:
    """English -> the language, from the plugin's catalogue."""
    found = {}
    for message in ET.parse(ROOT / "treedgs_qgis" / "i18n" / f"treedgs_{language}.ts").iter("message"):
        found[message.findtext("source", "")] = message.findtext("translation", "")
    return found


def quoted(text: str) -> str:
    """A text in a QGIS expression."""
    return "'" + text.replace("'", "''") + "'"


def in_language(pieces: dict[str, str]) -> str:
    """A QGIS expression that takes the piece of the language QGIS runs in; ``en`` where there is none."""
    cases = "".join(
        f" WHEN left(@qgis_locale, 2) = {quoted(language)} THEN {piece}"
        for language, piece in pieces.items()
        if language != "en" and piece != pieces["en"]
    )
    return f"(CASE{cases} ELSE {pieces['en']} END)" if cases else pieces["en"]


def said(text: str) -> str:
    """A text of a map tip or label as a QGIS expression, in the language of QGIS: the file itself carries it."""
    words = {language: translations(language).get(text) or text for language in LANGUAGES}
    return in_language({"en": quoted(text), **{language: quoted(word) for language, word in words.items()}})


def escaped(expression: str) -> str:
    """A text, as a QGIS expression, that HTML shows as it is."""
    return f"replace(replace(replace({expression}, '&', '&amp;'), '<', '&lt;'), '>', '&gt;')"


def show_texts_as_text(layer: QgsVectorLayer) -> None:
    """In the layer's map tip, what text fields hold is shown as text, not as HTML."""
    names = [field.name() for field in layer.fields() if field.typeName().lower() in ("string", "text")]
    if names:
        pattern = re.compile('"(' + "|".join(names) + ')"')
        layer.setMapTipTemplate(pattern.sub(lambda found: escaped(found[0]), layer.mapTipTemplate()))


def file_url(path: str) -> str:
    """A path, as a QGIS expression, as the address of a file in an attribute of HTML."""
    url = path
    for letter in "%#?\"'<>& ":
        url = f"replace({url}, {quoted(letter)}, '%{ord(letter):02X}')"
    return f"'file:///' || regexp_replace({url}, '^/+', '')"


def memory_layer(fields: dict[str, tuple[str, str]], name: str, geometry: str = "PointZ") -> QgsVectorLayer:
    """An empty layer with the fields and their aliases, and the file's own key, hidden in table, filters and form."""
    columns = "&".join(f"field={field}:{kind}" for field, (kind, _) in fields.items())
    layer = QgsVectorLayer(f"{geometry}?crs=EPSG:32615&{columns}&field={KEY}:integer", name, "memory")
    for index, (_, alias) in enumerate(fields.values()):
        layer.setFieldAlias(index, alias)
    layer.setEditorWidgetSetup(len(fields), QgsEditorWidgetSetup("Hidden", {}))
    only_editable(layer, tuple(fields))  # the table's quick field bar begins with the first that can be edited
    begin_with(layer, ())
    return layer


def marker(size_property: str | None = None, **properties: str) -> QgsMarkerSymbol:
    """A simple marker, its size optionally by expression (millimetres)."""
    symbol = QgsMarkerSymbol.createSimple({"size_unit": "MM", "outline_width": "0.3", **properties})
    if size_property:
        symbol.symbolLayer(0).setDataDefinedProperty(
            QgsSymbolLayer.PropertySize, QgsProperty.fromExpression(size_property)
        )
    return symbol


def cased(symbol: QgsSymbol) -> QgsSymbol:
    """The symbol on a wider, white and solid copy of itself: seen on any ground."""
    below = symbol.symbolLayer(0).clone()
    below.setStrokeColor(QColor("white"))
    below.setStrokeStyle(Qt.PenStyle.SolidLine)
    below.setStrokeWidth(below.strokeWidth() + CASING_MM)
    symbol.insertSymbolLayer(0, below)
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
        # Most lines are shorter than their label: it stands 3.2 mm below their middle.
        settings.geometryGenerator = "translate(centroid($geometry), 0, -0.0032 * coalesce(@map_scale, 0))"
        settings.geometryGeneratorEnabled = True
        settings.geometryGeneratorType = QgsWkbTypes.PointGeometry
        settings.placement = QgsPalLayerSettings.OverPoint
    settings.dist = 0.6
    settings.offsetType = QgsPalLayerSettings.FromSymbolBounds
    settings.scaleVisibility = True
    settings.minimumScale = least_scale
    settings.maximumScale = 0
    settings.setFormat(text)
    return QgsVectorLayerSimpleLabeling(settings)


def begin_with(layer: QgsVectorLayer, names: tuple[str, ...], order: str = "") -> None:
    """The columns that the attribute table begins with; the others follow in their order, each as wide as its heading
    in the longest language. order: a column that rows are sorted by."""
    config = QgsAttributeTableConfig()
    config.update(layer.fields())
    columns, aliases = config.columns(), {field.name(): field.alias() for field in layer.fields()}
    for column in columns:
        alias = aliases.get(column.name, "")
        headings = [alias, *(translations(language).get(alias, "") for language in LANGUAGES)]
        column.width = max(MIN_COLUMN_PX, LETTER_PX * max(map(len, headings)))
        column.hidden = column.name == KEY
    first = [column for name in names for column in columns if column.name == name]
    config.setColumns(first + [column for column in columns if column.name not in names])
    if order:
        config.setSortExpression(f'"{order}"')
    layer.setAttributeTableConfig(config)


def write_on_top(layer: QgsVectorLayer, fields: list[str], title: str, written: tuple[str, ...], rest: str) -> None:
    """A form with what a person writes in a box of its own, on top of the others."""
    form = layer.editFormConfig()
    form.setLayout(QgsEditFormConfig.TabLayout)
    form.clearTabs()
    for text, names in ((title, written), (rest, [name for name in fields if name not in written])):
        box = QgsAttributeEditorContainer(text, form.invisibleRootContainer())
        box.setIsGroupBox(True)
        for name in names:
            box.addChildElement(QgsAttributeEditorField(name, fields.index(name), box))
        form.addTab(box)
    layer.setEditFormConfig(form)


def only_editable(layer: QgsVectorLayer, names: tuple[str, ...]) -> None:
    """All other fields are read-only, in the form and in the table."""
    form = layer.editFormConfig()
    for index, field in enumerate(layer.fields()):
        form.setReadOnly(index, field.name() not in names)
    layer.setEditFormConfig(form)
