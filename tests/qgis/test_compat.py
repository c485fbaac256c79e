"""Nothing that QGIS 4 / Qt 6 dropped: a lint over the plugin and the PyQGIS tools."""

from __future__ import annotations

import ast
import re
import subprocess

import pytest
from qgis_driver import ROOT

FILES = sorted((*(ROOT / "treedgs_qgis").rglob("*.py"), *(ROOT / "processing").glob("*.py"), ROOT / "__init__.py"))
#: Gone or moved; what to use instead.
GONE = {
    r"\bexec_\(": "exec()",
    r"\bQRegExp\b": "QRegularExpression",
    r"\bQVariant\b": "compat, or plain Python values",
    r"\bfrom PyQt[456]\b|\bimport PyQt[456]\b": "qgis.PyQt",
    r"\bimport (sip|resources_rc)\b": "nothing",
    r"\bQgsField\(": "no fields are made in the plugin; if one is needed, through compat",
    r"\bdistutils\b|\bimp\b\.": "the standard library of Python 3.12",
    r"\bsetMargin\(|\bQDesktopWidget\b|\bqApp\b": "Qt 6 names",
    r"pushFormattedMessage": "not in QGIS 3.22",
}
#: Classes whose enum values are scoped or moved to Qgis.* in newer versions: their CamelCase attributes are enums.
ENUM_HOLDERS = re.compile(
    r"\b(QgsProcessing(?:ParameterDefinition|ParameterFile|ParameterNumber|ParameterField|Algorithm)?|QgsWkbTypes|QgsUnitTypes"
    r"|QgsMapLayer|QgsMapLayerType|QgsSnappingConfig|QgsTolerance|QgsFeatureRequest|QgsVectorFileWriter|Qt|QVariant)"
    r"\.([A-Z]\w+)\b(?!\()"
)
#: Qt's own enums by their full name (Qt.Key.Key_Space) are the same in PyQt 5 and 6.
FULL_QT_NAMES = re.compile(r"\bQt\.([A-Z]\w+)\.[A-Z]\w+")


def code(path) -> str:
    """The source without comments and docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            if isinstance(body[0].value, ast.Constant) and isinstance(body[0].value.value, str):
                body[0].value.value = ""
    return ast.unparse(tree)


def offences(text: str) -> list[str]:
    found = [f"{match.group(0)}: use {better}" for gone, better in GONE.items() for match in re.finditer(gone, text)]
    text = FULL_QT_NAMES.sub("QT", text)
    classes = {"LayerDetails", "IndividualLayerSettings"}
    return found + [match.group(0) for match in ENUM_HOLDERS.finditer(text) if match.group(2) not in classes]


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_name_that_newer_qgis_dropped(path):
    text = code(path)
    if path.name == "compat.py":
        # The one place that may name old places, as text that is looked up.
        text = re.sub(r"'[^']*'", "''", text)
    assert not offences(text)


@pytest.mark.parametrize(
    "line",
    [
        "dialog.exec_()",
        "p.setFlags(QgsProcessingParameterDefinition.FlagAdvanced)",
        "QgsProcessingParameterFile('A', 'a', QgsProcessingParameterFile.Folder)",
        "if layer.geometryType() == QgsWkbTypes.PointGeometry: pass",
        "QgsField('a', QVariant.Double)",
        "from PyQt5.QtCore import Qt",
        "layer.type() == QgsMapLayer.VectorLayer",
        "item.setCheckState(Qt.Checked)",
    ],
)
def test_the_lint_catches_what_it_is_for(line):
    assert offences(line)


def test_names_in_compat_exist_in_this_qgis(qgis):
    done = qgis.python("""
from treedgs.treedgs_qgis import compat
print("COMPAT", sorted(name for name in dir(compat) if name.isupper()))
try:
    compat.first_attr("Qgis.NoSuchThing", "QgsNothing.AtAll")
except AttributeError as problem:
    print("LOUD", problem)
""")
    assert "COMPAT" in done.stdout and "LOUD" in done.stdout and "NoSuchThing" in done.stdout, done.stderr


def test_metadata_is_open_for_qgis_4():
    text = (ROOT / "metadata.txt").read_text(encoding="utf-8")
    assert "qgisMinimumVersion=3.22" in text and "qgisMaximumVersion=4.99" in text and "supportsQt6" not in text


MARKS = re.compile(
    r"{\w*}|%\d|%n|</?\w+>|--[a-z][a-z-]+|treedgs:\w+|\bTREEDGS_\w+|\b\w+\.(?:json|gpkg|laz|tif|csv|ply|html)\b"
)


def marks(text: str) -> list[str]:
    """What a translation has to keep as it is: placeholders, tags, options, names of algorithms and files."""
    return sorted(MARKS.findall(text))


@pytest.mark.parametrize("language", ["de", "es"])
def test_every_text_is_translated_and_keeps_its_placeholders(language):
    """What to do: give the translation in treedgs_qgis/i18n/treedgs_<language>.ts, then make translations."""
    import xml.etree.ElementTree as ET

    messages = list(ET.parse(ROOT / "treedgs_qgis" / "i18n" / f"treedgs_{language}.ts").iter("message"))
    assert len(messages) > 800
    for message in messages:
        source, translation = message.findtext("source", ""), message.find("translation")
        assert translation is not None and translation.get("type") != "unfinished" and translation.text, source
        assert marks(source) == marks(translation.text), source


def test_the_marks_are_found():
    assert marks("{a}: %1 with --some-option") == ["%1", "--some-option", "{a}"]
    assert marks("{a}: %2") != marks("{b}: %2") and marks("<b>x</b>") != marks("x")


def test_the_catalogues_hold_every_text_that_there_is(qgis):
    """A new parameter, message, reason or style: make translations (then make styles)."""
    done = subprocess.run(
        ["/usr/bin/python3", str(ROOT / "tools" / "write_translations.py"), "--check"],
        env=qgis.environment(),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_map_tips_and_legends_speak_the_users_language(qgis, tmp_path):
    """The words of a map tip travel in the GeoPackage; columns and legend are translated when QGIS loads it."""
    import pyproj

    from treedgs_geo.inventory.tree_layer import write_trees
    from treedgs_geo.stems.quality.tree import Tree

    tree = Tree(tree_id=1, x=500000.0, y=3450000.0, z_ground=20.0, qc_flag="reject", qc_reason="few_views,lean")
    write_trees(tmp_path / "trees.gpkg", [tree], pyproj.CRS("EPSG:32617"))
    done = qgis.python(
        """
from qgis.core import *
from treedgs.treedgs_qgis import i18n
from treedgs.treedgs_qgis.loading import in_the_users_language
for language in ("de", "es_MX", "fr"):
    layer = QgsVectorLayer(sys.argv[1], "trees", "ogr")
    context = QgsExpressionContext()
    scope = QgsExpressionContextScope(); scope.setVariable("qgis_locale", language)
    context.appendScopes([scope, QgsExpressionContextUtils.layerScope(layer)])
    context.setFeature(next(layer.getFeatures()))
    translator = i18n.install(language)
    in_the_users_language(layer)
    words = [entry.label() for entry in layer.renderer().categories()]
    print("TIP", language, QgsExpression.replaceExpressionText(layer.mapTipTemplate(), context))
    print("WORDS", language, layer.attributeAlias(layer.fields().indexOf("ba_m2")), words)
    i18n.remove(translator)
""",
        tmp_path / "trees.gpkg",
    )
    said = done.stdout
    assert "TIP de <b>Baum 1</b><br>Kein BHD" in said and "der Stamm ist stärker geneigt" in said, said + done.stderr
    assert "TIP es_MX <b>Árbol 1</b><br>Sin DAP" in said and "muy pocas fotos ven el tronco" in said
    assert "TIP fr <b>Tree 1</b><br>No DBH" in said and "too few photos see the stem" in said
    assert "WORDS de Grundfläche [m²] ['gemessen', 'gemessen, zu prüfen', 'gesehen, kein BHD'" in said
    assert "'pale: outside the plots'" in said, "what the map shows is in the legend"
    assert "WORDS fr Basal area [m²] ['measured', 'measured, to be checked', 'seen, no DBH'" in said


def test_titles_and_refusals_are_shown_in_the_users_language(qgis):
    code = """
from qgis.core import QgsProcessingContext, QgsSettings
plugin = qgis.utils.plugins["treedgs"]
plugin.unload()
QgsSettings().setValue("locale/overrideFlag", True)
for language in ("de_DE", "es_MX", "fr_FR"):
    QgsSettings().setValue("locale/userLocale", language)
    plugin.initProcessing()
    alg = QgsApplication.processingRegistry().algorithmById("treedgs:photostodbh")
    label = [d.description() for d in alg.parameterDefinitions() if d.name() == "BH_M"]
    print("SHOWN", language, alg.name(), alg.displayName(), "|", alg.group(), "|", label)
    values = {"PHOTOS": "/", "CRS": "EPSG:4326", "WORKSPACE": "/nowhere", "OUTPUT": "/nowhere/t.gpkg"}
    print("WHY", language, alg.checkParameterValues(values, QgsProcessingContext())[1])
    plugin.unload()
QgsSettings().setValue("locale/overrideFlag", False)
"""
    shown = qgis.python(code).stdout
    assert "SHOWN de_DE photostodbh BHD aus Drohnenfotos messen | 2 Messen | ['Brusthöhe [m]']" in shown, shown
    assert "SHOWN es_MX photostodbh Medir el DAP en fotos de dron | 2 Medir" in shown, shown
    assert "SHOWN fr_FR photostodbh Measure DBH from drone photos | 2 Measure | ['Breast height [m]']" in shown
    assert "WHY de_DE CRS: EPSG:4326 (WGS 84) ist geographisch (Grad)" in shown
    assert "WHY es_MX CRS: EPSG:4326 (WGS 84) es geográfico (grados)" in shown
    assert "WHY fr_FR CRS: EPSG:4326 (WGS 84) is geographic (degrees)" in shown
