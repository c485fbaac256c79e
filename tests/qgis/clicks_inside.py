"""Runs inside QGIS (``--code``) for ``test_clicks.py``: real clicks on the offer's buttons, with Python's garbage
collected in between. The set-up is a stand-in that goes on until it may end. The report goes to ``TREEDGS_CLICKS``.
Not imported by anything.
"""

import os
import sys
import threading
import time

import qgis.utils
from inside import click, rest, seen, start, wait
from qgis.core import QgsApplication, QgsProcessingAlgorithm, QgsProcessingProvider
from qgis.gui import QgsMessageBarItem
from qgis.PyQt.QtWidgets import QProgressBar, QPushButton
from qgis.utils import iface

plugin = qgis.utils.plugins["treedgs"]
environment = sys.modules["treedgs.treedgs_qgis.environment"]
may_end = threading.Event()


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
        step = 0
        while not (feedback.isCanceled() or may_end.is_set()):
            environment.going_on(target)
            step += 1
            feedback.setProgress(100 * step / (step + 100))
            time.sleep(0.05)
        environment.over(target)
        return {}


class Provider(QgsProcessingProvider):
    def id(self):
        return "clicktest"

    def name(self):
        return "clicktest"

    def loadAlgorithms(self):
        self.addAlgorithm(Slow())


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
    rest()
    seen["offered"] = [words(opened.messageBar()), sorted(buttons(opened.messageBar()))]
    for turn, bar in (("dialog", opened.messageBar()), ("first", iface.messageBar()), ("second", iface.messageBar())):
        if turn == "first":
            opened.close()
            plugin.offer.missed.emit(missing.EngineMissing(""))
        rest()
        click(buttons(bar)["Set up now"])
        wait(lambda bar=bar: any(shown(bar)))
        early = shown(bar)
        wait(lambda bar=bar, early=early: shown(bar) != early)
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
        if turn == "second":
            may_end.set()
        else:
            click(buttons(bar)["Stop"])
        seen[f"{turn}_ended"] = wait(lambda: plugin.offer.job.task is None)
        rest()
        seen[f"{turn}_words"] = words(bar)
        seen[f"{turn}_buttons"] = sorted(buttons(bar))


start(main, os.environ["TREEDGS_CLICKS"])
