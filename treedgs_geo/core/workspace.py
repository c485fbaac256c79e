"""A workspace: a folder any stage can be resumed from, described by ``run.json``."""

from __future__ import annotations

import importlib.metadata
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .. import __version__
from .errors import InputError
from .files import ensure_writable, read_json, write_json

#: File names inside a workspace (``docs/workspace.md``).
GEOTAGS = "geotags.gpkg"
SFM = "sfm"
DENSE = "dense.laz"
DTM = "dtm.tif"
FIELD = "field.ply"
SURFACE = "surface.laz"
STEMS = "stems.laz"
TREES = "trees.gpkg"
REPORT = "report.html"


class Workspace:
    """Paths and the per-stage record of one plot's run.

    ``run.json``: ``{"version", "libraries", "crs", "stages": {name: {"status", "key", "seconds", "peak_memory_mb",
    "result", "settings"}}}``. A stage is skipped when its record is ``done`` with the same ``key`` (settings + input
    fingerprint) and its outputs still exist.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder)
        ensure_writable(self.folder / "run.json")
        self._file = self.folder / "run.json"
        if self._file.exists():
            self.record = read_json(self._file)
            if not isinstance(self.record, dict) or "stages" not in self.record:
                raise InputError(f"{self._file}: is not a TreeDGS run record; choose an empty folder as workspace.")
        else:
            self.record = {"version": __version__, "libraries": _versions(), "crs": None, "stages": {}}

    def path(self, name: str) -> Path:
        """Absolute path of a workspace file."""
        return self.folder / name

    def is_done(self, stage: str, key: str, outputs: list[Path]) -> bool:
        """True when the stage ran with the same key and its outputs are still there."""
        entry = self.record["stages"].get(stage)
        return bool(entry and entry["status"] == "done" and entry["key"] == key and all(p.exists() for p in outputs))

    def result(self, stage: str) -> dict[str, Any]:
        """What the finished stage returned."""
        return self.record["stages"][stage]["result"]

    @contextmanager
    def running(self, stage: str, key: str, settings: dict[str, Any]) -> Iterator[dict[str, Any]]:
        """Record a stage: the block fills the yielded ``result`` dict; failure is recorded too."""
        entry: dict[str, Any] = {"status": "running", "key": key, "settings": settings, "result": {}}
        self.record["stages"][stage] = entry
        self.save()
        began = time.monotonic()
        try:
            yield entry["result"]
            entry["status"] = "done"
        except BaseException as problem:
            entry["status"] = "cancelled" if isinstance(problem, KeyboardInterrupt) else "failed"
            entry["error"] = str(problem)
            raise
        finally:
            entry["seconds"] = round(time.monotonic() - began, 2)
            entry["peak_memory_mb"] = peak_memory_mb()
            self.save()

    def save(self) -> None:
        """Write ``run.json`` atomically."""
        write_json(self._file, self.record)


def peak_memory_mb() -> int:
    """Largest resident size so far of this process and of its finished children, MB."""
    try:
        import resource
    except ModuleNotFoundError:
        # Windows: the peak of this process; finished children are not counted there.
        import psutil

        return round(psutil.Process().memory_info().peak_wset / 1024**2)
    scale = 1 / 1024 if sys.platform != "darwin" else 1 / 1024**2
    largest = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return round(largest * scale)


def _versions() -> dict[str, str]:
    found = {"python": sys.version.split()[0]}
    for name in (
        "numpy",
        "scipy",
        "numba",
        "pycolmap",
        "opencv-python-headless",
        "open3d",
        "laspy",
        "rasterio",
        "geopandas",
    ):
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found
