"""Nothing that QGIS 4 / Qt 6 dropped: a lint over the plugin and the PyQGIS tools."""

from __future__ import annotations

import ast
import re

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


def test_translations_are_complete_where_a_user_looks_first(qgis):
    """Titles and groups are in both languages; placeholders survive; QGIS shows them."""
    import xml.etree.ElementTree as ET

    for language in ("de", "es"):
        for message in ET.parse(ROOT / "treedgs_qgis" / "i18n" / f"treedgs_{language}.ts").iter("message"):
            source, translation = message.findtext("source", ""), message.find("translation")
            assert translation is not None
            if translation.get("type") != "unfinished":
                assert set(re.findall(r"{\w+}", source)) == set(re.findall(r"{\w+}", translation.text or "")), source
    code = """
from qgis.core import QgsSettings
plugin = qgis.utils.plugins["treedgs"]
plugin.unload()
QgsSettings().setValue("locale/overrideFlag", True)
for language in ("de_DE", "es_MX", "fr_FR"):
    QgsSettings().setValue("locale/userLocale", language)
    plugin.initProcessing()
    alg = QgsApplication.processingRegistry().algorithmById("treedgs:photostodbh")
    label = [d.description() for d in alg.parameterDefinitions() if d.name() == "BH_M"]
    print("SHOWN", language, alg.name(), alg.displayName(), "|", alg.group(), "|", label)
    plugin.unload()
QgsSettings().setValue("locale/overrideFlag", False)
"""
    shown = qgis.python(code).stdout
    assert "SHOWN de_DE photostodbh BHD aus Drohnenfotos messen | Bäume messen | ['Brusthöhe [m]']" in shown, shown
    assert "SHOWN es_MX photostodbh Medir el DAP en fotos de dron | Medir árboles" in shown, shown
    assert "SHOWN fr_FR photostodbh Measure DBH from drone photos | Measure trees | ['Breast height [m]']" in shown
