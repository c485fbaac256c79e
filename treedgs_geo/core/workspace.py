"""A workspace: a folder any stage can be resumed from, described by ``run.json``."""

from __future__ import annotations

import importlib.metadata
import os
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from .. import __version__
from .errors import InputError, OutputError, TreeDGSError
from .files import content_hash, ensure_writable, read_json, remove_leftovers, write_json
from .folder_lock import Busy, Lease, Lost, holder_of, host
from .settings import param

#: File names inside a workspace (``docs/developer/workspace.md``).
GEOTAGS = "geotags.gpkg"
SFM = "sfm"
DENSE = "dense.laz"
DTM = "dtm.tif"
CHM = "chm.tif"
ORTHO = "ortho.tif"
FIELD = "field.ply"
SURFACE = "surface.laz"
STEMS = "stems.laz"
TREES = "trees.gpkg"
FITS = "fits.json"
GIVEN = "given.json"
FIELD_STEMS = "field_stems.csv"
SHEETS = "sheets"
REPORT = "report.html"
VIEW = "report_3d.html"


#: Silence after which another computer's run counts as dead, seconds: a run may be deep in native code for long.
STALE_S = 300.0


def workspace_option() -> Any:
    """The setting of a workspace to write into."""
    holds = (GEOTAGS, DENSE, DTM, CHM, ORTHO, FIELD, SURFACE, STEMS, TREES, FITS, GIVEN, FIELD_STEMS, REPORT, VIEW)
    text = "Folder for intermediate results; a second run resumes there. Not given: beside the photos, NAME_treedgs."
    return param(None, kind="output_folder", help=text, holds=holds, known_by="run.json")


def beside_photos(photos: Path) -> Path:
    """Where the workspace lies if none is given: found again by the next run, and kept with the photos."""
    place = Path(os.path.abspath(photos))
    return place.with_name(f"{place.name or 'photos'}_treedgs")


class KeptWorkspace:
    """Settings with ``photos`` and ``workspace``: fills in where the workspace lies."""

    photos: Path
    workspace: Path

    def __post_init__(self) -> None:
        if self.workspace is None:
            object.__setattr__(self, "workspace", beside_photos(self.photos))


class Workspace:
    """Paths and the per-stage record of one plot's run.

    ``run.json``: ``{"version", "libraries", "crs", "stages": {name: {"status", "key", "seconds", "peak_memory_mb",
    "result", "settings", "outputs"}}}``. A stage is skipped when its record is ``done`` with the same ``key`` (settings
    + input fingerprint) and its outputs are as it left them. ``outputs``: file -> SHA-256, or "" where others may
    change the file.
    """

    def __init__(self, folder: Path, lease: Lease | None = None) -> None:
        self.folder = Path(folder)
        self._file = self.folder / "run.json"
        self._lease = lease
        self.record = read_record(self.folder) or {
            "version": __version__,
            "libraries": _versions(),
            "crs": None,
            "stages": {},
        }

    @classmethod
    @contextmanager
    def held(cls, folder: Path) -> Iterator[Workspace]:
        """The workspace, for this process alone until the block ends.

        Raises:
            InputError: another run works there; a foreign ``run.json``. OutputError: the folder cannot be written.
        """
        folder = Path(folder)
        ensure_writable(folder / "run.json")
        try:
            lease = Lease.take(folder, STALE_S)
        except Busy as busy:
            raise InputError(_busy(folder, busy)) from None
        except OSError as problem:
            said = problem.strerror or problem
            raise OutputError(f"{folder}: cannot be written ({said}); choose another workspace.") from None
        with lease.renewed():
            remove_leftovers(folder)
            yield cls(folder, lease)

    def path(self, name: str) -> Path:
        """Absolute path of a workspace file."""
        return self.folder / name

    def ran(self, stage: str, key: str) -> bool:
        """True when the stage ended well with the same key."""
        entry = self._entry(stage)
        return entry.get("status") == "done" and entry.get("key") == key and isinstance(entry.get("result"), dict)

    def damage(self, stage: str, outputs: list[Path]) -> str:
        """What is wrong with a finished stage's outputs, in words, or ''."""
        kept = self._entry(stage).get("outputs")
        kept = kept if isinstance(kept, dict) else {}
        for path in outputs:
            before = kept.get(self._name(path), "")
            if not path.is_file():
                return f"{path}: is missing"
            if before and content_hash(path) != before:
                return f"{path}: is not as the run left it (damaged or changed)"
        return ""

    def result(self, stage: str) -> dict[str, Any]:
        """What the finished stage returned."""
        return self.record["stages"][stage]["result"]

    def output_hashes(self, stage: str) -> dict[str, str]:
        """File -> SHA-256 of a finished stage's outputs."""
        return dict(self._entry(stage).get("outputs") or {})

    @contextmanager
    def running(
        self, stage: str, key: str, settings: dict[str, Any], outputs: Iterable[Path] = (), edited: Iterable[Path] = ()
    ) -> Iterator[dict[str, Any]]:
        """Record a stage: the block fills the yielded ``result`` dict; failure is recorded too.

        outputs: files it writes. edited: those of them that people may change afterwards.

        Raises:
            OutputError: the record cannot be written, or another process has taken the workspace over.
        """
        entry: dict[str, Any] = {"status": "running", "key": key, "settings": settings, "result": {}}
        self.record["stages"][stage] = entry
        self.save()
        began = time.monotonic()
        try:
            yield entry["result"]
            hashes = {self._name(path): "" if path in list(edited) else content_hash(path) for path in outputs}
            entry["status"], entry["outputs"] = "done", hashes
        except BaseException as problem:
            entry["status"] = "cancelled" if isinstance(problem, KeyboardInterrupt) else "failed"
            entry["error"] = str(problem)
            self._cost(entry, began)
            with suppress(TreeDGSError, OSError):  # what went wrong first is what counts
                self.save()
            raise
        self._cost(entry, began)
        self.save()

    def save(self) -> None:
        """Write ``run.json`` atomically.

        Raises:
            OutputError: it cannot be written, or another process has taken the workspace over.
        """
        if self._lease is not None:
            try:
                self._lease.check()
            except Lost:
                raise OutputError(
                    f"{self.folder}: another process has taken this workspace over while this one was silent; "
                    "choose another workspace, or wait for that run and start again."
                ) from None
        write_json(self._file, self.record)

    def _cost(self, entry: dict[str, Any], began: float) -> None:
        entry["seconds"] = round(time.monotonic() - began, 2)
        entry["peak_memory_mb"] = peak_memory_mb()

    def _entry(self, stage: str) -> dict[str, Any]:
        entry = self.record["stages"].get(stage)
        return entry if isinstance(entry, dict) else {}

    def _name(self, path: Path) -> str:
        return os.path.relpath(path, self.folder).replace(os.sep, "/")


def read_record(folder: Path) -> dict[str, Any] | None:
    """A workspace's ``run.json``; None where there is none.

    Raises:
        InputError: not readable, or not a run record.
    """
    file = Path(folder) / "run.json"
    if not file.exists():
        return None
    record = read_json(file)
    if not isinstance(record, dict) or "stages" not in record:
        raise InputError(f"{file}: is not a TreeDGS run record; choose an empty folder as workspace.")
    stages = record["stages"]
    if not isinstance(stages, dict) or not all(isinstance(entry, dict) for entry in stages.values()):
        raise InputError(
            f"{file}: its 'stages' are no table of stages, expected one entry a stage; delete the file: every stage is "
            "then done again."
        )
    return record


def in_use(folder: Path) -> str:
    """Why a run could not start in this workspace now, or ''."""
    holder = holder_of(folder)
    return _busy(folder, Busy(holder)) if holder is not None else ""


def _busy(folder: Path, busy: Busy) -> str:
    elsewhere = busy.holder.get("host") != host()
    wait = f" (if that computer is off, wait {STALE_S / 60:.0f} minutes)" if elsewhere else ""
    return (
        f"{folder}: another run works in this workspace ({busy}); wait until it has ended, stop it, or choose another "
        f"workspace{wait}."
    )


def peak_memory_mb() -> int:
    """Largest resident size so far of this process and of its finished children, MB."""
    if sys.platform == "win32":
        # The peak of this process; finished children are not counted there.
        import psutil

        return round(psutil.Process().memory_info().peak_wset / 1024**2)
    import resource

    scale = 1 / 1024 if sys.platform != "darwin" else 1 / 1024**2
    largest = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return round(largest * scale)


def _versions() -> dict[str, str]:
    found = {"python": sys.version.split()[0]}
    used = ("numpy", "scipy", "numba", "pycolmap", "opencv-python-headless", "open3d", "laspy", "rasterio", "geopandas")
    for name in used:
        with suppress(importlib.metadata.PackageNotFoundError):
            found[name] = importlib.metadata.version(name)
    return found
