"""What a chain is made of: stages that know their checks, cost, work and outputs, and are done again only where
something they depend on has changed; one runner, one dry run."""

from __future__ import annotations

import json
import operator
import os
import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from .. import __version__
from ..core.errors import InputError, TreeDGSError
from ..core.files import check_name, fingerprint, short_hash
from ..core.geopackage import ensure_unlocked, move_aside
from ..core.machine import cores, release_memory
from ..core.progress import Collector, Reporter
from ..core.workspace import Workspace, peak_memory_mb
from ..inventory.tree_layer import OWN_LAYERS

#: What a chain carries from stage to stage.
J = TypeVar("J")


@dataclass(frozen=True)
class Cost:
    """What a stage needs, roughly. seconds: on this machine. more_s: on top, where its cheap way turns out not to be
    good enough. memory_gb, disk_gb: GB."""

    seconds: float = 0.0
    memory_gb: float = 0.0
    disk_gb: float = 0.0
    more_s: float = 0.0

    def __add__(self, other: Cost) -> Cost:
        return Cost(*map(operator.add, astuple(self), astuple(other)))

    def time_text(self) -> str:
        """A range: the estimate is good to a factor of two at best."""
        low, high = self.seconds / 1.6, max(self.seconds * 1.6, (self.seconds + self.more_s) * 1.2)
        if high < 90:
            return f"about {max(low, 1):.0f} to {max(high, 2):.0f} seconds"
        if high < 5400:
            return f"about {max(low / 60, 1):.0f} to {high / 60 + 0.5:.0f} minutes"
        return f"about {low / 3600:.1f} to {high / 3600:.1f} hours"


@dataclass(frozen=True)
class Key:
    """What the outcome of a stage depends on. settings: values. files: by their content."""

    settings: dict[str, Any] = field(default_factory=dict)
    files: Sequence[Path] = ()


@dataclass(frozen=True)
class Stage(Generic[J]):
    """A stage of a chain.

    name: in ``run.json``, and what users read. share: of a usual run's time; only the progress bar depends on it.
    run: ``(job, reporter) -> result`` does the work: fills the job or writes the outputs; the result, if any, is JSON.
    checks: each raises a ``TreeDGSError`` for what would end the job. Those of the first stage come before anything is
    read, the others' before anything expensive. cost: what the stage needs; says what the dry run finds. That of the
    first stage reads what the checks of the others need. key: what the outcome depends on; a stage of the same key
    whose outputs are as it left them is kept. outputs: files that it leaves. load: into the job, what later stages
    need of the outputs. wanted: whether it runs at all. readable: for outputs that people may edit: raises where they
    cannot be used any more. always: never kept.
    """

    name: str
    share: float
    run: Callable[[J, Collector], dict[str, Any] | None]
    checks: tuple[Callable[[J], object], ...] = ()
    cost: Callable[[J, Findings], Cost] = lambda _job, _findings: Cost()
    key: Callable[[J], Key] = lambda _job: Key()
    outputs: Callable[[J], list[Path]] = lambda _job: []
    load: Callable[[J, dict[str, Any]], None] = lambda _job, _result: None
    wanted: Callable[[J], bool] = lambda _job: True
    readable: Callable[[J], object] | None = None
    always: bool = False


class NotKept(InputError):
    """A stage would have to be done again."""


class Steps:
    """Runs stages one after the other; the key of a stage covers everything before it.

    space: where finished stages are kept; without one nothing is. shares: stage -> share of the run's time. only_kept:
    nothing is done again; a stage that would have to be is an error.
    """

    def __init__(
        self, space: Workspace | None, reporter: Reporter, shares: dict[str, float], only_kept: bool = False
    ) -> None:
        self.space, self.reporter, self.only_kept = space, reporter, only_kept
        self._key, self._at = "", 0.0
        self._left = dict(shares)
        self.warnings: list[str] = []
        #: Stage -> name of the run by its inputs and settings up to there: the same inputs give the same.
        self.run_ids: dict[str, str] = {}
        #: Stage -> seconds and peak memory.
        self.done: dict[str, dict[str, Any]] = {}

    def weigh(self, name: str, factor: float) -> None:
        """The stage ``name``, still to come, takes ``factor`` times longer than usual: the progress bar knows it."""
        if name in self._left:
            self._left[name] *= factor

    def skip(self, name: str) -> None:
        """The stage ``name`` will not run: the progress bar does not wait for it."""
        self._left.pop(name, None)

    def run(self, stage: Stage[J], job: J) -> dict[str, Any]:
        """Do the stage unless it is done already; returns its (JSON) result.

        Raises:
            NotKept: the stage would have to be done again, and only kept ones are wanted.
        """
        name, key, outputs, space = stage.name, stage.key(job), stage.outputs(job), self.space
        share = self._left.pop(name)
        high = min(self._at + (1.0 - self._at) * share / (share + sum(self._left.values())), 1.0)
        if space is None:
            collector, began = Collector(self.reporter), time.monotonic()
            with self.reporter.stage(name, self._at, high):
                found = stage.run(job, collector) or {}
            self.done[name] = {"seconds": time.monotonic() - began, "peak_memory_mb": peak_memory_mb()}
            self._at, self.warnings = high, self.warnings + collector.warnings
            release_memory()
            return found
        contents = fingerprint(key.files)
        self.run_ids[name] = short_hash(__version__, *list(self.run_ids.values())[-1:], key.settings, contents)
        # The same folder by another name is no reason to do a stage again.
        absolute = {k: os.path.abspath(v) if isinstance(v, Path) else v for k, v in key.settings.items()}
        self._key = short_hash(__version__, self._key, absolute, contents)
        plain = json.loads(json.dumps(key.settings, default=str))
        with self.reporter.stage(name, self._at, high):
            if not stage.always and self._is_kept(space, stage, job, outputs):
                self.reporter.info(f"{name}: unchanged since the last run, kept")
                found = space.result(name)
            elif self.only_kept:
                raise NotKept(
                    f"{space.folder}: the stage {name} of its run is not finished with these inputs, settings "
                    "and this version; run photos-to-dbh with them once without --at, then give the points again."
                )
            else:
                collector = Collector(self.reporter)
                edited = outputs if stage.readable else []
                with space.running(name, self._key, plain, outputs, edited) as found:
                    found.update(stage.run(job, collector) or {})
                    found["warnings"] = list(dict.fromkeys(collector.warnings))
        # A stage done again may come out otherwise: what follows depends on what is there, not on what was asked for.
        self._key = short_hash(self._key, space.output_hashes(name))
        self._at = high
        self.warnings += found.get("warnings", [])
        release_memory()
        return found

    def _is_kept(self, space: Workspace, stage: Stage[J], job: J, outputs: list[Path]) -> bool:
        if not space.ran(stage.name, self._key):
            return False
        problem = space.damage(stage.name, outputs)
        aside = ""
        try:
            if stage.readable is not None and not problem:
                stage.readable(job)
        except TreeDGSError as trouble:
            problem = str(trouble)
            aside = "".join(f" The file is kept as {move_aside(path).name}." for path in outputs)
        if problem:
            self.reporter.warn(f"{problem.rstrip('.')}; the stage {stage.name} is done again.{aside}")
        return not problem


def check(stage: Stage[J], job: J) -> None:
    """Say what would end the job at this stage.

    Raises:
        TreeDGSError: the first trouble.
    """
    for one in stage.checks:
        one(job)


def run_stages(stages: Sequence[Stage[J]], job: J, steps: Steps) -> None:
    """Do a checked first stage, check the others, do them; what is kept is not done again.

    Raises:
        TreeDGSError: an input that cannot be used, with what to do about it.
    """
    for number, stage in enumerate(stages):
        if number == 1:
            for other in stages[1:]:
                check(other, job)
        if not stage.wanted(job):
            steps.skip(stage.name)
            continue
        stage.load(job, steps.run(stage, job))


class Findings(Collector):
    """Hears a dry run: what is wrong (the job would fail), and the warnings: what may cost accuracy or trees. facts:
    figures for the result."""

    def __init__(self, inner: Reporter) -> None:
        super().__init__(inner)
        self.problems: list[str] = []
        self.facts: dict[str, Any] = {}

    def problem(self, sentence: str) -> None:
        """Something that has to be corrected first."""
        self.problems.append(sentence)
        self._inner.warn(sentence)


def dry_run(stages: Sequence[Stage[J]], job: J, findings: Findings, folder: Path) -> dict[str, Any]:
    """What the run would meet and need, machine against cost, the verdict; nothing is written. folder: where it needs
    disk.

    Raises:
        InputError: something that would end the run; all of it was reported, the first one is the sentence.
    """
    import psutil

    total = Cost()
    for at, stage in enumerate(stages):
        for one in stage.checks:
            try:
                one(job)
            except TreeDGSError as problem:
                findings.problem(str(problem))
        with findings.stage(stage.name, at / len(stages), (at + 1) / len(stages)):
            total += stage.cost(job, findings)
    place = existing(folder)
    memory, disk = psutil.virtual_memory().available / 1e9, shutil.disk_usage(place).free / 1e9
    findings.info(
        f"Memory: about {total.memory_gb:.1f} GB needed, {memory:.1f} GB free. Disk: about {total.disk_gb:.1f} GB "
        f"needed, {disk:.0f} GB free at {place}. Time: {total.time_text()} on {cores()} cores."
    )
    if memory < total.memory_gb:
        findings.warn(
            f"About {total.memory_gb:.1f} GB of memory are needed and {memory:.1f} GB are free: close other "
            "programs, or choose the preset fast or fewer photos."
        )
    if disk < total.disk_gb:
        findings.problem(
            f"{place}: {disk:.1f} GB of disk are free, about {total.disk_gb:.1f} GB are needed; "
            "make room or choose a workspace on another disk."
        )
    if findings.problems:
        more = f" (and {len(findings.problems) - 1} more, above)" if len(findings.problems) > 1 else ""
        raise InputError(f"{findings.problems[0]}{more}")
    status = f"ready: {total.time_text()}" + (
        f"; {len(findings.warnings)} warnings, see above" * bool(findings.warnings)
    )
    findings.info(f"Dry run: {status}. Nothing was written.")
    return {
        **findings.facts,
        "predicted_s": round(total.seconds),
        "needed_memory_gb": round(total.memory_gb, 1),
        "needed_disk_gb": round(total.disk_gb, 1),
        "status": status,
    }


def check_target(target: Path) -> None:
    """Without making the folder: the nearest one that exists has to be writable; nobody edits the layer.

    Raises:
        TreeDGSError: a name that no file can have, a folder that cannot be written, an open edit session.
    """
    check_name(target)
    folder = existing(target.parent)
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise InputError(f"{target}: the folder {folder} cannot be written; choose another output folder.")
    ensure_unlocked(target, OWN_LAYERS)


def existing(path: Path) -> Path:
    """The path, or the nearest folder above it that is there."""
    path = Path(path).absolute()
    while not os.path.exists(path) and path != path.parent:
        path = path.parent
    return path
