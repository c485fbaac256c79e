"""Fixtures: QGIS in a private profile whose path has a space and an accent, and engines that misbehave."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from qgis_driver import FAKE, ROOT, Qgis, load


@pytest.fixture(scope="session")
def qgis(tmp_path_factory: pytest.TempPathFactory) -> Qgis:
    """QGIS with the plugin; skips where QGIS is not installed (``make test`` installs it)."""
    tools = load("treedgs_tools_qgis_run", ROOT / "tools" / "qgis_run.py")
    if tools.qgis_process() is None:
        pytest.skip("QGIS is not installed here; make setup installs it")
    return Qgis(tmp_path_factory.mktemp("perfil de José"))


@pytest.fixture
def fake_engine(tmp_path: Path):
    """Make an engine with a given behaviour (Python code); returns its path."""

    def make(behaviour: str) -> Path:
        path = tmp_path / "fausse machine é" / "python"
        path.parent.mkdir(exist_ok=True)
        path.write_text(FAKE.format(python=os.path.realpath(sys.executable), behaviour=behaviour), encoding="utf-8")
        path.chmod(0o755)
        return path

    return make
