"""The small process between a Dask worker and a plot's engine: holds the lease, keeps the record, watches memory.

Called as ``python -m treedgs_geo.campaign.supervise`` with the job as one JSON line on stdin, which then stays open:
when it closes, the worker is gone and the engine is ended. Loads nothing heavy, so it can always react. Answers with
one JSON line.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import sys
import threading
import time
from pathlib import Path
from typing import Any

from .. import __version__
from ..core.errors import TreeDGSError
from ..core.files import read_json
from ..core.folder_lock import Busy, Lease, Lost, host
from ..core.geopackage import move_aside
from ..core.resource_errors import is_full
from .engine_process import Ending, EngineProcess
from .inputs import content_key, input_files
from .manifest import own_field, own_plots
from .places import CAMPAIGN, LOG, PROGRESS, TREES
from .record import Record

#: Seconds to wait for a lease whose holder may be dying just now.
PATIENCE_S = 4.0


def supervise(job: dict[str, Any], orphaned: threading.Event) -> dict[str, Any]:
    """Run one plot if it has to run.

    job: ``plot_id, folder, workspace, campaign, version, series, settings`` (hash), ``stamp, row, threads, need_gb,
    limit_gb, disk_gb, time_limit_min``. Returns ``{"outcome", "message", …}``; outcome ``kept`` = was done already,
    ``done``, ``busy``, ``given_up``, or how it failed.
    """
    folder = Path(job["folder"])
    problem = _same_campaign(job)
    if problem:
        return {"outcome": "setup", "message": problem}
    try:
        lease = _take(folder)
    except Busy as busy:
        return {"outcome": "busy", "message": f"is being run by {busy}"}
    except OSError as trouble:
        kind = "disk" if is_full(str(trouble)) else "setup"
        return {"outcome": kind, "message": f"{folder} cannot be written on {host()} ({trouble.strerror})"}
    try:
        return _run(job, folder, lease, orphaned)
    finally:
        lease.free()


def _run(job: dict[str, Any], folder: Path, lease: Lease, orphaned: threading.Event) -> dict[str, Any]:
    record = Record.read(folder)
    if record.is_unchanged(job["stamp"], job["settings"]):
        return {"outcome": "kept"}
    row = job["row"]
    try:
        # Of tables that serve many plots, only this plot's lines count.
        lines = json.dumps([own_plots(row), own_field(row)], sort_keys=True)
        files = content_key(input_files(row["route"], row["values"], "", ""))
        key = f"{job['settings']}:{files}:{hashlib.sha256(lines.encode()).hexdigest()[:16]}"
    except (OSError, TreeDGSError) as trouble:
        return {
            "outcome": "setup",
            "message": f"an input cannot be read on {host()} ({trouble}); every worker needs "
            "the inputs under the same path",
        }
    if record.is_done(key):
        record.stamp = job["stamp"]
        record.save()
        return {"outcome": "kept"}
    if not record.may_run(key, job["series"]):
        _fail(record, key, job)
        return {"outcome": "given_up", "message": record.last_problem()}
    attempt = {"series": job["series"], "key": key, "host": host(), "outcome": None, "began": round(time.time(), 2)}
    record.attempts.append(attempt)
    record.status, record.key, record.stamp = "new", key, job["stamp"]
    began = time.monotonic()
    try:
        record.save()
        lease.check()
        if (folder / TREES).exists() and not record.has_trees():
            move_aside(folder / TREES)
        ending = _engine(job, folder, lease, orphaned)
    except (Lost, OSError, TreeDGSError) as trouble:
        ending = Ending("disk" if is_full(str(trouble)) else "interrupted", str(trouble))
    attempt.update(
        outcome=ending.outcome,
        message=ending.message,
        seconds=round(time.monotonic() - began, 2),
        peak_gb=round(ending.peak_gb, 3),
        cpu_s=ending.cpu_s,
    )
    answer = {
        "outcome": ending.outcome,
        "message": ending.message,
        "seconds": attempt["seconds"],
        "peak_gb": attempt["peak_gb"],
        "host": host(),
        "failed": 0,
    }
    if ending.outcome == "done":
        taken = {name: attempt[name] for name in ("seconds", "cpu_s", "peak_gb", "host")}
        record.status, record.result = "done", {**ending.result, **taken}
        answer["n_trees"], answer["n_measured"] = ending.result["n_trees"], ending.result["n_measured"]
    elif ending.outcome != "interrupted" and not record.may_run(key, job["series"]):
        record.status = "failed"
    answer["failed"] = record.counts(key, job["series"])[0]
    answer["may_retry"] = ending.outcome != "done" and record.may_run(key, job["series"])
    try:
        lease.check()
        record.save()
    except Lost as trouble:
        return {"outcome": "interrupted", "message": str(trouble), "may_retry": True}
    except (OSError, TreeDGSError) as trouble:
        # A result that is not on disk does not count.
        return {
            **answer,
            "outcome": "disk" if is_full(str(trouble)) else "setup",
            "message": str(trouble),
            "unrecorded": True,
        }
    return answer


def _engine(job: dict[str, Any], folder: Path, lease: Lease, orphaned: threading.Event) -> Ending:
    """Start the engine and watch it to its end."""
    import psutil

    free = psutil.disk_usage(str(folder)).free / 1e9
    if free < job["disk_gb"]:
        return Ending(
            "disk",
            f"{folder}: {1000 * free:.0f} MB of disk are free, the plot needs about "
            f"{1000 * job['disk_gb']:.0f} MB; make room and run again",
        )
    process = EngineProcess(folder, {"folder": str(folder), "row": job["row"]}, job["threads"], folder / LOG, lease.key)
    limit_s = 60 * job["time_limit_min"] if job["time_limit_min"] else float("inf")
    began = reported = time.monotonic()
    try:
        while not process.ended(0.2):
            now = time.monotonic()
            if orphaned.is_set():
                process.stop("interrupted", "its worker ended")
                break
            try:
                lease.renew()
            except Lost as trouble:
                process.stop("interrupted", str(trouble))
                break
            process.watch_memory(job["need_gb"], job["limit_gb"])
            if now - began > limit_s:
                process.stop("timeout", f"took longer than the limit of {job['time_limit_min']:g} minutes")
                break
            if now - reported > 2:
                reported = now
                _report(folder, process, now - began)
    finally:
        process.kill()
        (folder / PROGRESS).unlink(missing_ok=True)
    return process.ending()


def _report(folder: Path, process: EngineProcess, seconds: float) -> None:
    """Progress for the coordinator's table; not worth an error."""
    with contextlib.suppress(OSError):
        (folder / PROGRESS).write_text(
            json.dumps(
                {
                    "stage": process.stage,
                    "fraction": process.fraction,
                    "seconds": round(seconds),
                    "host": host(),
                    "peak_gb": round(process.peak_gb, 2),
                }
            ),
            encoding="utf-8",
        )


def _take(folder: Path) -> Lease:
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        try:
            return Lease.take(folder)
        except Busy:
            time.sleep(0.3)
    return Lease.take(folder)


def _same_campaign(job: dict[str, Any]) -> str:
    """Why this host cannot work for the campaign, or ''."""
    if job["version"] != __version__:
        return f"{host()} has TreeDGS {__version__}, the campaign was started with {job['version']}; install the same"
    try:
        found = read_json(Path(job["workspace"]) / CAMPAIGN)
        if found.get("uuid") == job["campaign"]:
            return ""
    except TreeDGSError:
        pass
    return (
        f"{host()} does not see the campaign's folder {job['workspace']}; mount the shared folder under the same path"
    )


def _fail(record: Record, key: str, job: dict[str, Any]) -> None:
    record.status, record.key, record.stamp = "failed", key, job["stamp"]
    with contextlib.suppress(OSError, TreeDGSError):
        record.save()


def main() -> None:
    """Read the job, run, answer."""
    orphaned = threading.Event()
    answer = sys.stdout
    sys.stdout = sys.stderr
    job = json.loads(sys.stdin.buffer.readline())

    def watch() -> None:
        while sys.stdin.buffer.read(64):
            pass
        orphaned.set()

    threading.Thread(target=watch, daemon=True).start()
    found = supervise(job, orphaned)
    try:
        answer.write(json.dumps(found) + "\n")
        answer.flush()
    except OSError:
        pass  # nobody listens any more; the record has it
    sys.stderr.flush()
    # The watching thread sits in a read that nothing ends.
    os._exit(0)


if __name__ == "__main__":
    main()
