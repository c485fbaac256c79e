"""Runs inside QGIS (``--code``) for ``test_clicks.py``: real clicks on the offer's buttons, with Python's garbage
collected in between. The set-up is a stand-in of four seconds. The report goes to ``TREEDGS_CLICKS``.
Not imported by anything.
"""

import gc
import json
import os
import sys
import time
import traceback

import qgis.utils
from qgis.core import QgsApplication, QgsProcessingAlgorithm, QgsProcessingProvider
from qgis.gui import QgsMessageBarItem
from qgis.PyQt.QtCore import Qt, QTimer
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import QApplication, QProgressBar, QPushButton
from qgis.utils import iface

seen = {}
plugin = qgis.utils.plugins["treedgs"]
environment = sys.modules["treedgs.treedgs_qgis.environment"]


class Slow(QgsProcessingAlgorithm):
    def createInstance(self):
        return Slow()

    def name(self):
        return "slow"

    def displayName(self):
        return "slow"

    def initAlgorithm(self, configuration=None):
        pass

    def processAlgorithm(self, parameters, context, feedback):
        target = sys.modules["treedgs.treedgs_qgis.engine"].managed_environment()
        for step in range(40):
            environment.going_on(target)
            if feedback.isCanceled():
                break
            time.sleep(0.1)
            feedback.setProgress(2.5 * step)
        environment.over(target)
        return {}


class Provider(QgsProcessingProvider):
    def id(self):
        return "clicktest"

    def name(self):
        return "clicktest"

    def loadAlgorithms(self):
        self.addAlgorithm(Slow())


def rest(seconds=0.3):
    """Events, and no Python object that only a cycle holds."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        QApplication.processEvents()
        QTest.qWait(20)
    gc.collect()


def wait(done, seconds=30):
    until = time.monotonic() + seconds
    while not done():
        if time.monotonic() > until:
            return False
        QTest.qWait(20)
    return True


def buttons(bar):
    return {
        button.text(): button
        for item in bar.findChildren(QgsMessageBarItem)
        for button in item.findChildren(QPushButton)
        if button.isVisible()
    }


def words(bar):
    return [item.text() for item in bar.findChildren(QgsMessageBarItem)]


def shown(bar):
    return [child.value() for child in bar.findChildren(QProgressBar) if child.isVisible()]


def main():
    missing = sys.modules["treedgs.treedgs_qgis.missing"]
    plugin.kept_provider = Provider()
    QgsApplication.processingRegistry().addProvider(plugin.kept_provider)
    plugin.offer.job.algorithm = "clicktest:slow"
    iface.messageBar().clearWidgets()
    iface.mainWindow().showNormal()
    made = QgsApplication.processingRegistry().createAlgorithmById("treedgs:terrain")
    opened = plugin.offer.dialog(made, missing.EngineMissing(""))
    opened.setGeometry(60, 60, 1000, 640)
    opened.show()
    rest(2.0)
    seen["offered"] = [words(opened.messageBar()), sorted(buttons(opened.messageBar()))]
    for turn, bar in (("dialog", opened.messageBar()), ("first", iface.messageBar()), ("second", iface.messageBar())):
        if turn == "first":
            opened.close()
            plugin.offer.missed.emit(missing.EngineMissing(""))
        rest()
        QTest.mouseClick(buttons(bar)["Set up now"], Qt.MouseButton.LeftButton)
        seen[f"{turn}_started"] = wait(lambda: plugin.offer.job.task is not None, 3)
        rest(1.0)
        early = shown(bar)
        rest(1.0)
        seen[f"{turn}_bar"] = [early, shown(bar)]
        if turn == "first":
            other = QgsApplication.processingRegistry().createAlgorithmById("treedgs:terrain")
            meanwhile = other.createCustomParametersWidget(None)
            meanwhile.show()
            rest()
            seen["meanwhile"] = [
                other.canExecute()[1],
                words(meanwhile.messageBar()),
                sorted(buttons(meanwhile.messageBar())),
            ]
            meanwhile.close()
        if turn != "second":
            QTest.mouseClick(buttons(bar)["Stop"], Qt.MouseButton.LeftButton)
        seen[f"{turn}_ended"] = wait(lambda: plugin.offer.job.task is None)
        rest()
        seen[f"{turn}_words"] = words(bar)
        seen[f"{turn}_buttons"] = sorted(buttons(bar))


def run():
    try:
        main()
    except BaseException:
        seen["error"] = traceback.format_exc()
    with open(os.environ["TREEDGS_CLICKS"], "w", encoding="utf-8") as file:
        json.dump(seen, file)
    os._exit(0)


QTimer.singleShot(3000, run)
