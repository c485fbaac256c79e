"""A picture of QGIS, drawn under Xvfb: the toolbox open at TreeDGS, a tree layer on the map. ``make screenshot``.

python tools/screenshot.py [trees.gpkg] [picture.png]
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import qgis_run

#: Runs inside QGIS; TREES and PICTURE are filled in.
INSIDE = """
import sys
from qgis.core import QgsApplication, QgsProject, QgsVectorLayer
from qgis.PyQt.QtCore import QTimer
from qgis.PyQt.QtWidgets import QApplication, QDockWidget, QLineEdit, QTreeView
from qgis.utils import iface

window = iface.mainWindow()
window.showNormal()
window.setGeometry(0, 0, 1280, 800)
layer = QgsVectorLayer({trees!r}, "trees", "ogr")
QgsProject.instance().addMapLayer(layer)
QgsProject.instance().setCrs(layer.crs())
for dock in window.findChildren(QDockWidget):
    if dock.objectName() not in ("Layers", "ProcessingToolbox"):
        dock.hide()
    if dock.objectName() == "Layers":
        dock.setMinimumWidth(230)
    if dock.objectName() == "ProcessingToolbox":
        dock.show()
        dock.setMinimumWidth(380)
        for line in dock.findChildren(QLineEdit):
            line.setText("treedgs")
        for view in dock.findChildren(QTreeView):
            view.expandAll()


def zoom():
    extent = layer.extent()
    extent.scale(1.25)
    iface.mapCanvas().setExtent(extent)
    iface.mapCanvas().refreshAllLayers()


def shoot():
    window.grab().save({picture!r})
    sys.stdout.flush()
    QgsProject.instance().clear()
    QgsApplication.instance().exit(0)
    import os
    os._exit(0)


QTimer.singleShot(3000, zoom)
QTimer.singleShot(9000, shoot)
"""


def main() -> int:
    """Draw; 1 when the picture did not come about."""
    trees = Path(sys.argv[1] if len(sys.argv) > 1 else qgis_run.ROOT / "demo" / "trees.gpkg").resolve()
    picture = Path(sys.argv[2] if len(sys.argv) > 2 else qgis_run.ROOT / "docs" / "images" / "toolbox.png").resolve()
    if not trees.exists():
        print(f"error: {trees} does not exist; run make demo first, or name a tree layer", file=sys.stderr)
        return 1
    program, frame = qgis_run.qgis(), shutil.which("xvfb-run")
    if program is None or frame is None:
        print("error: QGIS or xvfb-run was not found; run make setup", file=sys.stderr)
        return 1
    picture.parent.mkdir(parents=True, exist_ok=True)
    before = picture.stat().st_mtime if picture.exists() else 0
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "inside.py"
        script.write_text(INSIDE.format(trees=str(trees), picture=str(picture)), encoding="utf-8")
        variables = qgis_run.environment()
        variables.pop("QT_QPA_PLATFORM")
        command = [frame, "-a", "-s", "-screen 0 1280x800x24", program, "--noversioncheck", "--nologo"]
        subprocess.run([*command, "--code", str(script)], env=variables, timeout=180)
    if not picture.exists() or picture.stat().st_mtime == before:
        print("error: QGIS drew no picture", file=sys.stderr)
        return 1
    _shrink(picture)
    print(picture)
    return 0


def _shrink(picture: Path) -> None:
    """A palette is enough for a window and makes the file a third as large."""
    from PIL import Image

    Image.open(picture).convert("RGB").quantize(256, Image.Quantize.MAXCOVERAGE).save(picture, optimize=True)


if __name__ == "__main__":
    sys.exit(main())
