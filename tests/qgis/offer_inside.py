"""Runs inside QGIS (``--code``) for ``test_first_use.py``: a new user without an engine, with the mouse.

The job is JSON in ``TREEDGS_OFFER``: ``cloud``, ``output``, ``report``, ``pictures``. What was seen goes to ``report``.
Not imported by anything.
"""

import json
import os
import shutil
import sys
import time

import qgis.utils
from inside import click, rest, seen, start, wait
from qgis.core import QgsApplication, QgsProject
from qgis.gui import QgsMessageBarItem
from qgis.PyQt.QtWidgets import QProgressBar, QPushButton
from qgis.utils import iface

JOB = json.loads(os.environ["TREEDGS_OFFER"])
seen |= {"progress": [], "words": []}
plugin = qgis.utils.plugins["treedgs"]
window = iface.mainWindow()


def picture(name, widget):
    rest(0.4)
    widget.grab().save(os.path.join(JOB["pictures"], f"{name}.png"))


def offered(bar):
    """Texts and visible buttons of the offers on a message bar."""
    items = bar.findChildren(QgsMessageBarItem)
    words = [item.text() for item in items]
    return words, [button.text() for item in items for button in item.findChildren(QPushButton) if button.isVisible()]


def dialog(algorithm, values=()):
    """As the toolbox opens it."""
    import processing

    made = QgsApplication.processingRegistry().createAlgorithmById(algorithm)
    assert made.canExecute()[0], made.canExecute()[1]
    opened = processing.createAlgorithmDialog(algorithm, dict(values))
    opened.setGeometry(60, 60, 1000, 640)
    opened.show()
    rest()
    return opened


def main():
    window.showNormal()
    window.setGeometry(0, 0, 1280, 800)
    rest(0.6)
    seen["menu"] = [entry.text() for entry in plugin.entries]
    seen["first"] = offered(iface.messageBar())
    picture("engine_first", window)
    values = {"INPUT": JOB["cloud"], "CRS": "EPSG:32617", "OUTPUT": JOB["output"]}
    opened = dialog("treedgs:pointcloudtodbh", values)
    bar = opened.messageBar()
    seen["dialog"] = offered(bar)
    picture("engine_offer", opened)

    plugin.offer.job.reported.connect(
        lambda percent, words: (seen["progress"].append(percent), seen["words"].append(words))
    )
    began = time.monotonic()
    button = next(b for b in bar.findChildren(QPushButton) if b.isVisible() and b.text() == "Set up now")
    click(button)
    assert wait(lambda: plugin.offer.job.percent > 20 or plugin.offer.job.task is None)
    seen["bar"] = [child.value() for child in bar.findChildren(QProgressBar) if child.isVisible()]
    picture("engine_running", opened)
    assert wait(lambda: plugin.offer.job.task is None)
    rest()
    seen["seconds"] = time.monotonic() - began
    seen["ended"] = offered(bar)
    picture("engine_done", opened)
    opened.runAlgorithm()
    assert wait(lambda: os.path.exists(JOB["output"]) and opened.results())
    seen["results"] = {name: str(value) for name, value in opened.results().items()}
    opened.close()

    iface.messageBar().clearWidgets()
    QgsProject.instance().clear()
    next(entry for entry in plugin.entries if "sample" in entry.text()).trigger()
    assert wait(lambda: plugin.opened is not None)
    rest(0.6)
    picture("engine_sample", plugin.opened)
    picture("engine_sample_map", window)
    values = plugin.opened.createProcessingParameters()
    context = sys.modules["qgis.core"].QgsProcessingContext()
    seen["sample"] = {
        "layers": sorted(layer.name() for layer in QgsProject.instance().mapLayers().values()),
        "plots": QgsProject.instance().mapLayersByName("Plots")[0].featureCount(),
        "title": plugin.opened.windowTitle(),
        "values": {name: value.authid() if hasattr(value, "authid") else str(value) for name, value in values.items()},
        "problem": plugin.opened.algorithm().checkParameterValues(values, context)[1],
    }
    plugin.opened.close()

    opened = dialog("treedgs:simulateplot")
    seen["extra"] = offered(opened.messageBar())
    opened.close()
    # A virus scanner, a cleaned disk: the environment lacks a library.
    engine = sys.modules["treedgs.treedgs_qgis.engine"]
    packages = sys.modules["treedgs.treedgs_qgis.environment"].packages_of(engine.managed_environment())
    shutil.rmtree(packages / "laspy")
    opened = dialog("treedgs:pointcloudtodbh")
    seen["broken"] = offered(opened.messageBar())
    opened.close()


start(main, JOB["report"])
