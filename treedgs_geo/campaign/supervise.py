"""One plot from its lease to its record: whether it has to run (again), its engine, and how that ended."""

from __future__ import annotations

import contextlib
import json
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..core.errors import TreeDGSError
from ..core.files import fingerprint, short_hash, write_json
from ..core.folder_lock import Busy, Lease, Lost, host
from ..core.geopackage import is_whole, move_aside
from ..core.resource_errors import is_full
from .engine_process import Ending, EngineProcess
from .inputs import input_files
from .manifest import own_field, own_plots
from .places import LOG, RECORD, TREES

#: A plot that fails is tried again at most this often.
RETRIES = 2
#: An attempt cut short because its worker or coordinator died is not the plot's fault; but there is an end to it.
MAX_INTERRUPTIONS = 12
#: Endings of attempts whose worker or coordinator died or was stopped.
_CUT_SHORT = (None, "interrupted")
#: Endings that another try at once cannot change.
_FINAL = {"input"}
#: Endings that are not the plot's: a full disk, a host without a library or with too little memory. They do not use up
#: its attempts.
ELSEWHERE = {"disk", "setup", "missing", "too_large"}
_KEPT_ATTEMPTS = 60


@dataclass
class Record:
    """``plot.json``. key: inputs and settings. stamp: names, sizes, times of the inputs. status: ``new``, ``done`` or
    ``failed``. attempts: ``{"series", "host", "began", "outcome", …}``; one without outcome was cut short.
    result: what the plot's run returned."""

    folder: Path
    key: str = ""
    stamp: str = ""
    status: str = "new"
    attempts: list[dict[str, Any]] = field(default_factory=list)
    result: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def read(cls, folder: Path) -> Record:
        """The plot's record; a new one where there is none, or none that can be read."""
        try:
            found = json.loads((Path(folder) / RECORD).read_text(encoding="utf-8"))
            attempts, result = list(found["attempts"]), dict(found["result"])
            return cls(Path(folder), found["key"], found["stamp"], found["status"], attempts, result)
        except (OSError, ValueError, KeyError, TypeError):
            return cls(Path(folder))

    def save(self) -> None:
        """Write atomically."""
        kept = {name: value for name, value in vars(self).items() if name != "folder"}
        write_json(self.folder / RECORD, {**kept, "attempts": self.attempts[-_KEPT_ATTEMPTS:]})

    def is_unchanged(self, stamp: str, settings: str) -> bool:
        """Finished, and nothing about its files and settings looks different: no need to read them."""
        return self.status == "done" and self.stamp == stamp and self.key.split(":")[0] == settings and self.has_trees()

    def has_trees(self) -> bool:
        """The plot's layer is there and whole."""
        return is_whole(self.folder / TREES, "trees")

    def may_run(self, key: str, series: int) -> bool:
        """Whether another attempt of this key is left in this series of starts."""
        endings = [(a.get("series") == series and a.get("key") == key, a.get("outcome")) for a in self.attempts]
        mine = [outcome for is_mine, outcome in endings if is_mine]
        cut = sum(outcome in _CUT_SHORT for outcome in mine)
        failed = sum(outcome not in {*_CUT_SHORT, "done", *ELSEWHERE} for outcome in mine)
        is_mine, last = next((end for end in reversed(endings) if end[1] not in _CUT_SHORT), (False, None))
        return failed <= RETRIES and cut <= MAX_INTERRUPTIONS and not (is_mine and last in _FINAL)

    def last_problem(self) -> str:
        """What the last attempt said."""
        said = (str(attempt["message"]) for attempt in reversed(self.attempts) if attempt.get("message"))
        return next(said, "its worker died each time")


def run_plot(job: dict[str, Any], stop: threading.Event, started: Callable[[EngineProcess], None]) -> dict[str, Any]:
    """Run one plot if it has to run.

    job: of :class:`.coordinate.Coordinator`. stop: set when the campaign ends early. started: called with the plot's
    engine.

    Returns:
        ``outcome`` (``kept``: was done already, ``done``, ``busy``, ``given_up``, or how it failed), ``message``, and
        of a plot that was run ``seconds`` and ``may_retry``.
    """
    folder = Path(job["folder"])
    try:
        lease = Lease.take(folder)
    except Busy as busy:
        return {"outcome": "busy", "message": f"is being run by {busy}"}
    except OSError as trouble:
        kind = "disk" if is_full(str(trouble)) else "setup"
        return {"outcome": kind, "message": f"{folder} cannot be written on {host()} ({trouble.strerror})"}
    try:
        return _run(job, folder, lease, stop, started)
    finally:
        lease.free()


def _run(
    job: dict[str, Any], folder: Path, lease: Lease, stop: threading.Event, started: Callable[[EngineProcess], None]
) -> dict[str, Any]:
    record = Record.read(folder)
    if record.is_unchanged(job["stamp"], job["settings"]):
        return {"outcome": "kept"}
    row = job["row"]
    try:
        # Of tables that serve many plots, only this plot's lines count.
        lines = short_hash(own_plots(row), own_field(row))
        key = f"{job['settings']}:{fingerprint(input_files(row['route'], row['values'], '', ''))}:{lines}"
    except (OSError, TreeDGSError) as trouble:
        return {
            "outcome": "setup",
            "message": f"an input cannot be read on {host()} ({trouble}); every computer needs "
            "the inputs under the same path",
        }
    if record.status == "done" and record.key == key and record.has_trees():
        record.stamp = job["stamp"]
        record.save()
        return {"outcome": "kept"}
    may_run = record.may_run(key, job["series"])
    record.status, record.key, record.stamp = "new" if may_run else "failed", key, job["stamp"]
    if not may_run:
        with contextlib.suppress(OSError, TreeDGSError):
            record.save()
        return {"outcome": "given_up", "message": record.last_problem()}
    attempt = {"series": job["series"], "key": key, "host": host(), "outcome": None, "began": round(time.time(), 2)}
    record.attempts.append(attempt)
    began = time.monotonic()
    try:
        record.save()
        lease.check()
        if (folder / TREES).exists() and not record.has_trees():
            move_aside(folder / TREES)
        ending = _engine(job, folder, lease, stop, started)
    except (Lost, OSError, TreeDGSError) as trouble:
        ending = Ending("disk" if is_full(str(trouble)) else "interrupted", str(trouble))
    taken = {"seconds": round(time.monotonic() - began, 2), "peak_gb": round(ending.peak_gb, 3), "host": host()}
    attempt.update(taken, outcome=ending.outcome, message=ending.message)
    may_retry = ending.outcome != "done" and record.may_run(key, job["series"])
    if ending.outcome == "done":
        record.status, record.result = "done", {**ending.result, **taken}
    elif ending.outcome != "interrupted" and not may_retry:
        record.status = "failed"
    try:
        lease.check()
        record.save()
    except Lost as trouble:
        return {"outcome": "interrupted", "message": str(trouble), "may_retry": True}
    except (OSError, TreeDGSError) as trouble:
        # A result that is not on disk does not count.
        ending = Ending("disk" if is_full(str(trouble)) else "setup", str(trouble))
    return {"outcome": ending.outcome, "message": ending.message, "seconds": taken["seconds"], "may_retry": may_retry}


def _engine(
    job: dict[str, Any], folder: Path, lease: Lease, stop: threading.Event, started: Callable[[EngineProcess], None]
) -> Ending:
    """Start the engine and watch it to its end."""
    import psutil

    if job["need_gb"] > job["limit_gb"]:
        return Ending(
            "too_large",
            f"needs about {job['need_gb']:.1f} GB of memory, this computer has {job['limit_gb']:.1f} GB for plots; use "
            "a larger machine, or a faster preset",
        )
    free = psutil.disk_usage(str(folder)).free / 1e9
    if free < job["disk_gb"]:
        return Ending(
            "disk",
            f"{folder}: {1000 * free:.0f} MB of disk are free, the plot needs about "
            f"{1000 * job['disk_gb']:.0f} MB; make room and run again",
        )
    process = EngineProcess(folder, {"folder": str(folder), "row": job["row"]}, job["threads"], folder / LOG, lease.key)
    started(process)
    try:
        while not process.ended(0.2):
            if stop.is_set():
                process.stop("interrupted", "the campaign was stopped")
                break
            try:
                lease.renew()
            except Lost as trouble:
                process.stop("interrupted", str(trouble))
                break
            process.watch_memory(job["need_gb"], job["limit_gb"])
    finally:
        process.kill()
    return process.ending()
