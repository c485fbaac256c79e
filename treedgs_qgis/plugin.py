"""The plugin object: registers the Processing provider, with or without a graphical QGIS."""

from __future__ import annotations

import importlib
import sys
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from qgis.core import QgsApplication, QgsMessageLog, QgsProcessingProvider
from qgis.PyQt.QtCore import Qt, QTimer
from qgis.PyQt.QtGui import QIcon
from qgis.PyQt.QtWidgets import QDockWidget

from . import i18n, words
from .compat import LOG_CRITICAL, QAction


def dialog_of(algorithm: str, values: dict[str, Any]) -> Any:
    """QGIS' dialog of an algorithm; its package has the name of our own folder."""
    return importlib.import_module("processing.tools.general").createAlgorithmDialog(algorithm, values)


#: In the menu *Plugins*, and there the algorithms of a survey in the order of the work: before and after the review.
MENU = "TreeDGS"
MEASURE = ("planflight", "photostodbh", "pointcloudtodbh")
CHECK_AND_REPORT = ("tapesample", "tapecheck", "trial", "standtable", "compare")
#: Height of the list of stems at first: the map keeps the rest.
STEMS_PIXELS = 220
ENGINE = ("setupengine", "checkengine", "removeengine")


class TreeDGSPlugin:
    """What QGIS loads. ``qgis_process`` calls :meth:`initProcessing` alone."""

    def __init__(self, iface) -> None:
        self.iface = iface
        self.provider: QgsProcessingProvider | None = None
        self.translator = None
        self.panel: Any = None
        self.stems: Any = None
        self.action: Any = None
        self.entries: list[Any] = []
        self.offer: Any = None
        self.opened: Any = None

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
        """Start in the graphical QGIS: the provider, and the panel's button and menu entry."""
        self.initProcessing()
        if self.iface is None or self.action is not None:
            return
        from . import view_3d

        self.add_dialogs(MEASURE)
        icon = QIcon(str(Path(__file__).with_name("icons") / "review.svg"))
        self.action = QAction(icon, i18n.tr("Review trees"), self.iface.mainWindow())
        self.action.setObjectName("TreeDGSReviewAction")
        self.action.setCheckable(True)
        self.action.toggled.connect(self.show_panel)
        self.iface.addToolBarIcon(self.action)
        self.iface.addPluginToMenu(MENU, self.action)
        self.add_entry(i18n.tr("Stem list"), "stems", self.show_stems)
        self.add_entry(i18n.tr("3D view of this plot"), "view3d", partial(view_3d.show, self.iface))
        self.entries[-1].setIcon(QgsApplication.getThemeIcon("/mActionNew3DMap.svg"))
        self.iface.addToolBarIcon(self.entries[-1])
        self.add_dialogs(CHECK_AND_REPORT)
        from .offer import Offer
        from .tryit import begin

        self.offer = Offer(self.iface)
        text = f"{i18n.tr('Try it with a sample flight')} …"
        self.add_entry(text, "tryit", lambda *_: begin(self.iface, self.open_dialog, self.offer))
        if self.provider is not None:
            self.provider.offer = self.offer
            self.provider.open_panel = partial(self.action.setChecked, True)
        self.add_dialogs(ENGINE)
        QTimer.singleShot(0, self.offer.first_time)

    def add_dialogs(self, names: tuple[str, ...]) -> None:
        """Lines of the menu that open an algorithm's dialog."""
        for name in names:
            title = f"{QgsApplication.processingRegistry().algorithmById(f'treedgs:{name}').displayName()} …"
            self.add_entry(title, name, partial(self.open_dialog, f"treedgs:{name}", {}))

    def add_entry(self, text: str, name: str, called: Callable[..., None]) -> None:
        """One line of the menu."""
        entry = QAction(text, self.iface.mainWindow())
        entry.setObjectName(f"TreeDGS-{name}")
        entry.triggered.connect(called)
        self.iface.addPluginToMenu(MENU, entry)
        self.entries.append(entry)

    def open_dialog(self, algorithm: str, values: dict[str, Any], *_: Any) -> None:
        """The dialog of an algorithm; the last one is kept, or Python would take it away."""
        self.opened = dialog_of(algorithm, values)
        self.opened.show()

    def show_panel(self, shown: bool) -> None:
        """Open the panel **Review trees**, or close it."""
        if self.panel is None and shown:
            from .review.panel import ReviewPanel

            self.panel = ReviewPanel(self.iface)
            self.panel.visibilityChanged.connect(self._follow_panel)
            self.iface.addDockWidget(Qt.DockWidgetArea.RightDockWidgetArea, self.panel)
            # All of the height is its own: the toolbox, open or not yet, is a tab beside it.
            toolbox = self.iface.mainWindow().findChild(QDockWidget, "ProcessingToolbox")
            if toolbox is not None:
                self.iface.mainWindow().tabifyDockWidget(toolbox, self.panel)
                QTimer.singleShot(0, self.panel.raise_)
        if self.panel is not None:
            self.panel.setVisible(shown)

    def show_stems(self, *_: Any) -> None:
        """Open the dock **Stem list**; a tree clicked there is shown in the panel, where that is open."""
        if self.stems is None:
            from .review.stem_list import StemList

            self.stems = StemList(self.iface, lambda tree: self.panel is not None and self.panel.show_any(tree))
            self.iface.addDockWidget(Qt.DockWidgetArea.BottomDockWidgetArea, self.stems)
            self.iface.mainWindow().resizeDocks([self.stems], [STEMS_PIXELS], Qt.Orientation.Vertical)
        self.stems.show()

    def _follow_panel(self, _visible: bool) -> None:
        """The panel was closed by its own cross; one behind another dock's tab is still open."""
        if self.action is not None and self.panel is not None:
            self.action.blockSignals(True)
            self.action.setChecked(not self.panel.isHidden())
            self.action.blockSignals(False)

    def unload(self) -> None:
        """Remove the provider, the panel and its button."""
        for dock in (self.panel, self.stems):
            if dock is not None:
                dock.close_for_good()
                self.iface.removeDockWidget(dock)
                dock.deleteLater()
        self.panel = self.stems = None
        if self.action is not None:
            self.iface.removePluginMenu(MENU, self.action)
            self.iface.removeToolBarIcon(self.action)
            self.action = None
        for entry in self.entries:
            self.iface.removePluginMenu(MENU, entry)
            self.iface.removeToolBarIcon(entry)
        self.entries.clear()
        if self.offer is not None:
            self.offer.job.stop()
            self.offer = None
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
            self.provider = None
        i18n.remove(self.translator)
        self.translator = None
