"""QGIS 4: every module of the plugin, and the tools that PyQGIS runs, are imported with the real PyQt6."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from qgis_driver import ROOT


def imported(repository: Path) -> subprocess.CompletedProcess:
    """What a process with Qt 6 says of a repository."""
    command = [sys.executable, str(ROOT / "tests" / "qgis" / "qt6_imports.py"), str(repository)]
    return subprocess.run(
        command, capture_output=True, text=True, env={**os.environ, "QT_QPA_PLATFORM": "offscreen"}, cwd=repository
    )


def test_every_module_of_the_plugin_imports_with_qt_6():
    done = imported(ROOT)
    assert done.returncode == 0, done.stdout + done.stderr
    assert int(done.stdout.split()[0]) > 45


def test_names_that_qt_6_lacks_are_found(tmp_path):
    """The check is not blind: an old enum, a module that is gone, and a place in compat that is not the newest."""
    for name in ("treedgs_qgis", "processing", "tools"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__", "*.qm"))
    (tmp_path / "__init__.py").touch()
    (tmp_path / "tools" / "old.py").write_text("from qgis.PyQt.QtCore import Qt\nprint(Qt.Tool, Qt.WindowType.Tool)\n")
    (tmp_path / "processing" / "old.py").write_text("from qgis.PyQt.QtCore import QRegExp\n")
    (tmp_path / "processing" / "other.py").write_text("from qgis.core import Qgis\nprint(Qgis.Critical)\n")
    done = imported(tmp_path)
    assert done.returncode == 1, done.stderr
    lines = done.stdout.splitlines()
    assert any("old.py:2: Qt.Tool" in line for line in lines) and not any("WindowType" in line for line in lines)
    assert any("QtCore has no QRegExp" in line for line in lines)
    assert any("processing.other: AttributeError" in line for line in lines)
