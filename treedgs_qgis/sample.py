"""The sample flight: a small simulated plot (photos, geotags, terrain) to try the plugin with. Standard library only.

It comes in the plugin's zip, as the folder ``sample``; ``make package`` (or ``make sample``) makes it from the demo's
plot. Runs write beside their photos, so it is copied to where they may.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from .engine import PLUGIN_ROOT, EngineError, data_dir
from .words import tr

SOURCE = PLUGIN_ROOT / "sample"
#: Its coordinates.
CRS = "EPSG:6344"


def default_folder() -> Path:
    """In the data folder."""
    return data_dir() / "sample"


def copy(folder: Path) -> Path:
    """The sample in ``folder``, which results of a former try may share; returns it.

    Raises:
        EngineError: the plugin came without it, or the folder cannot be written.
    """
    if not (SOURCE / "images").is_dir():
        raise EngineError(tr("The sample flight did not come with this copy of the plugin; run: make sample"))
    try:
        shutil.copytree(SOURCE, folder, dirs_exist_ok=True)
    except OSError as problem:
        raise EngineError(
            tr("{folder}: the sample flight cannot be written ({problem}); give another FOLDER.").format(
                folder=folder, problem=getattr(problem, "strerror", None) or problem
            )
        ) from None
    return folder


def job_values(folder: Path) -> dict[str, Any]:
    """What **Measure DBH from drone photos** is given for it."""
    return {
        "PHOTOS": str(folder / "images"),
        "GEOTAGS": str(folder),
        "CRS": CRS,
        "PLOTS": str(folder / "plots.csv"),
        "WORKSPACE": str(folder / "work"),
        "OUTPUT": str(folder / "trees.gpkg"),
    }


def results(folder: Path) -> dict[str, Any]:
    """What measuring it has given, as far as it is there."""
    values = job_values(folder)
    found = {name: values[name] for name in ("WORKSPACE", "OUTPUT")} | {"REPORT": str(folder / "work" / "report.html")}
    return {name: path for name, path in found.items() if Path(path).exists()}
