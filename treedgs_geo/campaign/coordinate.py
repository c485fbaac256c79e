"""Hands plots to the workers a few at a time and follows them to their end; keeps counts, not plots."""

from __future__ import annotations

import heapq
import queue
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..core.costs import time_text
from ..core.errors import TreeDGSError
from ..core.folder_lock import Busy, Lease
from ..core.progress import Reporter
from .clusters import Crew
from .places import RECORD, TREES
from .progress import Board
from .record import ELSEWHERE, RETRIES, Record
from .state import Campaign, Plan, job_of

#: Seconds until a plot that somebody else runs just now, or that failed, is looked at again.
BUSY_S, AGAIN_S = 3.0, 1.0
#: A plot whose worker died under it is handed out again this often by one coordinator.
MAX_TURNS = 40
#: Plots given up because their host is not set up, none having been done, after which the start is broken off.
MAX_STUCK = 4


class SchedulerLost(TreeDGSError):
    """The scheduler or all its workers are gone."""


@dataclass
class Tally:
    """What this start did. kept: finished before. failed: plots given up."""

    done: int = 0
    kept: int = 0
    failed: int = 0
    retried: int = 0
    interrupted: int = 0
    trees: int = 0
    measured: int = 0
    reasons: dict[str, int] = field(default_factory=dict)

    @property
    def settled(self) -> int:
        """Plots that need nothing more."""
        return self.done + self.kept + self.failed


@dataclass
class _Running:
    index: int
    job: dict[str, Any]
    since: float
    turns: int


class Coordinator:
    """One start of a campaign."""

    def __init__(
        self,
        plan: Plan,
        campaign: Campaign,
        crew: Crew,
        threads: int,
        time_limit_min: float,
        patience_s: float,
        reporter: Reporter,
        function: Callable[[dict[str, Any]], dict[str, Any]],
        renew: Callable[[], None],
    ) -> None:
        self.plan, self.campaign, self.crew, self.reporter = plan, campaign, crew, reporter
        self.threads, self.time_limit_min, self.patience_s = threads, time_limit_min, patience_s
        self.function, self.renew = function, renew
        self.tally = Tally()
        # The longest first: the last plots to end are short ones.
        self._order = iter(np.argsort(-plan.seconds, kind="stable").tolist())
        self._again: list[tuple[float, int, int, float]] = []
        self._running: dict[str, _Running] = {}
        self._ended: queue.SimpleQueue[tuple[str, Any]] = queue.SimpleQueue()
        self._futures: dict[str, Any] = {}
        self._exhausted, self._turn = False, 0
        self._no_crew_since: float | None = None
        self._reported_at = 0.0
        self._stuck = 0
        self.board = Board(plan, campaign, crew, reporter)

    def run(self) -> Tally:
        """Until every plot is settled.

        Raises:
            SchedulerLost: nobody is left to run plots; what was finished is kept.
        """
        with suppress(StopIteration):
            while True:
                self._fill()
                self._settle(0.4)
                self._watch()
                self.renew()
                self.board.show(self.tally, [(r.job, r.since) for r in self._running.values()])
                if self._exhausted and not self._again and not self._running:
                    break
        self.board.show(self.tally, [], last=True)
        return self.tally

    def _fill(self) -> None:
        """Keep the workers busy: a few plots more than they can run at once are handed out."""
        slots, largest, _ = self.crew.capacity()
        if not slots:
            return
        window = 2 * slots + 1
        while len(self._running) < window:
            following = self._next()
            if following is None:
                return
            index, turns, need = following
            entry = self.plan.entry(index)
            self._turn += 1
            job = job_of(entry, self.campaign, self._turn, self.threads, self.time_limit_min)
            job["need_gb"] = max(job["need_gb"], need)
            folder = Path(job["folder"])
            record = Record.read(folder) if (folder / RECORD).exists() else None
            if record is not None:
                if record.is_unchanged(job["stamp"], job["settings"]):
                    self.tally.kept += 1
                    self._count(record.result)
                    self.board.settled(index)
                    continue
                if record.status == "done" and not record.has_trees():
                    self.reporter.warn(f"{folder / TREES}: is missing or damaged; {job['plot_id']} is measured again.")
                peaks = [a.get("peak_gb", 0) for a in record.attempts if a.get("outcome") == "memory"]
                if peaks:
                    # It needed more than foreseen: declared from what was seen, doubled each time.
                    job["need_gb"] = min(max(job["need_gb"] * 2 ** len(peaks), 1.3 * max(peaks)), max(largest, need))
            if job["need_gb"] > largest:
                self._too_large(index, job, largest)
                continue
            future = self.crew.submit(self.function, job)
            self._running[future.key] = _Running(index, job, time.monotonic(), turns)
            self._futures[future.key] = future
            future.add_done_callback(lambda done: self._ended.put((done.key, done)))

    def _next(self) -> tuple[int, int, float] | None:
        """``(index, turns so far, memory)`` of the plot to hand out, or None for now."""
        now = time.monotonic()
        if self._again and self._again[0][0] <= now:
            _, index, turns, need = heapq.heappop(self._again)
            return index, turns, need
        if not self._exhausted:
            for index in self._order:
                return index, 0, 0.0
            self._exhausted = True
        return None

    def _settle(self, wait_s: float) -> None:
        """Take the answers that have come."""
        try:
            key, future = self._ended.get(timeout=wait_s)
        except queue.Empty:
            return
        while True:
            self._one(key, future)
            try:
                key, future = self._ended.get_nowait()
            except queue.Empty:
                return

    def _one(self, key: str, future: Any) -> None:
        running = self._running.pop(key, None)
        self._futures.pop(key, None)
        if running is None:
            return
        if future.status == "finished":
            try:
                answer = future.result(timeout=30)
            except Exception as problem:
                answer = {"outcome": "interrupted", "message": str(problem), "may_retry": True}
        elif future.status == "error":
            answer = {"outcome": "interrupted", "message": _error_of(future), "may_retry": True}
        else:
            answer = {"outcome": "interrupted", "message": "its worker or the scheduler was lost", "may_retry": True}
        with suppress(Exception):
            future.release()
        self._judge(running, answer)

    def _judge(self, running: _Running, answer: dict[str, Any]) -> None:
        outcome, plot_id = answer["outcome"], running.job["plot_id"]
        message = str(answer.get("message") or "").rstrip(".")
        if outcome in ("done", "kept"):
            record = Record.read(Path(running.job["folder"]))
            if record.status != "done":
                outcome, message = "setup", "its result is not in its folder"
            else:
                self.tally.done += outcome == "done"
                self.tally.kept += outcome == "kept"
                self._count(record.result)
                self.board.settled(running.index, answer.get("seconds") if outcome == "done" else None)
                if outcome == "done":
                    self.board.line(self.tally, plot_id, record.result)
                return
        if outcome == "busy":
            self._later(running, BUSY_S, count=False)
            return
        if outcome == "interrupted":
            self.tally.interrupted += 1
            if running.turns < MAX_TURNS and answer.get("may_retry", True):
                self._later(running, AGAIN_S)
                return
        elif running.turns < RETRIES if outcome in ELSEWHERE else answer.get("may_retry"):
            self.tally.retried += 1
            self.reporter.warn(f"{plot_id} failed and is tried again: {message}.")
            self._later(running, AGAIN_S)
            return
        self._give_up(running.index, plot_id, message)
        if outcome in ("setup", "missing"):
            self._stuck += 1
            if self._stuck >= MAX_STUCK and not self.tally.done:
                raise SchedulerLost(f"No plot can be run: {message}; correct that and run again.")

    def _later(self, running: _Running, seconds: float, count: bool = True) -> None:
        heapq.heappush(
            self._again, (time.monotonic() + seconds, running.index, running.turns + count, running.job["need_gb"])
        )

    def _give_up(self, index: int, plot_id: str, message: str) -> None:
        self.tally.failed += 1
        self.board.settled(index)
        self.reporter.warn(f"{plot_id} is given up: {message}.")

    def _too_large(self, index: int, job: dict[str, Any], largest: float) -> None:
        """No worker has the memory the plot declares: said, not tried."""
        message = (
            f"needs about {job['need_gb']:.1f} GB of memory, the largest worker has {largest:.1f} GB for plots; "
            "use a larger machine, or a faster preset"
        )
        with suppress(Busy, OSError, TreeDGSError):
            lease = Lease.take(Path(job["folder"]))
            try:
                record = Record.read(Path(job["folder"]))
                record.attempts.append(
                    {"series": job["series"], "key": "", "outcome": "memory", "message": message, "peak_gb": 0.0}
                )
                record.status = "failed"
                record.save()
            finally:
                lease.free()
        self._give_up(index, job["plot_id"], message)

    def _count(self, result: dict[str, Any]) -> None:
        self.tally.trees += int(result.get("n_trees") or 0)
        self.tally.measured += int(result.get("n_measured") or 0)
        for reason, number in (result.get("reasons") or {}).items():
            self.tally.reasons[reason] = self.tally.reasons.get(reason, 0) + number

    def _watch(self) -> None:
        """Notice that the scheduler or every worker has gone, and wait for it to come back."""
        self.crew.heal()
        if self.crew.alive() and self.crew.capacity()[0]:
            self._no_crew_since = None
            return
        now = time.monotonic()
        if self._no_crew_since is None:
            self._no_crew_since = self._reported_at = now
        waited = now - self._no_crew_since
        if not self.crew.alive():
            self.reporter.warn(f"The scheduler at {self.crew.address} is lost; waiting for it to come back.")
            lost = list(self._running.values())
            self._running.clear()
            self._futures.clear()
            if not self.crew.reconnect(self.patience_s):
                raise SchedulerLost(
                    f"The scheduler at {self.crew.address} was lost after {self.tally.settled} of {len(self.plan)} "
                    f"plots and did not come back within {time_text(self.patience_s)}; what was finished is kept, "
                    "start the scheduler and run again."
                )
            self.tally.interrupted += len(lost)
            for running in lost:
                self._later(running, AGAIN_S)
            self._no_crew_since = time.monotonic()
        elif now - self._reported_at > 20:
            self._reported_at = now
            self.reporter.info(f"No worker is connected to {self.crew.address}; waiting.")
        if waited > self.patience_s and not self._queued():
            raise SchedulerLost(
                f"No worker is connected to {self.crew.address} after {time_text(waited)}; start 'dask worker "
                f"{self.crew.address} --resources memory_gb=8' on each machine and run again."
            )

    def _queued(self) -> bool:
        """A batch queue may take hours to start its first job."""
        return self.crew.address in ("slurm", "pbs")


def _error_of(future: Any) -> str:
    try:
        problem = future.exception(timeout=10)
        return f"{type(problem).__name__}: {problem}"[:300]
    except Exception as problem:
        return str(problem)[:300]
