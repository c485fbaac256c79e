"""The plugin object: registers the Processing provider, with or without a graphical QGIS."""

from __future__ import annotations

import sys
import traceback

from qgis.core import QgsApplication, QgsMessageLog, QgsProcessingProvider

from . import i18n, words
from .compat import LOG_CRITICAL


class TreeDGSPlugin:
    """What QGIS loads. ``qgis_process`` calls :meth:`initProcessing` alone."""

    def __init__(self, iface) -> None:
        self.iface = iface
        self.provider: QgsProcessingProvider | None = None
        self.translator = None

    def initProcessing(self) -> None:
        """Register the provider.

        QGIS 3.22 swallows tracebacks raised here ("error starting plugin"), so they are logged before going on.
        """
        if self.provider is not None:
            return
        try:
            self.translator = i18n.install()
            words.translate = i18n.tr
            from .provider import TreeDGSProvider

            provider = self.provider = TreeDGSProvider()
            QgsApplication.processingRegistry().addProvider(provider)
            # The models name our own algorithms, which QGIS finds only once the provider is registered.
            provider.refreshAlgorithms()
        except Exception:
            text = traceback.format_exc()
            QgsMessageLog.logMessage(text, "TreeDGS", LOG_CRITICAL)
            print(text, file=sys.stderr)
            raise

    def initGui(self) -> None:
        """Start in the graphical QGIS."""
        self.initProcessing()

    def unload(self) -> None:
        """Remove the provider."""
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
            self.provider = None
        i18n.remove(self.translator)
        self.translator = None
