"""How far a campaign is: the reporter's fraction and lines, and ``status.txt``, a table anyone can watch."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.costs import time_text
from ..core.progress import Reporter
from .places import PROGRESS, STATUS

if TYPE_CHECKING:
    from .clusters import Crew
    from .coordinate import Tally
    from .state import Campaign, Plan

#: Seconds between two tables.
EVERY_S = 2.0


class Board:
    """Live progress, weighted by what plots were predicted to cost and corrected by what they did cost."""

    def __init__(self, plan: Plan, campaign: Campaign, crew: Crew, reporter: Reporter) -> None:
        self.plan, self.campaign, self.crew, self.reporter = plan, campaign, crew, reporter
        self._total = float(plan.seconds.sum()) or 1.0
        self._settled = self._spent = self._foreseen = 0.0
        self._shown = 0.0

    def settled(self, index: int, seconds: float | None = None) -> None:
        """A plot needs nothing more. seconds: what it took, if it was run now."""
        self._settled += float(self.plan.seconds[index])
        if seconds is not None:
            self._spent += seconds
            self._foreseen += float(self.plan.seconds[index])

    def line(self, tally: Tally, plot_id: str, result: dict[str, Any]) -> None:
        """One finished plot, for the log."""
        accuracy = result.get("accuracy") or {}
        error = f", RMSE {accuracy['rmse_cm']:.2f} cm on {accuracy['n']}" if accuracy.get("rmse_cm") is not None else ""
        self.reporter.info(
            f"{tally.settled:>{len(str(len(self.plan)))}}/{len(self.plan)}  {plot_id}: {result['n_measured']} of "
            f"the {result['n_trees']} stems found measured, {time_text(result['seconds'])}, "
            f"{result['peak_gb']:.2f} GB{error}"
        )

    def left_s(self, slots: int) -> float | None:
        """Seconds left, or None before the first plot has ended."""
        if not self._foreseen:
            return None
        return (self._total - self._settled) * self._spent / self._foreseen / max(slots, 1)

    def show(self, tally: Tally, running: list[tuple[dict[str, Any], float]], last: bool = False) -> None:
        """Progress to the reporter, the table to ``status.txt``."""
        now = time.monotonic()
        if now - self._shown < EVERY_S and not last:
            return
        self._shown = now
        slots = self.crew.capacity()[0]
        left = None if last else self.left_s(slots)
        rows, partly = [], 0.0
        for job, since in running:
            found = _progress_of(Path(job["folder"]))
            if found is None:
                rows.append(("waiting for a worker", job["plot_id"], "", "", ""))
                continue
            partly += min(float(found.get("fraction", 0)), 1.0)
            rows.append(
                (
                    f"{found.get('stage') or 'starting'} {100 * found.get('fraction', 0):.0f} %",
                    job["plot_id"],
                    time_text(now - since),
                    f"{found.get('peak_gb', 0):.2f} GB",
                    found.get("host", ""),
                )
            )
        mean = self._total / max(len(self.plan), 1)
        message = f"{tally.settled} of {len(self.plan)} plots" + (f", about {time_text(left)} left" if left else "")
        self.reporter.progress(min((self._settled + partly * mean) / self._total, 1.0), message)
        lines = [
            f"{message}; {tally.done} done now, {tally.kept} done before, {tally.failed} failed, "
            f"{tally.retried} retries, {tally.interrupted} interruptions; {tally.measured} of the {tally.trees} stems "
            "found measured",
            f"workers: {slots} plots at once at {self.crew.address}; dashboard: {self.crew.dashboard or 'off'}; "
            f"{time.strftime('%Y-%m-%d %H:%M:%S')}",
            "",
        ]
        lines += [
            f"{plot:<24.24} {stage:<28.28} {spent:>8} {memory:>9}  {place}"
            for stage, plot, spent, memory, place in sorted(rows)
        ]
        write_text(self.campaign.workspace / STATUS, "\n".join(lines) + "\n")


def _progress_of(folder: Path) -> dict[str, Any] | None:
    try:
        found = json.loads((folder / PROGRESS).read_text(encoding="utf-8"))
        return found if isinstance(found, dict) else None
    except (OSError, ValueError):
        return None


def write_text(target: Path, text: str) -> None:
    """Renamed into place; a table that cannot be written is not worth an error."""
    temporary = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, target)
    except OSError:
        temporary.unlink(missing_ok=True)
