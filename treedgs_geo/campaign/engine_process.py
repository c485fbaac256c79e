"""One engine child: started, listened to, measured, ended with everything it started."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..core.children import python_command, was_killed
from ..core.files import FULL_BYTES, free_bytes, remove_leftovers, write_json
from ..core.folder_lock import HANDED
from ..core.resource_errors import is_full

#: What libraries read to know how many threads they may start.
THREADS = (
    "TREEDGS_THREADS", "NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS", "OPENCV_FOR_THREADS_NUM", "VECLIB_MAXIMUM_THREADS",
)  # fmt: skip
#: Below this share of the machine's memory a plot that uses more than it declared is ended before the machine swaps.
_LOW_MEMORY = 0.04
_EXITS = {2: "input", 3: "missing", 4: "memory", 130: "interrupted"}


@dataclass
class Ending:
    """How the engine ended. outcome: ``done`` or a kind of failure; message: one sentence."""

    outcome: str
    message: str = ""
    result: dict[str, Any] = field(default_factory=dict)
    peak_gb: float = 0.0


class EngineProcess:
    """The engine of one plot."""

    def __init__(self, folder: Path, job: dict[str, Any], threads: int, log: Path, lease_key: str) -> None:
        self.folder, self.stage, self.fraction, self.peak_gb = folder, "", 0.0, 0.0
        self._result: dict[str, Any] | None = None
        self._sentence = ""
        self._stopped: tuple[str, str] | None = None
        self._measured = 0.0
        file = folder / "job.json"
        write_json(file, job)
        group: dict[str, Any] = {"start_new_session": True}
        if sys.platform == "win32":
            group = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP | subprocess.CREATE_NO_WINDOW}
        environment = {**os.environ, **dict.fromkeys(THREADS, str(threads)), HANDED: lease_key}
        with open(log, "w", encoding="utf-8") as stream:
            self._process = subprocess.Popen(
                python_command("treedgs_geo.campaign.plot", file),
                cwd=folder,
                env=environment,
                stdin=subprocess.PIPE,  # its end shows the engine that this process is gone
                stdout=subprocess.PIPE,
                stderr=stream,
                **group,
            )
        self._reader = threading.Thread(target=self._listen, daemon=True)
        self._reader.start()

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for raw in self._process.stdout:
            try:
                message = json.loads(raw)
            except ValueError:
                continue
            kind = message.get("t") if isinstance(message, dict) else None
            if kind == "progress":
                self.fraction = float(message.get("fraction", 0))
            elif kind == "stage":
                self.stage = str(message.get("name", ""))
            elif kind == "error":
                self._sentence = str(message.get("message", ""))
            elif kind == "result":
                self._result = message.get("result") or {}

    def ended(self, wait_s: float) -> bool:
        """Whether the engine has ended, after waiting up to ``wait_s``."""
        try:
            self._process.wait(wait_s)
            return True
        except subprocess.TimeoutExpired:
            return False

    def watch_memory(self, need_gb: float, limit_gb: float) -> None:
        """Measure the engine and its children once a second; end it when it would make the machine swap."""
        import psutil

        now = time.monotonic()
        if now - self._measured < 1:
            return
        self._measured = now
        gigabytes = 0.0
        with contextlib.suppress(psutil.Error):
            engine = psutil.Process(self._process.pid)
            for part in (engine, *engine.children(recursive=True)):
                with contextlib.suppress(psutil.Error):
                    gigabytes += part.memory_info().rss / 1e9
        self.peak_gb = max(self.peak_gb, gigabytes)
        if gigabytes > limit_gb:
            self.stop(
                "memory",
                f"used {gigabytes:.1f} GB of memory, {limit_gb:.1f} GB are there for plots; run it on a "
                "larger machine, with a faster preset or fewer photos",
            )
        memory = psutil.virtual_memory()
        if gigabytes > need_gb and memory.available < _LOW_MEMORY * memory.total:
            self.stop(
                "memory",
                f"used {gigabytes:.1f} GB of memory where {need_gb:.1f} GB were foreseen, and the "
                "machine had none left; run fewer plots at once or a faster preset",
            )

    def stop(self, outcome: str, message: str) -> None:
        """End the engine for a reason of ours."""
        self._stopped = self._stopped or (outcome, message)
        self.kill()

    def kill(self) -> None:
        """End the engine and everything it started."""
        import psutil

        parts: list[psutil.Process] = []
        with contextlib.suppress(psutil.Error):
            parts = psutil.Process(self._process.pid).children(recursive=True)
        if sys.platform != "win32":
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)
        elif self._process.poll() is None:
            self._process.kill()
        for part in parts:
            with contextlib.suppress(psutil.Error):
                part.kill()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(10)
        self._reader.join(5)

    def ending(self) -> Ending:
        """Outcome, in words, with what it took."""
        code, full = self._process.poll(), free_bytes(self.folder) < FULL_BYTES
        remove_leftovers(self.folder)
        if self._stopped:
            return Ending(*self._stopped, peak_gb=self.peak_gb)
        if code == 0 and self._result is not None:
            return Ending("done", "", self._result, self.peak_gb)
        message = self._sentence or _last_line(self.folder / "engine.log")
        if full or is_full(message):
            sentence = f"{self.folder}: the disk is full; make room and run again ({message})"
            return Ending("disk", sentence, peak_gb=self.peak_gb)
        return Ending(*explain(code, message), peak_gb=self.peak_gb)


def explain(code: int | None, message: str) -> tuple[str, str]:
    """``(outcome, sentence)`` of an exit code."""
    if code is None:
        return "crash", "the engine did not end when it was killed"
    if was_killed(code):
        return "memory", "was killed by the system, most likely because memory ran out"
    if code == -signal.SIGTERM:
        return "interrupted", "was stopped from outside"
    if code < 0 or code in (134, 139):
        number = -code if code < 0 else code - 128
        try:
            name = signal.Signals(number).name
        except ValueError:
            name = f"signal {number}"
        return "crash", f"the engine crashed ({name}); see engine.log in the plot's folder"
    return _EXITS.get(code, "defect"), message or f"the engine ended with code {code}"


def _last_line(log: Path) -> str:
    try:
        text = log.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
    return next(filter(None, map(str.strip, reversed(text.splitlines()))), "")[:300]
