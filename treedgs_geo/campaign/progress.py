"""How far a campaign is: the reporter's fraction and lines, and ``status.txt``, a table anyone can watch."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.costs import time_text
from ..core.progress import Reporter
from .places import STATUS

if TYPE_CHECKING:
    from .coordinate import Running, Tally
    from .state import Campaign, Plan

#: Seconds between two tables.
EVERY_S = 2.0


class Board:
    """Live progress, weighted by what plots were predicted to cost and corrected by what they did cost.

    at_once: plots at once on this computer. shown: the table is written.
    """

    def __init__(self, plan: Plan, campaign: Campaign, at_once: int, reporter: Reporter, shown: bool = True) -> None:
        self.plan, self.campaign, self.at_once, self.reporter, self.shown = plan, campaign, at_once, reporter, shown
        self._total = float(plan.column("seconds").sum()) or 1.0
        self._settled = self._spent = self._foreseen = 0.0
        self._showed = 0.0

    def settled(self, index: int, seconds: float | None = None) -> None:
        """A plot needs nothing more. seconds: what it took, if it was run now."""
        self._settled += self.plan.entries[index]["seconds"]
        if seconds is not None:
            self._spent += seconds
            self._foreseen += self.plan.entries[index]["seconds"]

    def line(self, tally: Tally, plot_id: str, result: dict[str, Any]) -> None:
        """One finished plot, for the log."""
        accuracy = result.get("accuracy") or {}
        error = f", RMSE {accuracy['rmse_cm']:.2f} cm on {accuracy['n']}" if accuracy.get("rmse_cm") is not None else ""
        self.reporter.info(
            f"{tally.settled:>{len(str(len(self.plan)))}}/{len(self.plan)}  {plot_id}: {result['n_measured']} of "
            f"the {result['n_trees']} stems found measured, {time_text(result['seconds'])}, "
            f"{result['peak_gb']:.2f} GB{error}"
        )

    def show(self, tally: Tally, running: list[Running], last: bool = False) -> None:
        """Progress to the reporter, the table to ``status.txt``."""
        now = time.monotonic()
        if now - self._showed < EVERY_S and not last:
            return
        self._showed = now
        left = None
        if self._foreseen and not last:
            left = (self._total - self._settled) * self._spent / self._foreseen / self.at_once
        partly, rows = 0.0, []
        for plot in running:
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
        if self.shown:
            when = f"{self.at_once} plots at once on this computer; {time.strftime('%Y-%m-%d %H:%M:%S')}"
            write_text(self.campaign.workspace / STATUS, "\n".join([heading, when, "", *sorted(rows), ""]))


def write_text(target: Path, text: str) -> None:
    """Renamed into place; a table that cannot be written is not worth an error."""
    temporary = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, target)
    except OSError:
        temporary.unlink(missing_ok=True)
