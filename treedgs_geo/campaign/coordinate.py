"""Hands plots to threads, each of which watches an engine of its own, and follows them to their end; how far it is: the
reporter's fraction and lines, and ``status.txt``, a table anyone can watch."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..core.costs import time_text
from ..core.errors import OutputError, TreeDGSError
from ..core.files import atomic_path
from ..core.progress import Reporter
from .engine_process import EngineProcess
from .places import STATUS, TREES, plot_folder
from .state import Campaign, Plan
from .supervise import ELSEWHERE, RETRIES, Record, run_plot

#: Seconds until a plot that somebody else runs just now, or that failed, is looked at again.
BUSY_S, AGAIN_S = 3.0, 1.0
#: Plots given up because this computer is not set up, none having been done, after which the start is broken off.
MAX_STUCK = 4
#: Seconds between two tables.
EVERY_S = 2.0


@dataclass(frozen=True)
class Capacity:
    """plots: at once. memory_gb: for all of them together. threads: of each."""

    plots: int
    memory_gb: float
    threads: int = 1


@dataclass
class Tally:
    """What was done since this start, here or by a computer that joined. kept: finished before. failed: given up."""

    done: int = 0
    kept: int = 0
    failed: int = 0
    retried: int = 0
    interrupted: int = 0
    trees: int = 0
    measured: int = 0
    reasons: Counter[str] = field(default_factory=Counter)

    @property
    def settled(self) -> int:
        """Plots that need nothing more."""
        return self.done + self.kept + self.failed


@dataclass
class Running:
    """A plot that is run here. since: of the monotonic clock. engine: None until it has started."""

    index: int
    job: dict[str, Any]
    since: float
    engine: EngineProcess | None = None

    def started(self, engine: EngineProcess) -> None:
        """Its engine runs."""
        self.engine = engine


class Coordinator:
    """One start of a campaign. Its progress is weighted by what plots were predicted to cost and corrected by what they
    did cost.

    renew: called all the time, for the campaign's lease. joined: another process leads it: what that one runs, and the
    table, is left to it. function: what is done with a plot's job.
    """

    def __init__(
        self,
        plan: Plan,
        campaign: Campaign,
        capacity: Capacity,
        reporter: Reporter,
        renew: Callable[[], None] = lambda: None,
        joined: bool = False,
        function: Callable[..., dict[str, Any]] = run_plot,
    ) -> None:
        self.plan, self.campaign, self.capacity, self.reporter = plan, campaign, capacity, reporter
        self.function, self.renew, self.joined = function, renew, joined
        self.tally = Tally()
        self._stop = threading.Event()
        # The longest first: the last plots to end are short ones. Index -> when it may be handed out.
        self._waiting = dict.fromkeys(np.argsort(-plan.column("seconds"), kind="stable").tolist(), 0.0)
        self._running: dict[Future, Running] = {}
        self._need_gb = plan.column("memory_gb").copy()
        self._tries: Counter[int] = Counter()
        self._stuck, self._began = 0, time.time()
        # Seconds as predicted: of all plots, of those that need nothing more, and of those run now; what these took.
        self._total = float(plan.column("seconds").sum()) or 1.0
        self._settled = self._foreseen = self._spent = 0.0
        self._showed = 0.0

    def run(self) -> Tally:
        """Until every plot is settled.

        Raises:
            TreeDGSError: no plot can be run on this computer.
        """
        with ThreadPoolExecutor(self.capacity.plots) as pool:
            try:
                while self._waiting or self._running:
                    self._fill(pool)
                    if not self._running:
                        time.sleep(0.2)
                    for ended in wait(self._running, 0.4, FIRST_COMPLETED).done:
                        self._judge(self._running.pop(ended), ended)
                    self.renew()
                    if time.monotonic() - self._showed >= EVERY_S:
                        self._show()
            finally:
                self._stop.set()
        self._show()
        return self.tally

    def _fill(self, pool: ThreadPoolExecutor) -> None:
        """Hand out plots while there are threads and memory for them."""
        for index, at in list(self._waiting.items()):
            free_gb = self.capacity.memory_gb - sum(running.job["need_gb"] for running in self._running.values())
            if len(self._running) == self.capacity.plots:
                return
            room = self._need_gb[index] <= free_gb or self._need_gb[index] > self.capacity.memory_gb
            if at > time.monotonic() or (self._running and not room):
                continue
            del self._waiting[index]
            job = self._job(self.plan.entries[index])
            record = Record.read(Path(job["folder"]))
            if record.is_unchanged(job["stamp"], job["settings"]):
                self._finished(index, record)
                continue
            if record.status == "done" and not record.has_trees():
                self.reporter.warn(
                    f"{Path(job['folder']) / TREES}: is missing or damaged; {job['plot_id']} is measured again."
                )
            if peaks := [a.get("peak_gb", 0) for a in record.attempts if a.get("outcome") == "memory"]:
                # It needed more than foreseen: declared from what was seen, doubled each time.
                seen = max(job["need_gb"] * 2 ** len(peaks), 1.3 * max(peaks))
                job["need_gb"] = min(seen, max(self.capacity.memory_gb, job["need_gb"]))
            self._need_gb[index] = job["need_gb"]
            if self._running and free_gb < job["need_gb"] <= self.capacity.memory_gb:
                self._waiting[index] = 0.0
            else:
                running = Running(index, job, time.monotonic())
                self._running[pool.submit(self.function, job, self._stop, running.started)] = running

    def _job(self, entry: dict[str, Any]) -> dict[str, Any]:
        """What :func:`.supervise.run_plot` needs to know of a plot."""
        return {
            "plot_id": entry["row"]["plot_id"],
            "folder": str(plot_folder(self.campaign.workspace.resolve(), entry["row"]["plot_id"])),
            "series": self.campaign.record["series"],
            "settings": entry["settings"],
            "stamp": entry["inputs"]["stamp"],
            "row": entry["row"],
            "need_gb": entry["memory_gb"],
            "limit_gb": self.capacity.memory_gb,
            "disk_gb": entry["disk_gb"],
            "threads": self.capacity.threads,
        }

    def _judge(self, running: Running, ended: Future) -> None:
        index, plot_id = running.index, running.job["plot_id"]
        try:
            answer = ended.result()
        except Exception as problem:
            answer = {"outcome": "setup", "message": f"{type(problem).__name__}: {problem}"[:300]}
        outcome, message = answer["outcome"], str(answer.get("message") or "").rstrip(".")
        if outcome in ("done", "kept"):
            record = Record.read(Path(running.job["folder"]))
            if record.status == "done":
                self._finished(index, record)
                return
            outcome, message = "setup", "its result is not in its folder"
        if outcome == "busy":
            if not self.joined:
                self._waiting[index] = time.monotonic() + BUSY_S
            return
        again = answer.get("may_retry")
        if outcome in ELSEWHERE:
            again = outcome != "too_large" and self._tries[index] < RETRIES
            self._tries[index] += 1
        if again:
            self._waiting[index] = time.monotonic() + AGAIN_S
            if outcome == "interrupted":
                self.tally.interrupted += 1
            else:
                self.tally.retried += 1
                self.reporter.warn(f"{plot_id} failed and is tried again: {message}.")
            return
        self.tally.failed += 1
        self._settled += self.plan.entries[index]["seconds"]
        self.reporter.warn(f"{plot_id} is given up: {message}.")
        if outcome in ("setup", "missing"):
            self._stuck += 1
            if self._stuck >= MAX_STUCK and not self.tally.done:
                raise TreeDGSError(f"No plot can be run: {message}; correct that and run again.")

    def _finished(self, index: int, record: Record) -> None:
        result, entry = record.result, self.plan.entries[index]
        new = any(a.get("outcome") == "done" and a.get("began", 0.0) >= self._began - 1 for a in record.attempts)
        self.tally.done += new
        self.tally.kept += not new
        self.tally.trees += int(result.get("n_trees") or 0)
        self.tally.measured += int(result.get("n_measured") or 0)
        self.tally.reasons.update(result.get("reasons") or {})
        self._settled += entry["seconds"]
        if not new:
            return
        self._spent += result["seconds"]
        self._foreseen += entry["seconds"]
        accuracy = result.get("accuracy") or {}
        error = f", RMSE {accuracy['rmse_cm']:.2f} cm on {accuracy['n']}" if accuracy.get("rmse_cm") is not None else ""
        self.reporter.info(
            f"{self.tally.settled:>{len(str(len(self.plan)))}}/{len(self.plan)}  {entry['row']['plot_id']}: "
            f"{result['n_measured']} of the {result['n_trees']} stems found measured, {time_text(result['seconds'])}, "
            f"{result['peak_gb']:.2f} GB{error}"
        )

    def _show(self) -> None:
        """Progress to the reporter, the table to ``status.txt``."""
        tally, now, at_once = self.tally, time.monotonic(), self.capacity.plots
        self._showed = now
        left = None
        if self._foreseen and (self._waiting or self._running):
            left = (self._total - self._settled) * self._spent / self._foreseen / at_once
        partly, rows = 0.0, []
        for plot in self._running.values():
            engine, name = plot.engine, plot.job["plot_id"]
            if engine is not None:
                partly += min(engine.fraction, 1.0) * self.plan.entries[plot.index]["seconds"]
            stage = "starting" if engine is None else f"{engine.stage or 'starting'} {100 * engine.fraction:.0f} %"
            memory = f"{engine.peak_gb if engine else 0:.2f} GB"
            rows.append(f"{name:<24.24} {stage:<28.28} {time_text(now - plot.since):>8} {memory:>9}")
        message = f"{tally.settled} of {len(self.plan)} plots" + (f", about {time_text(left)} left" if left else "")
        self.reporter.progress(min((self._settled + partly) / self._total, 1.0), message)
        heading = (
            f"{message}; {tally.done} done now, {tally.kept} done before, {tally.failed} failed, {tally.retried} "
            f"retries, {tally.interrupted} interruptions; {tally.measured} of the {tally.trees} stems found measured"
        )
        if not self.joined:
            when = f"{at_once} plots at once on this computer; {time.strftime('%Y-%m-%d %H:%M:%S')}"
            write_text(self.campaign.workspace / STATUS, "\n".join([heading, when, "", *sorted(rows), ""]))


def write_text(target: Path, text: str) -> None:
    """Whole or not at all; a table that cannot be written is not worth an error."""
    with suppress(OutputError), atomic_path(target) as temporary:
        temporary.write_text(text, encoding="utf-8")
