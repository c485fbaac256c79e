"""``treedgs doctor``: complete, and clear about what is missing."""

from __future__ import annotations

import ast
import importlib
import re
import sys

import pytest
from qgis_driver import ROOT

from treedgs_geo.cli import main
from treedgs_geo.core.errors import MissingComponentError
from treedgs_geo.core.extras import EXTRAS
from treedgs_geo.core.progress import Reporter
from treedgs_geo.verbs import MODULES
from treedgs_geo.verbs.doctor import COMMAND, NEEDS, OPTIONAL, PACKAGES, DoctorSettings, check_libraries, machine


def imported() -> set[str]:
    """Third-party modules that the library imports anywhere."""
    found = set()
    for path in (ROOT / "treedgs_geo").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
                found.add(node.module.split(".")[0])
    # pointtree is imported by a program that runs in its own environment.
    return found - set(sys.stdlib_module_names) - {"treedgs_geo", "treedgs_lab", "pointtree"}


def test_every_library_that_is_imported_is_checked():
    # They come with others: pandas with geopandas, affine with rasterio, markupsafe with jinja2.
    assert imported() <= {*PACKAGES, *OPTIONAL, "pandas", "affine", "markupsafe"}


def test_every_verb_says_what_it_needs():
    assert set(NEEDS) == set(MODULES)
    assert {name for modules in NEEDS.values() for name in modules} <= {*PACKAGES, *OPTIONAL}


def test_extras_are_the_same_everywhere():
    """What the library, the plugin, the doctor and pyproject.toml call an extra, and what it brings."""
    from qgis_driver import load

    load("treedgs_shell", ROOT / "treedgs_qgis" / "__init__.py", ROOT / "treedgs_qgis")
    plugin = load("treedgs_shell.extras", ROOT / "treedgs_qgis" / "extras.py")
    brought = [module for modules in EXTRAS.values() for module in modules]
    assert sorted(brought) == sorted(OPTIONAL)
    assert plugin.CHOICES == {name: EXTRAS[name] for name in plugin.CHOICES}
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    for name, modules in EXTRAS.items():
        listed = re.search(rf"^{name} = \[(.*?)\]$", text, re.M | re.S)
        packages = {re.split("[<>=]", item)[0] for item in re.findall(r'"([^"]+)"', listed[1])}
        assert packages == {OPTIONAL[module] for module in modules}, name
    for part in ("", *plugin.CHOICES, "gpu"):
        assert plugin.disk_mb(part) > plugin.download_mb(part) > 0
    assert (
        plugin.missing(["open3d", "openpyxl"]) == ["simulate", "reports"] and plugin.missing(["open3d", "numpy"]) == []
    )
    assert plugin.needed_gb(["simulate"]) > plugin.needed_gb([]) > 1


def test_an_extra_that_was_not_chosen_is_no_fault(monkeypatch):
    real = importlib.import_module

    def without(name, *more):
        if name in ("open3d", "openpyxl"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return real(name, *more)

    monkeypatch.setattr(importlib, "import_module", without)
    said: list[str] = []
    reporter = Reporter()
    monkeypatch.setattr(reporter, "info", said.append)
    result = COMMAND.run(DoctorSettings(), reporter)
    assert "but stand-table, benchmark, simulate-plot" in result["status"] and "reports, simulate" in result["status"]
    assert "simulate-plot: not set up, it needs the extra simulate" in said and "terrain: works" in said


def test_a_verb_without_its_extra_says_so_in_one_sentence(tmp_path, monkeypatch, capsys):
    """A real engine from which the library is taken away."""
    monkeypatch.setitem(sys.modules, "open3d", None)
    command = ["simulate-plot", "--preset", "test", "--output", str(tmp_path / "plot"), "--log-format", "plain"]
    assert main(command) == 3
    said = capsys.readouterr().err
    assert "simulate-plot: needs the library open3d" in said and "SIMULATE=true" in said
    assert "Traceback" not in said and not (tmp_path / "plot").exists()


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
    monkeypatch.setattr("treedgs_geo.verbs.doctor.PACKAGES", few)
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
