"""The engine's whole family of processes: begun as one, ended as one. Standard library only."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import suppress
from typing import Any

from .pythons import no_window
from .windows_job import Job

#: Seconds between asking a process group to stop and killing it.
GRACE_S = 1.2


def own_group() -> dict[str, Any]:
    """Arguments of ``Popen``: a group of its own, without a console window."""
    if sys.platform == "win32":
        return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP | subprocess.CREATE_NO_WINDOW}
    return {"start_new_session": True}


def stop_group(process: subprocess.Popen, job: Job | None = None) -> None:
    """End the child and everything it started: ask, wait, kill. Returns within 2 s.

    job: what holds them on Windows.
    """
    if sys.platform == "win32":
        # Also when the engine itself has ended: its own children must not outlive it.
        if not (job and job.end()) and process.poll() is None:
            taskkill = os.path.join(os.environ.get("SYSTEMROOT", r"C:\Windows"), "System32", "taskkill.exe")
            with suppress(OSError):
                subprocess.run([taskkill, "/T", "/F", "/PID", str(process.pid)], capture_output=True, **no_window())
        return
    group = process.pid
    if process.poll() is None:
        _signal_group(group, signal.SIGTERM)
        with suppress(subprocess.TimeoutExpired):
            process.wait(GRACE_S)
    # Also when the engine itself has ended: its own children must not outlive it.
    _signal_group(group, signal.SIGKILL)
    with suppress(subprocess.TimeoutExpired):
        process.wait(1)


def _signal_group(group: int, number: int) -> None:
    if sys.platform == "win32":
        return
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(group, number)
