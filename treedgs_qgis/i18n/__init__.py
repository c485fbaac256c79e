"""Translations: one catalogue a language (``treedgs_<language>.qm``), made from the ``.ts`` beside it.

``make translations`` collects the texts and compiles; a text without a translation is shown in English.
"""

from __future__ import annotations

from pathlib import Path

from qgis.core import QgsApplication
from qgis.PyQt.QtCore import QCoreApplication, QTranslator

CONTEXT = "TreeDGS"
FOLDER = Path(__file__).parent


def tr(text: str) -> str:
    """The text in the language of QGIS."""
    return QCoreApplication.translate(CONTEXT, text) if text else text


def install(locale: str = "") -> QTranslator | None:
    """Load the catalogue of QGIS' language (or of ``locale``); ``None`` where there is none.

    The caller keeps the result alive.
    """
    application = QgsApplication.instance()
    if not locale and application:
        # What its windows speak, which ``--lang`` sets too; without windows what is set.
        spoken = application.translation()
        locale = spoken if spoken not in ("", "C") else application.locale()
    for name in (locale, locale[:2]):
        file = FOLDER / f"treedgs_{name}.qm"
        if name and file.exists():
            translator = QTranslator()
            if translator.load(str(file)) and QCoreApplication.installTranslator(translator):
                return translator
    return None


def remove(translator: QTranslator | None) -> None:
    """Take the catalogue out again."""
    if translator is not None:
        QCoreApplication.removeTranslator(translator)
