"""Libraries that not every user needs: which extra brings them, and the sentence for a job that lacks one."""

from __future__ import annotations

import importlib
from types import ModuleType

from .errors import MissingComponentError

#: The package with the simulator, the benchmarks and the publication's tables: it imports the library, never the
#: other way round, so the library reaches it by name.
LAB = "treedgs_lab"

#: Extra of ``pyproject.toml`` -> the modules it brings. ``treedgs_qgis/extras.py`` has the same.
EXTRAS: dict[str, tuple[str, ...]] = {
    "simulate": ("open3d",),
    "reports": ("openpyxl", "reportlab"),
    "gpu": ("warp",),
    "torch": ("torch",),
    "e57": ("pye57",),
    "completion": ("shtab",),
}


def extra_of(module: str | None) -> str:
    """The extra that brings a module (``torch.nn`` as well as ``torch``); '' where every engine has it."""
    top = (module or "").split(".")[0]
    return next((name for name, modules in EXTRAS.items() if top in modules), "")


def lacks(module: str | None, verb: str) -> str:
    """The sentence for a verb that needs a library which is not installed."""
    extra = extra_of(module)
    if extra in ("simulate", "reports"):
        return (
            f"{verb}: needs the library {module}, which the extra '{extra}' brings and this engine lacks; run 'Set up "
            f"the engine' (treedgs:setupengine) with {extra.upper()}=true, or pip install 'treedgs-geo[{extra}]'."
        )
    if extra:
        return f"{verb}: needs the library {module}, which is not installed; pip install 'treedgs-geo[{extra}]'."
    return f"{verb}: the library {module} is not installed; run 'make setup' or 'treedgs doctor'."


def lab(module: str, verb: str) -> ModuleType:
    """A module of the lab.

    Raises:
        MissingComponentError: the lab is not installed.
    """
    try:
        return importlib.import_module(f"{LAB}.{module}")
    except ModuleNotFoundError as missing:
        if missing.name != LAB:
            raise
        raise MissingComponentError(
            f"{verb}: needs the package {LAB} (simulator, benchmarks, the publication's tables), which is not "
            "installed; install TreeDGS from its repository or the plugin's zip, which have it."
        ) from None
