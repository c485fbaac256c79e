"""``treedgs doctor``: complete, and clear about what is missing."""

from __future__ import annotations

import ast
import importlib
import sys

import pytest
from qgis_driver import ROOT

from treedgs_geo.commands import MODULES
from treedgs_geo.commands.doctor import COMMAND, NEEDS, OPTIONAL, PACKAGES, DoctorSettings, check_libraries, machine
from treedgs_geo.core.errors import MissingComponentError
from treedgs_geo.core.progress import Reporter


def imported() -> set[str]:
    """Third-party modules that the library imports anywhere."""
    found = set()
    for path in (ROOT / "treedgs_geo").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
                found.add(node.module.split(".")[0])
    return found - set(sys.stdlib_module_names) - {"treedgs_geo"}


def test_every_library_that_is_imported_is_checked():
    # Both come with others: pandas with geopandas, affine with rasterio.
    assert imported() <= {*PACKAGES, *OPTIONAL, "pandas", "affine"}


def test_every_verb_says_what_it_needs():
    assert set(NEEDS) == set(MODULES)
    assert {name for modules in NEEDS.values() for name in modules} <= set(PACKAGES)


def test_a_missing_library_and_a_broken_one_are_named(monkeypatch):
    real = importlib.import_module

    def broken(name, *more):
        if name == "pycolmap":
            raise ModuleNotFoundError("No module named 'pycolmap'", name="pycolmap")
        if name == "open3d":
            raise ImportError("libGL.so.1: cannot open shared object file")
        return real(name, *more)

    monkeypatch.setattr(importlib, "import_module", broken)
    few = {"pycolmap": "pycolmap", "open3d": "open3d", "numpy": "numpy"}
    monkeypatch.setattr("treedgs_geo.commands.doctor.PACKAGES", few)
    versions, problems = check_libraries(few, Reporter())
    assert set(versions) == {"numpy"}
    assert problems["pycolmap"] == "not installed" and "libGL.so.1" in problems["open3d"]
    with pytest.raises(MissingComponentError) as caught:
        COMMAND.run(DoctorSettings(), Reporter())
    sentence = str(caught.value)
    assert "pycolmap not installed" in sentence and "photos-to-dbh" in sentence and "simulate-plot" in sentence
    assert "pointcloud-to-dbh" not in sentence and "make setup" in sentence and "\n" not in sentence


def test_the_machine_is_described():
    here = machine()
    assert here["cores"] >= 1 and here["memory_gb"] > 0 and here["free_disk_gb"] > 0
