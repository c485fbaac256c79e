"""The sample flight: a small simulated plot (photos, geotags, terrain) to try the plugin with. Standard library only.

It is a zip beside the plugin's, not in it: ``make package`` writes it, and ``sample.json`` with its hash. It lies at
the plugin's homepage.
"""

from __future__ import annotations

import configparser
import hashlib
import json
import shutil
import zipfile
from pathlib import Path
from typing import Any

from .engine import PLUGIN_ROOT, EngineError, data_dir
from .words import tr

KNOWN = Path(__file__).with_name("sample.json")
NAME = "treedgs-sample.zip"
#: Its coordinates.
CRS = "EPSG:6344"
#: In the folder when everything is there: the hash of the zip.
READY = "sample.txt"


def known() -> dict[str, Any]:
    """``bytes``, ``sha256`` and ``photos`` of this version's sample."""
    found = json.loads(KNOWN.read_text(encoding="utf-8"))
    # Written in groups of eight, or scanners take it for a secret.
    return {**found, "sha256": found["sha256"].replace(" ", "")}


def address() -> str:
    """Where it is fetched from."""
    parser = configparser.ConfigParser(interpolation=None)
    parser.read(PLUGIN_ROOT / "metadata.txt", encoding="utf-8")
    return f"{parser['general']['homepage'].rstrip('/')}/{NAME}"


def beside() -> Path | None:
    """The zip of a clone of the repository, after ``make package``."""
    file = PLUGIN_ROOT / "dist" / NAME
    return file if file.is_file() else None


def default_folder() -> Path:
    """In the data folder."""
    return data_dir() / "sample"


def is_there(folder: Path) -> bool:
    """Whether this version's sample was unpacked there."""
    try:
        return (folder / READY).read_text(encoding="utf-8").strip() == known()["sha256"]
    except OSError:
        return False


def unpack(archive: Path, folder: Path, source: str) -> None:
    """Check the zip and unpack it. source: where it is from, for the sentence.

    Raises:
        EngineError: it is not this version's sample, or the folder cannot be written.
    """
    try:
        with open(archive, "rb") as stream:
            digest = hashlib.sha256(stream.read()).hexdigest()
        if digest != known()["sha256"]:
            raise EngineError(
                tr("{source}: is not the sample flight of this version (its hash differs); get {name} anew.").format(
                    source=source, name=NAME
                )
            )
        # Results of a former try stay; what is unpacked is replaced.
        for below in ("images", READY):
            path = folder / below
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)
        folder.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(archive) as packed:
            packed.extractall(folder)
        (folder / READY).write_text(digest + "\n", encoding="utf-8")
    except OSError as problem:
        raise EngineError(
            tr("{folder}: the sample flight cannot be written ({problem}); give another FOLDER.").format(
                folder=folder, problem=problem.strerror or problem
            )
        ) from None


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
