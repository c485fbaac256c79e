"""What the scripts that run inside QGIS (``--code``) share: waiting, a person's clicks, and a report of what was seen.

Python's garbage is collected while they wait: what nobody holds would be gone.
"""

import gc
import json
import os
import time
import traceback

from qgis.core import QgsProject
from qgis.PyQt.QtCore import Qt, QTimer
from qgis.PyQt.QtTest import QTest
from qgis.utils import iface

#: Then a script gives up, and says where.
PATIENCE_S = 1500
#: What the test looks at.
seen = {}


def rest(seconds=0.3):
    """Let windows work, and the map be drawn."""
    QTest.qWait(round(1000 * seconds))
    wait(lambda: not iface.mapCanvas().isDrawing())


def wait(done):
    """Until something is so; whether it became so."""
    until = time.monotonic() + PATIENCE_S
    gc.collect()
    while not done() and time.monotonic() < until:
        QTest.qWait(20)
        gc.collect()
    return bool(done())


def click(widget, at=None):
    """The left button on a widget's middle, or at a point of it."""
    places = () if at is None else (Qt.KeyboardModifier.NoModifier, at)
    QTest.mouseClick(widget, Qt.MouseButton.LeftButton, *places)
    rest()


def start(main, report):
    """Run it once QGIS is up, write what was seen (``error``: how it broke), end QGIS."""

    def run():
        try:
            main()
        except BaseException:
            seen["error"] = traceback.format_exc()
        with open(report, "w", encoding="utf-8") as file:
            json.dump(seen, file)
        QgsProject.instance().clear()
        os._exit(0)

    iface.initializationCompleted.connect(lambda: QTimer.singleShot(0, run))
