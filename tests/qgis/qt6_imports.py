"""Import modules of the plugin with Qt 6: the real PyQt6, and a ``qgis`` that has the newest names only.

    python qt6_imports.py REPOSITORY

Run in a process of its own by ``test_qt6.py``. ``qgis.core`` and the like hold classes without anything inside; what
is an enum there has only the places that ``compat.py`` looks at first, which are those of QGIS 4.
"""

from __future__ import annotations

import ast
import importlib
import sys
import types
from pathlib import Path
from unittest import mock

ROOT = Path(sys.argv[1])
QT = ("QtCore", "QtGui", "QtWidgets", "QtXml", "QtNetwork")


class Stub(types.ModuleType):
    """A module whose every capital name is an empty class."""

    def __getattr__(self, name: str):
        if not name.startswith("Q"):
            raise AttributeError(name)
        made = type(name, (), {"__init__": lambda self, *a, **k: None})
        setattr(self, name, made)
        return made


def newest_names() -> list[str]:
    """The first place of every name of ``compat.py``, like ``Qgis.MessageLevel.Critical``."""
    tree = ast.parse((ROOT / "treedgs_qgis" / "compat.py").read_text(encoding="utf-8"))
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and ast.unparse(node.func) == "first_attr"]
    return [call.args[0].value for call in calls if isinstance(call.args[0], ast.Constant)]


def install() -> None:
    """``qgis`` and what lies in it, before anything is imported."""
    package = types.ModuleType("qgis")
    package.__path__ = []
    sys.modules["qgis"] = package
    for name in ("core", "gui", "utils", "analysis", "_3d"):
        sys.modules[f"qgis.{name}"] = stub = Stub(f"qgis.{name}")
        setattr(package, name, stub)
    sys.modules["qgis.utils"].iface = mock.MagicMock()
    sys.modules["qgis.utils"].plugins = {}
    for name in ("osgeo", "osgeo.ogr", "osgeo.osr", "osgeo.gdal"):  # QGIS' own, of no Qt
        sys.modules[name] = mock.MagicMock()
    qt = types.ModuleType("qgis.PyQt")
    qt.__path__ = []
    sys.modules["qgis.PyQt"] = package.PyQt = qt
    for name in QT:
        sys.modules[f"qgis.PyQt.{name}"] = importlib.import_module(f"PyQt6.{name}")
    core = sys.modules["qgis.core"]
    core.QgsProviderRegistry = mock.MagicMock()
    for dotted in newest_names():
        for holder in (core, sys.modules["qgis.gui"]):
            for part in dotted.split("."):
                if part not in vars(holder):
                    setattr(holder, part, type(part, (), {}))
                holder = getattr(holder, part)


def wrong_names(path: Path) -> list[str]:
    """Names of Qt, with all that follows them (``Qt.WindowType.Tool``), that Qt 6 does not have."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    tried = {id(below) for node in ast.walk(tree) if isinstance(node, ast.Try) for below in ast.walk(node)}
    known, wrong = {}, []
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("qgis.PyQt.") and id(node) not in tried:
            module = importlib.import_module(node.module.replace("qgis.PyQt", "PyQt6"))
            for name in node.names:
                if hasattr(module, name.name):
                    known[name.asname or name.name] = getattr(module, name.name)
                else:
                    wrong.append(f"{path.name}: {node.module} has no {name.name}")
    for node in ast.walk(tree):
        words = ast.unparse(node).split(".") if isinstance(node, ast.Attribute) else []
        if words and words[0] in known and all(word.isidentifier() for word in words):
            thing = known[words[0]]
            for word in words[1:]:
                if not hasattr(thing, word):
                    wrong.append(f"{path.name}:{node.lineno}: {'.'.join(words)}")
                    break
                thing = getattr(thing, word)
    return wrong


def main() -> int:
    """Import everything; what fails is printed."""
    install()
    failed = []
    package = types.ModuleType("treedgs")
    package.__path__ = [str(ROOT)]
    sys.modules["treedgs"] = package
    sys.path.insert(0, str(ROOT / "tools"))
    plugin = sorted((ROOT / "treedgs_qgis").rglob("*.py")) + sorted((ROOT / "processing").glob("*.py"))
    modules = [path.relative_to(ROOT).with_suffix("").parts for path in plugin if path.stem != "__init__"]
    names = [".".join(("treedgs", *parts)) for parts in modules]
    tools = [f"layer_styles.{path.stem}" for path in (ROOT / "tools" / "layer_styles").glob("*.py")]
    for name in [*names, *tools, "write_styles", "write_models"]:
        try:
            importlib.import_module(name)
        except Exception as problem:
            failed.append(f"{name}: {type(problem).__name__}: {problem}")
    files = [*plugin, *(ROOT / "tools").rglob("*.py"), ROOT / "__init__.py"]
    failed += [line for path in files for line in wrong_names(path)]
    print("\n".join(failed) or f"{len(names) + len(tools) + 2} modules")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
