"""What a dry run found, and what the job would need of this machine."""

from __future__ import annotations

import os
import shutil
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..core.errors import InputError, TreeDGSError
from ..core.files import check_name
from ..core.geopackage import ensure_unlocked
from ..core.machine import cores
from ..core.progress import Reporter
from ..inventory.tree_layer import OWN_LAYERS


@dataclass
class Findings:
    """What is wrong (the job would fail), and what may cost accuracy or trees."""

    reporter: Reporter
    problems: list[str] = field(default_factory=list)
    warnings: int = 0

    def problem(self, sentence: str) -> None:
        """Something that has to be corrected first."""
        self.problems.append(sentence)
        self.reporter.warn(sentence)

    def warning(self, sentence: str) -> None:
        """Something to know."""
        self.warnings += 1
        self.reporter.warn(sentence)

    def conclude(self, facts: dict[str, Any], needs: Needs) -> dict[str, Any]:
        """Machine against needs, then the verdict.

        Raises:
            InputError: there is a problem; all of them were reported, the first one is the sentence.
        """
        needs.compare(self)
        if self.problems:
            more = f" (and {len(self.problems) - 1} more, above)" if len(self.problems) > 1 else ""
            raise InputError(f"{self.problems[0]}{more}")
        status = f"ready: {needs.time_text()}" + (f"; {self.warnings} warnings, see above" if self.warnings else "")
        self.reporter.info(f"Dry run: {status}. Nothing was written.")
        return {
            **facts,
            "predicted_s": round(needs.seconds),
            "needed_memory_gb": round(needs.memory_gb, 1),
            "needed_disk_gb": round(needs.disk_gb, 1),
            "status": status,
        }


@dataclass(frozen=True)
class Needs:
    """seconds on this machine, memory and disk in GB, and where the disk is needed. more_s: seconds that come on top
    where the cheap way turns out not to be good enough."""

    seconds: float
    memory_gb: float
    disk_gb: float
    folder: Path
    more_s: float = 0.0

    def time_text(self) -> str:
        """A range: the estimate is good to a factor of two at best."""
        low, high = self.seconds / 1.6, max(self.seconds * 1.6, (self.seconds + self.more_s) * 1.2)
        if high < 90:
            return f"about {max(low, 1):.0f} to {max(high, 2):.0f} seconds"
        if high < 5400:
            return f"about {max(low / 60, 1):.0f} to {high / 60 + 0.5:.0f} minutes"
        return f"about {low / 3600:.1f} to {high / 3600:.1f} hours"

    def compare(self, findings: Findings) -> None:
        """Warn where this machine has less than the job needs."""
        import psutil

        memory = psutil.virtual_memory().available / 1e9
        disk = shutil.disk_usage(_existing(self.folder)).free / 1e9
        findings.reporter.info(
            f"Memory: about {self.memory_gb:.1f} GB needed, {memory:.1f} GB free. Disk: about {self.disk_gb:.1f} GB "
            f"needed, {disk:.0f} GB free at {_existing(self.folder)}. Time: {self.time_text()} on {cores()} cores."
        )
        if memory < self.memory_gb:
            findings.warning(
                f"About {self.memory_gb:.1f} GB of memory are needed and {memory:.1f} GB are free: close other "
                "programs, or choose the preset fast or fewer photos."
            )
        if disk < self.disk_gb:
            findings.problem(
                f"{_existing(self.folder)}: {disk:.1f} GB of disk are free, about {self.disk_gb:.1f} GB are needed; "
                "make room or choose a workspace on another disk."
            )


def check_target(target: Path, findings: Findings) -> None:
    """Without making the folder: the nearest one that exists has to be writable; an open edit session is reported."""
    try:
        check_name(target)
    except TreeDGSError as problem:
        findings.problem(str(problem))
        return
    folder = _existing(target.parent)
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        findings.problem(f"{target}: the folder {folder} cannot be written; choose another output folder.")
        return
    try:
        ensure_unlocked(target, OWN_LAYERS)
    except TreeDGSError as problem:
        findings.problem(str(problem))


def _existing(path: Path) -> Path:
    path = Path(path).absolute()
    while not os.path.exists(path) and path != path.parent:
        path = path.parent
    return path
